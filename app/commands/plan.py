"""``trueaxis plan``: which shots tell the most of an arm, what to expect of them, and what they save."""

import argparse
import json
import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from app.isolability_report import isolability_html
from app.isolability_summary import isolability_lines
from app.output import OutputFile, require_writable, write_files
from app.progress import Progress
from app.standard_output import print_result
from core.calibration import calibrate
from core.campaign_files import read_campaign
from core.errors import InputError
from core.gap.additions import Addition, additions
from core.gap.isolability import Isolability, isolability
from core.gap.isolability_json import isolability_json, isolability_record
from core.gap.planned import as_planned, with_noise
from core.measurements import Campaign
from core.planning.mounts import with_bar
from core.planning.plan_files import PLAN_FORMAT, assumptions, plan_csv, plan_json
from core.planning.planned_campaign import planned_campaign
from core.planning.proposal import (
    KINDS,
    Proposal,
    Saving,
    middle_ranges,
    poses_that_matter,
    propose,
    saving,
    swept_ranges,
)
from core.planning.sight import Field, Sight
from core.planning.site import Repeats, Site
from core.planning.site_makers import calibrated_site, narrowed, nominal_site, targets_on_links
from core.robot_files import read_robot
from core.theodolite import Theodolite
from core.wording import is_simulated

SHOTS = 129
"""As many as table 1 of the paper has."""
MOST_SHOTS = 2000
SECONDS_A_SHOT = 40.0
SIGMA_MM = 0.1
DRAWN, CALIBRATED = "drawn", "calibrated"
SIMS = (DRAWN, CALIBRATED)
PLAN_FILES = {"plan.csv", "plan.json", "plan.html"}
EPILOG = """What is planned for: a campaign that was measured once (its calibration tells where the arm, the targets and
the base stand, and how well points repeat), a robot.toml alone (its base is then the instrument's frame), or, with
nothing given, the simulated demo cell. Poses that matter are those within the ranges of the campaign's sweeps, else
within the middle half of all joints' ranges.

Targets are seen if every --station sees them; two stations with --sigma-arcsec are theodolites, whose points are less
exact the farther away they are. What is written: plan.csv, the commands with the columns of measurements.csv and no
points yet, and plan.json with what to expect: how exact the arm will be, and which causes of a sim-to-real gap the
points will show and tell apart. plan.html is that as a page.

With --judge nothing is proposed: the campaign's own rows are judged, whether they hold points yet or not, with the
noise that it states or that --sigma-mm and --repeatability-mm give. All other options are then without meaning."""


@dataclass(frozen=True)
class Given:
    """What there is to plan for."""

    site: Site
    campaign: Campaign | None
    ranges: np.ndarray
    """Of the motors from the marks, in which the arm is to be exact, (n, 2)."""
    seconds_a_shot: float


@dataclass(frozen=True)
class ToldApart:
    """What the shots will tell of causes of a gap, and what more could."""

    found: Isolability
    tried: tuple[Addition, ...]


