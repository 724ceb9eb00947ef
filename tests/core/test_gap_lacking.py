"""A name that leaves much at its own place is a relative's; one that is right leaves nothing there."""

import pytest
from gap_cells import crane_cell, measured

from core.gap.analysis import analyse
from core.gap.diagnosis import Findings
from core.gap.evidence import NOTHING
from core.gap.folds import blocks
from core.gap.lacking import lacks
from core.gap.observations import observe
from core.gap.open_set import Stand


def judged(fault: str, *without: str) -> tuple[Findings, Stand]:
    """What was found of one fault, and the first name."""
    seen = observe(measured(crane_cell(), fault))
    found = Findings(analyse(seen, frozenset(without)), seen, blocks(seen), told=False)
    return found, found.named[0]


@pytest.mark.parametrize(
    "fault",
    [
        "backlash:1:0.05deg",
        "backlash:2:0.05deg",
        "compliance:3:20urad/Nm",
        "flexure:2:10urad/Nm",
        "drift:-:0.2mm/h",
        "base_shift:113:0.5mm",
    ],
)
def test_the_right_name_leaves_nothing_at_its_place(fault: str) -> None:
    found, stand = judged(fault)
    assert stand.place.effect == fault.split(":")[0]
    assert not lacks(found.judge, stand, NOTHING)


def test_a_relative_leaves_much_there_and_is_no_likelier_than_not() -> None:
    found, stand = judged("hysteresis:2:0.05deg", "hysteresis")
    assert (stand.place.effect, stand.place.joint) == ("backlash", 2)
    assert lacks(found.judge, stand, NOTHING)


def test_effects_that_have_no_relatives_are_not_asked() -> None:
    found, stand = judged("ratio:2:0.3%")
    assert stand.place.effect == "ratio"
    assert not lacks(found.judge, stand, NOTHING)
