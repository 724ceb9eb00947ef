"""Effects and where they sit, put into words."""

from collections.abc import Iterable

from core.gap.result import UNKNOWN, Cause, Place

NAMES = {
    "geometry": "geometry",
    "zero_offset": "zero offset",
    "ratio": "gear ratio",
    "eccentricity": "once-a-turn error",
    "mesh": "tooth ripple",
    "backlash": "backlash",
    "compliance": "compliance",
    "coupling": "coupling",
    "axis_wobble": "axis wobble",
    "latency": "latency",
    "thermal": "thermal growth",
    "drift": "drift",
    "base_shift": "base shift",
    "target_slip": "target slip",
    "scale": "length scale",
    "hysteresis": "hysteresis",
    "flexure": "flexure",
    "payload": "payload",
    "linkage": "four-bar linkage",
    "quantisation": "encoder steps",
    UNKNOWN: "unknown effect",
}
"""Every effect of the contract, as a person calls it; the order is that of pages and tables."""
CALIBRATION = "what the calibration leaves uncertain"

MEANINGS = {
    "geometry": "A link is longer or shorter, or an axis points elsewhere, than in the sim.",
    "zero_offset": "The joint stands a constant amount beside its command.",
    "ratio": "The joint moves a little further, or less far, than commanded, in proportion.",
    "eccentricity": "A wheel sits off its centre: the joint errs to and fro once a turn.",
    "mesh": "Teeth or a wave generator: the joint errs to and fro several times a turn.",
    "backlash": "Play in the drive: the joint stops elsewhere when it comes from the other side.",
    "compliance": "The drive gives under load, like a spring.",
    "coupling": "The motor of one joint moves another joint as well, and the sim does not know it.",
    "axis_wobble": "The axis itself tilts or shifts while the joint turns: the bearing does not run true.",
    "latency": "The joint lags behind its command, or is read late: an error along the motion.",
    "thermal": "Links grow as the arm warms up.",
    "drift": "The instrument or the base creeps while time goes by.",
    "base_shift": "From one record on, the base or the instrument stands elsewhere.",
    "target_slip": "From one record on, a target sits elsewhere on its link.",
    "scale": "The instrument's millimetre is not the sim's millimetre.",
    "hysteresis": "Lost motion that grows with the way since the last reversal.",
    "flexure": "The link itself bends or twists under load.",
    "payload": "The arm carries more, less or elsewhere than the sim believes.",
    "linkage": "A four-bar drive whose bars are not as long as in the sim.",
    "quantisation": "The encoder counts in steps that show.",
    UNKNOWN: "Something acts here, and none of the effects that are known to the program describes it.",
}

OF_ALL = {"latency": "all joints", "quantisation": "all joints", "thermal": "all links", "flexure": "all links"}
ON_LINKS = ("thermal", "flexure")
VARIABLES = {
    "time": "that follows time",
    "configuration": "that follows the arm's configuration",
    "payload": "that follows the payload",
}


def effect_name(effect: str) -> str:
    """What a person calls an effect."""
    return NAMES.get(effect, effect.replace("_", " "))


def place_words(place: Place) -> str:
    """An effect with its place: ``backlash of joint 3``; texts from files are in it as they are."""
    name, where = effect_name(place.effect), where_words(place)
    return f"{name} {where}" if where else name


def where_words(place: Place) -> str:
    """The place alone, to be put behind the name of an effect: ``of joint 3``; empty: it has none."""
    if place.effect == "coupling" and place.source is not None:
        return f"from joint {place.source} to joint {place.joint}"
    if place.effect == UNKNOWN and place.joint is not None:
        return f"at joint {place.joint}"
    if place.frame is not None:
        return f"of frame {place.frame}"
    since = f"from record {place.record} on" if place.record is not None else ""
    if place.target is not None:
        return f"of target {place.target} {since}".rstrip()
    if place.joint is not None:
        return f"of {'link' if place.effect in ON_LINKS else 'joint'} {place.joint}"
    if place.variable is not None:
        return VARIABLES.get(place.variable, f"that follows {place.variable}")
    return since or (f"of {OF_ALL[place.effect]}" if place.effect in OF_ALL else "")


MOST_WORDS = 3
"""Places of a class that a sentence names; the rest is counted."""


def either_of(places: Iterable[Place]) -> str:
    """Places of a class: ``backlash of joint 3 or hysteresis of joint 3``; of a large one the first few."""
    words = [place_words(place) for place in places]
    if len(words) > MOST_WORDS + 1:
        words = [*words[:MOST_WORDS], f"one of {len(words) - MOST_WORDS} more"]
    return listed(words, "or")


def cause_words(cause: Cause) -> str:
    """A cause by its name, or as the class that the data leave open."""
    return place_words(cause.place) if len(cause.twins) < 2 else either_of(cause.twins)


def listed(words: list[str], last: str = "and") -> str:
    """a; a and b; a, b and c."""
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} {last} {words[-1]}" if words else ""
