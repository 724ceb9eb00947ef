"""The diagnosis on the workbench, and what the dashboard says of it, with diagnoses made by hand."""

import sys
from types import ModuleType

import pytest

from app.gap_bench import LEAST_POINTS, Diagnosed, GapBench
from app.gap_words import causes_words, next_words, numbers_words, verdict_words, working_words
from app.workbench import Workbench
from core.errors import InputError
from core.session import Session
from core.session_campaign import open_campaign
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events
from tests.app.command_line import SAMPLES
from tests.core import gap_reports
from tests.core.test_campaign_archive import packed, sample

HOSTILE = "<script>window.broken=1</script><img src=x>"
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
    return calls


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
    gaps, told, changed = GapBench(bench), [], []
    bench.on_change(lambda: changed.append(gaps.found is not None))
    gaps.diagnose(False, lambda done, text: told.append(done))
    assert changed == [True]
    assert told == [1.0]
    assert asked[0][1] is None
    assert asked[0][0].measurements.count == 165
    assert "nominal" in gaps.found.of
    assert not gaps.outdated
    bench.decisions.exclude(bench.state.shots[3].id, "bumped")
    assert gaps.outdated


def test_the_last_solution_may_be_the_sim(bench, asked):
    gaps = GapBench(bench)
    with pytest.raises(InputError, match="solve first"):
        gaps.diagnose(True)
    bench.solving.solve()
    gaps.diagnose(True)
    assert asked[0][1] is gaps.arm
    assert gaps.arm.robot.joint_count == 6


def test_an_uploaded_campaign_is_its_own_matter(bench, asked):
    gaps = GapBench(bench)
    gaps.diagnose_archive(packed(sample()), "mine.zip")
    assert gaps.found.of == "mine.zip"
    assert gaps.found.shots is None
    bench.decisions.exclude(bench.state.shots[3].id, "bumped")
    assert not gaps.outdated
    with pytest.raises(InputError, match=r"odd\.zip cannot be unpacked"):
        gaps.diagnose_archive(b"no archive", "odd.zip")


def test_another_session_has_no_diagnosis_yet(bench, asked, tmp_path):
    gaps = GapBench(bench)
    gaps.diagnose(False)
    bench.switch(open_campaign(SAMPLES / "irb_l6", tmp_path / f"b{SUFFIX}"))
    assert gaps.found is None
    bench.session.close()


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
