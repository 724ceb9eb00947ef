"""A joint axis as JSON."""

import numpy as np

from core.axes import AxisFit
from core.json_values import Json, json_text, mm, number, numbers, root_mean_square
from core.points_file import PlainSweep
from core.version import VERSION

AXIS_FORMAT = "trueaxis-axis/1"


def axis_to_json(sweep: PlainSweep, fit: AxisFit) -> str:
    """The axis of one sweep of points as the text of a JSON file; lengths in mm, in the instrument's frame."""
    return json_text(
        {
            "format": AXIS_FORMAT,
            "trueaxis": VERSION,
            "frame": "instrument",
            "kind": "prismatic" if fit.sliding else "revolute",
            "estimator": fit.estimator,
            **line_record(fit),
            **scatter_record(fit),
            "noise_mm": mm(fit.sigma_m),
            "targets": list(sweep.target_names),
            "radius_mm": None if fit.sliding else mm(fit.radius_m),
            "rejected": [int(k) + 1 for k in np.flatnonzero(~fit.used)],
        }
    )


def line_record(fit: AxisFit) -> Json:
    """Where an axis is and how well that is known. Through a sliding axis only the direction is known."""
    return {
        "point_mm": mm(fit.line.point_m),
        "direction": numbers(fit.line.direction),
        "point_std_mm": mm(fit.point_std_m),
        "direction_std_rad": number(fit.direction_std_rad),
    }


def scatter_record(fit: AxisFit) -> Json:
    """How the fitted points lie about an axis."""
    return {
        "rms_axial_mm": mm(fit.rms_axial_m),
        "rms_radial_mm": mm(fit.rms_radial_m),
        "rms_tangential_mm": mm(root_mean_square(fit.tangential_m[fit.used])),
        "points": len(fit.used),
        "used": int(np.count_nonzero(fit.used)),
        "noise_factor": number(fit.noise_factor),
    }
