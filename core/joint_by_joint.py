"""The paper's way: each joint on its own, one step at a time (sections 2 and 3).

1. Displacements about each axis, and the transmission function of each joint (equations 6 to 8, 12 and 13).
2. The axes carried back to the zero pose, from the base up, and the passive motion of joint i+1 while joint i moved
   (14 and 15): what lies below joint i+1 is known by the time that it is needed.
3. The phi-model (appendix), with the covariance of the axes carried through.

Joints that were never swept stay as they stood: their nominal geometry is not mixed in.
"""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import Arm
from core.axes import AxisFit
from core.coupling import carried_back, fit_coupling, passive_curve
from core.displacement import Displacements, displacements
from core.errors import CampaignError, TrueaxisError
from core.estimate import ArmEstimate, axis_basis
from core.function_fit import FunctionFit, SweepCurve
from core.geometry import Array, Line, cross, invert, joint_motion
from core.measurements import Campaign
from core.motion_forms import MotionFunction, coupling_form, transmission_form
from core.phi_convention import Convention
from core.phi_model import PhiModel
from core.phi_uncertainty import geometry_from_axes
from core.sweep_fits import SAME_COMMAND, SweepFit, SweepFits, active_from_zero
from core.transmission import fit_transmission


@dataclass(frozen=True)
class SweepMotion:
    """What one sweep shows of its joint's drive."""

    found: SweepFit
    displacements: Displacements
    curve: SweepCurve
    """Commanded against actual displacement."""
    passive: SweepCurve | None = None
    """Passive displacement of the next joint against the active one of this, if a second target was watched."""


def joint_by_joint(
    campaign: Campaign, found: SweepFits, convention: Convention | None, nominal: PhiModel | None
) -> tuple[ArmEstimate, tuple[SweepMotion, ...]]:
    """Estimate the arm one joint at a time from the axes of its sweeps.

    Args:
        campaign: what was measured.
        found: the axes of all sweeps.
        convention, nominal: the frames of the phi-model; None: not every joint was swept.

    Raises:
        CampaignError: a joint without a sweep stands differently in two sweeps.
    """
    _require_still(campaign, found)
    motions = [_motion(campaign, fit) for fit in found.fits]
    drives = _transmissions(campaign, motions)
    walk = _FromTheBase(campaign, found, motions, drives)
    walk.run()
    arm = walk.arm()
    covariance = walk.axis_covariance()
    geometry = None
    if convention is not None and nominal is not None:
        geometry = geometry_from_axes(arm.axes, convention, covariance, nominal)
    stated = np.concatenate([f.sweep.covariance_m2[f.axis_rows] for f in found.fits])
    estimate = ArmEstimate(
        method="joint by joint",
        arm=arm,
        axis_covariance=covariance,
        transmissions=tuple(drives),
        offset_std=offset_std(campaign, drives),
        couplings=tuple(walk.couplings),
        geometry=geometry,
        noise_m=found.noise.rms_m(stated),
    )
    return estimate, tuple(walk.motions)


def offsets(campaign: Campaign, drives: list[MotionFunction]) -> Array:
    """Offsets of the transducers, by which the commands at the arm's marks read what they do, rad or m, (n,)."""
    if campaign.home is None:
        return np.zeros(len(drives))
    at_zero = np.array([replace(drive, offset=0.0)(0.0) for drive in drives])
    gains = np.where(campaign.robot.coupling_compensated, campaign.robot.coupling_gains, 0.0)
    return campaign.home - at_zero - gains * np.concatenate([[0.0], at_zero[:-1]])


