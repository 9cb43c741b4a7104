"""A machine as written in its file, before parameters are applied: names checked, texts parsed, types resolved."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from llfsm_verify.arrangement.fields import VERSION, Report, mark
from llfsm_verify.arrangement.model import ACTION_KINDS, ActionKind, Suppression
from llfsm_verify.arrangement.nodes import Node, Scalar, Sequence
from llfsm_verify.arrangement.suppressions import KEY, read_suppressions
from llfsm_verify.arrangement.type_table import TypeTable
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.scope import IMPLICIT_SUSPEND, did_you_mean
from llfsm_verify.language.syntax import ParsedActions, ParsedExpression
from llfsm_verify.language.types import Type

MACHINE_KEYS = (VERSION, "machine", "parameters", "variables", "initial", "suspend", "states", KEY)
STATE_KEYS = ("name", "variables", *ACTION_KINDS, "transitions", KEY)
TRANSITION_KEYS = ("when", "to", KEY)
VARIABLE_KEYS = ("type", "init", KEY)


@dataclass(frozen=True, slots=True)
class ParameterText:
    name: str
    kind: Literal["whiteboard", "machine", "constant"]
    type: Type | None
    """None for a machine."""
    span: Span


@dataclass(frozen=True, slots=True)
class VariableText:
    name: str
    type: Type
    init: Node | None
    span: Span


@dataclass(frozen=True, slots=True)
class TransitionText:
    guard: ParsedExpression
    target: int
    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class StateText:
    name: str
    variables: tuple[VariableText, ...]
    actions: dict[ActionKind, ParsedActions]
    transitions: tuple[TransitionText, ...]
    span: Span


@dataclass(frozen=True, slots=True)
class MachineText:
    kind: str
    parameters: tuple[ParameterText, ...]
    variables: tuple[VariableText, ...]
    states: tuple[StateText, ...]
    initial: int
    suspend: int | None
    broken: frozenset[str]
    """Names whose declaration is wrong: using them is no further error."""
    words: frozenset[str]
    """All identifiers in the machine's texts."""
    span: Span
    suppressions: tuple[Suppression, ...] = ()


