"""Solving ahead: nothing is computed twice, and nothing is shown that belongs to other data."""

import threading
from dataclasses import replace

import numpy as np
import pytest

import app.ahead
from app.ahead import SolveAhead
from core.calibration import calibrate
from core.errors import AxisUndefined
from core.twin.campaign import simulate_campaign
from tests.app.report_cases import rows_kept


@pytest.fixture
def solved(monkeypatch) -> list:
    """The campaigns that were solved."""
    asked = []

    def watched(campaign):
        asked.append(campaign)
        return calibrate(campaign)

    monkeypatch.setattr(app.ahead, "calibrate", watched)
    return asked


def test_what_was_prepared_is_there_for_an_equal_campaign(solved):
    ahead = SolveAhead()
    ahead.prepare(simulate_campaign(1))
    ahead.prepare(simulate_campaign(1))
    found = ahead.solution(simulate_campaign(1))
    assert len(solved) == 1
    assert found.estimate.noise_m == calibrate(simulate_campaign(1)).estimate.noise_m


@pytest.mark.parametrize("change", ["a point by a picometre", "a record less", "the title"])
def test_any_other_campaign_is_solved_anew(solved, change):
    campaign, ahead = simulate_campaign(1), SolveAhead()
    ahead.prepare(campaign)
    if change == "the title":
        other = replace(campaign, title=f"{campaign.title}!")
    elif change == "a record less":
        other = rows_kept(campaign, np.arange(len(campaign.measurements.record)) != 7)
    else:
        points = campaign.measurements.point_m.copy()
        points[7, 1] += 1e-12
        other = replace(campaign, measurements=replace(campaign.measurements, point_m=points))
    found = ahead.solution(other)
    assert len(solved) == 2
    assert found.campaign is other


def test_what_cannot_be_solved_is_said_when_it_is_asked_for(solved):
    campaign, ahead = simulate_campaign(1), SolveAhead()
    few = rows_kept(campaign, np.isin(campaign.measurements.record, campaign.measurements.record[:2]))
    ahead.prepare(few)
    with pytest.raises(AxisUndefined):
        ahead.solution(few)


def test_whoever_asks_meanwhile_waits_for_what_is_being_solved(monkeypatch):
    begun, go, asked = threading.Event(), threading.Event(), []

    def slow(campaign):
        asked.append(campaign)
        begun.set()
        assert go.wait(10)
        return calibrate(campaign)

    monkeypatch.setattr(app.ahead, "calibrate", slow)
    ahead = SolveAhead()
    ahead.prepare(simulate_campaign(1))
    assert begun.wait(10)
    # One at a time: what comes meanwhile is left for when it is asked for.
    ahead.prepare(simulate_campaign(2))
    threading.Timer(0.1, go.set).start()
    assert ahead.solution(simulate_campaign(1)).rejected is not None
    assert len(asked) == 1
