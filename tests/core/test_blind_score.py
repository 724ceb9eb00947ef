"""Scores of blind diagnoses: every figure from cases small enough to be counted by hand."""

import json
from pathlib import Path

import numpy as np
import pytest

from core.errors import InputError
from core.gap.blind_answers import Answer, check_names, read_answers
from core.gap.blind_check import Said, SaidCause
from core.gap.blind_json import blind_to_json
from core.gap.blind_score import ELSEWHERE, NOT_READ, NOT_SAID, NOTHING, Score, score
from core.gap.blind_tables import campaigns_csv, confusion_csv
from core.gap.result import UNKNOWN, Place, Verdict

BACKLASH_3 = Place("backlash", joint=3)
HYSTERESIS_3 = Place("hysteresis", joint=3)
RATIO_2 = Place("ratio", joint=2)
UNKNOWN_5 = Place(UNKNOWN, joint=5)


def cause(place: Place, probability: float = 0.9, *twins: Place) -> SaidCause:
    return SaidCause(place, probability, (place, *twins))


def said(name: str, *causes: SaidCause, verdict: Verdict = Verdict.EXPLAINED, left_m: float = 1e-4) -> Said:
    return Said(name, verdict, causes, gap_rms_m=5e-4, left_rms_m=left_m, floor_rms_m=1e-4)


def one(effect: str, **place: int | str) -> tuple[Answer, ...]:
    return (Answer(effect, tuple(place.items())),)


def scored(*pairs: tuple[Said, tuple[Answer, ...]]) -> Score:
    return score(tuple(pair[0] for pair in pairs), {pair[0].name: pair[1] for pair in pairs})


def test_one_effect_is_right_by_name_by_class_or_by_joint_only() -> None:
    there = one("hysteresis", joint=3)
    found = scored(
        (said("by name", cause(HYSTERESIS_3)), there),
        (said("by class", cause(BACKLASH_3, 0.6, HYSTERESIS_3)), there),
        (said("by joint", cause(BACKLASH_3)), there),
        (said("not at all", cause(RATIO_2)), there),
        (said("nothing", verdict=Verdict.NO_GAP), there),
    )
    assert (found.single.exact.count, found.single.up_to_class.count, found.single.joint.count) == (1, 2, 3)
    assert found.single.exact.of == found.single.joint.of == 5
    assert found.mixture.exact.of == found.false_alarms.of == found.other_detected.of == 0
    assert [case.said.name for case in found.cases if case.wrong_names] == ["by joint", "not at all"]
    assert found.wrong_names.share == pytest.approx(2 / 5)


def test_a_right_cause_without_a_joint_is_no_wrong_joint() -> None:
    there = (*one("ratio", joint=2), *one("scale"))
    found = scored(
        (said("a", cause(Place("scale"))), there),
        (said("b", cause(RATIO_2)), there),
        (said("c", cause(BACKLASH_3)), there),
    )
    assert (found.mixture.joint.count, found.mixture.joint.of) == (2, 3)


def test_only_the_strongest_cause_counts_for_the_first() -> None:
    found = scored((said("a", cause(RATIO_2), cause(BACKLASH_3)), one("backlash", joint=3)))
    assert found.single.exact.count == 0
    assert found.cases[0].exact == (1,)