class MachineReader:
    """Reads one machine; what is wrong goes to the report."""

    def __init__(self, report: Report, types: TypeTable) -> None:
        self.report = report
        self.types = types
        self.broken: set[str] = set()
        self.words: set[str] = set()
        self.suppressions: list[Suppression] = []

    def read(self, node: Node) -> MachineText | None:
        """The machine, or None when it has no readable states."""
        if not self.report.can_read(node, "the machine"):
            return None
        fields = self.report.fields(node, "a machine", MACHINE_KEYS, ("machine", "states"))
        if fields is None:
            return None
        kind = self.report.name(fields["machine"], "the name of a machine")
        self.suppressions += read_suppressions(self.report, fields.get(KEY), node)
        parameters = self._parameters(fields.get("parameters"))
        variables = self.variables(fields.get("variables"))
        names = self._state_names(fields["states"])
        if names is None:
            return None
        states = self._states(fields["states"], names)
        owners = {s.name for s in states if s.variables}
        for variable in variables:
            if variable.name in owners:
                message = f"state `{variable.name}` has variables, so a variable of the machine cannot have its name"
                self.report.error("E118", message, variable.span, "choose another name")
        order = list(names)
        initial = self._state_number(fields.get("initial"), order, "E072", "initial")
        declared = self._state_number(fields.get("suspend"), order, "E073", "suspend")
        suspend = declared if declared is not None else _isolated(states)
        return MachineText(
            kind or "?", parameters, variables, states, initial or 0, suspend,
            frozenset(self.broken), frozenset(self.words), mark(fields["machine"]), tuple(self.suppressions),
        )  # fmt: skip

    def _parameters(self, node: Node | None) -> tuple[ParameterText, ...]:
        mapping = None if node is None else self.report.mapping(node, "`parameters`")
        found: list[ParameterText] = []
        for key, value in mapping.items if mapping else ():
            name = self.report.name(key, "the name of a parameter")
            parameter = None if name is None else self._parameter(name, key.span, value)
            if parameter is None:
                self.broken.add(key.text)
            else:
                found.append(parameter)
        return tuple(found)

    def _parameter(self, name: str, span: Span, node: Node) -> ParameterText | None:
        shape = "write `machine`, `{whiteboard: TYPE}` or `{constant: TYPE}`"
        if isinstance(node, Scalar):
            if node.text == "machine":
                return ParameterText(name, "machine", None, span)
            self.report.error("E065", f"parameter `{name}` is neither a machine nor has it a type", mark(node), shape)
            return None
        fields = self.report.fields(node, f"parameter `{name}`", ("whiteboard", "constant"))
        if fields is None:
            return None
        if len(fields) != 1:
            self.report.error("E065", f"parameter `{name}` must be one kind of thing", mark(node), shape)
            return None
        if "constant" in fields:
            constant = self.types.read_scalar(fields["constant"], "the type of a constant")
            return None if constant is None else ParameterText(name, "constant", constant, span)
        kind = self.types.read(fields["whiteboard"], "the type of a parameter")
        return None if kind is None else ParameterText(name, "whiteboard", kind, span)

    def variables(self, node: Node | None) -> tuple[VariableText, ...]:
        mapping = None if node is None else self.report.mapping(node, "`variables`")
        found: list[VariableText] = []
        for key, value in mapping.items if mapping else ():
            name = self.report.name(key, "the name of a variable")
            fields = self.report.fields(value, f"variable `{key.text[:60]}`", VARIABLE_KEYS, ("type",))
            kind = None if fields is None else self.types.read(fields["type"], "the type of a variable")
            if name is None or fields is None or kind is None:
                self.broken.add(key.text)
                continue
            self.suppressions += read_suppressions(self.report, fields.get(KEY), value, name=key)
            init = fields.get("init")
            if isinstance(init, Scalar):
                self._note_words(init.text)
            found.append(VariableText(name, kind, init, key.span))
        return tuple(found)

    def _state_names(self, node: Node) -> dict[str, Span] | None:
        """The names of the states in order, None when there is no list of states."""
        states = self.report.sequence(node, "`states`")
        if states is None:
            return None
        if not states.items:
            self.report.error("E074", "a machine needs at least one state", mark(node), "write `- name: …`")
            return None
        names: dict[str, Span] = {}
        for item in states.items:
            fields = self.report.fields(item, "a state", STATE_KEYS, ("name",))
            name = None if fields is None else self.report.name(fields["name"], "the name of a state")
            if fields is None or name is None:
                continue
            span = mark(fields["name"])
            if name in names:
                note = f"the first one is at line {names[name].line}"
                self.report.error("E070", f"there are two states `{name}`", span, "choose another name", (note,))
            else:
                names[name] = span
        return names or None

    def _states(self, node: Node, names: dict[str, Span]) -> tuple[StateText, ...]:
        assert isinstance(node, Sequence)
        found: list[StateText] = []
        silent = Report()  # the keys were reported when the names were read
        for item in node.items:
            fields = silent.fields(item, "a state", STATE_KEYS, ("name",))
            name = fields["name"] if fields else None
            if fields is None or not isinstance(name, Scalar) or names.get(name.text) != mark(name):
                continue
            actions: dict[ActionKind, ParsedActions] = {}
            for kind in ACTION_KINDS:
                if kind in fields:
                    parsed = self.report.actions(fields[kind], kind)
                    if parsed is not None:
                        actions[kind] = parsed
                        self._note_words(parsed.fragment.text)
            self.suppressions += read_suppressions(self.report, fields.get(KEY), item)
            variables = self.variables(fields.get("variables"))
            transitions = self._transitions(fields.get("transitions"), list(names))
            found.append(StateText(name.text, variables, actions, transitions, mark(name)))
        return tuple(found)

    def _transitions(self, node: Node | None, states: list[str]) -> tuple[TransitionText, ...]:
        if node is None or (isinstance(node, Scalar) and not node.text):
            return ()
        sequence = self.report.sequence(node, "`transitions`")
        found: list[TransitionText] = []
        for item in sequence.items if sequence else ():
            fields = self.report.fields(item, "a transition", TRANSITION_KEYS, ("when", "to"))
            if fields is None:
                continue
            self.suppressions += read_suppressions(self.report, fields.get(KEY), item)
            target = self._state_number(fields["to"], states, "E071", "to")
            guard = self.report.guard(fields["when"], "when")
            if target is None or guard is None:
                continue
            text = guard.fragment.text
            self._note_words(text)
            found.append(TransitionText(guard, target, " ".join(text.split()), fields["when"].span))
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
        import re

        self.words.update(re.findall(r"[A-Za-z_][A-Za-z0-9_]*", text))


def _isolated(states: Iterable[StateText]) -> int | None:
    """The suspend state of a machine that declares none: a state `Suspend` without transitions in or out."""
    ordered = list(states)
    targets = {t.target for s in ordered for t in s.transitions}
    for number, state in enumerate(ordered):
        if state.name == "Suspend" and not state.transitions and number not in targets:
            return number
    return None
