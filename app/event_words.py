"""Events of a session as a person calls them."""

from core.session_events import (
    CheckShot,
    Event,
    Fact,
    InstrumentChosen,
    Judged,
    NoteWritten,
    OperatorNamed,
    Planned,
    PosesPlanned,
    RobotChosen,
    Setting,
    ShotTaken,
    Skipped,
    TargetsNamed,
    Titled,
)
from core.session_state import State

CHOICES: dict[type[Event], str] = {
    InstrumentChosen: "the choice of the instrument",
    NoteWritten: "the note that was written last",
    OperatorNamed: "the operator's name",
    Planned: "the change of the plan",
    PosesPlanned: "the change of the test poses",
    RobotChosen: "the choice of the robot",
    TargetsNamed: "the change of the targets",
    Titled: "the change of the title",
}
"""Events that need no more words than their kind."""


def stop_words(taken: ShotTaken, state: State) -> str:
    """Which stop of its sweep a shot was taken at: ``stop 3``, or that it is beside the plan."""
    planned = [row.stops for row in state.plan.sweeps if (row.joint, row.sweep) == (taken.joint, taken.sweep)]
    return "an extra stop" if planned and taken.step >= planned[0] else f"stop {taken.step + 1}"


def event_words(event: Event, state: State) -> str:
    """What an event of the session was, as the object of a sentence; plain text, not escaped."""
    if isinstance(event, ShotTaken):
        again = "the second measurement of " if event.replaces else ""
        return f"{again}the shot of joint {event.joint}, {stop_words(event, state)}, target {event.target}"
    if isinstance(event, Judged):
        shot = state.shot(event.shots[0])
        record = "shots" if shot is None or len(event.shots) > 1 else f"record {shot.record}"
        return f"that {record} is {event.verdict}"
    if isinstance(event, Skipped):
        return f"the skipping of joint {event.joint}, stop {event.step + 1}, target {event.target}"
    if isinstance(event, Setting):
        return f"the choice of {event.key.replace('_', ' ')}"
    if isinstance(event, Fact):
        return f"what was entered as {event.key}"
    if isinstance(event, CheckShot):
        return f"one shot of the instrument check at target {event.target}"
    return CHOICES.get(type(event), "what was entered last")
