"""Diagnoses made by hand: every part is invented, nothing is computed from the campaign but the points themselves."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from core.gap.result import (
    Cause,
    Cell,
    DetectionLimit,
    GapReport,
    LeftTest,
    NoiseModel,
    Outlier,
    Parameter,
    Place,
    Reliability,
    Rivals,
    Transfer,
    Verdict,
    Where,
)
from core.measurements import Campaign
from core.robot import Robot
from core.twin import scara
from core.twin.campaign import simulate_campaign

COMPLIANCE = Place("compliance", joint=2)
BACKLASH = Place("backlash", joint=3)
HYSTERESIS = Place("hysteresis", joint=3)
COUPLING = Place("coupling", joint=4, source=3)
FLEXURE = Place("flexure", joint=1)
UNKNOWN_5 = Place("unknown", joint=5)
NOISE = NoiseModel(
    stated_m=1.1e-4,
    used_m=1.3e-4,
    source="replicates",
    degrees_of_freedom=36.0,
    tail_degrees=np.inf,
    correlation=0.12,
    floor_rms_m=1.3e-4 * 3**0.5,
    floor_source="repeats",
)
EFFECTS_OF_JOINTS = (
    "zero_offset",
    "ratio",
    "eccentricity",
    "mesh",
    "backlash",
    "compliance",
    "axis_wobble",
    "latency",
    "hysteresis",
    "quantisation",
)


@lru_cache
def six_joints() -> Campaign:
    """The paper's arm, seen."""
    return simulate_campaign(1)


@lru_cache
def with_slide() -> Campaign:
    """An arm with a sliding joint, seen."""
    return simulate_campaign(1, scara.cell())


def explained(campaign: Campaign | None = None) -> GapReport:
    """Three causes take the gap down to the floor; the second of them has a twin."""
    campaign = six_joints() if campaign is None else campaign
    rows, shifts = _rows(campaign), _shifts(campaign, 3)
    rng = np.random.default_rng(7)
    noise = rng.normal(scale=NOISE.used_m, size=(len(rows), 3))
    difference = sum(shifts) + noise
    floor = NOISE.floor_rms_m
    steps = (9.0e-4, 5.0e-4, 3.0e-4, floor * 1.02)
    places = (
        (COMPLIANCE, (COMPLIANCE, FLEXURE), (Parameter("compliance_rad_per_nm", 3.1e-6, 2e-7),)),
        (BACKLASH, (BACKLASH,), (Parameter("gap_rad", 1.2e-3, 5e-5),)),
        (COUPLING, (COUPLING,), (Parameter("gain_1", 0.0123, 0.0004),)),
    )
    causes = tuple(
        _cause(place, twins, parameters, steps[k : k + 2], shifts[k])
        for k, (place, twins, parameters) in enumerate(places)
    )
    return _report(campaign, Verdict.EXPLAINED, steps[0], steps[-1], causes, difference, noise)


def partly_explained(campaign: Campaign | None = None) -> GapReport:
    """One cause is named, something unknown acts at joint 5, and more is left than noise."""
    whole = explained(campaign)
    first = replace(whole.causes[0], twins=(COMPLIANCE,))
    second = Cause(UNKNOWN_5, 0.8, (UNKNOWN_5,), (), 5e-4, 4e-4, 0.2, 0.15, whole.causes[1].shift_m)
    return replace(
        whole,
        verdict=Verdict.PARTLY_EXPLAINED,
        causes=(first, second),
        left_rms_m=4e-4,
        left_m=whole.left_m + whole.causes[2].shift_m,
        left_test=LeftTest("runs along the order of measurement", 1e-5, False),
    )


def unexplained(campaign: Campaign | None = None) -> GapReport:
    """A gap, and nothing that accounts for it."""
    whole = explained(campaign)
    return replace(
        whole,
        verdict=Verdict.UNEXPLAINED,
        causes=(),
        left_rms_m=whole.gap_rms_m,
        left_m=whole.difference_m,
        left_test=LeftTest("null bootstrap", 1e-4, False),
        rivals=(),
    )


def no_gap(campaign: Campaign | None = None) -> GapReport:
    """Real and sim differ by noise alone; there is next to nothing to show."""
    whole = explained(campaign)
    noise = whole.left_m
    return replace(
        whole,
        verdict=Verdict.NO_GAP,
        causes=(),
        gap_rms_m=NOISE.floor_rms_m,
        left_rms_m=NOISE.floor_rms_m,
        difference_m=noise,
        left_test=LeftTest("null bootstrap", 0.43, True),
        where=replace(whole.where, by_joint=np.zeros(campaign_joints(whole)), worst_region="no region stands out"),
        transfers=(),
        rivals=(),
        evidence_map=(),
        reliability=None,
        outliers=(),
    )


def barely_known(campaign: Campaign | None = None) -> GapReport:
    """Whatever may be missing is missing, and whatever may be not a number is not."""
    whole = unexplained(campaign)
    unknown = replace(NOISE, stated_m=None, source="residuals", tail_degrees=4.0, floor_source="unknown")
    lost = replace(
        explained(campaign).causes[1],
        parameters=(Parameter("gap_rad", 1e-3, np.nan),),
        share_closed=np.nan,
        share_closed_last=np.inf,
    )
    return replace(
        whole,
        verdict=Verdict.PARTLY_EXPLAINED,
        noise=unknown,
        causes=(lost,),
        where=replace(whole.where, sweep_directions=None, pose_directions=None, worst_rows=np.zeros(0, dtype=int)),
        left_test=LeftTest("", np.nan, False),
        limits=(),
        evidence_map=(),
        reliability=None,
        transfers=(),
        outliers=(),
    )


