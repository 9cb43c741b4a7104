"""A guard in another format than YAML, with a reader and a writer of its own: a line `KEY.KEY = VALUE` a value."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import llfsm_verify
from llfsm_verify.arrangement import formats
from llfsm_verify.arrangement.draft import Draft, MachineDraft, Unreadable
from llfsm_verify.arrangement.files import read_named, read_source
from llfsm_verify.arrangement.formats import Given
from llfsm_verify.arrangement.formats import reading as machine_formats
from llfsm_verify.arrangement.formats.documents import draft_arrangement, draft_machine
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.formats.writing import Edits, NewMachine, Writer
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source, Span
from llfsm_verify.registry import Entry, Registry
from llfsm_verify.yaml.nodes import Mapping as MappingNode
from llfsm_verify.yaml.nodes import Node, Scalar, Sequence, mark, written
from tests.extensions.guards.helpers import guarded, proved

LINE = re.compile(r"^(\w[\w.]*) = (.*)$", re.MULTILINE)
NEWLINE = "¶"
"""Stands for a new line in a value, as one character, so that places are as in the file."""

# ---------------------------------------------------------------- the reader


def nodes(source: Source) -> Node:
    root: dict[str, Any] = {}
    for line in LINE.finditer(source.text):
        text = line[2].replace(NEWLINE, "\n")
        span = Span(source, line.start(2), line.end(2))
        value = Scalar(Fragment(text, source, range(span.start, span.end + 1)), span)
        *keys, last = re.finditer(r"\w+", line[1])
        inner = root
        for key in keys:
            at = line.start() + key.start()
            inner = inner.setdefault(key[0], (written(source, at, at + len(key[0])), {}))[1]
        at = line.start() + last.start()
        inner[last[0]] = (written(source, at, at + len(last[0])), value)
    return node(root, Span(source, 0, len(source.text)))


def node(value: Any, span: Span) -> Node:
    if isinstance(value, Scalar):
        return value
    items = tuple((key, node(inner, key.span)) for key, inner in value.values())
    if all(key.text.isdigit() for key, _ in items):
        return Sequence(tuple(inner for _, inner in items), span)
    return MappingNode(items, span)


def read_arrangement(given: Given) -> Draft:
    source, data = read_source(given.path) if given.text is None else (Source(str(given.path), given.text), b"")
    reading = Reading(Path(given.path).parent, given.files)
    reading.add_source(source, data)
    return reading.draft(draft_arrangement(reading, nodes(source), "flat"), source.name)


def read_machine(reading: Reading, path: Path, at: Scalar) -> MachineDraft | Unreadable:
    text = reading.files.get(str(path))
    source, data = read_named(path, mark(at), "machine") if text is None else (Source(str(path), text), b"")
    reading.add_source(source, data)
    return draft_machine(reading, nodes(source))


# ---------------------------------------------------------------- the writer


def lines_of(value: Any, *keys: str) -> Iterator[str]:
    entries: Any = value.items() if isinstance(value, Mapping) else enumerate(value)
    for key, inner in entries:
        place = (*keys, str(key))
        if isinstance(inner, str | int):
            yield f"{'.'.join(place)} = {str(inner).replace(chr(10), NEWLINE)}"
        else:
            yield from lines_of(inner, *place)


def text_of(document: Mapping[str, object]) -> str:
    return "".join(f"{line}\n" for line in lines_of(document))


def machine_text(machine: NewMachine) -> str:
    states = [
        {
            "name": state.name,
            **{k: text if isinstance(text, str) else "\n".join(text) for k, text in state.actions.items() if text},
            "transitions": [{"when": guard, "to": target} for guard, target in state.transitions],
            **({"stays": "true"} if state.stays else {}),
        }
        for state in machine.states
    ]
    document = {"machine": machine.name, "parameters": machine.parameters, "variables": machine.variables}
    return "".join(f"# {line}\n" for line in machine.comments) + text_of({**document, "states": states})


class FlatEditor:
    """Lines are replaced, added and taken out; comments and all other lines stay."""

    def __init__(self, source: Source) -> None:
        self.edits = Edits(source)
        self._known = {line[1]: line[2] for line in LINE.finditer(source.text)}
        self._new: dict[str, list[str]] = {}
        self._renamed: dict[str, str] = {}
        self._swapped: dict[str, str] = {}

    def _below(self, *keys: str) -> list[str]:
        place = ".".join(keys)
        return [key for key in self._known if key == place or key.startswith(f"{place}.")]

    def has(self, *keys: str) -> bool:
        return bool(self._below(*keys))

    def text(self, *keys: str) -> str | None:
        return self._known.get(".".join(keys))

    def names(self, *keys: str) -> tuple[str, ...]:
        return tuple(dict.fromkeys(key.split(".")[len(keys)] for key in self._below(*keys)))

    def put(self, keys: tuple[str, ...], value: Any) -> None:
        self._new[".".join(keys)] = list(lines_of({keys[-1]: value}, *keys[:-1]))

    def remove(self, key: str) -> None:
        self._new[key] = []

    def rename(self, key: str, name: str) -> None:
        self._renamed[key] = name

    def swap(self, keys: tuple[str, ...], others: Mapping[str, str]) -> None:
        self._swapped |= {key: others[self._known[key]] for key in self._below(*keys) if self._known[key] in others}

    def append(self, keys: tuple[str, ...], item: str) -> None:
        added = sum(key.startswith(".".join(keys)) for key in self._new)
        self.put((*keys, str(len(self._below(*keys)) + added)), item)

    def result(self) -> str:
        kept = []
        for line in self.edits.result().splitlines():
            key = line.split(" = ")[0]
            if any(key == place or key.startswith(f"{place}.") for place in self._new):
                continue
            kept.append(f"{key} = {self._swapped[key]}" if key in self._swapped else line)
        lines = [*kept, *(line for new in self._new.values() for line in new)]
        for key, name in self._renamed.items():
            lines = [re.sub(rf"^{key}\b", name, line) for line in lines]
        return "\n".join(lines) + "\n"


WRITER = Writer(text_of, machine_text, FlatEditor)


@pytest.fixture(autouse=True)
def flat(monkeypatch: pytest.MonkeyPatch) -> None:
    """The format is there beside the others."""
    for module, kind, place in (
        (formats, "ARRANGEMENTS", "read_arrangement"),
        (formats, "WRITERS", "WRITER"),
        (machine_formats, "MACHINES", "read_machine"),
    ):
        registry: Registry[object] = getattr(module, kind)
        entries = [*registry.values(), Entry("flat", f"{__name__}:{place}", "flat", (".flat",))]
        monkeypatch.setattr(module, kind, Registry(registry.kind, entries))


# ---------------------------------------------------------------- the tests

DOCUMENT: dict[str, Any] = {
    "name": "flat",
    "cycle_ms": 10,
    "whiteboard": {
        "go": {"type": "bool", "role": "input"},
        "speed": {"type": "0..9", "init": "0", "role": "output"},
    },
    "machines": {
        "driver": {"file": "driver.flat", "parameters": {"out": "speed"}},
        "other": {
            "inline": {
                "machine": "Other",
                "states": [{"name": "A", "internal": "if (go)\n  speed = 2;", "stays": "true"}],
            }
        },
    },
    "schedule": ["driver", "other"],
    "operators": {"write": ["speed"]},
}
DRIVER = {
    "machine": "Driver",
    "parameters": {"out": {"whiteboard": "0..9"}},
    "states": [{"name": "S", "internal": "out = go ? 9 : 1;", "stays": "true"}],
}


def written_flat(folder: Path) -> Path:
    (folder / "driver.flat").write_text(text_of(DRIVER))
    path = folder / "a.flat"
    path.write_text(f"# driven by hand\n{text_of(DOCUMENT)}# the end\n")
    return path


@pytest.mark.parametrize("access", [{}, {"levels": ["low", "high"], "write": {"speed": "low"}}], ids=["free", "levels"])
def test_an_arrangement_is_guarded_in_its_own_format(tmp_path: Path, access: dict[str, Any]) -> None:
    path = written_flat(tmp_path)
    path.write_text(path.read_text() + text_of({"access": access} if access else {}))
    inline = {**DOCUMENT["machines"], "driver": {"inline": DRIVER, "parameters": {"out": "speed"}}}
    other = tmp_path / "a.yaml"
    llfsm_verify.build(**DOCUMENT | {"machines": inline} | ({"access": access} if access else {})).write(other)
    made = []
    for given in (path, other):
        found, lines = guarded(
            given, ["calm: G speed <= 3"], {"speed": "0"}, until="after(0)", reactions=["suspend other"]
        )
        assert proved(found, lines).exit_code == 0
        made.append(found)
    ours, theirs = made
    assert list(ours.files) == ["a.flat", "monitor.machine.flat", "switch.machine.flat", "driver.flat"]
    main = ours.files["a.flat"].splitlines()
    assert main[0] == "# driven by hand" and "# the end" in main and "operators.write.0 = speed_requested" in main
    assert "machine = Driver" in ours.files["driver.flat"] and ours.names == replace(
        theirs.names, rights=ours.names.rights
    )
    for one, same in zip(ours.arrangement.machines, theirs.arrangement.machines, strict=True):
        assert [(s.name, [t.text for t in s.transitions]) for s in one.states] == [
            (s.name, [t.text for t in s.transitions]) for s in same.states
        ]


def test_a_model_is_written_in_it(tmp_path: Path) -> None:
    written_flat(tmp_path)
    machines = DOCUMENT["machines"] | {
        "driver": {"file": str(tmp_path / "driver.flat"), "parameters": {"out": "speed"}}
    }
    llfsm_verify.build(**DOCUMENT | {"machines": machines}).write(tmp_path / "b.flat")
    assert (tmp_path / "b.flat").read_text() == text_of(DOCUMENT)
    assert llfsm_verify.load(tmp_path / "b.flat").machines == llfsm_verify.load(tmp_path / "a.flat").machines


def test_a_format_that_can_only_be_read_is_not_guarded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(formats, "WRITERS", Registry(formats.WRITERS.kind, [formats.WRITERS["yaml"]]))
    with pytest.raises(DiagnosticError, match="there is no writer of arrangements `flat`") as caught:
        guarded(written_flat(tmp_path), ["calm: G speed <= 3"], {"speed": "0"})
    assert caught.value.diagnostics[0].code == "E438"
