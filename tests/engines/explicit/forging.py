"""Checkpoints made on purpose: any content with a valid digest, and what the command does with it."""

from __future__ import annotations

import json
import os
import resource
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any, BinaryIO
from unittest.mock import patch

from llfsm_verify import cli
from llfsm_verify.kripke import checkpoint
from tests.cli.running import llfsm

SECONDS = 20
"""Of processor time: what takes longer hangs."""
BYTES = 1 << 32
"""Of memory beside what this process has: what wants more was not bounded by the size of the file."""


@dataclass(frozen=True, slots=True)
class Forged:
    """The parts of a checkpoint."""

    header: dict[str, Any]
    sections: tuple[bytes, ...]

    def write(self, path: Path) -> None:
        write_line(path, json.dumps(self.header).encode(), self.sections)

    def with_number(self, key: str, value: object) -> Forged:
        """The same with another one of the numbers."""
        return replace(self, header={**self.header, "numbers": {**self.header["numbers"], key: value}})

    def with_section(self, number: int, data: bytes) -> Forged:
        """The same with another section."""
        return replace(self, sections=(*self.sections[:number], data, *self.sections[number + 1 :]))


def write_line(path: Path, header: bytes, sections: Sequence[bytes] = ()) -> None:
    """A checkpoint with any line as its header, and a valid digest."""
    data = checkpoint.FORMAT + header + b"\n" + b"".join(sections)
    path.unlink(missing_ok=True)  # the search that wrote it in this process may still hold the lock
    path.write_bytes(data + sha256(data).digest())


@dataclass(frozen=True, slots=True)
class Check:
    """A check that a limit ends while it saves to `path`, and what is true: the names of what is violated."""

    arguments: tuple[str, ...]
    path: Path
    most: int
    violated: frozenset[str] = field(default_factory=frozenset)

    def run(self, *more: str) -> tuple[str, ...]:
        return ("verify", *self.arguments, "--checkpoint", str(self.path), *more)

    def saved(self) -> Forged:
        """What the search that the limit ends has saved."""
        sizes: list[int] = []
        really = checkpoint.write

        def write(file: BinaryIO, header: Any, sections: Any) -> None:
            sizes[:] = [size for _, size in sections]
            really(file, header, sections)

        with patch.object(checkpoint, "write", write):
            done = llfsm(*self.run("--max-states", str(self.most)))
        assert done.returncode in (1, 4), done.stderr
        assert sizes, "nothing was saved"
        _, header, data = self.path.read_bytes().split(b"\n", 2)
        places = [sum(sizes[:i]) for i in range(len(sizes))]
        return Forged(json.loads(header), tuple(data[at : at + size] for at, size in zip(places, sizes, strict=True)))

    def outcome(self, *more: str) -> str:
        """What going on from the file comes to: ``refused``, ``violated``, ``holds`` or ``unknown``; anything that a
        checkpoint must not cause is an AssertionError."""
        code, out, err = in_a_child(self.run("--resume", "--format", "json", *more), self.path.with_suffix(".out"))
        told = f"exit code {code}: {err}"
        if code == 3:
            assert "error[E413]" in err or "error[E414]" in err, told
            return "refused"
        assert code in (0, 1, 4), told
        result = json.loads(out)
        resumed = result["resumed_from"]
        verdicts = {p["name"]: p for p in result["properties"]}
        for name, found in verdicts.items():
            assert found["verdict"] != "violated" or name in self.violated, told
            claimed = found["verdict"] == "holds" and name in self.violated
            assert not claimed or (resumed and "(resumed from " in found["words"]), told
        faults = result["faults"]["verdict"]
        assert faults != "violated" or "faults" in self.violated
        assert faults != "holds" or "faults" not in self.violated or resumed
        return {0: "holds", 1: "violated", 4: "unknown"}[code]


