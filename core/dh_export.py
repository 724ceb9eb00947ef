"""Standard Denavit-Hartenberg rows of any chain, and how well conditioned they are.

Row i leads from frame i-1, whose z-axis is the axis of joint i, to frame i, whose z-axis is the axis of joint i+1:

    Rot(z, theta_i + g_i) Trans(0, 0, d_i) Trans(a_i, 0, 0) Rot(x, alpha_i)          (d_i + g_i where the joint slides)

The x-axis of frame i lies on the common normal of the two axes. That normal has no place of its own where the axes are
parallel, and a bad one where they nearly are, as those of every real arm: a displacement e across the axes moves it by
e / sin(alpha) along them. That factor is the condition of a row. (It is what the phi-model does away with.)
"""

from dataclasses import dataclass

import numpy as np

from core.geometry import Array, cross, invert
from core.json_values import json_text
from core.kinematics import forward
from core.robot import Robot
from core.robot_builders import DhRow
from core.robot_json import exact_mm
from core.version import VERSION

DH_FORMAT = "trueaxis-dh/1"
PARALLEL = 1e-9
"""Sine of the angle below which axes are taken as parallel."""
ILL_CONDITIONED = 10.0
"""A row with a worse condition is warned of: axes less than 5.7 degrees from parallel."""
CHECKED = 200


@dataclass(frozen=True)
class DhChain:
    """Rows with what stands before and behind them, and how well they reproduce the chain."""

    base: Array
    """From frame 0 to the base frame, (4, 4)."""
    rows: tuple[DhRow, ...]
    """One a joint; the last is zero, what is behind joint n is all in ``tool``."""
    tool: Array
    """From the tool to frame n, (4, 4)."""
    conditions: Array
    """Of each row, infinite for parallel axes, 1 for the last, (n,)."""
    position_error_m: float
    """Largest difference of the tool's place to that of the chain, over random displacements."""
    rotation_error: float
    """The same of the entries of its rotation."""


def dh_chain(robot: Robot) -> DhChain:
    """Denavit-Hartenberg rows of a chain."""
    frames = _frames_at_zero(robot)
    frame, rows, conditions = frames[0], [], []
    for i in range(robot.joint_count - 1):
        row, condition = _row(frame, frames[i + 1])
        rows.append(row)
        turning = not robot.joints[i].slides and not robot.joints[i + 1].slides
        conditions.append(condition if turning else 1.0)
        frame = frame @ row.transform()
    rows.append(DhRow(0.0, 0.0, 0.0, 0.0))
    tool = invert(frame) @ frames[-1]
    return DhChain(frames[0], tuple(rows), tool, np.array([*conditions, 1.0]), *_errors(robot, frames[0], rows, tool))


def dh_forward(
    base: Array, rows: tuple[DhRow, ...] | list[DhRow], tool: Array, sliding: np.ndarray, net: Array
) -> Array:
    """Forward kinematics of rows for net displacements (m, n): T_tool_to_base, (m, 4, 4)."""
    out = np.broadcast_to(base, (len(net), 4, 4))
    for i, row in enumerate(rows):
        turn = np.where(sliding[i], 0.0, net[:, i])
        moved = np.zeros((len(net), 4, 4))
        cosine, sine = np.cos(turn), np.sin(turn)
        moved[:, 0, 0] = moved[:, 1, 1] = cosine
        moved[:, 0, 1], moved[:, 1, 0] = -sine, sine
        moved[:, 2, 2] = moved[:, 3, 3] = 1.0
        moved[:, 2, 3] = np.where(sliding[i], net[:, i], 0.0)
        out = out @ moved @ row.transform()
    return out @ tool


