"""The atoms of properties: what a state formula may ask about a configuration and the step that led to it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence, Sized
from dataclasses import dataclass, field, replace
from typing import Literal as OneOf
from typing import Protocol, cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.language import syntax, typed
from llfsm_verify.language.constants import evaluate
from llfsm_verify.language.expressions import BOOL, ExpressionChecker
from llfsm_verify.language.habits import PROPERTY_WORDS, member_meant, word_meant
from llfsm_verify.language.parser import parse_guard
from llfsm_verify.language.scope import (
    CALLS,
    CHOOSE,
    COMMANDS,
    ELSEWHERE,
    MachineSignature,
    Scope,
    Table,
    did_you_mean,
    enumerators_of,
)
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import Variable
from llfsm_verify.language.types import EnumType, FixedType, Type

OBSERVATIONS = ("ran", "entered", "suspended", "loaded", "finished")
"""What a property may ask of a machine by a word alone."""
_Observation = OneOf["ran", "entered", "suspended", "loaded", "finished"]
MACHINE_FUNCTIONS = ("fired", "entered", "sampled", "read")
"""What it may ask by a word with arguments: `m.fired(STATE, 0)`, `m.entered(STATE)`, `m.sampled(x)`, `m.read(x)`."""
_COMPARED = re.compile(r"\s*([=!]=)\s*(?:\w+(?:\.|@|::))?(\w+)")
EDGES = ("rose", "fell", "changed")
PROPERTY_FUNCTIONS = (
    "abs",
    "min",
    "max",
    "floor",
    "ceil",
    "round",
    "is_running",
    "is_suspended",
    "done",
    "refused",
    "faulted",
    "sampled",
    *EDGES,
)
_Edge = OneOf["rose", "fell", "changed"]


class _State(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def variables(self) -> Sequence[Variable]: ...
    @property
    def transitions(self) -> Sized: ...


class _Machine(Protocol):
    @property
    def name(self) -> str: ...
    @property
    def variables(self) -> Sequence[Variable]: ...
    @property
    def states(self) -> Sequence[_State]: ...
    @property
    def suspend(self) -> int | None: ...
    @property
    def nested(self) -> bool: ...
    @property
    def knowledge(self) -> Mapping[str, typed.LetIn]: ...


class _WhiteboardVariable(Protocol):
    @property
    def variable(self) -> Variable: ...
    @property
    def role(self) -> str: ...


class _Arrangement(Protocol):
    """The part of `arrangement.model.Arrangement` that properties see (this stage comes before it)."""

    @property
    def types(self) -> Mapping[str, Type]: ...
    @property
    def tables(self) -> Mapping[str, Table]: ...
    @property
    def whiteboard(self) -> Sequence[_WhiteboardVariable]: ...
    @property
    def texts(self) -> Sequence[_Machine]: ...
    @property
    def surroundings(self) -> tuple[str, ...]: ...
    @property
    def knowledge(self) -> Mapping[str, typed.LetIn]: ...


@dataclass(frozen=True, slots=True)
class MachineView:
    """What a property may name of a machine instance."""

    signature: MachineSignature
    variables: Mapping[str, Variable]
    state_variables: Mapping[str, Mapping[str, Variable]]
    """By state and by name."""
    transitions: tuple[int, ...]
    """The number of transitions of each state."""
    knowledge: Mapping[str, typed.LetIn] = field(default_factory=dict)
    """What its theories say."""

    @staticmethod
    def of(machine: _Machine) -> MachineView:
        states = tuple(s.name for s in machine.states)
        prefix = len(machine.name) + 1
        return MachineView(
            signature=MachineSignature(machine.name, states, machine.suspend, machine.nested),
            variables={v.name[prefix:]: v for v in machine.variables},
            state_variables={
                s.name: {v.name[prefix + len(s.name) + 1 :]: v for v in s.variables}
                for s in machine.states
                if s.variables
            },
            transitions=tuple(len(s.transitions) for s in machine.states),
            knowledge=machine.knowledge,
        )


@dataclass(frozen=True, slots=True)
class PropertyScope:
    """The names a property may use: the whiteboard, and the machines with their variables and states."""

    whiteboard: Mapping[str, Variable]
    machines: Mapping[str, MachineView]
    types: Mapping[str, Type]
    enumerators: Mapping[str, tuple[EnumType, ...]]
    inputs: frozenset[str]
    tables: Mapping[str, Table] = field(default_factory=dict)
    surroundings: tuple[str, ...] = ()
    """The models of the surroundings, by their names; they are among the machines."""
    knowledge: Mapping[str, typed.LetIn] = field(default_factory=dict)

    @staticmethod
    def of(arrangement: _Arrangement) -> PropertyScope:
        return PropertyScope(
            whiteboard={w.variable.name: w.variable for w in arrangement.whiteboard},
            machines={m.name: MachineView.of(m) for m in arrangement.texts},
            types=arrangement.types,
            enumerators=enumerators_of(arrangement.types.values()),
            inputs=frozenset(w.variable.name for w in arrangement.whiteboard if w.role == "input"),
            tables=arrangement.tables,
            surroundings=arrangement.surroundings,
            knowledge=arrangement.knowledge,
        )

    def scope(self) -> Scope:
        signatures = {name: view.signature for name, view in self.machines.items()}
        return Scope(
            self.whiteboard, {}, signatures, (), "", self.types, self.enumerators, frozenset(), tables=self.tables,
            knowledge=self.knowledge,
        )  # fmt: skip


class AtomChecker(ExpressionChecker):
    """Expressions with the names of properties: ``m.n``, ``m.STATE.n``, ``m.ran``, ``m.fired(S, i)``, ``cycle``,
    ``sampled(x)``, ``rose(p)``."""

    def __init__(self, scope: PropertyScope, fragment: Fragment) -> None:
        super().__init__(scope.scope(), fragment)
        self.properties = scope
        start = fragment.offsets[0]
        self.quoted = start > 0 and fragment.source.text[start - 1] == '"'
        """The property file has the whole atom in quotes: a name that can be two things is then the variable."""

    def path(self, node: syntax.Path, expected: Type | None) -> typed.Expression:
        name = node.name
        if name.text == "cycle" and not node.steps:
            return typed.Observe("cycle", "", -1, -1, BOOL, self.span(node))
        if name.text in self.properties.machines and name.text not in self.properties.whiteboard:
            return self._of_machine(node, self.properties.machines[name.text])
        return super().path(replace(node, name=replace(name, quoted=False)), expected)

    def _takes_turns(self, machine: str, node: syntax.Node) -> None:
        """What follows asks for turns, which the model of the surroundings does not take."""
        if machine in self.properties.surroundings:
            hint = f"ask for `{machine}@STATE`, `{machine}.entered` or its variables"
            raise self.fail("E156", "the model of the surroundings takes no turns and has no samples", node, hint)

    def machine_argument(self, node: syntax.Expression) -> MachineSignature:
        machine = super().machine_argument(node)
        self._takes_turns(machine.name, node)
        return machine

    def is_value(self, name: syntax.Name) -> bool:
        return super().is_value(name) or name.text == "cycle" or name.text in self.properties.machines

    def _of_machine(self, node: syntax.Path, view: MachineView) -> typed.Expression:
        machine = view.signature.name
        if not node.steps:
            hint = (
                self._state_compared(node, view) or f"write `{machine}@STATE`, `{machine}.ran` or `{machine}.VARIABLE`"
            )
            raise self.fail("E148", f"`{machine}` is a machine and has no value", node, hint)
        first, *rest = node.steps
        if isinstance(first, syntax.Subscript):
            raise self.fail("E124", f"`{machine}` is a machine, not an array", first)
        name = first.name
        variable, entry = view.variables.get(name.text), view.knowledge.get(name.text)
        if name.text in view.signature.states and rest and isinstance(rest[0], syntax.Member):
            inner = view.state_variables.get(name.text, {})
            found = inner.get(rest[0].name.text)
            if found is not None:
                return self.read(found, node, tuple(rest[1:]))
            if variable is None:
                hint = did_you_mean(rest[0].name.text, inner) or f"state `{name.text}` has no variables"
                message = f"state `{name.text}` of `{machine}` has no variable `{rest[0].name.text}`"
                raise self.fail("E110", message, rest[0].name, hint)
        declared = variable is not None or entry is not None
        if name.text in (*OBSERVATIONS, "fired") and not (declared and (name.quoted or self.quoted)):
            if declared:
                word = f"{machine}.{name.text}"
                message = f"`{word}` is a variable here and a word of the property language"
                raise self.fail("E147", message, node, f'write `"{word}"` for the variable')
            if name.text != "entered":
                self._takes_turns(machine, node)
            if name.text == "fired":
                hint = f"write `{machine}.fired(STATE, 0)`"
                raise self.fail("E117", "`fired` takes a state and the number of a transition", node, hint)
            if rest:
                raise self.no_such_step(rest[0], BOOL)
            return typed.Observe(cast(_Observation, name.text), machine, -1, -1, BOOL, self.span(node))
        if entry is not None:
            return self.known(entry, node, tuple(rest))
        if variable is None:
            if name.text in ("read", "sampled") and machine not in self.properties.surroundings:
                hint = f"write `{machine}.{name.text}(x)`, where `x` is an input"
                raise self.fail("E117", f"`{name.text}` takes an input", node, hint)
            if name.text in view.signature.states:
                hint = f"write `{machine}@{name.text}`"
            else:
                around = machine in self.properties.surroundings
                words = ("entered",) if around else tuple(dict.fromkeys((*OBSERVATIONS, *MACHINE_FUNCTIONS)))
                near = self._state_compared(node, view) or member_meant(machine, name.text, (), PROPERTY_FUNCTIONS)
                own = [*view.variables, *view.knowledge]
                near = near or did_you_mean(name.text, [*own, *view.state_variables, *words])
                known = list(dict.fromkeys([*own[:8], *words]))
                hint = near or f"known here: {', '.join(f'`{n}`' for n in known)}"
            message = f"machine `{machine}` has no variable `{name.text}`"
            raise self.fail("E110", message, name, hint or None)
        return self.read(variable, node, tuple(rest))

    def _state_compared(self, node: syntax.Path, view: MachineView) -> str | None:
        """What to write where a machine, or what is meant to be its state, is compared with the name of a state."""
        place, machine = self.span(node), view.signature.name
        found = _COMPARED.match(place.source.text, place.end)
        state = found is not None and found[2] in view.signature.states
        return f"write `{'!' if found[1] == '!=' else ''}{machine}@{found[2]}`" if found and state else None

    def unknown(self, node: syntax.Path, enumerators: tuple[str, ...] = ()) -> DiagnosticError:
        near = [*self.visible(), *enumerators, *self.scope.enumerators, "cycle", *self.properties.machines]
        name = node.name.text
        views = self.properties.machines.items()
        owners = [f"{m}.{name}" for m, view in views if name in view.variables or name in view.knowledge]
        hint = f"write {' or '.join(f'`{o}`' for o in owners[:3])}" if owners else None
        hint = hint or self.state_meant(name) or word_meant(name, near, PROPERTY_WORDS) or did_you_mean(name, near)
        return self.fail("E110", f"there is no variable `{name}` on the whiteboard", node.name, hint)

    def known(
        self, entry: typed.LetIn, node: syntax.Path, steps: tuple[syntax.Member | syntax.Subscript, ...]
    ) -> typed.Expression:
        for part in nodes(entry):
            refused = _refused(part)
            if refused is not None:
                code, why = refused
                assert isinstance(part, typed.Binary | typed.Unary | typed.Index | typed.Lookup)
                notes = (f"an input of `{self.span(node).text}` is `{part.span.text}`, at {part.span}",)
                hint = "calculate it in a variable, and give the theory that"
                raise DiagnosticError(Diagnostic(code, why, self.span(node), notes, hint))
        return super().known(entry, node, steps)

    def index(self, node: syntax.Expression, size: int, what: str = "array") -> typed.Expression:
        index = super().index(node, size, what)
        if evaluate(index) is None:
            raise self.fail(
                "E144", "an index in a property must be a constant", node, "compare the elements one by one"
            )
        return index

    def bit_operands(
        self,
        nodes: tuple[syntax.Expression, ...],
        expected: Type | None,  # noqa: ARG002 - there are none
    ) -> tuple[list[typed.Expression], FixedType]:
        hint = "calculate it in a variable, and ask for that"
        raise self.fail("E145", "a property has no bit operations", nodes[0], hint)

    def divisor(self, node: syntax.Expression, divisor: typed.Expression) -> None:
        super().divisor(node, divisor)
        if evaluate(divisor) is None:
            raise self.fail("E143", "a property may divide only by a constant", node)

    def call(self, node: syntax.Call) -> typed.Expression:
        function = node.function
        name = function.name.text
        if len(function.steps) == 1 and isinstance(function.steps[0], syntax.Member):
            word = function.steps[0].name.text
            if word in MACHINE_FUNCTIONS and word != "entered":
                self._takes_turns(function.name.text, node)
            match word:
                case "fired":
                    return self._fired(node)
                case "entered":
                    return self._entered(node)
                case "sampled":
                    return self._sampled(node, self.machine_named(function.name).name)
                case "read":
                    return self._sampling(node)
            hint = f"write `{name}.{word}`" if word in OBSERVATIONS else did_you_mean(word, MACHINE_FUNCTIONS)
            raise self.fail("E113", f"there is no function `{self.span(function).text}`", function, hint)
        if name in ("refused", "faulted"):
            (argument,) = self.arguments(node, 1)
            machine = self.machine_argument(argument)
            kind: OneOf["refused", "faulted"] = "refused" if name == "refused" else "faulted"
            return typed.Observe(kind, machine.name, -1, -1, BOOL, self.span(node))
        if name == "sampled":
            return self._sampled(node, "")
        if name in EDGES:
            return self._edge(node, cast(_Edge, name))
        if name == "sqrt":
            raise self.fail("E145", "a property cannot use `sqrt`", node, "compare the square: `x * x >= …`")
        if name in ("after", "after_ms", CHOOSE) or name in COMMANDS:
            raise self.fail(
                "E145", f"a property cannot use `{name}`", node, "use it in a guard or action, and ask for the state"
            )
        if name not in PROPERTY_FUNCTIONS:
            known = f"functions of properties are {', '.join(f'`{n}`' for n in PROPERTY_FUNCTIONS)}"
            meant = word_meant(name, PROPERTY_FUNCTIONS, PROPERTY_WORDS)
            near = None if name in ELSEWHERE else meant or did_you_mean(name, PROPERTY_FUNCTIONS)
            near = f"write `{CALLS[name]}`" if name in MACHINE_FUNCTIONS else near
            raise self.fail("E113", f"there is no function `{name}`", function, near or known)
        return super().call(node)

    def _entered(self, node: syntax.Call) -> typed.Expression:
        """`m.entered(STATE)`: `m@STATE && m.entered`."""
        machine = self.machine_named(node.function.name)
        (state,) = self.arguments(node, 1)
        number, span = self.state_of(machine, self._state_name(state)), self.span(node)
        there = typed.AtState(machine.name, number, BOOL, span)
        entered = typed.Observe("entered", machine.name, -1, -1, BOOL, span)
        return typed.Binary("and", there, entered, BOOL, span)

    def _state_name(self, node: syntax.Expression) -> syntax.Name:
        if not isinstance(node, syntax.Path) or node.steps:
            raise self.fail("E112", "the name of a state is expected", node)
        return node.name

    def _input(self, node: syntax.Expression) -> typed.Read:
        """The input that an argument names, or a part of it."""
        read = self.expression(node)
        if not isinstance(read, typed.Read) or read.variable.name not in self.properties.inputs:
            known = did_you_mean(self.span(node).text, self.properties.inputs)
            raise self.fail("E154", "the name of an input is expected", node, known)
        return read

    def _sampled(self, node: syntax.Call, machine: str) -> typed.Sampled:
        (argument,) = self.arguments(node, 1)
        read = self._input(argument)
        return typed.Sampled(machine, read.variable, read.path, read.type, self.span(node))

    def _sampling(self, node: syntax.Call) -> typed.Sampling:
        machine = self.machine_named(node.function.name)
        (argument,) = self.arguments(node, 1)
        read = self._input(argument)
        if read.path:
            hint = f"write `{machine.name}.read({read.variable.name})`"
            raise self.fail("E154", "an input is sampled whole", argument, hint)
        return typed.Sampling(machine.name, read.variable, BOOL, self.span(node))

    def _edge(self, node: syntax.Call, kind: _Edge) -> typed.Edge:
        (argument,) = self.arguments(node, 1)
        operand = self.expression(argument) if kind == "changed" else self.boolean(argument)
        return typed.Edge(kind, operand, BOOL, self.span(node))

    def _fired(self, node: syntax.Call) -> typed.Observe:
        machine = self.machine_named(node.function.name)
        view = self.properties.machines[machine.name]
        state_node, number_node = self.arguments(node, 2)
        name = self._state_name(state_node)
        state = self.state_of(machine, name)
        number = evaluate(self.integer(number_node))
        if number is None:
            raise self.fail("E136", "a constant is expected", number_node)
        count = view.transitions[state] if state >= 0 else 0
        if not 0 <= number < count:
            few = "the state has no transitions" if count == 0 else "it has one, number 0"
            hint = f"they count from 0 to {count - 1}" if count > 1 else few
            message = f"state `{name.text}` of `{machine.name}` has no transition number {int(number)}"
            raise self.fail("E146", message, number_node, hint)
        return typed.Observe("fired", machine.name, state, int(number), BOOL, self.span(node))


def _refused(part: object) -> tuple[str, str] | None:
    """The code and the message where a part of what a theory is told cannot stand in a property."""
    match part:
        case typed.Lookup(index=index) | typed.Index(value=index) if evaluate(index) is None:
            return "E144", "an index in a property must be a constant"
        case typed.Binary("div" | "mod") if evaluate(part.right) is None:
            return "E143", "a property may divide only by a constant"
        case typed.Binary("band" | "bor" | "bxor" | "shl" | "shr") | typed.Unary("bnot"):
            return "E145", "a property has no bit operations"
        case typed.Unary("sqrt"):
            return "E145", "a property cannot use `sqrt`"
    return None


def check_atom(fragment: Fragment, scope: PropertyScope) -> typed.Expression:
    """The typed condition that `fragment` writes. Raises DiagnosticError at the first error."""
    checker = AtomChecker(scope, fragment)
    try:
        return checker.boolean(parse_guard(fragment).root)
    except DiagnosticError as e:
        if re.search(r"\bafter(?:_ms)?\s*\(", fragment.text):
            hint = "a property does not wait: ask for the state, or write a bound in time, such as `F[<=3s] p`"
        elif checker.quoted and re.search(r"\b[GFXURW]\b|->|\[\]|<>", fragment.text):
            hint = "quotes make one atom of a text: leave them out of a formula with temporal operators"
        else:
            raise
        raise DiagnosticError([replace(d, hint=hint) for d in e.diagnostics]) from None
