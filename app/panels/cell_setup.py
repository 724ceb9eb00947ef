"""What stands in the cell: targets and the links they ride on, the instrument, the sweeps to be made."""

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from app.cell_words import targets_words
from app.rigs import Source, source_events, source_of
from app.words import block
from app.workbench import Workbench
from core.campaign_files import INSTRUMENT_KINDS
from core.cell_setup import (
    changed_sweeps,
    changed_targets,
    commands_of_text,
    ends_of,
    home_events,
    planned_sweep,
    text_of_commands,
)
from core.errors import InputError
from core.point_lines import entered_points
from core.session_events import Event, InstrumentChosen, TargetEntry
from core.session_plan import PlannedSweep
from core.suggested_plan import suggested_sweeps
from core.wording import display_unit

if TYPE_CHECKING:
    import viser

NEW = "a new one"
SOURCES = {
    "entered by hand or from files": Source.BY_HAND,
    "simulated, for practice": Source.SIMULATED,
    "the built-in demo cell": Source.DEMO,
}
SIGMA_MM = (1e-6, 1e3)


class TargetEntryPanel:
    """Name, link and place of a target, to be added, changed or removed."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._list = gui.add_html("")
        self._name = gui.add_text("Name", "")
        hint = "Link k moves with joints 1 to k; 0 is the floor."
        self._link = gui.add_number("Rides on link", 1, min=0, max=100, step=1, hint=hint)
        hint = "x y z in mm in the frame that moves with the link, if you know it; otherwise it is estimated."
        self._place = gui.add_text("Known place", "", hint=hint)
        self._do = gui.add_button_group("Target", ("Add or change", "Remove"))
        self._do.on_click(self._act)

    def refresh(self) -> None:
        """Show the targets."""
        self._list.content = targets_words(self._bench.state)

    def _act(self, event: object) -> None:
        asked, name, link = self._do.value, str(self._name.value).strip(), self._link.value
        place = str(self._place.value)

        def job(client: object) -> None:
            state = self._bench.state
            if source_of(state) is Source.DEMO:
                raise InputError("the demo cell has its own targets; begin a new session to name yours")
            now = tuple(TargetEntry(t.name, t.link, t.point_m, t.sigma_m) for t in state.targets)
            others = tuple(target for target in now if target.name != name)
            if asked == "Remove" and len(others) == len(now):
                raise InputError(f"there is no target {name!r} to remove")
            if asked != "Remove":
                others = (*others, TargetEntry(name, _whole(link, "the link"), _place_of(place)))
            _append(self._bench, changed_targets(state, others))

        self._ask(event, job)


class InstrumentEntry:
    """Kind and promise of the instrument, and where the points come from."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._shown: object = None
        self._kind = gui.add_dropdown("Kind", INSTRUMENT_KINDS)
        hint = "What it promises: standard deviation of one coordinate of a point, mm. Nothing: it is estimated."
        self._sigma = gui.add_text("Stated σ [mm]", "", hint=hint)
        self._source = gui.add_dropdown("Points are", tuple(SOURCES))
        gui.add_button("Keep the instrument").on_click(self._keep)

    def refresh(self) -> None:
        """Show the instrument of the session."""
        state = self._bench.state
        said = state.instrument.kind, state.instrument.sigma_m, self._bench.rig.source, self._bench.session
        if said == self._shown:
            return
        self._shown = said
        self._kind.value = state.instrument.kind
        sigma = state.instrument.sigma_m
        self._sigma.value = "" if sigma is None else f"{sigma * 1e3:.6g}"
        self._source.value = next(name for name, source in SOURCES.items() if source is self._bench.rig.source)

    def _keep(self, event: object) -> None:
        kind, text, source = self._kind.value, str(self._sigma.value), SOURCES.get(self._source.value)

        def job(client: object) -> None:
            state = self._bench.state
            events: list[Event] = []
            if source is not None and source is not source_of(state):
                events += _source_events(self._bench, source)
            sigma = _sigma_m(text)
            if (kind, sigma) != (state.instrument.kind, state.instrument.sigma_m):
                if source is Source.DEMO:
                    raise InputError("the demo cell has its own instrument; begin a new session to choose another")
                events.append(InstrumentChosen(kind, sigma, state.instrument.description))
            _append(self._bench, events)

        self._ask(event, job)


