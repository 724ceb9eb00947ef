"""A calibration and an axis in a few lines for a person at a terminal."""

from pathlib import Path

import numpy as np

from core.axes import AxisFit
from core.calibration import Calibration
from core.displacement import displacements
from core.points_file import PlainSweep

MOST_FINDINGS = 8


def calibration_summary(calibration: Calibration, folder: Path) -> str:
    """What was calibrated, how well, what stands out, and where the files are.

    Args:
        folder: where calibration.json, report.html and tables/ are.
    """
    robot, used = calibration.campaign.robot, calibration.refinement.residuals.used
    lines = [
        calibration.campaign.title or "(a campaign without a title)",
        f"  arm      {robot.name}, {robot.joint_count} joints{_unknown_joints(calibration)}",
        f"  points   {used.sum()} used, {(~used).sum()} rejected, {len(calibration.found.fits)} sweeps",
        f"  noise    {calibration.estimate.noise_m * 1e3:.3f} mm in one coordinate of a point",
        "",
        *_finding_lines(calibration),
        "",
        f"Written: {folder / 'calibration.json'}, {folder / 'report.html'}, {folder / 'tables'}",
    ]
    return "\n".join(lines)


def axis_summary(name: str, sweep: PlainSweep, fit: AxisFit) -> str:
    """Where an axis is, how well that is known, and how the points lie about it.

    Args:
        name: of the file of points.
    """
    line, noise = fit.line, "estimated from the points" if sweep.sigma_m is None else "stated"
    used = np.count_nonzero(fit.used)
    rows = [
        ("points", f"{used} used, {len(fit.used) - used} rejected, targets: {', '.join(sweep.target_names)}"),
        ("direction", f"{_vector(line.direction, 7)}  +- {fit.direction_std_rad * 1e3:.4f} mrad"),
    ]
    if fit.sliding:
        rows.append(("through", f"{_vector(line.point_m * 1e3, 3)} mm  (a sliding axis has no place of its own)"))
    else:
        rows.append(("point", f"{_vector(line.point_m * 1e3, 3)} mm  +- {fit.point_std_m * 1e3:.4f} mm"))
        rows.append(("radius", ", ".join(f"{radius * 1e3:.3f}" for radius in fit.radius_m) + " mm"))
    rows.append(("moved", _moved(sweep, fit)))
    if fit.sliding:
        rows.append(("residuals", f"{fit.rms_radial_m * 1e3:.4f} mm rms away from the line"))
    else:
        axial, radial = fit.rms_axial_m * 1e3, fit.rms_radial_m * 1e3
        rows.append(("residuals", f"{axial:.4f} mm rms along the axis, {radial:.4f} mm away from it"))
    rows.append(("noise", f"{fit.sigma_m * 1e3:.4f} mm in one coordinate of a point, {noise}"))
    head = f"{name}: the axis of a joint that {'slides' if fit.sliding else 'turns'}, in the instrument's frame"
    return "\n".join([head, *(f"  {label:<10} {text}" for label, text in rows)])


def _unknown_joints(calibration: Calibration) -> str:
    said = []
    for words, joints in (("not swept", calibration.not_swept), ("not moved", calibration.not_moved)):
        if joints:
            said.append(f"{words}: {', '.join(map(str, joints))}")
    return f" ({'; '.join(said)})" if said else ""


def _finding_lines(calibration: Calibration) -> list[str]:
    significant = [finding.text for finding in calibration.findings if finding.significant]
    if not significant:
        return ["Nothing departs significantly from the nominal arm."]
    more = len(significant) - MOST_FINDINGS
    lines = [f"Significant findings ({len(significant)}):", *(f"  - {text}" for text in significant[:MOST_FINDINGS])]
    return [*lines, f"  and {more} more in the report"] if more > 0 else lines


def _vector(values: np.ndarray, decimals: int) -> str:
    return "  ".join(f"{value + 0.0:.{decimals}f}" for value in values)


def _moved(sweep: PlainSweep, fit: AxisFit) -> str:
    """How far the joint really went, and how far it was asked to."""
    unit, scale = ("mm", 1e3) if fit.sliding else ("deg", 180 / np.pi)
    _, first, stop = np.unique(sweep.stop, return_index=True, return_inverse=True)
    asked = None if sweep.commanded is None else sweep.commanded[first]
    moved = displacements(fit, sweep.point_m, stop=stop, target=sweep.target, commanded=asked).value
    seen = np.isfinite(moved)
    text = f"{np.ptp(moved[seen]) * scale:.4f} {unit}"
    return text if asked is None else f"{text}, commanded {np.ptp(asked[seen]) * scale:.4f} {unit}"
