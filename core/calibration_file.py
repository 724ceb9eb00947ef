"""calibration.json -> CalibratedArm: what is needed to use a calibration, checked."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from core.arm import Arm
from core.calibrated_arm import CalibratedArm, KnownTarget, in_robot_base
from core.calibration import calibrated_robot
from core.calibration_json import CALIBRATION_FORMAT, FRAME_KEYS, FRAME_SCALES
from core.driven_robot import nominal_couplings
from core.errors import InputError
from core.estimate import ArmEstimate, Geometry
from core.function_fit import FunctionFit
from core.geometry import Array
from core.json_records import JsonRecord, read_json
from core.motion_forms import MotionForm, MotionFunction, coupling_form, transmission_form
from core.parameter_covariance import (
    COUPLING,
    TRANSMISSION,
    Parameter,
    ParameterCovariance,
    constants_of,
    frame_parameters,
)
from core.phi_convention import Convention, convention_of
from core.phi_model import PhiModel, axes, from_axes
from core.robot import Robot
from core.robot_json import robot_of_record, transform_of
from core.units import displacement_units, to_si

PHI_SLACK_RAD = 1e-9
SKEW = 1e-6
"""Correlations that differ by less between the halves of a covariance, or variances less negative, are rounding."""


def read_calibration(path: Path | str) -> CalibratedArm:
    """The calibrated arm of a calibration.json.

    Raises:
        InputError: the file is missing or unreadable, of another format, without a geometry (because a joint was not
            swept), or holds something that cannot be; one sentence says where.
    """
    top = read_json(Path(path), CALIBRATION_FORMAT)
    if "nominal_robot" not in top:
        raise top.failed("does not hold the nominal robot, expected a file that this version of calibrate has written")
    nominal = robot_of_record(top.record("nominal_robot"))
    frames = top.records("frames")
    if not frames or "base_to_instrument" not in top:
        raise top.failed("has no frames: the calibrated geometry needs a sweep of every joint")
    lines = nominal.axes_at_zero()
    convention = convention_of(nominal)
    geometry = _geometry(top, frames, nominal, convention)
    estimate = _estimate(top, nominal, geometry)
    chain = calibrated_robot(nominal, convention, from_axes(lines, convention)[1], estimate)
    base, robot = in_robot_base(nominal, convention, chain, geometry.base)
    return CalibratedArm(
        nominal=nominal,
        robot=robot,
        drives=estimate.arm,
        base=base,
        targets=_targets(top, nominal),
        noise_m=estimate.noise_m,
        last_axis_std_rad=_last_axis_std(top, nominal),
        home=_home(top, nominal),
        source=top.text("campaign") if "campaign" in top else "",
        digest=top.text("digest_sha256") if "digest_sha256" in top else "",
        covariance=_covariance(top, estimate),
    )


def _geometry(top: JsonRecord, frames: tuple[JsonRecord, ...], nominal: Robot, convention: Convention) -> Geometry:
    if len(frames) != nominal.joint_count - 1:
        raise top.failed(f"{len(frames)} frames for {nominal.joint_count} joints, expected one less than joints")
    for record, phi in zip(frames, convention.phi_rad, strict=True):
        if abs(np.deg2rad(record.number("phi_deg")) - phi) > PHI_SLACK_RAD:
            raise record.wrong("phi_deg", f"{np.rad2deg(phi):.12g}, as the nominal robot has it")
    values, std = (np.stack([_frame_row(record.record(key)) for record in frames]) for key in ("actual", "std"))
    model = PhiModel(convention.phi_rad, *values.T, sliding=nominal.sliding)
    unknown = np.full((values.size, values.size), np.nan)
    return Geometry(transform_of(top, "base_to_instrument"), model, std, unknown)


def _frame_row(record: JsonRecord) -> Array:
    return np.array([record.number(key) for key in FRAME_KEYS]) / FRAME_SCALES


def _estimate(top: JsonRecord, nominal: Robot, geometry: Geometry) -> ArmEstimate:
    """The estimate as far as the file has it; covariances that it has not are NaN."""
    n = nominal.joint_count
    drives, offsets = _transmissions(top, nominal)
    couplings = _couplings(top, nominal)
    direct = MotionFunction(transmission_form("direct"), np.zeros(0))
    functions = tuple(
        replace(direct if fit is None else MotionFunction(fit.form, fit.coefficients), offset=offset)
        for fit, offset in zip(drives, offsets, strict=True)
    )
    passive = tuple(
        plain if fit is None else MotionFunction(fit.form, fit.coefficients)
        for fit, plain in zip(couplings, nominal_couplings(nominal), strict=True)
    )
    return ArmEstimate(
        method=top.text("method"),
        arm=Arm(nominal, axes(geometry.model, geometry.base), functions, passive),
        axis_covariance=np.full((4 * n, 4 * n), np.nan),
        transmissions=drives,
        offset_std=np.full(n, np.nan),
        couplings=couplings,
        geometry=geometry,
        noise_m=to_si(top.number("noise_mm"), "mm"),
    )


def _transmissions(top: JsonRecord, nominal: Robot) -> tuple[tuple[FunctionFit | None, ...], list[float]]:
    """The drives, None where the file has none, and their offsets, rad or m."""
    fits: list[FunctionFit | None] = [None] * nominal.joint_count
    offsets = [0.0] * nominal.joint_count
    for record in top.records("transmissions"):
        joint = _joint(record, "joint", nominal) - 1
        slides = nominal.joints[joint].slides
        ratio = record.record("constants").number("N") if record.text("form") == "gear" else None
        fits[joint] = _function(record, _named(record, lambda name, r=ratio: transmission_form(name, r)), slides)
        unit = displacement_units(slides)[0]
        if f"offset_{unit}" in record:
            offsets[joint] = to_si(record.number(f"offset_{unit}"), unit)
    return tuple(fits), offsets


def _couplings(top: JsonRecord, nominal: Robot) -> tuple[FunctionFit | None, ...]:
    fits: list[FunctionFit | None] = [None] * nominal.joint_count
    for record in top.records("couplings"):
        joint = _joint(record, "to", nominal)
        coupling = nominal.coupling_into(joint)
        if coupling is None:
            raise record.wrong("to", "a joint that the nominal robot has a coupling into")
        form = _named(record, lambda name, gain=coupling.gain: coupling_form(name, gain))
        fits[joint - 1] = _function(record, form, nominal.joints[joint - 1].slides)
    return tuple(fits)


def _named(record: JsonRecord, find: Callable[[str], MotionForm]) -> MotionForm:
    try:
        return find(record.text("form"))
    except InputError as wrong:
        raise record.failed(str(wrong)) from None


def _function(record: JsonRecord, form: MotionForm, slides: bool) -> FunctionFit:
    """A fitted function with what the file keeps of it: no covariance between its constants, no residuals."""
    values, spread = record.record("coefficients"), record.record("std")
    names = form.coefficient_names
    unit = "mm" if slides else "rad"
    rms = [f"rms_{when}_{unit}" for when in ("before", "after")]
    before, after = (to_si(record.number(key), unit) if key in record else np.nan for key in rms)
    std = np.array([spread.number(name) if name in spread else np.nan for name in names])
    return FunctionFit(
        form=form,
        coefficients=np.array([values.number(name) for name in names]),
        covariance=np.diag(std**2),
        start=np.empty(0),
        residual=(),
        rms_before=before,
        rms_after=after,
        chi_square=np.nan,
        reason=record.text("reason") if "reason" in record else "",
    )


def _covariance(top: JsonRecord, estimate: ArmEstimate) -> ParameterCovariance | None:
    """How geometry and drives err together, if the file says it."""
    if "covariance" not in top:
        return None
    record = top.record("covariance")
    known = {str(parameter): parameter for parameter in _parameters(estimate)}
    names = record.get("parameters")
    if not isinstance(names, list) or len(set(map(str, names))) < len(names) or not set(map(str, names)) <= set(known):
        raise record.wrong("parameters", "a list of parameters of this calibration, each once")
    matrix = record.numbers("matrix", (len(names), len(names)))
    std = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    if (np.diag(matrix) < 0).any() or (np.abs(matrix - matrix.T) > SKEW * np.outer(std, std)).any():
        raise record.failed("matrix is not a covariance, expected a symmetric one with variances on its diagonal")
    unit = np.where(std > 0, std, 1.0)
    if names and np.linalg.eigvalsh(matrix / np.outer(unit, unit)).min() < -SKEW:
        raise record.failed("matrix is not a covariance, expected one that gives no combination a negative variance")
    return ParameterCovariance(tuple(known[str(name)] for name in names), matrix)


def _parameters(estimate: ArmEstimate) -> list[Parameter]:
    """Everything that a calibration can have estimated."""
    out = frame_parameters(estimate.arm.robot.joint_count)
    for part, fits in ((TRANSMISSION, estimate.transmissions), (COUPLING, estimate.couplings)):
        for joint, fit in enumerate(fits, 1):
            out += [] if fit is None else constants_of(part, joint, fit.form)
    return out


def _targets(top: JsonRecord, nominal: Robot) -> tuple[KnownTarget, ...]:
    """The targets whose places were found."""
    found = []
    for record in top.records("targets"):
        point = record.optional_numbers("point_mm", 3)
        if None in point:
            continue
        link = record.integer("link")
        if not 0 <= link <= nominal.joint_count:
            raise record.wrong("link", f"a link 0..{nominal.joint_count} of {nominal.name}")
        std = np.array([np.nan if v is None else v for v in record.optional_numbers("std_mm", 3)])
        found.append(KnownTarget(record.text("name"), link, np.array(point) * 1e-3, std * 1e-3))
    return tuple(found)


def _last_axis_std(top: JsonRecord, nominal: Robot) -> float:
    last = [record for record in top.records("axes") if record.integer("joint") == nominal.joint_count]
    known = last and "direction_std_rad" in last[0]
    return last[0].number("direction_std_rad") if known else np.nan


def _home(top: JsonRecord, nominal: Robot) -> Array | None:
    if "home_deg" not in top:
        return None
    n, slides = nominal.joint_count, nominal.sliding
    turned = top.optional_numbers("home_deg", n)
    slid = top.optional_numbers("home_mm", n) if "home_mm" in top else (None,) * n
    values = [slid[i] if slides[i] else turned[i] for i in range(n)]
    if None in values:
        raise top.failed("home_deg and home_mm together do not name a command for every joint")
    return np.array([to_si(v, displacement_units(bool(s))[0]) for v, s in zip(values, slides, strict=True)])


def _joint(record: JsonRecord, key: str, nominal: Robot) -> int:
    joint = record.integer(key)
    if not 1 <= joint <= nominal.joint_count:
        raise record.wrong(key, f"a joint 1..{nominal.joint_count} of {nominal.name}")
    return joint
