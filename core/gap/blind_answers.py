"""answers.json: what was really wrong with each campaign of a blind check."""

from dataclasses import dataclass, replace
from pathlib import Path

from core.errors import InputError
from core.gap.place_words import NAMES
from core.gap.result import UNKNOWN, Place
from core.input_files import shown
from core.json_records import JsonRecord, read_object

OTHER = "other"
"""The effect of an answer for which the program has no candidate."""
EVERYWHERE = "all"
NOT_GIVEN = (None, "", "-")
OWNED = {
    "geometry": ("frame",),
    "coupling": ("source", "joint"),
    "target_slip": ("target",),
    **dict.fromkeys(("drift", "base_shift", "scale", "payload"), ()),
}
"""Which parts of a place belong to the name of an effect; of all others it is the joint."""
KEYS = {"joint": "joint", "link": "joint", "to": "joint", "from": "source", "frame": "frame", "target": "target"}
"""Keys of an answer, and which part of a place they mean."""


@dataclass(frozen=True)
class Answer:
    """One effect that is really there."""

    effect: str
    given: tuple[tuple[str, int | str | None], ...] = ()
    """Parts of the place that the answer names, with their values; None: all joints or links."""
    asked: bool = True
    """False: it is there as well, but too weak to be asked for; naming it is right, missing it is not wrong."""

    @property
    def joint(self) -> int | None:
        """The joint, if the answer names one."""
        value = dict(self.given).get("joint")
        return value if isinstance(value, int) else None

    def is_met_by(self, place: Place) -> bool:
        """Whether a place that was said is this one: the effect, and whatever of its place the answer gives."""
        if place.effect != (UNKNOWN if self.effect == OTHER else self.effect):
            return False
        return all(getattr(place, part) == value for part, value in self.given)


Answers = dict[str, tuple[Answer, ...]]


def read_answers(path: Path) -> Answers:
    """The answers by name of subfolder; none: nothing is wrong with that campaign.

    Beside ``effects`` a campaign may have ``also``: effects that are there as well and are not asked for.

    Raises:
        InputError: the file is missing, or something in it is not as expected; one sentence says what.
    """
    top = read_object(path)
    return {name: _answers(top.record(name)) for name in top.names()}


def _answers(record: JsonRecord) -> tuple[Answer, ...]:
    also = record.records("also") if "also" in record else ()
    asked = tuple(map(_answer, record.records("effects")))
    return (*asked, *(replace(_answer(one), asked=False) for one in also))


def _answer(record: JsonRecord) -> Answer:
    effect = record.text("effect")
    if effect in (OTHER, UNKNOWN):
        return Answer(OTHER, tuple((k, v) for k, v in _given(record).items() if k == "joint" and v is not None))
    if effect not in NAMES:
        raise record.wrong("effect", f"{OTHER} or one of {', '.join(n for n in NAMES if n != UNKNOWN)}")
    given = _given(record)
    if effect == "geometry" and "frame" not in given and "joint" in given:
        # Frame i is the link behind joint i.
        given["frame"] = given["joint"]
    owned = OWNED.get(effect, ("joint",))
    return Answer(effect, tuple((part, given[part]) for part in owned if part in given))


def _given(record: JsonRecord) -> dict[str, int | str | None]:
    """The parts of the place that an answer names."""
    given = {}
    for key, part in KEYS.items():
        value = record.get(key)
        if value in NOT_GIVEN:
            continue
        if part == "target":
            given[part] = record.text(key)
        elif value == EVERYWHERE:
            given[part] = None
        else:
            given[part] = record.integer(key)
    return given


def check_names(answers: Answers, folders: tuple[str, ...], path: Path) -> tuple[str, ...]:
    """Sentences on campaigns without an answer and answers without a campaign.

    Raises:
        InputError: no campaign has an answer.
    """
    if not set(answers) & set(folders):
        raise InputError(f"{path} has answers for {_some(answers)}, expected the subfolders {_some(folders)}")
    missing, spare = sorted(set(folders) - set(answers)), sorted(set(answers) - set(folders))
    notes = [f"no answer for {_some(missing)}: not scored"] if missing else []
    return tuple([*notes, *([f"answers without a campaign: {_some(spare)}"] if spare else [])])


def _some(names: object) -> str:
    names = list(names)
    listed = ", ".join(shown(name) for name in names[:5])
    return f"{listed} and {len(names) - 5} more" if len(names) > 5 else listed or "nothing"
