"""The comparison of methods on the workbench: on demand, in a process of its own, so that nothing here waits for it."""

from collections.abc import Callable

from app.beside import Beside, Tell
from core.errors import InputError
from core.rivals.comparison import Comparison

MOST_TRIALS = 100


class CompareBench:
    """The last comparison, and the one that is being made."""

    def __init__(self) -> None:
        self.found: Comparison | None = None
        self._work = Beside("a comparison")

    @property
    def running(self) -> bool:
        """Whether a comparison is being made."""
        return self._work.running

    def compare(self, trials: int, progress: Callable[[int], None], finished: Callable[[str], None]) -> None:
        """Begin a comparison; this returns at once.

        Args:
            trials: how many simulated measurements are averaged.
            progress: told how many are done, from another thread.
            finished: told at the end, from another thread: an empty text, or why there is no comparison.

        Raises:
            InputError: one is being made already, or the number is not 1..100.
        """
        if not isinstance(trials, int) or not 1 <= trials <= MOST_TRIALS:
            raise InputError(f"{trials!r} trials, expected a whole number from 1 to {MOST_TRIALS}")

        def ended(found: Comparison | None, why_not: str) -> None:
            self.found = found or self.found
            finished(why_not)

        self._work.start(_compared, (trials,), progress, ended)

    def stop(self) -> None:
        """Give up the comparison that is being made, if any."""
        self._work.stop()


def _compared(tell: Tell, trials: int) -> Comparison:
    from core.twin.trials import compare_on_twin

    return compare_on_twin(trials, tell)
