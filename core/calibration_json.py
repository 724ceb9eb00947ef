"""A calibration as ``calibration.json``: what other programs read.

Lengths are in mm, angles in deg or rad as the keys say, everything in the instrument's frame; null: not known.
The same calibration gives the same text. Keys may be added, never renamed.
"""

import numpy as np

from core.axis_json import line_record, scatter_record
from core.calibration import APART, Calibration
from core.findings import Finding
from core.geometry import Array
from core.json_values import Json, degrees, json_text, mm, named, number, numbers, root_mean_square, transform_mm
from core.motion_json import coupling_records, transmission_records
from core.robot_json import robot_record
from core.sweep_fits import SweepFit
from core.version import VERSION
from core.wording import joint_list, parameter_unit

CALIBRATION_FORMAT = "trueaxis-calibration/1"
FRAME_KEYS = ("a_mm", "b_mm", "alpha_deg", "theta_deg")
FRAME_SCALES = np.array([1e3, 1e3, 180 / np.pi, 180 / np.pi])


def calibration_to_json(calibration: Calibration) -> str:
    """The text of calibration.json."""
    estimate = calibration.estimate
    return json_text(
        {
            "format": CALIBRATION_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in deg or rad as the keys say; std: standard uncertainty; null: not known",
            **_source_record(calibration),
            "method": estimate.method,
            "estimator": calibration.estimator,
            "frame": "instrument",
            "base_to_instrument": None if estimate.geometry is None else transform_mm(estimate.geometry.base),
            **_noise_record(calibration),
            "axes": _axis_records(calibration),
            "frames": _frame_records(calibration),
            "transmissions": transmission_records(calibration),
            "couplings": coupling_records(calibration),
            "covariance": _covariance_record(calibration),
            "findings": [_finding_record(finding) for finding in calibration.findings],
            "targets": _target_records(calibration),
            "sweeps": [_sweep_record(fit) for fit in calibration.found.fits],
            "rejected": _rejection_records(calibration),
            "not_swept": list(calibration.not_swept),
            "not_moved": list(calibration.not_moved),
            "notes": _notes(calibration),
            "nominal_robot": robot_record(calibration.campaign.robot),
        }
    )


def _covariance_record(calibration: Calibration) -> Json | None:
    """How the parameters err together: in SI, as their names say; constants of functions as they stand above."""
    covariance = calibration.estimate.covariance
    if covariance is None:
        return None
    return {
        "parameters": [str(parameter) for parameter in covariance.parameters],
        "matrix": [[number(value, 30) for value in row] for row in covariance.matrix],
    }


def _source_record(calibration: Calibration) -> Json:
    """What was calibrated, from which files, measured with what."""
    campaign = calibration.campaign
    instrument = campaign.instrument
    return {
        "robot": campaign.robot.name,
        "campaign": campaign.title,
        "digest_sha256": campaign.digest or None,
        "campaign_notes": dict(campaign.notes),
        "joint_values": campaign.joint_values,
        "instrument": {
            "kind": instrument.kind,
            "sigma_mm": None if instrument.sigma_m is None else mm(instrument.sigma_m),
            **instrument.description,
        },
        "conditions": _conditions(calibration),
        **_home_record(calibration),
    }


def _home_record(calibration: Calibration) -> Json:
    """Commands at the arm's marks: an entry a joint, null in the list of the other unit."""
    home, slides = calibration.campaign.home, calibration.campaign.robot.sliding
    if home is None:
        return {}
    record: Json = {"home_deg": degrees(np.where(slides, np.nan, home))}
    if slides.any():
        record["home_mm"] = mm(np.where(slides, home, np.nan))
    return record


def _conditions(calibration: Calibration) -> Json:
    """The range of what was recorded beside the points."""
    table, out = calibration.campaign.measurements, {}
    for name in ("time_s", "temperature_c", "arm_temperature_c", "payload_kg"):
        values: Array | None = getattr(table, name)
        if values is not None and np.isfinite(values).any():
            out[name] = {
                "min": number(np.nanmin(values)),
                "mean": number(np.nanmean(values)),
                "max": number(np.nanmax(values)),
            }
    return out


def _noise_record(calibration: Calibration) -> Json:
    refinement = calibration.refinement
    used = refinement.residuals.used
    return {
        "noise_mm": mm(calibration.estimate.noise_m),
        "noise": {
            "stated": refinement.noise.stated,
            "factor": number(refinement.noise.factor),
            "added_mm": mm(refinement.noise.added_m),
            "joint_by_joint_mm": mm(calibration.joint_by_joint.noise_m),
        },
        "points": {"used": int(used.sum()), "rejected": int((~used).sum())},
        "degrees_of_freedom": int(refinement.degrees_of_freedom),
        "unobservable": int(refinement.unobservable),
    }


