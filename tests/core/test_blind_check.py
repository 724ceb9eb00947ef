"""Campaigns diagnosed in processes of their own: in order, each for itself, whatever happens to one of them."""

import os
from pathlib import Path

import pytest

from core.errors import InputError
from core.gap.blind_check import ENDED, campaign_folders, diagnose_all, said_in_short, said_of
from core.gap.result import Verdict
from tests.core import gap_reports
from tests.core.blind_stubs import say_name, say_or_die


def folders(parent: Path, *names: str) -> tuple[Path, ...]:
    for name in names:
        (parent / name).mkdir(parents=True)
    return tuple(parent / name for name in names)


def test_subfolders_are_found_by_name_without_hidden_ones_files_and_the_results(tmp_path: Path) -> None:
    folders(tmp_path, "b", "a", ".cache", "out")
    (tmp_path / "answers.json").write_text("{}")
    assert [path.name for path in campaign_folders(tmp_path, tmp_path / "out")] == ["a", "b"]
    assert [path.name for path in campaign_folders(tmp_path)] == ["a", "b", "out"]


def test_no_folder_and_no_campaigns_are_refused_in_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nowhere: No such file or directory, expected a folder with campaigns"):
        campaign_folders(tmp_path / "nowhere")
    with pytest.raises(InputError, match="has no subfolder"):
        campaign_folders(tmp_path)


def test_every_campaign_is_said_in_the_order_given_and_progress_ends_at_one(tmp_path: Path) -> None:
    asked = folders(tmp_path, "c", "a", "b")
    seen: list[tuple[float, str]] = []
    said = diagnose_all(asked, 2, lambda done, text: seen.append((done, text)), say_name)
    assert [one.name for one in said] == ["c", "a", "b"]
    assert [done for done, _ in seen] == [pytest.approx(k / 3) for k in (1, 2, 3)]
    assert {text for _, text in seen} == {"a", "b", "c"}


def test_processes_are_others_and_do_not_fight_for_processors(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    (said,) = diagnose_all(folders(tmp_path, "a"), 1, say=say_name)
    assert said.warnings[0] != str(os.getpid())
    assert said.warnings[1] == "1"
    assert "OMP_NUM_THREADS" not in os.environ


def test_a_process_that_dies_takes_no_other_campaign_with_it(tmp_path: Path) -> None:
    asked = folders(tmp_path, "a", "dies", "z")
    said = diagnose_all(asked, 2, say=say_or_die)
    assert [one.name for one in said] == ["a", "dies", "z"]
    assert [one.verdict for one in said] == [Verdict.NO_GAP, None, Verdict.NO_GAP]
    assert said[1].failure == ENDED


def test_a_campaign_that_cannot_be_read_becomes_a_sentence(tmp_path: Path) -> None:
    (folder,) = folders(tmp_path, "empty")
    said = said_of(folder)
    assert said.verdict is None
    assert "campaign.toml is missing" in said.failure
    assert "\n" not in said.failure


def test_what_is_said_holds_no_arrays() -> None:
    report = gap_reports.explained()
    said = said_in_short("a", report)
    assert [cause.place for cause in said.causes] == [cause.place for cause in report.causes]
    assert said.causes[0].places == report.causes[0].twins
    assert (said.gap_rms_m, said.points) == (report.gap_rms_m, len(report.rows))
