"""What the shots of a session say so far, before anything is solved: axes, where the next target will be seen."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.base_placement import Placement, place_base
from core.calibration import Calibration
from core.geometry import Array, Line, invert, transform
from core.kinematics import link_frames, nominal_net
from core.live_sweep import LiveSweep, carried_point, expected_point, live_sweep, place_std_at
from core.phi_model import from_axes
from core.robot import Robot
from core.session_plan import Step
from core.session_state import Shot, State

INSTRUMENT_HEIGHT_M = 1.5
_SYMMETRIC = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


@dataclass(frozen=True)
class SweepSoFar:
    """A sweep as far as it is measured."""

    joint: int
    sweep: int
    live: LiveSweep
    shots: tuple[Shot, ...]
    """Those that the axis rests on, in the order of measurement."""

    @property
    def points_m(self) -> Array:
        """The shots, (k, 3)."""
        return np.array([shot.taken.point_m for shot in self.shots]).reshape(-1, 3)

    @property
    def target(self) -> np.ndarray:
        """Index of the target of each shot, by names in alphabetical order, as in the fit, integer (k,)."""
        return np.unique([shot.taken.target for shot in self.shots], return_inverse=True)[1].astype(int)

    @property
    def commanded(self) -> Array:
        """Commanded displacement of the joint at each shot, rad or m, (k,)."""
        return np.array([shot.taken.commanded[self.joint - 1] for shot in self.shots])


@dataclass(frozen=True)
class Expected:
    """About where the target of the next shot will be seen."""

    point_m: Array
    """In the instrument's frame, (3,)."""
    axis: Array
    """Direction of the axis about or along which it moves, (3,)."""
    by_sweep: bool
    """Whether the axis of this sweep so far says so; else the nominal arm, which may be millimetres off."""


def sweep_so_far(state: State, joint: int, sweep: int) -> SweepSoFar:
    """The axis of a sweep so far, from the shots that count and show this joint alone."""
    links, robot = state.target_links, state.robot
    alone = robot is None or robot.coupling_from(joint) is None
    shots = []
    for shot in state.shots:
        if shot.counts and shot.taken.point_m is not None and (shot.taken.joint, shot.taken.sweep) == (joint, sweep):
            link = links.get(shot.taken.target, 0)
            if link == joint or (alone and link > joint):
                shots.append(shot)
    names = [shot.taken.target for shot in shots]
    live = live_sweep(
        np.array([shot.taken.point_m for shot in shots]).reshape(-1, 3),
        np.array([shot.taken.commanded[joint - 1] for shot in shots]),
        sliding=robot is not None and bool(robot.sliding[joint - 1]),
        target=np.unique(names, return_inverse=True)[1] if names else None,
        covariance_m2=_covariances(shots, state.instrument.sigma_m),
    )
    return SweepSoFar(joint, sweep, live, tuple(shots))


def base_so_far(state: State, sweeps: Callable[[int, int], SweepSoFar] | None = None) -> Placement:
    """Where the robot's base stands, by the axes of all sweeps so far.

    Args:
        state: of the session.
        sweeps: gives the sweep of a joint and a number, where somebody keeps them; None: they are fitted.
    """
    robot = state.robot
    nominal, found, sliding = [], [], []
    if robot is not None:
        for joint, sweep in dict.fromkeys((row.joint, row.sweep) for row in state.plan.sweeps):
            so_far = sweep_so_far(state, joint, sweep) if sweeps is None else sweeps(joint, sweep)
            if so_far.live.fit is not None:
                frames = link_frames(robot, _net(state, robot, so_far.shots[0].taken.commanded)[None])[0]
                axis = frames[joint - 1]
                nominal.append(Line(axis[:3, 3], axis[:3, 2]))
                found.append(so_far.live.fit.line)
                sliding.append(bool(robot.sliding[joint - 1]))
    if robot is None or found:
        return place_base(nominal, found, sliding)
    return Placement(transform(np.eye(3), _rough_place(state, robot)), False)


