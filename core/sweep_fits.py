"""The first step of a calibration: the axis of every sweep, the noise of the points, and what stands out."""

from dataclasses import dataclass

import numpy as np

from core.axes import AxisFit, fit_axis
from core.errors import AxisUndefined, CampaignError, InputError
from core.geometry import Array, cross
from core.kinematics import active_commands
from core.measurements import Campaign, Sweep
from core.noise import Noise, is_stated, noise_from_scatter

SAME_COMMAND = 1e-7
"""Commands closer than this, rad or m, are the same."""


@dataclass(frozen=True)
class SweepFit:
    """One sweep with its axis, in the configuration in which it was measured."""

    sweep: Sweep
    axis_rows: np.ndarray
    """Which rows of the sweep show this joint alone: their targets move with it and with nothing else, (k,)."""
    fit: AxisFit
    """The axis from those rows, in the instrument's frame."""

    @property
    def used(self) -> np.ndarray:
        """Rows of the sweep that are fitted: all but those that stand out, boolean, (k,)."""
        used = np.ones(len(self.sweep.rows), dtype=bool)
        used[self.axis_rows] = self.fit.used
        return used


@dataclass(frozen=True)
class SweepFits:
    """All sweeps of a campaign."""

    fits: tuple[SweepFit, ...]
    noise: Noise
    not_moved: tuple[int, ...]
    """Joints that were swept in name only: their command never changed."""

    @property
    def swept(self) -> tuple[int, ...]:
        """Joints with an axis of their own, ascending."""
        return tuple(sorted({f.sweep.joint for f in self.fits}))


def fit_sweeps(campaign: Campaign, estimator: str = "likelihood", reject: bool = True) -> SweepFits:
    """Find the axis of every sweep of a campaign, and the noise of the points.

    Args:
        campaign: what was measured.
        estimator: see ``core.axes.fit_axis``.
        reject: leave out points that stand out.

    Raises:
        CampaignError: there are no sweeps, or other motors are commanded to move in one.
        AxisUndefined: the points of a sweep cannot define its axis.
    """
    moved = [s for s in campaign.sweeps if np.ptp(s.commanded[:, s.joint - 1]) > SAME_COMMAND]
    if not moved:
        raise CampaignError("the campaign holds no sweep in which a joint moves; expected rows with phase = sweep")
    for sweep in moved:
        _require_one_motor(campaign, sweep)
    rows = [_rows_of_axis(campaign, sweep) for sweep in moved]
    noise = _first_noise(moved)
    # Twice: with the noise as stated, and with the noise that the first fits show.
    for _ in range(2):
        fits = tuple(_fit(campaign, s, r, noise, estimator, reject) for s, r in zip(moved, rows, strict=True))
        noise = _noise_of(fits)
    idle = {s.joint for s in campaign.sweeps} - {s.joint for s in moved}
    return SweepFits(fits, noise, tuple(sorted(idle)))


def _first_noise(sweeps: list[Sweep]) -> Noise:
    stated = all(is_stated(sweep.covariance_m2) for sweep in sweeps)
    # Where nothing is stated any small number will do: the fits show what it should have been.
    return Noise(stated, added_m=0.0 if stated else 1e-9)


def _require_one_motor(campaign: Campaign, sweep: Sweep) -> None:
    """Only the swept joint may move, and the command of the next one that its motion couples into."""
    coupling = campaign.robot.coupling_from(sweep.joint)
    free = {sweep.joint - 1} | ({coupling.target - 1} if coupling else set())
    for k in range(campaign.robot.joint_count):
        travel = np.ptp(sweep.commanded[:, k])
        if k not in free and travel > SAME_COMMAND:
            unit, scale = ("mm", 1e3) if campaign.robot.joints[k].slides else ("deg", 180 / np.pi)
            raise CampaignError(
                f"measurements.csv, {sweep.name}: the command of joint {k + 1} changes by {travel * scale:.4g} {unit}; "
                f"expected joint {sweep.joint} to move alone"
            )


def _rows_of_axis(campaign: Campaign, sweep: Sweep) -> np.ndarray:
    links = np.array([t.link for t in campaign.targets])[sweep.target]
    follows = links == sweep.joint
    if campaign.robot.coupling_from(sweep.joint) is None:
        follows = links >= sweep.joint
    rows = np.flatnonzero(follows)
    if len(rows) == 0:
        raise CampaignError(
            f"measurements.csv, {sweep.name}: no target rides on link {sweep.joint} itself, and links beyond it move "
            f"with joint {sweep.joint + 1} as well; expected a target on link {sweep.joint}"
        )
    return rows


def _fit(campaign: Campaign, sweep: Sweep, rows: np.ndarray, noise: Noise, estimator: str, reject: bool) -> SweepFit:
    try:
        fit = fit_axis(
            sweep.point_m[rows],
            sliding=campaign.robot.joints[sweep.joint - 1].slides,
            estimator=estimator,
            target=sweep.target[rows],
            stop=sweep.stop[rows],
            covariance_m2=noise.covariance(sweep.covariance_m2[rows]),
            commanded=sweep.commanded[sweep.stop[rows], sweep.joint - 1],
            reject=reject,
        )
    except AxisUndefined as error:
        raise AxisUndefined(f"measurements.csv, {sweep.name}: {error}") from None
    except InputError as error:
        raise CampaignError(f"measurements.csv, {sweep.name}: {error}") from None
    return SweepFit(sweep, rows, fit)


def _noise_of(fits: tuple[SweepFit, ...]) -> Noise:
    """The noise by the scatter of all sweeps about their axes."""
    observed = stated = 0.0
    components = freedom = 0
    for found in fits:
        fit, used = found.fit, found.fit.used
        free = 2 * int(used.sum()) - (2 if fit.sliding else 4) - 2 * len(fit.radius_m)
        scatter = fit.radial_m[used] ** 2 + (fit.tangential_m if fit.sliding else fit.axial_m)[used] ** 2
        observed += float(scatter.sum()) * 2 * used.sum() / max(free, 1)
        stated += _stated_variance(found, used)
        components += 2 * int(used.sum())
        freedom += free
    return noise_from_scatter(observed, stated, components, freedom)


def _stated_variance(found: SweepFit, used: np.ndarray) -> float:
    """Sum of the stated variances of the residuals' two components: all but the one along the path."""
    covariance = found.sweep.covariance_m2[found.axis_rows][used]
    line = found.fit.line
    along = np.broadcast_to(line.direction, (len(covariance), 3))
    if not found.fit.sliding:
        along = cross(along, found.sweep.point_m[found.axis_rows][used] - line.point_m)
        along = along / np.linalg.norm(along, axis=1)[:, None]
    whole = np.trace(covariance, axis1=1, axis2=2)
    return float(np.sum(whole - np.einsum("ki,kij,kj->k", along, covariance, along)))


def active_from_zero(campaign: Campaign, commanded: Array) -> Array:
    """Commanded active displacements, counted from the arm's marks where they are known, (m, n)."""
    home = np.zeros(campaign.robot.joint_count) if campaign.home is None else campaign.home
    return active_commands(campaign.robot, commanded - home)
