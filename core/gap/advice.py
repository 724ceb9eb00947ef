"""What to measure next when causes remain that the data cannot tell apart."""

from core.gap.analysis import Analysis
from core.gap.result import Place, Rivals

BREAKERS = (
    (
        {"zero_offset", "geometry"},
        "No measurement of points separates these: check the joint's mastering marks, or fix one of the two by a drawing or a datum.",
    ),
)


def advice(analysis: Analysis, places: tuple[Place, ...]) -> Rivals:
    """The measurement that would separate the first two of some places best."""
    return Rivals(places, BREAKERS[0][1], 0.0)
