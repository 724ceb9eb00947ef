"""Campaign folders: what is read, in which units; what is refused, and what the message names; the way back."""

import time
import tomllib
from hashlib import sha256
from pathlib import Path

import numpy as np
import pytest
from campaign_texts import (
    CAMPAIGN_TOML,
    FILES,
    HEADER,
    MEASUREMENTS_CSV,
    ROBOT_TOML,
    ROWS,
    assert_same,
    with_cell,
    with_columns,
    with_header,
    without,
    write_files,
)

from core.campaign_files import read_campaign
from core.campaign_writer import write_campaign
from core.errors import CampaignError, InputError
from core.measurements import Campaign

REAL = Path(__file__).resolve().parents[3] / "shared" / "real" / "ur10_a"
"""The published UR10 campaign of 11,911 poses, beside the checkout where it is at hand."""

MM = 1e-3


@pytest.fixture
def small(tmp_path: Path) -> Campaign:
    return read_campaign(write_files(tmp_path))


def test_points_and_commands_are_in_si(small: Campaign) -> None:
    table = small.measurements
    np.testing.assert_allclose(table.point_m[1], [101.5 * MM, 199 * MM, 5 * MM])
    np.testing.assert_allclose(table.commanded[7], [np.deg2rad(-30.5), np.deg2rad(20), 0])
    np.testing.assert_allclose(table.commanded[0], [0, 0, 100 * MM])
    np.testing.assert_allclose(table.speed[0], [np.deg2rad(0.5), 0, 0])
    np.testing.assert_allclose(table.readback[0], [np.deg2rad(10.01), np.nan, np.nan])
    np.testing.assert_allclose(table.torque_nm[0], [3.25, np.nan, np.nan])
    np.testing.assert_allclose(table.simulated_point_m[0], [MM, 2 * MM, 3 * MM])
    np.testing.assert_allclose(table.target_quaternion[0], [0.6, 0.8, 0, 0])
    assert (table.time_s[0], table.temperature_c[0], table.arm_temperature_c[0]) == (0.5, 21.5, 30.0)
    assert table.payload_kg[0] == 5.0
    assert np.isnan(table.payload_kg[9])


def test_who_moves_and_what_is_seen(small: Campaign) -> None:
    table = small.measurements
    assert table.phase.tolist() == ["sweep"] * 7 + ["pose"] * 2 + ["move"]
    assert table.joint.tolist() == [2] * 7 + [0] * 3
    assert table.sweep.tolist() == [1] * 7 + [0] * 3
    assert table.step.tolist() == [0, 1, 2, 3, 4, 5, 6, -1, -1, -1]
    assert table.pose.tolist() == [-1] * 7 + [0, 0, -1]
    assert table.target.tolist() == [0] * 6 + [1, 0, 0, -1]
    assert table.seen.tolist() == [True] * 6 + [False, True, True, False]
    assert table.check.tolist() == [False] * 6 + [True] + [False] * 3
    assert table.approach[0].tolist() == [0, 1, -1]
    assert table.approach[6].tolist() == [0, -1, 0]
    assert table.approach[7].tolist() == [1, -1, 0]
    assert small.sweeps[0].stop.tolist() == [0, 1, 2, 3, 4, 5]


def test_description(small: Campaign, tmp_path: Path) -> None:
    assert small.title == "small"
    assert small.notes == {"operator": "R. Müller", "shift": "2", "hall": "4"}
    assert small.instrument.kind == "laser-tracker"
    assert small.instrument.description == {"model": "AT960"}
    np.testing.assert_allclose(small.home, [0, np.deg2rad(10), 20 * MM])
    np.testing.assert_allclose(small.targets[0].point_m, [0.01, 0.02, 0.03])
    assert small.targets[0].sigma_m == pytest.approx(1e-4)
    assert small.targets[1].point_m is None
    parts = [(tmp_path / name).read_bytes() for name in ("campaign.toml", "robot.toml", "measurements.csv")]
    assert small.digest == sha256(b"".join(parts)).hexdigest()


def test_a_rows_own_sigma_beats_the_instruments(small: Campaign) -> None:
    table = small.measurements
    np.testing.assert_allclose(table.covariance_m2[0], np.eye(3) * 2e-5**2)
    np.testing.assert_allclose(table.covariance_m2[7], np.eye(3) * 5e-4**2)
    assert np.isnan(table.covariance_m2[6]).all()


