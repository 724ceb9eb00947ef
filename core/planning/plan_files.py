"""A proposal as files: the commands as a CSV in the columns of measurements.csv, and what it promises as JSON."""

import numpy as np

from core.gap.isolability_json import PLAN_FORMAT
from core.geometry import Array
from core.json_values import Json, degrees, json_text, mm, number
from core.measurement_writer import measurements_csv
from core.measurements import Campaign
from core.planning.expected_error import ExpectedError
from core.planning.mounts import places_on_links
from core.planning.proposal import Proposal, Saving
from core.robot import Robot
from core.robot_builders import to_source_frame
from core.session_plan import PlannedSweep
from core.version import VERSION


def plan_csv(proposal: Proposal) -> str:
    """The shots in their order as rows of a measurements.csv in which no point has been measured yet."""
    site = proposal.site
    return measurements_csv(Campaign(site.robot, site.targets, proposal.rows, home=site.home))


def plan_json(
    proposal: Proposal,
    saved: Saving | None,
    seconds_a_shot: float,
    source: str = "",
    isolability: Json | None = None,
) -> str:
    """The text of plan.json.

    Args:
        saved: against the shots of a campaign; None: there are none to compare with.
        source: title of that campaign.
        isolability: which causes of a gap the shots will be able to tell apart; None: nobody asked.
    """
    site = proposal.site
    return json_text(
        {
            "format": PLAN_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in rad or deg as the key says",
            "robot": site.robot.name,
            "campaign": source,
            "kind": proposal.kind,
            "criterion": proposal.criterion,
            "seed": proposal.seed,
            "shots": proposal.shots,
            "minutes": number(proposal.shots * seconds_a_shot / 60, 3),
            "seconds_a_shot": number(seconds_a_shot, 3),
            "unknowns": site.layout.size,
            "unobservable": proposal.unobservable,
            "expected": _expected(proposal.expected),
            "saving": None if saved is None else _saving(saved),
            "observability": {name: number(value) for name, value in vars(proposal.indices).items()},
            "noise": _noise(proposal),
            "targets": _targets(proposal),
            "sweeps": [_sweep(site.robot, sweep) for sweep in proposal.sweeps],
            "isolability": isolability,
            "assumptions": list(assumptions(proposal)),
        }
    )


def assumptions(proposal: Proposal) -> tuple[str, ...]:
    """What the promise rests on, in sentences."""
    site = proposal.site
    said = [
        "expected errors are the Cramer-Rao bound of these very shots: of the calibrated model alone, without the "
        "arm's repeatability on the day of use",
        "the model is taken as complete: bending, backlash, heat or a base that moves come on top",
    ]
    if site.sight.stations:
        field, body = site.sight.field, site.body
        said.append(
            f"a target is seen from {field.nearest_m:g} to {field.farthest_m:g} m and up to "
            f"{np.rad2deg(field.steepest_rad):.0f} deg steep, and not through the arm, taken as rods of "
            f"{body.radius_m * 1e3:.0f} mm radius from joint to joint ({body.tool_radius_m * 1e3:.0f} mm the last "
            "link); targets are seen from all sides"
        )
    else:
        said.append("no station was given: whether targets can be seen was not judged")
    said.append("collisions with fixtures, the floor or the arm itself are not looked for: try the moves slowly first")
    return tuple(said)


def _expected(errors: ExpectedError) -> Json:
    return {
        "mean_position_mm": mm(errors.mean_position_m),
        "rms_position_mm": mm(errors.rms_position_m),
        "worst_pose_rms_position_mm": mm(errors.worst_position_m),
        "mean_orientation_rad": number(errors.mean_orientation_rad),
        "rms_orientation_rad": number(errors.rms_orientation_rad),
    }


def _saving(saved: Saving) -> Json:
    return {
        "baseline_shots": saved.baseline_shots,
        "baseline_expected": _expected(saved.baseline),
        "shots_for_equal_accuracy": saved.equal_shots,
        "minutes_saved_for_equal_accuracy": number(saved.seconds / 60, 3),
    }


def _noise(proposal: Proposal) -> Json:
    site = proposal.site
    joints = site.repeats.joint_sigma
    return {
        "instrument_sigma_mm": None if site.sight.sigma_m is None else mm(site.sight.sigma_m),
        "stations_mm": [mm(station.position_m) for station in site.sight.stations],
        "repeatability_mm": mm(site.repeats.link_sigma_m),
        "repeatability_of_joints": None if joints is None else [number(value) for value in joints],
    }


def _targets(proposal: Proposal) -> list[Json]:
    """The targets that the plan sights, with their places on their links."""
    site, places = proposal.site, places_on_links(proposal.site)
    used = np.unique(proposal.rows.target[proposal.rows.target >= 0])
    return [
        {
            "name": site.targets[k].name,
            "link": int(site.links[k]),
            "xyz_mm": mm(to_source_frame(site.robot, int(site.links[k]), places[k])),
            "shots": int(np.count_nonzero(proposal.rows.target == k)),
        }
        for k in used
    ]


def _sweep(robot: Robot, sweep: PlannedSweep) -> Json:
    unit = "mm" if robot.joints[sweep.joint - 1].slides else "deg"
    ends = np.array([sweep.low, sweep.high])
    return {
        "joint": sweep.joint,
        "sweep": sweep.sweep,
        "stops": sweep.stops,
        "targets": list(sweep.targets),
        f"from_to_{unit}": mm(ends) if unit == "mm" else degrees(ends),
        "held_at": _commands(robot, np.array(sweep.held)),
    }


def _commands(robot: Robot, commanded: Array) -> list[float | None]:
    """Commands in deg, mm where a joint slides."""
    return [number(v, 12) for v in np.where(robot.sliding, commanded * 1e3, np.rad2deg(commanded))]
