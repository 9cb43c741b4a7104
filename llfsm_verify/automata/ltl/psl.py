"""Formulas with regular expressions as automata: a plain formula, and beside it a small automaton for each expression.

In negation normal form an expression's subformula has one polarity. It becomes an atom that starts a module; the module
reads the word from there and may demand another atom, which stands for the formula after the expression.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.boolean import Guard, Guards
from llfsm_verify.automata.finite.expressions import FiniteAutomaton, nondeterministic, useful_states
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.products import explore
from llfsm_verify.automata.omega.reduction import smaller
from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.formula import BINDING, EXPRESSIONS, TRUE, Formula, apply, atom, atoms, conjunction, is_boolean
from llfsm_verify.logic.rewriting.normal_form import NORMAL, rewritten

MAX_STATES = 4_000
MAX_EDGES = 100_000

Sort = Literal["every", "some", "closure", "no closure"]
ModuleState = tuple[frozenset[int], frozenset[int]]
"""The states of the expression's automaton in which obligations wait, and those of them of the current round."""


@dataclass(frozen=True, slots=True)
class _Move:
    guard: Guard
    demands: bool
    round_over: bool
    target: ModuleState


@dataclass(frozen=True, slots=True)
class _Module:
    """What an expression's subformula demands of the words from each place where its atom `start` holds.

    `every`: at the end of every match `demand` holds; `some`: at the end of some match it does; `closure`: every
    beginning can become a match, until there is one; `no closure`: some beginning cannot, and no match came before.
    """

    sort: Sort
    start: str
    demand: Formula
    """A state formula, or an atom of its own."""
    automaton: FiniteAutomaton

    @property
    def has_rounds(self) -> bool:
        """Whether obligations must not wait forever."""
        return self.sort in ("some", "no closure")

    def moves(self, state: ModuleState, started: bool) -> Iterator[_Move]:
        """What can be done with one letter; obligations of a round are all discharged before the next one starts."""
        waiting = state[0] | {0} if started else state[0]
        watched = (state[1] or waiting) if self.has_rounds else frozenset()
        if self.sort in ("every", "no closure"):
            yield from self._all_runs(waiting, watched)
        else:
            yield from self._one_run_each(sorted(waiting), watched)

    def _all_runs(self, waiting: frozenset[int], watched: frozenset[int]) -> Iterator[_Move]:
        edges, accepting = self.automaton.edges, self.automaton.accepting
        guards = self.automaton.guards
        leaving = [(g, t, q in watched) for q in sorted(waiting) for g, t in edges[q]]
        for part, inside in guards.partition(g for g, _, _ in leaving).items():
            targets = frozenset(t for g, t, _ in leaving if g in inside)
            left = frozenset(t for g, t, w in leaving if w and g in inside)
            matched = any(accepting[t] for t in targets)
            if matched and self.sort == "no closure":
                continue
            yield _Move(part, matched, not left, (targets, left))

    def _one_run_each(self, waiting: list[int], watched: frozenset[int]) -> Iterator[_Move]:
        edges, accepting = self.automaton.edges, self.automaton.accepting
        # A run that can end in a match may also go on, unless ending demands nothing more.
        options = [
            [
                (g, None if end else t, q in watched)
                for g, t in edges[q]
                for end in (
                    (True,) if accepting[t] and self.demand is TRUE else (True, False) if accepting[t] else (False,)
                )
            ]
            for q in waiting
        ]
        for choice in product(*options):
            guard = self.automaton.guards.always
            for g, _, _ in choice:
                guard = guard & g
            if guard:
                targets = frozenset(t for _, t, _ in choice if t is not None)
                left = frozenset(t for _, t, w in choice if w and t is not None)
                yield _Move(guard, any(t is None for _, t, _ in choice), not left, (targets, left))


def expression_automaton(formula: Formula, atom_order: Sequence[str], fresh: Sequence[str] = ()) -> Automaton:
    """The automaton of `formula`, of the operators of plain temporal logic and of `BINDING`, over `atom_order`.

    `fresh` are atoms of the formula to be chosen freely in each letter (see `project`). AutomatonTooLarge: a limit.
    Source for rounds: Miyano and Hayashi, Alternating finite automata on ω-words, TCS 32 (1984).
    """
    everything = (*atom_order, *fresh)
    guards = Guards(everything)
    plain, modules = _separated(formula, guards)
    started = [m.start for m in modules]
    demanded = [m.demand.key for m in modules if m.demand.key.startswith(HIDDEN + "then")]
    main = translate(plain, (*everything, *started, *demanded))
    return smaller(_Product(main, modules, guards, len(everything), len(atom_order)).automaton())


_Node = tuple[int, tuple[ModuleState, ...]]
"""A state of the plain formula's automaton, and those of the modules."""


