"""YAML as nodes: composed from the event stream, with size, depth, aliases and tags limited on the way.

Every scalar is a string, typed later by its position, so ``ON``, ``no`` and ``1:30`` are texts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import yaml

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Source, Span
from llfsm_verify.yaml import nodes
from llfsm_verify.yaml.nodes import Mapping, Node, Scalar, Sequence
from llfsm_verify.yaml.traps import eaten, explain, suspect
from llfsm_verify.yaml.vocabulary import PLAIN, Vocabulary


@dataclass(frozen=True, slots=True)
class YamlScalar(Scalar):
    """A scalar, and how it is written."""

    plain: bool
    """Without quotes."""
    anchored: bool
    size: int = 1

    def misread(self, key: str, *, guard: bool) -> Diagnostic | None:
        return eaten(self.span, key, guard=guard) if self.anchored and not self.text else None


@dataclass(frozen=True, slots=True)
class YamlSequence(Sequence):
    """A sequence; `size` counts its nodes, itself too."""

    size: int

    def misread(self, key: str, *, guard: bool) -> Diagnostic | None:
        return eaten(self.span, key, guard=guard)


@dataclass(frozen=True, slots=True)
class YamlMapping(Mapping):
    """A mapping; `flow` where it stands in braces, `size` as of a sequence."""

    flow: bool
    size: int

    def misread(self, key: str, *, guard: bool) -> Diagnostic | None:
        return eaten(self.span, key, guard=guard)

    def split(self, before: tuple[str, Node], key: Scalar, value: Node, *, guard: bool) -> Diagnostic | None:
        last, node = before
        if self.flow and _is_plain(key) and _is_plain(value) and not _text(value):
            return eaten(Span(key.span.source, node.span.start, key.span.end), last, guard=guard)
        return None


YamlNode = YamlScalar | YamlSequence | YamlMapping


def _is_plain(node: Node) -> bool:
    return isinstance(node, YamlScalar) and node.plain


def _text(node: Node) -> str:
    return node.text if isinstance(node, Scalar) else ""


class _Composer:
    def __init__(
        self, source: Source, events: Iterator[yaml.Event], diagnostics: list[Diagnostic], vocabulary: Vocabulary
    ) -> None:
        self.vocabulary = vocabulary
        self.source = source
        self.events = events
        self.diagnostics = diagnostics
        self.anchors: dict[str, YamlNode | None] = {}
        self.total = 0

    def fail(self, code: str, message: str, span: Span, hint: str | None = None) -> DiagnosticError:
        return DiagnosticError(
            [*self.diagnostics, Diagnostic(code, message, span, hint=hint or self.vocabulary.hints.get(code))]
        )

    def span(self, event: yaml.Event) -> Span:
        start = _index(event.start_mark)
        end = max(_index(event.end_mark), start)
        return Span(self.source, start, end)

    def count(self, size: int, span: Span) -> None:
        self.total += size
        if self.total > nodes.MAX_NODES:
            raise self.fail("E013", f"the file has more than {nodes.MAX_NODES:,} values, aliases counted", span)

    def document(self) -> YamlNode | None:
        """The one document of the stream, None when it is empty."""
        root: YamlNode | None = None
        for event in self.events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    raise self.fail("E014", "there is a second document", self.span(event), "remove the line `---`")
                root = self.node(next(self.events), 1)
        return root

    def node(self, event: yaml.Event, depth: int) -> YamlNode:
        span = self.span(event)
        if depth > nodes.MAX_DEPTH:
            place = Span(self.source, span.start, span.start + 1)
            raise self.fail("E012", f"values are nested more than {nodes.MAX_DEPTH} deep", place)
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
        node: YamlNode
        if isinstance(event, yaml.ScalarEvent):
            fragment = scalar_fragment(self.source, span.start, span.end, event.style, str(event.value))
            if event.style is None or event.style == "":
                span = Span(self.source, fragment.offsets[0], fragment.offsets[-1]) if fragment.text else span
            node = YamlScalar(fragment, span, not event.style, anchor is not None)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self.sequence(span, depth)
        else:
            assert isinstance(event, yaml.MappingStartEvent)
            node = self.mapping(span, bool(event.flow_style), depth)
        if anchor is not None:
            self.anchors[anchor] = node
        return node

    def alias(self, event: yaml.AliasEvent, span: Span) -> YamlNode:
        name = str(event.anchor)
        target = self.anchors.get(name)
        if target is None:
            trap = suspect(self.source, span.start, self.vocabulary)
            if trap is not None:
                raise DiagnosticError([*self.diagnostics, eaten(*trap, guard=trap[1] in self.vocabulary.guards)])
            what = "is inside its own anchor" if name in self.anchors else "has no anchor before it"
            raise self.fail(
                "E015", f"the alias `*{name}` {what}", span, "quote the value if it is not meant as an alias"
            )
        self.count(target.size, span)
        return target

    def tag(self, tag: str, span: Span) -> None:
        """A tag is an error; the value after it is read as if there were none, so that more errors are found."""
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

    def sequence(self, span: Span, depth: int) -> YamlSequence:
        items: list[YamlNode] = []
        for event in self.events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            items.append(self.node(event, depth + 1))
        return YamlSequence(tuple(items), span, 1 + sum(i.size for i in items))

    def mapping(self, span: Span, flow: bool, depth: int) -> YamlMapping:
        items: list[tuple[YamlScalar, YamlNode]] = []
        seen: dict[str, YamlScalar] = {}
        for event in self.events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            key = self.node(event, depth + 1)
            value = self.node(next(self.events), depth + 1)
            if not isinstance(key, YamlScalar):
                self.diagnostics.append(Diagnostic("E018", "a key must be a word", key.span, hint="quote it"))
            elif key.text in seen:
                note = f"the first one is at line {seen[key.text].span.line}"
                self.diagnostics.append(
                    Diagnostic(
                        "E017", f"the key `{key.text}` appears twice", key.span, (note,), self.vocabulary.hints["E017"]
                    )
                )
            else:
                seen[key.text] = key
                items.append((key, value))
        return YamlMapping(tuple(items), span, flow, 1 + sum(k.size + v.size for k, v in items))


def _index(mark: object) -> int:
    return int(getattr(mark, "index", 0))


def compose(
    source: Source, diagnostics: list[Diagnostic], vocabulary: Vocabulary = PLAIN, *, pure: bool = False
) -> YamlNode:
    """The value in `source`; what is wrong but can be read past is appended to `diagnostics`.

    Advice is given in the words of `vocabulary`.

    `pure` uses the YAML parser written in Python even when the faster one is there. Raises DiagnosticError when the
    text is not YAML (E010), empty (E011) or beyond a limit (E012 to E014).
    """
    before = len(diagnostics)
    loader = yaml.SafeLoader if pure else getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        root = _Composer(source, iter(yaml.parse(source.text, Loader=loader)), diagnostics, vocabulary).document()
    except yaml.YAMLError as e:
        if not pure and "nesting depth" in str(getattr(e, "problem", "")):
            # libyaml 0.2.6 looks ahead, and gives up before it has told where our own limit is passed.
            del diagnostics[before:]
            return compose(source, diagnostics, vocabulary, pure=True)
        raise DiagnosticError([*diagnostics, explain(source, e, vocabulary)]) from None
    if root is None:
        raise DiagnosticError(
            [*diagnostics, Diagnostic("E011", "the file is empty", hint=vocabulary.hints["E011"], file=source.name)]
        )
    return root


_WHITE = " \t\r\n\x85\u2028\u2029"
_ESCAPE_LENGTHS = {"x": 4, "u": 6, "U": 10}
_MAX_ALIGNED = 1 << 17
"""Characters of a scalar whose places are found; a longer one is refused as too long, at its first character."""

_ANCHOR = re.compile(r"&[^\s,\[\]{}]+\s+")


def scalar_fragment(source: Source, start: int, end: int, style: str | None, value: str) -> Fragment:
    """The fragment of the scalar `value`, written as source[start:end] in YAML's `style` (None: plain)."""
    text = source.text
    anchor = _ANCHOR.match(text, start, end)
    if anchor is not None:
        start = anchor.end()
    if style in ("'", '"'):
        start += 1
        end -= 1
    elif style in ("|", ">"):
        newline = text.find("\n", start, end)
        start = end if newline < 0 else newline + 1
    if text[start : start + len(value)] == value and (style is None or end - start == len(value)):
        return Fragment(value, source, range(start, start + len(value) + 1))
    offsets = _align(text, start, end, style, value[:_MAX_ALIGNED])
    offsets += [offsets[-1]] * (len(value) - _MAX_ALIGNED)
    return Fragment(value, source, tuple(offsets))


def _align(text: str, start: int, end: int, style: str | None, value: str) -> list[int]:
    """The offset of each character of `value`, and the one after the last: whitespace may have been folded or
    stripped, everything else stands in the text as it is or as an escape."""
    offsets: list[int] = []
    at = start
    for character in value:
        if character not in _WHITE:
            at = _skip_white(text, at, end)
        if style == '"':
            while text.startswith("\\", at) and at + 1 < end and text[at + 1] in "\r\n":
                at = _skip_white(text, at + 1, end)
            if text.startswith("\\", at):
                offsets.append(at)
                at += _ESCAPE_LENGTHS.get(text[at + 1 : at + 2], 2)
                continue
        offsets.append(min(at, end))
        if at < end and text[at] == character:
            at += 2 if style == "'" and character == "'" else 1
        elif character == "\n" and text.startswith("\r\n", at):
            at += 2
    last = offsets[-1] + 1 if offsets else start
    offsets.append(min(max(last, start), len(text)))
    return offsets


def _skip_white(text: str, at: int, end: int) -> int:
    while at < end and text[at] in _WHITE:
        at += 1
    return at