def test_without_any_statement_the_covariance_is_unknown(tmp_path: Path) -> None:
    text = CAMPAIGN_TOML.replace("sigma_mm = 0.02\n", "")
    campaign = read_campaign(write_files(tmp_path, campaign=text, measurements=without("sigma_mm")))
    assert np.isnan(campaign.measurements.covariance_m2).all()


def test_a_full_covariance_beats_sigma(tmp_path: Path) -> None:
    entries = {"xx": 4, "xy": 1, "xz": 0.5, "yy": 3, "yz": -0.25, "zz": 2}
    columns = {f"cov_{key}_mm2": [""] * 7 + [str(value)] for key, value in entries.items()}
    covariance = read_campaign(write_files(tmp_path, measurements=with_columns(columns))).measurements.covariance_m2
    np.testing.assert_allclose(covariance[7], np.array([[4, 1, 0.5], [1, 3, -0.25], [0.5, -0.25, 2]]) * 1e-6)
    np.testing.assert_allclose(covariance[8], np.eye(3) * 2e-5**2)


def test_other_units_say_the_same(small: Campaign, tmp_path_factory: pytest.TempPathFactory) -> None:
    text = MEASUREMENTS_CSV
    for old, new, factor in (("q2_deg", "q2_rad", np.pi / 180), ("q3_mm", "q3_m", MM), ("y_mm", "y_m", MM)):
        header = text.splitlines()[0].split(",")
        place = header.index(old)
        lines = [line.split(",") for line in text.splitlines()]
        for cells in lines[1:]:
            cells[place] = repr(float(cells[place]) * factor) if cells[place] else ""
        lines[0][place] = new
        text = "\n".join(map(",".join, lines)) + "\n"
    other = read_campaign(write_files(tmp_path_factory.mktemp("units"), measurements=text)).measurements
    np.testing.assert_allclose(other.commanded, small.measurements.commanded, atol=1e-15)
    np.testing.assert_allclose(other.point_m, small.measurements.point_m, atol=1e-15)


def test_spreadsheet_habits_are_accepted(tmp_path: Path, small: Campaign) -> None:
    text = "\ufeff" + MEASUREMENTS_CSV.replace("\n", "\r\n").replace("T1", '" T1 "') + "\r\n\r\n"
    write_files(tmp_path)
    (tmp_path / "measurements.csv").write_bytes(text.encode())
    (tmp_path / "campaign.toml").write_bytes(("\ufeff" + CAMPAIGN_TOML.replace("\n", "\r\n")).encode())
    assert_same(read_campaign(tmp_path), small)


def test_records_out_of_order_are_sorted(tmp_path: Path, small: Campaign) -> None:
    text = "\n".join([HEADER, *ROWS[::-1]]) + "\n"
    again = read_campaign(write_files(tmp_path, measurements=text))
    assert again.measurements.record.tolist() == list(range(1, 11))
    assert_same(again, small)


def test_read_back_values_may_pass_the_limits(tmp_path: Path) -> None:
    text = with_cell(9, "q1_deg", "170.001")
    campaign = CAMPAIGN_TOML.replace('"commanded"', '"readback"')
    read_campaign(write_files(tmp_path, measurements=text, campaign=campaign))
    with pytest.raises(CampaignError, match="row 9"):
        read_campaign(write_files(tmp_path, measurements=text))