@pytest.mark.parametrize(
    ("answer", "place", "met"),
    [
        (("backlash", {"joint": 3}), BACKLASH_3, True),
        (("backlash", {}), BACKLASH_3, True),
        (("backlash", {"joint": 2}), BACKLASH_3, False),
        (("latency", {"joint": None}), Place("latency"), True),
        (("latency", {"joint": None}), Place("latency", joint=1), False),
        (("coupling", {"source": 3, "joint": 4}), Place("coupling", joint=4, source=3), True),
        (("coupling", {"source": 2, "joint": 4}), Place("coupling", joint=4, source=3), False),
        (("geometry", {"frame": 2}), Place("geometry", frame=2), True),
        (("geometry", {"frame": 2}), Place("geometry", frame=3), False),
        (("target_slip", {"target": "T1"}), Place("target_slip", target="T1", record=7), True),
        (("base_shift", {}), Place("base_shift", record=90), True),
        (("other", {}), UNKNOWN_5, True),
        (("other", {"joint": 4}), UNKNOWN_5, False),
        (("other", {}), BACKLASH_3, False),
    ],
)
def test_an_answer_is_met_where_effect_and_given_place_agree(answer: tuple, place: Place, met: bool) -> None:
    assert Answer(answer[0], tuple(answer[1].items())).is_met_by(place) is met


def test_a_mixture_is_judged_as_a_set_and_a_cause_meets_one_effect_only() -> None:
    there = (*one("backlash", joint=3), *one("ratio", joint=2), *one("hysteresis", joint=3))
    found = scored(
        (said("a", cause(BACKLASH_3, 0.9, HYSTERESIS_3), cause(RATIO_2), cause(Place("scale"))), there),
        (said("b", cause(UNKNOWN_5)), there),
    )
    sets = found.sets
    assert sets.campaigns == 2
    assert sets.precision == pytest.approx(2 / 3)
    assert sets.precision_up_to_class == pytest.approx(2 / 3)
    assert sets.recall == pytest.approx((2 / 3 + 0) / 2)
    assert sets.all_found.count == 0
    assert found.cases[0].exact == (0, 1, None)
    assert found.mixture.exact.count == 1


def test_classes_are_paired_so_that_most_effects_are_met() -> None:
    there = (*one("backlash", joint=3), *one("hysteresis", joint=3))
    both = scored((said("a", cause(HYSTERESIS_3, 0.5, BACKLASH_3), cause(HYSTERESIS_3)), there))
    assert both.cases[0].up_to_class == (0, 1)
    assert both.cases[0].exact[0] is None
    assert both.sets.all_found.count == 1


def test_alarms_on_nothing() -> None:
    found = scored(
        (said("quiet", verdict=Verdict.NO_GAP), ()),
        (said("alarmed", cause(RATIO_2)), ()),
        (said("uneasy", verdict=Verdict.UNEXPLAINED), ()),
    )
    assert (found.false_alarms.count, found.false_alarms.of) == (2, 3)
    assert np.isnan(found.single.exact.share)


def test_what_has_no_name_is_detected_by_verdict_or_by_an_unknown_cause() -> None:
    there = one("other")
    found = scored(
        (said("unknown", cause(UNKNOWN_5)), there),
        (said("partly", cause(RATIO_2, 0.4), verdict=Verdict.PARTLY_EXPLAINED), there),
        (said("misnamed", cause(RATIO_2)), there),
        (said("blind", verdict=Verdict.NO_GAP), there),
    )
    assert (found.other_detected.count, found.other_detected.of) == (2, 4)
    assert (found.other_named_wrongly.count, found.other_named_wrongly.of) == (1, 4)


def test_probabilities_against_outcomes() -> None:
    there = one("ratio", joint=2)
    found = scored(
        *((said(f"right {k}", cause(RATIO_2, 0.8)), there) for k in range(3)),
        (said("wrong", cause(BACKLASH_3, 0.8)), there),
        (said("unsure", cause(BACKLASH_3, 0.2)), there),
    )
    assert found.by_name.claims == 5
    assert found.by_name.brier == pytest.approx((3 * 0.04 + 0.64 + 0.04) / 5)
    assert found.by_name.expected_error == pytest.approx((4 * abs(0.8 - 0.75) + 0.2) / 5)
    assert found.by_name.count.tolist() == [1, 4]


def test_a_certain_claim_falls_in_the_last_bin() -> None:
    found = scored((said("a", cause(RATIO_2, 1.0)), one("ratio", joint=2)))
    assert (found.by_name.brier, found.by_name.expected_error) == (0.0, 0.0)


