"""Accuracy and repeatability as ISO 9283:1998 defines them, where poses were repeated, and of distances.

For n visits of one commanded pose (the same commands under another pose index), with l_j the distance of the j-th
attained position from their barycentre:

    AP   pose accuracy            distance of the barycentre from the commanded position; angle of the mean orientation
                                  from the commanded one
    RP   pose repeatability       mean(l) + 3 s(l); of the orientation 3 s of the turns about x, y and z
    AD   distance accuracy        distance between two barycentres less the commanded distance

with s the standard deviation with n - 1. The standard asks for 30 visits; n is said. 'Commanded' is the pose that a
model predicts for the commands. The instrument's noise is in all of these. Distances do not depend on the base frame.
"""

from dataclasses import dataclass

import numpy as np

from core.geometry import Array
from core.link_poses import TOOL, mean_rotation
from core.rotations import vectors_of_rotations
from core.standstills import SAME_COMMAND
from core.verification import ModelErrors, Verification

MOST_PAIRS = 200_000


@dataclass(frozen=True)
class Accuracy:
    """AP of one commanded pose under one model; of the orientation NaN where none was measured."""

    position_m: float
    orientation_rad: float


@dataclass(frozen=True)
class RepeatedPose:
    """One commanded pose that was visited more than once."""

    poses: tuple[int, ...]
    """Their indices in the campaign."""
    nominal: Accuracy
    calibrated: Accuracy
    repeatability_m: float
    """RP of the position."""
    repeatability_rad: Array
    """RP of the orientation about x, y and z of the robot's base, (3,); NaN where none was measured."""

    @property
    def visits(self) -> int:
        return len(self.poses)


@dataclass(frozen=True)
class DistanceAccuracy:
    """AD over pairs of commanded poses under one model, m."""

    mean_m: float
    rms_m: float
    max_m: float
    """The largest without its sign."""
    pairs: int


def repeated_poses(found: Verification) -> tuple[RepeatedPose, ...]:
    """Accuracy and repeatability of every commanded pose that was visited more than once."""
    return tuple(_repeated(found, rows) for rows in _visits(found) if len(rows) > 1)


def distance_accuracy(found: Verification, model: ModelErrors) -> DistanceAccuracy | None:
    """AD of a model over all pairs of commanded poses; None with fewer than two of them."""
    visits = _visits(found)
    visits = _of_one_point(found, visits)
    if len(visits) < 2:
        return None
    measured = np.stack([found.measured.pose[rows, :3, 3].mean(axis=0) for rows in visits])
    predicted = np.stack([model.predicted[rows[0], :3, 3] for rows in visits])
    first, second = np.triu_indices(len(visits), 1)
    if len(first) > MOST_PAIRS:
        chosen = np.linspace(0, len(first) - 1, MOST_PAIRS).astype(int)
        first, second = first[chosen], second[chosen]
    apart = [np.linalg.norm(points[first] - points[second], axis=1) for points in (measured, predicted)]
    error = apart[0] - apart[1]
    rms, largest = float(np.sqrt(np.mean(error**2))), float(np.abs(error).max())
    return DistanceAccuracy(float(error.mean()), rms, largest, len(error))


def _visits(found: Verification) -> list[np.ndarray]:
    """Rows of the measured poses by commands, and by whose place was measured, in the order of their first visit."""
    rounded = np.round(found.measured.seen.commanded / SAME_COMMAND).astype(np.int64)
    keys = np.concatenate([rounded, _points(found)[:, None]], axis=1)
    _, first, which = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    return [np.flatnonzero(which.ravel() == k) for k in np.argsort(first)]


def _points(found: Verification) -> np.ndarray:
    """Whose place each row is: numbers that are the same for the tool, or for the same targets, (k,)."""
    tool = np.array([reference == TOOL for reference in found.measured.reference])
    seen = found.measured.seen.points.seen & ~tool[:, None]
    return np.unique(np.concatenate([tool[:, None], seen], axis=1), axis=0, return_inverse=True)[1].ravel()


def _of_one_point(found: Verification, visits: list[np.ndarray]) -> list[np.ndarray]:
    """Those visits that show the place that is shown most often."""
    points = _points(found)
    own = np.array([points[rows[0]] for rows in visits])
    return [rows for rows, point in zip(visits, own, strict=True) if point == np.bincount(own).argmax()]


def _repeated(found: Verification, rows: np.ndarray) -> RepeatedPose:
    place = found.measured.pose[rows, :3, 3]
    middle = place.mean(axis=0)
    away = np.linalg.norm(place - middle, axis=1)
    mean, turns = np.full((3, 3), np.nan), np.full((len(rows), 3), np.nan)
    if found.measured.turned[rows].all():
        rotation = found.measured.pose[rows, :3, :3]
        mean = mean_rotation(rotation)
        # Small turns about x, y and z commute, so that their components are the angles that the standard names.
        turns = vectors_of_rotations(rotation @ mean.T) @ found.arm.base[:3, :3]
    return RepeatedPose(
        poses=tuple(int(p) for p in found.measured.seen.pose[rows]),
        nominal=_accuracy(found.nominal, rows, middle, mean),
        calibrated=_accuracy(found.calibrated, rows, middle, mean),
        repeatability_m=float(away.mean() + 3 * away.std(ddof=1)),
        repeatability_rad=3 * turns.std(axis=0, ddof=1),
    )


def _accuracy(model: ModelErrors, rows: np.ndarray, middle: Array, mean: Array) -> Accuracy:
    predicted = model.predicted[rows[0]]
    shift = float(np.linalg.norm(middle - predicted[:3, 3]))
    if np.isnan(mean).any():
        return Accuracy(shift, np.nan)
    turn = vectors_of_rotations((mean @ predicted[:3, :3].T)[None])[0]
    return Accuracy(shift, float(np.linalg.norm(turn)))
