"""``trueaxis gap`` and ``blind-check``: what they write and print, with diagnoses made by hand."""

import json
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from app.__main__ import main
from app.commands import blind_check
from core.gap import blind_answers
from core.gap.blind_check import Said, SaidCause
from core.gap.result import GapReport, Place, Verdict
from tests.app.command_line import SAMPLES, contents, trueaxis
from tests.core import gap_reports

CAMPAIGN = SAMPLES / "irb_l6"
BACKLASH = Place("backlash", joint=3)


@pytest.fixture
def diagnosed(monkeypatch: pytest.MonkeyPatch) -> Callable[[GapReport], list]:
    """Let ``diagnose`` return what was made by hand; the calls are kept."""
    calls: list = []

    def let(report: GapReport) -> list:
        module = ModuleType("core.gap.diagnosis")

        def diagnose(campaign, arm=None, told=None, progress=None):
            calls.append((campaign, arm, told))
            progress(0.5, "looking")
            return replace(report, campaign=campaign, rows=report.rows)

        module.diagnose = diagnose
        monkeypatch.setitem(sys.modules, "core.gap.diagnosis", module)
        return calls

    return let


def test_gap_writes_the_contract_and_a_report(diagnosed, tmp_path: Path, capsys) -> None:
    calls = diagnosed(gap_reports.explained())
    out = tmp_path / "deep" / "out"
    assert main(["gap", str(CAMPAIGN), "--out", str(out)]) == 0
    assert set(contents(out)) == {"gap.json", "corrected_points.csv", "report.html"}
    document = json.loads((out / "gap.json").read_text(encoding="utf-8"))
    assert (document["format"], document["verdict"]) == ("trueaxis-gap/1", "explained")
    assert (calls[0][1], calls[0][2]) == (None, None)
    said = capsys.readouterr()
    assert said.err == ""
    assert "0.900 mm -> 0.230 mm (floor 0.225 mm)" in said.out
    assert "cause 1  compliance of joint 2 or flexure of link 1: probability 93 %" in said.out
    assert "gap 0.0688 ± 0.0029 deg" in said.out
    assert "repeat the sweep of joint 2" in said.out
    assert "lost motion cannot be tested" in said.out
    assert str(out / "gap.json") in said.out


def test_gap_prints_the_json_alone_when_asked(diagnosed, tmp_path: Path, capfdbinary) -> None:
    diagnosed(gap_reports.no_gap())
    assert main(["gap", str(CAMPAIGN), "--out", str(tmp_path / "out"), "--json"]) == 0
    said = capfdbinary.readouterr()
    assert json.loads(said.out)["verdict"] == "no_gap"
    assert said.out == (tmp_path / "out" / "gap.json").read_bytes()
    assert "No gap beyond the noise" in said.err.decode()


def test_a_calibration_is_the_sim_when_it_is_given(diagnosed, tmp_path: Path, capsys) -> None:
    calls = diagnosed(gap_reports.no_gap())
    assert main(["calibrate", str(CAMPAIGN), "--out", str(tmp_path / "c")]) == 0
    calibration = tmp_path / "c" / "calibration.json"
    assert main(["gap", str(CAMPAIGN), "--calibration", str(calibration), "--out", str(tmp_path / "o")]) == 0
    assert calls[0][1].robot.joint_count == 6


