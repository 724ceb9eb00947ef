"""How fast and how completely poses are solved: the paper's arm, thousands of poses at once."""

from collections import Counter
from functools import cache

import numpy as np

from core.calibrated_arm import CalibratedArm, calibrated_arm
from core.calibration import calibrate
from core.compensation import compensate, reached
from core.driven_robot import DrivenRobot, nominal_driven
from core.geometry import Array
from core.inverse_kinematics import JointSolutions, Outcome, inverse_kinematics
from core.kinematics import forward, nominal_net
from core.robot import Joint, JointKind
from core.robot_builders import DhRow, robot_from_dh
from core.rotations import vectors_of_rotations
from core.twin.campaign import simulate_campaign
from core.twin.irb_l6_arm import nominal_robot
from core.twin.scara import cell as scara_cell
from tests.benchmarks.clock import median_s, once_s
from tests.benchmarks.tables import markdown

COMPENSATED = 10_000
QUARTER = np.pi / 2
SEVEN = {
    "KUKA LBR iiwa 14": (
        ((0.36, 0), (0, 0), (0.42, 0), (0, 0), (0.4, 0), (0, 0), (0.126, 0)),
        (-QUARTER, QUARTER, QUARTER, -QUARTER, -QUARTER, QUARTER, 0),
        ((-170, 170), (-120, 120), (-170, 170), (-120, 120), (-170, 170), (-120, 120), (-175, 175)),
    ),
    "Franka Panda": (
        ((0.333, 0), (0, 0), (0.316, 0.0825), (0, -0.0825), (0.384, 0), (0, 0.088), (0.107, 0)),
        (-QUARTER, QUARTER, QUARTER, -QUARTER, QUARTER, QUARTER, 0),
        ((-166, 166), (-101, 101), (-166, 166), (-176, -4), (-166, 166), (-1, 215), (-166, 166)),
    ),
}
"""Arms of seven joints: d and a of each row in m, alpha in rad, and limits in degrees."""


@cache
def calibrated() -> CalibratedArm:
    """The paper's arm as a simulated campaign has it."""
    return calibrated_arm(calibrate(simulate_campaign(1)))


def seven_joints(name: str) -> DrivenRobot:
    """An arm with a joint to spare."""
    lengths, twists, limits = SEVEN[name]
    joints = [Joint(JointKind.REVOLUTE, tuple(np.deg2rad(ends))) for ends in limits]
    rows = [DhRow(0.0, d, a, alpha) for (d, a), alpha in zip(lengths, twists, strict=True)]
    return nominal_driven(robot_from_dh(name, joints, rows))


def random_commands(robot: DrivenRobot, count: int, seed: int = 0) -> Array:
    """Commands anywhere within the limits of all joints."""
    low, high = np.clip(robot.limits, -2 * np.pi, 2 * np.pi).T
    return np.random.default_rng(seed).uniform(low, high, (count, len(low)))


def compensation_table() -> str:
    """10,000 poses compensated: with the nominal joint values as the start, and without."""
    arm = calibrated()
    # Half the range of the joints: inside the limits, the corrected commands are as well.
    q = 0.5 * random_commands(arm.nominal_driven(), COMPENSATED)
    poses = forward(arm.nominal, nominal_net(arm.nominal, q))
    rows = []
    for words, start, repeats in (("nominal joint values given", q, 3), ("nothing but the poses", None, 1)):
        seconds = median_s(lambda start=start: compensate(arm, poses, start), repeats)
        found = compensate(arm, poses, start)
        there = reached(arm, found.commanded[found.ok])
        wanted = poses[found.ok]
        shift = np.linalg.norm(there[:, :3, 3] - wanted[:, :3, 3], axis=1).max()
        turn = np.linalg.norm(
            vectors_of_rotations(there[:, :3, :3] @ np.swapaxes(wanted[:, :3, :3], 1, 2)), axis=1
        ).max()
        rows.append((words, f"{seconds:.2f}", f"{found.ok.sum():,}", f"{shift * 1e6:.1e}", f"{turn * 1e6:.1e}"))
    header = (f"{COMPENSATED:,} poses of the IRB L6", "s", "ok", "forth and back, um", "urad")
    return markdown(header, rows)


def completeness_table(count: int) -> str:
    """Random poses made by forward kinematics within the limits, solved without any start."""
    rows = []
    arms = [nominal_driven(nominal_robot()), nominal_driven(scara_cell().robot), *map(seven_joints, SEVEN)]
    for robot in arms:
        poses = forward(robot.chain, robot.drives.net(random_commands(robot, count)))
        found: list[JointSolutions] = []
        seconds = once_s(lambda poses=poses, robot=robot, found=found: found.append(inverse_kinematics(robot, poses)))
        outcome = Counter(found[0].outcome)
        rest = ", ".join(f"{n} {name}" for name, n in outcome.items() if name != Outcome.SOLVED) or "none"
        rows.append((robot.chain.name, f"{count:,}", f"{outcome[Outcome.SOLVED]:,}", rest, f"{seconds:.1f}"))
    return markdown(("arm", "random poses", "solved", "others", "s"), rows)


def report(count: int) -> str:
    """Both tables."""
    return f"{compensation_table()}\n\n{completeness_table(count)}"