class SweepEntry:
    """One sweep of the plan, to be added, changed or removed; or all of them as suggested."""

    def __init__(self, gui: "viser.GuiApi", bench: Workbench, ask: Callable) -> None:
        self._bench, self._ask = bench, ask
        self._offered: tuple[PlannedSweep, ...] = ()
        text = (
            "One joint moves at a time, the last joint first. Longer arcs and more stops make axes better known. "
            "<b>Suggest all</b> plans a sweep of every joint that a target shows."
        )
        gui.add_html(block(f"<p class='soft'>{text}</p>", "sweeps-intro"))
        gui.add_button("Suggest all").on_click(self._suggest)
        self._which = gui.add_dropdown("Sweep", (NEW,))
        self._which.on_update(lambda event: self._fill() if event.client else None)
        self._joint = gui.add_number("Joint", 1, min=1, max=100, step=1)
        self._from = gui.add_number("From [° or mm]", -25.0, step=0.001)
        self._to = gui.add_number("To [° or mm]", 25.0, step=0.001)
        self._stops = gui.add_number("Stops", 16, min=2, max=10_000, step=1)
        self._targets = gui.add_text("Targets", "", hint="Names, parted by commas.")
        self._both = gui.add_checkbox("Forwards and back", False, hint="The return pass shows lost motion.")
        hint = "Commands of all joints about which it is made, ° and mm; nothing: at home."
        self._held = gui.add_text("Others wait at", "", hint=hint)
        self._do = gui.add_button_group("This sweep", ("Add or change", "Remove"))
        self._do.on_click(self._act)
        hint = "Commands at the arm's marks, ° and mm, if you know them: displacement counts from there."
        self._home = gui.add_text("Home", text_of_commands(bench.nominal, bench.state.plan.home), hint=hint)
        gui.add_button("Keep home").on_click(self._keep_home)

    def refresh(self) -> None:
        """Offer the sweeps of the plan; what is typed stays until the plan is another one."""
        rows = self._bench.state.plan.sweeps
        if rows == self._offered:
            return
        names, chosen = (*map(_name, rows), NEW), self._which.value
        self._offered = rows
        if names != tuple(self._which.options):
            self._which.options = names
            self._which.value = chosen if chosen in names[:-1] else names[0]
        self._fill()

    def _fill(self) -> None:
        """The boxes as the chosen sweep has them."""
        row = self._chosen()
        robot, state = self._bench.nominal, self._bench.state
        if row is None:
            return
        scale = display_unit(bool(robot.sliding[row.joint - 1]))[1]
        low, high = ends_of(robot, state, row)
        self._joint.value, self._stops.value = row.joint, row.stops
        self._from.value, self._to.value = round(low * scale, 4), round(high * scale, 4)
        self._targets.value, self._both.value = ", ".join(row.targets), row.both_ways
        self._held.value = text_of_commands(robot, row.held)

    def _suggest(self, event: object) -> None:
        def job(client: object) -> None:
            state = self._bench.state
            sweeps = suggested_sweeps(self._bench.nominal, state.target_links)
            if not sweeps:
                raise InputError("no target shows any joint, expected targets on the links; see Targets above")
            _append(self._bench, changed_sweeps(state, sweeps))

        self._ask(event, job)

    def _act(self, event: object) -> None:
        asked, chosen = self._do.value, self._which.value
        joint, ends = self._joint.value, (self._from.value, self._to.value)
        stops, both = self._stops.value, self._both.value
        names, held = str(self._targets.value), str(self._held.value)

        def job(client: object) -> None:
            state = self._bench.state
            old = next((row for row in state.plan.sweeps if _name(row) == chosen), None)
            others = tuple(row for row in state.plan.sweeps if row is not old)
            if asked == "Remove":
                if old is None:
                    raise InputError("no sweep is chosen, expected one to remove")
                _append(self._bench, changed_sweeps(state, others))
                return
            number = _whole(joint, "the joint")
            same = old is not None and old.joint == number
            sweep = old.sweep if same else 1 + max((r.sweep for r in others if r.joint == number), default=0)
            row = planned_sweep(
                state,
                number,
                sweep,
                self._ends(number, ends),
                _whole(stops, "the number of stops"),
                tuple(dict.fromkeys(name.strip() for name in names.split(",") if name.strip())),
                bool(both),
                commands_of_text(self._bench.nominal, held, "others wait at"),
            )
            _append(self._bench, changed_sweeps(state, (*others, row)))

        self._ask(event, job)

    def _ends(self, joint: int, ends: tuple[float, float]) -> tuple[float, float]:
        robot = self._bench.nominal
        if not 1 <= joint <= robot.joint_count or not all(
            isinstance(end, int | float) and np.isfinite(end) for end in ends
        ):
            raise InputError(f"joint {joint} from {ends[0]!r} to {ends[1]!r}, expected a joint and two numbers")
        scale = display_unit(bool(robot.sliding[joint - 1]))[1]
        return ends[0] / scale, ends[1] / scale

    def _keep_home(self, event: object) -> None:
        text = str(self._home.value)

        def job(client: object) -> None:
            home = commands_of_text(self._bench.nominal, text, "home")
            if home != self._bench.state.plan.home:
                _append(self._bench, home_events(self._bench.state, home))

        self._ask(event, job)

    def _chosen(self) -> PlannedSweep | None:
        return next((row for row in self._bench.state.plan.sweeps if _name(row) == self._which.value), None)


def _append(bench: Workbench, events: list[Event]) -> None:
    if events:
        bench.session.append_all(events)
        bench.changed()


def _source_events(bench: Workbench, source: Source) -> list[Event]:
    """What says where points come from; measured and simulated ones never stand in one session."""
    if bench.state.shots or bench.state.checks:
        raise InputError("there are shots already; begin a new session for points from elsewhere")
    if source is Source.DEMO and bench.rig.source is not Source.DEMO:
        raise InputError("this is not the demo cell; begin a new session with it")
    return source_events(source, bench.nominal.name)


def _name(row: PlannedSweep) -> str:
    return f"joint {row.joint}, sweep {row.sweep}"


def _place_of(text: str) -> tuple[float, float, float] | None:
    points = entered_points(text, "mm")
    if len(points) > 1:
        raise InputError("the known place of a target is one line, expected x y z in mm, or nothing")
    return points[0].point_m if points else None


def _sigma_m(text: str) -> float | None:
    if not text.strip():
        return None
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not SIGMA_MM[0] <= value <= SIGMA_MM[1]:
        raise InputError(f"stated σ: {text.strip()[:40]!r}, expected a number of mm above 0, or nothing")
    return value * 1e-3


def _whole(value: object, what: str) -> int:
    if not isinstance(value, int | float) or value != value or value != int(value):
        raise InputError(f"{what} is {value!r}, expected a whole number")
    return int(value)
