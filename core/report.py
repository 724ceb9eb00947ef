"""What a calibration says, as tables: one row a thing, plain column names with units, numbers in full.

They are written as CSV files and shown in the report. Lengths are mm and angles deg, unless the name of a column says
otherwise; where joints that turn and joints that slide share a column, a column ``unit`` tells which it is.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pandas as pd

from core.calibration import Calibration
from core.estimate import ArmEstimate
from core.function_fit import FunctionFit
from core.phi_model import PARAMETERS
from core.sweep_fits import SweepFit
from core.wording import display_unit, parameter_unit


@dataclass(frozen=True)
class Table:
    """One table of the report."""

    name: str
    """Stem of its file name."""
    title: str
    frame: pd.DataFrame
    note: str = ""


def tables(calibration: Calibration) -> tuple[Table, ...]:
    """All tables of a calibration; those about things that it does not have are empty, with their columns."""
    return (
        sweeps_table(calibration),
        axes_table(calibration),
        parameters_table(calibration),
        transmissions_table(calibration),
        couplings_table(calibration),
        constants_table(calibration),
        candidates_table(calibration),
        zeros_table(calibration),
        findings_table(calibration),
        rejected_table(calibration),
        targets_table(calibration),
        residuals_table(calibration),
    )


def sweeps_table(calibration: Calibration) -> Table:
    """Table 1 as acquired: one row a sweep, in the order of measurement."""
    rows = [
        {"order": order, **_sweep_row(calibration, found, calibration.refinement.residuals.used[here])}
        for order, (found, here) in enumerate(sweep_rows(calibration), 1)
    ]
    columns = _columns("order joint sweep first last span unit intervals points extra_point targets used rejected")
    note = (
        "Spans are of the commanded displacement. An extra point rides beyond the next joint: it shows how far that "
        "joint is dragged along."
    )
    return Table("sweeps", "What was measured", pd.DataFrame(rows, columns=columns), note)


def axes_table(calibration: Calibration) -> Table:
    """The axis of every swept joint when all joints are at zero, by both methods."""
    rows = []
    for joint in calibration.found.swept:
        for estimate in (calibration.estimate, calibration.joint_by_joint):
            rows.append(_axis_row(calibration, estimate, joint))
    columns = [
        "joint",
        "kind",
        "method",
        "x_mm",
        "y_mm",
        "z_mm",
        "point_std_mm",
        "direction_x",
        "direction_y",
        "direction_z",
        "direction_std_rad",
        "rms_axial_mm",
        "rms_radial_mm",
        "points",
    ]
    note = "Axes in the instrument's frame with every joint at zero; directions point in the positive sense of motion."
    return Table("axes", "Joint axes", pd.DataFrame(rows, columns=columns), note)


def parameters_table(calibration: Calibration) -> Table:
    """Table 2: every parameter of the phi-model, nominal against actual."""
    columns = [
        "frame",
        "phi_deg",
        "parameter",
        "unit",
        "nominal",
        "actual",
        "difference",
        "std",
        "significance",
        "significant",
        "fixed",
        "joint_by_joint",
        "joint_by_joint_std",
    ]
    rows = list(_parameter_rows(calibration))
    note = "" if rows else "The phi-model needs a sweep of every joint; this campaign does not have one."
    return Table("parameters", "Geometry: nominal and actual", pd.DataFrame(rows, columns=columns), note)


def transmissions_table(calibration: Calibration) -> Table:
    """The drive of every swept joint: family of its function, and the error before and after the fit."""
    rows = []
    for joint, fit in enumerate(calibration.estimate.transmissions, 1):
        if fit is None:
            continue
        rows.append({"joint": joint, **_function_row(fit, bool(calibration.campaign.robot.sliding[joint - 1]))})
    columns = ["joint", *_FUNCTION_COLUMNS]
    note = "Functions map the actual displacement of a joint to the commanded one."
    return Table("transmissions", "Drives", pd.DataFrame(rows, columns=columns), note)


def couplings_table(calibration: Calibration) -> Table:
    """The passive motion of each coupled joint that was observed."""
    robot, rows = calibration.campaign.robot, []
    for joint, fit in enumerate(calibration.estimate.couplings, 1):
        if fit is None:
            continue
        row = _function_row(fit, bool(robot.sliding[joint - 1]))
        rows.append({"from": joint - 1, "to": joint, "nominal_gain": float(robot.coupling_gains[joint - 1]), **row})
    columns = ["from", "to", "nominal_gain", *_FUNCTION_COLUMNS]
    note = "Functions map the active displacement of one joint to the passive one of the next."
    return Table("couplings", "Couplings", pd.DataFrame(rows, columns=columns), note)


def constants_table(calibration: Calibration) -> Table:
    """The constants of all functions, by both methods; SI units (rad, or plain numbers)."""
    rows = []
    for kind in ("transmission", "coupling"):
        refined, start = (getattr(e, f"{kind}s") for e in (calibration.estimate, calibration.joint_by_joint))
        for joint, (fit, first) in enumerate(zip(refined, start, strict=True), 1):
            if fit is None:
                continue
            for k, name in enumerate(fit.form.coefficient_names):
                same = first is not None and first.form.name == fit.form.name
                rows.append(
                    {
                        "kind": kind,
                        "joint": joint,
                        "family": fit.form.name,
                        "constant": name,
                        "unit": constant_unit(fit, name),
                        "value": fit.coefficients[k],
                        "std": fit.std[k],
                        "joint_by_joint": first.coefficients[k] if same else np.nan,
                        "joint_by_joint_std": first.std[k] if same else np.nan,
                    }
                )
    columns = _columns("kind joint family constant unit value std joint_by_joint joint_by_joint_std")
    return Table("constants", "Constants of the functions", pd.DataFrame(rows, columns=columns))


def candidates_table(calibration: Calibration) -> Table:
    """The families that were tried for every function."""
    rows = []
    for kind in ("transmission", "coupling"):
        for joint, fit in enumerate(getattr(calibration.estimate, f"{kind}s"), 1):
            if fit is None:
                continue
            unit, scale = display_unit(bool(calibration.campaign.robot.sliding[joint - 1]))
            for candidate in fit.candidates:
                rows.append(
                    {
                        "kind": kind,
                        "joint": joint,
                        "family": candidate.name,
                        "constants": candidate.constants,
                        "rms": candidate.rms * scale,
                        "unit": unit,
                        "chi_square": candidate.chi_square,
                        "probability": candidate.probability,
                        "chosen": candidate.name == fit.form.name,
                    }
                )
    columns = _columns("kind joint family constants rms unit chi_square probability chosen")
    return Table("candidates", "Families that were compared", pd.DataFrame(rows, columns=columns))


def zeros_table(calibration: Calibration) -> Table:
    """What every swept joint reads at the arm's marks, and the offset of its transducer."""
    campaign, estimate, rows = calibration.campaign, calibration.estimate, []
    at_zero = estimate.arm.commanded_for(np.zeros(campaign.robot.joint_count))[0]
    for joint in calibration.found.swept:
        unit, scale = display_unit(campaign.robot.joints[joint - 1].slides)
        known = campaign.home is not None
        rows.append(
            {
                "joint": joint,
                "reading_at_marks": campaign.home[joint - 1] * scale if known else np.nan,
                "command_for_zero": at_zero[joint - 1] * scale,
                "offset": estimate.arm.transmissions[joint - 1].offset * scale if known else np.nan,
                "offset_std": estimate.offset_std[joint - 1] * scale if known else np.nan,
                "unit": unit,
            }
        )
    columns = _columns("joint reading_at_marks command_for_zero offset offset_std unit")
    note = (
        "Displacement counts from the arm's marks."
        if campaign.home is not None
        else "The campaign does not say what the joints read at the arm's marks: displacement counts from command zero."
    )
    return Table("zeros", "Zeros", pd.DataFrame(rows, columns=columns), note)


