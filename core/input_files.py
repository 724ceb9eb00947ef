"""Reading a file that somebody else wrote: bounded in size, decoded, and never anything but an InputError."""

import os
from dataclasses import dataclass
from pathlib import Path

from core.errors import InputError

MEGABYTE = 1_000_000


@dataclass(frozen=True)
class InputText:
    """A text file as it was read."""

    path: Path
    data: bytes
    """Its bytes, for the digest."""
    text: str
    """Its text, without a byte order mark."""


def read_text(path: Path, limit_bytes: int, error: type[InputError]) -> InputText:
    """A UTF-8 text file, with or without byte order mark.

    Raises:
        error: the file is missing, empty, larger than the limit, not UTF-8, or holds NUL bytes.
    """
    return decoded(path, _read_bytes(path, limit_bytes, error), error)


def decoded(path: Path, data: bytes, error: type[InputError]) -> InputText:
    """The text of a file whose bytes are at hand; ``path`` is what messages call it.

    Raises:
        error: it is empty, not UTF-8, or holds NUL bytes.
    """
    if not data:
        raise error(f"{path} is empty (0 bytes)")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as wrong:
        line = data.count(b"\n", 0, wrong.start) + 1
        raise error(
            f"{path}, line {line}: byte {data[wrong.start]:#04x} at offset {wrong.start} is not UTF-8 text"
        ) from None
    if "\0" in text:
        line = data.count(b"\n", 0, data.index(b"\0")) + 1
        raise error(f"{path}, line {line}: holds a NUL byte, expected plain UTF-8 text")
    return InputText(path, data, text)


def inside(folder: Path, name: str, place: str, error: type[InputError]) -> Path:
    """The path of a file that another file names, which must lie in that file's folder.

    Raises:
        error: the name leads out of the folder.
    """
    path = folder / name
    root = os.path.realpath(folder)
    if not os.path.realpath(path).startswith(os.path.join(root, "")):
        raise error(f"{place} = {shown(name)} leads out of the folder {folder}, expected a file in it")
    return path


def shown(value: object) -> str:
    """A value as a message shows it: quoted, on one line, cut where it is long."""
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:40]}...{text[-10:]}"


def one_line(text: str) -> bool:
    """Whether a name can stand in a message: one line, no control characters, at most 200 characters."""
    return len(text) <= 200 and len(text.splitlines()) <= 1 and all(c >= " " and c != "\x7f" for c in text)


def _read_bytes(path: Path, limit_bytes: int, error: type[InputError]) -> bytes:
    try:
        if path.exists() and not path.is_file():
            raise error(f"{path} is not a file")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            data = file.read(limit_bytes + 1) if size <= limit_bytes else b""
    except FileNotFoundError:
        raise error(f"{path} is missing") from None
    except (OSError, ValueError) as wrong:
        reason = getattr(wrong, "strerror", None) or str(wrong)
        raise error(f"{path} cannot be read: {reason}") from None
    if max(size, len(data)) > limit_bytes:
        raise error(
            f"{path} has {max(size, len(data)) / MEGABYTE:.1f} MB, expected at most {limit_bytes / MEGABYTE:g} MB"
        )
    return data
