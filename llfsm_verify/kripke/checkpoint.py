"""Checkpoint files: an exploration's memory on disk, replaced whole or not at all.

A file is a line that names the format, a line of JSON (what was checked, and numbers), sections one after the other,
whose sizes follow from the numbers, and the SHA-256 of everything before it. That is against accidents. The file may
also have been made on purpose, so what is read is looked at before it is used (`kripke.restoring`).

The place of a file is kept for one search (`Reservation`): nothing else is replaced there, and no other search saves
there. The file itself is locked, not another one beside it; it is empty until something is saved. A new checkpoint is
written under one other name, FILE.tmp, and locked before it takes the place of the old one: so at every moment the file
of that name is whole, and locked. What `kill -9` leaves is an empty file or FILE.tmp, and the next search uses both up.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from hashlib import sha256
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, BinaryIO

from llfsm_verify.files import special_kind
from llfsm_verify.jsonvalue import Json
from llfsm_verify.kripke.graph import FIRST_BYTES, MAX_NODES, NUMBER_BYTES, Graph
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


MOST = 1 << 60
"""Counts are no larger: kernels add to them in 64 bits."""


@dataclass(frozen=True, slots=True)
class Numbers:
    """The numbers of an exploration between two batches of nodes: how much lies in memory, and what is counted.

    `words` are those of chains, `level_end` is the node with which the next level begins; `overflow` and the faults are
    the first nodes from which they happen, or -1.
    """

    nodes: int
    expanded: int
    letters: int
    words: int
    edges: int
    transitions: int
    level_end: int
    depth: int
    overflow: int
    faults: tuple[int, ...]

    def header(self) -> dict[str, Json]:
        """The same for the header of a checkpoint."""
        return {**asdict(self), "faults": list(self.faults)}

    @staticmethod
    def of_header(data: Json, faults: int) -> Numbers:
        """What `header` gave, of a program with so many faults. Raises Unusable, also for a number out of range."""
        if not isinstance(data, dict) or data.keys() != {f.name for f in fields(Numbers)}:
            raise Unusable("it is damaged")
        sites = data["faults"]
        if not isinstance(sites, list) or len(sites) != faults:
            raise Unusable("it is damaged")
        plain = {key: whole(value, -1, MOST) for key, value in data.items() if key != "faults"}
        found = Numbers(**plain, faults=tuple(whole(site, -1, MOST) for site in sites))
        _check_numbers(found)
        return found


def whole(data: Json, low: int, high: int) -> int:
    """A number of a header, from `low` to `high`. Raises Unusable for anything else."""
    if isinstance(data, bool) or not isinstance(data, int) or not low <= data <= high:
        raise Unusable("it is damaged")
    return data


def _check_numbers(n: Numbers) -> None:
    counts = (n.nodes, n.expanded, n.letters, n.words, n.edges, n.transitions, n.level_end, n.depth)
    need(min(counts) >= 0)
    need(max(n.nodes, n.letters, n.words) <= MAX_NODES)
    need(max(n.expanded, n.level_end, n.depth) <= n.nodes)
    need(max(n.overflow, *n.faults, -1) < n.expanded)


def need(found: object) -> None:
    """Raises Unusable unless this is true."""
    if not found:
        raise Unusable("it is damaged")


def sizes(n: Numbers, graph: Graph, letter_bytes: int, *, with_words: bool) -> list[int]:
    """Bytes of the regions of an exploration: `keys`, `parents`, `first`, `targets`, `labels`, letters, words."""
    return [
        n.nodes * graph.words * 8,
        n.nodes * NUMBER_BYTES,
        (n.expanded + 1) * FIRST_BYTES if graph.with_edges else 0,
        n.edges * NUMBER_BYTES,
        n.edges * NUMBER_BYTES,
        n.letters * letter_bytes,
        *([n.words * 8] if with_words else []),
    ]


ENDING = ".tmp"
_OPEN = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NONBLOCK
_MODE = 0o600
_TRIES = 100


class NotReplaceable(Exception):
    """Something is there that is not a checkpoint, and stays; the message says what."""


class Taken(Exception):
    """Another search is saving there."""


class Reservation:
    """A place that is this search's until `release`, which also happens when this process ends.

    A second reservation in the same process takes the place over from the first.
    """

    def __init__(self, path: Path) -> None:
        """Raises NotReplaceable, Taken, and OSError when files cannot be made there."""
        self._path = Path(os.path.realpath(path))  # a link is kept, and what it leads to replaced
        self._new = self._path.with_name(self._path.name + ENDING)
        _must_be_replaceable(self._path)
        with _GUARD:
            before = _HELD.get(self._path)
            if before is not None:
                before.release()
            self._file: int | None = _locked(self._path)
            _HELD[self._path] = self
        try:
            _must_be_replaceable(self._path)  # again, now that no other process changes it
            _must_be_replaceable(self._new, in_part=True)
            self._new.unlink(missing_ok=True)
            os.close(os.open(self._new, _OPEN | os.O_EXCL, _MODE))  # can it be made?
            self._new.unlink()
        except BaseException:
            self.release()
            raise

    def save(self, header: Mapping[str, Json], sections: Sequence[tuple[Region, int]]) -> None:
        """Replace the file when a new one is whole and on the disk. Raises OSError; then the old one is still there."""
        if self._file is None:
            raise OSError(errno.EBUSY, "another search is saving there")
        new = os.open(self._new, _OPEN | os.O_TRUNC | os.O_NOFOLLOW, _MODE)
        try:
            fcntl.flock(new, fcntl.LOCK_EX | fcntl.LOCK_NB)
            with open(new, "wb", closefd=False) as file:
                write(file, header, sections)
            os.fsync(new)
            if not _is_at(self._file, self._path) and self._path.exists():
                raise OSError(errno.EEXIST, "another file has been put in its place")
            self._new.replace(self._path)
        except BaseException:
            os.close(new)
            self._new.unlink(missing_ok=True)
            raise
        os.close(self._file)
        self._file = new
        _sync(self._path.parent)

    def release(self) -> None:
        """Give the place up. Where nothing was saved, no file is left."""
        if self._file is None:
            return
        file, self._file = self._file, None
        _HELD.pop(self._path, None)
        try:
            if os.fstat(file).st_size == 0 and _is_at(file, self._path):
                self._path.unlink()
        except OSError:
            pass  # an empty file is no harm
        finally:
            os.close(file)


_HELD: dict[Path, Reservation] = {}
"""The reservations of this process. Locks tell processes apart only."""
_GUARD = Lock()


def _locked(path: Path) -> int:
    """The file, made if need be, and locked. Raises Taken."""
    for _ in range(_TRIES):
        file = os.open(path, _OPEN, _MODE)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(file)
            raise Taken from None
        except OSError:
            os.close(file)
            raise
        if _is_at(file, path):
            return file
        os.close(file)  # it was replaced or removed in between
    raise Taken


def _is_at(file: int, path: Path) -> bool:
    """Whether an open file is the one of this name."""
    try:
        return os.path.samestat(os.fstat(file), path.stat())
    except FileNotFoundError:
        return False


def _must_be_replaceable(path: Path, *, in_part: bool = False) -> None:
    """Raises NotReplaceable unless there is nothing, an empty file or a checkpoint, `in_part` also one cut short."""
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:
        return
    kind = special_kind(mode)
    if kind is not None:
        raise NotReplaceable(f"{path} is {kind}")
    with path.open("rb") as file:
        first = file.read(len(FORMAT))
    if first and not first.startswith(KIND) and not (in_part and KIND.startswith(first)):
        raise NotReplaceable(f"{path} is not a checkpoint")


def _sync(folder: Path) -> None:
    """Have the names in a folder written to the disk. Raises OSError."""
    file = os.open(folder, os.O_RDONLY | os.O_CLOEXEC)
    try:
        os.fsync(file)
    except OSError as error:
        if error.errno != errno.EINVAL:  # a file system that cannot, and need not
            raise
    finally:
        os.close(file)