def findings_table(calibration: Calibration) -> Table:
    """What deviates from the design, the significant ones first."""
    rows = []
    for finding in calibration.findings:
        unit, scale = parameter_unit(finding.parameter)
        rows.append(
            {
                "text": finding.text,
                "frame": finding.frame,
                "joint": finding.joint,
                "parameter": finding.parameter,
                "deviation": finding.deviation * scale,
                "std": finding.std * scale,
                "unit": unit,
                "significance": abs(finding.deviation) / finding.std if finding.std > 0 else np.nan,
                "significant": finding.significant,
            }
        )
    columns = _columns("text frame joint parameter deviation std unit significance significant")
    frame = pd.DataFrame(rows, columns=columns).astype({"frame": "Int64", "joint": "Int64"})
    return Table("findings", "Findings", frame, "Significant: more than two standard uncertainties off the design.")


def rejected_table(calibration: Calibration) -> Table:
    """Points that were left out, and why."""
    rows = [
        {
            "record": r.record,
            "joint": r.joint,
            "target": r.target,
            "residual_mm": r.residual_m * 1e3,
            "reason": r.reason,
        }
        for r in calibration.rejected
    ]
    return Table(
        "rejected",
        "Rejected points",
        pd.DataFrame(rows, columns=["record", "joint", "target", "residual_mm", "reason"]),
    )


