"""From the covariance of axes to that of phi-model parameters: against numerical derivatives and simulated axes."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from random_arms import SEEDS, convention_of, random_model, random_motion

from core.errors import RobotError
from core.estimate import axis_basis
from core.geometry import Line, rotation_about
from core.phi_convention import Convention, convention_for
from core.phi_model import PhiModel, axes, from_axes, near
from core.phi_uncertainty import axes_by_parameters, geometry_from_axes
from core.twin import irb_l6, scara

ARMS = [
    (False,) * 2,
    (False,) * 4,
    (False,) * 6,
    (False, False, True, False, False),
    (False, False, False, True),
    (False, True, False),
    (True, False, False),
]


def perturbed(lines: tuple[Line, ...], change) -> tuple[Line, ...]:
    """Axes tilted and shifted, (n, 4), each at its point and in its own basis."""
    out = []
    for line, (t1, t2, s1, s2) in zip(lines, np.reshape(change, (-1, 4)), strict=True):
        e1, e2 = axis_basis(line.direction)
        turn = t1 * e2 - t2 * e1
        angle = np.linalg.norm(turn)
        direction = rotation_about(turn / angle, angle) @ line.direction if angle > 0 else line.direction
        out.append(Line(line.point_m + s1 * e1 + s2 * e2, direction))
    return tuple(out)


def parameters(lines, convention: Convention, reference: PhiModel):
    return near(from_axes(lines, convention)[1], reference).parameters.ravel()


def numerical(lines, convention, reference, h=1e-6):
    """Derivatives of all parameters by tilts and shifts of all axes, (4(n-1), 4n)."""
    columns = []
    for j in range(4 * len(lines)):
        step = np.zeros(4 * len(lines))
        step[j] = h
        ahead, behind = (parameters(perturbed(lines, s * step), convention, reference) for s in (1, -1))
        columns.append((ahead - behind) / (2 * h))
    return np.stack(columns, axis=1)


def random_covariance(rng, n, scale=1e-4):
    factor = scale * rng.normal(size=(4 * n, 4 * n + 3))
    return factor @ factor.T / (4 * n)


def assert_right(lines, convention, model, covariance):
    found = geometry_from_axes(lines, convention, covariance, model)
    jacobian = numerical(lines, convention, model)
    measured = np.repeat(~convention.sliding, 4) | (np.arange(4 * len(lines)) % 4 < 2)
    # What a sliding axis' place is said to be does not count.
    assert np.abs(jacobian[:, ~measured]).max(initial=0.0) < 1e-6
    expected = jacobian[:, measured] @ covariance[np.ix_(measured, measured)] @ jacobian[:, measured].T
    size = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(found.covariance, expected, atol=2e-4 * size.max() ** 2)
    np.testing.assert_allclose(found.std.ravel(), size, rtol=1e-3, atol=1e-4 * size.max())
    assert np.all(found.std[~convention.free] == 0.0)


@pytest.mark.parametrize("sliding", ARMS)
@given(SEEDS)
@settings(max_examples=12)
def test_covariance_against_numerical_derivatives(sliding, seed):
    rng = np.random.default_rng(seed)
    model, base = random_model(rng, sliding), random_motion(rng)
    convention = convention_of(model)
    lines = axes(model, base)
    model = from_axes(lines, convention)[1]
    assume(np.abs(np.sin(model.alpha_rad)).min() > 0.2)
    assert_right(lines, convention, model, random_covariance(rng, len(sliding)))


def test_covariance_where_the_first_axes_are_parallel_and_a_later_one_is_not():
    directions = ((0, 0, 1), (0.02, 0.01, 1), (0.1, 1, 0.02), (1, 0.05, 0.1))
    points = ((0, 0, 0), (0.4, 0, 0), (0.7, 0.1, 0.2), (0.9, 0.1, 0.2))
    lines = tuple(Line(np.array(p, float), np.array(d, float)) for p, d in zip(points, directions, strict=True))
    convention = convention_for(lines, np.zeros(4, dtype=bool))
    assert convention.heading_is_offset
    covariance = random_covariance(np.random.default_rng(5), 4)
    assert_right(lines, convention, from_axes(lines, convention)[1], covariance)


@pytest.mark.parametrize("cell", [irb_l6.cell, scara.cell])
def test_covariance_of_the_simulated_arms(cell):
    cell, rng = cell(), np.random.default_rng(2)
    nominal = cell.robot.axes_at_zero()
    convention = convention_for(nominal, cell.robot.sliding, cell.robot.phi_rad, y_reference=np.eye(3)[1])
    reference = from_axes(nominal, convention)[1]
    assert_right(cell.truth.arm.axes, convention, reference, random_covariance(rng, len(nominal)))


def test_scatter_of_simulated_axes_is_what_is_stated():
    cell, rng = irb_l6.cell(), np.random.default_rng(3)
    convention = convention_for(
        cell.robot.axes_at_zero(), cell.robot.sliding, cell.robot.phi_rad, y_reference=np.eye(3)[1]
    )
    covariance = random_covariance(rng, 6)
    lines = cell.truth.arm.axes
    found = geometry_from_axes(lines, convention, covariance, cell.nominal)
    factor = np.linalg.cholesky(covariance)
    sample = np.array(
        [parameters(perturbed(lines, factor @ rng.normal(size=24)), convention, cell.nominal) for _ in range(600)]
    )
    free = convention.free.ravel()
    np.testing.assert_allclose(sample.std(axis=0)[free], found.std.ravel()[free], rtol=0.12)
    np.testing.assert_allclose(sample.std(axis=0)[~free], 0.0, atol=1e-12)
    pulls = (sample - found.model.parameters.ravel())[:, free]
    square = np.einsum("si,ij,sj->s", pulls, np.linalg.inv(found.covariance[np.ix_(free, free)]), pulls)
    count = int(free.sum())
    assert square.mean() == pytest.approx(count, abs=3 * np.sqrt(2 * count / 600))


@pytest.mark.parametrize("sliding", ARMS[:4])
def test_axes_by_parameters_against_numerical_derivatives(sliding):
    rng = np.random.default_rng(4)
    model, base = random_model(rng, sliding), random_motion(rng)
    lines = axes(model, base)
    found = axes_by_parameters(lines, base, model)
    values = model.parameters
    for j in range(values.size):
        step = np.zeros(values.size)
        step[j] = 1e-6
        ends = []
        for sign in (1, -1):
            a, b, alpha, theta = (values + sign * step.reshape(values.shape)).T
            ends.append(axes(PhiModel(model.phi_rad, a, b, alpha, theta, model.sliding), base))
        expected = [
            axis_basis(line.direction) @ change
            for line, ahead, behind in zip(lines, *ends, strict=True)
            for change in ((ahead.direction - behind.direction) / 2e-6, (ahead.point_m - behind.point_m) / 2e-6)
        ]
        np.testing.assert_allclose(found[:, j], np.concatenate(expected), atol=1e-8)


def test_angles_are_written_near_the_nominal_ones():
    cell = irb_l6.cell()
    convention = convention_for(
        cell.robot.axes_at_zero(), cell.robot.sliding, cell.robot.phi_rad, y_reference=np.eye(3)[1]
    )
    found = geometry_from_axes(cell.truth.arm.axes, convention, np.eye(24) * 1e-12, cell.nominal)
    assert np.abs(found.model.parameters[:, 2:] - cell.nominal.parameters[:, 2:]).max() < np.deg2rad(1)
    np.testing.assert_allclose(found.model.parameters, cell.truth.phi.parameters, atol=1e-9)
    np.testing.assert_allclose(found.base, cell.truth.base, atol=1e-9)


def test_a_singular_choice_of_phi_is_refused():
    lines = (
        Line(np.zeros(3), np.eye(3)[2]),
        Line(np.array([0, 0.4, 0]), np.eye(3)[0]),
        Line(np.array([0, 0.4, 0.5]), np.eye(3)[2]),
    )
    turning, model = np.zeros(3, dtype=bool), random_model(np.random.default_rng(1), (False,) * 3)
    geometry_from_axes(lines, convention_for(lines, turning, np.array([np.pi / 2, np.pi / 2])), np.eye(12), model)
    with pytest.raises(RobotError, match="phi_2 makes Z_phi parallel"):
        geometry_from_axes(lines, convention_for(lines, turning, np.array([np.pi / 2, 0.0])), np.eye(12), model)