def in_a_child(arguments: Sequence[str], file: Path) -> tuple[int, str, str]:
    """The command in a process forked from this one, with limits: exit code (negative: a signal) and what it prints."""
    paths = [file, file.with_suffix(".err")]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of forking beside the threads of numpy's library
        child = os.fork()
    if child == 0:
        code = 70
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
            statm = Path("/proc/self/statm")
            if statm.exists():
                most = int(statm.read_text().split()[0]) * resource.getpagesize() + BYTES
                resource.setrlimit(resource.RLIMIT_AS, (most, most))
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            with paths[0].open("w") as out, paths[1].open("w") as err:
                sys.stdout, sys.stderr = out, err
                code = cli.main(arguments)
        finally:
            os._exit(code)
    _, status = os.waitpid(child, 0)
    out, err = (path.read_text() for path in paths)
    return os.waitstatus_to_exitcode(status), out, err


NUMBERS = (
    0,
    1,
    2,
    3,
    5,
    -1,
    -2,
    64,
    255,
    1 << 16,
    (1 << 31) - 1,
    1 << 31,
    (1 << 32) - 1,
    (1 << 63) - 1,
    1 << 63,
    1 << 64,
)
OTHERS = (True, False, None, "5", "", 0.0, 1e300, [], {}, [0], {"a": 1})
WORDS = (b"\x00" * 8, b"\xff" * 8, b"\x01" + b"\x00" * 7, b"\xff" * 4 + b"\x00" * 4, b"\x00" * 7 + b"\x80")


def mutations(original: Forged, random: Random, count: int) -> Iterator[Forged]:
    """So many checkpoints that differ from one in a few places, a third of these in the header."""
    for _ in range(count):
        forged = original
        for _ in range(random.choice((1, 1, 1, 2, 4))):
            forged = _changed_header(forged, random) if random.random() < 0.3 else _changed_data(forged, random)
        yield forged


def _changed_header(forged: Forged, random: Random) -> Forged:
    header = json.loads(json.dumps(forged.header))
    places = list(_places(header))
    holder, key = random.choice([p for p in places if not isinstance(p[0][p[1]], str)] or places)
    value, kind = holder[key], random.random()
    if kind < 0.25:
        holder[key] = random.choice(OTHERS)
    elif kind < 0.6 and isinstance(value, int):
        holder[key] = value + random.choice((-2, -1, 1, 2, 8, 64))
    elif kind < 0.8 and isinstance(value, list) and value:
        at = random.randrange(len(value))
        value[at : at + 1] = [] if random.random() < 0.5 else [value[at], value[at]]
    else:
        holder[key] = random.choice(NUMBERS)
    return replace(forged, header=header)


def _places(value: Any) -> Iterator[tuple[Any, Any]]:
    """Every place in a value of JSON, as what holds it and its key there."""
    for key, item in value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ():
        yield value, key
        yield from _places(item)


def _changed_data(forged: Forged, random: Random) -> Forged:
    number = random.choice([i for i, s in enumerate(forged.sections) if s])
    data = bytearray(forged.sections[number])
    at, kind = random.randrange(len(data)), random.random()
    if kind < 0.4:  # a number in the place of another one, which often leads to something that fits
        size = random.choice((4, 4, 8, 16))
        source, target = (random.randrange(max(1, len(data) // size)) * size for _ in range(2))
        part = data[source : source + size][: len(data) - target]
        data[target : target + len(part)] = part
    elif kind < 0.65:
        data[at] ^= 1 << random.randrange(8)
    elif kind < 0.8:
        data[at] = (data[at] + random.choice((1, -1))) % 256
    elif kind < 0.9:
        word = random.choice(WORDS)
        at = at // 8 * 8
        data[at : at + len(word)] = word[: len(data) - at]
    elif kind < 0.95:
        data[:] = random.choice((b"\x00", b"\xff", b"\x01")) * len(data)
    else:
        data = data[: len(data) // 2] if random.random() < 0.5 else data + data[:64]
    return forged.with_section(number, bytes(data))