def test_shares_closed_are_of_the_gap_beyond_the_floor() -> None:
    there = one("ratio", joint=2)
    found = scored(
        (said("all", cause(RATIO_2), left_m=1e-4), there),
        (said("half", cause(RATIO_2), left_m=(13e-8) ** 0.5), there),
        (said("empty", verdict=Verdict.NO_GAP), ()),
    )
    assert found.median_closed == pytest.approx(0.75)
    assert found.tenth_closed == pytest.approx(0.55)


def test_a_campaign_that_was_not_diagnosed_counts_as_missed() -> None:
    broken = Said("broken", None, failure="measurements.csv is missing")
    found = scored((broken, one("ratio", joint=2)), (said("good", cause(RATIO_2)), one("ratio", joint=2)))
    assert found.not_diagnosed == ("broken",)
    assert found.single.exact.share == 0.5
    also = scored((broken, ()), (Said("odd", None), one("other")))
    assert also.false_alarms.of == 0
    assert (also.other_detected.count, also.other_detected.of) == (0, 1)


def test_the_confusion_table_has_every_answer_once() -> None:
    pairs = (
        (said("a", cause(RATIO_2)), one("ratio", joint=2)),
        (said("b", cause(RATIO_2)), one("ratio", joint=1)),
        (said("c", cause(BACKLASH_3)), one("hysteresis", joint=3)),
        (said("d", verdict=Verdict.NO_GAP), ()),
        (said("e", verdict=Verdict.UNEXPLAINED), one("other")),
        (said("f", cause(RATIO_2)), (*one("ratio", joint=2), *one("scale"))),
        (Said("g", None), one("drift")),
    )
    table = scored(*pairs).confusion
    counts = {(r, c): int(table.counts[i, j]) for i, r in enumerate(table.rows) for j, c in enumerate(table.columns)}
    expected = {
        ("ratio", "ratio"): 2,
        ("ratio", ELSEWHERE): 1,
        ("hysteresis", "backlash"): 1,
        (NOTHING, NOTHING): 1,
        ("other", NOT_SAID): 1,
        ("scale", NOT_SAID): 1,
        ("drift", NOT_READ): 1,
    }
    assert {pair: count for pair, count in counts.items() if count} == expected
    assert table.counts.sum() == sum(expected.values())
    lines = confusion_csv(scored(*pairs)).splitlines()
    assert lines[0] == ",".join(["there", *table.columns])
    assert len(lines) == 1 + len(table.rows)
    assert len(campaigns_csv(scored(*pairs)).splitlines()) == 1 + len(pairs)


def test_what_is_there_without_being_asked_for_may_be_named_or_missed() -> None:
    asked, also = one("backlash", joint=3), (Answer("ratio", (("joint", 2),), asked=False),)
    found = scored(
        (said("named", cause(BACKLASH_3), cause(RATIO_2)), (*asked, *also)),
        (said("missed", cause(BACKLASH_3)), (*asked, *also)),
        (said("first", cause(RATIO_2), cause(BACKLASH_3)), (*asked, *also)),
        (said("seen in nothing", cause(RATIO_2)), also),
        (said("alarm", cause(BACKLASH_3)), also),
        (said("quiet", verdict=Verdict.NO_GAP), also),
    )
    assert found.single.exact.of == 3
    assert found.single.exact.count == 2
    assert (found.false_alarms.count, found.false_alarms.of) == (1, 3)
    assert [case.said.name for case in found.cases if case.wrong_names] == ["alarm"]
    assert found.by_name.brier == pytest.approx((6 * 0.01 + 0.81) / 7)
    mixed = (*asked, *one("scale"), *also)
    sets = scored((said("a", cause(BACKLASH_3), cause(RATIO_2), cause(Place("scale"))), mixed)).sets
    assert (sets.precision, sets.recall) == (1.0, 1.0)


