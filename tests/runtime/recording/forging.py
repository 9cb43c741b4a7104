"""What somebody does who writes a recording again: all its checksums fit then."""

from __future__ import annotations

import zlib
from pathlib import Path

from llfsm_verify.runtime.live.text import CHECK_BYTES
from llfsm_verify.runtime.recording.file import HEAD, MAGIC, Recording, _entry, checksum


def begin_of(data: bytes) -> int:
    """Where the first entry is."""
    return data.index(b"\n", len(MAGIC)) + 1 + HEAD


def entries_of(path: Path) -> list[bytes]:
    """The entries of a whole recording, without their checksums."""
    data = path.read_bytes()
    with Recording(path) as recording:
        frame, check, at, found = [0] * recording.words, recording._first, begin_of(data), []
        while at < len(data):
            begin = at
            _, check, at = _entry(data, begin, frame, check)
            found.append(data[begin : at - CHECK_BYTES])
    return found


def sealed(head: bytes, entries: list[bytes], closed: bytes = bytes.fromhex("0100feff")) -> bytes:
    """A recording with this header (up to `used`) and these entries."""
    check, parts = zlib.crc32(head), []
    first = check.to_bytes(CHECK_BYTES, "little")
    for entry in entries:
        check = checksum(entry, check)
        parts += [entry, check.to_bytes(CHECK_BYTES, "little")]
    body = b"".join(parts)
    return head + len(body).to_bytes(8, "little") + closed + first + body
