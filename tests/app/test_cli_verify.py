"""``trueaxis verify``, ``compensate`` and ``export`` as processes: what they write, and what they refuse."""

import csv
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import SAMPLES, assert_refused, contents, copy_of_sample, edit_cell, edit_rows, trueaxis

from core.calibration_file import read_calibration
from core.compensation import reached
from core.kinematics import forward
from core.rotations import quaternions, turns_of_rotations

CAMPAIGN = SAMPLES / "irb_l6"
FOUR = ("nominal_position_mm", "calibrated_position_mm", "nominal_orientation_rad", "calibrated_orientation_rad")


@pytest.fixture(scope="module")
def calibration(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibrated")
    assert trueaxis("calibrate", CAMPAIGN, "--out", folder).returncode == 0
    return folder / "calibration.json"


def write_poses(path: Path, calibration: Path, count: int = 5) -> np.ndarray:
    """Poses of the nominal arm as a file; the poses themselves."""
    arm = read_calibration(calibration)
    q = np.random.default_rng(1).uniform(-0.4, 0.4, (count, 6))
    poses = forward(arm.nominal, q)
    turns = quaternions(poses[:, :3, :3])
    rows = [f"p{k},{','.join(repr(float(v)) for v in [*poses[k, :3, 3] * 1e3, *turns[k]])}" for k in range(count)]
    path.write_text("pose,x_mm,y_mm,z_mm,qw,qx,qy,qz\n" + "\n".join(rows) + "\n", encoding="utf-8")
    return poses


def table(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def test_verify_writes_the_contract_and_a_report(calibration: Path, tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    done = trueaxis("verify", CAMPAIGN, "--calibration", calibration, "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert set(contents(out)) == {"verification.json", "report.html"}
    document = json.loads((out / "verification.json").read_text(encoding="utf-8"))
    assert [record["pose"] for record in document["poses"]] == list(range(12))
    assert set(FOUR) <= set(document["poses"][0])
    assert 44 < document["summary"]["nominal_position_mm"]["mean"] < 50
    assert document["summary"]["calibrated_position_mm"]["mean"] < 2
    assert document["improvement_position"] > 20
    assert "position, mean [mm]" in done.stdout
    assert "simulated" in done.stdout
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "SIMULATED" in report
    assert report.count('<script type="application/json">') == 2
    assert "http" not in report.split("<main>")[1].split("</main>")[0].replace("http://www.w3.org", "")


def test_verify_prints_its_json_and_keeps_limits(calibration: Path, tmp_path: Path) -> None:
    done = trueaxis(
        "verify",
        CAMPAIGN,
        "--calibration",
        calibration,
        "--out",
        tmp_path,
        "--json",
        "--limit-mm",
        5,
        "--limit-mrad",
        50,
    )
    assert done.returncode == 0
    assert json.loads(done.stdout) == json.loads((tmp_path / "verification.json").read_text(encoding="utf-8"))
    limits = json.loads(done.stdout)["limits"]
    assert (limits["nominal"], limits["calibrated"]) == ("fail", "pass")
    assert "within the limits" in done.stderr
    again = trueaxis("verify", CAMPAIGN, "--calibration", calibration, "--out", tmp_path / "b", "--limit-mm", 5)
    assert "pass" in again.stdout


def test_the_same_input_gives_the_same_files(calibration: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        trueaxis("verify", CAMPAIGN, "--calibration", calibration, "--out", tmp_path / name)
    first, second = (json.loads((tmp_path / n / "verification.json").read_text()) for n in ("a", "b"))
    assert first == second


def test_a_campaign_from_elsewhere_is_verified_with_a_note(calibration: Path, tmp_path: Path) -> None:
    assert trueaxis("simulate", "--out", tmp_path / "later", "--seed", 9).returncode == 0
    done = trueaxis("verify", tmp_path / "later", "--calibration", calibration, "--out", tmp_path / "out")
    assert done.returncode == 0
    assert "another campaign" in done.stdout


@pytest.mark.parametrize("option", ["--limit-mm=0", "--limit-mrad=-1", "--limit-mm=wide", "--limit-mm=nan"])
def test_limits_are_numbers_above_zero(option: str, calibration: Path, tmp_path: Path) -> None:
    done = trueaxis("verify", CAMPAIGN, "--calibration", calibration, "--out", tmp_path / "out", option)
    assert done.returncode == 2
    assert "expected a number above 0" in done.stderr
    assert not (tmp_path / "out").exists()


def test_verify_refuses_what_it_cannot_use(calibration: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"

    def verify(campaign: Path, file: Path = calibration):
        return trueaxis("verify", campaign, "--calibration", file, "--out", out)

    assert_refused(verify(tmp_path / "nowhere"), "nowhere", "campaign folder")
    assert_refused(verify(CAMPAIGN, tmp_path / "none.json"), "none.json is missing")
    assert_refused(verify(CAMPAIGN, CAMPAIGN / "robot.toml"), "robot.toml", "not valid JSON")
    assert_refused(verify(SAMPLES / "scara_slide"), "joints")
    sweeps_only = copy_of_sample(tmp_path)
    edit_rows(sweeps_only, lambda rows: [row for row in rows if row["phase"] == "sweep"])
    assert_refused(verify(sweeps_only), "no pose records")
    edit_cell(sweeps_only, 5, "x_mm", "wide")
    assert_refused(verify(sweeps_only), "row 7", "x_mm", "wide")
    broken = json.loads(calibration.read_text(encoding="utf-8"))
    del broken["frames"]
    (tmp_path / "broken.json").write_text(json.dumps(broken), encoding="utf-8")
    assert_refused(verify(CAMPAIGN, tmp_path / "broken.json"), "broken.json", "frames")
    assert not out.exists()


def test_compensate_makes_the_calibrated_arm_go_there(calibration: Path, tmp_path: Path) -> None:
    poses = write_poses(tmp_path / "poses.csv", calibration)
    out = tmp_path / "commands.csv"
    done = trueaxis("compensate", "--calibration", calibration, tmp_path / "poses.csv", "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    rows = table(out)
    assert [row["pose"] for row in rows] == [f"p{k}" for k in range(5)]
    assert {row["status"] for row in rows} == {"ok"}
    commanded = np.deg2rad([[float(row[f"q{j}_deg"]) for j in range(1, 7)] for row in rows])
    there = reached(read_calibration(calibration), commanded)
    np.testing.assert_allclose(there, poses, rtol=0, atol=1e-7)
    sent = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows])
    assert np.linalg.norm(sent - poses[:, :3, 3] * 1e3, axis=1).mean() > 20


def test_compensate_takes_poses_in_the_instruments_frame_and_as_turns(calibration: Path, tmp_path: Path) -> None:
    arm = read_calibration(calibration)
    poses = write_poses(tmp_path / "poses.csv", calibration, 3)
    seen = arm.base @ poses
    by_turns = tmp_path / "turns.csv"
    angles = np.rad2deg(turns_of_rotations(seen[:, :3, :3]))
    lines = [",".join(repr(float(v)) for v in [*seen[k, :3, 3], *angles[k]]) for k in range(3)]
    by_turns.write_text("x_m,y_m,z_m,rx_deg,ry_deg,rz_deg\n" + "\n".join(lines) + "\n", encoding="utf-8")
    common = ("--calibration", calibration, "--out")
    assert trueaxis("compensate", tmp_path / "poses.csv", *common, tmp_path / "a.csv").returncode == 0
    assert trueaxis("compensate", by_turns, *common, tmp_path / "b.csv", "--frame", "instrument").returncode == 0
    first, second = (table(tmp_path / n) for n in ("a.csv", "b.csv"))
    for one, two in zip(first, second, strict=True):
        assert float(one["q4_deg"]) == pytest.approx(float(two["q4_deg"]), abs=1e-6)
        assert float(one["x_mm"]) == pytest.approx(float(two["x_m"]) * 1e3, abs=1e-6)


def test_rows_that_cannot_be_had_are_named_and_left_empty(calibration: Path, tmp_path: Path) -> None:
    write_poses(tmp_path / "poses.csv", calibration)
    lines = (tmp_path / "poses.csv").read_text(encoding="utf-8").splitlines()
    lines[2] = "far,9000,0,0,1,0,0,0"
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    out = tmp_path / "out.csv"
    done = trueaxis("compensate", "--calibration", calibration, tmp_path / "poses.csv", "--out", out)
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    assert "row 3, pose far: unreachable" in done.stderr
    assert "4 of 5 poses" in done.stdout
    rows = table(out)
    assert rows[1]["status"].startswith("unreachable")
    assert {value for key, value in rows[1].items() if key not in ("pose", "status")} == {""}


def test_compensate_refuses_what_it_cannot_use(calibration: Path, tmp_path: Path) -> None:
    out, poses = tmp_path / "out.csv", tmp_path / "poses.csv"

    def compensate(text: str, *options: object):
        poses.write_text(text, encoding="utf-8")
        return trueaxis("compensate", "--calibration", calibration, poses, "--out", out, *options)

    head = "x_mm,y_mm,z_mm,qw,qx,qy,qz\n"
    assert_refused(compensate(head + "9000,0,0,1,0,0,0\n"), "poses.csv", "none of the 1 poses", "row 2", "unreachable")
    assert_refused(compensate(head + "1,2,3,1,1,0,0\n"), "poses.csv", "row 2", "expected 1")
    assert_refused(compensate("x,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,1,0,0,0\n"), "column x", "x_mm")
    assert_refused(compensate(""), "poses.csv", "empty")
    assert compensate(head + "1,2,3,1,0,0,0\n", "--frame", "floor").returncode == 2
    assert compensate(head + "1,2,3,1,0,0,0\n", "--within-mm", "-1").returncode == 2
    assert not out.exists()
    missing = trueaxis("compensate", "--calibration", tmp_path / "none.json", poses, "--out", out)
    assert_refused(missing, "none.json is missing")
    nothing = trueaxis("compensate", "--calibration", calibration, tmp_path / "none.csv", "--out", out)
    assert_refused(nothing, "none.csv is missing")


@pytest.mark.parametrize("form", ["urdf", "mjcf", "dh", "json"])
def test_export_writes_one_file(form: str, calibration: Path, tmp_path: Path) -> None:
    out = tmp_path / f"robot.{form}"
    done = trueaxis("export", "--calibration", calibration, "--format", form, "--out", out)
    assert done.returncode == 0
    assert set(contents(tmp_path)) == {out.name}
    text = out.read_text(encoding="utf-8")
    expected = {"urdf": "<robot", "mjcf": "<mujoco", "dh": "trueaxis-dh/1", "json": "trueaxis-chain/1"}
    assert expected[form] in text
    assert ("condition" in done.stderr) == (form == "dh")


def test_an_exported_urdf_serves_as_the_nominal_robot_of_a_campaign(calibration: Path, tmp_path: Path) -> None:
    """The calibrated arm described by its URDF: what verification then calls nominal is as good as calibrated."""
    campaign = copy_of_sample(tmp_path)
    trueaxis("export", "--calibration", calibration, "--format", "urdf", "--out", campaign / "robot.urdf")
    described = (campaign / "robot.toml").read_text(encoding="utf-8")
    joints = described[described.index("[[joint]]") : described.index("[[frame]]")]
    couplings = described[described.index("[[coupling]]") : described.index("[[link]]")]
    source = 'urdf = "robot.urdf"\nbase_link = "base_link"\ntip_link = "tool"\n'
    head = 'format = "trueaxis-robot/1"\nname = "as calibrated"\n'
    (campaign / "robot.toml").write_text(f"{head}{source}\n{joints}\n{couplings}", encoding="utf-8")
    assert trueaxis("calibrate", campaign, "--out", tmp_path / "again").returncode == 0
    done = trueaxis(
        "verify", campaign, "--calibration", tmp_path / "again" / "calibration.json", "--out", tmp_path / "v"
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / "v" / "verification.json").read_text())["summary"]
    before = json.loads(
        trueaxis("verify", CAMPAIGN, "--calibration", calibration, "--out", tmp_path / "w", "--json").stdout
    )
    assert summary["calibrated_position_mm"]["mean"] == pytest.approx(
        before["summary"]["calibrated_position_mm"]["mean"], rel=0.05
    )
    assert summary["nominal_position_mm"]["mean"] < before["summary"]["nominal_position_mm"]["mean"]


def test_export_refuses_what_it_cannot_use(calibration: Path, tmp_path: Path) -> None:
    out = tmp_path / "robot.urdf"
    assert trueaxis("export", "--calibration", calibration, "--format", "step", "--out", out).returncode == 2
    assert_refused(trueaxis("export", "--calibration", tmp_path, "--format", "urdf", "--out", out), "is not a file")
    shutil.copy(calibration, tmp_path / "copy.json")
    inside = tmp_path / "copy.json" / "robot.urdf"
    assert_refused(
        trueaxis("export", "--calibration", calibration, "--format", "urdf", "--out", inside), "cannot be written"
    )
    assert not out.exists()
