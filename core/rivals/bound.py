"""What no unbiased method can beat: the Cramer-Rao bound of a campaign, carried to the tool at given commands.

Every measured point tells something of every parameter that moves it, weighed by its noise. The inverse of that Fisher
information bounds the covariance of all parameters; where commands bring the tool follows from them, and so does the
expected length of its error. The noise is normal and known, the families of the drive functions are known.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arm_jacobian import ArmState, Layout, Observations, moved, predict
from core.geometry import Array
from core.measurements import Campaign
from core.phi_model import frames, from_axes
from core.rivals.identified import convention_of
from core.rivals.markers import marker_moves, markers
from core.sweep_fits import active_from_zero

STEP = 1e-6
"""Of the central differences by which the last frame follows from the axes, rad or m."""
NODES = 120


@dataclass(frozen=True, eq=False)
class Bound:
    """The best that can be known of a tool's pose."""

    parameters: Array
    """Covariance of the layout's unknowns, (p, p)."""
    by_parameters: Array
    """Derivative of the tool's shift and turn in the instrument's frame, (k, 6, p)."""

    @property
    def covariance(self) -> Array:
        """Of shift and turn, (k, 6, 6)."""
        return self.by_parameters @ self.parameters @ np.swapaxes(self.by_parameters, 1, 2)

    def mean_position_m(self, repeatability_m: float = 0.0) -> float:
        """Expected length of the position error, mean over the poses; a visit's own error may be added (std)."""
        return float(mean_length(self.covariance[:, :3, :3] + repeatability_m**2 * np.eye(3)).mean())

    def mean_orientation_rad(self, repeatability_rad: float = 0.0) -> float:
        """The same of the orientation error."""
        return float(mean_length(self.covariance[:, 3:, 3:] + repeatability_rad**2 * np.eye(3)).mean())


def cramer_rao(
    campaign: Campaign, true: ArmState, layout: Layout, seen: Observations, covariance_m2: Array, commanded: Array
) -> Bound:
    """The bound of a set of points.

    Args:
        campaign: tells the robot and its marks.
        true: the arm as it is.
        layout: what is unknown of it.
        seen: what was asked of the motors for each point.
        covariance_m2: of each point, all noise included, (m, 3, 3).
        commanded: commands whose tool poses are judged, (k, n).
    """
    jacobian = predict(true, seen, layout).jacobian
    whitened = np.linalg.inv(np.linalg.cholesky(covariance_m2)) @ jacobian
    information = whitened.reshape(-1, layout.size).T @ whitened.reshape(-1, layout.size)
    scale = 1.0 / np.sqrt(np.diag(information))
    parameters = np.linalg.inv(information * scale[:, None] * scale) * scale[:, None] * scale
    return Bound(parameters, _tool_by_parameters(campaign, true, layout, commanded))


def mean_length(covariance: Array) -> Array:
    """Mean length of normal vectors of mean zero with covariances (..., 3, 3).

    By E sqrt(Q) = 1 / sqrt(pi) integral of (1 - E exp(-Q u^2)) / u^2 du over u > 0, u = tan(v) over the vector's size.
    """
    values = np.maximum(np.linalg.eigvalsh(covariance), 0.0)
    size = np.sqrt(np.maximum(values.sum(axis=-1), 1e-300))
    node, weight = np.polynomial.legendre.leggauss(NODES)
    v, weight = np.pi / 4 * (node + 1), np.pi / 4 * weight
    share = values / size[..., None] ** 2
    decay = np.prod(1 + 2 * share[..., None] * np.tan(v) ** 2, axis=-2) ** -0.5
    return size / np.sqrt(np.pi) * ((1 - decay) / np.sin(v) ** 2 @ weight)


def _tool_by_parameters(campaign: Campaign, true: ArmState, layout: Layout, commanded: Array) -> Array:
    """Shift and turn of the tool at commands by all unknowns, (k, 6, p); the tool hangs on the last phi-frame."""
    n, count = campaign.robot.joint_count, len(commanded)
    tool = markers(_tool_at_rest(campaign, true))
    with_tool = replace(true, rest_points_m=tool)
    places = slice(layout.targets.start, layout.targets.start + 9)
    wide = replace(layout, targets=places, size=places.stop)
    seen = Observations(
        point_m=np.zeros((3 * count, 3)),
        target=np.tile(np.arange(3), count),
        link=np.full(3 * count, n),
        asked=np.repeat(active_from_zero(campaign, commanded), 3, axis=0),
        sliding=campaign.robot.sliding,
        home=campaign.home is not None,
    )
    found = predict(with_tool, seen, wide)
    flat = found.jacobian.reshape(count, 9, -1)
    moves = flat[:, :, : places.start] + flat[:, :, places] @ _tool_by_axes(campaign, true, layout)
    each = marker_moves(found.point_m.reshape(count, 3, 3))
    out = np.zeros((count, 6, layout.size))
    out[:, :, : places.start] = np.linalg.pinv(each) @ moves
    return out


def _tool_at_rest(campaign: Campaign, state: ArmState) -> Array:
    """From the tool to the instrument's frame when every joint is at zero, (4, 4)."""
    base, model = from_axes(state.axes, convention_of(campaign.robot))
    return frames(model, np.zeros(len(state.axes)), base)[-1] @ campaign.robot.link_transforms[-1]


def _tool_by_axes(campaign: Campaign, true: ArmState, layout: Layout) -> Array:
    """The tool's markers at rest by the unknowns before the targets, by central differences, (9, p)."""
    out = np.zeros((9, layout.targets.start))
    for place in layout.axes:
        for k in range(place.start, place.stop) if place is not None else ():
            step = np.zeros(layout.size)
            step[k] = STEP
            ends = [markers(_tool_at_rest(campaign, moved(true, layout, sign * step))) for sign in (1, -1)]
            out[:, k] = ((ends[0] - ends[1]) / (2 * STEP)).ravel()
    return out
