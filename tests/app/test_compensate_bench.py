"""Compensating on the workbench: pasted poses become commands, as on the command line; mistakes are named by row."""

import csv

import numpy as np
import pytest

from app.compensate_bench import CHUNK, MOST_POSES, CompensateBench
from app.compensate_words import MOST_ROWS, summary_words, table_words
from app.pose_bench import PoseBench
from app.workbench import Workbench
from core.compensation import compensate
from core.errors import InputError
from core.kinematics import forward, nominal_net
from core.pose_files import wanted_csv
from core.session import Session
from core.session_store import SUFFIX
from core.twin import irb_l6
from core.twin.demo import demo_events


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    cell = irb_l6.cell()
    path = tmp_path_factory.mktemp("solved") / f"a{SUFFIX}"
    one = Workbench(Session.create(path, demo_events(cell), by="A. Operator"), cell)
    one.runs.run(True)
    one.solving.solve()
    yield one
    one.session.close()


@pytest.fixture
def ready(bench):
    return CompensateBench(PoseBench(bench))


def table_of(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(text.splitlines()))


def random_poses(ready: CompensateBench, count: int) -> tuple[str, np.ndarray]:
    arm = ready._arm()
    q = np.random.default_rng(1).uniform(-0.3, 0.3, (count, 6))
    poses = forward(arm.nominal, nominal_net(arm.nominal, q))
    return wanted_csv(tuple(f"p{k}" for k in range(count)), arm.nominal, poses, q), q


def test_the_test_poses_are_an_example_and_come_out_as_on_the_command_line(ready, bench):
    text = ready.test_poses_csv()
    rows = table_of(text)
    wanted = np.array(bench.state.poses.wanted)
    q = np.array([[float(row[f"q{i + 1}_deg"]) for i in range(6)] for row in rows])
    np.testing.assert_allclose(np.deg2rad(q), wanted, atol=1e-11)
    ready.compensate(text.encode(), "the pasted table")
    arm = ready._arm()
    found = compensate(arm, forward(arm.nominal, nominal_net(arm.nominal, wanted)), wanted)
    np.testing.assert_allclose(ready.last.found.commanded, found.commanded, rtol=0, atol=1e-9)
    said = table_of(ready.last.csv)
    assert [row["status"] for row in said] == ["ok"] * 12
    assert float(said[3]["q2_deg"]) == pytest.approx(np.rad2deg(found.commanded[3, 1]), abs=1e-7)


def test_many_poses_go_in_parts_and_come_out_as_one(ready):
    text, q = random_poses(ready, CHUNK + 300)
    told = []
    ready.compensate(text.encode(), "many.csv", progress=lambda share, words: told.append((share, words)))
    assert [words for _, words in told] == [f"0 of {CHUNK + 300} poses", f"{CHUNK} of {CHUNK + 300} poses"]
    last = ready.last
    assert len(last.found.status) == len(last.effect.nominal.position_m) == CHUNK + 300
    assert last.found.ok.all()
    arm = ready._arm()
    there = forward(arm.robot, arm.drives.net(last.found.commanded))
    wanted = forward(arm.nominal, nominal_net(arm.nominal, q))
    np.testing.assert_allclose(there, wanted, rtol=0, atol=1e-8)


def test_mistakes_are_named_and_what_was_there_stays(ready):
    good, _ = random_poses(ready, 2)
    ready.compensate(good.encode(), "good.csv")
    before = ready.last
    for text, words in (
        ("", "the pasted table is empty"),
        ("x_mm,y_mm,z_mm\n1,2,3\n", "no orientation, expected columns qw"),
        ("x,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,1,0,0,0\n", "column x has no unit"),
        ("x_mm,y_mm,z_mm,qw,qx,qy,qz\n1,2,3,1,1,0,0\n", "row 2.*length 1.41421, expected 1"),
        ("x_mm,y_mm,z_mm,qw,qx,qy,qz\n" + "1,2,3,1,0,0,0\n" * (MOST_POSES + 1), "expected at most 20000 here"),
    ):
        with pytest.raises(InputError, match=words):
            ready.compensate(text.encode(), "the pasted table")
    assert ready.last is before


def test_a_pose_out_of_reach_is_named_in_its_row(ready):
    text, _ = random_poses(ready, 3)
    rows = text.splitlines()
    cells = rows[2].split(",")
    cells[1] = "9999"
    rows[2] = ",".join(cells)
    ready.compensate("\n".join(rows).encode(), "poses.csv")
    assert ready.last.found.ok.tolist() == [True, False, True]
    words = table_words(ready.last)
    assert "unreachable: far out of reach" in words
    assert "2 of 3 poses" in summary_words(ready.last, False)


def test_names_are_shown_as_they_are_and_long_tables_are_cut(ready):
    text, _ = random_poses(ready, MOST_ROWS + 50)
    text = text.replace("p0,", "<script>x</script>,", 1)
    ready.compensate(text.encode(), "poses.csv")
    words = table_words(ready.last)
    assert "<script>" not in words
    assert "&lt;script&gt;" in words
    assert "and 50 more poses" in words
    assert words.count("<tr>") == 2 * (MOST_ROWS + 1)


def test_commands_of_an_earlier_solution_are_marked(ready, bench):
    text, _ = random_poses(ready, 2)
    ready.compensate(text.encode(), "poses.csv")
    assert not ready.outdated
    bench.decisions.exclude(bench.state.shots[7].id, "target was bumped")
    bench.solving.solve()
    assert ready.outdated
    assert "earlier solution" in summary_words(ready.last, ready.outdated)


def test_without_a_solution_it_says_what_to_do(tmp_path):
    cell = irb_l6.cell()
    one = Workbench(Session.create(tmp_path / f"b{SUFFIX}", demo_events(cell)), cell)
    try:
        with pytest.raises(InputError, match="solve first"):
            CompensateBench(PoseBench(one)).compensate(b"x_mm\n1\n", "a")
    finally:
        one.session.close()
