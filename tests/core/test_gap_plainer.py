"""Play instead of a hysteresis that can do all that play does and explains hardly more."""

from dataclasses import replace

import numpy as np
import pytest
from gap_cells import crane_cell, measured

from core.gap import plainer as plainer_module
from core.gap.analysis import Analysis, analyse
from core.gap.evidence import NOTHING, Chosen, without
from core.gap.observations import observe
from core.gap.plainer import _blurred, plainer
from core.gap.search import Found


def looked_for(name: str, joint: int, *faults: str) -> tuple[Analysis, Found]:
    """An analysis of faults, and what a search that knows one effect of one joint alone would have found."""
    analysis = analyse(observe(measured(crane_cell(), *faults)))
    of_joint = [k for k in analysis.problem.named if analysis.problem.candidates[k].place.joint == joint]
    groups = np.array([k for k in of_joint if analysis.problem.candidates[k].place.effect == name])
    gains = analysis.evidence.gains(groups)
    best = int(np.argmax(gains.evidence))
    chosen = Chosen((int(groups[best]),), (float(gains.size[best]),))
    return analysis, replace(analysis.found, chosen=chosen, worth=chosen, main=chosen)


def effects(analysis: Analysis, found: Found) -> list[list[str]]:
    out = plainer(analysis.problem, analysis.evidence, found, analysis.threshold, NOTHING)
    assert out.worth is out.main
    return [[analysis.problem.candidates[g].place.effect for g in c.groups] for c in (out.chosen, out.worth, out.main)]


def test_hysteresis_gives_way_to_play() -> None:
    assert effects(*looked_for("hysteresis", 1, "backlash:1:0.05deg")) == [["backlash"]] * 3


def test_hysteresis_stays_where_play_explains_less(monkeypatch: pytest.MonkeyPatch) -> None:
    """By a hundredth here; where that much may be the roughness of forms, play is preferred."""
    looked = looked_for("hysteresis", 1, "hysteresis:1:0.06deg")
    assert effects(*looked) == [["backlash"]] * 3
    monkeypatch.setattr(plainer_module, "PLAINER", 0.995)
    assert effects(*looked) == [["hysteresis"]] * 3


def test_what_is_left_by_a_name_of_another_joint_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    """What stood in for two causes gives way to one of them; the other is found beside it then."""
    analysis, found = looked_for("axis_wobble", 2, "mesh:1:0.05deg", "eccentricity:3:0.03deg")
    monkeypatch.setattr(plainer_module, "plausible", lambda one, chain: one.candidate.place.effect != "axis_wobble")
    out = plainer(analysis.problem, analysis.evidence, found, analysis.threshold, NOTHING)
    places = [analysis.problem.candidates[g].place for g in out.chosen.groups]
    assert [(place.effect, place.joint) for place in places] == [("mesh", 1), ("eccentricity", 3)]


def test_a_name_is_missed_among_all_that_was_found_though_another_does_as_well_alone() -> None:
    """Numbers that look impossible alone are blurred then, and are no reason to replace it."""
    analysis = analyse(observe(measured(crane_cell(), "compliance:2:20urad/Nm", "ratio:2:0.3%")))
    problem, evidence = analysis.problem, analysis.evidence
    effect = {g: problem.candidates[g].place.effect for g in problem.named}
    whole = analysis.found.chosen
    assert [effect[g] for g in whole.groups] == ["compliance", "ratio"]
    mine = without(whole, whole.groups[1:])
    gains = evidence.gains(problem.named)
    load = [k for k, g in enumerate(problem.named) if effect[g] == "payload" and problem.width(g) == 1]
    best = max(load, key=lambda k: gains.evidence[k])
    other = Chosen((int(problem.named[best]),), (float(gains.size[best]),))
    assert evidence.given(other) > evidence.given(mine)
    assert _blurred(problem, evidence, mine, other, 0, whole, NOTHING)
    assert not _blurred(problem, evidence, mine, other, 0, mine, NOTHING)
