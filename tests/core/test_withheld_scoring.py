"""The withheld suite's score: what counts as right, and that answers come last."""

import json
from pathlib import Path

import numpy as np
import pytest

from core.errors import CampaignError
from tests.benchmarks.withheld import asking
from tests.benchmarks.withheld.cases import IMPOSSIBLE, SEEDS, all_cases
from tests.benchmarks.withheld.command import run
from tests.benchmarks.withheld.effects.library import NAMED
from tests.benchmarks.withheld.matching import is_right, right_in_class, right_place
from tests.benchmarks.withheld.product import Json, Product, Verdict, ask
from tests.benchmarks.withheld.score_table import by_part, failed, failures, rows, table
from tests.benchmarks.withheld.scoring import Outcome, brier, calibration_error

TRUTH: Json = {"kind": "single", "arm": "irb", "gap": 3.0, "noise": "stated", "protocol": "rich", "records": 1000}
TRUTH |= {"effects": ["compliance"], "seed": 1}
BEND, WINDUP = {"effect": "flexure", "joint": 1}, {"effect": "compliance", "joint": 2}


def gap(*causes: Json, verdict: str = "explained", left: float = 0.05) -> Json:
    return {
        "verdict": verdict,
        "causes": list(causes),
        "gap_rms_mm": 0.13,
        "floor_rms_mm": 0.05,
        "left_rms_mm": left,
    }


def outcome(answers: list[Json], said: Json | None, **more: object) -> Outcome:
    truth = TRUTH | {"answers": answers, "also": []} | {k: v for k, v in more.items() if k in (*TRUTH, "also")}
    rest = {k: v for k, v in more.items() if k in ("oracle", "without")}
    return Outcome("c0001", truth, Verdict(said, 1.0, realised=more.get("realised")), **rest)


@pytest.mark.parametrize(
    ("said", "truth", "right"),
    [
        (WINDUP, WINDUP, True),
        (WINDUP | {"joint": 3}, WINDUP, False),
        (BEND, WINDUP, False),
        ({"effect": "flexure", "link": 1}, BEND, True),
        ({"effect": "coupling", "from": 2, "to": 3}, {"effect": "coupling", "from": 2, "to": 3}, True),
        ({"effect": "coupling", "from": 1, "to": 3}, {"effect": "coupling", "from": 2, "to": 3}, False),
        ({"effect": "thermal"}, {"effect": "thermal"}, True),
        ({"effect": "thermal", "joint": 2}, {"effect": "thermal"}, False),
        ({"effect": "base_shift", "record": 520}, {"effect": "base_shift", "record": 500}, True),
        ({"effect": "base_shift", "record": 540}, {"effect": "base_shift", "record": 500}, False),
        ({"effect": "base_shift"}, {"effect": "base_shift", "record": 500}, False),
        (
            {"effect": "target_slip", "target": "T2", "record": 500},
            {"effect": "target_slip", "target": "T1", "record": 500},
            False,
        ),
    ],
)
def test_a_cause_is_right_if_effect_and_place_are(said: Json, truth: Json, right: bool) -> None:
    assert is_right(said, truth, 1000) is right


def test_a_declared_class_counts_for_all_that_it_holds() -> None:
    said = BEND | {"class": [BEND, WINDUP]}
    assert right_in_class(said, WINDUP, 1000)
    assert not is_right(said, WINDUP, 1000)
    assert right_place(said, WINDUP)
    assert not right_in_class(said, WINDUP | {"joint": 4}, 1000)


def test_places_of_unknowns() -> None:
    at_joint = {"effect": "other", "where": {"joint": 3, "second": 5}}
    assert right_place({"effect": "unknown", "joint": 5}, at_joint)
    assert not right_place({"effect": "unknown", "joint": 4}, at_joint)
    in_time = {"effect": "other", "where": {"variable": "time"}}
    assert right_place({"effect": "unknown", "variable": "time"}, in_time)
    assert right_place({"effect": "drift"}, in_time)
    assert not right_place({"effect": "unknown", "joint": 2}, in_time)