WRONG_CELLS = [
    ("record", 3, "x", "'x'"),
    ("record", 3, "1", "row 2 has it too"),
    ("record", 3, "1.5", "whole number"),
    ("record", 3, "", "empty"),
    ("phase", 4, "swep", "'sweep', 'pose', 'move'"),
    ("joint", 4, "4", "1..3"),
    ("joint", 4, "0", "1..3"),
    ("joint", 4, "", "empty"),
    ("sweep", 4, "0", "at least 1"),
    ("step", 4, "-1", "at least 0"),
    ("pose", 9, "", "empty"),
    ("use", 5, "maybe", "'fit', 'check'"),
    ("approach", 5, "2", "+1, -1"),
    ("approach2", 9, "up", "'up'"),
    ("target", 5, "T9", "'T1', 'floor'"),
    ("target", 5, "", "'T1', 'floor'"),
    ("target", 11, "T1", "move"),
    ("q1_deg", 6, "", "empty"),
    ("q1_deg", 6, "12,5", "cells"),
    ("q1_deg", 6, "12_5", "number"),
    ("q1_deg", 6, "१२", "number"),
    ("q1_deg", 6, "nan", "number"),
    ("q1_deg", 6, "170.1", "-170 to 170 deg"),
    ("q3_mm", 6, "500.001", "-10 to 500 mm"),
    ("x_mm", 6, "nan", "number"),
    ("x_mm", 6, "inf", "number"),
    ("x_mm", 6, "1e400", "number"),
    ("x_mm", 6, "1e15", "1e+12"),
    ("x_mm", 6, "", "all of them empty"),
    ("x_mm", 6, "12.3 mm", "'12.3 mm'"),
    ("sigma_mm", 9, "0", "above 0"),
    ("sigma_mm", 9, "-0.1", "above 0"),
    ("time_s", 9, "10:30", "'10:30'"),
    ("target_qw", 3, "0.9", "unit quaternion"),
    ("target_qy", 3, "", "together"),
    ("sim_z_mm", 3, "", "all of them empty"),
]


@pytest.mark.parametrize(("column", "row", "cell", "words"), WRONG_CELLS)
def test_a_wrong_cell_is_named(tmp_path: Path, column: str, row: int, cell: str, words: str) -> None:
    with pytest.raises(CampaignError) as told:
        read_campaign(write_files(tmp_path, measurements=with_cell(row, column, cell)))
    message = str(told.value)
    assert f"measurements.csv, row {row}" in message
    assert words in message
    assert column in message or words == "cells"


def test_a_move_holds_no_point(tmp_path: Path) -> None:
    text = MEASUREMENTS_CSV
    for column in ("x_mm", "y_mm", "z_mm"):
        text = with_cell(11, column, "1", text)
    with pytest.raises(CampaignError, match="row 11, column x_mm: '1', expected nothing"):
        read_campaign(write_files(tmp_path, measurements=text))


def test_a_target_before_the_joint_cannot_see_it(tmp_path: Path) -> None:
    text = CAMPAIGN_TOML.replace("link = 2", "link = 1")
    with pytest.raises(CampaignError, match=r"row 2, column target: 'T1' rides on link 1 and cannot see joint 2"):
        read_campaign(write_files(tmp_path, campaign=text))


def test_a_covariance_must_be_one(tmp_path: Path) -> None:
    for entries in ((1, 1, 0, 1, 0, 1), (1, 0.9, 0.9, 1, -0.9, 1), (1, 2, 2, 1, 2, 1)):
        names = [f"cov_{key}_mm2" for key in ("xx", "xy", "xz", "yy", "yz", "zz")]
        columns = {name: [str(value)] for name, value in zip(names, entries, strict=True)}
        with pytest.raises(CampaignError, match=r"row 2.*positive definite"):
            read_campaign(write_files(tmp_path, measurements=with_columns(columns)))


WRONG_HEADERS = [
    (with_header("q1_deg", "q1"), "q1 has no unit"),
    (with_header("x_mm", "x"), "x has no unit"),
    (with_header("x_mm", "x_cm"), "x_cm has an unsuitable unit, expected x_mm or x_m"),
    (with_header("q3_mm", "q3_deg"), "q3_deg has an unsuitable unit, expected q3_mm or q3_m"),
    (with_header("q1_deg", "q1_mm"), "q1_mm has an unsuitable unit"),
    (with_header("tau1_nm", "tau1"), "tau1 has no unit"),
    (with_header("speed1_deg_s", "speed1_deg"), "unsuitable unit"),
    (with_header("sigma_mm", "Sigma_mm"), "expected sigma_mm"),
    (with_header("remark", "q4_deg"), "joint 4"),
    (with_header("remark", "approach4"), "joint 4"),
    (with_header("remark", "x_m"), "both give x"),
    (with_header("remark", "x_mm"), "'x_mm' stands twice"),
    (without("x_mm"), "column x_mm or x_m is missing"),
    (without("q2_deg"), "column q2_deg or q2_rad is missing"),
    (without("record"), "column record is missing"),
    (without("phase"), "column phase is missing"),
    (without("target"), "column target is missing"),
    (without("joint"), "column joint is missing; it is needed in row 2"),
    (without("step"), "column step is missing; it is needed in row 2"),
    (without("pose"), "column pose is missing; it is needed in row 9"),
    (without("target_qx"), "column target_qx is missing"),
    (without("sim_x_mm"), "column sim_x_mm or sim_x_m is missing"),
    (MEASUREMENTS_CSV.replace(",", ";"), "parted by commas"),
    (HEADER + "\n", "no rows"),
]


