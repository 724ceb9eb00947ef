"""Who may write to a session: one process at a time, by a lock that dies with it.

The lock stands on a file beside the session (``NAME.lock``), because closing any handle of the session file itself
would drop SQLite's own locks. Inside is who holds it, for the others to read.
"""

import contextlib
import getpass
import json
import os
import socket
import time
from dataclasses import dataclass
from pathlib import Path

from core.session_entries import utc_now

try:
    import fcntl
except ImportError:  # Windows: writers are kept apart by the numbers of their events alone.
    fcntl = None  # type: ignore[assignment]


PATIENCE = 5
"""Tries: who only asks whether somebody writes holds the lock for a moment."""


class LockRefused(Exception):
    """The lock cannot be had; the message says who has it, or why not."""

    def __init__(self, why: str, in_use: bool = False) -> None:
        super().__init__(why)
        self.in_use = in_use
        """Whether another process writes to the session."""


@dataclass(frozen=True)
class WriteLock:
    """The right to write to one session file."""

    path: Path
    handle: int

    def release(self) -> None:
        """Give the right back; may be called again."""
        with contextlib.suppress(OSError):
            # Removed while still locked, so that nobody can hold a lock on a file that is gone.
            self.path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            os.close(self.handle)


def lock_for(session: Path) -> WriteLock:
    """The right to write to a session file.

    Raises:
        LockRefused: another process has it, or the folder cannot be written to.
    """
    path = session.with_name(session.name + ".lock")
    for attempt in range(PATIENCE):
        handle = _opened(path)
        try:
            if fcntl is not None:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            if _is_still(handle, path):
                _sign(handle)
                return WriteLock(path, handle)
        except BlockingIOError:
            if attempt == PATIENCE - 1:
                why = f"{_holder(handle)} is writing to it"
                os.close(handle)
                raise LockRefused(why, in_use=True) from None
            time.sleep(0.01)
        except OSError as wrong:
            os.close(handle)
            raise LockRefused(f"{path} cannot be locked ({wrong.strerror})") from None
        os.close(handle)
    raise LockRefused("another process is just closing it", in_use=True)


def _opened(path: Path) -> int:
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_CLOEXEC", 0), 0o644)
    except OSError as wrong:
        raise LockRefused(f"{path.parent} cannot be written to ({wrong.strerror})") from None


def _is_still(handle: int, path: Path) -> bool:
    """Whether the file that was locked is still the one of that name: its last holder may just have removed it."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _sign(handle: int) -> None:
    try:
        user = getpass.getuser()
    except (KeyError, OSError):
        user = "somebody"
    signature = {"pid": os.getpid(), "user": user, "host": socket.gethostname(), "since": utc_now()}
    os.ftruncate(handle, 0)
    # A full disk leaves the lock unsigned, which is no reason to refuse it.
    with contextlib.suppress(OSError):
        os.pwrite(handle, json.dumps(signature).encode(), 0)


def _holder(handle: int) -> str:
    try:
        told = json.loads(os.pread(handle, 4096, 0))
        since = str(told["since"])[:19].replace("T", " ")
        return f"process {int(told['pid'])} of {told['user']} on {told['host']} (since {since} UTC)"
    except (OSError, ValueError, KeyError, TypeError):
        return "another process"


def writer_of(session: Path) -> str | None:
    """Who is writing to a session file now; None: nobody."""
    if fcntl is None:
        return None
    try:
        handle = os.open(session.with_name(session.name + ".lock"), os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _holder(handle)
    except OSError:
        return None
    finally:
        os.close(handle)
    return None