def offset_std(campaign: Campaign, fits: list[FunctionFit | None]) -> Array:
    """Standard uncertainties of the offsets, from the constants of the functions, (n,)."""
    if campaign.home is None:
        return np.zeros(len(fits))
    gains = np.where(campaign.robot.coupling_compensated, campaign.robot.coupling_gains, 0.0)
    variance = np.zeros(len(fits))
    for k, fit in enumerate(fits):
        if fit is not None:
            gradient = fit.form.evaluate(np.zeros(1), fit.coefficients)[2][0]
            variance[k] = gradient @ fit.covariance @ gradient
    return np.sqrt(variance + gains**2 * np.concatenate([[0.0], variance[:-1]]))


def drive_functions(campaign: Campaign, fits: list[FunctionFit | None]) -> tuple[MotionFunction, ...]:
    """The transmission functions with their offsets; nominal where a joint was not swept."""
    plain = [
        MotionFunction(transmission_form("direct"), np.zeros(0))
        if fit is None
        else MotionFunction(fit.form, fit.coefficients)
        for fit in fits
    ]
    return tuple(replace(f, offset=float(o)) for f, o in zip(plain, offsets(campaign, plain), strict=True))


def coupling_functions(campaign: Campaign, fits: list[FunctionFit | None]) -> tuple[MotionFunction | None, ...]:
    """The coupling functions into each joint; the nominal gain where none was observed."""
    out: list[MotionFunction | None] = []
    for joint, fit in enumerate(fits, 1):
        coupling = campaign.robot.coupling_into(joint)
        if coupling is None:
            out.append(None)
        elif fit is None:
            out.append(MotionFunction(coupling_form("proportional", coupling.gain), np.array([coupling.gain])))
        else:
            out.append(MotionFunction(fit.form, fit.coefficients))
    return tuple(out)


def _require_still(campaign: Campaign, found: SweepFits) -> None:
    """A joint without a sweep has no axis to be carried about, so it must stand the same throughout."""
    for k in range(campaign.robot.joint_count):
        if k + 1 in found.swept:
            continue
        held = np.concatenate([active_from_zero(campaign, f.sweep.commanded)[:, k] for f in found.fits])
        if np.ptp(held) > SAME_COMMAND and any(f.sweep.joint > k + 1 for f in found.fits):
            raise CampaignError(
                f"measurements.csv: joint {k + 1} has no sweep of its own but is commanded to different places; "
                f"expected a sweep of joint {k + 1}, or the same command throughout"
            )


def _motion(campaign: Campaign, found: SweepFit) -> SweepMotion:
    sweep, rows = found.sweep, found.axis_rows
    moved = displacements(
        found.fit,
        sweep.point_m[rows],
        stop=sweep.stop[rows],
        target=sweep.target[rows],
        commanded=sweep.commanded[:, sweep.joint - 1],
    )
    seen = np.isfinite(moved.value)
    asked = active_from_zero(campaign, sweep.commanded)[:, sweep.joint - 1]
    # What is seen of f is the displacement; an error of the axis enters with slope f' = 1 to first order.
    curve = SweepCurve(moved.value[seen], asked[seen], moved.std[seen], moved.axis_effect[seen], found.fit.covariance)
    return SweepMotion(found, moved, curve)


def _transmissions(campaign: Campaign, motions: list[SweepMotion]) -> list[FunctionFit | None]:
    drives: list[FunctionFit | None] = []
    for number, joint in enumerate(campaign.robot.joints, 1):
        curves = tuple(m.curve for m in motions if m.found.sweep.joint == number)
        try:
            drives.append(fit_transmission(joint, curves, campaign.home is not None) if curves else None)
        except TrueaxisError as error:
            raise type(error)(f"joint {number}: {error}") from None
    return drives


