"""Random problems with the reference's answers, and random step programs, drawn by Hypothesis from a seed.

The reference finds what is true of a small problem: all its configurations in plain Python, and all their runs against
each property. Steps are those of `backends.reference`. Of formulas the declarative tableau is searched (Lichtenstein
and Pnueli, POPL 1985), of regular expressions every rest that derivatives leave; nothing here is shared with an engine.
What the search finds is looked at once more by the definition (`logic.lasso`).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from itertools import count, product
from typing import TypeVar

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.automata.omega.emptiness import find_accepting_lasso
from llfsm_verify.backends.reference import Interpreter, evaluate
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.kripke.observing import observed_outputs
from llfsm_verify.logic import formula as f
from llfsm_verify.logic.expressions import derivative, letters, nullable
from llfsm_verify.logic.formula import FALSE, Formula
from llfsm_verify.logic.lasso import evaluate as holds_on
from llfsm_verify.logic.properties import Property, parse_properties
from llfsm_verify.logic.regular_evaluate import is_bad
from llfsm_verify.logic.word import CONNECTIVES
from llfsm_verify.logic.word import truth as state_truth
from llfsm_verify.program.program import Int, Program, Var
from llfsm_verify.testing.arrangements import Document, arrangements
from llfsm_verify.testing.conformance.outcome import Answers
from llfsm_verify.testing.programs import programs
from llfsm_verify.testing.properties import properties, regular_properties
from llfsm_verify.values import Value

Letter = frozenset[str]
Node = tuple[tuple[Value, ...], tuple[Value, ...]]
"""The values of the variables, and those of the outputs where the next step goes on with them."""
Truth = tuple[bool, ...]
"""Of the subformulas, in their order."""
TEMPORAL = ("X", "F", "G", "U", "W", "R", "M")
GUESSED = 6
"""Temporal subformulas up to which a formula is looked at."""


class TooLarge(Exception):
    """More than the reference looks at."""


@dataclass(slots=True)
class Space:
    """All configurations, and the letters of the steps between them; None: a step inside an observed cycle."""

    roots: list[tuple[Node, Letter]] = field(default_factory=list)
    edges: dict[Node, list[tuple[Node, Letter | None]]] = field(default_factory=dict)
    faults: set[str] = field(default_factory=set)
    """Their codes."""
    overflow: bool = False
    """A value leaves 64 bits."""


def explore(program: Program, most_nodes: int, most_steps: int) -> Space:
    """Breadth first. TooLarge: there are more configurations or steps."""
    interpreter, found, steps = Interpreter(program), Space(), 0
    variables = [v for v in program.vars if not v.output]
    outputs = [v for v in program.vars if v.output]
    fresh: dict[str, Value] = {v.name: v.init for v in outputs} | {program.cycle: 1}
    shown = observed_outputs(program)
    inputs = {f"input:{i.name}": i.init for i in program.inputs}
    for values in product(*map(_first_values, variables)):
        first = {v.name: value for v, value in zip(variables, values, strict=True)}
        seen: dict[str, Value] = first | {v.name: v.init for v in outputs}
        letter = frozenset(a.name for a in program.atoms if evaluate(a.expression, seen, inputs))
        found.roots.append(((values, tuple(fresh.values())), letter))
    todo = [node for node, _ in found.roots]
    for node in todo:
        if node in found.edges:
            continue
        found.edges[node] = []
        if len(found.edges) > most_nodes:
            raise TooLarge
        now = {v.name: value for v, value in zip(variables, node[0], strict=True)}
        before = dict(zip(fresh, node[1], strict=True))
        for process, after in interpreter.successors(now, before):
            steps += 1
            if steps > most_steps:
                raise TooLarge
            if after.overflow:
                found.overflow = True
                continue
            if after.fault is not None:
                found.faults.add(program.faults[after.fault].code)
                continue
            whole = program.observe == "ringlet" or process is None or after.outputs[program.cycle] == 1
            seen_next = frozenset(n for n, output in shown if after.outputs[output]) if whole else None
            kept = fresh if whole else after.outputs
            target = (tuple(after.values[v.name] for v in variables), tuple(kept[name] for name in fresh))
            found.edges[node].append((target, seen_next))
            todo.append(target)
        found.edges[node] = list(dict.fromkeys(found.edges[node]))
    return found


def _first_values(variable: Var) -> list[Value]:
    if not variable.free:
        return [variable.init]
    assert isinstance(variable.type, Int)
    values = range(variable.type.low, variable.type.high + 1)
    return list(values) if variable.length is None else list(product(values, repeat=variable.length))


def answers_to(problem: Problem, most_nodes: int, most_steps: int) -> Answers:
    """What is true of a problem, which has formulas without bounds and past, and regular expressions.

    A property is left out where runs end before its infinite ones tell. TooLarge: a limit, or a kind of fairness or
    formula that is not looked at here.
    """
    program = problem.program()
    if any(fair.premise is not None for fair in program.fairness):
        raise TooLarge
    space = explore(program, most_nodes, most_steps)
    ends = bool(space.faults) or space.overflow
    assumed = [p.formula for p in problem.assumptions if p.formula is not None]
    holds: dict[str, bool] = {}
    for line in problem.properties:
        if line.expression is not None:
            if assumed:
                raise TooLarge
            bad = _has_bad_prefix(line, space)
            if bad or not space.overflow:
                holds[line.name] = not bad
            continue
        if line.formula is None:
            raise TooLarge
        if _has_run([*assumed, f.negation(line.formula)], space, program):
            holds[line.name] = False
        elif not ends or (assumed and not space.overflow):
            holds[line.name] = True
    contradictory = bool(assumed) and not _has_run(assumed, space, program)
    faults = None if space.overflow else frozenset(space.faults)
    return Answers(holds, faults, None if contradictory and space.overflow else contradictory)


# ---------------------------------------------------------------- formulas


def _has_run(formulas: list[Formula], space: Space, program: Program) -> bool:
    """Whether some fair infinite run satisfies all formulas."""
    whole = f.conjunction(formulas)
    tableau = _Tableau(whole)
    fair = [condition.goal for condition in program.fairness]
    sets = len(tableau.temporal) + len(fair)

    def successors(node: tuple[Node, Truth]) -> Iterator[tuple[Letter | None, int, tuple[Node, Truth]]]:
        at, now = node
        kept = sum(1 << i for i, k in enumerate(tableau.temporal) if tableau.is_kept(k, now))
        for target, letter in space.edges[at]:
            if letter is None:
                yield None, 0, (target, now)
                continue
            went = sum(1 << len(tableau.temporal) + i for i, goal in enumerate(fair) if goal in letter)
            for later in tableau.truths(letter & tableau.atoms):
                if tableau.agrees(now, later):
                    yield letter, kept | went, (target, later)

    starts: dict[tuple[Node, Truth], Letter] = {}
    for root, letter in space.roots:
        for truth in tableau.truths(letter & tableau.atoms):
            if truth[-1]:
                starts[root, truth] = letter
    lasso = find_accepting_lasso(starts, successors, sets)
    if lasso is None:
        return False
    stem = [starts[lasso.start], *(letter for letter, _ in lasso.stem if letter is not None)]
    loop = [letter for letter, _ in lasso.loop if letter is not None]
    assert holds_on(whole, stem, loop), "the reference contradicts the definition"
    return True


class _Tableau:
    """Which subformulas are true at a letter, guessed, and whether the guesses at a letter and the next one agree."""

    def __init__(self, whole: Formula) -> None:
        self.nodes = f.postorder(whole)
        self._number = {node: i for i, node in enumerate(self.nodes)}
        self.temporal = [i for i, node in enumerate(self.nodes) if node.op in TEMPORAL]
        self.atoms = frozenset(f.atoms(whole))
        if len(self.temporal) > GUESSED or any(n.op not in (*TEMPORAL, *f.BOOLEAN) for n in self.nodes):
            raise TooLarge

    @cache  # noqa: B019 - a tableau is used once
    def truths(self, letter: Letter) -> list[Truth]:
        found = []
        for guess in product((False, True), repeat=len(self.temporal)):
            guessed = dict(zip(self.temporal, guess, strict=True))
            truth: list[bool] = []
            for i, node in enumerate(self.nodes):
                if node.op in ("true", "false"):
                    truth.append(node.op == "true")
                elif node.op == "atom":
                    truth.append(node.key in letter)
                elif i in guessed:
                    truth.append(guessed[i])
                else:
                    truth.append(CONNECTIVES[node.op]([truth[self._number[a]] for a in node.args]))
            found.append(tuple(truth))
        return found

    def _args(self, i: int, truth: Truth) -> tuple[bool, bool]:
        """The truth of both arguments of a temporal subformula; that of a single one twice."""
        args = self.nodes[i].args
        return truth[self._number[args[0]]], truth[self._number[args[-1]]]

    def agrees(self, now: Truth, later: Truth) -> bool:
        for i in self.temporal:
            (a, b), again = self._args(i, now), later[i]
            match self.nodes[i].op:
                case "X":
                    expected = self._args(i, later)[0]
                case "F":
                    expected = a or again
                case "G":
                    expected = a and again
                case "U" | "W":
                    expected = b or (a and again)
                case _:
                    expected = b and (a or again)
            if now[i] != expected:
                return False
        return True

    def is_kept(self, i: int, now: Truth) -> bool:
        """Whether what is said of a temporal subformula here is not put off to later letters."""
        a, b = self._args(i, now)
        match self.nodes[i].op:
            case "F" | "U":
                return not now[i] or b
            case "M":
                return not now[i] or (a and b)
            case "G":
                return now[i] or not a
            case "W":
                return now[i] or (not a and not b)
            case "R":
                return now[i] or not b
        return True


# ---------------------------------------------------------------- regular expressions


def _has_bad_prefix(line: Property, space: Space) -> bool:
    """Whether what some run shows is a bad prefix of the line."""
    assert line.expression is not None
    kind, whole, alphabet = line.kind, line.expression, letters(line.expression)
    assert kind in ("enforce", "forbid", "forbid initially")

    @cache
    def valuation(letter: Letter) -> frozenset[Formula]:
        return frozenset(a for a in alphabet if state_truth(a, letter))

    def read(rests: frozenset[Formula], shown: frozenset[Formula]) -> frozenset[Formula]:
        begun = rests | {whole} if kind == "forbid" else rests
        return frozenset(derivative(rest, shown.__contains__) for rest in begun) - {FALSE}

    seen: set[object] = set()
    todo: list[tuple[Node, frozenset[Formula], tuple[Letter, ...]]] = [
        (root, read(frozenset((whole,)), valuation(letter)), (letter,)) for root, letter in space.roots
    ]
    for node, rests, word in todo:
        key = (node, rests, valuation(word[-1]))
        if key in seen:
            continue
        seen.add(key)
        lost = not rests if kind == "enforce" else any(map(nullable, rests))
        if lost or (kind == "enforce" and is_bad(kind, whole, word)):
            return True
        if len(seen) > 5_000:
            raise TooLarge
        for target, letter in space.edges[node]:
            if letter is None or valuation(letter) == valuation(word[-1]):
                todo.append((target, rests, word))
            else:
                todo.append((target, read(rests, valuation(letter)), (*word, letter)))
    return False


T = TypeVar("T")

CONFIGURATIONS, STEPS = 120, 1_200
BATCH = 5
"""Drawn from one seed, since Hypothesis stays near where it began; some are too large for the reference, or void."""


@dataclass(frozen=True, slots=True)
class Drawn:
    """A random problem."""

    document: Document
    lines: str
    answers: Answers

    def problem(self) -> Problem:
        """A new one, with nothing lowered."""
        return _bound(self.document, self.lines)


def _bound(document: Document, lines: str) -> Problem:
    return bind(build_arrangement(document), parse_properties([Source("random.ltl", lines)]))


@cache
def problems(number: int, start: int) -> tuple[Drawn, ...]:
    """So many problems; the same for the same seed and release of Hypothesis."""
    found: list[Drawn] = []
    batches = (batch for i in count() for batch in _drawn(_texts(), BATCH, start + 1_000 * i))
    for document, lines in batches:
        drawn = _answered(document, lines)
        if drawn is not None:
            found.append(drawn)
        if len(found) == number:
            break
    return tuple(found)


@st.composite
def _texts(draw: st.DrawFn) -> tuple[Document, str]:
    """An arrangement with two formulas, two under an assumption, or two rules."""
    document = draw(arrangements(max_machines=2, max_states=3))
    arrangement = build_arrangement(document)
    if draw(st.integers(0, 2)) == 0:
        rules = [draw(regular_properties(arrangement)) for _ in range(2)]
        return document, "\n".join(f"{kind} p{i}: {text}" for i, (kind, text) in enumerate(rules))
    lines = [f"p{i}: {draw(properties(arrangement))}" for i in range(2)]
    if draw(st.booleans()):
        lines.append(f"assume a: {draw(properties(arrangement, max_leaves=2))}")
    return document, "\n".join(lines)


def _drawn(strategy: st.SearchStrategy[T], number: int, start: int) -> list[T]:
    found: list[T] = []

    @seed(start)
    @settings(
        max_examples=number, database=None, deadline=None, derandomize=False,
        phases=[Phase.generate], suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(strategy)
    def keep(value: T) -> None:
        found.append(value)

    keep()
    return found


@cache
def step_programs(number: int, start: int) -> tuple[Program, ...]:
    """So many step programs; the same for the same seed and release of Hypothesis."""
    found: list[Program] = []
    for i in count():
        found += _drawn(programs(), BATCH, start + 1_000 * i)
        if len(found) >= number:
            break
    return tuple(found[:number])


def _answered(document: Document, lines: str) -> Drawn | None:
    try:
        problem = _bound(document, lines)
        goals_of(problem)
        answers = answers_to(problem, CONFIGURATIONS, STEPS)
    except (DiagnosticError, TooLarge, OverflowError):  # a rule that nothing can break, or too much
        return None
    return Drawn(document, lines, answers) if answers.holds else None