def test_a_wrong_name_is_one_that_was_believed() -> None:
    assert outcome([WINDUP], gap(BEND | {"probability": 0.8})).wrong_name
    assert not outcome([WINDUP], gap(BEND | {"probability": 0.4})).wrong_name
    assert not outcome([WINDUP], gap(BEND | {"probability": 0.8, "class": [BEND, WINDUP]})).wrong_name
    assert not outcome([WINDUP], gap({"effect": "unknown", "joint": 2, "probability": 0.9})).wrong_name
    assert not outcome([WINDUP], gap(BEND | {"probability": 0.8}), also=[BEND]).wrong_name
    stranger = {"effect": "other", "where": {"joint": 2}}
    assert outcome([stranger], gap(WINDUP | {"probability": 0.8}), kind="other").wrong_name


def test_an_effect_out_of_the_library_is_noticed_or_not() -> None:
    def noticed(said: Json) -> bool:
        return outcome([WINDUP], gap(), without=Verdict(said, 1.0)).noticed_without

    sure = BEND | {"probability": 0.9}
    assert not noticed(gap(sure))
    assert not noticed(gap(verdict="no_gap"))
    assert noticed(gap(sure, verdict="partly_explained"))
    assert noticed(gap({"effect": "unknown", "joint": 2, "probability": 0.9}))
    assert noticed(gap(sure, WINDUP | {"probability": 0.3}))
    assert noticed(gap(sure | {"class": [BEND, {"effect": "zero_offset", "joint": 2}]}))


def test_what_is_one_and_the_same_on_an_arm_is_right_without_the_other() -> None:
    without = Verdict(gap(WINDUP | {"probability": 0.9}), 1.0)
    assert outcome([{"effect": "payload"}], gap(), arm="scara", without=without).noticed_without
    assert not outcome([{"effect": "payload"}], gap(), arm="irb", without=without).noticed_without
    assert not outcome([{"effect": "flexure", "joint": 1}], gap(), arm="scara", without=without).noticed_without


def test_closure_is_held_against_the_oracle_and_the_promise_against_another_day() -> None:
    cause = WINDUP | {"probability": 0.9}
    oracle = Verdict(gap(cause, left=0.05), 1.0)
    best = outcome([WINDUP], gap(cause, left=0.05), oracle=oracle, realised=0.93)
    assert best.against_oracle == pytest.approx(1.0)
    assert best.promise_missed_by == pytest.approx(0.07)
    half = outcome([WINDUP], gap(cause, left=np.sqrt((0.13**2 + 0.05**2) / 2)), oracle=oracle)
    assert half.against_oracle == pytest.approx(0.5)
    assert outcome([WINDUP], None, oracle=oracle).against_oracle == 0.0


def test_probabilities_are_scored() -> None:
    pairs = [(0.9, True)] * 9 + [(0.9, False)]
    assert brier(pairs) == pytest.approx(0.09)
    assert calibration_error(pairs) == pytest.approx(0.0, abs=1e-12)
    assert calibration_error([(1.0, False), (0.0, True)]) == pytest.approx(1.0)


def test_the_table_says_which_bars_are_met() -> None:
    right = outcome([WINDUP], gap(WINDUP | {"probability": 0.9}))
    wrong = outcome([WINDUP], gap(BEND | {"probability": 0.9}))
    reached = {row.figure: row for row in rows([right] * 19 + [wrong])}
    top = reached["one effect, gap/noise 3: right up to class"]
    assert (top.reached, top.count, top.met) == (0.95, 20, True)
    assert reached["wrong name with probability > 0.5"].met is False
    assert reached["one effect, gap/noise 10: right up to class"].met is None
    assert "NO" in table([right, wrong])
    assert [failed(right), failed(wrong)] == [False, True]


def test_parts_are_scored_one_by_one() -> None:
    right, wrong = gap(WINDUP | {"probability": 0.9}), gap(BEND | {"probability": 0.9})
    found = [outcome([WINDUP], said, seed=seed) for said, seed in ((right, 10), (right, 10_003), (wrong, 10_004))]
    line = next(line for line in by_part(found, (10, 10_000)).splitlines() if "gap/noise 3: right by name" in line)
    assert [cell.strip() for cell in line.strip("|").split("|")][1:] == ["1.000", "0.500"]


