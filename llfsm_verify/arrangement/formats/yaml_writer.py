"""Arrangements and machines as YAML text, which reads back as the same words.

In a text that is edited, entries and items are added in the style that is there, and the rest stays as it is.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from decimal import Decimal

import yaml

from llfsm_verify.arrangement.formats.writing import Edits, NewMachine, NewState, Uneditable, Value, Writer
from llfsm_verify.diagnostics import Source, Span

_PLAIN = re.compile(r"[A-Za-z_][\w./-]*|-?\d[\d.]*(\.\.-?\d[\d.]*)?", re.ASCII)
"""What needs no quotes: words, paths, numbers and ranges."""
_COMMANDS = re.compile(r"[A-Za-z_][\w(); ]*", re.ASCII)


class Document:
    """A text in YAML whose root is a mapping, as an `Editor`. Uneditable: it has aliases."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.edits = Edits(source)
        self._begun: set[int] = set()
        """Where collections begin that were empty, and are not any more."""
        for event in yaml.parse(source.text, Loader=yaml.SafeLoader):
            if isinstance(event, yaml.AliasEvent):
                assert event.start_mark is not None
                assert event.end_mark is not None
                span = Span(source, event.start_mark.index, event.end_mark.index)
                message = f"`{span.text}` repeats another part of the file, so the two cannot be changed separately"
                raise Uneditable(message, span, "write it out")
        root = yaml.compose(source.text, Loader=yaml.SafeLoader)
        assert isinstance(root, yaml.MappingNode)
        self.root = root

    def _get(self, *keys: str) -> yaml.Node | None:
        node: yaml.Node | None = self.root
        for key in keys:
            entries = node.value if isinstance(node, yaml.MappingNode) else ()
            node = next((value for name, value in entries if name.value == key), None)
        return node

    def has(self, *keys: str) -> bool:
        """See `Editor`, as for all of these."""
        return self._get(*keys) is not None

    def text(self, *keys: str) -> str | None:
        node = self._get(*keys)
        return str(node.value) if isinstance(node, yaml.ScalarNode) else None

    def names(self, *keys: str) -> tuple[str, ...]:
        node = self._get(*keys)
        return tuple(str(key.value) for key, _ in node.value) if isinstance(node, yaml.MappingNode) else ()

    def put(self, keys: tuple[str, ...], value: Value) -> None:
        there = self._get(*keys)
        if there is not None:
            self.edits.replace(there.start_mark.index, _end(there), _inline(value))
            return
        node = self._get(*keys[:-1])
        assert isinstance(node, yaml.MappingNode)
        self._add(node, keys[-1], value)

    def remove(self, key: str) -> None:
        entries = self.root.value
        at = next((i for i, (name, _) in enumerate(entries) if name.value == key), None)
        if at is None or len(entries) == 1:
            return
        after = entries[at + 1][0].start_mark.index if at + 1 < len(entries) else _end(entries[at][1])
        self.edits.replace(entries[at][0].start_mark.index, after, "")

    def rename(self, key: str, name: str) -> None:
        node = next(node for node, _ in self.root.value if node.value == key)
        self.edits.replace(node.start_mark.index, _end(node), name)

    def swap(self, keys: tuple[str, ...], others: Mapping[str, str]) -> None:
        node = self._get(*keys)
        for item in node.value if isinstance(node, yaml.SequenceNode) else ():
            if item.value in others:
                self.edits.replace(item.start_mark.index, item.end_mark.index, others[item.value])

    def append(self, keys: tuple[str, ...], item: str) -> None:
        node = self._get(*keys)
        assert isinstance(node, yaml.SequenceNode)
        if node.flow_style or not node.value:
            self._add_inflow(node, node.value[-1] if node.value else None, item)
        else:
            first = node.value[0].start_mark
            dash = self.source.text.rfind("-", 0, first.index)
            column = dash - (self.source.text.rfind("\n", 0, dash) + 1)
            self._add_line(node.value[-1], " " * column + f"- {item}", 2 * column + 1)

    def result(self) -> str:
        return self.edits.result()

    def _add(self, node: yaml.MappingNode, key: str, value: Value) -> None:
        """A mapping of collections gets a line for each entry of its own where it is added to the root."""
        if node.flow_style or not node.value:
            self._add_inflow(node, node.value[-1][1] if node.value else None, f"{key}: {_inline(value)}")
            return
        column = node.value[0][0].start_mark.column
        indent = " " * column
        lines = [f"{indent}{key}: {_inline(value)}"]
        if node is self.root and isinstance(value, Mapping) and not all(isinstance(v, str) for v in value.values()):
            lines = [f"{indent}{key}:", *(f"{indent}  {name}: {_inline(inner)}" for name, inner in value.items())]
        self._add_line(node.value[-1][1], "\n".join(lines), 2 * column)

    def _add_inflow(self, node: yaml.Node, last: yaml.Node | None, text: str) -> None:
        at = node.start_mark.index + 1 if last is None else _end(last)
        first = last is None and at not in self._begun
        self._begun.add(at)
        self.edits.replace(at, at, text if first else f", {text}")

    def _add_line(self, last: yaml.Node, line: str, depth: int) -> None:
        """A line after the one on which `last` ends. A list may be as far to the left as the key above it."""
        text, end = self.source.text, _end(last)
        if not text[:end].endswith("\n"):
            line_end = text.find("\n", end)
            end = len(text) if line_end < 0 else line_end
        else:  # a text in several lines, which ends where the next thing begins
            end = len(text[:end].rstrip())
        self.edits.replace(end, end, "\n" + line, depth=depth)


