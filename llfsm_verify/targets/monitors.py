"""Properties that an image decides while it runs: their monitors, and the step program that shows what they read.

    $ llfsm build models/microwave/arrangement.yaml --target c --for none --monitor properties/microwave.ltl -o oven
    property                 states  atoms  tables    RAM
    R1_sets_a_minute              4      4    48 B    5 B
    …
    23 monitors: 962 bytes of tables, 120 bytes of RAM, at most 403 operations a step
    …

Mistakes:

    a.ltl:1:1: error[E432]: `served` is not monitorable: no word decides it
    a.ltl:2:12: error[E515]: `env` is the model of the surroundings, which is absent when the arrangement runs
    a.ltl:3:1: error[E516]: the monitor of `slow` is too large: the automaton has more than 4,000 states
    a.ltl:4:9: error[E517]: `n + 1 > 3` may leave 64 bits, which a monitor on board cannot say

All mistakes are told, and then nothing is written.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.lookup import MonitorTooLarge, WalkTable, walk_table
from llfsm_verify.monitoring.machine import not_monitorable
from llfsm_verify.monitoring.machine_reads import surroundings_in
from llfsm_verify.monitoring.properties import Monitored, Timing, monitor_properties
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from llfsm_verify.program.program import Block, Choice, Const, Expr, Get, If, Local, Program, Sample, Set, Stmt, Switch
from llfsm_verify.program.terms import get
from llfsm_verify.program.trees import distinct_nodes, rebuilt, statements, with_branches, without
from llfsm_verify.targets import ABSENT, TOO_LARGE

LOOK_UP: Final = {"size": 24, "speed": 256}
"""How many bytes of tables a look-up less is worth, by `--optimize`: its code takes that many on a small machine."""


@dataclass(frozen=True, slots=True)
class OnBoard:
    """A property with its monitor, and the tables that it walks (`walk_table`, a short one)."""

    line: Property
    monitor: Monitor
    table: WalkTable

    @property
    def atoms(self) -> tuple[str, ...]:
        """The atoms that its table reads."""
        return tuple(self.monitor.atoms[place] for place in self.table.places)

    def state_of(self, verdict: MonitorVerdict) -> int | None:
        """The number of the state with a verdict."""
        found = (q for q, known in enumerate(self.monitor.verdicts) if known is verdict)
        return next((self.table.numbers[q] for q in found), None)

    @property
    def hopeless(self) -> int | None:
        """The number of the state that is never left and has no verdict."""
        found = (q for q, hopeless in enumerate(self.monitor.hopeless) if hopeless)
        return next((self.table.numbers[q] for q in found if self.table.numbers[q] >= self.table.settled), None)


@dataclass(frozen=True, slots=True)
class Watched:
    """A program with the monitors that go with it. `atoms`: what they read, over the state after a ringlet; `first`:
    the same over the state before the first one."""

    program: Program
    monitors: tuple[OnBoard, ...]
    atoms: Mapping[str, Expr]
    first: Mapping[str, Expr]


def watched(given: Arrangement, image: Arrangement, properties: PropertySet, optimize: str = "speed") -> Watched:
    """The program of an image with monitors of properties; `given`: the arrangement before `images.image_of`.

    DiagnosticError with all that is wrong: with the properties, that cannot be monitored (E432), that speaks of the
    surroundings (E515), or is too large (E516).
    """
    problems: list[Diagnostic] = []
    there: list[Property] = []
    for line in properties.properties:
        warning = surroundings_in(line.atoms, given) if given.plants else None
        if warning is None:
            there.append(line)
        else:
            problems.append(replace(warning, code=ABSENT))
    problem = None
    try:
        problem = bind(image, replace(properties, properties=tuple(there)))
        made = tuple(_monitors(problem, problems, LOOK_UP[optimize]))
    except DiagnosticError as error:
        problems += error.diagnostics
    if problems or problem is None:
        raise DiagnosticError(list(dict.fromkeys(problems)))
    used = {key for found in made for key in found.atoms}
    observed = tuple(atom for atom in problem.atoms if atom.name in used)
    return _apart(problem.programs.of(image, observed, keep_all_bits=True), made)


def _monitors(problem: Problem, problems: list[Diagnostic], look_up: int) -> Iterator[OnBoard]:
    """The monitors of all properties; what is wrong is added to `problems`."""
    for goal in goals_of(problem):
        line = goal.line
        try:
            monitor = monitor_properties(line, problem.assumptions, Timing(problem.clock)).monitor
            if monitor.hopeless[0]:
                problems.append(not_monitorable(Monitored(line, monitor)))
                continue
            yield OnBoard(line, monitor, walk_table(monitor, look_up=look_up))
        except (AutomatonTooLarge, MonitorTooLarge) as limit:
            message = f"the monitor of `{line.name}` is too large: {limit}"
            hint = "bound it more tightly, or let `llfsm check-recording` decide it afterwards"
            problems.append(Diagnostic(TOO_LARGE, message, line.span, hint=hint))
        except DiagnosticError as error:
            problems += error.diagnostics


def _apart(program: Program, monitors: tuple[OnBoard, ...]) -> Watched:
    """The atoms taken out of the program's steps. Those stay that read inputs, which no state has, or ask theories."""
    outputs = {a.output for a in program.atoms}
    shown = {s.var: s.value for s in statements(program.letter) if isinstance(s, Set) and s.var in outputs}
    sampled = {name for name, e in shown.items() if any(isinstance(node, Local) for node in distinct_nodes(e))}
    taken = outputs - sampled
    letter = without(program.letter, lambda s: isinstance(s, Set) and s.var in taken)
    program, letter = _one_choice_an_input(program, letter)
    atoms = {a.name: get(a.output, a.expression.type) if a.output in sampled else a.expression for a in program.atoms}
    first = {a.name: _at_first(program, a.expression) for a in program.atoms}
    program = replace(
        program,
        vars=tuple(v for v in program.vars if v.name not in taken),
        atoms=tuple(a for a in program.atoms if a.output not in taken),
        letter=letter,
        letter_stutter=(),
    )
    return Watched(program, monitors, atoms, first)


