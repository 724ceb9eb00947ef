"""Faults of simulated cells found by name or class with their sizes, nothing where nothing is, the corrected sim."""

from dataclasses import replace
from functools import cache, partial
from itertools import pairwise

import numpy as np
import pytest
from gap_cells import crane_cell, measured, scara_cell

from core.gap.corrected import Diagnosis, realised_closure
from core.gap.diagnosis import diagnose
from core.gap.ledger import closed_share, ledger
from core.gap.result import UNKNOWN, Place, Verdict
from core.twin.forward import DRIFT_DIRECTION, SLIP_DIRECTION

DEG = np.pi / 180
SPREADS = 4.0
"""Standard deviations that a parameter may be off by."""
TWO = ("backlash:1:0.05deg", "ratio:3:0.2%")


CELLS = {"crane": crane_cell, "coupled": partial(crane_cell, 4), "scara": scara_cell}


@cache
def report(cell: str, *effects: str) -> Diagnosis:
    return diagnose(measured(CELLS[cell](), *effects))


def duration_s(found: Diagnosis) -> float:
    """Between the first and the last point."""
    time_s = found.campaign.measurements.time_s
    return float(time_s[-1] - time_s[0])


FOUND = (
    ("coupled", "geometry:2.a:0.5mm", Place("geometry", frame=2), {}),
    ("crane", "zero_offset:2:0.1deg", Place("zero_offset", joint=2), {"offset_rad": 0.1 * DEG}),
    ("crane", "ratio:2:0.3%", Place("ratio", joint=2), {"error_1": 0.003}),
    (
        "crane",
        "eccentricity:3:0.05deg",
        Place("eccentricity", joint=3),
        {"sine_rad": 0.04 * DEG, "cosine_rad": 0.03 * DEG},
    ),
    ("crane", "backlash:1:0.05deg", Place("backlash", joint=1), {"gap_rad": 0.05 * DEG}),
    ("crane", "hysteresis:1:0.06deg", Place("hysteresis", joint=1), {"loss_rad": 0.06 * DEG}),
    ("crane", "compliance:3:20urad/Nm", Place("compliance", joint=3), {"give_rad_per_nm": 2e-5}),
    ("crane", "flexure:2:10urad/Nm", Place("flexure", joint=2), {}),
    ("crane", "payload:-:10kg", Place("payload"), {}),
    ("crane", "coupling:1-2:0.2%", Place("coupling", joint=2, source=1), {"gain_1": 0.002}),
    ("crane", "axis_wobble:1:0.05deg", Place("axis_wobble", joint=1), {}),
    ("coupled", "latency:2:10ms", Place("latency", joint=2), {"delay_s": 0.010}),
    ("crane", "latency:all:5ms", Place("latency"), {"delay_s": 0.005}),
    ("coupled", "thermal:all:30ppm/K", Place("thermal"), {}),
    ("crane", "base_shift:200:0.5mm", Place("base_shift"), {}),
    ("crane", "scale:-:500ppm", Place("scale"), {"error_1": 5e-4}),
    ("crane", "linkage:3:0.5%", Place("linkage", joint=3), {}),
    ("scara", "ratio:3:0.1%", Place("ratio", joint=3), {"error_1": 0.001}),
    ("scara", "backlash:3:80um", Place("backlash", joint=3), {}),
)


@pytest.mark.parametrize(("cell", "effect", "place", "sizes"), FOUND, ids=[f"{c} {e}" for c, e, *_ in FOUND])
def test_a_fault_of_obvious_size_is_found(cell: str, effect: str, place: Place, sizes: dict[str, float]) -> None:
    found = report(cell, effect)
    assert found.verdict is Verdict.EXPLAINED
    (cause,) = found.causes
    assert any(place.same_as(one) for one in cause.twins)
    numbers = {p.name: p for p in cause.parameters} if cause.place.same_as(place) else {}
    for name, size in sizes.items() if numbers else ():
        assert numbers[name].value == pytest.approx(size, abs=SPREADS * numbers[name].std)
        assert numbers[name].std < 0.2 * abs(size)
    assert found.left_rms_m < 1.5 * found.noise.floor_rms_m
    assert closed_share(found) > 0.9


@pytest.mark.parametrize(
    ("cell", "effect", "order"),
    [("crane", "mesh:2:0.03deg", ("order_1", 9.5)), ("scara", "mesh:3:60um", ("lead_m", 0.04 / 9.5))],
)
def test_a_mesh_error_is_found_with_its_order(cell: str, effect: str, order: tuple[str, float]) -> None:
    """Of a sliding joint the lead; whether it comes once or several times a turn of the spindle is not known."""
    found = report(cell, effect)
    (cause,) = found.causes
    joint = int(effect.split(":")[1])
    assert any(place.same_as(Place("mesh", joint=joint)) for place in cause.twins)
    numbers = {p.name: p for p in cause.parameters}
    assert numbers[order[0]].value == pytest.approx(order[1], rel=0.01)
    size = 0.03 * DEG if cell == "crane" else 60e-6
    unit = "rad" if cell == "crane" else "m"
    assert np.hypot(numbers[f"sine_{unit}"].value, numbers[f"cosine_{unit}"].value) == pytest.approx(size, rel=0.1)