def dh_warnings(chain: DhChain) -> tuple[str, ...]:
    """A sentence for every ill-conditioned row, and one if the rows do not reproduce the chain."""
    said = []
    for i, condition in enumerate(chain.conditions):
        if condition > ILL_CONDITIONED:
            angle = np.rad2deg(abs(np.sin(chain.rows[i].alpha_rad)))
            joints = f"the axes of joints {i + 1} and {i + 2}"
            if not np.isfinite(condition):
                said.append(f"{joints} are parallel: theta and d of row {i + 1} are a choice and not measured")
                continue
            said.append(
                f"{joints} are {angle:.4g} deg from parallel: theta and d of row {i + 1} are ill-conditioned "
                f"(condition {condition:.4g}), 0.1 mm across the axes moves d by {0.1 * condition:.4g} mm"
            )
    if chain.position_error_m > 1e-9 or chain.rotation_error > 1e-9:
        said.append(
            f"these rows miss the calibrated chain by up to {chain.position_error_m * 1e3:.2g} mm and "
            f"{chain.rotation_error:.2g} rad"
        )
    return tuple(said)


def dh_json(robot: Robot) -> str:
    """The rows as the text of a JSON file; lengths in mm, angles in deg, every digit kept."""
    chain = dh_chain(robot)
    rows = [
        {
            "joint": i + 1,
            "theta_deg": float(np.rad2deg(row.theta_rad)),
            "d_mm": float(row.d_m * 1e3),
            "a_mm": float(row.a_m * 1e3),
            "alpha_deg": float(np.rad2deg(row.alpha_rad)),
            "condition": float(condition) if np.isfinite(condition) else None,
        }
        for i, (row, condition) in enumerate(zip(chain.rows, chain.conditions, strict=True))
    ]
    return json_text(
        {
            "format": DH_FORMAT,
            "trueaxis": VERSION,
            "robot": robot.name,
            "convention": "standard: base_transform . Rot(z,theta_1+g_1) Trans(0,0,d_1) Trans(a_1,0,0) Rot(x,alpha_1)"
            " ... tool_transform; g_i is the net displacement of joint i, added to d_i where it slides",
            "base_transform": exact_mm(chain.base),
            "rows": rows,
            "tool_transform": exact_mm(chain.tool),
            "largest_position_error_mm": float(chain.position_error_m * 1e3),
            "largest_rotation_error": float(chain.rotation_error),
            "warnings": list(dh_warnings(chain)),
        }
    )


def _frames_at_zero(robot: Robot) -> Array:
    """Frames 1..n and the tool in the base frame, (n + 1, 4, 4)."""
    out = [robot.base_transform]
    for link in robot.link_transforms:
        out.append(out[-1] @ link)
    return np.stack(out)


def _row(frame: Array, goal: Array) -> tuple[DhRow, float]:
    """The row from a frame to one with its z-axis on that of ``goal``, and its condition."""
    z, origin = frame[:3, 2], frame[:3, 3]
    w, point = goal[:3, 2], goal[:3, 3]
    normal = cross(z, w)
    sine = float(np.linalg.norm(normal))
    between = point - origin
    if sine > PARALLEL:
        x = normal / sine
        d = float(cross(between, w) @ normal) / sine**2
        condition = 1.0 / sine
    else:
        across = between - z * (between @ z)
        distance = float(np.linalg.norm(across))
        x = across / distance if distance > PARALLEL else frame[:3, 0]
        d, condition = 0.0, np.inf
    # Of the two senses of the normal the one is taken that turns the frame by less than a right angle.
    x = x if x @ frame[:3, 0] >= 0 else -x
    theta = np.arctan2(x @ frame[:3, 1], x @ frame[:3, 0])
    alpha = np.arctan2(normal @ x, z @ w)
    return DhRow(float(theta), d, float(between @ x), float(alpha)), condition


def _errors(robot: Robot, base: Array, rows: list[DhRow], tool: Array) -> tuple[float, float]:
    rng = np.random.default_rng(1)
    net = rng.uniform(-np.pi, np.pi, (CHECKED, robot.joint_count))
    away = np.abs(dh_forward(base, rows, tool, robot.sliding, net) - forward(robot, net))
    return float(away[:, :3, 3].max()), float(away[:, :3, :3].max())
