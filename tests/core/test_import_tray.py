"""Files that come one by one: put together when they are complete, and told in one sentence when they are not."""

from pathlib import Path

import pytest

from core.errors import InputError
from core.import_tray import Tray, plain_name
from core.session import Session
from core.session_archive import archive_events, campaign_archive
from core.session_campaign import to_campaign

SAMPLE = Path(__file__).parent.parent.parent / "sample_data" / "irb_l6"
URDF = b"""<robot name="two"><link name="a"/><link name="b"/><link name="c"/><link name="finger"/>
<joint name="j1" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint>
<joint name="g" type="fixed"><parent link="b"/><child link="finger"/></joint>
<joint name="j2" type="revolute"><parent link="b"/><child link="c"/><origin xyz="0.5 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>"""
TOML_OF_URDF = b"""format = "trueaxis-robot/1"
urdf = "urdf/two.urdf"
base_link = "a"
tip_link = "c"
"""


def tray(**files: bytes) -> Tray:
    made = Tray()
    for name, data in files.items():
        made = made.added(name.replace("__", "."), data)
    return made


def test_a_robot_toml_alone_is_a_robot() -> None:
    one = tray(robot__toml=(SAMPLE / "robot.toml").read_bytes())
    assert one.missing() == ""
    assert one.campaign is None
    assert one.robot().name == "ASEA IRB L6"


def test_a_urdf_that_is_named_is_asked_for_and_found_by_its_last_name() -> None:
    one = tray(robot__toml=TOML_OF_URDF)
    assert "names the URDF file 'urdf/two.urdf', which is missing" in one.missing()
    with pytest.raises(InputError, match="which is missing, expected it among the files"):
        one.robot()
    both = one.added("two.urdf", URDF)
    assert both.missing() == ""
    assert both.robot().joint_count == 2


def test_a_lone_urdf_becomes_a_robot_once_its_ends_are_chosen() -> None:
    one = tray(two__urdf=URDF)
    starts, ends = one.urdf_ends
    assert starts[0] == "a"
    assert ends[0] == "c"
    assert set(ends) == {"c", "finger", "b"}
    assert one.robot("a", "c").joint_count == 2
    with pytest.raises(InputError, match="expected two of its links"):
        one.robot()
    with pytest.raises(InputError, match="no chain of joints leads from"):
        one.robot("c", "a")


def test_a_campaign_is_complete_with_its_three_files_in_any_order() -> None:
    one = tray(measurements__csv=(SAMPLE / "measurements.csv").read_bytes())
    assert "a robot is missing" in one.missing()
    one = one.added("robot.toml", (SAMPLE / "robot.toml").read_bytes())
    assert one.missing() == ""
    with pytest.raises(InputError, match=r"campaign\.toml is missing"):
        one.campaign_events()
    one = one.added("campaign.toml", (SAMPLE / "campaign.toml").read_bytes())
    assert one.missing() == ""
    assert len([event for event in one.campaign_events() if type(event).__name__ == "ShotTaken"]) > 100
    without = tray(
        campaign__toml=(SAMPLE / "campaign.toml").read_bytes(), robot__toml=(SAMPLE / "robot.toml").read_bytes()
    )
    assert without.missing() == "campaign.toml needs measurements.csv, which is missing"


def test_a_mistake_in_a_campaign_is_told_without_places_of_this_machine() -> None:
    data = (SAMPLE / "measurements.csv").read_bytes().replace(b"1,sweep,6", b"1,sweeep,6", 1)
    files = {name: (SAMPLE / name).read_bytes() for name in ("campaign.toml", "robot.toml")}
    one = tray(measurements__csv=data).added("campaign.toml", files["campaign.toml"])
    with pytest.raises(InputError, match=r"^measurements\.csv, row 2, column phase: 'sweeep'"):
        one.added("robot.toml", files["robot.toml"]).campaign_events()


@pytest.mark.parametrize(
    ("name", "data", "sentence"),
    [
        ("robot.toml", b"", r"robot\.toml is empty"),
        ("robot.toml", b"format = 3", r"robot\.toml: format = 3, expected"),
        ("robot.toml", b'format = "trueaxis-robot/9"', 'expected "trueaxis-robot/1"'),
        ("robot.toml", b"\xff\xfe", "is not UTF-8 text"),
        ("robot.toml", b"a\0b", "NUL byte"),
        ("robot.toml", b"a." * 5000 + b"b = 1", "more than 32 dotted parts"),
        ("robot.toml", b"[" * 100_000, "not valid TOML|nested too deep"),
        ("robot.toml", b"x" * 2_000_000, r"2\.0 MB, expected at most 1 MB"),
        ("robot.exe", b"MZ", r"of no use here, expected one of \.toml"),
        ("robot", b"MZ", "of no use here"),
        ("..", b"x", "expected a plain name"),
        ("", b"x", "expected a plain name"),
        ("a\nb.toml", b"x", "expected a plain name"),
    ],
)
def test_a_file_that_cannot_be_used_gets_one_sentence(name: str, data: bytes, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as refused:
        Tray().added(name, data)
    assert "\n" not in str(refused.value)
    assert len(str(refused.value)) < 300


def test_names_lose_their_paths() -> None:
    for name in ("../../etc/robot.toml", "C:\\temp\\robot.toml", "/robot.toml", "robot.toml"):
        assert plain_name(name) == "robot.toml"


def test_a_robot_that_names_files_elsewhere_gets_none() -> None:
    hostile = TOML_OF_URDF.replace(b"urdf/two.urdf", b"../../../../etc/passwd")
    one = tray(robot__toml=hostile).added("passwd.urdf", URDF)
    assert "which is missing" in one.missing()
    with pytest.raises(InputError):
        tray(robot__toml=TOML_OF_URDF.replace(b"urdf/two.urdf", b"/abs/two.urdf")).added("two.urdf", URDF).robot()


def test_a_tray_holds_so_many_files_and_replaces_those_of_one_name() -> None:
    one = Tray()
    for k in range(10):
        one = one.added(f"{k}.csv", b"x_mm,y_mm,z_mm\n")
    with pytest.raises(InputError, match="one file too many, expected at most 10"):
        one.added("more.csv", b"x")
    assert one.added("3.csv", b"other").names[-1] == "3.csv"


def test_hostile_urdf_files_are_refused() -> None:
    for data in (b"<robot", b"<!DOCTYPE x><robot/>", b"<robot name='r'><link name='a'/></robot>", b"<car/>"):
        with pytest.raises(InputError):
            _ = tray(r__urdf=data).urdf_ends


def test_a_session_goes_out_as_an_archive_and_comes_back(tmp_path: Path) -> None:
    files = Tray()
    for name in ("campaign.toml", "robot.toml", "measurements.csv"):
        files = files.added(name, (SAMPLE / name).read_bytes())
    with Session.create(tmp_path / "a.trueaxis", files.campaign_events()) as session:
        data = campaign_archive(session.state, "irb_l6")
        assert data == campaign_archive(session.state, "irb_l6")
        with Session.create(tmp_path / "b.trueaxis", archive_events(data, "irb_l6.zip")) as again:
            one, two = (to_campaign(s.state).measurements for s in (session, again))
            assert (one.point_m == two.point_m).all() or abs(one.point_m - two.point_m).max() < 1e-12
            assert (one.record == two.record).all()
