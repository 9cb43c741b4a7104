"""A case: a command with the files that it reads, kept as JSON once it has found something."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

CASES = Path(__file__).parent / "cases"


@dataclass(frozen=True, slots=True)
class Case:
    """What is run: `arguments` of `llfsm` (or of another program, see `running.PROGRAMS`) in a folder of `files`."""

    arguments: tuple[str, ...]
    files: tuple[tuple[str, bytes], ...] = ()
    stdin: bytes = b""

    def write(self, folder: Path) -> None:
        """Put the files into a folder."""
        for name, data in self.files:
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)

    def to_json(self, indent: int | None = 1) -> str:
        """The case as text that is fit for a repository, bytes that are no UTF-8 as lone surrogates."""
        files = {name: _text(data) for name, data in self.files}
        document = {"arguments": list(self.arguments), "files": files, "stdin": _text(self.stdin)}
        return json.dumps(document, indent=indent) + "\n"


def case_of(text: str) -> Case:
    """The case that `to_json` has written."""
    document = json.loads(text)
    files = tuple((name, _bytes(data)) for name, data in document["files"].items())
    return Case(tuple(document["arguments"]), files, _bytes(document["stdin"]))


def kept_cases() -> dict[str, Case]:
    """The cases that have found something, by name."""
    return {path.stem: case_of(path.read_text("utf-8")) for path in sorted(CASES.glob("*.json"))}


def _text(data: bytes) -> str:
    return data.decode("utf-8", "surrogateescape")


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")