def targets_table(calibration: Calibration) -> Table:
    """Where the targets are when every joint is at zero, in the instrument's frame."""
    rows = []
    for k, target in enumerate(calibration.campaign.targets):
        place = calibration.refinement.rest_points_m[k] * 1e3
        if not np.isfinite(place).all():
            continue
        std = np.sqrt(np.trace(calibration.refinement.rest_covariance_m2[k])) * 1e3
        rows.append(
            {
                "target": target.name,
                "link": target.link,
                "x_mm": place[0],
                "y_mm": place[1],
                "z_mm": place[2],
                "std_mm": std,
            }
        )
    columns = _columns("target link x_mm y_mm z_mm std_mm")
    return Table("targets", "Targets at zero", pd.DataFrame(rows, columns=columns))


def residuals_table(calibration: Calibration) -> Table:
    """Measured minus predicted, one row a point of a sweep."""
    residuals, table = calibration.refinement.residuals, calibration.campaign.measurements
    row = residuals.row
    names = np.array([t.name for t in calibration.campaign.targets], dtype=object)
    frame = pd.DataFrame(
        {
            "record": table.record[row],
            "joint": residuals.joint,
            "sweep": table.sweep[row],
            "step": table.step[row],
            "target": names[table.target[row]],
            "x_mm": residuals.residual_m[:, 0] * 1e3,
            "y_mm": residuals.residual_m[:, 1] * 1e3,
            "z_mm": residuals.residual_m[:, 2] * 1e3,
            "axial_mm": residuals.axial_m * 1e3,
            "radial_mm": residuals.radial_m * 1e3,
            "tangential_mm": residuals.tangential_m * 1e3,
            "used": residuals.used,
            "outlier_probability": residuals.outlier_probability,
        }
    )
    return Table("residuals", "Residuals", frame, "Measured minus predicted.")


def sweep_rows(calibration: Calibration) -> Iterator[tuple[SweepFit, slice]]:
    """Every sweep with its place in the refinement's residuals."""
    at = 0
    for found in calibration.found.fits:
        count = len(found.sweep.rows)
        yield found, slice(at, at + count)
        at += count


def _clean(value: float) -> float:
    """Zero instead of what rounding leaves of it: a millionth of a nanometre or of a degree means nothing."""
    return 0.0 if abs(value) < 1e-9 else float(value)


def _columns(names: str) -> list[str]:
    return names.split()


def constant_unit(fit: FunctionFit, name: str) -> str:
    """The unit of a constant: amplitudes of periodic errors are angles, everything else is a plain number."""
    return "rad" if name[0] in "sc" and fit.form.name != "arctangent" else "1"


_FUNCTION_COLUMNS = ("family", "formula", "rms_before", "rms_after", "unit", "reason")


