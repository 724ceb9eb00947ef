"""Work that would run in a process of its own, on a thread, where tests can put something in its way."""

import threading
from collections.abc import Callable
from multiprocessing.connection import Connection

from app.beside import at_work


class Thread(threading.Thread):
    """Looks like a process; it cannot be stopped."""

    def terminate(self) -> None:
        """Nothing."""


def started(pipe: Connection, work: Callable[..., object], arguments: tuple) -> Thread:
    """Stands in for ``app.beside.started``."""
    thread = Thread(target=at_work, args=(pipe, work, arguments), daemon=True)
    thread.start()
    return thread
