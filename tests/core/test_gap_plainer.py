"""Play instead of a hysteresis that can do all that play does and explains hardly more."""

from dataclasses import replace

import numpy as np
import pytest
from gap_cells import crane_cell, measured

from core.gap import plainer as plainer_module
from core.gap.analysis import Analysis, analyse
from core.gap.evidence import NOTHING, Chosen
from core.gap.observations import observe
from core.gap.plainer import plainer
from core.gap.search import Found


def looked_for(effect: str) -> tuple[Analysis, Found]:
    """An analysis, and what a search that knows hysteresis alone would have found."""
    analysis = analyse(observe(measured(crane_cell(), effect)))
    joint = int(effect.split(":")[1])
    of_joint = [k for k in analysis.problem.named if analysis.problem.candidates[k].place.joint == joint]
    groups = np.array([k for k in of_joint if analysis.problem.candidates[k].place.effect == "hysteresis"])
    gains = analysis.evidence.gains(groups)
    best = int(np.argmax(gains.evidence))
    chosen = Chosen((int(groups[best]),), (float(gains.size[best]),))
    return analysis, replace(analysis.found, chosen=chosen, worth=chosen, main=chosen)


def effects(analysis: Analysis, found: Found) -> list[list[str]]:
    out = plainer(analysis.problem, analysis.evidence, found, NOTHING)
    assert out.worth is out.main
    return [[analysis.problem.candidates[g].place.effect for g in c.groups] for c in (out.chosen, out.worth, out.main)]


def test_hysteresis_gives_way_to_play() -> None:
    assert effects(*looked_for("backlash:1:0.05deg")) == [["backlash"]] * 3


def test_hysteresis_stays_where_play_explains_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a hundredth here; where that much may be the roughness of forms, play is preferred."""
    looked = looked_for("hysteresis:1:0.06deg")
    assert effects(*looked) == [["backlash"]] * 3
    monkeypatch.setattr(plainer_module, "PLAINER", 0.995)
    assert effects(*looked) == [["hysteresis"]] * 3