def _rough_place(state: State, robot: Robot) -> Array:
    """Where the base may stand as long as no axis is known, (3,): so that the end of the arm is where a target was."""
    seen = (s for s in state.shots if s.counts and s.taken.point_m and state.target_links.get(s.taken.target))
    shot = next(seen, None)
    reach = float(np.linalg.norm(robot.link_transforms[:, :3, 3], axis=1).sum())
    if shot is None:
        # In front of the instrument, on the floor under it.
        return np.array([1.0 + 1.5 * reach, 0.0, -INSTRUMENT_HEIGHT_M])
    frames = link_frames(robot, _net(state, robot, shot.taken.commanded)[None])[0]
    return np.array(shot.taken.point_m) - frames[state.target_links[shot.taken.target], :3, 3]


def base_of(found: Calibration) -> Array | None:
    """Where a calibration has the nominal robot's base frame, in the instrument's frame, (4, 4); None: not known."""
    geometry = found.estimate.geometry
    if geometry is None or found.convention is None:
        return None
    nominal, _ = from_axes(found.campaign.robot.axes_at_zero(), found.convention)
    return geometry.base @ invert(nominal)


def expected_place(state: State, step: Step, so_far: SweepSoFar, base: Array | None) -> Expected | None:
    """About where the target of a step will be seen; None: it cannot be told yet.

    Args:
        so_far: the sweep of the step.
        base: from the robot's base frame to the instrument's, (4, 4); None: not known.
    """
    last = next((shot for shot in reversed(so_far.shots) if shot.taken.target == step.target), None)
    if so_far.live.fit is not None and last is not None:
        way = step.commanded[step.joint - 1] - last.taken.commanded[step.joint - 1]
        fit = so_far.live.fit
        return Expected(expected_point(fit, np.array(last.taken.point_m), way), fit.line.direction, True)
    robot = state.robot
    if base is None or robot is None:
        return None
    after = _net(state, robot, step.commanded)
    frames = base @ link_frames(robot, after[None])[0]
    place = _by_the_arm(state, robot, step, base, after)
    return None if place is None else Expected(place, frames[step.joint - 1][:3, 2], False)


def tool_place_std_m(state: State, so_far: SweepSoFar) -> float | None:
    """Standard uncertainty of a sweep's axis where it passes the tool; None: no axis, or no target on the last link.

    The tool is taken to be where a target on the last link was seen last.
    """
    fit = so_far.live.fit
    if fit is None or fit.sliding or state.robot is None:
        return None
    links, last_link = state.target_links, state.robot.joint_count
    seen = (s for s in reversed(state.shots) if links.get(s.taken.target) == last_link and s.taken.point_m is not None)
    shot = next(seen, None)
    return None if shot is None else place_std_at(fit, np.array(shot.taken.point_m)) * fit.noise_factor


def _by_the_arm(state: State, robot: Robot, step: Step, base: Array, after: Array) -> Array | None:
    """Where the nominal arm carries the target from where it was seen last, or has it by its known place."""
    target = next((target for target in state.targets if target.name == step.target), None)
    if target is None:
        return None
    seen = (s for s in reversed(state.shots) if s.counts and s.taken.target == target.name and s.taken.point_m)
    shot = next(seen, None)
    if shot is not None:
        before = _net(state, robot, shot.taken.commanded)
        return carried_point(robot, base, target.link, np.array(shot.taken.point_m), before, after)
    if target.point_m is None or target.link == 0:
        return None
    frame = base @ link_frames(robot, after[None])[0, target.link - 1]
    return frame[:3, :3] @ np.array(target.point_m) + frame[:3, 3]


def _net(state: State, robot: Robot, commanded: tuple[float, ...]) -> Array:
    home = np.zeros(robot.joint_count) if state.plan.home is None else np.array(state.plan.home)
    return nominal_net(robot, np.array(commanded) - home)[0]


def _covariances(shots: list[Shot], sigma_m: float | None) -> Array | None:
    """Of each shot its own, else what the instrument promises, (k, 3, 3); None where nothing is stated."""
    if not shots or (sigma_m is None and any(shot.taken.covariance_m2 is None for shot in shots)):
        return None
    promised = (0.0 if sigma_m is None else sigma_m**2) * np.array([1.0, 0, 0, 1.0, 0, 1.0])
    stated = [promised if shot.taken.covariance_m2 is None else shot.taken.covariance_m2 for shot in shots]
    return np.array(stated)[:, _SYMMETRIC]
