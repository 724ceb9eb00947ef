"""Files written whole or not at all.

Everything is prepared in memory, written into a temporary folder beside its place, and moved there when all of it is on
the disk. A folder that is new appears in one go; in one that is there already each file is replaced in one go, and
what else lies in it stays as it is.
"""

import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError


@dataclass(frozen=True)
class OutputFile:
    """A file to be written."""

    name: str
    """Its path below the output folder, parted by slashes."""
    text: str


def require_writable(folder: Path) -> None:
    """Refuse an output folder that cannot be one, before long work begins.

    Raises:
        InputError: it is a file or lies below one, or nothing may be written there.
    """
    with _named(folder):
        place = folder.absolute()
        while not place.exists() and place != place.parent:
            place = place.parent
        if not place.is_dir():
            raise InputError(f"{folder} cannot be written: {place} is a file, expected a folder")
        if not os.access(place, os.W_OK | os.X_OK):
            raise InputError(f"{folder} cannot be written: no permission to write in {place}")


def write_files(folder: Path, files: tuple[OutputFile, ...]) -> None:
    """Write files into a folder, all or none; the folder and those above it are made where they are missing.

    Raises:
        InputError: the folder or one of the files cannot be written; nothing has been changed.
    """
    require_writable(folder)
    with _named(folder):
        if folder.exists():
            _replace(folder, files)
        else:
            _create(folder, files)


def _create(folder: Path, files: tuple[OutputFile, ...]) -> None:
    made = [place for place in folder.absolute().parents if not place.exists()]
    try:
        folder.absolute().parent.mkdir(parents=True, exist_ok=True)
        with _beside(folder.absolute().parent) as prepared:
            _write(prepared, files)
            os.rename(prepared, folder)
    except BaseException:
        for place in made:
            if place.is_dir() and not any(place.iterdir()):
                place.rmdir()
        raise


def _replace(folder: Path, files: tuple[OutputFile, ...]) -> None:
    for file in files:
        _require_place(folder, file)
    with _beside(folder) as prepared:
        _write(prepared, files)
        for file in files:
            place = folder / file.name
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(prepared / file.name, place)


def _require_place(folder: Path, file: OutputFile) -> None:
    place = folder / file.name
    if place.is_dir():
        raise InputError(f"{place} cannot be written: it is a folder, expected a file or nothing")
    above = place.parent
    while above != folder:
        if above.exists() and not above.is_dir():
            raise InputError(f"{place} cannot be written: {above} is a file, expected a folder or nothing")
        above = above.parent


def _write(folder: Path, files: tuple[OutputFile, ...]) -> None:
    for file in files:
        place = folder / file.name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(file.text.encode("utf-8"))


@contextmanager
def _beside(parent: Path) -> Iterator[Path]:
    """A temporary folder in the same file system, gone afterwards if it was not moved to its place."""
    prepared = parent / f".trueaxis-{secrets.token_hex(6)}"
    prepared.mkdir()
    try:
        yield prepared
    finally:
        shutil.rmtree(prepared, ignore_errors=True)


@contextmanager
def _named(folder: Path) -> Iterator[None]:
    """What the operating system refuses, said in one sentence."""
    try:
        yield
    except (OSError, ValueError) as wrong:
        reason = getattr(wrong, "strerror", None) or str(wrong)
        raise InputError(f"{folder} cannot be written: {reason}") from None