@pytest.mark.parametrize("effect", ["quantisation:2:0.05deg", "quantisation:all:0.05deg"])
def test_steps_of_encoders_are_found_with_their_size(effect: str) -> None:
    """Arcs of equal steps make steps of many sizes look alike: only whole ones are believed."""
    found = report("crane", effect)
    _, joint, size = effect.split(":")
    (cause,) = found.causes
    assert cause.place == Place("quantisation", joint=None if joint == "all" else int(joint))
    numbers = {p.name: p.value for p in cause.parameters}
    assert numbers["share_1"] == pytest.approx(1.0, abs=0.05)
    steps = [value for name, value in numbers.items() if name.startswith("step_of_joint")]
    assert steps == pytest.approx([float(size.removesuffix("deg")) * DEG] * len(steps), rel=1e-3)
    assert len(steps) == (3 if joint == "all" else 1)


def test_what_creeps_and_slips_is_found_with_its_vector() -> None:
    drift = report("crane", "drift:-:0.2mm/h")
    numbers = {p.name: p for p in drift.causes[0].parameters}
    expected = 0.2e-3 * duration_s(drift) / 3600 * DRIFT_DIRECTION
    for axis, value in zip("xyz", expected, strict=True):
        assert numbers[f"shift_along_{axis}_m"].value == pytest.approx(
            value, abs=SPREADS * numbers[f"shift_along_{axis}_m"].std
        )
    slip = report("crane", "target_slip:A@150:0.5mm")
    assert slip.causes[0].place.same_as(Place("target_slip", target="A"))
    assert slip.causes[0].place.record == pytest.approx(150, abs=6)
    numbers = {p.name: p for p in slip.causes[0].parameters}
    for axis, value in zip("xyz", 0.5e-3 * SLIP_DIRECTION, strict=True):
        found = numbers[f"shift_along_{axis}_m"]
        assert found.value == pytest.approx(value, abs=SPREADS * found.std + 0.02 * 0.5e-3)


@pytest.mark.parametrize(("cell", "seed"), [("crane", 1), ("crane", 2), ("coupled", 1), ("scara", 1)])
def test_nothing_wrong_is_no_gap(cell: str, seed: int) -> None:
    found = diagnose(measured(CELLS[cell](), seed=seed))
    assert found.verdict is Verdict.NO_GAP
    assert found.causes == ()
    assert found.outliers == ()
    # Instrument and repeatability; the scale is good to a tenth.
    noise_m = np.hypot(2e-5, 1e-5 / np.sqrt(8 / np.pi))
    assert found.noise.used_m == pytest.approx(noise_m, rel=0.1)
    assert found.gap_rms_m == pytest.approx(np.sqrt(3) * noise_m, rel=0.1)
    assert found.limits


def test_two_faults_are_both_found() -> None:
    found = report("crane", *TWO)
    assert len(found.causes) == 2
    assert found.verdict is Verdict.EXPLAINED
    for place in (Place("backlash", joint=1), Place("ratio", joint=3)):
        assert any(place.same_as(twin) for cause in found.causes for twin in cause.twins)


class TestBooks:
    """Figures of one report agree with each other."""

    @pytest.fixture(params=[("ratio:2:0.3%",), TWO])
    def found(self, request: pytest.FixtureRequest) -> Diagnosis:
        return report("crane", *request.param)

    def test_the_ledger_adds_up(self, found: Diagnosis) -> None:
        assert sum(line.square_m2 for line in ledger(found)) == pytest.approx(found.gap_rms_m**2)

    def test_causes_shrink_the_gap_step_by_step(self, found: Diagnosis) -> None:
        steps = [found.causes[0].gap_before_rms_m, *(c.gap_after_rms_m for c in found.causes)]
        assert all(after < before for before, after in pairwise(steps))
        assert steps[-1] == pytest.approx(found.left_rms_m, rel=0.2)

    def test_what_a_cause_moves_is_what_is_no_longer_left(self, found: Diagnosis) -> None:
        moved = sum(c.shift_m for c in found.causes)
        rest = found.difference_m - moved - found.left_m
        # What is neither: base and targets, which were placed without knowing of the causes.
        assert np.sqrt(np.mean(np.sum((rest + moved) ** 2, axis=1))) == pytest.approx(found.gap_rms_m, rel=0.2)
        assert found.left_m.shape == found.difference_m.shape == (len(found.rows), 3)

    def test_where_the_gap_lies_adds_up(self, found: Diagnosis) -> None:
        assert found.where.by_joint.sum() == pytest.approx(1.0)
        assert found.where.sweep_directions.sum() == pytest.approx(1.0)
        assert found.where.pose_directions.sum() == pytest.approx(1.0)

    def test_causes_hold_wherever_they_were_not_fitted(self, found: Diagnosis) -> None:
        assert {t.fitted_on for t in found.transfers} >= {"sweeps", "poses", "the first 60 % of the time"}
        for transfer in found.transfers:
            assert transfer.gap_after_rms_m < 0.35 * transfer.gap_before_rms_m


