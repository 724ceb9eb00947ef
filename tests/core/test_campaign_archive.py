"""Campaigns in ZIP files: read as their folders are, and nothing else comes out of them."""

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from core import campaign_archive
from core.campaign_archive import read_campaign_archive
from core.campaign_files import read_campaign
from core.errors import CampaignError, InputError

FOLDER = Path(__file__).parent.parent.parent / "sample_data" / "irb_l6"
FILES = ("campaign.toml", "robot.toml", "measurements.csv")


def packed(files: dict[str, bytes]) -> bytes:
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return data.getvalue()


def sample(root: str = "") -> dict[str, bytes]:
    return {f"{root}{name}": (FOLDER / name).read_bytes() for name in FILES}


@pytest.mark.parametrize("root", ["", "irb_l6/", "a/b/"])
def test_an_archive_is_read_like_its_folder(root: str) -> None:
    found = read_campaign_archive(packed({**sample(root), f"{root}notes.pdf": b"x"}), "irb_l6.zip")
    expected = read_campaign(FOLDER)
    assert found.digest == expected.digest
    np.testing.assert_array_equal(found.measurements.point_m, expected.measurements.point_m)


def test_what_is_wrong_in_it_is_told_with_its_name_and_without_places_of_this_machine(tmp_path: Path) -> None:
    files = sample()
    files["measurements.csv"] = files["measurements.csv"].replace(b"sweep", b"sweeep", 1)
    with pytest.raises(InputError) as refused:
        read_campaign_archive(packed(files), "mine.zip")
    assert str(refused.value).startswith("mine.zip: measurements.csv")
    assert "tmp" not in str(refused.value)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "cannot be unpacked"),
        (b"PK\x03\x04 but then nothing", "cannot be unpacked"),
        (packed({}), "holds 0 files campaign.toml"),
        (packed({**sample("a/"), **sample("b/")}), "holds 2 files campaign.toml"),
        (packed({**sample("a/"), "a/../../evil.toml": b""}), "expected one within its folder"),
        (packed({**sample(), "..\\evil.csv": b""}), "expected one within its folder"),
        (packed({f"{k}.csv": b"" for k in range(2001)}), "expected at most 2000"),
    ],
)
def test_odd_archives_are_refused_in_one_sentence(data: bytes, words: str) -> None:
    with pytest.raises(CampaignError, match=words) as refused:
        read_campaign_archive(data, "odd.zip")
    assert str(refused.value).startswith("odd.zip")


def test_an_archive_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(campaign_archive, "LIMIT_BYTES", 100_000)
    with pytest.raises(CampaignError, match="unpacks to more than"):
        read_campaign_archive(packed({**sample(), "zeros.csv": b"0" * 1_000_000}), "bomb.zip")


def test_an_encrypted_or_damaged_file_is_refused() -> None:
    data = bytearray(packed(sample()))
    data[60:90] = bytes(30)
    with pytest.raises(CampaignError, match="cannot be unpacked"):
        read_campaign_archive(bytes(data), "damaged.zip")
