"""The pose records of a campaign, standstill by standstill: commands, and points of the targets on the last link."""

from dataclasses import dataclass, replace

import numpy as np

from core.errors import CampaignError
from core.geometry import Array
from core.measurements import POSE, Campaign
from core.rigid_pose import PointSets
from core.rotations import nearest_rotations, rotations_of_quaternions, vectors_of_rotations

FEWEST_FREEDOMS = 12
"""With fewer degrees of freedom repeated turns say nothing about their scatter."""
SAME_COMMAND = 1e-9
"""Commands that differ by less are one, rad or m."""


@dataclass(frozen=True)
class Standstills:
    """What was seen of the last link, one row a standstill."""

    pose: np.ndarray
    """Index of the pose in the campaign, ascending, (k,)."""
    commanded: Array
    """(k, n)."""
    wanted: Array
    """Commands by which the nominal arm would take the pose that was wanted; compensated ones differ, (k, n)."""
    target: np.ndarray
    """Which of the campaign's targets are on the last link and were seen, (j,)."""
    points: PointSets
    """Their points, repeated shots averaged, (k, j)."""
    rotation: Array
    """How 6-D targets are turned, from their own frame to the instrument's, (k, j, 3, 3); NaN where not seen."""
    turn_shots: np.ndarray
    """How many shots went into each turn, (k, j)."""
    turn_sigma_rad: float | None
    """Standard deviation of each component of a single turn, by repeated shots; None: too few of them."""

    @property
    def framed(self) -> np.ndarray:
        """Of which targets the turn was seen as well, boolean, (k, j)."""
        return self.points.seen & np.isfinite(self.rotation[..., 0, 0])

    @property
    def compensated(self) -> np.ndarray:
        """Which were commanded otherwise than the nominal arm would be, boolean, (k,)."""
        return np.abs(self.commanded - self.wanted).max(axis=1, initial=0.0) > SAME_COMMAND

    def some(self, keep: np.ndarray) -> "Standstills":
        """Some of the standstills, by index or flag, with the same targets."""
        points = PointSets(self.points.point_m[keep], self.points.covariance_m2[keep], self.points.seen[keep])
        return replace(
            self,
            pose=self.pose[keep],
            commanded=self.commanded[keep],
            wanted=self.wanted[keep],
            points=points,
            rotation=self.rotation[keep],
            turn_shots=self.turn_shots[keep],
        )


def standstills(campaign: Campaign, noise_m: float) -> Standstills:
    """The pose records of the targets on the last link.

    Args:
        campaign: its pose records are used whatever ``use`` says: a calibration fits sweeps only.
        noise_m: standard deviation of one coordinate of a point that states no covariance.

    Raises:
        CampaignError: no such record, or two different commands in one standstill.
    """
    table, n = campaign.measurements, campaign.robot.joint_count
    last = np.array([target.link == n for target in campaign.targets])
    if not last.any():
        raise CampaignError(f"no target rides on link {n}, the last one: there is nothing to verify the arm's poses by")
    rows = np.flatnonzero((table.phase == POSE) & table.seen & (table.target >= 0))
    rows = rows[last[table.target[rows]]]
    if len(rows) == 0:
        raise CampaignError("the campaign has no pose records of targets on the last link, expected some to verify by")
    pose, which = np.unique(table.pose[rows], return_inverse=True)
    target, column = np.unique(table.target[rows], return_inverse=True)
    first = np.array([rows[np.argmax(which == k)] for k in range(len(pose))])
    away = np.abs(table.commanded[rows] - table.commanded[first][which]).max(axis=1)
    if (away > SAME_COMMAND).any():
        wrong = int(pose[which[np.argmax(away)]])
        raise CampaignError(f"pose {wrong} has rows with different commands, expected one standstill")
    covariance = table.covariance_m2[rows]
    stated = np.isfinite(covariance).all(axis=(1, 2))
    covariance = np.where(stated[:, None, None], covariance, noise_m**2 * np.eye(3))
    commanded, shape = table.commanded[first], (len(pose), len(target))
    quaternion = None if table.target_quaternion is None else table.target_quaternion[rows]
    rotation, shots, turn_sigma = _turns(which, column, quaternion, shape)
    wanted = commanded if table.wanted is None else table.wanted[first]
    return Standstills(
        pose=pose,
        commanded=commanded,
        wanted=np.where(np.isnan(wanted), commanded, wanted),
        target=target,
        points=_averaged(which, column, table.point_m[rows], covariance),
        rotation=rotation,
        turn_shots=shots,
        turn_sigma_rad=turn_sigma,
    )


def _turns(
    row: np.ndarray, column: np.ndarray, quaternion: Array | None, shape: tuple[int, int]
) -> tuple[Array, np.ndarray, float | None]:
    """Turns of 6-D targets, repeated shots averaged, (k, j, 3, 3), how many there were, and how far they scatter."""
    mean, count = np.full((*shape, 3, 3), np.nan), np.zeros(shape, dtype=int)
    given = np.zeros(len(row), dtype=bool) if quaternion is None else np.isfinite(quaternion).all(axis=1)
    if quaternion is None or not given.any():
        return mean, count, None
    row, column, each = row[given], column[given], rotations_of_quaternions(quaternion[given])
    total = np.zeros((*shape, 3, 3))
    np.add.at(total, (row, column), each)
    np.add.at(count, (row, column), 1)
    seen = count > 0
    mean[seen] = nearest_rotations(total[seen])
    away = vectors_of_rotations(each @ np.swapaxes(mean[row, column], 1, 2))
    freedoms = 3 * int((count[seen] - 1).sum())
    return mean, count, float(np.sqrt(np.sum(away**2) / freedoms)) if freedoms >= FEWEST_FREEDOMS else None


def _averaged(row: np.ndarray, column: np.ndarray, point_m: Array, covariance: Array) -> PointSets:
    """Shots of one target in one standstill averaged by their covariances."""
    shape = (row.max() + 1, column.max() + 1)
    information, pulled = np.zeros((*shape, 3, 3)), np.zeros((*shape, 3))
    weight = np.linalg.inv(covariance)
    np.add.at(information, (row, column), weight)
    np.add.at(pulled, (row, column), np.einsum("mij,mj->mi", weight, point_m))
    seen = information.any(axis=(2, 3))
    spread = np.full((*shape, 3, 3), np.nan)
    spread[seen] = np.linalg.inv(information[seen])
    points = np.full((*shape, 3), np.nan)
    points[seen] = np.einsum("mij,mj->mi", spread[seen], pulled[seen])
    return PointSets(points, spread, seen)
