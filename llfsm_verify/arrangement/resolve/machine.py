"""A machine before parameters are applied: names checked, texts parsed, types resolved."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from llfsm_verify.arrangement.draft import (
    MachineDraft,
    ParameterDraft,
    StateDraft,
    TransitionDraft,
    Unreadable,
    VariableDraft,
)  # fmt: skip
from llfsm_verify.arrangement.model import ACTION_KINDS, ActionKind, Suppression
from llfsm_verify.arrangement.resolve.knowledge import KnowledgeText, parse_knowledge
from llfsm_verify.arrangement.resolve.type_table import TypeTable
from llfsm_verify.arrangement.suppressions import resolve_suppressions
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import IMPLICIT_SUSPEND, did_you_mean
from llfsm_verify.language.syntax import ParsedActions, ParsedExpression
from llfsm_verify.language.types import Type
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark
from llfsm_verify.yaml.nodes import Sequence as SequenceNode
from llfsm_verify.yaml.tables import TRUTHS

_WORD = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")


@dataclass(frozen=True, slots=True)
class ParameterText:
    """A parameter, its type resolved."""

    name: str
    kind: Literal["whiteboard", "machine", "constant"]
    type: Type | None
    """None for a machine."""
    span: Span


@dataclass(frozen=True, slots=True)
class VariableText:
    """A variable, its type resolved and its initial value as written."""

    name: str
    type: Type
    init: Node | None
    span: Span


@dataclass(frozen=True, slots=True)
class TransitionText:
    """A transition, its guard parsed and its target found."""

    guard: ParsedExpression
    target: int
    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class StateText:
    """A state, its actions parsed."""

    name: str
    variables: tuple[VariableText, ...]
    actions: dict[ActionKind, ParsedActions]
    transitions: tuple[TransitionText, ...]
    span: Span
    stays: bool
    runs: Node | None = None


@dataclass(frozen=True, slots=True)
class MachineText:
    """A machine file, parsed once for all instances; they are typed one by one."""

    kind: str
    parameters: tuple[ParameterText, ...]
    variables: tuple[VariableText, ...]
    states: tuple[StateText, ...]
    initial: int
    suspend: int | None
    broken: frozenset[str]
    """Names whose declaration is wrong: using them is not a further error."""
    words: frozenset[str]
    """All identifiers in the machine's texts."""
    span: Span
    suppressions: tuple[Suppression, ...] = ()
    knowledge: tuple[KnowledgeText, ...] = ()


