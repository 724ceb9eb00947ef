"""Files that come through a browser: limited before they fill the memory, and only from who may act.

viser takes files of any size from anybody (1.1.1). So its two handlers are wrapped: one looks at what is announced, the
other at what really comes.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from core.errors import InputError
from core.import_tray import plain_name
from core.input_files import MEGABYTE

if TYPE_CHECKING:
    import viser

LARGEST_BYTES = 100 * MEGABYTE
MOST_AT_ONCE = 4
"""Uploads in progress."""


def guard_uploads(server: "viser.ViserServer", may: Callable[[int], bool], refuse: Callable[[int, str], None]) -> None:
    """Refuse files that are too large, too many at once, or from who may not act.

    Args:
        may: whether the browser of this number may act.
        refuse: tells a browser why its file is not taken.
    """
    from viser import _messages

    def turn_away(client_id: int, message: _messages.FileTransferStartUpload | _messages.FileTransferPart) -> None:
        """Let a browser's button be pressed again and take its notice of a file on its way from the page."""
        client = server.get_clients().get(client_id)
        if client is not None:
            send, uuid = client.gui._websock_interface.queue_message, message.transfer_uuid
            send(_messages.FileTransferPartAck(message.source_component_uuid, uuid, 1, 1))
            send(_messages.RemoveNotificationMessage(f"upload-{uuid}"))

    gui, wire = server.gui, server._websock_server
    start, part = gui._handle_file_transfer_start, gui._handle_file_transfer_part
    wire.unregister_handler(_messages.FileTransferStartUpload, start)
    wire.unregister_handler(_messages.FileTransferPart, part)

    def checked_start(client_id: int, message: _messages.FileTransferStartUpload) -> None:
        why = _why_not(message.size_bytes, len(gui._current_file_upload_states), may(client_id))
        if why:
            turn_away(client_id, message)
            refuse(client_id, why)
        else:
            start(client_id, message)

    def checked_part(client_id: int, message: _messages.FileTransferPart) -> None:
        state = gui._current_file_upload_states.get(message.transfer_uuid)
        if state is None:
            return
        if state["client_id"] != client_id or state["transferred_bytes"] + len(message.content) > state["total_bytes"]:
            gui._current_file_upload_states.pop(message.transfer_uuid, None)
            turn_away(client_id, message)
            refuse(client_id, "The file that came is not the one that was announced; send it again.")
            return
        part(client_id, message)

    wire.register_handler(_messages.FileTransferStartUpload, checked_start)
    wire.register_handler(_messages.FileTransferPart, checked_part)


@contextmanager
def as_file(upload: "viser.UploadedFile") -> Iterator[Path]:
    """An uploaded file on the disk, under its plain name, for as long as the context lasts.

    Raises:
        InputError: its name is none, or there is no room for it.
    """
    name = plain_name(upload.name)
    try:
        with TemporaryDirectory(prefix="trueaxis-") as folder:
            path = Path(folder) / name
            path.write_bytes(upload.content)
            try:
                yield path
            except InputError as wrong:
                raise type(wrong)(str(wrong).replace(f"{folder}/", "")) from None
    except OSError as wrong:
        raise InputError(f"{name} cannot be kept, as there is no room for it: {wrong.strerror}") from None


def _why_not(size_bytes: int, at_once: int, may: bool) -> str:
    if not may:
        return "Another browser holds the operator's seat. Take the seat to send files."
    if not 0 <= size_bytes <= LARGEST_BYTES:
        return f"The file has {size_bytes / MEGABYTE:.0f} MB; send one of at most {LARGEST_BYTES / MEGABYTE:.0f} MB."
    if at_once >= MOST_AT_ONCE:
        return f"{at_once} files are on their way already; wait until they are here."
    return ""
