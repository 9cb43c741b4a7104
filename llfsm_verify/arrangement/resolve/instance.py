"""A machine's text with the arguments of one instance applied: scopes built, guards and actions type-checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from llfsm_verify.arrangement.model import Machine, OnFault, State, Transition
from llfsm_verify.arrangement.requests import Request
from llfsm_verify.arrangement.resolve.initial import read_constant, read_value
from llfsm_verify.arrangement.resolve.knowledge import check_knowledge
from llfsm_verify.arrangement.resolve.machine import MachineText, ParameterText, StateText, VariableText
from llfsm_verify.arrangement.resolve.nesting import resolve_runs
from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.language.scope import NO_MACHINES, Constant, MachineSignature, Scope, did_you_mean
from llfsm_verify.language.statements import check_actions, check_guard
from llfsm_verify.language.typed import Statement, Variable
from llfsm_verify.language.types import ArrayType, RecordType, default_value
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, Scalar, mark


@dataclass(frozen=True, slots=True)
class InstanceText:
    """One entry of `machines`: its name, the machine's text and what the arrangement says about it."""

    name: str
    text: MachineText
    arguments: dict[str, tuple[Scalar, Node]] = field(repr=False)
    suspended: bool
    span: Span
    model: bool = False
    """It may choose."""
    surroundings: bool = False
    """It is the model of the surroundings."""
    on_fault: OnFault = "end"
    request: Request | None = None
    """Of a plant."""

    def signature(self) -> MachineSignature:
        return MachineSignature(self.name, tuple(s.name for s in self.text.states), self.text.suspend)


