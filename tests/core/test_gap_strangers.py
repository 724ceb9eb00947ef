"""What no name describes is told as unknown, where it is; and names are not doubted for what is true beside them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from gap_cells import crane_cell, measured, scara_cell
from scipy.interpolate import CubicSpline
from scipy.signal import lfilter

from core.gap import posterior
from core.gap.analysis import analyse
from core.gap.diagnosis import Findings, diagnose
from core.gap.evidence import NOTHING, Chosen
from core.gap.folds import blocks
from core.gap.observations import observe
from core.gap.open_set import Stand
from core.gap.placement import place
from core.gap.posterior import NO_CAUSE, rivals
from core.gap.result import UNKNOWN, Place, Verdict
from core.gap.sim import Part, Sim, Slot
from core.geometry import Array
from core.measurements import Campaign

Field = Callable[[Sim], Array]


def bent(campaign: Campaign, shift_m: Field) -> Campaign:
    """A campaign whose points lie elsewhere by shifts (m, 3)."""
    seen = observe(campaign)
    sim = place(seen, np.ones(seen.count))
    points = campaign.measurements.point_m.copy()
    points[seen.rows] += shift_m(sim)
    return replace(campaign, measurements=replace(campaign.measurements, point_m=points))


def refraction(sim: Sim) -> Array:
    """Points sink with the square of their height."""
    height = sim.points_m()[:, 2] - sim.middle_m[2]
    return -2e-3 * (height**2)[:, None] * np.array([0.3, -0.2, 1.0])


def hose(sim: Sim) -> Array:
    """Joint 2 gives way by where joint 1 stands as well."""
    first, second = (sim.seen.active[:, j] / sim.seen.span[j] for j in (0, 1))
    angle = 1.5e-3 * np.sin(5.0 * first + 0.4) * np.cos(4.0 * second)
    return sim.moved_m({Slot(Part.DRIVE, 1): angle}) - sim.points_m()


def wander(sim: Sim) -> Array:
    """Joint 1 floats in its play: wherever it was left, it nearly stays."""
    steps = np.random.default_rng(1).normal(size=sim.seen.standstill.max() + 1)
    floating = np.clip(lfilter([np.sqrt(1 - 0.9**2)], [1.0, -0.9], steps), -1.5, 1.5)
    return sim.moved_m({Slot(Part.DRIVE, 0): 1e-4 * floating[sim.seen.standstill]}) - sim.points_m()


def sway(sim: Sim) -> Array:
    """The whole arm sways to and fro in the course of the day."""
    phase = np.array([0.3, 1.9, 4.0])
    return 2e-4 * np.sin(7.0 * sim.seen.time[:, None] + phase)


def hurry(sim: Sim) -> Array:
    """The whole arm sways to and fro too fast for any smooth function of time."""
    phase = np.array([0.3, 1.9, 4.0])
    return 3e-4 * np.sin(2 * np.pi * 16.3 * sim.seen.time[:, None] + phase)


def roam(sim: Sim) -> Array:
    """The whole arm wanders without aim: by chance nearly as far as a drift and a shift would bring it."""
    steps = np.random.default_rng(2).normal(size=(sim.seen.count, 3))
    way = np.cumsum(steps, axis=0)
    moments = np.linspace(sim.seen.time.min(), sim.seen.time.max(), sim.seen.count)
    there = np.column_stack([np.interp(sim.seen.time, moments, along) for along in way.T])
    return 3e-4 * there / np.sqrt(np.mean(np.sum(there**2, axis=1)))


def shake(sim: Sim) -> Array:
    """Joint 2 comes to rest a little elsewhere each time."""
    angles = 3e-4 * np.random.default_rng(2).normal(size=sim.seen.standstill.max() + 1)
    return sim.moved_m({Slot(Part.DRIVE, 1): angles[sim.seen.standstill]}) - sim.points_m()


def bump(sim: Sim) -> Array:
    """Joint 1 is off at one place of its way: many waves together look so, no single one does."""
    angle = 8e-4 * np.exp(-(((sim.seen.active[:, 0] - 0.2) / 0.22) ** 2))
    return sim.moved_m({Slot(Part.DRIVE, 0): angle}) - sim.points_m()


def bend(sim: Sim) -> Array:
    """The guide of joint 3 is bent: it tilts and shifts along a path through five places of its way."""
    x = sim.seen.active[:, 2]
    share = (x - x.min()) / np.ptp(x)
    places = np.random.default_rng(4).normal(size=(5, 6)) * [5e-4, 5e-4, 0, 2e-4, 2e-4, 1e-4]
    path = CubicSpline(np.linspace(0, 1, 5), places)(share)
    return sim.moved_m({Slot(Part.AXIS, 2, k): path[:, k] for k in range(6)}) - sim.points_m()


def cable(sim: Sim) -> Array:
    """A cable along the guide of joint 3 is taut at one end and slack at the other."""
    x = sim.seen.active[:, 2]
    share = (x - x.min()) / np.ptp(x)
    return sim.moved_m({Slot(Part.DRIVE, 2): 4e-4 * np.tanh((share - 0.6) / 0.12)}) - sim.points_m()


def test_a_bent_guide_is_named_and_what_errs_along_it_is_not_taken_for_one() -> None:
    found = diagnose(bent(measured(scara_cell()), bend))
    assert found.causes[0].place.same_as(Place("axis_wobble", joint=3))
    assert found.causes[0].probability > 0.9
    found = diagnose(bent(measured(scara_cell()), cable))
    assert found.causes[0].place.same_as(Place(UNKNOWN, joint=3))
    assert not any(cause.probability > 0.5 for cause in found.causes if cause.place.effect != UNKNOWN)


@pytest.mark.parametrize(
    ("field", "place_"),
    [
        (refraction, Place(UNKNOWN, variable="configuration")),
        (hose, Place(UNKNOWN, joint=2)),
        (wander, Place(UNKNOWN, joint=1)),
        (sway, Place(UNKNOWN, variable="time")),
        (hurry, Place(UNKNOWN, variable="time")),
        (shake, Place(UNKNOWN, joint=2)),
        (bump, Place(UNKNOWN, joint=1)),
    ],
    ids=["bent room", "joint by another", "floating joint", "swaying base", "hurrying base", "shaking joint", "bump"],
)
def test_what_has_no_name_is_located(field: Field, place_: Place) -> None:
    found = diagnose(bent(measured(crane_cell()), field))
    assert found.causes[0].place.same_as(place_)
    assert not any(cause.probability > 0.5 for cause in found.causes if cause.place.effect != UNKNOWN)


def test_a_base_that_wanders_is_not_said_to_drift_or_to_have_shifted() -> None:
    found = diagnose(bent(measured(crane_cell()), roam))
    assert {cause.place.effect for cause in found.causes} >= {"drift", "base_shift"}
    assert not any(cause.probability > 0.5 for cause in found.causes)


@pytest.mark.parametrize("rows", [(9,), (40,), (9, 10), (-4,)])
def test_one_point_that_is_far_off_is_an_outlier_and_no_change(rows: tuple[int, ...]) -> None:
    """A base that shifts just before it and back just after would explain it as well."""

    def slip_of_the_hand(sim: Sim) -> Array:
        out = np.zeros((sim.seen.count, 3))
        out[list(rows)] = [1.1e-3, -0.4e-3, 0.7e-3]
        return out

    found = diagnose(bent(measured(crane_cell()), slip_of_the_hand))
    assert found.verdict is Verdict.NO_GAP
    assert {one.record for one in found.outliers} >= {
        int(found.campaign.measurements.record[found.rows[k]]) for k in rows
    }


def test_what_follows_the_speed_of_a_joint_is_told_there() -> None:
    """Where the library does not know latency."""
    found = diagnose(measured(crane_cell(), "latency:2:10ms"), without=["latency"])
    assert found.causes[0].place.same_as(Place(UNKNOWN, joint=2))


def test_what_is_true_beside_a_cause_does_not_speak_against_it() -> None:
    """Of a mesh and a far smaller change of scale, neither given the other: the mesh explains more in its place."""
    seen = observe(measured(crane_cell(), "scale:-:500ppm", "mesh:3:0.03deg"))
    found = Findings(analyse(seen), seen, blocks(seen), told=False)
    scale = next(stand for stand in found.named if stand.place.effect == "scale")
    judge = replace(found.judge, found=Chosen(scale.groups, scale.sizes))
    named = judge.problem.named
    gains = judge.evidence.gains(named).evidence
    mesh = [k for k, g in enumerate(named) if judge.problem.candidates[g].place.effect == "mesh"]
    assert gains[mesh].max() > judge.evidence.gains(np.array(scale.groups)).evidence[0] + 100
    said = {(place.effect, place.joint): p for place, p in rivals(judge, scale, NOTHING)}
    assert said[("mesh", 3)] < 1e-6 < 0.1 < said[("scale", None)]


def test_a_name_that_nothing_speaks_for_is_less_probable_than_no_cause() -> None:
    seen = observe(measured(crane_cell(), "payload:-:2kg"))
    found = Findings(analyse(seen), seen, blocks(seen), told=False)
    judge, problem = found.judge, found.judge.problem
    given = Chosen(found.worth.groups, found.worth.sizes)
    gains = judge.evidence.gains(problem.named, given)
    least = int(np.argmin(gains.evidence))
    assert gains.evidence[least] < 0
    place, size = problem.candidates[problem.named[least]].place, float(gains.size[least])
    said = rivals(judge, Stand(place, (int(problem.named[least]),), (size,), 1.0), given)
    assert said[0][0] is NO_CAUSE or said[0][1] > next(p for one, p in said if one.same_as(place))


def test_a_rival_by_numbers_that_its_effect_never_has_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = observe(measured(crane_cell(), "payload:-:2kg"))
    found = Findings(analyse(seen), seen, blocks(seen), told=False)
    (stand,) = found.named
    before = {(place.effect, place.joint): p for place, p in rivals(found.judge, stand, NOTHING)}
    assert before[("ratio", 2)] > 0.1
    monkeypatch.setattr(posterior, "plausible", lambda one, chain: one.candidate.place.effect != "ratio")
    after = {(place.effect, place.joint): p for place, p in rivals(found.judge, stand, NOTHING)}
    assert after[("ratio", 2)] == 0.0
    assert after[("payload", None)] > before[("payload", None)]


def test_a_great_shift_between_two_moments_of_the_search_is_found_to_the_record() -> None:
    """Beside a joint error as large, the first look takes it for a drift."""
    found = diagnose(measured(crane_cell(), "base_shift:113:2mm", "eccentricity:2:0.2deg"))
    shift = next(cause.place for cause in found.causes if cause.place.effect == "base_shift")
    assert shift.record == pytest.approx(113, abs=3)
    assert any(cause.place == Place("eccentricity", joint=2) for cause in found.causes)