class TestCorrectedSim:
    EFFECTS = (("ratio:2:0.3%",), TWO)

    @pytest.mark.parametrize("effects", EFFECTS)
    def test_it_predicts_the_campaign_and_has_no_gap_of_its_own(self, effects: tuple[str, ...]) -> None:
        found = report("crane", *effects)
        seen, points = found.corrected.points_m(found.campaign)
        left = np.sqrt(np.mean(np.sum((seen.point_m - points) ** 2, axis=1)))
        assert left == pytest.approx(np.sqrt(np.mean(np.sum(found.left_m**2, axis=1))), rel=0.02)
        rows = found.campaign.measurements
        simulated = np.full_like(rows.point_m, np.nan)
        simulated[seen.rows] = points
        again = diagnose(replace(found.campaign, measurements=replace(rows, simulated_point_m=simulated)))
        assert again.verdict is Verdict.NO_GAP
        assert again.gap_rms_m == pytest.approx(left, rel=0.02)

    @pytest.mark.parametrize("effects", EFFECTS)
    def test_it_closes_as_much_on_another_day_as_was_promised(self, effects: tuple[str, ...]) -> None:
        found = report("crane", *effects)
        fresh = measured(crane_cell(), *effects, seed=7)
        assert realised_closure(found, fresh) == pytest.approx(closed_share(found), abs=0.05)

    def test_what_belongs_to_one_session_stays_there(self) -> None:
        found = report("crane", "base_shift:200:0.5mm")
        fresh = measured(crane_cell(), seed=7)
        assert found.corrected.causes[0].place.effect == "base_shift"
        seen, points = found.corrected.points_m(replace(fresh, digest="another day"))
        assert np.sqrt(np.mean(np.sum((seen.point_m - points) ** 2, axis=1))) < 1.2 * found.noise.floor_rms_m


class TestGivenAnswers:
    def test_told_the_cause_only_that_is_looked_at(self) -> None:
        campaign = measured(crane_cell(), "ratio:2:0.3%")
        told = diagnose(campaign, told=[{"effect": "ratio", "joint": 2}])
        assert [c.place for c in told.causes] == [Place("ratio", joint=2)]
        assert told.left_rms_m == pytest.approx(report("crane", "ratio:2:0.3%").left_rms_m, rel=0.1)

    @pytest.mark.parametrize(
        ("fault", "answer"),
        [
            ("quantisation:2:0.03deg", {"effect": "quantisation", "joint": 2}),
            ("quantisation:2:0.03deg", {"effect": "quantisation"}),
            ("axis_wobble:3:0.05deg", {"effect": "axis_wobble", "joint": 3}),
            ("hysteresis:1:0.05deg", {"effect": "hysteresis", "joint": 1}),
            ("geometry:2.alpha:0.1deg", {"effect": "geometry", "frame": 2}),
            ("drift:-:0.2mm/h", {"effect": "drift"}),
        ],
    )
    def test_told_of_any_effect_nothing_else_is_put_in_its_place(self, fault: str, answer: dict[str, object]) -> None:
        """Also where the library holds nothing of it before the data have been looked at: steps of encoders."""
        told = diagnose(measured(crane_cell(), fault), told=[answer])
        assert {cause.place.effect for cause in told.causes} == {answer["effect"]}
        assert told.left_rms_m < 1.5 * told.noise.floor_rms_m

    def test_an_effect_that_the_library_does_not_know_is_located(self) -> None:
        found = diagnose(measured(crane_cell(), "drift:-:0.2mm/h"), without=["drift"])
        assert found.verdict is Verdict.UNEXPLAINED
        assert [c.place for c in found.causes] == [Place(UNKNOWN, variable="time")]


def test_validation_rows_judge_and_are_not_fitted() -> None:
    """They are 5 mm astray: estimates stay, the verdict does not say that all is well."""
    campaign = measured(crane_cell(), "ratio:2:0.3%", checks=6)
    clean = diagnose(campaign)
    rows = campaign.measurements
    points = rows.point_m + np.where(rows.check[:, None], 5e-3, 0.0)
    astray = diagnose(replace(campaign, measurements=replace(rows, point_m=points)))
    assert clean.causes[0].place == Place("ratio", joint=2)
    assert clean.causes[0].parameters[0].value == pytest.approx(0.003, abs=SPREADS * clean.causes[0].parameters[0].std)
    assert astray.left_rms_m > 5e-4
    assert astray.verdict is not Verdict.EXPLAINED
    assert astray.noise.used_m == pytest.approx(clean.noise.used_m, rel=0.05)


def test_the_same_campaign_is_diagnosed_alike_every_time() -> None:
    first, again = report("crane", "backlash:1:0.05deg"), diagnose(measured(crane_cell(), "backlash:1:0.05deg"))
    assert [c.place for c in first.causes] == [c.place for c in again.causes]
    assert first.left_rms_m == again.left_rms_m
    np.testing.assert_array_equal(first.left_m, again.left_m)
