"""What is written, in the shapes that notations share: single values, lists and mappings, each with its place.

A format may have more to say of them, by classes of its own (`compose.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify.diagnostics import Diagnostic, Fragment, Source, Span

MAX_DEPTH = 64
MAX_NODES = 100_000
"""Nodes of one file, those that aliases repeat counted each time."""


class _Written:
    __slots__ = ()

    def misread(self, key: str, *, guard: bool) -> Diagnostic | None:  # noqa: ARG002 - a format may have something to say
        """What to say where a guard or an action is expected under `key`, and this is not what its author wrote."""
        return None


@dataclass(frozen=True, slots=True)
class Scalar(_Written):
    """One word, number or text."""

    fragment: Fragment
    span: Span
    """What to mark of it: with its quotes, where it has some."""

    @property
    def text(self) -> str:
        return self.fragment.text


@dataclass(frozen=True, slots=True)
class Sequence(_Written):
    """A list."""

    items: tuple[Node, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class Mapping(_Written):
    """Its keys are different words."""

    items: tuple[tuple[Scalar, Node], ...]
    span: Span

    def split(
        self,
        before: tuple[str, Node],  # noqa: ARG002 - as above
        key: Scalar,  # noqa: ARG002
        value: Node,  # noqa: ARG002
        *,
        guard: bool,  # noqa: ARG002
    ) -> Diagnostic | None:
        """What to say of an unknown `key` that the expression in the entry `before` it was split into."""
        return None


Node = Scalar | Sequence | Mapping


def written(source: Source, start: int, end: int) -> Scalar:
    """The characters `start` to `end` (end not included) of a source, as they stand there."""
    return Scalar(Fragment(source.text[start:end], source, range(start, end + 1)), Span(source, start, end))


def implied(text: str, at: Span) -> Scalar:
    """A text that does not stand in the file in these words: what is said of any part of it marks the place `at`."""
    offsets = (*[at.start] * len(text), at.start)
    return Scalar(Fragment(text, at.source, offsets), at)


def mark(node: Node) -> Span:
    """The place to mark for a node: at least one character."""
    span = node.span
    if span.end > span.start:
        return span
    return Span(span.source, span.start, span.start + 1)
