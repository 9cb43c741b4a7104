"""YAML as a tree of strings: composed from the event stream, with size, depth, aliases and tags limited on the way.

Every scalar is a string, typed later by its position, so ``ON``, ``no`` and ``1:30`` stay what they look like.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import yaml

from llfsm_verify.arrangement.codes import HINTS
from llfsm_verify.arrangement.scalars import scalar_fragment
from llfsm_verify.arrangement.traps import eaten, explain, suspect
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source, Span

MAX_DEPTH = 64
MAX_NODES = 100_000
"""Nodes of one file, those that aliases repeat counted each time."""


@dataclass(frozen=True, slots=True)
class Scalar:
    fragment: Fragment
    plain: bool
    anchored: bool
    span: Span
    size: int = 1

    @property
    def text(self) -> str:
        return self.fragment.text


@dataclass(frozen=True, slots=True)
class Sequence:
    items: tuple[Node, ...]
    span: Span
    size: int


@dataclass(frozen=True, slots=True)
class Mapping:
    items: tuple[tuple[Scalar, Node], ...]
    flow: bool
    span: Span
    size: int


Node = Scalar | Sequence | Mapping


class _Composer:
    def __init__(self, source: Source, events: Iterator[yaml.Event], diagnostics: list[Diagnostic]) -> None:
        self.source = source
        self.events = events
        self.diagnostics = diagnostics
        self.anchors: dict[str, Node | None] = {}
        self.total = 0

    def fail(self, code: str, message: str, span: Span, hint: str | None = None) -> DiagnosticError:
        return DiagnosticError([*self.diagnostics, Diagnostic(code, message, span, hint=hint or HINTS.get(code))])

    def span(self, event: yaml.Event) -> Span:
        start = _index(event.start_mark)
        end = max(_index(event.end_mark), start)
        return Span(self.source, start, end)

    def count(self, size: int, span: Span) -> None:
        self.total += size
        if self.total > MAX_NODES:
            raise self.fail("E013", f"the file has more than {MAX_NODES:,} values, aliases counted", span)

    def document(self) -> Node | None:
        """The one document of the stream, None when it is empty."""
        root: Node | None = None
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    raise self.fail("E014", "there is a second document", self.span(event), "remove the line `---`")
                root = self.node(next(self.events), 1)
        return root

    def node(self, event: yaml.Event, depth: int) -> Node:
        span = self.span(event)
        if depth > MAX_DEPTH:
            raise self.fail(
                "E012", f"values are nested more than {MAX_DEPTH} deep", Span(self.source, span.start, span.start + 1)
            )
        if isinstance(event, yaml.AliasEvent):
            return self.alias(event, span)
        self.count(1, span)
        assert isinstance(event, yaml.NodeEvent)
        anchor: str | None = event.anchor
        if anchor is not None:
            self.anchors[anchor] = None
        tag = getattr(event, "tag", None)
        if tag is not None:
            self.tag(str(tag), span)
        node: Node
        if isinstance(event, yaml.ScalarEvent):
            fragment = scalar_fragment(self.source, span.start, span.end, event.style, str(event.value))
            if event.style is None or event.style == "":
                span = Span(self.source, fragment.offsets[0], fragment.offsets[-1]) if fragment.text else span
            node = Scalar(fragment, not event.style, anchor is not None, span)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self.sequence(span, depth)
        else:
            assert isinstance(event, yaml.MappingStartEvent)
            node = self.mapping(span, bool(event.flow_style), depth)
        if anchor is not None:
            self.anchors[anchor] = node
        return node

    def alias(self, event: yaml.AliasEvent, span: Span) -> Node:
        name = str(event.anchor)
        target = self.anchors.get(name)
        if target is None:
            trap = suspect(self.source, span.start)
            if trap is not None:
                raise DiagnosticError([*self.diagnostics, eaten(*trap)])
            what = "stands inside its own anchor" if name in self.anchors else "has no anchor before it"
            raise self.fail(
                "E015", f"the alias `*{name}` {what}", span, "quote the value if it is not meant as an alias"
            )
        self.count(target.size, span)
        return target

    def tag(self, tag: str, span: Span) -> None:
        """A tag is an error; the value behind it is read as if there were none, so that more errors are found."""
        written = self.source.text[span.start : span.end].split("\n", 1)[0].strip() or tag
        word = written.split()[0][:60] if written else tag
        name = word.lstrip("!")
        hint = (
            f"write `not {name}`, or quote the value"
            if name.isidentifier() and not word.startswith("!!")
            else "remove it, or quote the value"
        )
        marked = Span(self.source, span.start, span.start + max(1, len(word)))
        self.diagnostics.append(
            Diagnostic("E016", f"`{word}` is a YAML tag, and tags are not used here", marked, hint=hint)
        )

    def sequence(self, span: Span, depth: int) -> Sequence:
        items: list[Node] = []
        for event in self.events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            items.append(self.node(event, depth + 1))
        return Sequence(tuple(items), span, 1 + sum(i.size for i in items))

    def mapping(self, span: Span, flow: bool, depth: int) -> Mapping:
        items: list[tuple[Scalar, Node]] = []
        seen: dict[str, Scalar] = {}
        for event in self.events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            key = self.node(event, depth + 1)
            value = self.node(next(self.events), depth + 1)
            if not isinstance(key, Scalar):
                self.diagnostics.append(Diagnostic("E018", "a key must be a word", key.span, hint="quote it"))
            elif key.text in seen:
                note = f"the first one is at line {seen[key.text].span.line}"
                self.diagnostics.append(
                    Diagnostic("E017", f"the key `{key.text}` is there twice", key.span, (note,), HINTS["E017"])
                )
            else:
                seen[key.text] = key
                items.append((key, value))
        return Mapping(tuple(items), flow, span, 1 + sum(k.size + v.size for k, v in items))


def _index(mark: object) -> int:
    return int(getattr(mark, "index", 0))


def compose(source: Source, diagnostics: list[Diagnostic], *, pure: bool = False) -> Node:
    """The value in `source`; what is wrong but can be read past is appended to `diagnostics`.

    `pure` uses the YAML parser written in Python even when the faster one is there. Raises DiagnosticError when the
    text is not YAML (E010), empty (E011) or beyond a limit (E012 to E014).
    """
    loader = yaml.SafeLoader if pure else getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        root = _Composer(source, iter(yaml.parse(source.text, Loader=loader)), diagnostics).document()
    except yaml.YAMLError as e:
        raise DiagnosticError([*diagnostics, explain(source, e)]) from None
    if root is None:
        raise DiagnosticError(
            [*diagnostics, Diagnostic("E011", "the file is empty", hint=HINTS["E011"], file=source.name)]
        )
    return root