class InstanceChecker:
    """Turns the text of one instance into a `Machine`. `world` is the scope of the arrangement itself."""

    def __init__(self, report: Report, world: Scope, instance: InstanceText, broken: frozenset[str]) -> None:
        self.report = report
        self.instance = instance
        self.broken = broken | instance.text.broken
        """Names whose declaration is wrong; using them is not reported again."""
        self.world = world
        self.variables = dict(world.variables)
        self.constants: dict[str, Constant] = {}
        self.knowledge = dict(world.knowledge)
        self.machines = {} if instance.surroundings else dict(world.machines)
        self.places: dict[tuple[str, str], Span] = {}
        """Where states name the machines that they run."""
        self.timed: list[object] = []
        """The checked guards and actions that may ask for the time."""

    def check(self) -> Machine:
        text = self.instance.text
        if not self.instance.surroundings:
            self.machines["self"] = self.instance.signature()
        self._bind_parameters()
        prefix = self.instance.name
        scope = self._scope(self.variables)
        machine_variables = tuple(
            v for v in (self._declare(d, f"{prefix}.{d.name}", scope, "machine") for d in text.variables) if v
        )
        scope = replace(self._scope(self.variables), chooses=False)
        own, broken = check_knowledge(self.report, text.knowledge, scope, self.broken, self._knowledge_taken)
        self.knowledge |= own
        self.broken |= broken
        states = tuple(self._state(s) for s in text.states)
        return Machine(
            prefix, text.kind, machine_variables, states, text.initial, text.suspend, self.instance.suspended,
            self.instance.span, self.instance.model, on_fault=self.instance.on_fault,
            request=self.instance.request, knowledge=own,
        )  # fmt: skip

    def _scope(self, variables: Mapping[str, Variable]) -> Scope:
        others = tuple(o for o in self.world.others if o != self.instance.name)
        return replace(
            self.world,
            variables=variables,
            constants=self.constants,
            machines=self.machines,
            others=others,
            self_name=self.instance.name,
            chooses=self.instance.model or self.instance.surroundings,
            surroundings=self.instance.surroundings,
            knowledge=self.knowledge,
        )

    # ------------------------------------------------------------ parameters

    def _bind_parameters(self) -> None:
        arguments = dict(self.instance.arguments)
        known = [p.name for p in self.instance.text.parameters]
        for name, (key, _) in arguments.items():
            if name not in known and name not in self.broken:
                hint = did_you_mean(name, known) or "the machine has no parameters"
                kind = self.instance.text.kind
                self.report.error("E062", f"machine `{kind}` has no parameter `{name[:60]}`", key.span, hint)
        for parameter in self.instance.text.parameters:
            if parameter.name not in arguments:
                hint = f"write `parameters: {{{parameter.name}: …}}`"
                message = f"machine `{self.instance.name}` has no value for its parameter `{parameter.name}`"
                self.report.error("E061", message, self.instance.span, hint)
                self.broken |= {parameter.name}
            else:
                self._bind(parameter, arguments[parameter.name][1])

    def _bind(self, parameter: ParameterText, node: Node) -> None:
        name = parameter.name
        bound = False
        if parameter.kind == "constant":
            assert not isinstance(parameter.type, ArrayType | RecordType | None)
            if not self._taken(name, parameter.span):
                value = read_constant(self.report, node, parameter.type, self.world, f"parameter `{name}`")
                if value is not None:
                    self.constants[name] = Constant(value, parameter.type)
                    bound = True
        elif parameter.kind == "machine":
            bound = self._bind_machine(parameter, node)
        else:
            bound = self._bind_variable(parameter, node)
        if not bound:
            self.broken |= {name}

    def _bind_machine(self, parameter: ParameterText, node: Node) -> bool:
        argument = self.report.scalar(node, f"parameter `{parameter.name}`")
        if argument is None:
            return False
        if self.instance.surroundings:
            message, instead = NO_MACHINES
            self.report.error("E156", message, mark(argument), instead)
            return False
        target = self.world.machines.get(argument.text)
        if target is None:
            if argument.text not in self.broken:
                hint = did_you_mean(argument.text, self.world.machines)
                message = f"parameter `{parameter.name}` is a machine, and there is no machine `{argument.text[:60]}`"
                self.report.error("E063", message, mark(argument), hint)
            return False
        if self.world.machines.get(parameter.name, target) is not target:
            message = f"the parameter `{parameter.name}` hides the machine of that name"
            self.report.error("E118", message, parameter.span, "choose another name")
            return False
        self.machines[parameter.name] = target
        return True

    def _bind_variable(self, parameter: ParameterText, node: Node) -> bool:
        argument = self.report.scalar(node, f"parameter `{parameter.name}`")
        if argument is None:
            return False
        variable = self.world.variables.get(argument.text)
        if variable is None:
            if argument.text not in self.broken:
                hint = did_you_mean(argument.text, self.world.variables)
                message = f"there is no whiteboard variable `{argument.text[:60]}` for parameter `{parameter.name}`"
                self.report.error("E063", message, mark(argument), hint)
            return False
        if variable.type != parameter.type:
            message = (
                f"parameter `{parameter.name}` is {parameter.type}, "
                f"whiteboard variable `{argument.text}` is {variable.type}"
            )
            self.report.error("E064", message, mark(argument))
            return False
        if self.world.variables.get(parameter.name) is not variable and self._taken(parameter.name, parameter.span):
            return False
        self.variables[parameter.name] = variable
        return True

    # ------------------------------------------------------------ variables

    def _taken(self, name: str, span: Span) -> bool:
        """Whether a new variable or constant would hide something; reported when it would."""
        if name in self.world.enumerators:
            owner = self.world.enumerators[name][0]
            self.report.error("E118", f"`{name}` is a value of the enumeration {owner}", span, "choose another name")
            return True
        if name in self.knowledge:
            place = self.knowledge[name].span
            note = (f"it is declared at {place}",)
            self.report.error("E118", f"there is already `{name}` in `knowledge`", span, "choose another name", note)
            return True
        earlier = self.variables.get(name)
        if earlier is None and name not in self.constants:
            return False
        where = {"whiteboard": "on the whiteboard", "machine": "in the machine", "state": "in the state"}
        what = f"a variable `{name}` {where[earlier.scope]}" if earlier else f"a parameter `{name}`"
        notes = (f"it is declared at {earlier.span}",) if earlier else ()
        self.report.error("E118", f"there is already {what}", span, "choose another name", notes)
        return True

    def _knowledge_taken(self, name: str, span: Span) -> bool:
        if name in self.world.tables or name in self.machines:
            self.report.error("E118", f"there is already something called `{name}`", span, "choose another name")
            return True
        return self._taken(name, span)

    def _declare(self, text: VariableText, full_name: str, scope: Scope, kind: str) -> Variable | None:
        if self._taken(text.name, text.span):
            return None
        value = default_value(text.type)
        if text.init is not None:
            constants_only = replace(scope, variables={})
            report = Report(self.report.vocabulary)
            given = read_value(report, text.init, text.type, constants_only, f"`{text.name}`")
            self.report.keep(report.diagnostics, self.broken)
            value = given if given is not None else value
        variable = Variable(full_name, text.type, value, "state" if kind == "state" else "machine", text.span)
        self.variables[text.name] = variable
        return variable

    # ------------------------------------------------------------ states

    def _state(self, text: StateText) -> State:
        outer = self.variables
        self.variables = dict(outer)
        prefix = f"{self.instance.name}.{text.name}"
        runs = self._runs(text)
        scope = replace(self._scope(self.variables), runs=runs)
        variables = tuple(
            v for v in (self._declare(d, f"{prefix}.{d.name}", scope, "state") for d in text.variables) if v
        )
        actions: dict[str, tuple[Statement, ...]] = {}
        for kind, parsed in text.actions.items():
            statements, diagnostics = check_actions(parsed, scope)
            self.report.keep(diagnostics, self.broken)
            actions[kind] = statements
            if "after" in parsed.fragment.text:
                self.timed.append(statements)
        transitions: list[Transition] = []
        for transition in text.transitions:
            try:
                guard = check_guard(transition.guard, scope)
            except DiagnosticError as e:
                self.report.keep(e.diagnostics, self.broken)
            else:
                if "after" in transition.text:
                    self.timed.append(guard)
                transitions.append(Transition(guard, transition.target, transition.text, transition.span))
        self.variables = outer
        return State(
            text.name, variables, actions.get("on_entry", ()), actions.get("on_exit", ()), actions.get("internal", ()),
            actions.get("on_suspend", ()), actions.get("on_resume", ()), tuple(transitions), text.span,
            text.stays, runs,
        )  # fmt: skip

    def _runs(self, text: StateText) -> tuple[str, ...]:
        if text.runs is not None and self.instance.surroundings:
            message, instead = NO_MACHINES
            self.report.error("E156", message, mark(text.runs), instead)
            return ()
        found = resolve_runs(self.report, text.runs, self.machines)
        for name, place in found:
            self.places.setdefault((self.instance.name, name), place)
        return tuple(name for name, _ in found)
