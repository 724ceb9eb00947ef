"""Calibrations of simulated campaigns beside the truth that made them, for tests of recovery and coverage."""

from dataclasses import dataclass

import numpy as np

from core.calibration import calibrate
from core.estimate import ArmEstimate
from core.geometry import Array, Line
from core.parameter_covariance import FRAME, TRANSMISSION
from core.phi_model import PARAMETERS, PhiModel, from_axes, near
from core.twin.campaign import simulate_campaign, truth
from core.twin.cell import Cell, Truth


@dataclass(frozen=True)
class Comparison:
    """Errors of one estimate in units of its own standard uncertainties, by the name of the quantity."""

    names: tuple[str, ...]
    scores: Array


def true_geometry(true: Truth, estimate: ArmEstimate, convention, nominal: PhiModel) -> PhiModel:
    """The true parameters by the same convention; where it uses a point of an axis, the one that the estimate uses."""
    lines = tuple(
        Line(axis.foot_of(found.point_m), axis.direction)
        for axis, found in zip(true.arm.axes, estimate.arm.axes, strict=True)
    )
    return near(from_axes(lines, convention)[1], nominal)


def compare(estimate: ArmEstimate, true: Truth, geometry: PhiModel) -> Comparison:
    """Every uncertain parameter of an estimate against the truth."""
    names, scores = [], []

    def add(name: str, error: float, std: float) -> None:
        if std > 0:
            names.append(name)
            scores.append(error / std)

    difference = estimate.geometry.model.parameters - geometry.parameters
    for i, j in np.ndindex(difference.shape):
        add(f"frame {i + 1} {('a', 'b', 'alpha', 'theta')[j]}", difference[i, j], estimate.geometry.std[i, j])
    for kind, fits, functions in (
        ("transmission", estimate.transmissions, true.arm.transmissions),
        ("coupling", estimate.couplings, true.arm.couplings),
    ):
        for joint, (fit, function) in enumerate(zip(fits, functions, strict=True), 1):
            if fit is not None:
                for k, name in enumerate(fit.form.coefficient_names):
                    error = fit.coefficients[k] - function.coefficients[k]
                    add(f"{kind} {joint} {name}", error, fit.std[k])
    for joint, std in enumerate(estimate.offset_std):
        error = estimate.arm.transmissions[joint].offset - true.arm.transmissions[joint].offset
        add(f"offset {joint + 1}", error, std)
    return Comparison(tuple(names), np.array(scores))


def scores_over_seeds(cell: Cell | None, seeds: range) -> tuple[tuple[str, ...], Array, Array]:
    """Names of all parameters, and their errors over standard uncertainties for both estimates, (seeds, parameters)."""
    true, refined, first = truth(cell), [], []
    for seed in seeds:
        found = calibrate(simulate_campaign(seed, cell))
        for rows, estimate in ((refined, found.estimate), (first, found.joint_by_joint)):
            geometry = true_geometry(true, estimate, found.convention, found.nominal)
            rows.append(compare(estimate, true, geometry))
    names = refined[0].names
    return names, np.array([c.scores for c in refined]), np.array([c.scores for c in first])


def joint_scores(cell: Cell, seed: int) -> Array:
    """Errors of geometry and drives in independent standard deviations, (k,): standard normal if covariances are."""
    found, true = calibrate(simulate_campaign(seed, cell)), truth(cell)
    estimate = found.estimate
    geometry = true_geometry(true, estimate, found.convention, found.nominal)
    errors = []
    for one in estimate.covariance.parameters:
        if one.part == FRAME:
            row = one.number - 1, PARAMETERS.index(one.name)
            errors.append(estimate.geometry.model.parameters[row] - geometry.parameters[row])
            continue
        fits, functions = (
            (estimate.transmissions, true.arm.transmissions)
            if one.part == TRANSMISSION
            else (estimate.couplings, true.arm.couplings)
        )
        fit = fits[one.number - 1]
        k = fit.form.coefficient_names.index(one.name)
        errors.append(fit.coefficients[k] - functions[one.number - 1].coefficients[k])
    roots = estimate.covariance.roots()
    scores, *_ = np.linalg.lstsq(roots, np.array(errors), rcond=None)
    np.testing.assert_allclose(roots @ scores, errors, atol=1e-9)
    return scores
