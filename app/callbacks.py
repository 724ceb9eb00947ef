"""Callbacks of the page that act at once, past the queue of jobs: what goes wrong in them is a sentence too.

viser (1.1.1) prints the trace of a callback that fails and tells nobody. All of them run in one pool of threads.
"""

from collections.abc import Callable
from concurrent.futures import Future
from typing import TYPE_CHECKING

from app.jobs import Jobs

if TYPE_CHECKING:
    import viser


def guard_callbacks(server: "viser.ViserServer", say: Callable[["viser.ClientHandle", str], None]) -> None:
    """Have every callback's failure told to the browser that caused it, and its trace written to the log.

    Args:
        say: tells a browser a sentence.
    """
    pool = server._thread_executor
    submit = pool.submit

    def guarded(callback: Callable[..., object], *arguments: object) -> Future[None]:
        client = getattr(arguments[0], "client", None) if arguments else None

        def report(sentence: str) -> None:
            if client is not None:
                say(client, sentence)

        return submit(Jobs.at_once, lambda: callback(*arguments), report)

    pool.submit = guarded