def test_gap_refuses_what_it_cannot_use(diagnosed, tmp_path: Path, capsys) -> None:
    diagnosed(gap_reports.no_gap())
    out = tmp_path / "out"
    assert main(["gap", str(tmp_path / "nowhere"), "--out", str(out)]) == 2
    assert main(["gap", str(CAMPAIGN), "--calibration", str(tmp_path / "none.json"), "--out", str(out)]) == 2
    (tmp_path / "file").write_text("")
    assert main(["gap", str(CAMPAIGN), "--out", str(tmp_path / "file" / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert [line.startswith("trueaxis: ") for line in said.err.splitlines()] == [True] * 3
    assert not out.exists()


SPOKEN = (
    Said("a", Verdict.EXPLAINED, (SaidCause(BACKLASH, 0.9, (BACKLASH,)),), 1e-3, 1e-4, 1e-4),
    Said("b", Verdict.NO_GAP, (), 1e-4, 1e-4, 1e-4),
    Said("c", None, failure="c/campaign.toml is missing"),
)
ANSWERS = {
    "a": {"effects": [{"effect": "backlash", "joint": 3}]},
    "b": {"effects": []},
    "c": {"effects": [{"effect": "scale"}]},
}


@pytest.fixture
def suite(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with campaigns of which somebody else said what there is to say."""
    folder = tmp_path / "suite"
    for name in "abc":
        (folder / name).mkdir(parents=True)
    (folder / "answers.json").write_text(json.dumps(ANSWERS), encoding="utf-8")
    monkeypatch.setattr(blind_check, "diagnose_all", lambda folders, processes, progress: SPOKEN)
    return folder


def test_blind_check_writes_what_was_said_the_score_and_a_confusion_table(suite: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    assert main(["blind-check", str(suite), "--out", str(out)]) == 0
    assert set(contents(out)) == {"blind.json", "confusion.csv", "campaigns.csv", "report.html"}
    document = json.loads((out / "blind.json").read_text(encoding="utf-8"))
    assert list(document["said"]) == ["a", "b", "c"]
    assert document["said"]["c"]["failure"] == "c/campaign.toml is missing"
    score = document["score"]
    assert score["top_1"]["one_effect"]["exact"] == {"share": 0.5, "count": 1, "of": 2}
    assert score["false_alarms_on_empty"] == {"share": 0.0, "count": 0, "of": 1}
    assert score["not_diagnosed"] == ["c"]
    said = capsys.readouterr().out
    assert "What was there, and how often it was called" in said
    assert "Not diagnosed: c: c/campaign.toml is missing" in said
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Confusion table" in page


def test_answers_are_opened_after_what_was_said_is_on_the_disk(
    suite: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    order: list[str] = []
    sync, read = os.fsync, blind_answers.read_answers

    def noting_sync(handle: int) -> None:
        order.append(f"sync {Path(os.readlink(f'/proc/self/fd/{handle}')).name}")
        sync(handle)

    def noting_read(path: Path) -> blind_answers.Answers:
        before = json.loads((tmp_path / "out" / "blind.json").read_text(encoding="utf-8"))
        assert before["score"] is None
        assert list(before["said"]) == ["a", "b", "c"]
        order.append("answers")
        return read(path)

    monkeypatch.setattr(os, "fsync", noting_sync)
    monkeypatch.setattr(blind_answers, "read_answers", noting_read)
    assert main(["blind-check", str(suite), "--out", str(tmp_path / "out")]) == 0
    assert order == ["sync blind.json", "sync out", "answers"]


def test_odd_answers_leave_what_was_said(suite: Path, tmp_path: Path, capsys) -> None:
    (suite / "answers.json").write_text('{"a": {"effects": [{"effect": "gremlins"}]}}', encoding="utf-8")
    assert main(["blind-check", str(suite), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.count("\n") == 1
    assert "gremlins" in said.err
    assert "blind.json, without a score" in said.err
    assert set(contents(tmp_path / "out")) == {"blind.json"}


def test_blind_check_refuses_what_it_cannot_use_before_it_begins(suite: Path, tmp_path: Path, capsys) -> None:
    out = str(tmp_path / "out")
    assert main(["blind-check", str(tmp_path / "nowhere"), "--out", out]) == 2
    (suite / "answers.json").unlink()
    assert main(["blind-check", str(suite), "--out", out]) == 2
    assert main(["blind-check", str(suite), "--out", out, "--processes", "7"]) == 2
    said = capsys.readouterr().err
    assert "answers.json is missing, expected the answers to 3 campaigns" in said
    assert not Path(out).exists()


def test_a_page_of_a_blind_check_escapes_names(suite: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    name = "<img src=x onerror=alert(1)>"
    odd = replace(SPOKEN[1], name=name, verdict=None, failure=name)
    monkeypatch.setattr(blind_check, "diagnose_all", lambda *_: (SPOKEN[0], odd))
    (suite / "answers.json").write_text(json.dumps({"a": ANSWERS["a"], name: {"effects": []}}), encoding="utf-8")
    assert main(["blind-check", str(suite), "--out", str(tmp_path / "out")]) == 0
    assert "<img" not in (tmp_path / "out" / "report.html").read_text(encoding="utf-8").split("<main>")[1]


@pytest.mark.slow
def test_both_commands_as_processes_with_the_real_diagnosis(tmp_path: Path) -> None:
    folder, out = tmp_path / "suite", tmp_path / "out"
    shutil.copytree(SAMPLES / "scara_slide", folder / "real")
    (folder / "broken").mkdir()
    (folder / "answers.json").write_text('{"real": {"effects": []}, "broken": {"effects": []}}', encoding="utf-8")
    done = trueaxis("gap", folder / "real", "--out", tmp_path / "gap", timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    document = json.loads((tmp_path / "gap" / "gap.json").read_text(encoding="utf-8"))
    done = trueaxis("blind-check", folder, "--out", out, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    said = json.loads((out / "blind.json").read_text(encoding="utf-8"))["said"]
    assert "campaign.toml is missing" in said["broken"]["failure"]
    assert said["real"]["verdict"] == document["verdict"]
    assert [cause["effect"] for cause in said["real"]["causes"]] == [cause["effect"] for cause in document["causes"]]
