"""The journal (WAL) of a session that was cut off: which part of it was committed, whatever SQLite makes of it.

SQLite reads a journal up to the first thing wrong in it. What was committed behind a damaged place is lost to SQLite,
but most of it is intact. In the file format (sqlite.org/fileformat2.html, section 4) every frame of one generation
repeats two salts of the journal's head, behind the size of the database, which is zero unless the frame commits; and
carries a check sum that goes on from the frame before it.
"""

import re
import struct
from dataclasses import dataclass

HEAD_BYTES, FRAME_BYTES = 32, 24
SALTS_AT = 8
"""In a frame's head; the commit mark stands in the four bytes before."""
SMALLEST_PAGE, LARGEST_PAGE = 512, 65536


@dataclass(frozen=True)
class JournalParts:
    """How far the content of a journal can be trusted."""

    committed: bytes
    """Up to the last commit that was certainly completed."""
    unsure: bytes
    """The last transaction, if it is damaged or its commit was not completed: one cannot tell which."""


def journal_parts(journal: bytes) -> JournalParts:
    """The committed part of a journal; all of it if its head is damaged."""
    salts, page_bytes = journal[16:24], int.from_bytes(journal[8:12], "big")
    frames = [HEAD_BYTES + found.start() - SALTS_AT for found in re.finditer(re.escape(salts), journal[HEAD_BYTES:])]
    if not frames or not SMALLEST_PAGE <= page_bytes <= LARGEST_PAGE:
        return JournalParts(journal, b"")
    whole = FRAME_BYTES + page_bytes
    ends = [start + whole for start in frames if any(journal[start + 4 : start + SALTS_AT])]
    if not ends:
        return JournalParts(b"", b"")
    # Frames are written one after the other: a commit that another frame follows was completed.
    if ends[-1] - whole < frames[-1] or _is_intact(journal, ends[-1] - whole, page_bytes):
        return JournalParts(journal[: ends[-1]], b"")
    sure = ends[-2] if len(ends) > 1 else 0
    return JournalParts(journal[:sure], journal[sure : ends[-1]])


def _is_intact(journal: bytes, start: int, page_bytes: int) -> bool:
    """Whether the check sum of a frame, continued from the frame before it, is right."""
    page = journal[start + FRAME_BYTES : start + FRAME_BYTES + page_bytes]
    if len(page) < page_bytes:
        return False
    before = start - page_bytes - FRAME_BYTES + 16 if start > HEAD_BYTES else 24
    first, second = struct.unpack(">II", journal[before : before + 8])
    order = ">" if journal[3] & 1 else "<"
    data = journal[start : start + 8] + page
    words = struct.unpack(f"{order}{len(data) // 4}I", data)
    for one, two in zip(words[::2], words[1::2], strict=True):
        first = (first + one + second) & 0xFFFFFFFF
        second = (second + two + first) & 0xFFFFFFFF
    return (first, second) == struct.unpack(">II", journal[start + 16 : start + 24])