def campaign_joints(report: GapReport) -> int:
    return report.campaign.robot.joint_count


def renamed(campaign: Campaign, text: str) -> Campaign:
    """The campaign with a text wherever its files may carry one."""
    robot: Robot = replace(campaign.robot, name=text)
    targets = tuple(replace(target, name=f"{target.name}{text}") for target in campaign.targets)
    return replace(campaign, title=text, robot=robot, targets=targets, notes={**campaign.notes, text: text})


def hostile(text: str) -> GapReport:
    """Every text that may come from a file is this one."""
    whole = explained(renamed(six_joints(), text))
    place = Place("target_slip", target=text, record=3)
    return replace(
        whole,
        sim=text,
        causes=(replace(whole.causes[0], place=place, twins=(place,)), *whole.causes[1:]),
        where=replace(whole.where, worst_region=text),
        transfers=(replace(whole.transfers[0], fitted_on=text, predicted=text),),
        rivals=(replace(whole.rivals[0], places=(place, BACKLASH), next_measurement=text),),
        limits=(*whole.limits, DetectionLimit(place, 1e-4, "m", 1e-4)),
        evidence_map=(*whole.evidence_map, Cell(place, 40.0, 0.3)),
        warnings=(text,),
        notes=(text,),
        hold_out=text,
        left_test=replace(whole.left_test, name=text),
    )


def _report(campaign, verdict, gap_m, left_m, causes, difference, left) -> GapReport:
    n, rows = campaign.robot.joint_count, _rows(campaign)
    share = np.linspace(1.0, 2.0, n)
    worst = np.argsort(-np.linalg.norm(difference, axis=1))[:30]
    return GapReport(
        campaign=campaign,
        sim="the nominal model",
        rows=rows,
        difference_m=difference,
        left_m=left,
        verdict=verdict,
        gap_rms_m=gap_m,
        left_rms_m=left_m,
        noise=NOISE,
        causes=causes,
        where=Where(
            share / share.sum(),
            np.array([0.2, 0.3, 0.5]),
            np.array([0.5, 0.3, 0.2]),
            "joint 2 beyond 40 deg with the arm stretched out: 1.4 mm rms over 30 points",
            np.sort(worst),
        ),
        transfers=(
            Transfer("sweeps", "poses", 36, 9.5e-4, 2.6e-4),
            Transfer("first half", "second half", 80, 8.8e-4, 2.4e-4),
        ),
        left_test=LeftTest("null bootstrap", 0.31, True),
        limits=tuple(_limits(n)),
        rivals=(
            Rivals((COMPLIANCE, FLEXURE), "repeat the sweep of joint 2 with 6 kg at the tool.", 4.2),
            Rivals((Place("zero_offset", joint=6), Place("geometry", frame=5)), "no measurement of points would.", 0.0),
        ),
        outliers=(Outlier(int(campaign.measurements.record[rows[4]]), 3.1e-3),),
        warnings=("no approach moves were logged: lost motion cannot be tested",),
        evidence_map=tuple(_map(n)),
        reliability=Reliability(np.array([0.1, 0.5, 0.95]), np.array([0.12, 0.46, 0.97]), np.array([50, 20, 130])),
        hold_out="five blocks of time and of joint space",
        seconds=2.4,
        peak_memory_mb=310.0,
    )


def _rows(campaign: Campaign) -> np.ndarray:
    return np.flatnonzero(campaign.measurements.seen)


def _shifts(campaign: Campaign, count: int) -> list[np.ndarray]:
    """Smooth invented shifts of the points, the first the largest, (m, 3) each, m."""
    q = campaign.measurements.commanded[_rows(campaign)]
    sizes = np.array([6e-4, 3e-4, 1.5e-4])[:count]
    return [size * np.stack([np.sin(q[:, k]), np.cos(q[:, k]), np.sin(2 * q[:, k])], 1) for k, size in enumerate(sizes)]


def _cause(place, twins, parameters, steps, shift) -> Cause:
    before, after = steps
    return Cause(place, 0.97 - 0.02 * len(twins), twins, parameters, before, after, 0.6, 0.55, shift)


def _limits(joints: int):
    for joint in range(1, joints + 1):
        yield DetectionLimit(Place("zero_offset", joint=joint), 1e-4 * joint, "rad", 1e-4)
        yield DetectionLimit(Place("ratio", joint=joint), 2e-5 * joint, "1", 1e-4)
    yield DetectionLimit(Place("scale"), 3e-5, "1", 9e-5)
    yield DetectionLimit(Place("drift"), 5e-5, "m", 5e-5)


def _map(joints: int):
    for e, effect in enumerate(EFFECTS_OF_JOINTS):
        for joint in range(1, joints + 1):
            yield Cell(Place(effect, joint=joint), 3.0 * e + joint, (e * joints + joint) / (12 * joints))
    yield Cell(COUPLING, 12.0, 0.14)
    yield Cell(Place("coupling", joint=4, source=2), 2.0, 0.02)
    yield Cell(COMPLIANCE, 210.0, 0.7)
    yield Cell(FLEXURE, 205.0, 0.69)
    for effect in ("scale", "drift", "payload"):
        yield Cell(Place(effect), 1.0, 0.01)
    yield Cell(Place("geometry", frame=2), 5.0, 0.04)
