"""A plan with what it promises: which shots, how exact the arm will be, and what that saves."""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import InputError
from core.geometry import Array
from core.kinematics import active_commands
from core.measurements import SWEEP, Measurements
from core.planning.exchange import CRITERIA
from core.planning.expected_error import ExpectedError, Required, expected_error, required
from core.planning.information import fitted, information_of, whitened
from core.planning.observability import Observability, observability, scaled_singular_values
from core.planning.pose_plan import least_poses, pose_plan
from core.planning.prior import plausible_deviations
from core.planning.shots import pose_rows, shot_count, sweep_rows
from core.planning.site import Site
from core.planning.sweep_plan import least_shots, sweep_plan
from core.planning.visibility import within_limits
from core.session_plan import PlannedSweep, commands_for

KINDS = ("sweeps", "poses")
LEVER_M = 0.1
"""Of a tool whose tip counts as much as the tool's origin: what orientations weigh."""
REQUIRED_POSES = 60
MIDDLE = 0.5
"""Share of each joint's range that matters where nobody has said what does."""


@dataclass(frozen=True)
class Proposal:
    """Shots to be taken, and what to expect of a calibration by them."""

    site: Site
    kind: str
    criterion: str
    seed: int
    rows: Measurements
    """Unmeasured rows of a campaign, moves included."""
    sweeps: tuple[PlannedSweep, ...]
    """The same as sweeps; none for free poses."""
    expected: ExpectedError
    """By the Cramer-Rao bound, over the poses that matter."""
    indices: Observability
    unobservable: int

    @property
    def shots(self) -> int:
        """How many targets are sighted."""
        return shot_count(self.rows)


@dataclass(frozen=True)
class Saving:
    """A plan against the shots that would be taken without it."""

    baseline_shots: int
    baseline: ExpectedError
    equal_shots: int | None
    """The fewest planned shots from which no larger a mean error is to be expected; None: the plan is not as good."""
    seconds_a_shot: float

    @property
    def seconds(self) -> float:
        """Measuring time saved for equal accuracy."""
        return 0.0 if self.equal_shots is None else self.seconds_a_shot * (self.baseline_shots - self.equal_shots)


def propose(site: Site, kind: str, shots: int, needed: Required, seed: int = 1, criterion: str = "I") -> Proposal:
    """Choose the shots.

    Args:
        kind: ``sweeps`` of single joints, or free ``poses``.
        shots: sightings of targets.
        needed: the poses that matter.
        seed: of the search; the same seed gives the same plan.
        criterion: ``I``, the error over the poses that matter, or ``D``, all unknowns alike.

    Raises:
        InputError: no such kind or criterion, too few shots, or too little to be seen.
    """
    if kind not in KINDS or criterion not in CRITERIA:
        raise InputError(f"there is no plan of {kind!r} by {criterion!r}, expected sweeps or poses, by I or D")
    loss = needed.loss(LEVER_M) if criterion == "I" else None
    rng = np.random.default_rng(seed)
    sweeps: tuple[PlannedSweep, ...] = ()
    if kind == "sweeps":
        sweeps = sweep_plan(site, shots, rng, loss)
        rows = sweep_rows(site.robot, sweeps, tuple(target.name for target in site.targets), site.home)
    else:
        rows = pose_rows(*pose_plan(site, shots, rng, loss))
    found = information_of(site, rows)
    return Proposal(
        site=site,
        kind=kind,
        criterion=criterion,
        seed=seed,
        rows=rows,
        sweeps=sweeps,
        expected=expected_error(needed, found.covariance),
        indices=indices_of(site, rows),
        unobservable=found.unobservable,
    )


