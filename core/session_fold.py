"""State + event -> state: what each kind of event changes.

The fold never refuses an event that stands in a file: if others that it speaks of are lost, it does what is left to
do. Whether an event makes sense is asked before it is written, by ``core.session_checks``.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from core.measurements import Instrument, Target
from core.session_entries import Entry
from core.session_events import (
    CheckShot,
    Closed,
    Copied,
    Created,
    Event,
    Fact,
    Failed,
    InstrumentChosen,
    Judged,
    NoteWritten,
    Opened,
    OperatorNamed,
    Planned,
    PosesPlanned,
    RobotChosen,
    Setting,
    ShotTaken,
    Skipped,
    Solved,
    TargetsNamed,
    Titled,
    WentTo,
)
from core.session_plan import Plan
from core.session_poses import PosePlan
from core.session_state import Check, Failure, Note, Shot, Solve, State

FILING = (Opened, Closed, Copied)
"""Events of the file, which change nothing that was measured or decided."""


def applied(state: State, entry: Entry) -> State:
    """The state after one more event."""
    change = _CHANGES.get(type(entry.event))
    changes = {} if change is None else change(state, entry, entry.event)
    if not isinstance(entry.event, FILING):
        changes["changed_utc"] = entry.utc
    return replace(state, **changes) if changes else state


def folded(state: State, entries: Iterable[Entry]) -> State:
    """The state after more events."""
    for entry in entries:
        state = applied(state, entry)
    return state


def _created(state: State, entry: Entry, event: Created) -> dict[str, Any]:
    return {"created_utc": entry.utc, "software": (event.software,)}


def _opened(state: State, entry: Entry, event: Opened) -> dict[str, Any]:
    return {} if event.software in state.software[-1:] else {"software": (*state.software, event.software)}


def _titled(state: State, entry: Entry, event: Titled) -> dict[str, Any]:
    return {"title": event.title}


def _operator(state: State, entry: Entry, event: OperatorNamed) -> dict[str, Any]:
    return {"operator": event.name}


def _robot(state: State, entry: Entry, event: RobotChosen) -> dict[str, Any]:
    return {"robot_toml": event.toml, "robot_files": tuple(event.files.items())}


def _targets(state: State, entry: Entry, event: TargetsNamed) -> dict[str, Any]:
    return {"targets": tuple(Target(t.name, t.link, t.point_m, t.sigma_m) for t in event.targets)}


def _instrument(state: State, entry: Entry, event: InstrumentChosen) -> dict[str, Any]:
    return {"instrument": Instrument(event.instrument, event.sigma_m, dict(event.description), event.turn_sigma_rad)}


def _plan(state: State, entry: Entry, event: Planned) -> dict[str, Any]:
    return {"plan": Plan(event.sweeps, event.home, event.joint_values)}


def _poses(state: State, entry: Entry, event: PosesPlanned) -> dict[str, Any]:
    return {"poses": PosePlan(event.wanted, event.targets)}


def _fact(state: State, entry: Entry, event: Fact) -> dict[str, Any]:
    return {"facts": _with(state.facts, event.key, event.value or None)}


def _setting(state: State, entry: Entry, event: Setting) -> dict[str, Any]:
    return {"settings": _with(state.settings, event.key, event.value)}


def _shot(state: State, entry: Entry, event: ShotTaken) -> dict[str, Any]:
    record = event.record or state.next_record
    shot = Shot(entry.seq, entry.utc, entry.by, record, event)
    shots = [*state.shots, shot]
    place = None if event.replaces is None else state.place_of(event.replaces)
    if place is not None:
        shots[place] = replace(shots[place], superseded_by=entry.seq)
    changes = {"shots": tuple(shots), "next_record": max(record + 1, state.next_record)}
    return changes if shot.key is None else changes | {"cursor": shot.key}


def _judged(state: State, entry: Entry, event: Judged) -> dict[str, Any]:
    shots = list(state.shots)
    for number in event.shots:
        place = state.place_of(number)
        if place is not None:
            judgement = {"verdict": event.verdict, "reason": event.reason, "judged_by": entry.by}
            shots[place] = replace(shots[place], **judgement)
    return {"shots": tuple(shots)}


def _skipped(state: State, entry: Entry, event: Skipped) -> dict[str, Any]:
    return {"skipped": _with(state.skipped, event.key, event.reason), "cursor": event.key}


def _went_to(state: State, entry: Entry, event: WentTo) -> dict[str, Any]:
    if event.key not in state.skipped:
        return {"cursor": event.key}
    # Who goes to a skipped step means to make it after all.
    return {"cursor": event.key, "skipped": _with(state.skipped, event.key, None)}


def _check(state: State, entry: Entry, event: CheckShot) -> dict[str, Any]:
    others = tuple(check for check in state.checks if check.number != event.check)
    before = next((check.shots for check in state.checks if check.number == event.check), ())
    return {"checks": (*others, Check(event.check, event.target, (*before, event)))}


def _solved(state: State, entry: Entry, event: Solved) -> dict[str, Any]:
    return {"solves": (*state.solves, Solve(entry.seq, entry.utc, entry.by, event))}


def _note(state: State, entry: Entry, event: NoteWritten) -> dict[str, Any]:
    return {"notes": (*state.notes, Note(entry.seq, entry.utc, entry.by, event))}


def _failed(state: State, entry: Entry, event: Failed) -> dict[str, Any]:
    return {"failures": (*state.failures, Failure(entry.seq, entry.utc, event.sentence))}


def _with(values: Mapping, key: object, value: object) -> Mapping:
    """A mapping with one more value; None takes the key away."""
    changed = {**values, key: value}
    if value is None:
        del changed[key]
    return MappingProxyType(changed)


_CHANGES: dict[type[Event], Callable[[State, Entry, Any], dict[str, Any]]] = {
    Created: _created,
    Opened: _opened,
    Titled: _titled,
    OperatorNamed: _operator,
    RobotChosen: _robot,
    TargetsNamed: _targets,
    InstrumentChosen: _instrument,
    Planned: _plan,
    PosesPlanned: _poses,
    Fact: _fact,
    Setting: _setting,
    ShotTaken: _shot,
    Judged: _judged,
    Skipped: _skipped,
    WentTo: _went_to,
    CheckShot: _check,
    Solved: _solved,
    NoteWritten: _note,
    Failed: _failed,
}
