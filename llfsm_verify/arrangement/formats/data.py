"""Documents from Python values in the shape of the file; places are paths in the data, such as `machines.m.inline`."""

from __future__ import annotations

import re
from collections.abc import Mapping as MappingABC
from decimal import Decimal
from pathlib import Path

from llfsm_verify.arrangement.draft import UNREADABLE, Draft
from llfsm_verify.arrangement.formats.documents import draft_arrangement
from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.diagnostics import DataSource, Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.yaml import nodes
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence

NAME = "<document>"
_PLAIN_KEY = re.compile(r"\w+\Z")
_SURROGATE = re.compile("[\ud800-\udfff]")


def draft_data(document: MappingABC[str, object]) -> Draft:
    """The draft of an arrangement in Python values; machine files are looked up from the current directory."""
    reading = Reading(Path())
    try:
        root, source = node_of_data(document, reading.diagnostics)
    except DiagnosticError as e:
        reading.add(e)
        return reading.draft(UNREADABLE, NAME)
    reading.add_source(source, _digested(source))
    return reading.draft(draft_arrangement(reading, root, "arrangement"), NAME)


def node_of_data(
    document: MappingABC[str, object], diagnostics: list[Diagnostic], name: str = NAME
) -> tuple[Node, DataSource]:
    """Python values as nodes of a document called `name`; what can be read past is appended to `diagnostics`.

    DiagnosticError: it is beyond a limit (E012, E013), or holds no text (E005).
    """
    source = DataSource(name)
    composer = _Composer(source)
    root = composer.node(document, "", 1)
    source.close()
    diagnostics += composer.diagnostics
    return root, source


def _digested(source: DataSource) -> bytes:
    """All that stands in the data and where, different for different data."""
    pieces = (f"{len(path)} {path} {len(text)} {text}\n" for path, text in source.pieces)
    return "".join(pieces).encode("utf-8", "surrogatepass")


class _Composer:
    """Makes nodes of values, and their texts a source."""

    def __init__(self, source: DataSource) -> None:
        self.source = source
        self.diagnostics: list[Diagnostic] = []
        self.total = 0

    def fail(self, code: str, message: str, span: Span, hint: str) -> DiagnosticError:
        self.source.close()
        return DiagnosticError(Diagnostic(code, message, span, hint=hint))

    def node(self, value: object, path: str, depth: int) -> Node:
        self.total += 1
        if depth > nodes.MAX_DEPTH or self.total > nodes.MAX_NODES:
            start = self.source.add(path or NAME)
            span = Span(self.source, start, start + 1)
            if depth > nodes.MAX_DEPTH:
                raise self.fail(
                    "E012", f"values are nested more than {nodes.MAX_DEPTH} deep", span, "use fewer levels of nesting"
                )
            raise self.fail("E013", f"the data has more than {nodes.MAX_NODES:,} values", span, "write fewer values")
        if isinstance(value, MappingABC):
            return self.mapping(value, path, depth)
        if isinstance(value, list | tuple):
            start = self.source.add(path or NAME)
            items = tuple(self.node(item, f"{path}[{i}]", depth + 1) for i, item in enumerate(value))
            return Sequence(items, Span(self.source, start, items[-1].span.end if items else start))
        if isinstance(value, bool):
            return self.scalar("true" if value else "false", path)
        if isinstance(value, float | Decimal):
            return self.scalar(f"{Decimal(str(value)):f}", path)  # never with an exponent
        return self.scalar("" if value is None else str(value), path)

    def mapping(self, value: MappingABC[object, object], path: str, depth: int) -> Mapping:
        start = self.source.add(path or NAME)
        entries: dict[str, tuple[Scalar, Node]] = {}
        end = start
        for key, item in value.items():
            word = str(key)
            inner = f"{path}.{word}" if path else word
            if not _PLAIN_KEY.match(word):
                inner = f"{path}[{word!r}]"
            name = self.scalar(word, inner)
            if word in entries:
                message = f"the key `{word}` appears twice"
                self.diagnostics.append(Diagnostic("E017", message, name.span, hint="remove one of them"))
                continue
            entries[word] = (name, self.node(item, inner, depth + 1))
            end = entries[word][1].span.end
        return Mapping(tuple(entries.values()), Span(self.source, start, end))

    def scalar(self, text: str, path: str) -> Scalar:
        start = self.source.add(path or NAME, text)
        end = start + len(text)
        span = Span(self.source, start, end)
        if _SURROGATE.search(text):
            raise self.fail("E005", "half of a surrogate pair is not a character", span, "write whole characters")
        return Scalar(Fragment(text, self.source, range(start, end + 1)), span)
