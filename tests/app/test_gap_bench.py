"""The diagnosis on the workbench, and what the dashboard says of it, with diagnoses made by hand."""

import queue
import sys
import time
from types import ModuleType

import pytest

from app.beside import STOPPED
from app.gap_bench import LEAST_POINTS, Diagnosed, GapBench
from app.gap_words import causes_words, next_words, numbers_words, verdict_words, working_words
from app.workbench import Workbench
from core.errors import CampaignError, InputError
from core.gap.result import GapReport
from core.session import Session
from core.session_campaign import open_campaign
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app import in_thread
from tests.app.command_line import SAMPLES
from tests.core import gap_reports
from tests.core.test_campaign_archive import packed, sample

HOSTILE = "<script>window.broken=1</script><img src=x>"
PATIENCE_S = 120
MADE = ("explained", "partly_explained", "unexplained", "no_gap", "barely_known")


@pytest.fixture
def asked(monkeypatch):
    """What the diagnosis was asked for; it answers with three causes."""
    calls = []
    module = ModuleType("core.gap.diagnosis")

    def diagnose(campaign, arm=None, told=None, progress=None):
        calls.append((campaign, arm))
        if progress is not None:
            progress(1.0, "done")
        return gap_reports.explained(campaign)

    module.diagnose = diagnose
    monkeypatch.setitem(sys.modules, "core.gap.diagnosis", module)
    monkeypatch.setattr("app.beside.started", in_thread.started)
    return calls


def ended(begin, *arguments) -> tuple[str, list[float]]:
    """What a diagnosis says at its end, and the shares of the work that it told."""
    told, ends = [], queue.Queue()
    begin(*arguments, lambda done, text: told.append(done), ends.put)
    return ends.get(timeout=PATIENCE_S), told


@pytest.fixture
def bench(tmp_path):
    session = open_campaign(SAMPLES / "irb_l6", tmp_path / f"a{SUFFIX}")
    yield Workbench(session)
    session.close()


def test_a_new_session_has_not_points_enough(tmp_path):
    cell = irb_l6.cell()
    session = Session.create(tmp_path / f"new{SUFFIX}", demo_events(cell))
    bench = Workbench(session, cell)
    gaps = GapBench(bench)
    for taken in range(LEAST_POINTS):
        assert not gaps.enough, taken
        bench.shooting.measure()
    assert gaps.enough
    bench.decisions.exclude(bench.state.shots[0].id, "bumped")
    assert not gaps.enough
    session.close()


def test_the_session_is_diagnosed_and_grows_old_when_it_changes(bench, asked):
    gaps = GapBench(bench)
    assert ended(gaps.diagnose, False) == ("", [1.0])
    assert not gaps.running
    assert asked[0][1] is None
    assert asked[0][0].measurements.count == 165
    assert "nominal" in gaps.found.of
    assert not gaps.outdated
    bench.decisions.exclude(bench.state.shots[3].id, "bumped")
    assert gaps.outdated


def test_the_last_solution_may_be_the_sim(bench, asked):
    gaps = GapBench(bench)
    with pytest.raises(InputError, match="solve first"):
        ended(gaps.diagnose, True)
    bench.solving.solve()
    ended(gaps.diagnose, True)
    assert asked[0][1] is gaps.arm
    assert gaps.arm.robot.joint_count == 6


def test_an_uploaded_campaign_is_its_own_matter(bench, asked):
    gaps = GapBench(bench)
    assert ended(gaps.diagnose_archive, packed(sample()), "mine.zip") == ("", [1.0])
    assert gaps.found.of == "mine.zip"
    assert gaps.found.shots is None
    bench.decisions.exclude(bench.state.shots[3].id, "bumped")
    assert not gaps.outdated
    why_not, _ = ended(gaps.diagnose_archive, b"no archive", "odd.zip")
    assert "odd.zip cannot be unpacked" in why_not
    assert gaps.found.of == "mine.zip"


def test_another_session_has_no_diagnosis_yet(bench, asked, tmp_path):
    gaps = GapBench(bench)
    ended(gaps.diagnose, False)
    bench.switch(open_campaign(SAMPLES / "irb_l6", tmp_path / f"b{SUFFIX}"))
    assert gaps.found is None
    bench.session.close()


@pytest.mark.slow
def test_a_diagnosis_in_its_own_process_holds_up_neither_a_shot_nor_a_solution(bench):
    gaps, told, ends = GapBench(bench), queue.Queue(), queue.Queue()
    begun = time.monotonic()
    gaps.diagnose(False, lambda done, text: told.put((done, text)), ends.put)
    assert time.monotonic() - begun < 1
    with pytest.raises(InputError, match="a diagnosis is being made already"):
        gaps.diagnose(False, print, print)
    told.get(timeout=PATIENCE_S)
    bench.decisions.exclude(bench.state.shots[3].id, "bumped")
    bench.solving.solve()
    assert gaps.running
    assert ends.get(timeout=PATIENCE_S) == ""
    shares = [told.get()[0] for _ in range(told.qsize())]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert type(gaps.found.report) is GapReport
    assert gaps.found.report.campaign.measurements.count == 165
    assert gaps.outdated


def test_a_diagnosis_can_be_stopped(bench):
    gaps, told, ends = GapBench(bench), queue.Queue(), queue.Queue()
    gaps.diagnose(False, lambda done, text: told.put(done), ends.put)
    told.get(timeout=PATIENCE_S)
    gaps.stop()
    assert ends.get(timeout=PATIENCE_S) == STOPPED
    assert gaps.found is None
    assert not gaps.running


def test_why_there_is_no_diagnosis_is_said(bench, asked, monkeypatch):
    def refuse(campaign, arm=None, told=None, progress=None):
        raise CampaignError("the campaign says nothing of its joints")

    monkeypatch.setattr(sys.modules["core.gap.diagnosis"], "diagnose", refuse)
    gaps = GapBench(bench)
    assert ended(gaps.diagnose, False) == ("the campaign says nothing of its joints", [])
    assert gaps.found is None


@pytest.mark.parametrize("name", MADE)
def test_every_diagnosis_is_said(name):
    report = getattr(gap_reports, name)()
    found = Diagnosed(report, "this session", ())
    text = verdict_words(found, False) + numbers_words(report) + causes_words(report) + next_words(report)
    assert "nan" not in text
    assert text.count("<tr>") >= 3 + len(report.causes)
    assert "diagnose again" in verdict_words(found, True)


def test_before_there_is_one_it_is_said_what_to_do():
    assert "Press <b>Diagnose</b>" in verdict_words(None, False)
    assert working_words("") == ""


def test_texts_of_files_are_escaped():
    report = gap_reports.hostile(HOSTILE)
    text = verdict_words(Diagnosed(report, HOSTILE, ()), False)
    text += numbers_words(report) + causes_words(report) + next_words(report) + working_words(HOSTILE)
    assert "<script" not in text
    assert "<img" not in text