@pytest.mark.parametrize("seeds", SEEDS)
def test_the_suite_is_large_and_its_seeds_are_its_own(seeds: str) -> None:
    cases = all_cases(seeds)
    assert len(cases) >= 300
    mine = {case.seed for case in cases}
    others = {case.seed for name in SEEDS if name != seeds for case in all_cases(name)}
    assert len(mine) == len(cases)
    assert not mine & others
    assert len(SEEDS[seeds]) * 300 <= len(cases)
    for gap_size in (1.0, 3.0, 10.0):
        assert {case.effects[0] for case in cases if case.kind == "single" and case.gap == gap_size} == set(NAMED)
    assert not any((case.arm, effect) in IMPOSSIBLE for case in cases for effect in case.effects)


def says_no_gap(campaign: object, told: object = None) -> Json:
    # Whoever looks at answers too early finds verdicts missing: the told ones come after all others.
    return gap(verdict="no_gap") if told is None else gap(dict(told[0]) | {"probability": 1.0})


def refuses(campaign: object) -> Json:
    raise CampaignError("nothing moves, expected a sweep")


def breaks(campaign: object) -> Json:
    return {}["nothing"]


def nothing_ever() -> Product:
    return Product(says_no_gap, json.dumps, lambda report, fresh: 0.5)


def test_the_whole_way_with_a_product_that_sees_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = run("all", "dev", tmp_path, limit=6, processes=1, load=nothing_ever)
    assert "6 campaigns" in capsys.readouterr().out
    assert "| one effect, gap/noise 3: right up to class" in text
    assert len(list((tmp_path / "verdicts").glob("*.json"))) == 6
    answers = json.loads((tmp_path / "suite" / "answers.json").read_text())
    assert set(answers) == {path.name for path in asking.campaigns(tmp_path)}
    assert all(set(entry) <= {"effects", "also"} for entry in answers.values())


def test_answers_are_opened_after_the_last_verdict(tmp_path: Path) -> None:
    run("make", "dev", tmp_path, only="single", limit=2, processes=1)
    truths = tmp_path / "truth"
    truths.rename(tmp_path / "locked")
    with pytest.raises(FileNotFoundError, match="truth"):
        asking.ask_all(tmp_path, nothing_ever, processes=1, say=lambda text: None)
    assert len(list((tmp_path / "verdicts").glob("*.json"))) == 2


def test_refusals_and_crashes_are_told_apart(tmp_path: Path) -> None:
    run("make", "dev", tmp_path, limit=1, processes=1)
    folder = asking.campaigns(tmp_path)[0]
    product = nothing_ever()
    refused = ask(Product(refuses, product.to_json, product.realised), folder)
    crashed = ask(Product(breaks, product.to_json, product.realised), folder)
    assert refused.refused == "nothing moves, expected a sweep"
    assert "KeyError" in crashed.crashed
    assert not refused.crashed


@pytest.mark.parametrize("asked", ["oracle", "without"])
def test_a_crash_counts_whatever_was_asked(asked: str) -> None:
    fine = outcome([WINDUP], gap(WINDUP))
    broken = outcome([WINDUP], gap(WINDUP), **{asked: Verdict(None, 1.0, crashed="ValueError: empty")})
    assert not failed(fine)
    assert failed(broken)
    (row,) = (one for one in rows([fine, broken]) if one.figure.startswith("crashed"))
    assert row.met is False
    assert "ValueError: empty" in failures([fine, broken])


def test_another_day_that_fails_does_not_lose_the_verdict(tmp_path: Path) -> None:
    run("make", "dev", tmp_path, limit=1, processes=1)
    folder = asking.campaigns(tmp_path)[0]
    verdict = ask(Product(says_no_gap, json.dumps, lambda report, fresh: {}["nothing"]), folder, folder)
    assert verdict.gap == says_no_gap(None)
    assert "KeyError" in verdict.not_realised


def test_the_same_case_is_made_twice_alike(tmp_path: Path) -> None:
    for day in ("one", "two"):
        run("make", "dev", tmp_path / day, only="mixture", limit=1, processes=1)
    files = [sorted((tmp_path / day).rglob("*.csv")) for day in ("one", "two")]
    assert files[0]
    assert [path.read_bytes() for path in files[0]] == [path.read_bytes() for path in files[1]]