def test_no_cases_at_all() -> None:
    empty = score((), {})
    assert empty.confusion.counts.shape == (0, 0)
    assert json.loads(blind_to_json((), empty))["score"]["top_1"]["one_effect"]["exact"]["share"] is None


def test_what_was_said_is_the_same_before_and_after_the_score() -> None:
    spoken = (said("a", cause(RATIO_2)), Said("b", None, failure="no measurements.csv"))
    before = json.loads(blind_to_json(spoken))
    after = json.loads(blind_to_json(spoken, score(spoken, {"a": one("ratio", joint=2), "b": ()})))
    assert before["score"] is None
    assert before["said"] == after["said"]
    assert before["said_sha256"] == after["said_sha256"]
    assert after["score"]["top_1"]["one_effect"]["exact"] == {"share": 1.0, "count": 1, "of": 1}
    assert {"brier", "expected_calibration_error", "share_closed"} <= set(after["score"])


def written(folder: Path, text: str) -> Path:
    path = folder / "answers.json"
    path.write_text(text, encoding="utf-8")
    return path


def test_answers_are_read_with_every_way_to_name_a_place(tmp_path: Path) -> None:
    effects = [
        {"effect": "backlash", "joint": 3, "size": 0.1},
        {"effect": "coupling", "from": 3, "to": 4},
        {"effect": "flexure", "link": 2},
        {"effect": "geometry", "frame": 1},
        {"effect": "geometry", "joint": 2},
        {"effect": "latency", "joint": "all"},
        {"effect": "payload", "joint": None},
        {"effect": "target_slip", "target": "T1", "record": 80},
        {"effect": "base_shift", "record": 50},
        {"effect": "other"},
    ]
    also = [{"effect": "drift"}]
    found = read_answers(written(tmp_path, json.dumps({"a": {"effects": effects}, "b": {"effects": [], "also": also}})))
    assert found["b"] == (Answer("drift", asked=False),)
    assert [dict(answer.given) for answer in found["a"]] == [
        {"joint": 3},
        {"source": 3, "joint": 4},
        {"joint": 2},
        {"frame": 1},
        {"frame": 2},
        {"joint": None},
        {},
        {"target": "T1"},
        {},
        {},
    ]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("[1]", "expected an object"),
        ("{", "not valid JSON"),
        ('{"a": 3}', "a = 3, expected an object"),
        ('{"a": {}}', "a.effects is missing, expected a list of objects"),
        ('{"a": {"effects": [7]}}', "expected a list of objects"),
        ('{"a": {"effects": [], "also": 1}}', "a.also = 1, expected a list of objects"),
        ('{"a": {"effects": [{}]}}', "a.effects[0].effect is missing"),
        ('{"a": {"effects": [{"effect": "gremlins"}]}}', "expected other or one of geometry"),
        ('{"a": {"effects": [{"effect": "ratio", "joint": "three"}]}}', "joint = 'three', expected a whole number"),
        ('{"a": {"effects": [{"effect": "ratio", "joint": [1]}]}}', "joint = [1], expected a whole number"),
        ('{"a": {"effects": [{"effect": "target_slip", "target": 1}]}}', "target = 1, expected a text"),
    ],
)
def test_odd_answers_are_refused_in_one_sentence(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        read_answers(written(tmp_path, text))
    assert words in str(refused.value)
    assert "answers.json" in str(refused.value)
    assert "\n" not in str(refused.value)


def test_answers_of_other_campaigns_are_noticed(tmp_path: Path) -> None:
    assert check_names({"a": ()}, ("a",), tmp_path) == ()
    notes = check_names({"a": (), "x": ()}, ("a", "b"), tmp_path)
    assert "'b': not scored" in notes[0]
    assert "'x'" in notes[1]
    with pytest.raises(InputError, match="answers for 'x', expected the subfolders 'a'"):
        check_names({"x": ()}, ("a",), tmp_path)
