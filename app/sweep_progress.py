"""The living table of sweeps: what of the plan is done, left out, or beside it."""

from dataclasses import dataclass

from core.session_plan import PlannedSweep
from core.session_state import State


@dataclass(frozen=True)
class SweepProgress:
    """One row of the living table of sweeps."""

    planned: PlannedSweep
    done: int
    """Planned shots that were taken, those left out included."""
    skipped: int
    excluded: int
    """Shots that do not count, extra ones included."""
    extra: int
    """Shots beside the plan."""
    current: bool

    @property
    def left(self) -> int:
        """Shots still to do."""
        return max(self.planned.shots - self.done - self.skipped, 0)

    @property
    def finished(self) -> bool:
        return self.left == 0


def sweep_progress(state: State) -> tuple[SweepProgress, ...]:
    """All planned sweeps with what is done of them."""
    return tuple(_row(state, planned) for planned in state.plan.sweeps)


def _row(state: State, planned: PlannedSweep) -> SweepProgress:
    sweep = planned.joint, planned.sweep
    here = [s for s in state.shots if s.superseded_by is None and (s.taken.joint, s.taken.sweep) == sweep]
    keys = {step.key for step in state.steps if step.sweep_key == sweep}
    current = state.next_step
    return SweepProgress(
        planned=planned,
        done=len(keys & state.done),
        skipped=len((keys - state.done) & state.skipped.keys()),
        excluded=sum(1 for shot in here if not shot.counts),
        extra=sum(1 for shot in here if shot.key not in keys),
        current=current is not None and current.sweep_key == sweep,
    )
