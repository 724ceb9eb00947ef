"""What planned points will be able to tell apart, as a page."""

from collections.abc import Sequence

from app.report_cells import aligned, count, number
from app.report_page import Cell, Heading, Item, Page, Section, ShownTable, page_html
from core.gap.additions import Addition, Parting, best_for
from core.gap.isolability import APART, Isolability, Isolated
from core.gap.isolability_field import STATED
from core.gap.isolability_json import shown_size
from core.gap.place_words import MEANINGS, NAMES, effect_name, listed, place_words
from core.gap.planned import untested
from core.gap.verdict_words import capital
from core.version import VERSION
from core.wording import typeset

NOWHERE, NOT_AT_ALL = "–", "∞"
MOST_RIVALS = 5
METHOD = (
    "Every effect that a diagnosis of the gap knows acts in turn on the planned points, alone, drawn at random in all "
    "its numbers. What it moves is compared with what every other effect could move instead, base, unknown targets "
    "and geometry being fitted as well, and counted as a diagnosis would count it: as the evidence to be expected, "
    "less what more freedom costs. Nothing is measured yet, so the figures are of the plan, not of the arm.",
    f"The limit is the size that would be found in about four campaigns of five. Rivals are named at {STATED:g} times "
    f"the noise, or at twice the limit where that is more; {APART:g} standard deviations between an effect and a rival "
    "tell them apart in about nine campaigns of ten. Lengths are root mean square over the sighted targets, before "
    "base and targets are placed anew.",
    "The forms of the effects are those that the program knows, and the noise is as stated: several effects at once, "
    "strange noise or an effect without a name make it harder than these figures say.",
)


def isolability_html(found: Isolability, tried: Sequence[Addition], title: str, simulated: bool) -> str:
    """The page as one self-contained file.

    Args:
        title: of the campaign; empty: it has none.
        simulated: whether the arm that is planned for is no real one.
    """
    return page_html(isolability_page(found, tried, title, simulated))


def isolability_page(found: Isolability, tried: Sequence[Addition], title: str, simulated: bool) -> Page:
    """The page as sections, before it becomes HTML."""
    sections = (
        Section("limits", "The smallest effects that would be found", tables=(_grid(found),)),
        _alike(found, tried),
        _additions(tried),
        Section("unknown", "What these points cannot be asked", items=tuple(Item(s) for s in untested(found.problem))),
        Section("method", "Method and terms", METHOD, terms=_meanings(found)),
    )
    return Page(
        kind="Before measuring",
        title=title or found.problem.sim.seen.campaign.robot.name,
        badge="SIMULATED: no robot was measured" if simulated else "",
        summary=tuple(typeset(capital(f"add {_words(one)}.")) for one in tried[:3]),
        facts=_facts(found),
        sections=tuple(section for section in sections if section is not None),
        figures=_key_numbers(found),
        lead=_lead(found),
    )


def _lead(found: Isolability) -> str:
    named = sum(one.named for one in found.effects)
    return f"{named} of {len(found.effects)} effects would be found and named by these points, each acting alone."


def _key_numbers(found: Isolability) -> tuple[tuple[str, str], ...]:
    named = sum(one.named for one in found.effects)
    hidden = sum(not one.limit.shown for one in found.effects)
    return (
        ("Named", f"{named}"),
        ("Taken for each other", f"{len(found.effects) - named - hidden}"),
        ("Not seen", f"{hidden}"),
        ("Noise", f"{found.noise_m * 1e3:.3f} mm"),
        ("Points", f"{found.problem.sim.seen.count}"),
    )


def _facts(found: Isolability) -> tuple[tuple[str, str], ...]:
    known = "as drawn, to 1 mm and 1 mrad: all of it is fitted" if found.drawn else "to 0.1 mm and 0.1 mrad"
    return (
        ("Robot", found.problem.sim.seen.campaign.robot.name),
        ("Geometry known", known),
        ("Noise", f"{found.noise_m * 1e3:.3f} mm, one coordinate"),
        ("Software", f"trueaxis {VERSION}"),
    )


