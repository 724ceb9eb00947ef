"""Events as they stand in the file: numbered, dated, signed, with a check sum, as one JSON object a row.

    {"crc":"5f0c1a2b","size":"0000213","format":2,"seq":17,"utc":"2026-03-02T09:14:05.120433Z","by":"A. Name",
     "event":{"kind":"judged",...}}

``crc`` is the CRC-32 of the ``size`` bytes that follow the two. So an entry tells by itself whether it is intact, and
can be found in a file whose structure is lost.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Annotated
from zlib import crc32

import msgspec
from msgspec import Meta

from core.session_events import LONGEST_EVENT_BYTES, AnyEvent, Event, SessionError, checked, kind_of
from core.session_values import Line, PositiveInt

SESSION_FORMAT = 2
"""Of the entries that this program writes; it reads all before it."""


def _unchanged(plain: dict) -> dict:
    """Format 2 only adds: sweeps that are held elsewhere than at home."""
    return plain


MIGRATIONS: dict[int, Callable[[dict], dict]] = {1: _unchanged}
"""From format k to k + 1: the plain event of an entry, rewritten when it is read. Files keep what they hold."""

_HEAD = re.compile(rb'\{"crc":"([0-9a-f]{8})","size":"(\d{7})",')
_HEAD_BYTES = len(b'{"crc":"00000000","size":"0000000",')


@dataclass(frozen=True)
class Entry:
    """One event with its number, time and author."""

    seq: int
    """1, 2, 3, ... without gaps."""
    utc: str
    """When it was kept, ISO 8601, UTC."""
    by: str
    """Who did it; may be empty."""
    event: AnyEvent

    @property
    def kind(self) -> str:
        return kind_of(self.event)


class _Body(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    format: PositiveInt
    seq: PositiveInt
    utc: Annotated[str, Meta(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{6}Z\Z")]
    by: Line
    event: msgspec.Raw


_BODY = msgspec.json.Decoder(_Body)
_EVENT = msgspec.json.Decoder(AnyEvent)


class DamagedEntry(Exception):
    """A row is not the entry that was written; the message says in which way."""


def utc_now() -> str:
    """The time as entries have it."""
    return datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def new_entry(seq: int, event: Event, by: str, utc: str | None = None) -> Entry:
    """An entry whose event and author have been checked.

    Raises:
        SessionError: a value cannot be; the sentence says which.
    """
    try:
        author = msgspec.convert(by, Line)
    except msgspec.ValidationError:
        raise SessionError("the author of an event must be a text on one line of at most 200 characters") from None
    return Entry(seq, utc or utc_now(), author, checked(event))


def encoded(entry: Entry) -> bytes:
    """The JSON of an entry, UTF-8.

    Raises:
        SessionError: it is longer than a session keeps.
    """
    try:
        event = msgspec.Raw(msgspec.json.encode(entry.event))
    except UnicodeEncodeError:
        raise SessionError(f"event {entry.kind!r}: holds characters that are no text") from None
    body = msgspec.json.encode(_Body(SESSION_FORMAT, entry.seq, entry.utc, entry.by, event))[1:]
    if len(body) > LONGEST_EVENT_BYTES:
        megabytes, most = len(body) / 1e6, LONGEST_EVENT_BYTES / 1e6
        raise SessionError(f"event {entry.kind!r} takes {megabytes:.1f} MB, expected at most {most:g} MB")
    return b'{"crc":"%08x","size":"%07d",' % (crc32(body), len(body)) + body


def decoded(data: object) -> Entry:
    """The entry that a row holds.

    Raises:
        DamagedEntry: the bytes are not those that were written.
        SessionError: a newer program wrote it.
    """
    head = _HEAD.match(data) if isinstance(data, bytes) else None
    if head is None:
        raise DamagedEntry("it is not an entry")
    body = data[_HEAD_BYTES:]
    if len(body) != int(head[2]) or crc32(body) != int(head[1], 16):
        raise DamagedEntry("its check sum does not fit")
    try:
        parts = _BODY.decode(b"{" + body)
        return Entry(parts.seq, parts.utc, parts.by, _event(parts))
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as wrong:
        raise DamagedEntry(f"it does not follow its schema ({' '.join(str(wrong).split())[:120]})") from None


def carved(data: bytes) -> Iterator[Entry]:
    """Intact entries found in the bytes of a file, in the order in which they stand there."""
    for head in _HEAD.finditer(data):
        try:
            yield decoded(data[head.start() : head.end() + int(head[2])])
        except (DamagedEntry, SessionError):
            continue


def _event(parts: _Body) -> AnyEvent:
    if parts.format == SESSION_FORMAT:
        return _EVENT.decode(parts.event)
    if parts.format > SESSION_FORMAT:
        raise SessionError(newer(parts.format))
    plain = msgspec.json.decode(parts.event)
    for step in range(parts.format, SESSION_FORMAT):
        plain = MIGRATIONS[step](plain)
    return msgspec.convert(plain, AnyEvent)


def newer(form: int) -> str:
    """What to say of a file of a later format."""
    return (
        f"was written by a newer trueaxis (session format {form}; this one reads up to {SESSION_FORMAT}),"
        " expected an older file or a newer trueaxis"
    )
