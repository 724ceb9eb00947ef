"""Circle-point analysis: each joint axis from the arc on which it alone moves a target, drives taken at their word.

``plane_and_circle``: a plane through the points of an arc gives the direction, a circle in it the centre (Stone,
Kinematic Modeling, Identification, and Control of Robotic Manipulators, Kluwer 1987; the paper's Stone and Sanderson
1987). No commanded displacement enters the axis.

``commanded_rotations``: the points of an arc are fitted by rotations about the axis through the angles that were
commanded. That the commanded angles are trusted is what the paper says of Broderick and Cipra ("A method for
determining and correcting robot position and orientation errors due to manufacturing", ASME Journal of Mechanisms,
Transmissions, and Automation in Design 110, 1988) and of Kim 1990; how the fit is done here, by least squares over all
points of the arc, is this project's choice and no worse than theirs.

Both then take the joints to have moved as commanded, couplings with their nominal gains: neither has transmission
functions. Axes are carried back to the arm's zero about those below them.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from core.arm_jacobian import ArmState, Layout, Observations
from core.axes.plane_circle import plane_circle
from core.axes.points import sweep_points
from core.drives import coupling_functions
from core.errors import CampaignError
from core.geometry import Array, Line, invert, joint_motion, perpendicular_basis
from core.measurements import Campaign
from core.motion_forms import Direct, MotionFunction
from core.rivals.aggregate import linear_least_squares
from core.rivals.equations import PointEquations
from core.sweep_fits import SAME_COMMAND, active_from_zero

UNIT_M = 1e-3
"""All points of an arc weigh the same."""


@dataclass(frozen=True, eq=False)
class Arc:
    """What one joint alone did to targets."""

    joint: int
    """1..n."""
    sliding: np.ndarray
    """Which joints of the arm slide, (n,)."""
    net: Array
    """Nominal net displacements of all joints at every point, from the arm's zero, (k, n)."""
    target: np.ndarray
    """(k,)."""
    point_m: Array
    """(k, 3)."""

    @property
    def slides(self) -> bool:
        return bool(self.sliding[self.joint - 1])

    @property
    def displacement(self) -> Array:
        """Of the joint itself, (k,)."""
        return self.net[:, self.joint - 1]


def plane_and_circle(campaign: Campaign) -> ArmState:
    """The arm by plane and circle fits.

    Raises:
        CampaignError: a joint has no arc of its own.
        AxisUndefined: the points of an arc do not define an axis.
    """
    return _arm(campaign, _plane_circle_axis)


def commanded_rotations(campaign: Campaign) -> ArmState:
    """The arm by rotations through the commanded displacements.

    Raises:
        CampaignError: a joint has no arc of its own.
        AxisUndefined: the points of an arc do not define an axis.
        NotConverged: the fit of an axis did not settle.
    """
    return _arm(campaign, _commanded_axis)


def _arm(campaign: Campaign, axis_of: Callable[[Arc], Line]) -> ArmState:
    robot, axes = campaign.robot, []
    arcs = _arcs(campaign)
    for joint in range(1, robot.joint_count + 1):
        mine = [arc for arc in arcs if arc.joint == joint]
        if not mine:
            raise CampaignError(f"joint {joint} has no sweep with a target that moves with it alone, expected one")
        axes.append(_mean([_at_zero(axis_of(arc), arc, axes) for arc in mine]))
    direct = MotionFunction(Direct(), np.zeros(0))
    return ArmState(
        tuple(axes),
        (direct,) * robot.joint_count,
        coupling_functions(campaign, [None] * robot.joint_count),
        np.zeros((0, 3)),
    )


def _arcs(campaign: Campaign) -> list[Arc]:
    """Of every sweep the points of targets that move with its joint and with no other."""
    robot, out = campaign.robot, []
    links = np.array([target.link for target in campaign.targets])
    for sweep in campaign.sweeps:
        active = active_from_zero(campaign, sweep.commanded)[sweep.stop]
        net = active.copy()
        net[:, 1:] += robot.coupling_gains[1:] * active[:, :-1]
        link = links[sweep.target]
        alone = link == sweep.joint if robot.coupling_from(sweep.joint) else link >= sweep.joint
        if alone.any() and np.ptp(net[alone, sweep.joint - 1]) > SAME_COMMAND:
            out.append(Arc(sweep.joint, robot.sliding, net[alone], sweep.target[alone], sweep.point_m[alone]))
    return out


def _plane_circle_axis(arc: Arc) -> Line:
    points = sweep_points(arc.point_m, arc.target)
    if arc.slides:
        means = [arc.point_m[arc.target == t].mean(axis=0) for t in arc.target]
        direction = np.linalg.svd(arc.point_m - means, full_matrices=False)[2][0]
        return _in_sense(Line(arc.point_m.mean(axis=0), direction), arc)
    found = plane_circle(points, debias=False)
    return _in_sense(Line(found.point_m, found.direction), arc)


def _commanded_axis(arc: Arc) -> Line:
    """The aggregate model of an arm with one joint, from the axis by plane and circle."""
    start = _plane_circle_axis(arc)
    targets, local = np.unique(arc.target, return_inverse=True)
    first = np.array([np.argmax(local == k) for k in range(len(targets))])
    displacement = arc.displacement - arc.displacement[0]
    back = [joint_motion(start, -displacement[k], arc.slides) for k in first]
    rest = np.stack([m[:3, :3] @ arc.point_m[k] + m[:3, 3] for m, k in zip(back, first, strict=True)])
    direct = MotionFunction(Direct(), np.zeros(0))
    state = ArmState((start,), (direct,), (None,), rest)
    sliding = np.array([arc.slides])
    layout = Layout.of(state, sliding, np.ones(1, dtype=bool), np.zeros(1, dtype=bool))
    link = np.ones(len(local), dtype=int)
    seen = Observations(arc.point_m, local, link, displacement[:, None], sliding, home=False)
    equations = PointEquations.of(layout, seen, np.tile(UNIT_M**2 * np.eye(3), (len(link), 1, 1)))
    return linear_least_squares(equations, state).state.axes[0]


def _at_zero(line: Line, arc: Arc, below: list[Line]) -> Line:
    """The axis as it is when the joints below it stand at zero."""
    motion = np.eye(4)
    for k, axis in enumerate(below):
        motion = motion @ joint_motion(axis, arc.net[0, k], bool(arc.sliding[k]))
    return line.moved(invert(motion))


def _in_sense(line: Line, arc: Arc) -> Line:
    """The line with the direction in which positive commands move."""
    arm = arc.point_m - line.point_m
    if arc.slides:
        agreement = sum(
            np.cov(arm[arc.target == t] @ line.direction, arc.displacement[arc.target == t])[0, 1]
            for t in np.unique(arc.target)
        )
        return line if agreement >= 0 else Line(line.point_m, -line.direction)
    e1, e2 = perpendicular_basis(line.direction)
    angle = np.arctan2(arm @ e2, arm @ e1)
    along, against = (
        sum(abs(np.exp(1j * (angle - s * arc.displacement))[arc.target == t].sum()) for t in np.unique(arc.target))
        for s in (1, -1)
    )
    return line if along >= against else Line(line.point_m, -line.direction)


def _mean(lines: list[Line]) -> Line:
    """One axis of several sweeps of a joint."""
    points = [line.foot_of(lines[0].point_m) for line in lines]
    return Line(np.mean(points, axis=0), np.sum([line.direction for line in lines], axis=0))
