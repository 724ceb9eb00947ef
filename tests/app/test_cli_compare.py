"""``trueaxis compare`` as a process, its figures and its report."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_refused, contents, trueaxis

from app.comparison_report import comparison_html, comparison_page
from app.comparison_summary import comparison_summary
from app.figures.comparison import GROUPS, orientation_comparison_figure, position_comparison_figure
from core.rivals.comparison import Comparison, Data, ErrorSizes, MethodRow, Reference
from core.rivals.observed import Drives

SIZES = ErrorSizes(1e-3, 1.2e-3, 2e-3, 3e-3, 0.1e-3)


@cache
def example() -> Comparison:
    """A table of made-up numbers."""
    rows = (
        MethodRow("nothing", "s0", Data.NONE, Drives.AS_COMMANDED, ErrorSizes(47e-3), ErrorSizes(0.05)),
        MethodRow("ours", "s1", Data.SWEEPS, Drives.FUNCTIONS, SIZES, SIZES, 1e-3, 2e-3, 0.1, 129, True),
        MethodRow("theirs", "s2", Data.POINTS, Drives.AS_COMMANDED, SIZES, SIZES, points=129, failed=2, note="so-so"),
        MethodRow("<b>odd</b>", "s3", Data.POSES, Drives.FUNCTIONS, replace(SIZES, mean=0.5e-3), SIZES, points=129),
    )
    limit = Reference("limit", 0.9e-3, 8e-3, "what is possible", bounds=True)
    return Comparison("A made-up table", 4, 12, rows, (limit,), ("one note",))


def test_compare_writes_its_files_and_prints_the_table(tmp_path: Path) -> None:
    done = trueaxis("compare", "--out", tmp_path / "deep" / "out", "--seeds", 1, timeout=300)
    assert (done.returncode, done.stderr) == (0, "")
    assert set(contents(tmp_path / "deep" / "out")) == {"comparison.json", "report.html"}
    document = json.loads((tmp_path / "deep" / "out" / "comparison.json").read_text(encoding="utf-8"))
    assert (document["trials"], document["poses"]) == (1, 12)
    assert {method["points"] for method in document["methods"]} == {0, 129}
    for method in document["methods"]:
        assert method["name"] in done.stdout
        assert method["failed_trials"] == 0
    means = {(m["name"], m["drives"]): m["position_mm"]["mean"] for m in document["methods"]}
    assert means["no calibration", "as commanded"] == pytest.approx(47, abs=1)
    assert means["linear least squares, positions", "with functions"] < 1
    assert "The sweeps lose to as many points in free poses" in done.stdout
    assert "paper, after" in done.stdout
    assert "simulated" in done.stdout
    report = (tmp_path / "deep" / "out" / "report.html").read_text(encoding="utf-8")
    assert "SIMULATED" in report
    assert report.count('<script type="application/json">') == 2


@pytest.mark.parametrize("seeds", ["0", "-1", "many", "1.5", "1001"])
def test_the_number_of_trials_is_checked(seeds: str, tmp_path: Path) -> None:
    done = trueaxis("compare", "--out", tmp_path / "out", f"--seeds={seeds}")
    assert done.returncode == 2
    assert "expected a whole number from 1 to 1000" in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_is_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("here", encoding="utf-8")
    assert_refused(trueaxis("compare", "--out", tmp_path / "file" / "out", timeout=20), "is a file, expected a folder")


@pytest.mark.parametrize("draw", [position_comparison_figure, orientation_comparison_figure])
def test_figures_show_every_method_once_and_the_smallest_on_top(draw) -> None:
    figure = draw(example())
    assert [trace.name for trace in figure.data] == [name for name, _, _ in GROUPS]
    places = sorted(y for trace in figure.data for y in trace.y)
    assert places == list(range(5))
    by_place = {y: x for trace in figure.data for x, y in zip(trace.x, trace.y, strict=True)}
    assert list(np.diff([by_place[k] for k in places]) >= 0) == [True] * 4
    assert figure.layout.yaxis.range[0] > figure.layout.yaxis.range[1]
    assert "&lt;b&gt;odd&lt;/b&gt;" in figure.layout.yaxis.ticktext


def test_figures_show_what_was_found() -> None:
    figure = position_comparison_figure(example())
    own = figure.data[0]
    assert list(own.x) == [1.0]
    assert list(own.error_x.array) == pytest.approx([1.0])
    assert list(figure.data[-1].x) == pytest.approx([0.9])


def test_the_page_says_what_was_found() -> None:
    page = comparison_page(example())
    assert page.badge.startswith("SIMULATED")
    assert [section.id for section in page.sections] == ["errors", "methods", "how"]
    said = " ".join(page.summary)
    assert "The sweeps lose to as many points in free poses: 1 of 2 methods" in said
    table = page.sections[1].tables[0]
    assert table.groups[0][0][0].text == "ours, drives with functions"
    assert "theirs, drives as commanded: 2" in table.note
    sources = page.sections[1].tables[1]
    assert [row[1].text for row in sources.groups[0]] == ["s0", "s1", "s2", "s3"]
    assert "one note" in page.sections[2].paragraphs


def test_the_page_is_one_file_and_names_are_escaped() -> None:
    html = comparison_html(example())
    assert "<b>odd</b>" not in html.split("<main>")[1]
    assert " src=" not in html.split("<main>")[1]
    for block in html.split('<script type="application/json">')[1:]:
        assert json.loads(block.split("</script>")[0])["data"]


def test_the_summary_has_a_line_for_everything() -> None:
    text = comparison_summary(example(), Path("somewhere"))
    lines = text.splitlines()
    for name in ("nothing", "ours, drives with functions", "theirs, drives as commanded", "limit"):
        assert sum(line.startswith(name) for line in lines) >= 1
    assert "theirs, drives as commanded: 2 of 4 trials failed" in lines
    assert lines[-1] == f"Written: {Path('somewhere') / 'comparison.json'}, {Path('somewhere') / 'report.html'}"
