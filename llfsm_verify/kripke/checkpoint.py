"""Checkpoint files: an exploration's memory on disk, replaced whole or not at all.

A file is a line that names the format, a line of JSON (what was checked, numbers, and the size of each section), the
sections one behind the other, and a CRC-32 of everything before it.
"""

from __future__ import annotations

import json
import os
import tempfile
import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from llfsm_verify.kripke.memory import Region

FORMAT = b"llfsm-verify checkpoint 1\n"
PORTION = 1 << 22
"""Bytes read or written at once."""

Json = None | bool | int | float | str | list["Json"] | dict[str, "Json"]


class Unusable(Exception):
    """A checkpoint that cannot be gone on from; the message says why, in a sentence."""


def save(path: Path, header: Mapping[str, Json], sections: Sequence[tuple[Region, int]]) -> None:
    """Write regions, of each so many bytes, with a header. The file at `path` is replaced when the new one is on disk.

    Raises OSError.
    """
    sizes: Json = [size for _, size in sections]
    handle, name = tempfile.mkstemp(prefix=path.name, suffix=".tmp", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            check = _write(file, FORMAT + json.dumps({**header, "sizes": sizes}).encode() + b"\n", 0)
            for region, size in sections:
                with region.view(size) as view:
                    for start in range(0, size, PORTION):
                        with view[start : start + PORTION] as part:
                            check = _write(file, part, check)
            file.write(check.to_bytes(4, "little"))
            file.flush()
            os.fsync(file.fileno())
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def _write(file: BinaryIO, data: bytes | memoryview, check: int) -> int:
    file.write(data)
    return zlib.crc32(data, check)


def header_of(path: Path) -> dict[str, Json]:
    """The header of a checkpoint. Raises OSError, and Unusable for a file of another kind."""
    with path.open("rb") as file:
        return _header(file)[0]


def load(path: Path, regions: Sequence[Region]) -> None:
    """Read the sections into regions, which grow as needed. Raises OSError, and Unusable for a damaged file."""
    with path.open("rb") as file:
        header, check = _header(file)
        sizes = header.get("sizes")
        if not isinstance(sizes, list) or len(sizes) != len(regions):
            raise Unusable("it is damaged")
        for region, size in zip(regions, sizes, strict=True):
            if not isinstance(size, int) or size < 0 or size > path.stat().st_size:
                raise Unusable("it is damaged")
            region.grow(size)
            with region.view(size) as view:
                for start in range(0, size, PORTION):
                    with view[start : start + PORTION] as part:
                        if file.readinto(part) != len(part):
                            raise Unusable("it is cut short")
                        check = zlib.crc32(part, check)
        if file.read() != check.to_bytes(4, "little"):
            raise Unusable("it is damaged")


def _header(file: BinaryIO) -> tuple[dict[str, Json], int]:
    first, line = file.readline(len(FORMAT)), file.readline(1 << 24)
    if first != FORMAT:
        raise Unusable("it is not a checkpoint of this version")
    try:
        header = json.loads(line)
    except ValueError:
        raise Unusable("it is damaged") from None
    if not isinstance(header, dict):
        raise Unusable("it is damaged")
    return header, zlib.crc32(first + line)
