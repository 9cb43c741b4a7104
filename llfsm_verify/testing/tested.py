"""What a random test runs: an arrangement, the monitors of its properties, what nothing finite can test, and the values
at which something changes, which are around the constants that a step program compares its choices with.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic import codes
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.properties import Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.program.dependence import blocks, decided_by, uses
from llfsm_verify.program.program import (
    Block,
    Choice,
    Const,
    Emit,
    Expr,
    Fault,
    Int,
    Let,
    Op,
    Program,
    Sample,
    Set,
    Switch,
)
from llfsm_verify.program.trees import nodes as expression_nodes
from llfsm_verify.program.trees import statements
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import Shown, shown

SMALL = 16
"""A type with at most so many values is tried whole."""


class UntestedWarning(UserWarning):
    """Properties that random runs cannot find violated, or not every violation of them."""


@dataclass(frozen=True, slots=True)
class Untested:
    """A property that is not tested, or (`partly`) not every violation of which is; `reason` in words."""

    line: Property
    reason: str
    partly: bool

    @property
    def diagnostic(self) -> Diagnostic:
        message = f"`{self.line.name}` is tested in part only" if self.partly else f"`{self.line.name}` is not tested"
        hint = "check it with `llfsm verify`, or do without `strict`"
        return Diagnostic("E471" if self.partly else "E470", f"{message}: {self.reason}", self.line.span, hint=hint)


@dataclass(frozen=True, slots=True)
class Stimulus:
    """What a test sets and holds: an input (a scalar of it), or the age of an untimed state.

    `boundaries` are the values around the constants that it is compared with, as numbers. An input that is not sampled
    once a ringlet has single reads, the `choices`, each of which can have a value of its own. `often`: it may change in
    every ringlet, not only between cycles. `start` is the `init` of an input, 0 of an age.
    """

    name: str
    type: Int
    labels: tuple[str, ...]
    start: int
    boundaries: tuple[int, ...]
    choices: tuple[str, ...]
    often: bool

    @property
    def is_small(self) -> bool:
        """Its values are so few that each is as likely as another."""
        return self.type.high - self.type.low < SMALL

    @property
    def likely(self) -> list[Shown]:
        """All values of a small type, else those around which something changes; the first one first, then near 0."""
        found = range(self.type.low, self.type.high + 1) if self.is_small else (self.start, *self.boundaries)
        return [self.shown(v) for v in sorted(set(found), key=lambda v: (v != self.start, abs(v), v))]

    def shown(self, value: int) -> Shown:
        """A number as users write it."""
        return shown(self.type, self.labels, value)


class Tested:
    """An arrangement to be run at random, with the monitors of those of its properties that finite runs can violate.

    Compiled once, when it is first run.
    """

    def __init__(
        self, arrangement: Arrangement, properties: PropertySet | None = None, given: Sequence[str | Path] = ()
    ) -> None:
        """`given` is what `properties` were read from, for programs that repeat a run.

        Raises DiagnosticError: the properties do not fit the arrangement (E1xx, E33x), or are void (E342, E344).
        """
        self.arrangement = arrangement
        self.properties = properties if properties is not None else PropertySet()
        self.given = tuple(given) or _written(self.properties)
        problem = bind(arrangement, self.properties)
        self.program = lower(arrangement, problem.atoms, keep_all_bits=True)
        self.tested: dict[str, Property] = {}
        """By name: the properties whose monitors watch each run."""
        self.monitors: dict[str, Monitor] = {}
        """By name: the monitors of `tested`."""
        self.untested: list[Untested] = []
        """The others, and those of `tested` that some infinite runs violate without a bad prefix."""
        timing = Timing(problem.clock)
        for goal in goals_of(problem):
            line = goal.line
            try:
                monitor = monitor_properties(line, self.properties.assumptions, timing).monitor
                safe = goal.is_safe()
            except AutomatonTooLarge as limit:
                self.untested.append(Untested(line, str(limit), False))
                continue
            except DiagnosticError as error:
                if any(d.code != codes.AUTOMATON_COMPLEMENT for d in error.diagnostics):
                    raise
                self.untested.append(Untested(line, error.diagnostics[0].message, False))
                continue
            if MonitorVerdict.FALSE not in monitor.verdicts:
                self.untested.append(Untested(line, "no finite run violates it", False))
                continue
            self.tested[line.name], self.monitors[line.name] = line, monitor
            if not safe:
                self.untested.append(Untested(line, "not every run that violates it has a finite part that does", True))

    def demand_all(self) -> None:
        """DiagnosticError (E470, E471) when something is untested."""
        if self.untested:
            raise DiagnosticError(one.diagnostic for one in self.untested)

    @property
    def untested_text(self) -> str:
        """What is not tested, in a sentence; empty when everything is."""
        parts: dict[str, list[str]] = {}
        for one in self.untested:
            words = f"{'tested in part' if one.partly else 'not tested'} ({one.reason})"
            parts.setdefault(words, []).append(one.line.name)
        said = "; ".join(f"{words}: {', '.join(names)}" for words, names in parts.items())
        return f"{self.arrangement.name}: {said}. `llfsm verify` decides them." if said else ""

    @cached_property
    def simulation(self) -> MonitoredSimulation:
        """The simulation that runs are made `anew` from."""
        return MonitoredSimulation(self.program, self.monitors)

    @cached_property
    def execution(self) -> Execution:
        """What shows runs that do not fail."""
        return Execution(self.program)

    # ------------------------------------------------------------ what can be set

    @cached_property
    def stimuli(self) -> Mapping[str, Stimulus]:
        """What a test may change, by name."""
        near = boundaries(self.program)
        inits = {i.name: i.init for i in self.program.inputs}
        stored = {v.name: v.init for v in self.program.vars if v.origin.kind == "input" and isinstance(v.init, int)}
        grouped: dict[str, list[Choice]] = {}
        for choice in self.program.choices:
            grouped.setdefault(choice.source, []).append(choice)
        stimuli = {}
        for name, choices in grouped.items():
            one = choices[0]
            start = inits[name] if name in inits else stored[name] if one.input else one.type.low
            names = tuple(c.name for c in choices if c.name != name)
            stimuli[name] = Stimulus(name, one.type, one.labels, start, near[name], names, name in inits)
        return stimuli

    @cached_property
    def free(self) -> Mapping[str, Stimulus]:
        """Inputs that have any value at first and keep it."""
        near = boundaries(self.program)
        found = {}
        for v in self.program.vars:
            if v.free:
                assert isinstance(v.type, Int), "inputs are bounded"
                assert isinstance(v.init, int), "inputs are scalars here"
                found[v.name] = Stimulus(v.name, v.type, v.origin.labels, v.init, near[v.name], (), False)
        return found

    @property
    def by_cycle(self) -> bool:
        """Nothing that a test sets matters between two ends of cycles: stretches count cycles."""
        return len(self.program.processes) == 1 and not any(k.often for k in self.stimuli.values())

    @property
    def cycle_length(self) -> int:
        """Ringlets in a cycle of all processes together, at most."""
        return len(self.program.slots)

    @cached_property
    def longest(self) -> int:
        """Cycles in a stretch, at most."""
        return longest_wait(self.program)


def _written(properties: PropertySet) -> tuple[str, ...]:
    """The lines of properties as texts that can be read again, one for each syntax."""
    texts: dict[str, list[str]] = {}
    for p in properties:
        kind = "" if p.kind == "ltl" else f"{p.kind} "
        header = [] if p.syntax == "llfsm" else [f"# syntax: {p.syntax}"]
        texts.setdefault(p.syntax, header).append(f"{kind}{p.name}: {p.text}")
    return tuple("\n".join(lines) for lines in texts.values())


COMPARISONS = frozenset({"eq", "ne", "lt", "le", "gt", "ge"})
MAX_CONSTANTS = 200
"""An input that is compared with more constants is given these first ones."""

Node = str | tuple[int, str]
"""A variable by its name, a local by the `id` of its block and its name."""


@dataclass(frozen=True, slots=True)
class _Flow:
    """Where values go, whatever the order of statements, and what they are compared with."""

    targets: dict[Node, set[Node]] = field(default_factory=dict)
    sampled: dict[str, set[Node]] = field(default_factory=dict)
    """By choice: the locals that hold it."""
    compared: dict[Node, dict[int, None]] = field(default_factory=dict)


def boundaries(program: Program) -> Mapping[str, tuple[int, ...]]:
    """By the name of each input, age or free variable: the values around what it is compared with, and its extremes.

    Those are c - 1, c and c + 1 for each constant c of a comparison, or a switch, in which a value computed from the
    input stands (and of c divided by what it is multiplied by), as far as they are in its type; ascending, without
    repetitions. What a value is computed from is taken from all statements together, so there may be some too many.
    """
    flow = _Flow()
    for block, _ in blocks(program):
        _read(block, flow)
    found: dict[str, set[int]] = {}
    starts = [(c.input or c.name, c.type, flow.sampled.get(c.name, set())) for c in program.choices]
    starts += [(v.name, v.type, {v.name}) for v in program.vars if v.free and isinstance(v.type, Int)]
    for name, kind, nodes in starts:
        constants: dict[int, None] = {}
        for node in _reached(flow, nodes):
            constants |= flow.compared.get(node, {})
        near = {v for c in list(constants)[:MAX_CONSTANTS] for v in (c - 1, c, c + 1) if kind.low <= v <= kind.high}
        found.setdefault(name, set()).update(near | {kind.low, kind.high})
    return {name: tuple(sorted(values)) for name, values in found.items()}


def longest_wait(program: Program, limit: int = 512) -> int:
    """So many cycles may go by until a clock has run out, or a counter has counted: at least 16.

    That is twice the largest clock, or the largest extent of a variable, where that is at most `limit`.
    """
    found = 16
    for var in program.vars:
        if var.output or not isinstance(var.type, Int):
            continue
        extent = var.type.high - var.type.low
        if var.name.endswith(".$clock"):
            found = max(found, 2 * extent + 2)
        elif var.origin.kind not in ("control", "input") and not var.origin.labels and extent <= limit:
            found = max(found, extent + 1)
    return found


def _read(block: Block, flow: _Flow) -> None:
    key = id(block)
    for statement in statements(block):
        if isinstance(statement, Sample):
            flow.sampled.setdefault(statement.choice, set()).add((key, statement.local.name))
        elif isinstance(statement, Let):
            _moves((key, statement.local.name), statement.value, key, flow)
        elif isinstance(statement, Set):
            _moves(statement.var, statement.value, key, flow)
            if statement.index is not None:
                _compares(statement.index, key, flow)
        elif isinstance(statement, Fault):
            _compares(statement.when, key, flow)
        elif not isinstance(statement, Emit):
            decided = decided_by(statement)
            _compares(decided, key, flow)
            if isinstance(statement, Switch):
                for node in _nodes(decided, key):
                    flow.compared.setdefault(node, {}).update((value, None) for value, _ in statement.cases)


def _moves(target: Node, value: Expr, key: int, flow: _Flow) -> None:
    _compares(value, key, flow)
    for node in _nodes(value, key):
        flow.targets.setdefault(node, set()).add(target)


def _compares(expression: Expr, key: int, flow: _Flow) -> None:
    """Note the constants of every comparison in `expression`."""
    for part in expression_nodes(expression):
        if isinstance(part, Op) and part.op in COMPARISONS:
            constants = {p.value: None for p in expression_nodes(part) if isinstance(p, Const)}
            factors = [f for p in expression_nodes(part) if isinstance(p, Op) and p.op == "mul" for f in p.args]
            sizes = [f.value for f in factors if isinstance(f, Const) and f.value > 1]
            constants |= {c // size: None for size in sizes for c in constants}
            for node in _nodes(part, key):
                flow.compared.setdefault(node, {}).update(constants)


def _nodes(expression: Expr, key: int) -> Iterator[Node]:
    used = uses(expression)
    yield from used.variables
    yield from ((key, name) for name in used.locals)


def _reached(flow: _Flow, nodes: set[Node]) -> set[Node]:
    """All that is computed from some nodes, themselves included."""
    todo, marked = list(nodes), set(nodes)
    while todo:
        for target in flow.targets.get(todo.pop(), ()):
            if target not in marked:
                marked.add(target)
                todo.append(target)
    return marked
