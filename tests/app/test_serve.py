"""``trueaxis serve`` refuses in one sentence what it cannot do, before anything is made."""

import socket
import sqlite3
from pathlib import Path

import pytest

from core.session import Session
from core.session_entries import SESSION_FORMAT
from core.session_store import SUFFIX
from tests.app.command_line import assert_refused, contents, trueaxis


@pytest.fixture
def newer(tmp_path: Path) -> Path:
    """A session that a newer program wrote."""
    path = tmp_path / f"newer{SUFFIX}"
    Session.create(path, by="A. Operator").close()
    connection = sqlite3.connect(path)
    connection.execute(f"PRAGMA user_version = {SESSION_FORMAT + 1}")
    connection.close()
    return path


def test_a_session_of_a_newer_program_is_refused_and_left_alone(newer: Path) -> None:
    before = contents(newer.parent)
    assert_refused(trueaxis("serve", newer, "--port", 0), newer.name, "was written by a newer trueaxis")
    assert contents(newer.parent) == before


def test_a_port_that_is_in_use_is_named(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = trueaxis("serve", "--port", port, "--sessions", tmp_path)
    assert_refused(done, f"--port {port}", "in use", "expected a free port")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--port", 99999), "--port 99999: expected 0 to 65535"),
        (("--host", "nowhere.invalid"), "--host nowhere.invalid"),
        (("no-such.trueaxis",), "no-such.trueaxis"),
    ],
)
def test_an_address_or_a_session_that_cannot_be_is_refused(tmp_path: Path, arguments: tuple, words: str) -> None:
    assert_refused(trueaxis("serve", *arguments, "--sessions", tmp_path), words)


def test_a_folder_for_sessions_that_cannot_be_made_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    done = trueaxis("serve", "--port", 0, "--sessions", tmp_path / "file")
    assert_refused(done, "expected a folder for sessions that can be written")
