"""A campaign folder packed into a ZIP file -> Campaign, for campaigns that come through a browser."""

import io
import lzma
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath
from tempfile import TemporaryDirectory

from core.campaign_files import read_campaign
from core.errors import CampaignError, InputError
from core.input_files import MEGABYTE, shown
from core.measurements import Campaign

DESCRIBED = "campaign.toml"
ENDINGS = (".toml", ".csv", ".urdf", ".xml")
"""Of files that a campaign may consist of; whatever else is in the archive is left there."""
UNPACKING = (zipfile.BadZipFile, zlib.error, lzma.LZMAError, RuntimeError, EOFError, ValueError, OSError)
"""What a damaged, encrypted or unusual archive may raise."""
MOST_ENTRIES = 2000
LIMIT_BYTES = 200 * MEGABYTE
"""Of all files together, unpacked."""


def read_campaign_archive(data: bytes, name: str) -> Campaign:
    """The campaign in a ZIP file: campaign.toml and what it names, at the top or in one folder of it.

    Args:
        data: the file.
        name: what it is called in messages.

    Raises:
        CampaignError, RobotError: it is no ZIP file, holds no campaign or more than one, is too large, or the campaign
            cannot be read; one sentence says why.
    """
    with unpacked_campaign(data, name) as folder:
        return read_campaign(folder)


@contextmanager
def unpacked_campaign(data: bytes, name: str) -> Iterator[Path]:
    """The folder of a campaign in a ZIP file, for as long as the context lasts; errors within name the archive.

    Raises:
        CampaignError: as for ``read_campaign_archive``.
    """
    with TemporaryDirectory(prefix="trueaxis-") as place:
        folder = Path(place)
        _unpack(data, name, folder)
        try:
            yield folder
        except InputError as wrong:
            raise type(wrong)(str(wrong).replace(f"{folder}/", f"{name}: ").replace(str(folder), name)) from None


def _unpack(data: bytes, name: str, folder: Path) -> None:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            root = _root(archive, name)
            left = LIMIT_BYTES
            for entry in archive.infolist():
                path = PurePosixPath(entry.filename)
                if not entry.is_dir() and path.suffix.lower() in ENDINGS and path.is_relative_to(root):
                    left -= _extract(archive, entry, folder / _inner(path, root, name), left, name)
    except UNPACKING as wrong:
        raise CampaignError(f"{name} cannot be unpacked, expected a ZIP file of a campaign folder: {wrong}") from None


def _root(archive: zipfile.ZipFile, name: str) -> PurePosixPath:
    """The folder of the archive that holds the campaign."""
    entries = archive.namelist()
    if len(entries) > MOST_ENTRIES:
        raise CampaignError(f"{name} holds {len(entries)} files, expected at most {MOST_ENTRIES}")
    found = [path.parent for path in map(PurePosixPath, entries) if path.name == DESCRIBED]
    if len(found) != 1:
        raise CampaignError(f"{name} holds {len(found)} files {DESCRIBED}, expected one")
    return found[0]


def _inner(path: PurePosixPath, root: PurePosixPath, name: str) -> PurePosixPath:
    inner = path.relative_to(root)
    if inner.is_absolute() or ".." in inner.parts or "\\" in str(inner) or ":" in str(inner) or "\0" in str(inner):
        raise CampaignError(f"{name} holds a file {shown(str(path))}, expected one within its folder")
    return inner


def _extract(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, left: int, name: str) -> int:
    """Unpack one file, believing its bytes rather than its header; their number."""
    with archive.open(entry) as packed:
        content = packed.read(left + 1)
    if len(content) > left:
        raise CampaignError(f"{name} unpacks to more than {LIMIT_BYTES / MEGABYTE:g} MB, expected less")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return len(content)
