"""Fit a family of motion functions to observed displacements, and choose among families by evidence.

The observed displacement m_j of a stop is off by its own noise and by the error eps of the axis, which pulls all stops
of a sweep the same smooth way (a shift of the axis looks like a first harmonic). Both are in the fit, so that neither
the constants nor their uncertainties nor the choice of a family are misled:

    minimise  sum_j w_j [y_j - f(m_j + start_s) - level_s - g_j' eps_s + f0]^2 + sum_s eps_s' C_s^-1 eps_s

over the constants of f, eps_s, and one free number of each sweep: where it began (``start``, transmissions: only motion
since the first stop is seen) or what it began with (``level``, couplings: only the passive motion since the first stop
is seen). f0 is f(0) where the arm's marks define zero (``home``), else 0.

Families compete by their evidence (marginal likelihood, by Laplace's approximation) under a Gaussian prior about a
perfect drive, of the size that errors of real drives have (``MotionForm.prior_std``):

    -2 ln Z = chi^2 + penalty at the best constants + ln det(1 + S F S) - 2 ln(prior odds)

with S the prior's standard deviations and F the information of the constants. A constant that the stops cannot pin down
costs as much as it gains, so that nothing is over-fitted (MacKay 1992, doi 10.1162/neco.1992.4.3.415). Of families that
the stops cannot tell apart the one with the fewest constants is taken, and it is said. The prior takes part in the
choice alone: the chosen family is then fitted without it.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import NotConverged
from core.geometry import Array
from core.motion_forms import MotionForm

TELLING = 0.1
"""A family is ruled out where it is less probable than this share of the best."""


@dataclass(frozen=True)
class SweepCurve:
    """What one sweep shows of a function: y against displacement."""

    displacement: Array
    """Observed displacement from the first stop, rad or m, (stops,)."""
    y: Array
    """What the function maps it to, counted from the same zero in all sweeps, (stops,)."""
    std: Array
    """Standard deviation of y - f(displacement) by the noise of single stops, (stops,)."""
    axis_effect: Array
    """Change of what is seen of f by errors of the axis, (stops, e)."""
    axis_covariance: Array
    """Of those errors, (e, e)."""


@dataclass(frozen=True)
class Candidate:
    """One family in the competition."""

    name: str
    constants: int
    rms: float
    """Root mean square residual, rad (m)."""
    chi_square: float
    probability: float
    """Among the families tried, prior odds included."""


@dataclass(frozen=True)
class FunctionFit:
    """A fitted function: its constants with covariance, where each sweep began, and what is left."""

    form: MotionForm
    coefficients: Array
    """(p,)."""
    covariance: Array
    """Of the constants, (p, p)."""
    start: Array
    """The free number of each sweep: displacement (or value) at its first stop, from zero, (sweeps,)."""
    residual: tuple[Array, ...]
    """y - f at the stops of each sweep."""
    rms_before: float
    """Root mean square of y minus displacement, best constant taken off: the error before the fit."""
    rms_after: float
    chi_square: float
    candidates: tuple[Candidate, ...] = ()
    reason: str = ""
    """Why this family, in a sentence."""

    @property
    def std(self) -> Array:
        """Standard uncertainties of the constants, (p,)."""
        return np.sqrt(np.diag(self.covariance))


def fit_function(
    form: MotionForm,
    curves: tuple[SweepCurve, ...],
    *,
    home: bool = False,
    level: bool = False,
    nominal_slope: float = 1.0,
    prior: bool = False,
) -> FunctionFit:
    """Fit one family to the curves of one joint, by Gauss-Newton.

    Args:
        form: the family.
        curves: one for each sweep.
        home: whether y counts from the value at zero displacement, f(0).
        level: whether a sweep's free number is the value at its first stop, not the displacement.
        nominal_slope: slope of the function of a perfect drive, for the error before the fit.
        prior: whether the constants are held near those of a perfect drive, as the evidence supposes.

    Raises:
        NotConverged: the iteration did not end.
    """
    p, s = len(form.coefficient_names), len(curves)
    coefficients = form.start()
    start = np.array([np.mean(c.y - nominal_slope * c.displacement) for c in curves])
    if not level:
        start = start / nominal_slope
    axis = [np.zeros(len(c.axis_covariance)) for c in curves]
    for _ in range(60):
        normal, gradient, chi_square, residual = _normal_equations(
            form, curves, (home, level), coefficients, start, axis
        )
        if prior:
            precision = 1.0 / form.prior_std() ** 2
            normal[range(p), range(p)] += precision
            gradient[:p] -= precision * (coefficients - form.start())
            chi_square += float(precision @ (coefficients - form.start()) ** 2)
        scale = 1.0 / np.sqrt(np.diag(normal))
        step = np.linalg.lstsq(normal * scale[:, None] * scale, gradient * scale, rcond=1e-14)[0] * scale
        coefficients, start = coefficients + step[:p], start + step[p : p + s]
        at = p + s
        for k, errors in enumerate(axis):
            axis[k] = errors + step[at : at + len(errors)]
            at += len(errors)
        if gradient @ step < 1e-6 * (1.0 + chi_square):
            covariance = np.linalg.pinv(normal * scale[:, None] * scale, rcond=1e-14, hermitian=True)
            covariance = covariance * scale[:, None] * scale
            return _function_fit(
                form, curves, coefficients, covariance[:p, :p], start, residual, chi_square, nominal_slope
            )
    raise NotConverged(f"the fit of a {form.name} function did not converge in 60 steps")


def choose_function(
    forms: tuple[tuple[MotionForm, float], ...],
    curves: tuple[SweepCurve, ...],
    *,
    home: bool = False,
    level: bool = False,
    nominal_slope: float = 1.0,
) -> FunctionFit:
    """Fit every family and keep the most probable.

    Args:
        forms: families with their prior odds.
        curves, home, level, nominal_slope: as for ``fit_function``.
    """
    stops = sum(len(c.y) for c in curves)
    options = {"home": home, "level": level, "nominal_slope": nominal_slope}
    fits = []
    for form, odds in forms:
        if len(form.coefficient_names) + len(curves) >= stops:
            continue
        try:
            held = fit_function(form, curves, prior=True, **options)
            fits.append((fit_function(form, curves, **options), _misfit(held) - 2 * np.log(odds)))
        except (NotConverged, np.linalg.LinAlgError):
            continue
    if not fits:
        raise NotConverged(f"none of {', '.join(f.name for f, _ in forms)} could be fitted to {stops} stops")
    score = np.array([misfit for _, misfit in fits])
    probability = np.exp(-0.5 * (score - score.min()))
    probability /= probability.sum()
    candidates = tuple(
        Candidate(fit.form.name, len(fit.coefficients), fit.rms_after, fit.chi_square, float(chance))
        for (fit, _), chance in zip(fits, probability, strict=True)
    )
    possible = [k for k in range(len(fits)) if probability[k] > TELLING * probability.max()]
    best = min(possible, key=lambda k: (candidates[k].constants, -probability[k]))
    others = [candidates[k] for k in range(len(fits)) if k != best]
    tied = [candidates[k] for k in possible if k != best]
    return replace(fits[best][0], candidates=candidates, reason=_reason(candidates[best], tied, others))


def _misfit(held: FunctionFit) -> float:
    """-2 ln of the evidence of a family, from its fit under the prior."""
    spread = held.form.prior_std()
    if len(spread) == 0:
        return held.chi_square
    return held.chi_square - float(np.linalg.slogdet(held.covariance / np.outer(spread, spread))[1])


def _normal_equations(
    form: MotionForm,
    curves: tuple[SweepCurve, ...],
    free: tuple[bool, bool],
    coefficients: Array,
    start: Array,
    axis: list[Array],
) -> tuple[Array, Array, float, tuple[Array, ...]]:
    home, level = free
    p, s = len(coefficients), len(curves)
    size = p + s + sum(len(errors) for errors in axis)
    normal, gradient, chi_square, residuals = np.zeros((size, size)), np.zeros(size), 0.0, []
    at_zero, _, gradient_at_zero = form.evaluate(np.zeros(1), coefficients)
    at = p + s
    for k, (curve, errors) in enumerate(zip(curves, axis, strict=True)):
        x = curve.displacement + (0.0 if level else start[k])
        value, slope, by_coefficients = form.evaluate(x, coefficients)
        if home:
            value, by_coefficients = value - at_zero, by_coefficients - gradient_at_zero
        residual = curve.y - value - curve.axis_effect @ errors - (start[k] if level else 0.0)
        design = np.zeros((len(x), size))
        design[:, :p], design[:, p + k] = by_coefficients, 1.0 if level else slope
        here = slice(at, at + len(errors))
        design[:, here] = curve.axis_effect
        weight = 1.0 / curve.std**2
        normal += (design * weight[:, None]).T @ design
        gradient += design.T @ (weight * residual)
        prior = np.linalg.inv(curve.axis_covariance)
        normal[here, here] += prior
        gradient[here] -= prior @ errors
        chi_square += float(weight @ residual**2 + errors @ prior @ errors)
        residuals.append(residual)
        at += len(errors)
    return normal, gradient, chi_square, tuple(residuals)


def _function_fit(
    form: MotionForm,
    curves: tuple[SweepCurve, ...],
    coefficients: Array,
    covariance: Array,
    start: Array,
    residual: tuple[Array, ...],
    chi_square: float,
    nominal_slope: float,
) -> FunctionFit:
    before = [c.y - nominal_slope * c.displacement for c in curves]
    before = np.concatenate([b - b.mean() for b in before])
    return FunctionFit(
        form=form,
        coefficients=coefficients,
        covariance=covariance,
        start=start,
        residual=residual,
        rms_before=float(np.sqrt(np.mean(before**2))),
        rms_after=float(np.sqrt(np.mean(np.concatenate(residual) ** 2))),
        chi_square=chi_square,
        reason="set in the robot's description",
    )


def _reason(chosen: Candidate, tied: list[Candidate], others: list[Candidate]) -> str:
    """Why a family was chosen, in words."""
    if not others:
        return "the only family that these stops can carry"
    if tied:
        names = ", ".join(f"{c.name} {c.probability:.0%}" for c in sorted(tied, key=lambda c: -c.probability))
        mine = f"{chosen.name} {chosen.probability:.0%}"
        return f"simplest of the families that these stops cannot tell apart ({mine}, {names})"
    rival = max(others, key=lambda c: c.probability)
    odds = min(chosen.probability / max(rival.probability, 1e-300), 1e6)
    return f"most probable of {len(others) + 1} families, {odds:.3g} times more so than {rival.name}"
