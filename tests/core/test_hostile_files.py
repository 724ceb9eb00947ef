"""Whatever stands in the files of a campaign, reading ends in a Campaign or in one sentence, never otherwise."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import pytest
from campaign_texts import FILES, HEADER, MEASUREMENTS_CSV, ROBOT_TOML, assert_same, write_files
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from core.campaign_files import read_campaign
from core.campaign_writer import write_campaign
from core.errors import InputError
from core.measurements import Campaign
from core.points_file import read_points
from core.robot_files import read_robot

T = TypeVar("T")

hostile = settings(
    deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture], print_blob=False
)

_CELLS = (
    "|nan|inf|-inf|1e308|-1e308|1e-320|1e999|0x10|1_0|1,5|'|१|−1|½|\u2028|\x1c|\r|\t7|a\tb|-0|+1|1.|.5|sweep|move|pose"
    '||T1|floor|check|9007199254740993|-1|0|1|2|3|4|1e12|#|=1+1|\ud7ff|\U0001f600| |"|""'
)
_VALUES = (
    "|nan|inf|-inf|1e308|1e-308|true|\"x\"|\"\"|'''a\nb'''|[]|[[]]|{}|[1, 2]|-1|0|1979-05-27|07:32:00|[nan, nan, nan]"
    '|[0, 0, 0]|"\\u2028"|{a = 1}|[1, 2, 3]|0xff|[[1, 2]]|"../x"|"\\u0000"|[-inf, inf]|[1e300, 1e300, 1e300]|[{}]'
)
NAMES = st.sampled_from(sorted(FILES))
OVERWRITTEN = st.lists(st.tuples(st.integers(0, 10_000), st.integers(0, 255)), min_size=1, max_size=6)
ODD_CELL = (
    st.sampled_from([*_CELLS.split("|"), "9" * 400, "é" * 300])
    | st.text(max_size=8).filter(lambda text: text.isprintable())
    | st.floats().map(repr)
)
ODD_TOML = st.sampled_from([*_VALUES.split("|"), "9" * 400, "9" * 5_000])


def only_a_sentence(folder: Path) -> Campaign | str:
    """The campaign, or the sentence that refuses it."""
    return result_or_sentence(read_campaign, folder)


def result_or_sentence(read: Callable[[Path], T], path: Path) -> T | str:
    """What is read, or the one line that refuses it."""
    try:
        return read(path)
    except InputError as told:
        message = str(told)
    assert message.strip()
    assert len(message.splitlines()) == 1, message
    return message


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_files(tmp_path_factory.mktemp("hostile"))


def read_with(folder: Path, name: str, content: bytes) -> Campaign | str:
    """Read the campaign with one file replaced, then put that file back."""
    path = folder / name
    path.write_bytes(content)
    try:
        return only_a_sentence(folder)
    finally:
        path.write_text(FILES[name], encoding="utf-8")


def test_the_campaign_itself_is_read(folder: Path) -> None:
    assert isinstance(only_a_sentence(folder), Campaign)


@given(
    name=NAMES,
    flips=OVERWRITTEN,
)
@settings(hostile, max_examples=700)
def test_bytes_are_overwritten(folder: Path, name: str, flips: list[tuple[int, int]]) -> None:
    data = bytearray(FILES[name].encode())
    for place, byte in flips:
        data[place % len(data)] = byte
    read_with(folder, name, bytes(data))


@given(name=NAMES, start=st.integers(0, 10_000), length=st.integers(0, 400), again=st.booleans())
@settings(hostile, max_examples=500)
def test_pieces_are_cut_out_or_doubled(folder: Path, name: str, start: int, length: int, again: bool) -> None:
    data = FILES[name].encode()
    start %= len(data)
    piece = data[start : start + length]
    read_with(folder, name, data[:start] + piece * (2 if again else 0) + data[start + length :])


@given(name=NAMES, length=st.integers(0, 3_000))
@settings(hostile, max_examples=200)
def test_files_end_early(folder: Path, name: str, length: int) -> None:
    read_with(folder, name, FILES[name].encode()[:length])


@given(
    cells=st.lists(st.tuples(st.integers(0, 10), st.integers(0, 40), ODD_CELL), min_size=1, max_size=3),
)
@settings(hostile, max_examples=900)
@example(cells=[(1, 0, "9" * 131_000 + "x")])
def test_cells_are_replaced(folder: Path, cells: list[tuple[int, int, str]]) -> None:
    rows = [line.split(",") for line in MEASUREMENTS_CSV.splitlines()]
    for row, column, cell in cells:
        rows[row][column % len(rows[row])] = cell
    result = read_with(folder, "measurements.csv", "\n".join(map(",".join, rows)).encode())
    if isinstance(result, Campaign):
        write_campaign(folder / "again", result, ROBOT_TOML)
        assert_same(read_campaign(folder / "again"), result)


@given(first=st.integers(0, 40), second=st.integers(0, 40), rename=st.booleans())
@settings(hostile, max_examples=300)
def test_columns_change_places(folder: Path, first: int, second: int, rename: bool) -> None:
    """With their cells the table stays as it is; without them, whatever follows is a campaign or a sentence."""
    rows = [line.split(",") for line in MEASUREMENTS_CSV.splitlines()]
    first, second = first % len(rows[0]), second % len(rows[0])
    for row in rows[:1] if rename else rows:
        row[first], row[second] = row[second], row[first]
    result = read_with(folder, "measurements.csv", "\n".join(map(",".join, rows)).encode())
    if not rename:
        assert isinstance(result, Campaign)


@given(name=st.sampled_from(["campaign.toml", "robot.toml"]), which=st.integers(0, 100), value=ODD_TOML)
@settings(hostile, max_examples=600)
def test_values_are_replaced(folder: Path, name: str, which: int, value: str) -> None:
    lines = FILES[name].splitlines()
    places = [k for k, line in enumerate(lines) if " = " in line]
    place = places[which % len(places)]
    lines[place] = lines[place].partition(" = ")[0] + " = " + value
    read_with(folder, name, "\n".join(lines).encode())


@given(name=st.sampled_from(["campaign.toml", "robot.toml"]), which=st.integers(0, 100), other=st.integers(0, 100))
@settings(hostile, max_examples=300)
def test_lines_change_places(folder: Path, name: str, which: int, other: int) -> None:
    lines = FILES[name].splitlines()
    which, other = which % len(lines), other % len(lines)
    lines[which], lines[other] = lines[other], lines[which]
    read_with(folder, name, "\n".join(lines).encode())


@given(data=st.binary(max_size=300))
@settings(hostile, max_examples=200)
def test_anything_at_all(folder: Path, data: bytes) -> None:
    for name in FILES:
        assert isinstance(read_with(folder, name, data), str)


@given(cells=st.lists(st.lists(ODD_CELL, min_size=6, max_size=6), min_size=1, max_size=4))
@settings(hostile, max_examples=300)
def test_points_files_of_anything(folder: Path, cells: list[list[str]]) -> None:
    path = folder / "points.csv"
    rows = ["x_mm,y_mm,z_mm,target,q_deg,sigma_mm", "1,2,3,A,0,0.1", *map(",".join, cells)]
    path.write_bytes("\n".join(rows).encode())
    sweep = result_or_sentence(read_points, path)
    assert isinstance(sweep, str) or len(sweep.point_m) == len(sweep.stop) == len(sweep.target) > 0


URDF = (
    '<robot name="a"><link name="b"/><link name="t"/><joint name="j" type="revolute"><parent link="b"/>'
    '<child link="t"/><origin xyz="1 2 3" rpy="0 1 0"/><axis xyz="0 1 1"/><limit lower="-1" upper="1"/></joint></robot>'
)


@given(
    flips=st.lists(st.tuples(st.integers(0, 500), st.integers(32, 126)), max_size=4),
    start=st.integers(0, 500),
    length=st.integers(0, 30),
)
@settings(hostile, max_examples=400)
def test_urdf_files_are_damaged(folder: Path, flips: list[tuple[int, int]], start: int, length: int) -> None:
    data = bytearray(URDF.encode())
    for place, byte in flips:
        data[place % len(data)] = byte
    del data[start : start + length]
    (folder / "arm.urdf").write_bytes(data)
    path = folder / "other.toml"
    path.write_text(ROBOT_TOML.split("[[")[0] + 'urdf = "arm.urdf"\nbase_link = "b"\ntip_link = "t"\n')
    robot = result_or_sentence(read_robot, path)
    assert isinstance(robot, str) or robot.joint_count == 1


@pytest.mark.parametrize(
    "text",
    [
        HEADER.replace(",", ",\n", 1) + "\n",
        "a" * 200_000,
        '"' + "a,b\n" * 1_000,
        "," * 2_000_000,
        "record\n" + "\n" * 100_000,
        ",".join(f"q{k}_deg" for k in range(900)) + "\n" + "1," * 899 + "1\n",
        "record," + "9" * 5_000 + "\n1,2\n",
    ],
)
def test_strange_tables(folder: Path, text: str) -> None:
    assert isinstance(read_with(folder, "measurements.csv", text.encode()), str)


def test_a_folder_in_place_of_a_file_and_a_link_out_of_the_folder(tmp_path: Path) -> None:
    outside = tmp_path / "outside.toml"
    outside.write_text(ROBOT_TOML)
    inner = tmp_path / "campaign"
    inner.mkdir()
    write_files(inner)
    (inner / "robot.toml").unlink()
    (inner / "robot.toml").symlink_to(outside)
    assert "leads out of the folder" in str(only_a_sentence(inner))
    (inner / "robot.toml").unlink()
    (inner / "robot.toml").symlink_to(inner / "robot.toml")
    assert "cannot be read" in str(only_a_sentence(inner))
