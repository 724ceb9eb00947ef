"""What is known while measuring: each sweep's axis so far, where the base stands, where the next target will be."""

import numpy as np

from app.rigged_session import RiggedSession
from app.solving import Solving
from core.base_placement import Placement
from core.session_live import (
    Expected,
    SweepSoFar,
    base_of,
    base_so_far,
    expected_place,
    sweep_so_far,
    tool_place_std_m,
)
from core.session_state import State


class KnownSoFar:
    """Fits that are made anew with every shot."""

    def __init__(self, work: RiggedSession, solving: Solving) -> None:
        self._work, self._solving = work, solving
        self._fitted: tuple[State | None, dict[tuple[int, int], SweepSoFar]] = (None, {})

    def so_far(self, joint: int, sweep: int) -> SweepSoFar:
        """A sweep as far as it is measured; fitted once as long as nothing changes."""
        state = self._work.state
        if state is not self._fitted[0]:
            self._fitted = state, {}
        sweeps = self._fitted[1]
        if (joint, sweep) not in sweeps:
            sweeps[joint, sweep] = sweep_so_far(state, joint, sweep)
        return sweeps[joint, sweep]

    def tool_std_m(self, so_far: SweepSoFar) -> float | None:
        """How well the place of a sweep's axis is known at the tool, m; None: there is no axis or no tool yet."""
        return tool_place_std_m(self._work.state, so_far)

    def base(self) -> Placement:
        """Where the robot's base stands in the instrument's frame, as well as it is known."""
        if self._work.rig.base is not None:
            return Placement(self._work.rig.base, True)
        found = self._solving.calibration
        solved = None if found is None else base_of(found)
        return base_so_far(self._work.state, self.so_far) if solved is None else Placement(solved, True)

    def expected(self) -> Expected | None:
        """About where the target of the next shot will be; None: not known yet."""
        step, base = self._work.state.next_step, self.base()
        if step is None:
            return None
        so_far = self.so_far(step.joint, step.sweep)
        return expected_place(self._work.state, step, so_far, base.base if base.settled else None)

    def aims(self, expected: Expected | None) -> tuple[str, ...]:
        """How each theodolite is to be aimed at an expected place, in sentences; none for other instruments."""
        rig = self._work.rig
        if expected is None or rig.theodolites is None:
            return ()
        names = (name for name, _ in rig.stations)
        angles = (np.rad2deg(station.observe(expected.point_m)[0]) for station in rig.theodolites)
        return tuple(f"{name}: hz {hz:.3f}°, v {v:.3f}°" for name, (hz, v) in zip(names, angles, strict=True))
