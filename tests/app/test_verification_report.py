"""Figures 9 and 10 and the page around them: what is drawn is what was found, for any number and size of errors."""

import json
import sys
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

sys.path.append(str(Path(__file__).parent.parent / "core"))
from arms_in_use import EXACT, arm, campaign, cell

from app.figures.pose_errors import orientation_errors_figure, position_errors_figure
from app.verification_report import verification_html, verification_page
from core.twin.campaign import simulate_campaign
from core.twin.noise import Noise
from core.verification import Limits, Verification, verify


@cache
def found(limits: Limits = Limits(), noise: Noise = Noise()) -> Verification:  # noqa: B008
    return verify(campaign("l6", noise), arm("l6", noise), limits)


def traces(figure) -> dict:
    return {trace.name: trace for trace in figure.data}


def test_the_figures_show_every_pose_of_both_models() -> None:
    for draw, kind in ((position_errors_figure, "position"), (orientation_errors_figure, "orientation")):
        shown = traces(draw(found()))
        assert set(shown) == {"nominal", "nominal, mean", "calibrated", "calibrated, mean"}
        for name in ("nominal", "calibrated"):
            errors = getattr(getattr(found(), name), kind)
            np.testing.assert_allclose(np.array(shown[name].y, dtype=float), errors.value * 1e3)
            np.testing.assert_allclose(np.array(shown[name].error_y.array, dtype=float), 2e3 * errors.std)
            assert float(shown[f"{name}, mean"].y[0]) == pytest.approx(errors.mean * 1e3)
            assert list(shown[name].x) == [str(k) for k in range(12)]


def test_everything_lies_within_the_figure() -> None:
    figure = position_errors_figure(found())
    low, high = (10 ** float(v) for v in figure.layout.yaxis.range)
    values = np.concatenate([found().nominal.position.value, found().calibrated.position.value]) * 1e3
    assert figure.layout.yaxis.type == "log"
    assert low < values.min() < values.max() < high


def test_a_limit_is_drawn_where_it_is() -> None:
    shown = traces(position_errors_figure(found(Limits(position_m=2e-3))))
    assert float(shown["limit, 2 mm"].y[0]) == 2.0
    assert "limit, 2 mm" not in traces(orientation_errors_figure(found(Limits(position_m=2e-3))))


def test_errors_of_nothing_do_not_stop_the_figure() -> None:
    perfect = found(noise=EXACT)
    low, high = position_errors_figure(perfect).layout.yaxis.range
    assert high - low <= 7
    assert "<html" in verification_html(perfect)


def test_the_page_says_what_was_found() -> None:
    page = verification_page(found(Limits(5e-3, 0.05)))
    assert page.badge.startswith("SIMULATED")
    assert [section.id for section in page.sections] == ["errors", "poses", "iso", "method"]
    said = " ".join(page.summary)
    assert f"{found().nominal.position.mean * 1e3:.2f} mm nominal" in said
    assert "limits the calibrated arm: pass" in said
    rows = page.sections[1].tables[0].groups[0]
    assert len(rows) == 12
    assert rows[0][-1].text == "pass"
    facts = dict(page.facts)
    assert "T1" in facts["Targets"]


def test_the_page_is_one_file_that_asks_for_nothing() -> None:
    html = verification_html(replace(found(), campaign=replace(found().campaign, title='<script>alert("x")</script>')))
    assert "<script>alert" not in html
    assert " src=" not in html.split("<main>")[1]
    blocks = html.split('<script type="application/json">')[1:]
    assert len(blocks) == 2
    for block in blocks:
        assert json.loads(block.split("</script>")[0])["data"]


def test_very_many_poses_are_thinned_and_the_worst_stay() -> None:
    own = cell("l6")
    protocol = replace(own.protocol, poses=np.tile(own.protocol.poses, (250, 1)))
    many = verify(simulate_campaign(2, replace(own, protocol=protocol)), arm("l6", Noise()))
    shown = traces(position_errors_figure(many))["calibrated"]
    assert len(shown.y) <= 2100 < many.calibrated.position.count
    assert max(map(float, shown.y)) == pytest.approx(many.calibrated.position.max * 1e3)
    table = verification_page(many).sections[1].tables[0]
    assert len(table.groups[0]) == 500
    assert "verification.json" in table.note
    assert verification_page(many).sections[2].tables[1].groups[0][0][1].text == "250"


def test_compensated_visits_have_a_section_of_their_own() -> None:
    from test_pose_loop import loop

    assert "loop" not in [section.id for section in verification_page(found()).sections]
    both = loop(Noise(), Noise())
    section = next(s for s in verification_page(both.found).sections if s.id == "loop")
    assert [len(group) for group in section.tables[0].groups] == [2, 2]
    shown = traces(section.plots[0].figure)
    np.testing.assert_allclose(
        np.array(shown["compensated command"].y, dtype=float), both.compensated.errors.position.value * 1e3
    )
    assert verification_html(both.found).count('<script type="application/json">') == 4


def test_without_orientations_there_is_no_figure_of_them() -> None:
    from test_partial_poses import seen_only

    few = verify(seen_only(campaign("l6", Noise()), "T1"), arm("l6", Noise()))
    page = verification_page(few)
    assert len(page.sections[0].plots) == 1
    assert "No orientation was measured." in page.summary
    assert "nan" not in verification_html(few).split("<main>")[1].split("<script")[0]