@pytest.mark.parametrize(("text", "words"), WRONG_HEADERS)
def test_a_wrong_column_is_named(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(CampaignError) as told:
        read_campaign(write_files(tmp_path, measurements=text))
    assert "measurements.csv" in str(told.value)
    assert words in str(told.value)


def test_a_passive_joint_has_no_command(tmp_path: Path) -> None:
    robot = ROBOT_TOML.replace('kind = "revolute"\ndrive_ratio', 'kind = "passive"\ndrive_ratio')
    with pytest.raises(CampaignError, match="joint 2 is passive and has no q column"):
        read_campaign(write_files(tmp_path, robot=robot))
    with pytest.raises(CampaignError, match=r"row 2, column joint: '2', expected a joint with a motor"):
        read_campaign(write_files(tmp_path, robot=robot, measurements=without("q2_deg")))


WRONG_DESCRIPTIONS = [
    ('format = "trueaxis-campaign/1"', 'format = "trueaxis-campaign/2"', 'expected "trueaxis-campaign/1"'),
    ("title =", "title", "line 2"),
    ('"commanded"', '"wished"', '"readback"'),
    ('"laser-tracker"', '"ruler"', '"theodolite-pair"'),
    ("sigma_mm = 0.02", "sigma_mm = 0.0", "sigma_mm = 0.0"),
    ("sigma_mm = 0.02", "sigma = 0.02", "expected sigma_mm"),
    ("place = false", 'place = "no"', "true or false"),
    ("link = 2", "link = 4", "link 0..3"),
    ("link = 2", "link = 1.5", "whole number"),
    ("xyz_mm = [10.0, 20.0, 30.0]", "xyz = [10.0, 20.0, 30.0]", "expected xyz_mm"),
    ("xyz_mm = [10.0, 20.0, 30.0]", "xyz_mm = [10.0, 20.0]", "3 numbers"),
    ("xyz_sigma_mm = 0.1", "xyz_sigma_mm = -0.1", "at least 0"),
    ('name = "floor"', 'name = "T1"', "name of its own"),
    ("q = [0.0, 10.0, 20.0]", "q = [0.0, 10.0]", "3 numbers"),
    ('robot = "robot.toml"', 'robot = "../robot.toml"', "leads out of the folder"),
    ('robot = "robot.toml"', 'robot = "/etc/hostname"', "leads out of the folder"),
    ('robot = "robot.toml"', 'robot = "nobody.toml"', "is missing"),
    ("[[target]]", "[[targets]]", "no [[target]]"),
]


@pytest.mark.parametrize(("old", "new", "words"), WRONG_DESCRIPTIONS)
def test_a_wrong_description_is_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    assert old in CAMPAIGN_TOML
    with pytest.raises(InputError) as told:
        read_campaign(write_files(tmp_path, campaign=CAMPAIGN_TOML.replace(old, new)))
    assert ".toml" in str(told.value)
    assert words in str(told.value)


@pytest.mark.parametrize("name", FILES)
def test_a_file_that_cannot_be_read_is_named(tmp_path: Path, name: str) -> None:
    path = write_files(tmp_path) / name
    good = path.read_bytes()
    for content, words in (
        (b"", "empty"),
        (good[:40] + b"\n\xff" + good[40:], "line 2" if name == "measurements.csv" else "not UTF-8"),
        (good[:40] + b"\0" + good[40:], "NUL"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=words) as told:
            read_campaign(tmp_path)
        assert name in str(told.value)
    path.unlink()
    with pytest.raises(InputError, match=f"{name} is missing"):
        read_campaign(tmp_path)
    path.mkdir()
    with pytest.raises(InputError, match=f"{name} is not a file"):
        read_campaign(tmp_path)


@pytest.mark.parametrize(("name", "size"), [("campaign.toml", 1_000_001), ("measurements.csv", 64_000_001)])
def test_a_file_that_is_too_large_is_not_read(tmp_path: Path, name: str, size: int) -> None:
    with (write_files(tmp_path) / name).open("r+b") as file:
        file.truncate(size)
    with pytest.raises(CampaignError, match="expected at most"):
        read_campaign(tmp_path)


def test_a_missing_folder_is_named(tmp_path: Path) -> None:
    with pytest.raises(CampaignError, match="nowhere is missing"):
        read_campaign(tmp_path / "nowhere")
    with pytest.raises(CampaignError, match=r"robot.toml is not a folder"):
        read_campaign(write_files(tmp_path) / "robot.toml")


@pytest.mark.parametrize("covariance", [False, True])
def test_what_is_written_is_read_back(tmp_path: Path, covariance: bool) -> None:
    columns = {f"cov_{k}_mm2": ["4" if k[0] == k[1] else "0.5"] for k in ("xx", "xy", "xz", "yy", "yz", "zz")}
    text = with_columns(columns).replace(",speed1_deg_s", ",read3_mm") if covariance else MEASUREMENTS_CSV
    campaign = read_campaign(write_files(tmp_path, measurements=text))
    write_campaign(tmp_path / "again", campaign, ROBOT_TOML)
    again = read_campaign(tmp_path / "again")
    assert_same(again, campaign)
    assert sorted(p.name for p in (tmp_path / "again").iterdir()) == sorted(FILES)


def test_frames_of_denavit_and_hartenberg_are_undone_on_the_way_back(tmp_path: Path) -> None:
    """A target on link 2 of a DH arm is told in DH frame 2, at the far end of that link."""
    dh = "\n".join(f"[[dh]]\ntheta_deg = {t}\nd_mm = {d}\na_mm = {a}\nalpha_deg = {u}" for t, d, a, u in DH_ROWS)
    head, _, _ = ROBOT_TOML.partition("[[frame]]")
    campaign = read_campaign(write_files(tmp_path, robot=head + dh))
    # Rot(z,0) Trans(0,0,7) Trans(100,0,0) Rot(x,90) carries (10, 20, 30) to (110, -30, 27).
    np.testing.assert_allclose(campaign.targets[0].point_m, [0.110, -0.030, 0.027], atol=1e-15)
    write_campaign(tmp_path / "again", campaign, head + dh)
    written = tomllib.loads((tmp_path / "again" / "campaign.toml").read_text())
    assert written["target"][0]["xyz_mm"] == pytest.approx([10, 20, 30], abs=1e-11)
    assert_same(read_campaign(tmp_path / "again"), campaign)


DH_ROWS = [(0, 5, 50, 0), (0, 7, 100, 90), (0, 0, 0, 0)]


def test_names_that_need_quotes_survive(tmp_path: Path) -> None:
    name = 'T "1", left'
    text = CAMPAIGN_TOML.replace('"T1"', r'"T \"1\", left"').replace('"4"', r'"a\nb \\ \u0001"')
    rows = MEASUREMENTS_CSV.replace("T1", '"T ""1"", left"')
    campaign = read_campaign(write_files(tmp_path, campaign=text, measurements=rows))
    assert campaign.targets[0].name == name
    write_campaign(tmp_path / "again", campaign, ROBOT_TOML)
    assert_same(read_campaign(tmp_path / "again"), campaign)


def test_twenty_thousand_rows_are_read_at_once(tmp_path: Path) -> None:
    header = "record,phase,pose,target,q1_deg,q2_deg,q3_mm,x_mm,y_mm,z_mm,sigma_mm,time_s,temperature_c"
    rows = (f"{k},pose,{k},T1,{k % 170},{k % 90}.25,{k % 500},{k}.125,{-k}.5,3.25,0.02,{k},21.5" for k in range(20_000))
    write_files(tmp_path, measurements="\n".join([header, *rows]) + "\n")
    start = time.process_time()
    campaign = read_campaign(tmp_path)
    assert time.process_time() - start < 1.0
    assert campaign.measurements.count == 20_000


@pytest.mark.skipif(not REAL.is_dir(), reason="the measured campaign is not at hand")
def test_a_measured_campaign_is_read() -> None:
    start = time.process_time()
    campaign = read_campaign(REAL)
    assert time.process_time() - start < 2.0
    assert campaign.measurements.count == 11_911
    assert campaign.measurements.seen.all()
    assert campaign.robot.joint_count == 6
