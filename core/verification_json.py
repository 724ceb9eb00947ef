"""A verification as ``verification.json``: what other programs read. Keys may be added, never renamed."""

import numpy as np

from core.geometry import Array
from core.json_values import Json, json_text, mm, number, numbers
from core.pose_loop import PoseLoop, pose_loop
from core.repeatability import DistanceAccuracy, RepeatedPose, distance_accuracy, repeated_poses
from core.verification import Errors, Verification, overall, verdicts
from core.version import VERSION

VERIFICATION_FORMAT = "trueaxis-verification/1"


def verification_to_json(found: Verification) -> str:
    """The text of verification.json."""
    return json_text(
        {
            "format": VERIFICATION_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in rad; std: standard uncertainty; null: not known",
            "robot": found.campaign.robot.name,
            "campaign": found.campaign.title,
            "digest_sha256": found.campaign.digest or None,
            "calibration": {"campaign": found.arm.source, "digest_sha256": found.arm.digest or None},
            "frame": "robot base",
            "reference": _reference_record(found),
            "poses": _pose_records(found),
            "summary": _summary(found),
            "improvement_position": number(found.improvement_position),
            "improvement_orientation": number(found.improvement_orientation),
            "compensation": _loop_record(pose_loop(found)),
            "limits": _limits_record(found),
            "distances": {
                "nominal": _distance_record(distance_accuracy(found, found.nominal)),
                "calibrated": _distance_record(distance_accuracy(found, found.calibrated)),
            },
            "repeated_poses": [_repeated_record(one) for one in repeated_poses(found)],
            "skipped_poses": list(found.measured.skipped),
            "suspect_poses": list(found.measured.suspects),
            "notes": list(found.notes),
        }
    )


def quantities(found: Verification) -> dict[str, tuple[Errors, float]]:
    """The four kinds of errors by their names in the file, with what makes their unit of SI ones."""
    return {
        "nominal_position_mm": (found.nominal.position, 1e3),
        "calibrated_position_mm": (found.calibrated.position, 1e3),
        "nominal_orientation_rad": (found.nominal.orientation, 1.0),
        "calibrated_orientation_rad": (found.calibrated.orientation, 1.0),
    }


def _reference_record(found: Verification) -> Json:
    """Whose poses were judged, and how the targets were placed on the link."""
    measured = found.measured
    return {
        "point": measured.reference[0] if len(set(measured.reference)) == 1 else "mixed",
        "anchors": list(measured.anchors),
        "turn_from_other_poses": bool(measured.free_turn),
        "noise_factor": number(measured.noise_factor),
    }


def _pose_records(found: Verification) -> list[Json]:
    kinds = quantities(found)
    base = found.arm.base[:3, :3]
    shifts = {"nominal": found.nominal.shift_m @ base, "calibrated": found.calibrated.shift_m @ base}
    turns = {"nominal": found.nominal.turn_rad @ base, "calibrated": found.calibrated.turn_rad @ base}
    judged = _judged(found)
    records = []
    for k, pose in enumerate(found.measured.seen.pose):
        record: Json = {"pose": int(pose), "targets": int(found.measured.seen.points.seen[k].sum())}
        record["reference"] = found.measured.reference[k]
        record |= {name: number(errors.value[k] * scale) for name, (errors, scale) in kinds.items()}
        record["std"] = {name: number(errors.std[k] * scale) for name, (errors, scale) in kinds.items()}
        record["error_mm"] = {model: mm(shift[k]) for model, shift in shifts.items()}
        record["turn_rad"] = {model: numbers(turn[k]) for model, turn in turns.items()}
        if judged:
            record["verdict"] = {name: each[k] for name, each in judged.items()}
        records.append(record)
    return records


def _summary(found: Verification) -> Json:
    return {name: _statistics(errors, scale) for name, (errors, scale) in quantities(found).items()}


def _statistics(errors: Errors, scale: float) -> Json:
    return {
        "mean": number(errors.mean * scale),
        "rms": number(errors.rms * scale),
        "p95": number(errors.p95 * scale),
        "max": number(errors.max * scale),
        "n": errors.count,
        "mean_std": number(errors.mean_std * scale),
    }


def _loop_record(loop: PoseLoop) -> Json | None:
    """Wanted poses and what came of them, by nominal and by compensated commands; null without the latter."""
    if not loop.compensated.count:
        return None
    both = (("nominal", loop.nominal), ("compensated", loop.compensated))
    pose = loop.found.measured.seen.pose
    return {
        "visits": [
            {
                "pose": int(pose[attempts.row[k]]),
                "wanted": int(attempts.goal[k]) + 1,
                "command": name,
                "position_mm": mm(attempts.errors.position.value[k]),
                "orientation_rad": number(attempts.errors.orientation.value[k]),
                "std": {
                    "position_mm": mm(attempts.errors.position.std[k]),
                    "orientation_rad": number(attempts.errors.orientation.std[k]),
                },
            }
            for name, attempts in both
            for k in range(attempts.count)
        ],
        "summary": {
            name: {
                "position_mm": _statistics(attempts.errors.position, 1e3),
                "orientation_rad": _statistics(attempts.errors.orientation, 1.0),
            }
            for name, attempts in both
        },
        "improvement_position": number(loop.improvement_position),
        "improvement_orientation": number(loop.improvement_orientation),
    }


def _judged(found: Verification) -> dict[str, tuple[str, ...]]:
    """Verdicts by name, for the quantities that have a limit."""
    limits = {"position_mm": found.limits.position_m, "orientation_rad": found.limits.orientation_rad}
    each = {name: verdicts(errors, limits[name.partition("_")[2]]) for name, (errors, _) in quantities(found).items()}
    return {name: said for name, said in each.items() if said}


def _limits_record(found: Verification) -> Json | None:
    """The operator's limits and whether the arm keeps them, its uncertainty considered; null without limits."""
    judged = _judged(found)
    if not judged:
        return None
    limits = found.limits
    return {
        "position_mm": None if limits.position_m is None else number(limits.position_m * 1e3),
        "orientation_rad": None if limits.orientation_rad is None else number(limits.orientation_rad),
        "rule": "pass: every error with two standard uncertainties more is within; fail: one with two less is not",
        "nominal": overall(tuple(v for name, said in judged.items() if name.startswith("nominal") for v in said)),
        "calibrated": overall(tuple(v for name, said in judged.items() if name.startswith("calibrated") for v in said)),
    }


def _distance_record(found: DistanceAccuracy | None) -> Json | None:
    if found is None:
        return None
    return {"mean_mm": mm(found.mean_m), "rms_mm": mm(found.rms_m), "max_mm": mm(found.max_m), "pairs": found.pairs}


def _repeated_record(found: RepeatedPose) -> Json:
    return {
        "poses": list(found.poses),
        "visits": found.visits,
        "nominal_ap_mm": mm(found.nominal.position_m),
        "nominal_ap_rad": number(found.nominal.orientation_rad),
        "calibrated_ap_mm": mm(found.calibrated.position_m),
        "calibrated_ap_rad": number(found.calibrated.orientation_rad),
        "rp_mm": mm(found.repeatability_m),
        "rp_rad": _axes(found.repeatability_rad),
    }


def _axes(values: Array) -> Json:
    return {axis: number(value) for axis, value in zip("xyz", np.asarray(values), strict=True)}
