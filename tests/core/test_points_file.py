"""Plain tables of one sweep's points."""

from pathlib import Path

import numpy as np
import pytest

from core.errors import CampaignError
from core.points_file import PlainSweep, read_points


def read(folder: Path, text: str) -> PlainSweep:
    (folder / "points.csv").write_text(text)
    return read_points(folder / "points.csv")


def test_points_alone(tmp_path: Path) -> None:
    sweep = read(tmp_path, "x_mm,y_m,z_mm\n1,2,3\n4,5,6\n,,\n7,8,9\n")
    np.testing.assert_allclose(sweep.point_m, [[0.001, 2, 0.003], [0.004, 5, 0.006], [0.007, 8, 0.009]])
    assert sweep.stop.tolist() == [0, 1, 3]
    assert sweep.target.tolist() == [0, 0, 0]
    assert (sweep.commanded, sweep.sliding, sweep.sigma_m) == (None, None, None)


def test_targets_share_the_stops_at_which_they_were_seen(tmp_path: Path) -> None:
    sweep = read(tmp_path, "x_mm,y_mm,z_mm,target\n1,2,3,A\n1,2,4,B\n2,2,3,A\n2,2,4,B\n3,2,4,B\n")
    assert sweep.target_names == ("A", "B")
    assert sweep.target.tolist() == [0, 1, 0, 1, 1]
    assert sweep.stop.tolist() == [0, 0, 1, 1, 2]


def test_steps_are_numbered_as_they_were_met(tmp_path: Path) -> None:
    sweep = read(tmp_path, "x_mm,y_mm,z_mm,step,sigma_mm\n1,2,3,40,0.1\n1,2,4,10,\n2,2,3,40,0.2\n2,2,4,20,0.1\n")
    assert sweep.stop.tolist() == [0, 1, 0, 2]
    np.testing.assert_allclose(sweep.sigma_m, [1e-4, np.nan, 2e-4, 1e-4])


@pytest.mark.parametrize(
    ("unit", "sliding", "si"), [("deg", False, np.pi / 180), ("rad", False, 1), ("mm", True, 1e-3)]
)
def test_the_unit_of_the_commands_tells_the_kind_of_joint(tmp_path: Path, unit: str, sliding: bool, si: float) -> None:
    sweep = read(tmp_path, f"x_mm,y_mm,z_mm,q_{unit}\n1,2,3,0\n1,2,4,10\n")
    assert sweep.sliding is sliding
    np.testing.assert_allclose(sweep.commanded, [0, 10 * si])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x,y_mm,z_mm\n1,2,3\n", "x has no unit"),
        ("x_mm,y_mm\n1,2\n", "column z_mm or z_m is missing"),
        ("x_mm,y_mm,z_mm,q\n1,2,3,4\n", "q has no unit"),
        ("x_mm,y_mm,z_mm,q_deg\n1,2,3,\n", "row 2, column q_deg: empty"),
        ("x_mm,y_mm,z_mm\n1,2,a\n", "row 2, column z_mm: 'a'"),
        ("x_mm,y_mm,z_mm\n1,,3\n", "row 2, column y_mm: empty"),
        ("x_mm,y_mm,z_mm\n,,\n", "at least one row"),
        ("x_mm,y_mm,z_mm,sigma_mm\n1,2,3,0\n", "above 0"),
        ("x_mm,y_mm,z_mm,step\n1,2,3,\n", "row 2, column step"),
        ("x_mm,y_mm,z_mm,target\n1,2,3,\n", "a target's name"),
    ],
)
def test_what_cannot_be_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(CampaignError) as told:
        read(tmp_path, text)
    assert words in str(told.value)
