"""What planned points will be able to tell apart, in a few lines for a person at a terminal."""

from collections.abc import Sequence

from core.gap.additions import Addition
from core.gap.isolability import Isolability, Isolated
from core.gap.isolability_field import STATED
from core.gap.place_words import NAMES, effect_name
from core.gap.planned import untested

MOST_ADDITIONS = 3
ELSEWHERE = "rest"
"""Head of the column for effects of no joint, link or frame."""
CONFUSED, HIDDEN = "*", "-"


def isolability_lines(found: Isolability, tried: Sequence[Addition]) -> list[str]:
    """A table effect by joint, how many would be told apart, and what to add to the plan."""
    named = sum(one.named for one in found.effects)
    hidden = sum(not one.limit.shown for one in found.effects)
    confused = len(found.effects) - named - hidden
    known = "all geometry fitted, the sim being as drawn" if found.drawn else "geometry known to 0.1 mm, 0.1 mrad"
    return [
        "What these points will be able to tell apart (trueaxis gap)",
        f"  smallest effect that would be found, mm rms at the targets; noise {found.noise_m * 1e3:.3f} mm, {known}",
        *_table(found),
        f"  {CONFUSED} at {STATED:g} times the noise it could be taken for another; {HIDDEN} not seen at any size",
        f"  of {len(found.effects)} effects {named} would be named, {confused} taken for each other, {hidden} not seen",
        *(f"  add      {_addition(one)}" for one in tried[:MOST_ADDITIONS]),
        *(f"  unknown  {sentence}" for sentence in untested(found.problem)),
    ]


def _addition(one: Addition) -> str:
    does = [f"tells {one.pairs} {'pair' if one.pairs == 1 else 'pairs'} apart"] if one.pairs else []
    does += [f"shows {one.shown} more"] if one.shown else []
    return f"{one.words} ({one.points} points): {', '.join(does)}"


def _table(found: Isolability) -> list[str]:
    cells: dict[tuple[str, str], list[Isolated]] = {}
    for one in found.effects:
        cells.setdefault((one.place.effect, _column(one)), []).append(one)
    joints = [str(j) for j in range(1, found.problem.sim.seen.joint_count + 1)]
    heads = [*joints, *([ELSEWHERE] if any(column == ELSEWHERE for _, column in cells) else [])]
    effects = [effect for effect in NAMES if any(key[0] == effect for key in cells)]
    wide = max((len(effect_name(effect)) for effect in effects), default=0)
    lines = [f"  {'':<{wide}}{''.join(f'{head:>8}' for head in heads)}"]
    for effect in effects:
        row = "".join(f"{_cell(cells.get((effect, head), [])):>8}" for head in heads)
        lines.append(f"  {effect_name(effect):<{wide}}{row}")
    return lines


def _column(one: Isolated) -> str:
    joint = one.place.joint or one.place.frame
    return ELSEWHERE if joint is None else str(joint)


def _cell(effects: Sequence[Isolated]) -> str:
    """The worst of the effects of a kind at one joint: several couplings may end there."""
    if not effects:
        return ""
    if not all(one.limit.shown for one in effects):
        return HIDDEN + " "
    worst = max(one.limit.rms_m for one in effects) * 1e3
    return f"{worst:.2g}" + (" " if all(one.named for one in effects) else CONFUSED)