def _end(node: yaml.Node) -> int:
    """Where the text of a node ends. The parser ends what is indented only where the next thing begins."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        node = node.value[-1][1] if isinstance(node, yaml.MappingNode) else node.value[-1]
    return int(node.end_mark.index)


def _inline(value: Value) -> str:
    """A value on one line."""
    if isinstance(value, str):
        return value if _PLAIN.fullmatch(value) else json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {_inline(inner)}" for name, inner in value.items()) + "}"
    return "[" + ", ".join(map(_inline, value)) + "]"


def machine_text(machine: NewMachine) -> str:
    """The text of a machine file."""
    lines = [*(f"# {line}" for line in machine.comments), f"machine: {machine.name}"]
    for key, entries in (("parameters", machine.parameters), ("variables", machine.variables)):
        notes = machine.notes if key == "variables" else {}
        lines += [f"{key}:"] if entries else []
        lines += [
            f"  {name}: {_inline(v)}{f' # {notes[name]}' if name in notes else ''}" for name, v in entries.items()
        ]
    named = {"initial": machine.initial, "suspend": machine.suspend}
    lines += [f"{key}: {name}" for key, name in named.items() if name is not None]
    return "\n".join([*lines, "states:", *(line for state in machine.states for line in _state(state))]) + "\n"


def _state(state: NewState) -> list[str]:
    lines = [f"  - name: {state.name}"]
    for kind, action in state.actions.items():
        if isinstance(action, str):
            lines.append(f"    {kind}: {action if _COMMANDS.fullmatch(action) else _inline(action)}")
        elif action:
            lines += [f"    {kind}: |", *(f"      {line}" for line in action)]
    lines += [f"    runs: {_inline(state.runs)}"] if state.runs else []
    items = [_inline({"when": guard, "to": target}) for guard, target in state.transitions]
    if items and state.brief:
        lines.append(f"    transitions: [{', '.join(items)}]")
    elif items:
        lines += ["    transitions:", *(f"      - {item}" for item in items)]
    return [*lines, "    stays: true"] if state.stays else lines


def to_yaml(document: Mapping[str, object]) -> str:
    """A document of Python values in the shape of a file, as `build_arrangement` takes it."""
    return yaml.dump(_plain(document), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)


class _Dumper(yaml.SafeDumper):
    """Texts of several lines are blocks, and nothing is an alias."""

    def ignore_aliases(self, data: object) -> bool:  # noqa: ARG002 - the same value may stand in several places
        return True

    def represent_str(self, data: str) -> yaml.ScalarNode:
        return self.represent_scalar("tag:yaml.org,2002:str", data, style="|" if "\n" in data else None)


_Dumper.add_representer(str, _Dumper.represent_str)


def _plain(value: object) -> object:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    if isinstance(value, bool | int) or value is None:
        return value
    return f"{Decimal(str(value)):f}" if isinstance(value, float | Decimal) else str(value)


WRITER = Writer(to_yaml, machine_text, Document)
