"""A comparison as ``comparison.json``: what other programs read. Keys may be added, never renamed."""

from core.json_values import Json, json_text, mm, number
from core.rivals.comparison import Comparison, ErrorSizes, MethodRow, Reference
from core.rivals.verdict import verdicts
from core.version import VERSION

COMPARISON_FORMAT = "trueaxis-comparison/1"


def comparison_to_json(found: Comparison) -> str:
    """The text of comparison.json."""
    return json_text(
        {
            "format": COMPARISON_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in rad; errors over all kept-out poses of all trials; mean_std: standard "
            "error of the mean over trials; null: not known",
            "title": found.title,
            "simulated": True,
            "trials": found.trials,
            "poses": found.poses,
            "methods": [_method(row) for row in found.rows],
            "references": [_reference(one) for one in found.references],
            "verdicts": list(verdicts(found)),
            "notes": list(found.notes),
        }
    )


def _method(row: MethodRow) -> Json:
    return {
        "name": row.name,
        "source": row.source,
        "own": row.own,
        "data": str(row.data),
        "drives": str(row.drives),
        "points": row.points,
        "position_mm": _sizes(row.position_m, 1e3),
        "orientation_rad": _sizes(row.orientation_rad, 1.0),
        "length_error_rms_mm": mm(row.length_error_m),
        "angle_error_rms_rad": number(row.angle_error_rad),
        "seconds": number(row.seconds),
        "failed_trials": row.failed,
        "note": row.note,
    }


def _sizes(sizes: ErrorSizes, scale: float) -> Json:
    return {name: number(getattr(sizes, name) * scale) for name in ("mean", "mean_std", "rms", "p95", "max")}


def _reference(one: Reference) -> Json:
    return {
        "name": one.name,
        "mean_position_mm": mm(one.position_m),
        "mean_orientation_rad": number(one.orientation_rad),
        "note": one.note,
    }