class _Product:
    def __init__(self, main: Automaton, modules: list[_Module], guards: Guards, visible: int, kept: int) -> None:
        self._main, self._modules, self._guards = main, modules, guards
        self._visible, self._kept = (1 << visible) - 1, (1 << kept) - 1
        self._atoms = main.atoms[:kept]
        bits = {key: 1 << i for i, key in enumerate(main.atoms)}
        self._starts = [bits[m.start] for m in modules]
        self._demands = [bits[m.demand.key] if m.demand.key.startswith(HIDDEN + "then") else 0 for m in modules]
        self._conditions = [
            guards.always if d else guards.of(m.demand) for m, d in zip(modules, self._demands, strict=True)
        ]
        marks = main.acceptance_sets
        self._marks = []
        for m in modules:
            self._marks.append(1 << marks if m.has_rounds else 0)
            marks += m.has_rounds
        self._sets = marks
        self._known: dict[tuple[int, ModuleState, bool], list[_Move]] = {}

    def automaton(self) -> Automaton:
        if self._main.is_empty:
            return Automaton(self._atoms, (), 0)
        empty: ModuleState = (frozenset(), frozenset())
        first = (0, (empty,) * len(self._modules))
        return explore(first, self._following, self._atoms, self._sets, MAX_STATES, MAX_EDGES)

    def _following(self, node: _Node) -> Iterator[tuple[int, int, _Node, int]]:
        for edge in self._main.edges[node[0]]:
            for guard, acceptance, after in self._joint(edge, node[1]):
                for positive, negative in self._guards.cubes(guard):
                    yield positive & self._kept, negative & self._kept, (edge.target, after), acceptance

    def _joint(
        self, edge: Edge, states: tuple[ModuleState, ...]
    ) -> Iterator[tuple[Guard, int, tuple[ModuleState, ...]]]:
        """The ways in which all modules can go along with a transition of the plain formula."""
        label = self._guards.cube(edge.positive & self._visible, edge.negative & self._visible)
        partial: list[tuple[Guard, int, tuple[ModuleState, ...]]] = [(label, edge.acceptance, ())]
        for i, state in enumerate(states):
            longer = []
            for guard, acceptance, before in partial:
                for move in self._moves(i, state, bool(edge.positive & self._starts[i])):
                    tick()
                    if move.demands and edge.negative & self._demands[i]:
                        continue
                    common = guard & move.guard
                    if move.demands:  # an atom demanded that the transition does not mention may well hold
                        common = common & self._conditions[i]
                    if common:
                        mark = self._marks[i] if move.round_over else 0
                        longer.append((common, acceptance | mark, (*before, move.target)))
            if len(longer) > MAX_EDGES:
                raise AutomatonTooLarge("transitions", MAX_EDGES)
            partial = longer
        yield from partial

    def _moves(self, i: int, state: ModuleState, started: bool) -> list[_Move]:
        key = (i, state, started)
        if key not in self._known:
            moves: list[_Move] = []
            for move in self._modules[i].moves(state, started):
                moves.append(move)
                if len(moves) > MAX_EDGES:
                    raise AutomatonTooLarge("transitions", MAX_EDGES)
            self._known[key] = moves
        return self._known[key]


# ---------------------------------------------------------------- the plain formula, and the modules


def _separated(formula: Formula, guards: Guards) -> tuple[Formula, list[_Module]]:
    """`formula` in negation normal form with atoms in place of its expressions, and their modules."""
    modules: dict[tuple[Sort, Formula, Formula], _Module] = {}
    laws: list[Formula] = []

    def module(sort: Sort, expression: Formula, after: Formula) -> Formula:
        key = (sort, expression, after)
        if key not in modules:
            number = len(modules)
            demand = after
            if not is_boolean(after) or any(k.startswith(HIDDEN + "module") for k in atoms(after)):
                demand = atom(f"{HIDDEN}then{number}")
                laws.append(apply("G", apply("implies", demand, after)))
            automaton = nondeterministic(expression, guards)
            if sort in ("closure", "no closure"):
                automaton = _trimmed(automaton)
            modules[key] = _Module(sort, f"{HIDDEN}module{number}", demand, automaton)
        return atom(modules[key].start)

    def rewrite(node: Formula, negative: bool, of: Callable[[Formula, bool], Formula]) -> Formula:
        if node.op in EXPRESSIONS:
            return node
        if node.op == "closure":
            return module("no closure" if negative else "closure", node.args[0], TRUE)
        if node.op in BINDING:
            sort: Sort = "every" if (node.op == "[]->") != negative else "some"
            return module(sort, node.args[0], of(node.args[1], negative))
        return NORMAL(node, negative, of)

    plain = rewritten(formula, False, rewrite)[formula, False]
    return conjunction((plain, *laws)), list(modules.values())


def _trimmed(automaton: FiniteAutomaton) -> FiniteAutomaton:
    """Only edges to states from which a match is possible."""
    useful = useful_states(automaton)
    edges = tuple(tuple((g, t) for g, t in row if t in useful) for row in automaton.edges)
    return FiniteAutomaton(automaton.guards, edges, automaton.accepting)
