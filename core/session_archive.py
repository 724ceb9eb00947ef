"""A session <-> a campaign in a ZIP file, for those that come and go through a browser."""

import io
import zipfile
from pathlib import Path
from tempfile import TemporaryDirectory

from core.campaign_archive import unpacked_campaign
from core.session_campaign import export_campaign
from core.session_events import Event, SessionError
from core.session_import import campaign_events
from core.session_state import State

DATE = (1980, 1, 1, 0, 0, 0)
"""Of every file in an archive, so that the same session gives the same bytes."""


def archive_events(data: bytes, name: str) -> list[Event]:
    """What happened in a campaign that comes as a ZIP file, as events.

    Args:
        data: the file.
        name: what it is called in messages.

    Raises:
        CampaignError, RobotError: it cannot be unpacked or read; one sentence says why.
    """
    with unpacked_campaign(data, name) as folder:
        return campaign_events(folder)


def campaign_archive(state: State, root: str) -> bytes:
    """A session's campaign folder as a ZIP file.

    Args:
        root: name of the folder in it.

    Raises:
        SessionError, RobotError: as for ``to_campaign``, or there is no room to write.
    """
    data = io.BytesIO()
    try:
        with TemporaryDirectory(prefix="trueaxis-") as place:
            folder = Path(place)
            export_campaign(state, folder)
            with zipfile.ZipFile(data, "w", zipfile.ZIP_DEFLATED) as archive:
                for path in sorted(path for path in folder.rglob("*") if path.is_file()):
                    entry = zipfile.ZipInfo(f"{root}/{path.relative_to(folder).as_posix()}", DATE)
                    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
                    archive.writestr(entry, path.read_bytes())
    except OSError as wrong:
        raise SessionError(f"the campaign cannot be packed, as there is no room for it: {wrong.strerror}") from None
    return data.getvalue()