class MachineResolver:
    """Resolves one machine; what is wrong goes to the report."""

    def __init__(self, report: Report, types: TypeTable) -> None:
        self.report = report
        self.types = types
        self.broken: set[str] = set()
        self.words: set[str] = set()
        self.suppressions: list[Suppression] = []

    def resolve(self, draft: MachineDraft) -> MachineText | None:
        """The machine, or None when it has no readable states."""
        kind = self.report.name(draft.name, "the name of a machine")
        self.suppressions += resolve_suppressions(self.report, draft.lint)
        parameters = self._parameters(draft.parameters)
        variables = self.variables(draft.variables)
        knowledge, broken = parse_knowledge(self.report, draft.knowledge)
        self.broken |= broken
        for text in (text for entry in knowledge for text in entry.words):
            self._note_words(text)
        if isinstance(draft.states, Unreadable):
            return None
        if not draft.states:
            self.report.error("E074", "a machine needs at least one state", draft.states_at, "write `- name: …`")
            return None
        names = self._state_names(draft.states)
        if not names:
            return None
        states = self._states(draft.states, names)
        owners = {s.name for s in states if s.variables}
        own = [(v.name, v.span, "a variable of the machine") for v in variables]
        for name, span, what in (*own, *((k.name, k.span, "what a theory says") for k in knowledge)):
            if name in owners:
                message = f"state `{name}` has variables, so {what} cannot have its name"
                self.report.error("E118", message, span, "choose another name")
        order = list(names)
        initial = self._state_number(draft.initial, order, "E072", "initial")
        declared = self._state_number(draft.suspend, order, "E073", "suspend")
        suspend = declared if declared is not None else _isolated(states)
        return MachineText(
            kind or "?", parameters, variables, states, initial or 0, suspend,
            frozenset(self.broken), frozenset(self.words), mark(draft.name), tuple(self.suppressions),
            knowledge,
        )  # fmt: skip

    def _parameters(self, drafts: Sequence[ParameterDraft]) -> tuple[ParameterText, ...]:
        self.report.distinct(draft.name for draft in drafts)
        found: list[ParameterText] = []
        for draft in drafts:
            name = self.report.name(draft.name, "the name of a parameter")
            parameter = None if name is None else self._parameter(name, draft)
            if parameter is None:
                self.broken.add(draft.name.text)
            else:
                found.append(parameter)
        return tuple(found)

    def _parameter(self, name: str, draft: ParameterDraft) -> ParameterText | None:
        if isinstance(draft.kind, Unreadable):
            return None
        if draft.kind == "machine":
            return ParameterText(name, "machine", None, draft.name.span)
        if draft.type is None:
            shape = "write `machine`, `{whiteboard: TYPE}` or `{constant: TYPE}`"
            self.report.error("E065", f"parameter `{name}` is not a machine and has no type", draft.name.span, shape)
            return None
        kind: Type | None
        if draft.kind == "constant":
            kind = self.types.read_scalar(draft.type, "the type of a constant")
        else:
            kind = self.types.read(draft.type, "the type of a parameter")
        return None if kind is None else ParameterText(name, draft.kind, kind, draft.name.span)

    def variables(self, drafts: Sequence[VariableDraft]) -> tuple[VariableText, ...]:
        self.report.distinct(draft.name for draft in drafts)
        found: list[VariableText] = []
        for draft in drafts:
            name = self.report.name(draft.name, "the name of a variable")
            kind = None
            if not isinstance(draft.type, Unreadable):
                kind = self.types.read(draft.type, "the type of a variable")
            if name is None or kind is None:
                self.broken.add(draft.name.text)
                continue
            self.suppressions += resolve_suppressions(self.report, draft.lint)
            if isinstance(draft.init, Scalar):
                self._note_words(draft.init.text)
            found.append(VariableText(name, kind, draft.init, draft.name.span))
        return tuple(found)

    def _state_names(self, drafts: Iterable[StateDraft]) -> dict[str, Span]:
        """The names of the states in order, with their places."""
        names: dict[str, Span] = {}
        for draft in drafts:
            name = self.report.name(draft.name, "the name of a state")
            if name is None:
                continue
            span = mark(draft.name)
            if name in names:
                note = f"the first one is at {names[name].nearby}"
                self.report.error("E070", f"there are two states `{name}`", span, "choose another name", (note,))
            else:
                names[name] = span
        return names

    def _states(self, drafts: Iterable[StateDraft], names: dict[str, Span]) -> tuple[StateText, ...]:
        found: list[StateText] = []
        for draft in drafts:
            if not isinstance(draft.name, Scalar) or names.get(draft.name.text) != mark(draft.name):
                continue
            actions: dict[ActionKind, ParsedActions] = {}
            for kind in ACTION_KINDS:
                if kind in draft.actions:
                    parsed = self.report.actions(draft.actions[kind], kind)
                    if parsed is not None:
                        actions[kind] = parsed
                        self._note_words(parsed.fragment.text)
            self.suppressions += resolve_suppressions(self.report, draft.lint)
            variables = self.variables(draft.variables)
            transitions = self._transitions(draft.transitions, list(names))
            stays = self._stays(draft)
            if isinstance(draft.runs, SequenceNode):
                self.words.update(item.text for item in draft.runs.items if isinstance(item, Scalar))
            found.append(
                StateText(draft.name.text, variables, actions, transitions, mark(draft.name), stays, draft.runs)
            )
        return tuple(found)

    def _stays(self, draft: StateDraft) -> bool:
        stays = self.report.choice(draft.stays, "`stays`", TRUTHS, "false") == "true"
        if stays and draft.transitions and draft.stays is not None:
            message = "a machine stays in a state with transitions anyway, until one of them fires"
            self.report.error("E075", message, mark(draft.stays), "remove `stays`, or the transitions")
        return stays

    def _transitions(self, drafts: Iterable[TransitionDraft], states: list[str]) -> tuple[TransitionText, ...]:
        found: list[TransitionText] = []
        for draft in drafts:
            self.suppressions += resolve_suppressions(self.report, draft.lint)
            target = self._state_number(draft.target, states, "E071", "to")
            guard = None if isinstance(draft.guard, Unreadable) else self.report.guard(draft.guard, "when")
            if target is None or guard is None or isinstance(draft.guard, Unreadable):
                continue
            text = guard.fragment.text
            self._note_words(text)
            found.append(TransitionText(guard, target, " ".join(text.split()), draft.guard.span))
        return tuple(found)

    def _state_number(self, node: Node | None, states: list[str], code: str, key: str) -> int | None:
        if node is None:
            return None
        name = self.report.scalar(node, f"`{key}`")
        if name is None:
            return None
        if name.text not in states:
            hint = did_you_mean(name.text, states)
            if name.text == IMPLICIT_SUSPEND:
                hint = "declare a suspend state of your own to reach it by a transition"
            self.report.error(code, f"there is no state `{name.text[:60]}`", mark(name), hint)
            return None
        return states.index(name.text)

    def _note_words(self, text: str) -> None:
        self.words.update(_WORD.findall(text))


def _isolated(states: Iterable[StateText]) -> int | None:
    """The suspend state of a machine that declares none: a state `Suspend` without transitions in or out."""
    ordered = list(states)
    targets = {t.target for s in ordered for t in s.transitions}
    for number, state in enumerate(ordered):
        if state.name == "Suspend" and not state.transitions and not state.stays and number not in targets:
            return number
    return None
