"""Least squares on the aggregate model: the whole arm from the errors of its end-effector.

``linear_least_squares``: the errors are set equal to the identification Jacobian times the parameters' deviations,
solved, and this is repeated from the corrected parameters until nothing changes (Mooring, Roth and Driels, Fundamentals
of Manipulator Calibration, Wiley 1991; Hollerbach and Wampler, "The calibration index and taxonomy for robot kinematic
calibration methods", International Journal of Robotics Research 15, 1996; of the paper's references Hayati 1988 and
Zhuang 1990).

``nonlinear_least_squares``: the same cost minimised over parameters of the phi-model (or any other set) by
Levenberg-Marquardt (More 1978, as MINPACK has it) with the analytic Jacobian; of the paper's references Driels and
Pathre 1991.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares

from core.arm_jacobian import ArmState
from core.errors import NotConverged
from core.geometry import Array
from core.rivals.chain_parameters import ChainParameters
from core.rivals.equations import Equations

MOST_ITERATIONS = 50
SETTLED = 1e-11
"""Largest change of any parameter, rad or m, at which the linear iteration ends."""
MOST_EVALUATIONS = 200
"""Of the Levenberg-Marquardt method."""


@dataclass(frozen=True, eq=False)
class Solution:
    """What a fit of the aggregate model found."""

    state: ArmState
    covariance: Array
    """Of the local deviations of the state, by the stated noise, (size, size)."""
    condition: float
    """Condition number of the Jacobian by the method's own parameters, its columns scaled to length 1."""
    iterations: int
    converged: bool
    parameters: Array | None = None
    """The method's own parameters, where they are not local deviations."""


def linear_least_squares(equations: Equations, start: ArmState) -> Solution:
    """Solve the linearised model again and again.

    Raises:
        NotConverged: the parameters still change after 50 times, or run away.
    """
    state = start
    for iteration in range(1, MOST_ITERATIONS + 1):
        found = equations.evaluate(state)
        if not np.isfinite(found.jacobian).all():
            break
        step = solved(found.jacobian, found.residual)
        state = equations.moved(state, step)
        if np.abs(step).max() < SETTLED:
            jacobian = equations.evaluate(state).jacobian
            return Solution(state, covariance_of(jacobian), condition_of(jacobian), iteration, True)
    raise NotConverged(f"the linearised model did not settle in {MOST_ITERATIONS} solutions")


def nonlinear_least_squares(equations: Equations, start: ArmState, chain: ChainParameters) -> Solution:
    """Levenberg-Marquardt over the parameters of a chain, constants of functions and the attachment."""
    problem = ParameterProblem(equations, start, chain)
    found = least_squares(
        problem.residual,
        np.zeros(problem.size),
        jac=problem.jacobian,
        method="lm",
        x_scale="jac",
        ftol=1e-15,
        xtol=1e-15,
        gtol=1e-15,
        max_nfev=MOST_EVALUATIONS,
    )
    state = problem.state(found.x)
    return Solution(
        state=state,
        covariance=covariance_of(equations.evaluate(state).jacobian),
        condition=condition_of(problem.jacobian(found.x)),
        iterations=int(found.nfev),
        converged=bool(found.success),
        parameters=found.x[: chain.size],
    )


class ParameterProblem:
    """The aggregate model over one vector: parameters of a chain, constants of functions, attachment."""

    def __init__(self, equations: Equations, start: ArmState, chain: ChainParameters) -> None:
        self._equations, self._start, self._chain = equations, start, chain
        layout = equations.layout
        # A shift of a sliding axis changes nothing, and is no unknown.
        self._rows = np.concatenate(
            [4 * i + np.arange(p.stop - p.start) for i, p in enumerate(layout.axes) if p is not None]
        )

    @property
    def size(self) -> int:
        return self._chain.size + self._equations.size - self._equations.functions.start

    def state(self, x: Array) -> ArmState:
        """The arm that a vector describes."""
        local = np.concatenate([np.zeros(self._equations.functions.start), x[self._chain.size :]])
        return replace(self._equations.moved(self._start, local), axes=self._chain.axes(x[: self._chain.size]))

    def residual(self, x: Array) -> Array:
        """Predicted less measured, whitened, (e,)."""
        return -self._equations.evaluate(self.state(x)).residual

    def jacobian(self, x: Array) -> Array:
        """Its derivative, (e, size)."""
        equations, k = self._equations, self._chain.size
        local = equations.evaluate(self.state(x)).jacobian
        by_chain = local[:, equations.axes] @ self._chain.by_parameters(x[:k])[self._rows]
        sits = slice(equations.functions.stop, equations.size)
        by_attachment = local[:, sits] @ equations.by_attachment(x[len(x) - equations.attachment :])
        return np.concatenate([by_chain, local[:, equations.functions], by_attachment], axis=1)


def solved(jacobian: Array, residual: Array) -> Array:
    """Least-squares solution with columns scaled alike; what the equations say nothing about stays."""
    scale = _lengths(jacobian)
    return np.linalg.lstsq(jacobian / scale, residual, rcond=1e-12)[0] / scale


def covariance_of(jacobian: Array) -> Array:
    """Covariance of parameters under whitened equations, (size, size)."""
    scale = _lengths(jacobian)
    inverse = np.linalg.pinv(jacobian / scale, rcond=1e-12) / scale[:, None]
    return inverse @ inverse.T


def condition_of(jacobian: Array) -> float:
    """Largest over smallest singular value, columns scaled to length 1; infinite where rank is lost."""
    values = np.linalg.svd(jacobian / _lengths(jacobian), compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 1e-15 * values[0] else np.inf


def _lengths(jacobian: Array) -> Array:
    lengths = np.linalg.norm(jacobian, axis=0)
    return np.where(lengths > 0, lengths, 1.0)