def saving(proposal: Proposal, needed: Required, baseline: Measurements, seconds_a_shot: float) -> Saving:
    """What a proposal saves against other shots, by planning again with fewer of them.

    Couplings that the other shots do not show are taken as known for these, which flatters them.
    """
    site = proposal.site
    without = expected_by(shown_by(site, baseline), baseline, needed.commanded)
    count = int(fitted(baseline).sum())
    goal = without.mean_position_m

    def is_enough(shots: int) -> bool:
        again = propose(site, proposal.kind, shots, needed, proposal.seed, proposal.criterion)
        return again.expected.mean_position_m <= goal

    low = least_of(site, proposal.kind)
    if proposal.expected.mean_position_m > goal:
        return Saving(count, without, None, seconds_a_shot)
    if is_enough(low):
        return Saving(count, without, low, seconds_a_shot)
    high = proposal.shots
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if is_enough(middle) else (middle, high)
    return Saving(count, without, high, seconds_a_shot)


def expected_by(site: Site, rows: Measurements, commanded: Array) -> ExpectedError:
    """What planned or measured shots let expect in poses of commands (k, n)."""
    return expected_error(required(site, commanded), information_of(site, rows).covariance)


def shown_by(site: Site, rows: Measurements) -> Site:
    """The same site with those couplings held at what is thought of them that the shots do not show.

    As in a calibration: sweeps show the passive motion of the next joint where a target beyond it was watched.
    """
    taken = fitted(rows)
    beyond = site.links[rows.target] > rows.joint
    joints = np.unique(rows.joint[taken & (rows.phase == SWEEP) & beyond])
    free = bool((taken & (rows.phase != SWEEP)).any())
    shown = np.isin(np.arange(site.robot.joint_count), joints) | free
    return replace(site, coupled=site.coupled & shown)


def least_of(site: Site, kind: str) -> int:
    """The fewest shots that a plan can do with."""
    return least_shots(site) if kind == "sweeps" else least_poses(site)


def indices_of(site: Site, rows: Measurements) -> Observability:
    """Observability of all unknowns, of those targets that are sighted, by planned or measured shots."""
    at = np.flatnonzero(fitted(rows))
    jacobian = whitened(site, rows.commanded[at], rows.target[at]).reshape(-1, site.layout.size)
    shown = np.abs(jacobian).max(axis=0) > 0
    shown[: site.layout.targets.start] = True
    values = scaled_singular_values(jacobian[:, shown], plausible_deviations(site)[shown])
    return observability(values, len(at))


def swept_ranges(site: Site, rows: Measurements) -> Array:
    """How far each motor was moved from the marks by sweeps, (n, 2); the middle of its range where it was not."""
    motors = active_commands(site.robot, rows.commanded) - active_commands(site.robot, site.centre)
    ranges = middle_ranges(site)
    for joint in range(1, site.robot.joint_count + 1):
        mine = motors[(rows.phase == SWEEP) & (rows.joint == joint) & fitted(rows), joint - 1]
        if len(mine):
            ranges[joint - 1] = mine.min(), mine.max()
    return ranges


def middle_ranges(site: Site) -> Array:
    """The middle half of every joint's range, from the marks, (n, 2)."""
    middle, half = site.limits.mean(axis=1), MIDDLE * np.ptp(site.limits, axis=1) / 2
    return np.stack([middle - half, middle + half], axis=1) - site.centre[:, None]


def poses_that_matter(site: Site, ranges: Array, seed: int, count: int = REQUIRED_POSES) -> Required:
    """Random poses in which the arm is to be exact.

    Args:
        ranges: of the motors from the marks, (n, 2).

    Raises:
        InputError: hardly any of them is within the limits.
    """
    rng = np.random.default_rng([seed, 1])
    motors = active_commands(site.robot, site.centre)[0] + rng.uniform(*ranges.T, (40 * count, len(ranges)))
    commanded = commands_for(site.robot, motors)
    allowed = commanded[within_limits(site, commanded)]
    if len(allowed) < count:
        raise InputError(f"{len(allowed)} of {40 * count} poses within the ranges that matter are within the limits")
    return required(site, allowed[:count])
