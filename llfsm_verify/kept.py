"""The folder for what is computed once and loaded by later runs: each file is whole, checked, and named by its origin.

A name says everything that the content depends on, and a check sum covers name and content: a file that is damaged, or
has come to the name of another, counts as missing. Whoever can write in the folder can run code as its user.
"""

from __future__ import annotations

import atexit
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Protocol, TypeVar

from llfsm_verify.files import read_regular, replacing
from llfsm_verify.packing import PackingError, pack, unpack

FOLDER = "LLFSM_CACHE"
"""The environment variable that names the folder; else the user's cache folder is taken."""
LARGEST = 1 << 26
"""Bytes of a file; kernels have some ten thousand."""
DIGEST = 32
"""Bytes of the check sum at the beginning of a file."""
MOST_VALUES = 16
"""Values of one kind that are kept; the one that was computed longest ago goes first."""
MOST_WAITING = 8
"""Values that wait to be kept."""
BEGAN = time.time()
"""When this process imported the first of our modules, or a little later."""


def cache_folder() -> Path | None:
    """The folder; None: nowhere is said, and the user has no home directory."""
    named, user = os.environ.get(FOLDER), os.environ.get("XDG_CACHE_HOME")
    try:
        if named:
            return Path(named).expanduser()
        if user and Path(user).is_absolute():
            return Path(user) / "llfsm-verify"
        return Path("~").expanduser() / ".cache" / "llfsm-verify"
    except RuntimeError:  # the user is unknown to this system, such as in a container
        return None


def place(name: str) -> Path | None:
    """The file of that name in the folder; None: there is no folder."""
    folder = cache_folder()
    return None if folder is None else folder / name


def fingerprint(*parts: bytes | str) -> str:
    """A name for everything that decides what a file holds."""
    told = (part.encode() if isinstance(part, str) else part for part in parts)
    return sha256(b"\0".join(sha256(part).digest() for part in told)).hexdigest()[:32]


def kept(path: Path | None) -> bytes | None:
    """What a file holds; None: it is missing, unreadable or damaged."""
    if path is None:
        return None
    try:
        data = read_regular(path, LARGEST)
    except OSError:
        return None
    digest, content = data[:DIGEST], data[DIGEST:]
    return content if _check_sum(path, content) == digest else None


def keep(path: Path | None, content: bytes) -> str | None:
    """Write a file, whole or not at all; else why not."""
    if path is None:
        return "the user has no home directory"
    try:
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with replacing(path) as file:
            file.write(_check_sum(path, content) + content)
    except OSError as error:
        return f"{path.parent} cannot be written ({error.strerror or error})"
    return None


def keep_newest(path: Path, content: bytes, most: int) -> str | None:
    """The same for files that edits make useless: of those named `KIND-….…` as this one, the newest `most` are left."""
    if len(content) > LARGEST - DIGEST:
        return f"it has more than {LARGEST:,} bytes"
    why = keep(path, content)
    if why is None:
        with suppress(OSError):  # another run does the same, or the folder is not ours
            kind = path.name.partition("-")[0]
            old = sorted(path.parent.glob(f"{kind}-*"), key=lambda file: file.stat().st_mtime_ns, reverse=True)
            for file in old[most:]:
                file.unlink()
    return why


@cache
def installation() -> str | None:
    """A name for everything in this installation that decides what is computed: our modules, and what they build on.

    None: that cannot be said, since there are no sources, or some were written after this process began.
    """
    from importlib.metadata import version

    walk = os.walk(Path(__file__).parent)
    files = sorted(Path(folder, name) for folder, _, names in walk for name in names if name.endswith((".py", ".ll")))
    try:
        if not files or max(file.stat().st_mtime for file in files) >= BEGAN:
            return None
        sources = [file.read_bytes() for file in files]
    except OSError:
        return None
    return fingerprint(sys.version, version("lark"), *(str(file) for file in files), *sources)


class Keepable(Protocol):
    """A value that can know under which name it is kept: a frozen data class, whose copies do not take the name over
    (`init=False`)."""

    @property
    def kept_as(self) -> str | None: ...


K = TypeVar("K", bound=Keepable)


_waiting: dict[Path, tuple[object, Sequence[object]]] = {}
"""By file, a value that is to be kept there, and the objects of this run in it."""


def kept_or_computed(kind: str, name: str, known: Sequence[object], compute: Callable[[], K]) -> K:
    """The value that an earlier run has kept under the kind and name, else what `compute` gives.

    The name says everything that the value depends on, `known` included: objects of this run that are parts of it.
    What was computed waits to be kept, until `keeping_meanwhile`, until it is asked for again, or to the end.
    """
    path = place(f"{kind}-{name}.pickle")
    if path in _waiting or len(_waiting) >= MOST_WAITING:
        keep_waiting()
    data = kept(path)
    value: K = compute() if data is None else unpack(data, known)
    if data is None and path is not None:
        _waiting[path] = value, known
    object.__setattr__(value, "kept_as", name)
    return value


def forget_waiting() -> None:
    """Keep nothing of what waits."""
    _waiting.clear()


@atexit.register
def keep_waiting() -> None:
    """Keep now what waits for it."""
    while True:
        try:
            path, (value, known) = _waiting.popitem()
        except KeyError:
            return
        with suppress(PackingError, MemoryError):  # computed in each run
            keep_newest(path, pack(value, known), MOST_VALUES)


@contextmanager
def keeping_meanwhile() -> Iterator[None]:
    """Another thread keeps what waits, while the block is at work outside of Python."""
    if not _waiting:
        yield
        return
    thread = threading.Thread(target=keep_waiting)
    try:
        thread.start()
    except RuntimeError:  # the system has no room for it
        keep_waiting()
        yield
        return
    try:
        yield
    finally:
        thread.join()


def _check_sum(path: Path, content: bytes) -> bytes:
    return sha256(path.name.encode() + b"\0" + content).digest()