def _one_choice_an_input(program: Program, letter: Block) -> tuple[Program, Block]:
    """The program in which the letter samples an input by the choice of its ringlets: an image holds its inputs."""
    kept: dict[str, Choice] = {}
    names: dict[str, str] = {}
    for choice in program.choices:
        own = kept.setdefault(choice.input or choice.name, choice)
        names[choice.name] = own.name
    for of, choice in kept.items():
        if choice.name.endswith("#letter"):
            kept[of] = replace(choice, name=of)
            names = {old: of if new == choice.name else new for old, new in names.items()}
    return replace(program, choices=tuple(kept.values())), tuple(_resampled(letter, names))


def _resampled(block: Block, names: Mapping[str, str]) -> Iterator[Stmt]:
    for statement in block:
        if isinstance(statement, If | Switch):
            yield with_branches(statement, lambda inner: tuple(_resampled(inner, names)))
        elif isinstance(statement, Sample):
            yield Sample(statement.local, names[statement.choice])
        else:
            yield statement


def _at_first(program: Program, atom: Expr) -> Expr:
    """An atom over the initial configuration, which is known but for inputs that never change."""
    variables = {v.name: v for v in program.vars}
    inputs = {f"input:{i.name}": i.init for i in program.inputs}

    def known(node: Expr) -> Expr | None:
        if isinstance(node, Local):
            return Const(inputs[node.name], node.type)
        if not isinstance(node, Get) or variables[node.var].free:
            return None
        init = variables[node.var].init
        if isinstance(init, int):
            return Const(init, node.type)
        return Const(init[node.index.value], node.type) if isinstance(node.index, Const) else None

    return rebuilt(atom, known)
