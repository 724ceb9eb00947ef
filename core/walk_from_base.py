"""The walk from the base up: axes carried back to the zero pose, and couplings, each resting on what lies below it."""

from dataclasses import dataclass, replace

import numpy as np

from core.arm import Arm
from core.axes import AxisFit
from core.coupling import carry_back, fit_coupling, passive_curve, stops_that_stand_out, without_stops
from core.displacement import Displacements
from core.drives import coupling_functions, drive_functions
from core.errors import TrueaxisError
from core.estimate import axis_basis
from core.function_fit import FunctionFit, SweepCurve
from core.geometry import Array, Line, cross, invert, joint_motion
from core.measurements import Campaign
from core.sweep_fits import SAME_COMMAND, SweepFit, SweepFits, active_from_zero


@dataclass(frozen=True)
class SweepMotion:
    """What one sweep shows of its joint's drive."""

    found: SweepFit
    displacements: Displacements
    curve: SweepCurve
    """Commanded against actual displacement."""
    passive: SweepCurve | None = None
    """Passive displacement of the next joint against the active one of this, if a second target was watched."""
    passive_outliers: tuple[int, ...] = ()
    """Rows of the sweep that stand out of the passive curve."""


class WalkFromBase:
    """The walk from joint 1 up: axes at the zero pose, and couplings, each resting on what lies below it."""

    def __init__(
        self,
        campaign: Campaign,
        found: SweepFits,
        motions: list[SweepMotion],
        drives: list[FunctionFit | None],
        reject: bool,
    ) -> None:
        n = campaign.robot.joint_count
        self.campaign, self.found, self.motions = campaign, found, motions
        self.functions = drive_functions(campaign, drives)
        self.drives = drives
        self.reject = reject
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
                seen = self._passive(motion, joint, axis, coupling.gain)
                if seen is not None:
                    self.motions[index] = replace(motion, passive=seen[0], passive_outliers=seen[1])
                    curves.append(seen[0])
        if curves:
            try:
                self.couplings[joint - 1] = fit_coupling(coupling, tuple(curves))
            except TrueaxisError as error:
                raise type(error)(f"coupling {joint - 1} -> {joint}: {error}") from None

    def _passive(
        self, motion: SweepMotion, joint: int, axis: AxisFit, gain: float
    ) -> tuple[SweepCurve, tuple[int, ...]] | None:
        """The passive curve of a sweep without stops that stand out, and the rows of these; None: nothing to see."""
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
        carried = carry_back(
            points,
            sweep.stop[rows],
            sweep.target[rows],
            _turned(motion.found.fit, self.axes[joint - 2], below),
            net[:, joint - 2],
            _in_basis_of(self.axes[joint - 2], motion, below),
            active[:, joint - 2],
        )
        curve = passive_curve(axis, carried, gain)
        out = stops_that_stand_out(curve) if self.reject else np.zeros(len(curve.y), dtype=bool)
        outlying = rows[np.isin(sweep.stop[rows], np.unique(sweep.stop[rows])[out])]
        return without_stops(curve, out), tuple(int(row) for row in outlying)

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
    change = _change_of_basis(fit, line, motion)
    return replace(fit, line=line, basis=axis_basis(line.direction), covariance=change @ fit.covariance @ change.T)


def _in_basis_of(line: Line, motion: SweepMotion, carry: Array) -> Displacements:
    """Displacements with the effect of the axis written for tilts and shifts as ``_turned`` has them."""
    change = _change_of_basis(motion.found.fit, line, carry)
    return replace(motion.displacements, axis_effect=motion.displacements.axis_effect @ change.T)


def _change_of_basis(fit: AxisFit, line: Line, motion: Array) -> Array:
    """From tilts and shifts in the fit's basis to those in the basis of the moved axis; one block for each pair."""
    turn = axis_basis(line.direction) @ (fit.basis @ motion[:3, :3].T).T
    return np.kron(np.eye(len(fit.covariance) // 2), turn)
