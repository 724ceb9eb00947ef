"""Joints or motors that stood still at all points: what depends on such an angle is one number."""

from core.gap.observations import Observations
from core.gap.result import Place

CONSTANT = ("eccentricity", "ratio")
"""What is no more than a zero offset where a joint stands still."""


def is_offset_of_held(seen: Observations, place: Place) -> bool:
    """Whether a cause is a zero offset of a joint that was held."""
    return place.effect == "zero_offset" and bool((seen.held | seen.still)[place.joint - 1])


def same_where_held(seen: Observations, place: Place) -> list[Place]:
    """What such a cause may be as well; nothing, of other causes."""
    return [Place(effect, joint=place.joint) for effect in CONSTANT] if is_offset_of_held(seen, place) else []


def words_to_measure(place: Place) -> str:
    """What tells a zero offset of a held joint from the rest."""
    return f"Sweep joint {place.joint} itself: only its own motion shows what depends on its angle."
