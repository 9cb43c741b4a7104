"""Checkpoint files: an exploration's memory on disk, replaced whole or not at all.

A file is a line that names the format, a line of JSON (what was checked, and numbers), sections one after the other,
whose sizes follow from the numbers, and the SHA-256 of everything before it. That is against accidents. Somebody may
have made the file on purpose, so what is read is looked at before it is used (`kripke.restoring`).
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.memory import Region
from llfsm_verify.limits import Budget

if TYPE_CHECKING:
    from hashlib import _Hash

KIND = b"llfsm-verify checkpoint "
"""What a checkpoint of any version begins with."""
FORMAT = KIND + b"2\n"
PORTION = 1 << 22
"""Bytes read or written at once."""
LARGEST_HEADER = 1 << 24
"""Bytes of the line of JSON."""
DIGEST = 32
"""Bytes of the digest at the end."""

Section = tuple[Region, int]
"""A region, and how many of its bytes."""


class Unusable(Exception):
    """A checkpoint that cannot be continued from; the message says why, in a sentence."""


class OtherVersion(Exception):
    """A checkpoint of another version of this format."""


def write(file: BinaryIO, header: Mapping[str, Json], sections: Sequence[Section]) -> None:
    """Write a checkpoint with a header and sections. Raises OSError."""
    line = json.dumps(header).encode() + b"\n"
    digest = sha256()
    _write(file, FORMAT + line, digest)
    for region, size in sections:
        with region.view(size) as view:
            for start in range(0, size, PORTION):
                with view[start : start + PORTION] as part:
                    _write(file, part, digest)
    file.write(digest.digest())


def _write(file: BinaryIO, data: bytes | memoryview, digest: _Hash) -> None:
    file.write(data)
    digest.update(data)


def header_of(path: Path) -> dict[str, Json] | None:
    """The header of a checkpoint; None: there is none yet.

    Raises OSError, OtherVersion, and Unusable for a file that is not a checkpoint or whose header is not JSON.
    """
    try:
        with path.open("rb") as file:
            if not os.fstat(file.fileno()).st_size:
                return None
            first, line = _lines(file)
    except FileNotFoundError:
        return None
    if first != FORMAT:
        if first.startswith(KIND):
            raise OtherVersion
        raise Unusable("it is not a checkpoint")
    try:
        header = json.loads(line)
    except (ValueError, RecursionError):
        raise Unusable("it is damaged") from None
    if not isinstance(header, dict):
        raise Unusable("it is damaged")
    return header


def load(path: Path, sections: Sequence[Section], budget: Budget) -> None:
    """Read sections of these sizes into their regions, which grow as needed.

    Raises OSError, Unusable for a file of another size or with a wrong digest, and LimitReached when there is no memory
    for them or the time is over.
    """
    with path.open("rb") as file:
        digest = sha256(b"".join(_lines(file)))
        left = os.fstat(file.fileno()).st_size - file.tell() - DIGEST
        if left != sum(size for _, size in sections):
            raise Unusable("it is damaged")
        for region, size in sections:
            budget.check(size)
            region.grow(size)
            with region.view(size) as view:
                for start in range(0, size, PORTION):
                    budget.check()
                    with view[start : start + PORTION] as part:
                        if file.readinto(part) != len(part):
                            raise Unusable("it is cut short")
                        digest.update(part)
        if file.read(DIGEST + 1) != digest.digest():
            raise Unusable("it is damaged")


def _lines(file: BinaryIO) -> tuple[bytes, bytes]:
    """The line of the format, and that of the header."""
    return file.readline(len(FORMAT)), file.readline(LARGEST_HEADER)
