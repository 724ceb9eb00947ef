"""What compensation changes, as the calibration predicts it: where the nominal commands would end, and the new ones.

Nothing here is measured. How well the prediction holds shows on measured poses alone (``core/pose_loop.py``).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from core.calibrated_arm import CalibratedArm
from core.compensation import Compensation, nominal_start, reached
from core.geometry import Array, invert
from core.inverse_kinematics import Tolerance
from core.kinematics import forward, nominal_net
from core.rotations import vectors_of_rotations


@dataclass(frozen=True)
class Misses:
    """How far the tool ends from the wanted poses, a row a pose; NaN where there is no command."""

    position_m: Array
    """(m,)"""
    rotation_rad: Array
    """(m,)"""

    @property
    def mean_position_m(self) -> float:
        """Over the poses that have a command; NaN without any."""
        return _mean(self.position_m)

    @property
    def mean_rotation_rad(self) -> float:
        """The same of rotations."""
        return _mean(self.rotation_rad)


@dataclass(frozen=True)
class CompensationEffect:
    """Poses without compensation and with it, on the calibrated arm."""

    nominal_commanded: Array
    """The commands of the nominal arm for the wanted poses, rad or m, (m, n); NaN where it cannot take one."""
    reached: Array
    """Where the compensated commands bring the tool, in the frame of the wanted poses, (m, 4, 4); NaN without one."""
    nominal: Misses
    compensated: Misses


def compensation_effect(
    arm: CalibratedArm,
    poses: ArrayLike,
    found: Compensation,
    near: ArrayLike | None = None,
    frame: str = "base",
    tolerance: Tolerance | None = None,
) -> CompensationEffect:
    """What the commands that were found change; arguments as for ``compensate``."""
    wanted = np.asarray(poses, dtype=float)
    if frame == "instrument":
        wanted = invert(arm.base) @ wanted
    net = nominal_start(arm, wanted, tolerance, None if near is None else nominal_net(arm.nominal, near))
    missed = _misses(forward(arm.nominal, net), wanted)
    commanded = arm.nominal_driven().commands(net)
    limit = Tolerance() if tolerance is None else tolerance
    beyond = (missed.position_m > limit.position_m) | (missed.rotation_rad > limit.rotation_rad)
    commanded[beyond] = np.nan
    there = _reached(arm, found.commanded)
    return CompensationEffect(
        nominal_commanded=commanded,
        reached=arm.base @ there if frame == "instrument" else there,
        nominal=_misses(_reached(arm, commanded), wanted),
        compensated=_misses(there, wanted),
    )


def _reached(arm: CalibratedArm, commanded: Array) -> Array:
    """Where commands bring the tool, NaN where there are none, (m, 4, 4)."""
    there = ~np.isnan(commanded).any(axis=1)
    out = np.full((len(commanded), 4, 4), np.nan)
    out[there] = reached(arm, commanded[there])
    return out


def _misses(there: Array, wanted: Array) -> Misses:
    known = np.isfinite(there).all(axis=(1, 2))
    position, rotation = np.full(len(wanted), np.nan), np.full(len(wanted), np.nan)
    position[known] = np.linalg.norm(there[known, :3, 3] - wanted[known, :3, 3], axis=1)
    turns = vectors_of_rotations(there[known, :3, :3] @ np.swapaxes(wanted[known, :3, :3], 1, 2))
    rotation[known] = np.linalg.norm(turns, axis=1)
    return Misses(position, rotation)


def _mean(values: Array) -> float:
    known = values[np.isfinite(values)]
    return float(known.mean()) if len(known) else np.nan
