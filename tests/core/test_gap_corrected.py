"""The sim that a diagnosis corrects: its points can be read back, and have no gap any more."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from core.campaign_files import read_campaign
from core.gap.corrected_csv import HEADER, corrected_to_csv
from core.gap.diagnosis import diagnose
from core.gap.result import Verdict
from tests.benchmarks.withheld.worlds import make_campaign


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory):
    """A simulated campaign of an arm whose joints are late, made without the product's formulas."""
    folder = tmp_path_factory.mktemp("late")
    make_campaign("irb", "latency", 10.0, 17, folder)
    return read_campaign(folder)


@pytest.fixture(scope="module")
def found(late):
    return diagnose(late)


def test_corrected_points_are_the_measured_ones_less_what_is_left(late, found) -> None:
    rows = list(csv.reader(io.StringIO(corrected_to_csv(found))))
    assert tuple(rows[0]) == HEADER
    points = np.array([row[2:] for row in rows[1:]], dtype=float)
    measured = 1e3 * late.measurements.point_m[found.rows]
    np.testing.assert_allclose(points, measured - 1e3 * found.left_m, atol=6e-6)
    assert [int(row[0]) for row in rows[1:]] == list(late.measurements.record[found.rows])


def test_the_corrected_sim_has_no_gap(late, found) -> None:
    table = late.measurements
    simulated = np.full((table.count, 3), np.nan)
    simulated[found.rows] = table.point_m[found.rows] - found.left_m
    again = diagnose(replace(late, measurements=replace(table, simulated_point_m=simulated)))
    assert found.verdict is Verdict.EXPLAINED
    assert again.verdict is Verdict.NO_GAP
