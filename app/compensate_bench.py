"""Compensation on the workbench: poses that somebody pasted or sent, and the commands for them. Nothing draws here."""

from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from typing import TypeVar

import numpy as np

from app.pose_bench import PoseBench
from core.calibrated_arm import CalibratedArm
from core.compensation import Compensation, compensate
from core.compensation_effect import CompensationEffect, compensation_effect
from core.errors import InputError
from core.inverse_kinematics import Tolerance
from core.kinematics import forward, nominal_net
from core.pose_files import PoseTable, poses_csv, poses_of_bytes, wanted_csv

MOST_POSES = 20_000
"""More belong to the command line, which does not hold up the operator."""
CHUNK = 4096
Record = TypeVar("Record")
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Compensated:
    """Wanted poses with their commands."""

    arm: CalibratedArm
    table: PoseTable
    frame: str
    found: Compensation
    effect: CompensationEffect

    @property
    def csv(self) -> str:
        """The file that ``trueaxis compensate`` would write."""
        return poses_csv(self.table, self.arm.nominal, self.found.pose, self.found.commanded, self.found.status)


class CompensateBench:
    """The last poses that were compensated."""

    def __init__(self, poses: PoseBench) -> None:
        self._poses = poses
        self.last: Compensated | None = None

    @property
    def outdated(self) -> bool:
        """Whether the last poses were compensated by another solution than the present one."""
        return self.last is not None and self.last.arm is not self._poses.arm

    def test_poses_csv(self) -> str:
        """The planned test poses as a file of wanted poses.

        Raises:
            InputError: there is no solution, or no test pose.
        """
        arm, poses = self._arm(), self._poses.poses()
        if not poses:
            raise InputError("no test pose is planned: plan some under Verify, or paste your own")
        commands = np.array([pose.wanted for pose in poses])
        wanted = forward(arm.nominal, nominal_net(arm.nominal, commands))
        return wanted_csv(tuple(str(pose.number) for pose in poses), arm.nominal, wanted, commands)

    def compensate(
        self,
        data: bytes,
        name: str,
        frame: str = "base",
        tolerance: Tolerance | None = None,
        progress: Progress | None = None,
    ) -> None:
        """Find the commands for poses.

        Args:
            data: of a CSV file.
            name: what messages call it.
            frame: in which the poses are given, ``base`` or ``instrument``.
            tolerance: how far from a pose the tool may end.
            progress: is told the share that is done, and what is being done.

        Raises:
            InputError: there is no solution, the file cannot be used, or it has too many poses.
        """
        arm = self._arm()
        table = poses_of_bytes(data, name, arm.nominal)
        count = len(table.poses)
        if count > MOST_POSES:
            raise InputError(
                f"{name} has {count} poses, expected at most {MOST_POSES} here; trueaxis compensate takes any number"
            )
        parts: list[tuple[Compensation, CompensationEffect]] = []
        for first in range(0, count, CHUNK):
            if progress is not None:
                progress(first / count, f"{first} of {count} poses")
            rows = slice(first, first + CHUNK)
            near = None if table.near is None else table.near[rows]
            found = compensate(arm, table.poses[rows], near, frame, tolerance)
            parts.append((found, compensation_effect(arm, table.poses[rows], found, near, frame, tolerance)))
        found, effect = (_joined([part[k] for part in parts]) for k in (0, 1))
        self.last = Compensated(arm, table, frame, found, effect)

    def forget(self) -> None:
        """There is another session."""
        self.last = None

    def _arm(self) -> CalibratedArm:
        arm = self._poses.arm
        if arm is None:
            raise InputError("there is no solution with a sweep of every joint: solve first")
        return arm


def _joined(parts: list[Record]) -> Record:
    """Records of rows, one after the other, as one."""
    values = {}
    for field in fields(parts[0]):
        own = [getattr(part, field.name) for part in parts]
        if is_dataclass(own[0]):
            values[field.name] = _joined(own)
        elif isinstance(own[0], tuple):
            values[field.name] = tuple(value for part in own for value in part)
        else:
            values[field.name] = np.concatenate(own)
    return type(parts[0])(**values)
