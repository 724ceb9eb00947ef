"""The moment of a slip is found to the record; outliers come alone; where a joint's play began is unknown."""

from dataclasses import replace

import numpy as np
import pytest
from gap_cells import crane_cell, measured

from core.gap.analysis import ROW, _in_a_row
from core.gap.diagnosis import diagnose
from core.gap.doings import doings
from core.gap.effects.lost_motion import BEGAN, backlashes, hystereses
from core.gap.observations import observe
from core.gap.result import Place


def records_of(name: str) -> np.ndarray:
    campaign = measured(crane_cell())
    number = [target.name for target in campaign.targets].index(name)
    table = campaign.measurements
    return np.sort(table.record[(table.target == number) & np.isfinite(table.point_m).all(axis=1)])


@pytest.mark.parametrize(("target", "share"), [("A", 0.3), ("A", 0.8), ("C", 0.5), ("C", 0.25)])
def test_a_slip_is_told_from_the_first_record_at_which_it_was_seen(target: str, share: float) -> None:
    """Targets that are measured second or third at a standstill too, and after a long time in which nobody looked."""
    records = records_of(target)
    seen = int(records[int(share * len(records))])
    before = int(records[records < seen].max())
    found = diagnose(measured(crane_cell(), f"target_slip:{target}@{before + 1}:0.5mm"))
    (cause,) = found.causes
    assert cause.place.same_as(Place("target_slip", target=target))
    assert cause.place.record == seen


def test_points_off_in_a_row_are_no_outliers() -> None:
    marked = np.array([1, 0, 1, 1, 0, 1, 1, 1, 0, 1, 1, 1, 1], dtype=bool)
    row = np.array([0, 0, 0, 0, 0, 1, 1, 1, 0, 1, 1, 1, 1], dtype=bool)
    assert ROW == 3
    assert np.array_equal(_in_a_row(marked, ROW), row)
    assert not _in_a_row(np.zeros(5, dtype=bool), ROW).any()


@pytest.mark.parametrize("family", [backlashes, hystereses])
def test_where_play_began_is_a_number_of_its_own(family) -> None:
    """Joint 3 is swept after points were measured: until it moves, its play may stand anywhere."""
    campaign = measured(crane_cell())
    approach = campaign.measurements.approach.copy()
    approach[campaign.measurements.joint == 1, 1:] = 0
    told = doings(observe(replace(campaign, measurements=replace(campaign.measurements, approach=approach))))
    still = {joint: bool((told.sense[:, joint - 1] == 0).any()) for joint in (1, 2, 3)}
    assert still == {1: False, 2: True, 3: True}
    for candidate in family(told):
        columns = candidate.columns(told)
        assert len(columns) == len(candidate.names)
        began = any(name.startswith(BEGAN) for name in candidate.names)
        if candidate.atom == "taken up by the motor" or family is hystereses:
            assert began == still[candidate.place.joint]
        if began:
            (_, feature), *_ = columns[-1]
            sense = told.sense[:, candidate.place.joint - 1]
            assert set(np.unique(feature)) <= {0.0, 1.0}
            assert not feature[sense != 0].any() or "loads above" in candidate.atom