class _FromTheBase:
    """The walk from joint 1 up: axes at the zero pose, and couplings, each resting on what lies below it."""

    def __init__(
        self, campaign: Campaign, found: SweepFits, motions: list[SweepMotion], drives: list[FunctionFit | None]
    ) -> None:
        n = campaign.robot.joint_count
        self.campaign, self.found, self.motions = campaign, found, motions
        self.functions = drive_functions(campaign, drives)
        self.drives = drives
        self.axes: list[Line] = []
        self.couplings: list[FunctionFit | None] = [None] * n
        self.measured: list[tuple[AxisFit | None, Array]] = []
        self.nominal = campaign.robot.axes_at_zero()

    def run(self) -> None:
        for joint in range(1, self.campaign.robot.joint_count + 1):
            self._add_axis(joint)
            if self.campaign.robot.coupling_into(joint) is not None:
                self._add_coupling(joint)

    def arm(self) -> Arm:
        return Arm(
            self.campaign.robot, tuple(self.axes), self.functions, coupling_functions(self.campaign, self.couplings)
        )

    def axis_covariance(self) -> Array:
        """Covariance of all axes at zero: each sweep's own, and what the angles of the joints below add."""
        n = self.campaign.robot.joint_count
        out = np.zeros((4 * n, 4 * n))
        for k, (fit, _) in enumerate(self.measured):
            own = np.full((4, 4), np.nan)
            if fit is not None:
                own = np.zeros((4, 4))
                own[: len(fit.covariance), : len(fit.covariance)] = fit.covariance
            out[4 * k : 4 * k + 4, 4 * k : 4 * k + 4] = own
        return out + self._covariance_by_angles()

    def _covariance_by_angles(self) -> Array:
        """Uncertain displacements of the joints below turn an axis about theirs when it is carried to zero."""
        n = self.campaign.robot.joint_count
        out = np.zeros((4 * n, 4 * n))
        for j, drive in enumerate(self.drives):
            if drive is None or len(drive.coefficients) == 0:
                continue
            effect = np.zeros((4 * n, len(drive.coefficients)))
            for k in range(j + 1, n):
                fit, net = self.measured[k]
                if fit is not None:
                    effect[4 * k : 4 * k + 4] = np.outer(
                        self._axis_by_turn(k, j), self._net_by_constants(drive, net[j])
                    )
            out += effect @ drive.covariance @ effect.T
        return out

    def _axis_by_turn(self, k: int, j: int) -> Array:
        below, line = self.axes[j], self.axes[k]
        basis = axis_basis(line.direction)
        if self.campaign.robot.sliding[j]:
            return -np.concatenate([np.zeros(2), basis @ below.direction])
        shift = cross(below.direction, line.point_m - below.point_m)
        return -np.concatenate([basis @ cross(below.direction, line.direction), basis @ shift])

    def _net_by_constants(self, drive: FunctionFit, net: float) -> Array:
        at = np.array([net])
        _, slope, gradient = drive.form.evaluate(at, drive.coefficients)
        if self.campaign.home is not None:
            gradient = gradient - drive.form.evaluate(np.zeros(1), drive.coefficients)[2]
        return -gradient[0] / slope[0]

    def _net_below(self, sweep_fit: SweepFit, joint: int) -> Array:
        """Net displacements of the joints below a joint while a sweep of it was measured, (joint - 1,)."""
        asked = active_from_zero(self.campaign, sweep_fit.sweep.commanded[:1])[0]
        return self._net(self._active(asked[None, :]))[0, : joint - 1]

    def _active(self, asked: Array) -> Array:
        """Active displacements for commanded ones, by the transmission functions, (m, n)."""
        home = self.campaign.home is not None
        active = np.zeros_like(asked)
        for k, function in enumerate(self.functions):
            if self.drives[k] is not None:
                plain = replace(function, offset=0.0)
                active[:, k] = plain.inverse(asked[:, k] + (plain(0.0) if home else 0.0))
        return active

    def _net(self, active: Array) -> Array:
        """Net displacements, with the couplings known so far, (m, n)."""
        net = active.copy()
        for k, coupling in enumerate(coupling_functions(self.campaign, self.couplings)):
            if coupling is not None and self.drives[k] is not None:
                net[:, k] += coupling(active[:, k - 1])
        return net

    def _to_zero(self, net: Array, joint: int) -> Array:
        """The rigid motion that undoes joints 1..joint-1, (4, 4)."""
        motion = np.eye(4)
        for k in range(joint - 1):
            motion = motion @ joint_motion(self.axes[k], net[k], bool(self.campaign.robot.sliding[k]))
        return invert(motion)

    def _add_axis(self, joint: int) -> None:
        mine = [m.found for m in self.motions if m.found.sweep.joint == joint]
        if not mine:
            self.axes.append(self.nominal[joint - 1])
            self.measured.append((None, np.zeros(joint - 1)))
            return
        best = min(mine, key=lambda f: f.fit.direction_std_rad)
        net = self._net_below(best, joint)
        line = best.fit.line.moved(self._to_zero(net, joint))
        self.axes.append(line)
        self.measured.append((_turned(best.fit, line, self._to_zero(net, joint)), net))

    def _add_coupling(self, joint: int) -> None:
        """Fit the passive motion of a joint from second targets of the sweeps of the joint below it."""
        coupling = self.campaign.robot.coupling_into(joint)
        axis, _ = self.measured[joint - 1]
        curves = []
        for index, motion in enumerate(self.motions):
            if motion.found.sweep.joint == joint - 1 and axis is not None:
                curve = self._passive(motion, joint, axis, coupling.gain)
                if curve is not None:
                    self.motions[index] = replace(motion, passive=curve)
                    curves.append(curve)
        if curves:
            try:
                self.couplings[joint - 1] = fit_coupling(coupling, tuple(curves))
            except TrueaxisError as error:
                raise type(error)(f"coupling {joint - 1} -> {joint}: {error}") from None

    def _passive(self, motion: SweepMotion, joint: int, axis: AxisFit, gain: float) -> SweepCurve | None:
        sweep = motion.found.sweep
        asked = active_from_zero(self.campaign, sweep.commanded)
        if np.ptp(asked[:, joint - 1]) > SAME_COMMAND:
            return None
        links = np.array([t.link for t in self.campaign.targets])[sweep.target]
        rows = np.flatnonzero(links >= joint)
        if len(rows) < 3:
            return None
        active = self._observed(motion, self._active(asked))
        net = self._net(active)
        below = self._to_zero(net[0], joint - 1)
        points = sweep.point_m[rows] @ below[:3, :3].T + below[:3, 3]
        sliding = bool(self.campaign.robot.sliding[joint - 2])
        points = carried_back(points, self.axes[joint - 2], net[sweep.stop[rows], joint - 2], sliding)
        whole = replace(axis, used=np.ones(len(rows), dtype=bool))
        std = np.full(len(active), float(np.nanmean(motion.displacements.std)))
        return passive_curve(whole, points, sweep.stop[rows], sweep.target[rows], active[:, joint - 2], gain, std)

    def _observed(self, motion: SweepMotion, active: Array) -> Array:
        """Active displacements with those of the swept joint as they were seen, not as the function has them."""
        joint = motion.found.sweep.joint
        same = [m for m in self.motions if m.found.sweep.joint == joint]
        start = self.drives[joint - 1].start[next(k for k, m in enumerate(same) if m.found is motion.found)]
        seen = np.isfinite(motion.displacements.value)
        out = active.copy()
        out[seen, joint - 1] = start + motion.displacements.value[seen]
        return out


def _turned(fit: AxisFit, line: Line, motion: Array) -> AxisFit:
    """The fit carried by a rigid motion, its covariance written in the basis of the new direction."""
    carried, basis = fit.basis @ motion[:3, :3].T, axis_basis(line.direction)
    turn = basis @ carried.T
    blocks = [turn] * (len(fit.covariance) // 2)
    change = np.zeros_like(fit.covariance)
    for k, block in enumerate(blocks):
        change[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = block
    return replace(fit, line=line, basis=basis, covariance=change @ fit.covariance @ change.T)
