"""What planned points can tell apart, as a record for JSON files."""

from collections.abc import Sequence

from core.gap.additions import Addition, best_for
from core.gap.gap_json import place_record
from core.gap.isolability import APART, Isolability, Isolated
from core.gap.isolability_field import STATED, Limit
from core.gap.parameter_units import PART, unit_of
from core.gap.place_words import place_words
from core.gap.planned import untested
from core.json_values import Json, json_text, mm, number
from core.version import VERSION

PLAN_FORMAT = "trueaxis-plan/1"


def isolability_record(found: Isolability, tried: Sequence[Addition]) -> Json:
    """Every effect with its limit and its rivals, and what could be added to the plan."""
    return {
        "geometry": "as drawn: all of it is fitted" if found.drawn else "known as a calibration leaves it",
        "noise_mm": mm(found.noise_m),
        "stated_times_noise": STATED,
        "apart_std": APART,
        "effects": [_effect_record(one, tried) for one in found.effects],
        "additions": [_addition_record(one) for one in tried],
        "not_tested": list(untested(found.problem)),
    }


def isolability_json(found: Isolability, tried: Sequence[Addition], title: str) -> str:
    """The text of the plan.json of a campaign whose own rows are judged.

    Args:
        title: of the campaign.
    """
    return json_text(
        {
            "format": PLAN_FORMAT,
            "trueaxis": VERSION,
            "units": "lengths in mm, angles in rad or deg as the key says",
            "robot": found.problem.sim.seen.campaign.robot.name,
            "campaign": title,
            "kind": "own",
            "shots": found.problem.sim.seen.count,
            "isolability": isolability_record(found, tried),
        }
    )


def shown_size(limit: Limit) -> tuple[float, str]:
    """The size of a limit in a unit of people, and that unit; NaN and empty where the effect has no single number."""
    if not limit.unit:
        return limit.size, ""
    unit = PART if limit.unit == "1" else unit_of(f"size_{limit.unit}")
    return limit.size * unit.scale, unit.symbol


def _effect_record(one: Isolated, tried: Sequence[Addition]) -> Json:
    size, unit = shown_size(one.limit)
    way = best_for(one.place, tried)
    return {
        **place_record(one.place),
        "text": place_words(one.place),
        "seen": one.limit.shown,
        "limit_rms_mm": mm(one.limit.rms_m),
        "limit": number(size),
        "unit": unit or None,
        "told_apart": one.named,
        "judged_at_rms_mm": mm(one.rms_m) if one.limit.shown else None,
        "could_be_taken_for": [
            {**place_record(rival.place), "separation_std": number(rival.separation, 3)} for rival in one.rivals
        ],
        "add": None
        if way is None
        else {
            "measurement": way[0].words,
            "points": way[0].points,
            "brings_to_light": way[1].shows,
            "told_from": [place_record(place) for place in way[1].parted],
            "still_like": [place_record(place) for place in way[1].left],
        },
    }


def _addition_record(one: Addition) -> Json:
    return {
        "measurement": one.words,
        "points": one.points,
        "pairs_told_apart": one.pairs,
        "effects_brought_to_light": one.shown,
        "effects_then_alone": [
            place_record(parting.effect) for parting in one.partings if parting.parted and not parting.left
        ],
    }
