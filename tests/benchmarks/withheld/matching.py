"""Whether a cause that was said is the one that is true."""

from tests.benchmarks.withheld.product import Json

NEAR = 0.03
"""Of all records, by which a moment may be missed."""
NUMBERS = ("joint", "to", "frame", "link")
UNKNOWN, OTHER = "unknown", "other"


def number(cause: Json) -> int | None:
    """The joint, link or frame that a cause speaks of; None: it speaks of all or of none."""
    for key in NUMBERS:
        value = cause.get(key)
        if isinstance(value, int) and not isinstance(value, bool):
            return value
    return None


def is_right(said: Json, truth: Json, records: int) -> bool:
    """Whether effect and place are both right."""
    if said.get("effect") != truth["effect"]:
        return False
    for key in ("record", "target", "from"):
        if key == "record" and "record" in truth:
            moment = said.get("record")
            if not isinstance(moment, int) or abs(moment - int(str(truth["record"]))) > NEAR * records:
                return False
        elif key in truth and said.get(key) != truth[key]:
            return False
    return number(said) == number(truth)


def right_in_class(said: Json, truth: Json, records: int) -> bool:
    """Whether the truth is the cause or one that was declared to look the same."""
    return any(is_right(one, truth, records) for one in members(said))


def members(said: Json) -> list[Json]:
    """A cause and all that the data cannot tell from it."""
    declared = said.get("class")
    return [said, *declared] if isinstance(declared, list) else [said]


def right_place(said: Json, truth: Json) -> bool:
    """Whether the joint, link or frame is right, up to the declared class; the joints of a product count both."""
    places = truth.get("where", truth)
    assert isinstance(places, dict)
    if "variable" in places:
        return _right_variable(said, str(places["variable"]))
    wanted = {number(places), places.get("second")} - {None}
    return any(number(one) in wanted for one in members(said))


def _right_variable(said: Json, variable: str) -> bool:
    """Time is also meant by those who name what only time can do."""
    timed = {"drift", "base_shift", "thermal"}
    return any(
        one.get("variable") == variable or (variable == "time" and one.get("effect") in timed) for one in members(said)
    )
