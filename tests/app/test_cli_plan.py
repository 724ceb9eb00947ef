"""``trueaxis plan`` as a process: what it writes, that it can be measured and read back, and what it refuses."""

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import SAMPLES, assert_refused, contents, copy_of_sample, edit_cell, edit_rows, trueaxis

from core.campaign_files import read_campaign
from core.planning.shots import shot_count
from core.robot_files import read_robot

CAMPAIGN = SAMPLES / "irb_l6"
HEADER_START = ["record", "phase"]


def rows_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def plan_of(folder: Path) -> dict:
    return json.loads((folder / "plan.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module", params=["sweeps", "poses"])
def planned(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    out = tmp_path_factory.mktemp("planned") / "deep" / "out"
    done = trueaxis("plan", CAMPAIGN, "--kind", request.param, "--shots", 80, "--out", out)
    assert (done.returncode, done.stderr) == (0, "")
    assert "80 shots" in done.stdout
    assert "min saved" in done.stdout
    return request.param, out


def test_it_writes_the_commands_and_what_to_expect(planned: tuple[str, Path]) -> None:
    kind, out = planned
    assert set(contents(out)) == {"plan.csv", "plan.json", "plan.html"}
    document, rows = plan_of(out), rows_of(out / "plan.csv")
    assert document["format"] == "trueaxis-plan/1"
    assert (document["kind"], document["shots"], document["seed"]) == (kind, 80, 1)
    assert 0.01 < document["expected"]["mean_position_mm"] < 0.5
    assert document["unobservable"] == 0
    assert document["saving"]["baseline_shots"] == 129
    assert 1.2 < document["saving"]["baseline_expected"]["mean_position_mm"] < 2.2
    assert document["saving"]["minutes_saved_for_equal_accuracy"] > 30
    assert document["minutes"] == pytest.approx(80 * 40 / 60, abs=0.01)
    assert all(value > 0 for value in document["observability"].values())
    assert list(rows[0])[:2] == HEADER_START
    assert {(row["x_mm"], row["y_mm"], row["z_mm"]) for row in rows} == {("", "", "")}
    assert sum(bool(row["target"]) for row in rows) == 80
    assert sum(target["shots"] for target in document["targets"]) == 80
    assert any("collisions" in sentence for sentence in document["assumptions"])


def test_it_says_which_causes_of_a_gap_the_points_will_tell_apart(planned: tuple[str, Path]) -> None:
    kind, out = planned
    found = plan_of(out)["isolability"]
    by_text = {one["text"]: one for one in found["effects"]}
    assert len(by_text) == len(found["effects"]) > 70
    ratio = by_text["gear ratio of joint 4"]
    assert ratio["seen"]
    assert 0.05 < ratio["limit_rms_mm"] < 1.0
    assert ratio["unit"] == "ppm"
    hidden = by_text["zero offset of joint 1"]
    assert (hidden["seen"], hidden["told_apart"], hidden["limit_rms_mm"]) == (False, False, None)
    for one in found["effects"]:
        assert one["told_apart"] == (one["seen"] and not one["could_be_taken_for"])
        assert all(rival["separation_std"] < found["apart_std"] for rival in one["could_be_taken_for"])
        assert one["add"] is None or not one["told_apart"]
    lost_motion = any("lost motion" in sentence for sentence in found["not_tested"])
    assert lost_motion == (kind == "poses")
    assert ("backlash of joint 3" in by_text) == (kind == "sweeps")
    pairs = [one["pairs_told_apart"] + one["effects_brought_to_light"] for one in found["additions"]]
    assert pairs == sorted(pairs, reverse=True)


def test_the_summary_has_a_table_of_limits_effect_by_joint(tmp_path: Path) -> None:
    done = trueaxis("plan", CAMPAIGN, "--shots", 70, "--out", tmp_path)
    assert done.returncode == 0
    lines = done.stdout.splitlines()
    start = next(k for k, line in enumerate(lines) if "able to tell apart" in line)
    assert lines[start + 2].split() == ["1", "2", "3", "4", "5", "6", "rest"]
    (ratio,) = [line for line in lines if line.startswith("  gear ratio")]
    assert len(ratio.split()) == 2 + 6
    counts = next(line for line in lines if "would be named" in line)
    total, named, confused, hidden = (int(word) for word in counts.replace(",", "").split() if word.isdigit())
    assert total == named + confused + hidden
    assert any(line.startswith("  add ") for line in lines)


def test_the_page_says_the_same_for_a_reader(planned: tuple[str, Path]) -> None:
    _, out = planned
    page = (out / "plan.html").read_text(encoding="utf-8")
    found = plan_of(out)["isolability"]["effects"]
    named = sum(one["told_apart"] for one in found)
    assert f"{named} of {len(found)} effects would be found and named" in page
    assert "SIMULATED: no robot was measured" in page
    assert "Gear ratio" in page


class TestJudged:
    """The campaign's own rows instead of a proposal."""

    def judge(self, campaign: Path, out: Path, *options: object):
        return trueaxis("plan", campaign, "--judge", *(options or ("calibrated",)), "--out", out)

    def test_of_a_measured_campaign_its_own_rows_are_judged(self, tmp_path: Path) -> None:
        done = self.judge(CAMPAIGN, tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
        assert set(contents(tmp_path)) == {"plan.json", "plan.html"}
        document = plan_of(tmp_path)
        assert (document["format"], document["kind"]) == ("trueaxis-plan/1", "own")
        assert document["isolability"]["noise_mm"] == pytest.approx(0.11, abs=0.02)
        assert "effects" in done.stdout

    def test_the_noise_may_be_said(self, tmp_path: Path) -> None:
        options = ("calibrated", "--sigma-mm", 0.03, "--repeatability-mm", 0.04)
        assert self.judge(CAMPAIGN, tmp_path, *options).returncode == 0
        assert plan_of(tmp_path)["isolability"]["noise_mm"] == pytest.approx(0.05)

    def test_points_need_not_be_measured_where_targets_are_known_roughly(self, tmp_path: Path) -> None:
        campaign = copy_of_sample(tmp_path)
        edit_rows(campaign, lambda rows: [row | {"x_mm": "", "y_mm": "", "z_mm": ""} for row in rows])
        refused = self.judge(campaign, tmp_path / "out")
        assert_refused(refused, "target 'T2' has no place on its link")
        text = (campaign / "campaign.toml").read_text(encoding="utf-8")
        placed = re.sub(r"(link = [234]\n)", r"\1xyz_mm = [150.0, 40.0, 20.0]\n", text)
        (campaign / "campaign.toml").write_text(placed, encoding="utf-8")
        done = self.judge(campaign, tmp_path / "out", "drawn")
        assert (done.returncode, done.stderr) == (0, "")
        assert sum(one["seen"] for one in plan_of(tmp_path / "out")["isolability"]["effects"]) > 70

    def test_what_has_no_rows_is_refused(self, tmp_path: Path) -> None:
        robot = CAMPAIGN / "robot.toml"
        assert_refused(self.judge(robot, tmp_path / "out"), "--judge", "campaign folder")
        assert_refused(trueaxis("plan", "--judge", "drawn", "--out", tmp_path / "out"), "--judge", "campaign folder")


def test_commands_are_within_the_limits_of_the_robot(planned: tuple[str, Path]) -> None:
    _, out = planned
    limits = np.rad2deg([joint.limits for joint in read_robot(CAMPAIGN / "robot.toml").joints])
    commands = np.array([[float(row[f"q{j}_deg"]) for j in range(1, 7)] for row in rows_of(out / "plan.csv")])
    assert (commands >= limits[:, 0] - 1e-9).all()
    assert (commands <= limits[:, 1] + 1e-9).all()


def test_it_is_a_measurements_file_that_waits_for_points(planned: tuple[str, Path], tmp_path: Path) -> None:
    kind, out = planned
    campaign = copy_of_sample(tmp_path)
    shutil.copy(out / "plan.csv", campaign / "measurements.csv")
    found = read_campaign(campaign)
    assert shot_count(found.measurements) == 80
    assert not found.measurements.seen.any()
    assert set(found.measurements.phase) == ({"sweep", "move"} if kind == "sweeps" else {"pose"})


def test_the_same_seed_writes_the_same_files(planned: tuple[str, Path], tmp_path: Path) -> None:
    kind, out = planned
    for name, seed in (("same", 1), ("other", 2)):
        command = ("plan", CAMPAIGN, "--kind", kind, "--shots", 80, "--seed", seed, "--out", tmp_path / name)
        assert trueaxis(*command).returncode == 0
    assert contents(tmp_path / "same") == contents(out)
    assert contents(tmp_path / "other")["plan.csv"] != contents(out)["plan.csv"]


def test_sweeps_are_told_with_where_the_others_stand(tmp_path: Path) -> None:
    done = trueaxis("plan", CAMPAIGN, "--shots", 70, "--out", tmp_path, "--json")
    assert done.returncode == 0
    document = json.loads(done.stdout)
    assert document == plan_of(tmp_path)
    assert "Written" in done.stderr
    assert [sweep["joint"] for sweep in document["sweeps"]] == [6, 5, 4, 3, 2, 1]
    assert sum(sweep["stops"] * len(sweep["targets"]) for sweep in document["sweeps"]) == 70
    for sweep in document["sweeps"]:
        low, high = sweep["from_to_deg"]
        assert high - low > 20
        assert len(sweep["held_at"]) == 6


def test_with_nothing_given_it_plans_for_the_demo_cell(tmp_path: Path) -> None:
    done = trueaxis("plan", "--kind", "poses", "--shots", 60, "--out", tmp_path)
    assert done.returncode == 0
    document = plan_of(tmp_path)
    assert "Simulated" in document["campaign"]
    assert len(document["noise"]["stations_mm"]) == 2
    assert "through the arm" in done.stdout


def test_a_robot_alone_can_be_planned_for(tmp_path: Path) -> None:
    robot = SAMPLES / "scara_slide" / "robot.toml"
    stations = ("--station", "3000,-2000,500", "--station", "3000,2000,500", "--sigma-arcsec", 5)
    done = trueaxis("plan", robot, "--shots", 60, *stations, "--out", tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    document = plan_of(tmp_path)
    assert document["saving"] is None
    assert [target["link"] for target in document["targets"]]
    assert "as drawn" in document["isolability"]["geometry"]
    assert any("from_to_mm" in sweep for sweep in document["sweeps"])


def test_options_are_heeded(tmp_path: Path) -> None:
    common = ("plan", CAMPAIGN, "--kind", "poses", "--shots", 60, "--out")
    ranges = ("--range", "1:-15:20", "--range", "6:-90:90")
    assert trueaxis(*common, tmp_path / "a", *ranges, "--bar-mm", 300, "--seconds-a-shot", 60).returncode == 0
    q1 = [float(row["q1_deg"]) for row in rows_of(tmp_path / "a" / "plan.csv")]
    assert (min(q1) >= -15, max(q1) <= 20) == (True, True)
    document = plan_of(tmp_path / "a")
    assert document["minutes"] == 60
    assert any(target["name"].startswith("bar") for target in document["targets"])
    worse = ("--repeatability-mm", 2.0, "--sigma-mm", 1.0, "--criterion", "D")
    assert trueaxis(*common, tmp_path / "b", *worse).returncode == 0
    other = plan_of(tmp_path / "b")
    assert other["noise"]["repeatability_mm"] == 2.0
    assert other["noise"]["instrument_sigma_mm"] == 1.0
    assert other["expected"]["mean_position_mm"] > 5 * document["expected"]["mean_position_mm"]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--shots", "0"), "whole number from 1"),
        (("--shots", "many"), "whole number"),
        (("--shots", "1e9"), "whole number"),
        (("--seed", "-1"), "whole number from 0"),
        (("--kind", "circles"), "invalid choice"),
        (("--station", "1,2"), "three numbers"),
        (("--station", "1,2,nan"), "expected a number"),
        (("--sigma-mm", "0"), "above 0"),
        (("--sigma-arcsec", "inf"), "expected a number"),
        (("--repeatability-mm", "-1"), "at least 0"),
        (("--range", "1:2"), "JOINT:LOW:HIGH"),
        (("--bar-mm", "-3"), "above 0"),
    ],
)
def test_options_that_cannot_be_are_refused(options: tuple[str, str], words: str, tmp_path: Path) -> None:
    done = trueaxis("plan", CAMPAIGN, *options, "--out", tmp_path / "out")
    assert done.returncode == 2
    assert words in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_what_cannot_be_planned_for_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"

    def plan(*words: object):
        return trueaxis("plan", *words, "--out", out)

    assert_refused(plan(tmp_path / "nowhere"), "nowhere", "campaign folder")
    assert_refused(plan(CAMPAIGN, "--shots", 20), "20 shots are too few", "at least 66")
    assert_refused(plan(CAMPAIGN, "--shots", 20, "--kind", "poses"), "20 free poses", "at least")
    assert_refused(plan(CAMPAIGN, "--sigma-arcsec", 5), "0 stations", "two --station")
    two = ("--station", "0,0,0", "--station", "0,6000,0")
    assert_refused(plan(CAMPAIGN, *two, "--sigma-arcsec", 5, "--sigma-mm", 1), "no --sigma-mm")
    assert_refused(plan(CAMPAIGN, "--station", "90000,0,0"), "joint 6 cannot be seen moving")
    assert_refused(plan(CAMPAIGN, "--range", "9:0:1"), "joint 9", "1..6")
    assert_refused(plan(CAMPAIGN, "--range", "2:-80:0"), "joint 2", "-80", "-50 to 50 deg")
    assert_refused(plan(CAMPAIGN, "--bar-mm", 90000), "90000 mm")
    broken = copy_of_sample(tmp_path)
    edit_cell(broken, 5, "x_mm", "wide")
    assert_refused(plan(broken), "row 7", "x_mm", "wide")
    shutil.rmtree(broken)
    lacking = copy_of_sample(tmp_path)
    edit_rows(lacking, lambda rows: [row for row in rows if row["joint"] != "3"])
    assert_refused(plan(lacking), "every joint has to be swept")
    assert not out.exists()


def test_somebody_else_s_files_are_left_as_they_are(tmp_path: Path) -> None:
    (tmp_path / "plan.csv").write_text("mine", encoding="utf-8")
    assert_refused(trueaxis("plan", CAMPAIGN, "--kind", "poses", "--out", tmp_path), "plan.csv", "left as it is")
    assert (tmp_path / "plan.csv").read_text(encoding="utf-8") == "mine"
    (tmp_path / "plan.csv").unlink()
    again = ("plan", CAMPAIGN, "--kind", "poses", "--shots", 40, "--out", tmp_path)
    assert trueaxis(*again).returncode == trueaxis(*again).returncode == 0
