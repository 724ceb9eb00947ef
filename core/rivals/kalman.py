"""The extended Kalman filter: parameters improve with every pose that is measured, with their covariance.

Of the paper's references Whitney 1986, Trevelyan 1996 and Bay 1993; Du and Zhang, "IMU-based online kinematic
calibration of robot manipulator", The Scientific World Journal 2013 (doi 10.1155/2013/139738), filter kinematic
parameters in the same way. The parameters of an arm do not change, so the filter has no motion of its own; the
estimate is a state and the filter works on deviations from it. Each update is repeated from the corrected state (the
iterated filter, a Gauss-Newton step for step: Bell and Cathey, IEEE Transactions on Automatic Control 38, 1993,
doi 10.1109/9.250476).

A filter that begins with a nominal arm becomes over-confident: an axis that may be tilted by 50 mrad bends its arcs by
a millimetre a metre more than the linear model says, many times the noise, and the filter never looks back. So the
first standstills, twice as many equations as there are parameters, are solved together, and the filter goes on from
there; ``warm_up = 0`` leaves that out.
"""

from dataclasses import dataclass

import numpy as np

from core.arm_jacobian import ArmState
from core.errors import NotConverged
from core.estimate import axis_basis
from core.geometry import Array, Line, cross, rotation_about
from core.rivals.aggregate import MOST_ITERATIONS, SETTLED, covariance_of, solved
from core.rivals.equations import Equations

MOST_REPEATS = 5
"""Of one update."""
WORTHWHILE = 1e-6
"""An update is repeated while it changes the deviations by more than this, in units of what was known before."""


@dataclass(frozen=True)
class Prior:
    """How far an arm may be from where the filter begins: standard deviations."""

    tilt_rad: float = 0.05
    shift_m: float = 0.05
    """Of every axis: the arm's own deviations, and those of the base's first placement."""
    attachment_m: float = 0.05
    attachment_rad: float = 0.1

    def std(self, equations: Equations, state: ArmState) -> Array:
        """Standard deviations of all parameters, (size,)."""
        out = np.empty(equations.size)
        for place in equations.layout.axes:
            if place is not None:
                out[place] = [self.tilt_rad, self.tilt_rad, self.shift_m, self.shift_m][: place.stop - place.start]
        layout = equations.layout
        for functions, places in (
            (state.transmissions, layout.transmissions),
            (state.couplings, layout.couplings),
        ):
            for function, place in zip(functions, places, strict=True):
                if place is not None:
                    out[place] = function.form.prior_std()
        sits = np.full(equations.attachment, self.attachment_m)
        # Three a target are all lengths; the six of a body end with its turn.
        if equations.attachment != len(state.rest_points_m) * 3:
            sits[3:] = self.attachment_rad
        out[layout.targets.start :] = sits
        return out


@dataclass(frozen=True, eq=False)
class Filtered:
    """Where the filter ended, and how it came there."""

    state: ArmState
    covariance: Array
    """Of local deviations, (size, size)."""
    warm_up: int
    """How many standstills were solved together first."""
    innovation: Array
    """Squared innovation of every later one by its expected covariance: chi-square if all is right, (standstills,)."""
    std: Array
    """Standard deviations of the parameters after each of them, (standstills, size)."""


def kalman_filter(
    equations: Equations, start: ArmState, prior: Prior | Array | None = None, warm_up: int | None = None
) -> Filtered:
    """Filter the standstills in the order of measurement.

    Args:
        start: where the filter begins.
        prior: how far that may be wrong; an array is the covariance of the local deviations, (size, size).
        warm_up: how many standstills are solved together first; None: with twice as many equations as parameters.

    Raises:
        NotConverged: the first standstills could not be solved together.
    """
    if isinstance(prior, np.ndarray):
        covariance = prior
    else:
        covariance = np.diag((Prior() if prior is None else prior).std(equations, start) ** 2)
    first = _enough(equations) if warm_up is None else min(warm_up, equations.count)
    state = start
    if first:
        state, covariance = _together(equations.part(slice(first)), start, covariance)
    innovation, std = [], []
    for k in range(first, equations.count):
        state, covariance, square = _updated(equations.part(slice(k, k + 1)), state, covariance)
        innovation.append(square)
        std.append(np.sqrt(np.diag(covariance)))
    return Filtered(state, covariance, first, np.array(innovation), np.array(std).reshape(-1, equations.size))


def _enough(equations: Equations) -> int:
    each = len(equations.part(slice(1)).whitener[0])
    return min(int(np.ceil(2 * equations.size / each)), equations.count)


def _together(first: Equations, start: ArmState, prior: Array) -> tuple[ArmState, Array]:
    """The most probable state by some standstills and the prior, and its covariance: Gauss-Newton."""
    scale = np.sqrt(np.diag(prior))
    pull = np.linalg.inv(np.linalg.cholesky(prior / scale[:, None] / scale)) / scale
    state, deviation = start, np.zeros(first.size)
    for _ in range(MOST_ITERATIONS):
        found = first.evaluate(state)
        whole = np.concatenate([found.jacobian, pull])
        step = solved(whole, np.concatenate([found.residual, -pull @ deviation]))
        state, deviation = first.moved(state, step), deviation + step
        if np.abs(step).max() < SETTLED:
            return state, covariance_of(whole)
    raise NotConverged(f"the first {first.count} standstills of the filter were not solved in {MOST_ITERATIONS} steps")


def _updated(one: Equations, prior_state: ArmState, prior: Array) -> tuple[ArmState, Array, float]:
    """State, covariance and squared innovation after one standstill."""
    scale = np.sqrt(np.maximum(np.diag(prior), 1e-300))
    state, deviation, square = prior_state, np.zeros(one.size), 0.0
    for repeat in range(MOST_REPEATS):
        found = one.evaluate(state)
        spread = found.jacobian @ prior
        expected = spread @ found.jacobian.T + np.eye(len(found.residual))
        gain = np.linalg.solve(expected, spread).T
        if repeat == 0:
            square = float(found.residual @ np.linalg.solve(expected, found.residual))
        better = gain @ (found.residual + found.jacobian @ deviation)
        change = np.abs((better - deviation) / scale).max()
        deviation = better
        state = one.moved(prior_state, deviation)
        if change < WORTHWHILE:
            break
    # Joseph's form stays symmetric and positive whatever is rounded.
    keep = np.eye(one.size) - gain @ found.jacobian
    covariance = keep @ prior @ keep.T + gain @ gain.T
    carry = _carried(one, prior_state, state)
    return state, carry @ covariance @ carry.T, square


def _carried(one: Equations, before: ArmState, after: ArmState) -> Array:
    """From deviations about one state to those about another: the bases of the axes turn with their directions."""
    carry = np.eye(one.size)
    for place, old, new in zip(one.layout.axes, before.axes, after.axes, strict=True):
        if place is not None:
            turn = axis_basis(new.direction) @ (_shortest_turn(old, new) @ axis_basis(old.direction).T)
            carry[place, place] = np.kron(np.eye((place.stop - place.start) // 2), turn)
    return carry


def _shortest_turn(old: Line, new: Line) -> Array:
    """The smallest rotation from one direction to another, (3, 3)."""
    normal = cross(old.direction, new.direction)
    sine = float(np.sqrt(normal @ normal))
    if sine < 1e-15:
        return np.eye(3)
    return rotation_about(normal / sine, np.arctan2(sine, old.direction @ new.direction))
