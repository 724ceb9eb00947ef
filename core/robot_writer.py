"""Robot -> robot.toml, from a phi-model's rows or from Denavit-Hartenberg rows."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from core.errors import RobotError
from core.phi_model import PhiModel
from core.robot import Coupling, Joint, Robot
from core.robot_builders import DhRow, phi_model_of, phi_tool_of, to_source_frame
from core.robot_files import ROBOT_FORMAT
from core.toml_text import toml_number, toml_numbers, toml_quantity, toml_text
from core.units import displacement_units, from_si


def write_robot(path: Path | str, robot: Robot, model: PhiModel | None = None) -> None:
    """Write a phi-model robot as robot.toml; see ``phi_robot_toml``."""
    Path(path).write_text(phi_robot_toml(robot, model), encoding="utf-8", newline="\n")


def phi_robot_toml(robot: Robot, model: PhiModel | None = None) -> str:
    """The text of a robot.toml with [[frame]] rows, and [tool] where the last link transform is not the identity.

    Args:
        model: the rows to write; None: those that the robot was described by.

    Raises:
        RobotError: the robot was not described by a phi-model, or its frame 1 is not its base frame.
    """
    model = phi_model_of(robot) if model is None else model
    if not np.allclose(robot.base_transform, np.eye(4), rtol=0, atol=1e-12):
        raise RobotError(f"frame 1 of {robot.name} is not its base frame, which a phi-model's robot.toml cannot say")
    rows = zip(model.phi_rad, model.a_m, model.b_m, model.alpha_rad, model.theta_rad, strict=True)
    blocks = [_block("[[frame]]", _frame_lines(*row)) for row in rows]
    tool = phi_tool_of(robot.link_transforms[-1])
    if tool is not None:
        lines = _frame_lines(tool.phi_rad, tool.a_m, tool.b_m, tool.alpha_rad, tool.theta_rad)
        ends = [toml_quantity("gamma_deg", tool.gamma_rad), toml_quantity("h_mm", tool.h_m)]
        blocks.append(_block("[tool]", lines + ends))
    return _document(robot, blocks)


def dh_robot_toml(robot: Robot, rows: Sequence[DhRow]) -> str:
    """The text of a robot.toml with [[dh]] rows.

    Raises:
        RobotError: there are not as many rows as joints.
    """
    if len(rows) != robot.joint_count:
        raise RobotError(f"{robot.name} has {robot.joint_count} joints, got {len(rows)} Denavit-Hartenberg rows")
    return _document(robot, [_block("[[dh]]", _dh_lines(row)) for row in rows])


def _document(robot: Robot, geometry: list[str]) -> str:
    head = f"format = {toml_text(ROBOT_FORMAT)}\nname = {toml_text(robot.name)}\n"
    joints = [_block("[[joint]]", _joint_lines(joint)) for joint in robot.joints]
    couplings = [_block("[[coupling]]", _coupling_lines(coupling)) for coupling in robot.couplings]
    return "\n".join([head, *joints, *geometry, *couplings, *_physics(robot)])


def _physics(robot: Robot) -> list[str]:
    blocks = []
    for number, link in enumerate(robot.links, 1):
        centre = [from_si(v, "mm") for v in to_source_frame(robot, number, link.centre_m)]
        lines = [f"mass_kg = {toml_number(link.mass_kg)}", f"com_mm = {toml_numbers(centre)}"]
        blocks.append(_block("[[link]]", lines))
    if robot.gravity_direction is not None:
        blocks.append(_block("[gravity]", [f"direction = {toml_numbers(robot.gravity_direction)}"]))
    return blocks


def _frame_lines(phi_rad: float, a_m: float, b_m: float, alpha_rad: float, theta_rad: float) -> list[str]:
    return [
        toml_quantity("phi_deg", phi_rad),
        toml_quantity("a_mm", a_m),
        toml_quantity("b_mm", b_m),
        toml_quantity("alpha_deg", alpha_rad),
        toml_quantity("theta_deg", theta_rad),
    ]


def _dh_lines(row: DhRow) -> list[str]:
    return [
        toml_quantity("theta_deg", row.theta_rad),
        toml_quantity("d_mm", row.d_m),
        toml_quantity("a_mm", row.a_m),
        toml_quantity("alpha_deg", row.alpha_rad),
    ]


def _joint_lines(joint: Joint) -> list[str]:
    lines = [f"kind = {toml_text(joint.kind)}"]
    if np.isfinite(joint.limits).any():
        unit = displacement_units(joint.slides)[0]
        lines.append(f"limits = {toml_numbers(from_si(limit, unit) for limit in joint.limits)}")
    if joint.drive_ratio is not None:
        lines.append(f"drive_ratio = {float(joint.drive_ratio)!r}")
    if joint.transmission != "auto":
        lines.append(f"transmission = {toml_text(joint.transmission)}")
    return lines


def _coupling_lines(coupling: Coupling) -> list[str]:
    lines = [f"from = {coupling.source}", f"to = {coupling.target}", f"gain = {toml_number(coupling.gain)}"]
    if not coupling.compensated:
        lines.append("compensated = false")
    if coupling.form != "auto":
        lines.append(f"form = {toml_text(coupling.form)}")
    return lines


def _block(header: str, lines: list[str]) -> str:
    return "\n".join([header, *lines, ""])