def _grid(found: Isolability) -> ShownTable:
    """Effects against joints: limits in mm."""
    cells: dict[tuple[str, str], list[Isolated]] = {}
    for one in found.effects:
        joint = one.place.joint or one.place.frame
        cells.setdefault((one.place.effect, NOWHERE if joint is None else str(joint)), []).append(one)
    columns = [*(str(j) for j in range(1, found.problem.sim.seen.joint_count + 1)), NOWHERE]
    rows = [
        [Cell(capital(effect_name(effect))), *(_limit(cells.get((effect, column), [])) for column in columns)]
        for effect in NAMES
        if any(key[0] == effect for key in cells)
    ]
    headings = (Heading("Effect"), *(Heading(column, numeric=True) for column in columns))
    note = (
        "Joint, or the link or frame behind it; – : of no joint. Bold: it could be taken for something else. ∞: not "
        "seen at any size. Empty: not among the effects that these points can be asked for. Of several at one joint "
        "(couplings) the worst."
    )
    return ShownTable("Smallest effect, mm rms at the targets", headings, aligned([rows]), note, dense=True)


def _limit(effects: Sequence[Isolated]) -> Cell:
    if not effects:
        return Cell("")
    if not all(one.limit.shown for one in effects):
        return Cell(NOT_AT_ALL, numeric=True, mark="muted")
    worst = max(one.limit.rms_m for one in effects) * 1e3
    return number(worst, decimals=3, mark="" if all(one.named for one in effects) else "significant")


def _alike(found: Isolability, tried: Sequence[Addition]) -> Section | None:
    doubtful = [one for one in found.effects if one.rivals]
    if not doubtful:
        return None
    headings = (
        Heading("Effect"),
        Heading("From, mm", "The smallest that would be found, rms at the targets", True),
        Heading("That is", "The same in its own unit"),
        Heading("Could be taken for", "Standard deviations between them; below 4 they are not told apart safely"),
        Heading("Add to the plan", "The block of points that sets it apart from most of them"),
    )
    rows = [_doubt_row(one, tried) for one in doubtful]
    table = ShownTable("Effects that these points could not tell apart", headings, aligned([rows]), dense=True)
    return Section("alike", "What could be taken for what", tables=(table,))


def _doubt_row(one: Isolated, tried: Sequence[Addition]) -> list[Cell]:
    size, unit = shown_size(one.limit)
    own = f"{_digits(size)} {unit}" if unit else NOWHERE
    rivals = [f"{place_words(rival.place)} ({rival.separation:.1f})" for rival in one.rivals[:MOST_RIVALS]]
    more = len(one.rivals) - MOST_RIVALS
    way = best_for(one.place, tried)
    return [
        Cell(capital(place_words(one.place))),
        number(one.limit.rms_m * 1e3),
        Cell(own),
        Cell("; ".join([*rivals, *([f"{more} more"] if more > 0 else [])])),
        Cell(NOWHERE, mark="muted") if way is None else Cell(_added(*way)),
    ]


def _digits(value: float) -> str:
    """Three digits, and no powers of ten for large values."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _added(addition: Addition, parting: Parting) -> str:
    if not parting.left:
        return f"{addition.words}: told from all"
    return f"{addition.words}: told from {listed([place_words(place) for place in parting.parted])}"


def _additions(tried: Sequence[Addition]) -> Section | None:
    if not tried:
        return None
    headings = (
        Heading("Measurement"),
        Heading("Points", numeric=True),
        Heading("Pairs told apart", numeric=True),
        Heading("Effects brought to light", numeric=True),
        Heading("Effects then alone", numeric=True),
    )
    rows = [
        [
            Cell(capital(one.words)),
            count(one.points),
            count(one.pairs),
            count(one.shown),
            count(sum(bool(parting.parted) and not parting.left for parting in one.partings)),
        ]
        for one in tried
    ]
    table = ShownTable("Each added to the plan alone, the most useful first", headings, aligned([rows]), dense=True)
    return Section("additions", "What to add to the plan", tables=(table,))


def _words(one: Addition) -> str:
    does = [f"tells {one.pairs} more {'pair' if one.pairs == 1 else 'pairs'} apart"] if one.pairs else []
    does += [f"brings {one.shown} more to light"] if one.shown else []
    return f"{one.words} ({one.points} points): that {' and '.join(does)}"


def _meanings(found: Isolability) -> tuple[tuple[str, str], ...]:
    there = {one.place.effect for one in found.effects}
    return tuple((capital(effect_name(effect)), text) for effect, text in MEANINGS.items() if effect in there)
