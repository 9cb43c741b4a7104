"""Edits of texts in YAML: entries and items are added in the style that is there, and all else stays as it is."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping

import yaml

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.guarding.codes import UNFIT

Tree = str | Mapping[str, str]
"""What is added under a key: a text as it stands, or texts under keys of their own."""


class Edits:
    """Replacements in one text."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self._parts: list[tuple[int, int, int, str]] = []

    def replace(self, start: int, end: int, text: str, *, depth: int = 0) -> None:
        """The characters from `start` to `end` become `text`; saying the same twice is saying it once. Of insertions at
        one place the deepest comes first."""
        part = (start, end, -depth, text)
        if start == end or part not in self._parts:
            self._parts.append(part)

    def result(self) -> str:
        """The text with all edits; insertions at one place and of one depth stay in their order."""
        text, at = [], 0
        for start, end, _, new in sorted(self._parts, key=lambda part: part[:3]):
            assert start >= at, "edits overlap"
            text += [self.source.text[at:start], new]
            at = end
        return "".join([*text, self.source.text[at:]])


class Document:
    """A text in YAML whose root is a mapping, and the edits of it. DiagnosticError: it has aliases."""

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
                raise DiagnosticError(Diagnostic(UNFIT, message, span, hint="write it out"))
        root = yaml.compose(source.text, Loader=yaml.SafeLoader)
        assert isinstance(root, yaml.MappingNode)
        self.root = root

    def get(self, *keys: str) -> yaml.Node | None:
        """The value under keys that lead inwards from the root; None: it is not there."""
        node: yaml.Node | None = self.root
        for key in keys:
            entries = node.value if isinstance(node, yaml.MappingNode) else ()
            node = next((value for name, value in entries if name.value == key), None)
        return node

    def text(self, *keys: str) -> str | None:
        """The single value under keys; None: nothing is there."""
        node = self.get(*keys)
        return str(node.value) if isinstance(node, yaml.ScalarNode) else None

    def names(self, *keys: str) -> tuple[str, ...]:
        """The keys of the mapping under keys; no keys where it is missing."""
        node = self.get(*keys)
        return tuple(str(key.value) for key, _ in node.value) if isinstance(node, yaml.MappingNode) else ()

    def put(self, keys: tuple[str, ...], value: Tree) -> None:
        """Set the last of the keys, which lead inwards from the root, to `value`; those before it are there."""
        there = self.get(*keys)
        if there is not None:
            assert isinstance(value, str)
            self.edits.replace(there.start_mark.index, _end(there), value)
            return
        node = self.get(*keys[:-1])
        assert isinstance(node, yaml.MappingNode)
        self._add(node, keys[-1], value)

    def put_all(self, keys: tuple[str, ...], entries: Mapping[str, str]) -> None:
        """The same for entries of a mapping, which is added where it is not there."""
        if self.get(*keys) is None:
            self.put(keys, flow(entries))
        else:
            for name, value in entries.items():
                self.put((*keys, name), value)

    def remove(self, key: str) -> None:
        """Take an entry of the root out, if it is there and not the only one."""
        entries = self.root.value
        at = next((i for i, (name, _) in enumerate(entries) if name.value == key), None)
        if at is None or len(entries) == 1:
            return
        behind = entries[at + 1][0].start_mark.index if at + 1 < len(entries) else _end(entries[at][1])
        self.edits.replace(entries[at][0].start_mark.index, behind, "")

    def rename(self, key: str, name: str) -> None:
        """Another key for an entry of the root."""
        node = next(node for node, _ in self.root.value if node.value == key)
        self.edits.replace(node.start_mark.index, _end(node), name)

    def swap(self, keys: tuple[str, ...], others: Mapping[str, str]) -> None:
        """Write other words for those of the list under keys that have one; nothing where there is no list."""
        node = self.get(*keys)
        for item in node.value if isinstance(node, yaml.SequenceNode) else ():
            if item.value in others:
                self.edits.replace(item.start_mark.index, item.end_mark.index, others[item.value])

    def append(self, keys: tuple[str, ...], item: str) -> None:
        """Add an item at the end of the list under keys, which is there."""
        node = self.get(*keys)
        assert isinstance(node, yaml.SequenceNode)
        if node.flow_style or not node.value:
            self._add_inflow(node, node.value[-1] if node.value else None, item)
        else:
            first = node.value[0].start_mark
            dash = self.source.text.rfind("-", 0, first.index)
            column = dash - (self.source.text.rfind("\n", 0, dash) + 1)
            self._add_line(node.value[-1], " " * column + f"- {item}", 2 * column + 1)

    def _add(self, node: yaml.MappingNode, key: str, value: Tree) -> None:
        if node.flow_style or not node.value:
            text = f"{key}: {value if isinstance(value, str) else flow(value)}"
            self._add_inflow(node, node.value[-1][1] if node.value else None, text)
            return
        column = node.value[0][0].start_mark.column
        indent = " " * column
        lines = [f"{indent}{key}: {value}"] if isinstance(value, str) else [f"{indent}{key}:"]
        if not isinstance(value, str):
            lines += [f"{indent}  {name}: {text}" for name, text in value.items()]
        self._add_line(node.value[-1][1], "\n".join(lines), 2 * column)

    def _add_inflow(self, node: yaml.Node, last: yaml.Node | None, text: str) -> None:
        at = node.start_mark.index + 1 if last is None else _end(last)
        first = last is None and at not in self._begun
        self._begun.add(at)
        self.edits.replace(at, at, text if first else f", {text}")

    def _add_line(self, last: yaml.Node, line: str, depth: int) -> None:
        """A line behind the one on which `last` ends. A list may be as far to the left as the key above it."""
        text, end = self.source.text, _end(last)
        if not text[:end].endswith("\n"):
            behind = text.find("\n", end)
            end = len(text) if behind < 0 else behind
        else:  # a text in several lines, which ends where the next thing begins
            end = len(text[:end].rstrip())
        self.edits.replace(end, end, "\n" + line, depth=depth)


def _end(node: yaml.Node) -> int:
    """Where the text of a node ends. The parser ends what is indented only where the next thing begins."""
    while isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        node = node.value[-1][1] if isinstance(node, yaml.MappingNode) else node.value[-1]
    return int(node.end_mark.index)


def flow(value: Mapping[str, str]) -> str:
    """A mapping on one line."""
    return "{" + ", ".join(f"{name}: {text}" for name, text in value.items()) + "}"


def quoted(text: str) -> str:
    """A text as one value in YAML, with quotes where it needs them."""
    return text if re.fullmatch(r"[A-Za-z_][\w./-]*", text, re.ASCII) else json.dumps(text, ensure_ascii=False)