def _axis_records(calibration: Calibration) -> list[Json]:
    """The axes at zero displacement, and how the points of each joint's own sweeps lie about them."""
    residuals = calibration.refinement.residuals
    own = _rows_of_axes(calibration.found.fits) & residuals.used
    records = []
    for joint in calibration.found.swept:
        kind = calibration.campaign.robot.joints[joint - 1].kind
        line = calibration.estimate.arm.axes[joint - 1]
        direction_std, point_std = calibration.estimate.axis_std(joint)
        mine = own & (residuals.joint == joint)
        records.append(
            {
                "joint": joint,
                "kind": str(kind),
                "frame": "instrument",
                "point_mm": mm(line.point_m),
                "direction": numbers(line.direction),
                "point_std_mm": None if kind == "prismatic" else mm(point_std),
                "direction_std_rad": number(direction_std),
                "rms_axial_mm": mm(root_mean_square(residuals.axial_m[mine])),
                "rms_radial_mm": mm(root_mean_square(residuals.radial_m[mine])),
                "rms_tangential_mm": mm(root_mean_square(residuals.tangential_m[mine])),
                "points": int(mine.sum()),
            }
        )
    return records


def _rows_of_axes(fits: tuple[SweepFit, ...]) -> np.ndarray:
    """Which rows of all sweeps, one after the other, show the swept joint alone, boolean, (m,)."""
    return np.concatenate([np.isin(np.arange(len(fit.sweep.rows)), fit.axis_rows) for fit in fits])


def _frame_records(calibration: Calibration) -> list[Json]:
    """The phi-model, frame by frame; none where a joint was not swept."""
    convention, nominal = calibration.convention, calibration.nominal
    actual, first = calibration.estimate.geometry, calibration.joint_by_joint.geometry
    if convention is None or nominal is None or actual is None:
        return []
    records = []
    for i, phi in enumerate(convention.phi_rad):
        record: Json = {
            "frame": i + 1,
            "phi_deg": degrees(phi),
            "nominal": _frame_values(nominal.parameters[i]),
            "actual": _frame_values(actual.model.parameters[i]),
            "std": _frame_values(actual.std[i]),
        }
        if first is not None:
            record["joint_by_joint"] = {
                "values": _frame_values(first.model.parameters[i]),
                "std": _frame_values(first.std[i]),
            }
        records.append(record)
    return records


def _frame_values(row: Array) -> Json:
    return named(FRAME_KEYS, row * FRAME_SCALES)


def _finding_record(finding: Finding) -> Json:
    unit, scale = parameter_unit(finding.parameter)
    where = {"frame": finding.frame, "joint": finding.joint}
    return {
        "text": finding.text,
        **{key: value for key, value in where.items() if value is not None},
        "parameter": f"{finding.parameter.rpartition('_')[0]}_{unit}" if unit else finding.parameter,
        "deviation": number(finding.deviation * scale),
        "std": number(finding.std * scale),
        "unit": unit or "1",
        "significant": finding.significant,
    }


def _target_records(calibration: Calibration) -> list[Json]:
    """Where the targets are when every joint is at zero."""
    refinement = calibration.refinement
    variance = np.diagonal(refinement.rest_covariance_m2, axis1=1, axis2=2)
    return [
        {"name": target.name, "link": target.link, "point_mm": mm(point), "std_mm": mm(np.sqrt(spread))}
        for target, point, spread in zip(calibration.campaign.targets, refinement.rest_points_m, variance, strict=True)
    ]


def _sweep_record(found: SweepFit) -> Json:
    """One sweep and its own axis, in the configuration in which it was measured."""
    sweep, fit = found.sweep, found.fit
    return {
        "joint": sweep.joint,
        "sweep": sweep.number,
        "axis": line_record(fit),
        **scatter_record(fit),
        "radius_mm": None if fit.sliding else mm(fit.radius_m),
        "noise_mm": mm(fit.sigma_m),
    }


def _rejection_records(calibration: Calibration) -> list[Json]:
    return [
        {
            "record": rejection.record,
            "joint": rejection.joint,
            "target": rejection.target,
            "reason": rejection.reason,
            "residual_mm": mm(rejection.residual_m),
        }
        for rejection in calibration.rejected
    ]


def _notes(calibration: Calibration) -> list[str]:
    """What these data cannot say, in sentences."""
    notes = []
    unknown = tuple(sorted({*calibration.not_swept, *calibration.not_moved}))
    if unknown:
        verb = "were" if len(unknown) > 1 else "was"
        notes.append(
            f"{joint_list(unknown)} {verb} not swept, so no frames are given: geometry needs the axis of every joint"
        )
    elif calibration.estimate.geometry is None:
        notes.append("an arm of one joint has no frames")
    if not calibration.refinement.tied:
        notes.append(APART)
    if calibration.refinement.unobservable:
        notes.append(
            f"{calibration.refinement.unobservable} combinations of parameters leave no trace in these points "
            "and are kept at the joint-by-joint values"
        )
    return notes
