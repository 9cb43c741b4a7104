"""Transition files: what stands in them, with its places, and the names that states and outcomes get in the machine.

The machine `sm` has a state for each label and each final outcome. A *ticket* is the number of a stay in a state: its
remainder modulo the number of labels plus one is the label's, and it is another one each time that the state is entered
or gives an outcome, and in each pause. States answer tickets: the inputs `outcome` and `answers` are posted together,
and an outcome counts only where `answers` is the ticket of the moment. So an answer of a state that was left never
counts, unless COUNT entries later, in the same state.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property

import yaml

from llfsm_verify import Diagnostic
from llfsm_verify.extensions.crops.codes import LABEL, NEAR, SHAPE
from llfsm_verify.plug import MappingNode as Mapped
from llfsm_verify.plug import (
    Node,
    Report,
    Scalar,
    Source,
    Span,
    implied,
    is_name,
    mark,
)

COUNT = 8
"""Of tickets for each label, and of those before the first."""
LIKENESS = 0.75
"""How similar to a label (`difflib`) what is no label has to be for a warning."""
COMPARED = 20_000
"""Pairs of texts that are compared in this way, at most: it takes 10 µs."""
FAILED, TIMED_OUT = "failed", "timed out"
TROUBLES = (FAILED, TIMED_OUT)
"""Outcomes that each state may give: it raised an exception, or it took longer than its deadline."""
MACHINE, OUTCOME, ANSWERS, TICKET, NONE = "sm", "outcome", "answers", "ticket", "NONE"
PAUSED = "Paused"
INITIAL = "initial"
_KEYS = ("state_label", "descriptive_name", "transitions")


@dataclass(frozen=True, slots=True)
class Move:
    """A line of `transitions`."""

    outcome: Scalar
    target: Scalar


@dataclass(frozen=True, slots=True)
class Stage:
    """A state of the file."""

    label: Scalar
    about: str
    moves: Mapping[str, Move]
    """By outcomes."""
    at: Span
    """Where its transitions are listed."""

    def target(self, outcome: str) -> str | None:
        """The state that an outcome leads to; None: the file does not say it."""
        return self.moves[outcome].target.text if outcome in self.moves else None


@dataclass(frozen=True)
class Transitions:
    """A transition file."""

    source: Source
    stages: tuple[Stage, ...]
    listed: Span
    """Where the first state begins."""
    initial: Scalar | None = None
    """What an item `initial` says."""

    @property
    def begins(self) -> str:
        """The label of the initial state: the first one, where the file does not say it."""
        return self.stages[0].label.text if self.initial is None else self.initial.text

    def text_with(self, initial: str) -> str:
        """The text of the file, with an item that says in which state it begins; all else is in the same lines."""
        text, written = self.source.text, yaml.safe_dump(initial, default_style='"', allow_unicode=True, width=10**6)
        if self.initial is not None:
            return text[: self.initial.span.start] + written.strip() + text[self.initial.span.end :]
        end = re.search(r"^\.\.\.(?!\S)", text, re.MULTILINE)  # of the document, where something says it
        at, start = len(text) if end is None else end.start(), self.listed.start
        before = text[:at] if text[:at].endswith("\n") else f"{text[:at]}\n"
        return f"{before}{' ' * (start - text.rfind(chr(10), 0, start) - 1)}- {INITIAL}: {written}{text[at:]}"

    @cached_property
    def labels(self) -> Mapping[str, int]:
        """With their numbers, in the order of the file."""
        return {stage.label.text: number for number, stage in enumerate(self.stages)}

    @cached_property
    def abouts(self) -> Mapping[str, str]:
        """Labels by their descriptive names: of several, the first."""
        return {stage.about: stage.label.text for stage in reversed(self.stages)}

    def __getitem__(self, label: str) -> Stage:
        return self.stages[self.labels[label]]

    def target(self, label: str, outcome: str) -> str | None:
        """Where an outcome leads to: FAILED and TIMED_OUT, of which the file says nothing, to ends of these names."""
        return self[label].target(outcome) or (outcome if outcome in TROUBLES else None)

    @cached_property
    def ends(self) -> tuple[str, ...]:
        """The final outcomes: what transitions lead to, and is no label."""
        found = [move.target.text for stage in self.stages for move in stage.moves.values()]
        troubles = [t for t in TROUBLES if any(stage.target(t) is None for stage in self.stages)]
        return tuple(dict.fromkeys(text for text in (*found, *troubles) if text not in self.labels))

    @cached_property
    def states(self) -> Mapping[str, str]:
        """The name in the machine of each label and final outcome; the others are PAUSED."""
        return _names((*self.labels, *self.ends), (PAUSED,))

    @cached_property
    def values(self) -> Mapping[str, str]:
        """The value of the input `outcome` that stands for each outcome: what `values` of a port says."""
        found = [outcome for stage in self.stages for outcome in stage.moves]
        return _names(dict.fromkeys((*found, *TROUBLES)), (MACHINE, OUTCOME, ANSWERS, TICKET, NONE))

    @property
    def remainders(self) -> int:
        """Of tickets: one for each label, and one for the time before the first."""
        return len(self.stages) + 1

    @property
    def tickets(self) -> int:
        """How many there are."""
        return COUNT * self.remainders

    def next_ticket(self, ticket: int, label: str) -> int:
        """The ticket of a state that is entered after the stay of another ticket."""
        return (ticket // self.remainders + 1) % COUNT * self.remainders + self.labels[label]

    def is_of(self, ticket: int, label: str) -> bool:
        """Whether it is the ticket of a stay in that state."""
        return ticket % self.remainders == self.labels[label]


def read(report: Report, source: Source, root: Node) -> Transitions | None:
    """What stands in a file; None: nothing can be made of it. Everything wrong goes to `report`."""
    before = len(report.diagnostics)
    listed = report.sequence(root, "a transition file")
    if listed is None:
        return None
    begun = [item for item in listed.items if isinstance(item, Mapped) and [k.text for k, _ in item.items] == [INITIAL]]
    told = [one for item in listed.items if item not in begun and (one := _stage(report, item)) is not None]
    stages = [stage for stage, _ in told]
    if not listed.items:
        report.error(SHAPE, "a transition file has no states", mark(root), "write `- state:` for each of them")
    first: dict[str, Scalar] = {}
    for stage, at in told:
        label = stage.label
        if label.text in first:
            message = f"there are two states with the label `{label.text[:60]}`"
            if label.span == first[label.text].span:
                note, hint = "it is the label before, by an alias", "write it without an alias, with another label"
                report.error(SHAPE, message, at, hint, (note,))
            else:
                note = f"the first one is at {first[label.text].span.nearby}"
                report.error(SHAPE, message, label.span, "give one of them another label", (note,))
        first.setdefault(label.text, label)
    initial = _initial(report, begun, first)
    if any(d.is_error for d in report.diagnostics[before:]):
        return None
    found = Transitions(source, tuple(stages), listed.span, initial)
    report.diagnostics += _near(found)
    return found


def _initial(report: Report, begun: Collection[Mapped], labels: Mapping[str, Scalar]) -> Scalar | None:
    """The label in an item `initial`."""
    found = [label for item in begun if (label := report.scalar(item.items[0][1], f"`{INITIAL}`")) is not None]
    for label in found[1:]:
        report.error(SHAPE, f"there are two items `{INITIAL}`", label.span, "remove one of them")
    for label in found[:1]:
        if label.text not in labels:
            hint = near(label.text, labels) or "write a `state_label` of the file"
            report.error(
                LABEL, f"`{INITIAL}: {label.text[:60]}` names no label of the transition file", label.span, hint
            )
    return found[0] if found else None


def _stage(report: Report, item: Node) -> tuple[Stage, Span] | None:
    """A state: an item `state:`, with its keys below it, or beside it. And the place of that word."""
    at = mark(item)
    pairs = item.items if isinstance(item, Mapped) else ()
    if pairs and pairs[0][0].text == "state":
        at = pairs[0][0].span
        value, rest = pairs[0][1], pairs[1:]
        if rest and isinstance(value, Scalar) and not value.text.strip():
            assert isinstance(item, Mapped)
            item = Mapped(rest, item.span)
        else:
            for key, _ in rest:
                report.unknown_key(key, "an item of a transition file", ("state",))
            item = value
    elif report.mapping(item, "an item of a transition file") is not None:
        report.error("E034", "an item of a transition file has no `state`", mark(item), "write `- state:`")
        return None
    if not isinstance(item, Mapped):
        hint = f"write {', '.join(f'`{key}: …`' for key in _KEYS)} below it"
        report.error("E030", "a `state` must be a mapping (`key: value`)", mark(item), hint)
        return None
    fields = report.fields(item, "a `state`", _KEYS, _KEYS)
    if fields is None:
        return None
    label = report.scalar(fields["state_label"], "`state_label`")
    about = report.scalar(fields["descriptive_name"], "`descriptive_name`")
    moves = report.mapping(fields["transitions"], "`transitions`")
    if moves is None or label is None or about is None:
        return None
    found = {}
    for outcome, node in moves.items:
        target = report.scalar(node, f"the state after `{outcome.text[:60]}`")
        if target is not None:
            found[outcome.text] = Move(outcome, target)
    if not moves.items:
        report.error(SHAPE, f"the state `{label.text[:60]}` has no transitions", mark(moves), "write `OUTCOME: STATE`")
    return Stage(label, about.text, found, mark(moves)), at


class Meant:
    """Says which of some names was meant by a text that is not one of them.

    Of many names and texts, only those are found that differ in one place: comparing all takes the square of their
    number.
    """

    def __init__(self, found: Transitions, names: Iterable[str]) -> None:
        self._abouts, self._names = found.abouts, list(names)
        self._left = COMPARED

    def by(self, text: str) -> str | None:
        """A hint; None: none is similar."""
        label = self._abouts.get(text)
        if label is not None:
            return f"write `{label}`, the label of what this describes"
        self._left -= len(self._names)
        if self._left >= 0:
            return near(text, self._names)
        return near(text, dict.fromkeys(name for part in _parts(text) for name in self._by_parts.get(part, ())))

    @cached_property
    def _by_parts(self) -> Mapping[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name in self._names:
            for part in _parts(name):
                found.setdefault(part, []).append(name)
        return {part: names[: COMPARED // 1_000] for part, names in found.items()}


def _parts(text: str) -> set[str]:
    """A text without one of its first characters, and whole: texts that differ in one place have a part in common."""
    text = text.casefold()[:100]
    return {text, *(text[:at] + text[at + 1 :] for at in range(len(text)))}


def near(text: str, names: Iterable[str]) -> str | None:
    """A hint that names the one of these which may have been meant; None: none is similar."""
    close = get_close_matches(text[:100], list(names), 1, LIKENESS)
    return f"did you mean `{close[0]}`?" if close else None


def _near(found: Transitions) -> Iterable[Diagnostic]:
    meant = Meant(found, found.labels)
    for stage in found.stages:
        for move in stage.moves.values():
            target = move.target.text
            hint = None if target in found.labels else meant.by(target)
            if hint is not None:
                message = f"`{target[:60]}` is not a label, and is taken for a final outcome"
                yield Diagnostic(NEAR, message, move.target.span, hint=hint)


def _names(texts: Collection[str], taken: Iterable[str]) -> Mapping[str, str]:
    """A name made of each text: what a name cannot have becomes `_`, and names that are taken get a number."""
    used, found = set(taken), {}
    for text in sorted(texts, key=lambda t: not _is_name(t)):  # what is a name already stays as it is
        stem = re.sub(r"\W+", "_", text, flags=re.ASCII).strip("_") or "_"
        stem = stem if _is_name(stem) else f"_{stem}"
        name, number = stem, 2
        while name in used:
            name, number = f"{stem}_{number}", number + 1
        used.add(name)
        found[text] = name
    return {text: found[text] for text in texts}


def _is_name(text: str) -> bool:
    source = Source("", text)
    return is_name(implied(text, Span(source, 0, len(text))))
