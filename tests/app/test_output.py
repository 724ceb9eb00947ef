"""Files appear whole or not at all."""

import os
from pathlib import Path

import pytest
from command_line import contents

from app.output import OutputFile, require_writable, write_files
from core.errors import InputError

FILES = (OutputFile("a.txt", "änderung\n"), OutputFile("tables/b.csv", "1,2\n"))
WRITTEN = {"a.txt": "änderung\n".encode(), os.path.join("tables", "b.csv"): b"1,2\n"}


def test_a_new_folder_and_those_above_it_are_made(tmp_path: Path) -> None:
    write_files(tmp_path / "x" / "y", FILES)
    assert contents(tmp_path / "x" / "y") == WRITTEN
    assert [path.name for path in (tmp_path / "x").iterdir()] == ["y"]


def test_a_folder_below_the_working_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_files(Path("out"), FILES)
    write_files(Path("out"), FILES)
    assert contents(tmp_path / "out") == WRITTEN


def test_foreign_files_stay(tmp_path: Path) -> None:
    (tmp_path / "tables").mkdir()
    (tmp_path / "tables" / "mine.csv").write_text("mine")
    (tmp_path / "a.txt").write_text("old")
    write_files(tmp_path, FILES)
    assert contents(tmp_path) == {**WRITTEN, os.path.join("tables", "mine.csv"): b"mine"}


@pytest.mark.parametrize("exists", [False, True])
def test_a_full_disk_leaves_everything_as_it_was(exists: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "deep" / "out"
    if exists:
        out.mkdir(parents=True)
        (out / "a.txt").write_text("old")
    before = sorted(tmp_path.rglob("*"))
    write_bytes = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.name == "b.csv":
            raise OSError(28, "No space left on device")
        return write_bytes(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(InputError, match="out cannot be written: No space left on device"):
        write_files(out, FILES)
    assert sorted(tmp_path.rglob("*")) == before
    assert not exists or (out / "a.txt").read_text() == "old"


@pytest.mark.parametrize("blocked", ["a.txt", "tables/b.csv"])
def test_a_folder_where_a_file_must_go_stops_it_before_anything_changes(blocked: str, tmp_path: Path) -> None:
    (tmp_path / blocked).mkdir(parents=True)
    with pytest.raises(InputError, match="is a folder"):
        write_files(tmp_path, FILES)
    assert contents(tmp_path) == {}


def test_a_file_where_a_folder_must_go_stops_it_before_anything_changes(tmp_path: Path) -> None:
    (tmp_path / "tables").write_text("mine")
    with pytest.raises(InputError, match="tables is a file"):
        write_files(tmp_path, FILES)
    assert contents(tmp_path) == {"tables": b"mine"}


def test_no_permission_is_found_before_long_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != tmp_path)
    with pytest.raises(InputError, match="no permission"):
        require_writable(tmp_path / "new" / "out")
    assert contents(tmp_path) == {}


@pytest.mark.parametrize("name", ["x" * 300, "a\0b"])
def test_names_that_no_file_system_takes(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_files(tmp_path / name, FILES)
    assert contents(tmp_path) == {}