def _sweep_row(calibration: Calibration, found: SweepFit, used: np.ndarray) -> dict[str, object]:
    campaign, sweep = calibration.campaign, found.sweep
    unit, scale = display_unit(campaign.robot.joints[sweep.joint - 1].slides)
    travel = sweep.commanded[:, sweep.joint - 1] * scale
    stops, seen = len(travel), len(np.unique(sweep.target))
    counted = f"{seen} x {stops}" if seen > 1 else str(stops)
    return {
        "joint": sweep.joint,
        "sweep": sweep.number,
        "first": travel[0],
        "last": travel[-1],
        "span": np.ptp(travel),
        "unit": unit,
        "intervals": stops - 1,
        "points": counted if seen * stops == len(sweep.rows) else f"{len(sweep.rows)} of {counted}",
        "extra_point": "yes" if len(found.axis_rows) < len(sweep.rows) else "no",
        "targets": ", ".join(campaign.targets[k].name for k in dict.fromkeys(sweep.target.tolist())),
        "used": int(used.sum()),
        "rejected": int((~used).sum()),
    }


def _function_row(fit: FunctionFit, slides: bool) -> dict[str, object]:
    unit, scale = display_unit(slides)
    return {
        "family": fit.form.name,
        "formula": "; ".join([fit.form.formula, *(f"{k} = {v:.6g}" for k, v in fit.form.constants().items())]),
        "rms_before": fit.rms_before * scale,
        "rms_after": fit.rms_after * scale,
        "unit": unit,
        "reason": fit.reason,
    }


def _axis_row(calibration: Calibration, estimate: ArmEstimate, joint: int) -> dict[str, object]:
    slides = calibration.campaign.robot.joints[joint - 1].slides
    line, (turn_std, place_std) = estimate.arm.axes[joint - 1], estimate.axis_std(joint)
    residuals = calibration.refinement.residuals
    mine = (residuals.joint == joint) & residuals.used
    if estimate is calibration.estimate:
        axial, radial, points = residuals.axial_m[mine], residuals.radial_m[mine], int(mine.sum())
    else:
        fits = [f.fit for f in calibration.found.fits if f.sweep.joint == joint]
        axial = np.concatenate([np.where(f.sliding, np.nan, f.axial_m[f.used]) for f in fits])
        across = [np.hypot(f.radial_m, f.tangential_m) if f.sliding else f.radial_m for f in fits]
        radial = np.concatenate([a[f.used] for a, f in zip(across, fits, strict=True)])
        points = len(axial)
    place = np.full(3, np.nan) if slides else line.point_m * 1e3
    return {
        "joint": joint,
        "kind": calibration.campaign.robot.joints[joint - 1].kind.value,
        "method": estimate.method,
        **dict(zip(("x_mm", "y_mm", "z_mm"), place, strict=True)),
        "point_std_mm": np.nan if slides else place_std * 1e3,
        **dict(zip(("direction_x", "direction_y", "direction_z"), line.direction, strict=True)),
        "direction_std_rad": turn_std,
        "rms_axial_mm": float(np.sqrt(np.mean(axial**2))) * 1e3,
        "rms_radial_mm": float(np.sqrt(np.mean(radial**2))) * 1e3,
        "points": points,
    }


def _parameter_rows(calibration: Calibration) -> Iterator[dict[str, object]]:
    geometry, start = calibration.estimate.geometry, calibration.joint_by_joint.geometry
    nominal, convention = calibration.nominal, calibration.convention
    if geometry is None or nominal is None or convention is None:
        return
    for i, k in np.ndindex(convention.free.shape):
        unit, scale = parameter_unit(PARAMETERS[k])
        free, std = bool(convention.free[i, k]), geometry.std[i, k]
        design, actual = nominal.parameters[i, k], geometry.model.parameters[i, k]
        yield {
            "frame": i + 1,
            "phi_deg": np.rad2deg(nominal.phi_rad[i]),
            "parameter": PARAMETERS[k].split("_")[0],
            "unit": unit,
            "nominal": _clean(design * scale),
            "actual": _clean(actual * scale),
            "difference": _clean((actual - design) * scale),
            "std": std * scale,
            "significance": abs(actual - design) / std if free and std > 0 else np.nan,
            "significant": bool(free and abs(actual - design) > 2 * std),
            "fixed": not free,
            "joint_by_joint": _clean(start.model.parameters[i, k] * scale) if start is not None else np.nan,
            "joint_by_joint_std": start.std[i, k] * scale if start is not None else np.nan,
        }
