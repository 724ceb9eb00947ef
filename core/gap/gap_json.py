"""A diagnosis as ``gap.json``: what other programs read. Keys may be added, never renamed."""

import numpy as np

from core.gap.parameter_units import shown_limit, shown_parameter
from core.gap.place_words import place_words
from core.gap.result import (
    Cause,
    Cell,
    DetectionLimit,
    GapReport,
    NoiseModel,
    Place,
    Reliability,
    Rivals,
    Transfer,
)
from core.gap.verdict_words import verdict_sentence
from core.json_values import Json, json_text, mm, number, numbers
from core.version import VERSION

GAP_FORMAT = "trueaxis-gap/1"
SWEEP_DIRECTIONS = ("axial", "radial", "tangential")
POSE_DIRECTIONS = ("x", "y", "z")


def gap_to_json(report: GapReport) -> str:
    """The text of gap.json."""
    return json_text(
        {
            "format": GAP_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in deg, unless a name says otherwise; std: standard uncertainty; null: not "
            "known",
            "robot": report.campaign.robot.name,
            "campaign": report.campaign.title,
            "digest_sha256": report.campaign.digest or None,
            "sim": report.sim,
            "verdict": str(report.verdict),
            "sentence": verdict_sentence(report),
            "points": len(report.rows),
            "hold_out": report.hold_out,
            "gap_rms_mm": mm(report.gap_rms_m),
            "floor_rms_mm": mm(report.noise.floor_rms_m),
            "floor_source": report.noise.floor_source,
            "within_calibration_rms_mm": mm(report.within_calibration_rms_m),
            "left_rms_mm": mm(report.left_rms_m),
            "left_is_noise": bool(report.left_test.left_is_noise),
            "left_test": {"name": report.left_test.name, "p_value": number(report.left_test.p_value)},
            "noise": noise_record(report.noise),
            "causes": [cause_record(cause) for cause in report.causes],
            "where": _where_record(report),
            "transfer": [_transfer_record(one) for one in report.transfers],
            "rivals": [_rivals_record(one) for one in report.rivals],
            "detection_limits": [_limit_record(one) for one in report.limits],
            "outliers": [_outlier_record(one.record, one.length_m) for one in report.outliers],
            "warnings": list(report.warnings),
            "notes": list(report.notes),
            "evidence": [_cell_record(one) for one in report.evidence_map],
            "reliability": _reliability_record(report.reliability),
            "seconds": number(report.seconds, 3),
            "peak_memory_mb": number(report.peak_memory_mb, 1),
        }
    )


def place_record(place: Place) -> Json:
    """An effect and where it sits; keys that do not apply are left out."""
    if place.effect == "coupling":
        keys: Json = {"from": place.source, "to": place.joint}
    else:
        keys = {"joint": place.joint, "from": place.source}
    keys |= {
        "frame": place.frame,
        "target": place.target,
        "record": place.record,
        "variable": place.variable,
    }
    return {"effect": place.effect, **{key: value for key, value in keys.items() if value is not None}}


def cause_record(cause: Cause) -> Json:
    """One cause; its class holds at least itself."""
    shown = [shown_parameter(parameter) for parameter in cause.parameters]
    return {
        **place_record(cause.place),
        "probability": number(cause.probability),
        "class": [place_record(place) for place in cause.twins or (cause.place,)],
        "parameters": {one.name: number(one.value) for one in shown},
        "std": {one.name: number(one.std) for one in shown},
        "gap_before_rms_mm": mm(cause.gap_before_rms_m),
        "gap_after_rms_mm": mm(cause.gap_after_rms_m),
        "share_closed": number(cause.share_closed),
        "share_closed_last": number(cause.share_closed_last),
        "text": place_words(cause.place),
    }


def noise_record(noise: NoiseModel) -> Json:
    """What was found of the noise of one coordinate of a point."""
    return {
        "sigma_stated_mm": None if noise.stated_m is None else mm(noise.stated_m),
        "sigma_used_mm": mm(noise.used_m),
        "model": {
            "scale": None if noise.stated_m is None else number(noise.used_m / noise.stated_m),
            "tails": "normal" if np.isinf(noise.tail_degrees) else "student",
            "tail_degrees_of_freedom": number(noise.tail_degrees),
            "correlation_along_order": number(noise.correlation),
        },
        "from": noise.source,
        "degrees_of_freedom": number(noise.degrees_of_freedom),
    }


def _where_record(report: GapReport) -> Json:
    where, directions = report.where, {}
    if where.sweep_directions is not None:
        directions |= _shares(SWEEP_DIRECTIONS, where.sweep_directions)
    if where.pose_directions is not None:
        directions |= _shares(POSE_DIRECTIONS, where.pose_directions)
    record = report.campaign.measurements.record[report.rows]
    return {
        "by_joint": [{"joint": k, "share": number(share)} for k, share in enumerate(where.by_joint, 1)],
        "by_direction": directions,
        "by_record": [
            {"record": int(one), "real_minus_sim_mm": difference, "left_mm": left}
            for one, difference, left in zip(record, mm(report.difference_m), mm(report.left_m), strict=True)
        ],
        "worst_region": where.worst_region,
        "worst_region_records": [int(one) for one in record[where.worst_rows]],
    }


def _shares(names: tuple[str, ...], values: np.ndarray) -> Json:
    return dict(zip(names, numbers(values), strict=True))


def _transfer_record(one: Transfer) -> Json:
    return {
        "fitted_on": one.fitted_on,
        "predicted": one.predicted,
        "points": one.points,
        "gap_before_rms_mm": mm(one.gap_before_rms_m),
        "gap_after_rms_mm": mm(one.gap_after_rms_m),
    }


def _rivals_record(one: Rivals) -> Json:
    return {
        "causes": [place_record(place) for place in one.places],
        "next_measurement": one.next_measurement,
        "separation_std": number(one.separation),
    }


def _limit_record(one: DetectionLimit) -> Json:
    size, unit = shown_limit(one)
    moved = one.rms_m if np.isfinite(size) else np.nan
    return {**place_record(one.place), "size": number(size), "unit": unit, "rms_mm": mm(moved)}


def _outlier_record(record: int, length_m: float) -> Json:
    return {"record": int(record), "length_mm": mm(length_m), "reason": "it stands out of the noise of all the others"}


def _cell_record(one: Cell) -> Json:
    return {
        **place_record(one.place),
        "log_evidence": number(one.evidence),
        "share_closed": number(one.share_closed),
    }


def _reliability_record(found: Reliability | None) -> list[Json] | None:
    if found is None:
        return None
    bins = zip(found.said, found.right, found.worlds, strict=True)
    return [{"said": number(said), "right": number(right), "worlds": int(worlds)} for said, right, worlds in bins]
