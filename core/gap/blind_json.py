"""A blind check as ``blind.json``: first what was said, later the same with the score beside it."""

import hashlib
import json

from core.gap.blind_answers import Answer
from core.gap.blind_check import Said, SaidCause
from core.gap.blind_score import Calibration, Case, Score, Share, TopOne
from core.gap.gap_json import place_record
from core.json_values import Json, json_text, mm, number
from core.version import VERSION

BLIND_FORMAT = "trueaxis-blind/1"


def blind_to_json(said: tuple[Said, ...], score: Score | None = None, notes: tuple[str, ...] = ()) -> str:
    """The text of blind.json; without a score it is what is written before the answers are opened."""
    spoken = {one.name: said_record(one) for one in said}
    return json_text(
        {
            "format": BLIND_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm; shares 0..1; null: not known",
            "said": spoken,
            "said_sha256": hashlib.sha256(json.dumps(spoken, sort_keys=True).encode()).hexdigest(),
            "score": None if score is None else score_record(score),
            "notes": list(notes),
        }
    )


def said_record(said: Said) -> Json:
    """What was said of one campaign, or why nothing was."""
    if said.verdict is None:
        return {"verdict": None, "failure": said.failure, "causes": []}
    return {
        "verdict": str(said.verdict),
        "causes": [_cause_record(cause) for cause in said.causes],
        "gap_rms_mm": mm(said.gap_rms_m),
        "left_rms_mm": mm(said.left_rms_m),
        "floor_rms_mm": mm(said.floor_rms_m),
        "points": said.points,
        "seconds": number(said.seconds, 3),
        "warnings": list(said.warnings),
    }


def score_record(score: Score) -> Json:
    """The score as the contract has it, with what each figure counts."""
    sets = score.sets
    return {
        "campaigns": len(score.cases),
        "not_diagnosed": list(score.not_diagnosed),
        "top_1": {"one_effect": _top_record(score.single), "mixtures": _top_record(score.mixture)},
        "sets_of_mixtures": {
            "campaigns": sets.campaigns,
            "precision": number(sets.precision),
            "precision_up_to_class": number(sets.precision_up_to_class),
            "recall": number(sets.recall),
            "recall_up_to_class": number(sets.recall_up_to_class),
            "all_found_up_to_class": share_record(sets.all_found),
        },
        "false_alarms_on_empty": share_record(score.false_alarms),
        "other": {
            "detected": share_record(score.other_detected),
            "single_wrong_name": share_record(score.other_named_wrongly),
        },
        "wrong_names_after_abstention": share_record(score.wrong_names),
        "probabilities": {
            "effect_and_place": _calibration_record(score.by_name),
            "up_to_class": _calibration_record(score.by_class),
        },
        "brier": number(score.by_name.brier),
        "expected_calibration_error": number(score.by_name.expected_error),
        "share_closed": {"median": number(score.median_closed), "tenth_percentile": number(score.tenth_closed)},
        "confusion": {
            "there": list(score.confusion.rows),
            "said": list(score.confusion.columns),
            "counts": score.confusion.counts.tolist(),
        },
        "by_campaign": {case.said.name: _case_record(case) for case in score.cases},
        "definitions": {
            "top_1": "the strongest cause is one that is there; campaigns that could not be diagnosed count as missed",
            "joint": "the joint of the strongest cause is right whatever the effect; where the answer names a joint",
            "precision": "of the names said; an unknown cause is an abstention and is not counted",
            "also": "effects that the answers give as present without asking for them: naming one is right, missing "
            "it is not wrong",
            "wrong_names_after_abstention": "campaigns in which a cause that is not there was named alone (no class) "
            "with a probability above 0.5",
            "brier": "over all causes said, against effect and place both being right; an unknown one is right where "
            "the answer is other",
            "share_closed": "of gap^2 - floor^2 on kept-out points, campaigns with something wrong",
        },
    }


def answer_record(answer: Answer) -> Json:
    """An answer as it was understood."""
    return {"effect": answer.effect, **{part: "all" if v is None else v for part, v in answer.given}}


def share_record(share: Share) -> Json:
    """How many of how many; a share of none is null."""
    return {"share": number(share.share), "count": share.count, "of": share.of}


def _cause_record(cause: SaidCause) -> Json:
    return {
        **place_record(cause.place),
        "probability": number(cause.probability),
        "class": [place_record(place) for place in cause.places],
    }


def _top_record(found: TopOne) -> Json:
    return {
        "exact": share_record(found.exact),
        "up_to_class": share_record(found.up_to_class),
        "joint": share_record(found.joint),
    }


def _calibration_record(found: Calibration) -> Json:
    bins = zip(found.said, found.right, found.count, strict=True)
    return {
        "claims": found.claims,
        "brier": number(found.brier),
        "expected_calibration_error": number(found.expected_error),
        "bins": [{"said": number(said), "right": number(right), "claims": int(count)} for said, right, count in bins],
    }


def _case_record(case: Case) -> Json:
    return {
        "there": [answer_record(answer) for answer in case.answers],
        "also": [answer_record(answer) for answer in case.also],
        "met": [k is not None for k in case.exact],
        "met_up_to_class": [k is not None for k in case.up_to_class],
        "wrong_names": [place_record(cause.place) for cause in case.wrong_names],
        "share_closed": number(case.share_closed),
    }