def configure(parser: argparse.ArgumentParser) -> None:
    """Declare the options."""
    parser.add_argument(
        "source", type=Path, nargs="?", metavar="CAMPAIGN", help="campaign folder with sweeps, or a robot.toml"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for plan.csv and plan.json")
    parser.add_argument("--shots", type=_shots, default=SHOTS, metavar="N", help=f"how many (default: {SHOTS})")
    parser.add_argument(
        "--kind", choices=KINDS, default="sweeps", help="sweeps of single joints (default) or free poses"
    )
    parser.add_argument(
        "--criterion",
        choices=("I", "D"),
        default="I",
        help="I: the error over the poses that matter (default); D: all unknowns alike",
    )
    parser.add_argument("--seed", type=_seed, default=1, metavar="N", help="of the search (default: 1)")
    parser.add_argument(
        "--station",
        type=_place,
        action="append",
        default=[],
        metavar="X,Y,Z",
        help="where an instrument stands, mm, in the frame of the points; once each (--station=-1,2,3 for X below 0)",
    )
    parser.add_argument("--sigma-arcsec", type=_above_zero, metavar="S", help="of the angles of two stations")
    parser.add_argument("--sigma-mm", type=_above_zero, metavar="S", help="of one coordinate of a point")
    parser.add_argument("--repeatability-mm", type=_at_least_zero, metavar="S", help="of one coordinate, by the arm")
    parser.add_argument("--bar-mm", type=_above_zero, metavar="R", help="targets may also sit so far off the last axis")
    parser.add_argument(
        "--range",
        type=_range,
        action="append",
        default=[],
        metavar="JOINT:LOW:HIGH",
        help="keep a joint's commands within, deg (mm where it slides)",
    )
    parser.add_argument("--seconds-a-shot", type=_above_zero, metavar="T", help="default: as in the campaign, else 40")
    parser.add_argument(
        "--judge",
        choices=SIMS,
        help="say what the campaign's own rows could tell apart, with a sim as drawn or calibrated",
    )
    parser.add_argument("--json", action="store_true", help="print the JSON on standard output, nothing else")
    parser.epilog = EPILOG


def run(arguments: argparse.Namespace) -> None:
    """Plan and write the files.

    Raises:
        InputError: what is given cannot be planned for, or the folder cannot be written.
    """
    folder: Path = arguments.out
    require_writable(folder)
    _require_replaceable(folder)
    if arguments.judge is not None:
        _judge(arguments, folder)
        return
    with Progress(5) as progress:
        progress.step("reading")
        given = _given(arguments)
        progress.step("placing shots")
        needed = poses_that_matter(given.site, given.ranges, arguments.seed)
        proposal = propose(given.site, arguments.kind, arguments.shots, needed, arguments.seed, arguments.criterion)
        progress.step("comparing with the shots that were taken")
        saved = None
        if given.campaign is not None:
            saved = saving(proposal, needed, given.campaign.measurements, given.seconds_a_shot)
        progress.step("asking which causes of a gap they will tell apart")
        told = _told_apart(proposal, given)
        progress.step("writing")
        title = given.campaign.title if given.campaign else ""
        text = plan_json(proposal, saved, given.seconds_a_shot, title, isolability_record(told.found, told.tried))
        page = isolability_html(told.found, told.tried, title, simulated=_simulated(given.campaign))
        files = (("plan.csv", plan_csv(proposal)), ("plan.json", text), ("plan.html", page))
        write_files(folder, tuple(OutputFile(*file) for file in files))
    print_result(_summary(proposal, saved, told, given, folder), text, as_json=arguments.json)


def _given(arguments: argparse.Namespace) -> Given:
    """The site that the arguments describe."""
    source: Path | None = arguments.source
    if source is not None and source.is_file():
        site, campaign = _of_robot(source, arguments), None
    else:
        campaign, sight = _demo(arguments) if source is None else (read_campaign(source), _sight(arguments))
        site = calibrated_site(calibrate(campaign), sight)
    if arguments.repeatability_mm is not None:
        site = replace(site, repeats=Repeats(arguments.repeatability_mm * 1e-3, site.repeats.joint_sigma))
    ranges = middle_ranges(site) if campaign is None else swept_ranges(site, campaign.measurements)
    site = narrowed(site, _in_si(site, arguments.range))
    if arguments.bar_mm is not None:
        site = with_bar(site, arguments.bar_mm * 1e-3)
    return Given(site, campaign, ranges, arguments.seconds_a_shot or _seconds_a_shot(campaign))


def _of_robot(path: Path, arguments: argparse.Namespace) -> Site:
    robot = read_robot(path)
    sight = _sight(arguments) or Sight(sigma_m=SIGMA_MM * 1e-3)
    return nominal_site(robot, np.eye(4), targets_on_links(robot), sight)


def _demo(arguments: argparse.Namespace) -> tuple[Campaign, Sight]:
    """The simulated cell, measured once; its theodolites unless others are given."""
    from core.twin import irb_l6
    from core.twin.campaign import simulate_campaign

    pair = irb_l6.theodolites()
    return simulate_campaign(1), _sight(arguments) or Sight((pair.left, pair.right))


def _sight(arguments: argparse.Namespace) -> Sight | None:
    """The instrument as given on the command line; None: nothing was given."""
    places, arcsec, sigma_mm = arguments.station, arguments.sigma_arcsec, arguments.sigma_mm
    if arcsec is not None and (sigma_mm is not None or len(places) < 2):
        raise InputError(
            f"--sigma-arcsec with {len(places)} stations{' and --sigma-mm' if sigma_mm is not None else ''}, expected "
            "two --station or more, whose angles fix the points, and no --sigma-mm"
        )
    if not places and sigma_mm is None:
        return None
    angle = 1e-5 if arcsec is None else np.deg2rad(arcsec / 3600)
    stations = tuple(Theodolite(np.array(place) * 1e-3, sigma_hz_rad=angle, sigma_v_rad=angle) for place in places)
    if arcsec is not None:
        return Sight(stations)
    return Sight(stations, (SIGMA_MM if sigma_mm is None else sigma_mm) * 1e-3, Field())


def _seconds_a_shot(campaign: Campaign | None) -> float:
    """As long as a shot took in the campaign: the middle of all intervals."""
    if campaign is None or campaign.measurements.time_s is None:
        return SECONDS_A_SHOT
    between = np.diff(campaign.measurements.time_s)
    usual = float(np.median(between[np.isfinite(between)])) if np.isfinite(between).any() else 0.0
    return usual if usual > 0 else SECONDS_A_SHOT


def _judge(arguments: argparse.Namespace, folder: Path) -> None:
    """What the rows of a campaign, measured or not, could tell apart."""
    source: Path | None = arguments.source
    if source is None or source.is_file():
        raise InputError("--judge is of the rows of a campaign, expected a campaign folder")
    with Progress(3) as progress:
        progress.step("reading")
        campaign = read_campaign(source)
        noisy = with_noise(campaign, _in_m(arguments.sigma_mm), _in_m(arguments.repeatability_mm))
        progress.step("asking which causes of a gap the rows will tell apart")
        found = isolability(as_planned(noisy), drawn=arguments.judge == DRAWN)
        tried = additions(found)
        progress.step("writing")
        text = isolability_json(found, tried, campaign.title)
        page = isolability_html(found, tried, campaign.title, simulated=is_simulated(campaign))
        write_files(folder, (OutputFile("plan.json", text), OutputFile("plan.html", page)))
    lines = [campaign.title or campaign.robot.name, *isolability_lines(found, tried)]
    written = f"Written: {folder / 'plan.json'}, {folder / 'plan.html'}"
    print_result("\n".join([*lines, "", written]), text, as_json=arguments.json)


def _in_m(length_mm: float | None) -> float | None:
    return None if length_mm is None else length_mm * 1e-3


def _simulated(campaign: Campaign | None) -> bool:
    return campaign is not None and is_simulated(campaign)


def _told_apart(proposal: Proposal, given: Given) -> ToldApart:
    """A site of a campaign is that of a calibrated arm; of a drawing neither geometry nor targets are settled."""
    calibrated = given.campaign is not None
    found = isolability(planned_campaign(proposal, given.seconds_a_shot, calibrated), drawn=not calibrated)
    return ToldApart(found, additions(found))


def _in_si(site: Site, ranges: list[tuple[int, float, float]]) -> dict[int, tuple[float, float]]:
    sliding = site.robot.sliding
    scale = {j: 1e-3 if 1 <= j <= len(sliding) and sliding[j - 1] else math.pi / 180 for j, _, _ in ranges}
    return {joint: (low * scale[joint], high * scale[joint]) for joint, low, high in ranges}


def _summary(proposal: Proposal, saved: Saving | None, told: ToldApart, given: Given, folder: Path) -> str:
    minutes, expected = proposal.shots * given.seconds_a_shot / 60, proposal.expected
    what = f"{len(proposal.sweeps)} sweeps" if proposal.sweeps else "free poses"
    lines = [
        f"{proposal.site.robot.name}: {proposal.shots} shots, {what}, {minutes:.0f} min",
        f"  expected over the poses that matter: {expected.mean_position_m * 1e3:.3f} mm, "
        f"{expected.mean_orientation_rad * 1e3:.3f} mrad",
    ]
    lines += [f"  {_row(proposal, k)}" for k in range(len(proposal.sweeps))]
    if saved is not None:
        lines.append(f"  {_against(saved)}")
    lines += isolability_lines(told.found, told.tried)
    if proposal.unobservable:
        lines.append(f"Note: {proposal.unobservable} combinations of unknowns are not shown by these shots")
    lines += [f"Note: {sentence}" for sentence in assumptions(proposal)]
    return "\n".join([*lines, "", f"Written: {', '.join(str(folder / name) for name in sorted(PLAN_FILES))}"])


def _row(proposal: Proposal, k: int) -> str:
    sweep = proposal.sweeps[k]
    slides = proposal.site.robot.joints[sweep.joint - 1].slides
    unit, scale = ("mm", 1e3) if slides else ("deg", 180 / math.pi)
    ends = f"{sweep.low * scale:6.0f} to {sweep.high * scale:4.0f} {unit}"
    return f"joint {sweep.joint}, sweep {sweep.sweep}: {sweep.stops:3} stops, {ends}, {', '.join(sweep.targets)}"


def _against(saved: Saving) -> str:
    base = f"the {saved.baseline_shots} shots of the campaign: {saved.baseline.mean_position_m * 1e3:.3f} mm"
    if saved.equal_shots is None:
        return f"{base}; this plan is not as good"
    return f"{base}; as exact with {saved.equal_shots} planned shots: {saved.seconds / 60:.0f} min saved"


def _require_replaceable(folder: Path) -> None:
    """Write over an earlier plan only."""
    found = [name for name in sorted(PLAN_FILES) if (folder / name).exists()]
    if not found:
        return
    try:
        earlier = json.loads((folder / "plan.json").read_text(encoding="utf-8")).get("format") == PLAN_FORMAT
    except (OSError, ValueError, AttributeError, RecursionError):
        earlier = False
    if not earlier:
        raise InputError(f"{folder / found[0]} is not of an earlier plan and is left as it is; expected another folder")


def _shots(text: str) -> int:
    return _whole(text, 1, MOST_SHOTS)


def _seed(text: str) -> int:
    return _whole(text, 0, 2**63 - 1)


def _whole(text: str, low: int, high: int) -> int:
    try:
        value = int(text)
    except ValueError:
        value = low - 1
    if not low <= value <= high:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a whole number from {low} to {high}")
    return value


def _number(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not abs(value) < 1e9:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number")
    return value


def _above_zero(text: str) -> float:
    if not _number(text) > 0:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number above 0")
    return float(text)


def _at_least_zero(text: str) -> float:
    if not _number(text) >= 0:
        raise argparse.ArgumentTypeError(f"{text!r}, expected a number of at least 0")
    return float(text)


def _place(text: str) -> tuple[float, ...]:
    parts = text.split(",")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"{text!r}, expected three numbers with commas between")
    return tuple(_number(part) for part in parts)


def _range(text: str) -> tuple[int, float, float]:
    parts = text.split(":")
    if len(parts) != 3:
        raise argparse.ArgumentTypeError(f"{text!r}, expected JOINT:LOW:HIGH")
    return _whole(parts[0], 1, 1000), _number(parts[1]), _number(parts[2])
