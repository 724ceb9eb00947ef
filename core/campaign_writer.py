"""Campaign -> a campaign folder that ``read_campaign`` reads back as the same campaign."""

import os
from pathlib import Path

from core.campaign_files import CAMPAIGN_FORMAT
from core.measurement_writer import measurements_csv
from core.measurements import Campaign, Target
from core.robot import Robot
from core.robot_builders import to_source_frame
from core.toml_text import toml_key, toml_numbers, toml_quantity, toml_text
from core.units import displacement_units, from_si


def write_campaign(folder: Path | str, campaign: Campaign, robot_toml: str) -> None:
    """Write campaign.toml, robot.toml and measurements.csv into a folder, which is made if it is not there.

    Every file appears whole or not at all. A URDF file that ``robot_toml`` names is the caller's to put there.

    Args:
        robot_toml: the text of robot.toml, as from ``phi_robot_toml`` or read from the file of the campaign's robot.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    _write_whole(folder / "robot.toml", robot_toml)
    _write_whole(folder / "measurements.csv", measurements_csv(campaign))
    _write_whole(folder / "campaign.toml", campaign_toml(campaign))


def campaign_toml(campaign: Campaign) -> str:
    """The text of a campaign's campaign.toml."""
    head = [f"format = {toml_text(CAMPAIGN_FORMAT)}"]
    if campaign.title:
        head.append(f"title = {toml_text(campaign.title)}")
    head += ['robot = "robot.toml"', f"joint_values = {toml_text(campaign.joint_values)}"]
    blocks = [head, _instrument_lines(campaign)]
    if campaign.place_simulated:
        blocks.append(["[sim]", "place = true"])
    if campaign.home is not None:
        units = [displacement_units(joint.slides)[0] for joint in campaign.robot.joints]
        home = (from_si(value, unit) for value, unit in zip(campaign.home, units, strict=True))
        blocks.append(["[home]", f"q = {toml_numbers(home)}"])
    if campaign.notes:
        blocks.append(["[notes]", *_text_lines(campaign.notes)])
    blocks += [_target_lines(target, campaign.robot) for target in campaign.targets]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _instrument_lines(campaign: Campaign) -> list[str]:
    instrument = campaign.instrument
    lines = ["[instrument]", f"kind = {toml_text(instrument.kind)}"]
    if instrument.sigma_m is not None:
        lines.append(toml_quantity("sigma_mm", instrument.sigma_m))
    if instrument.turn_sigma_rad is not None:
        lines.append(toml_quantity("turn_sigma_mrad", instrument.turn_sigma_rad))
    return lines + _text_lines(instrument.description)


def _target_lines(target: Target, robot: Robot) -> list[str]:
    lines = ["[[target]]", f"name = {toml_text(target.name)}", f"link = {target.link}"]
    if target.point_m is not None:
        place = [from_si(value, "mm") for value in to_source_frame(robot, target.link, target.point_m)]
        lines.append(f"xyz_mm = {toml_numbers(place)}")
    if target.sigma_m:
        lines.append(toml_quantity("xyz_sigma_mm", target.sigma_m))
    return lines


def _text_lines(texts: dict[str, str]) -> list[str]:
    return [f"{toml_key(key)} = {toml_text(text)}" for key, text in texts.items()]


def _write_whole(path: Path, text: str) -> None:
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        beside.write_text(text, encoding="utf-8", newline="\n")
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)
