"""From a formula of linear temporal logic to a small Büchi automaton."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.labels import Alphabet, L, alphabet_of
from llfsm_verify.automata.ltl.expansion import Expansion
from llfsm_verify.automata.omega.augmented import Augmented, augment, is_obligation, minimal_weak, weak_components
from llfsm_verify.automata.omega.degeneralise import state_based
from llfsm_verify.automata.omega.pruning import useful
from llfsm_verify.automata.omega.reduction import closure, reduce_automaton, reduce_by_state
from llfsm_verify.automata.omega.subsets import Subsets, subsets
from llfsm_verify.automata.omega.symbolic import Arc, Symbolic, kept, merged_row, to_automaton
from llfsm_verify.limits import tick
from llfsm_verify.logic.formula import Formula, apply, atoms, is_plain
from llfsm_verify.logic.hierarchy import form
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import Simplifier

MAX_STATES = 4_000
MAX_TRANSITIONS = 100_000
MAX_SUBSETS = 300
MAX_STEPS = 20_000
STEPS_PER_TRANSITION = 20
MAX_OPPOSITE = 5_000
"""An obligation's deterministic automaton is not tried beyond these subsets, steps (and steps for each transition of
the other automaton), nor when the automaton of its complement has more transitions: it would hardly be the smaller one.
"""
FEW_STATES = 32
MANY_STATES = 500
MANY_TRANSITIONS = 2_000
MAX_LEVELS = 3
"""A conjunction or disjunction whose automaton has more states than a few, or passes so many states or transitions
before it is reduced, is also put together from automata of its parts (and these from theirs, so many levels down)."""


def translate(
    formula: Formula,
    atom_order: Sequence[str] | None = None,
    *,
    negate: bool = False,
    generalised: bool = True,
    closed: bool = False,
    max_states: int = MAX_STATES,
    max_transitions: int = MAX_TRANSITIONS,
    implies: Implication | None = None,
) -> Automaton:
    """The automaton of the words that satisfy `formula` (`negate`: that do not), each state with a non-empty language.

    `atom_order` gives the automaton's atoms (those of the formula by default; ValueError when one is missing, or when
    the formula has operators that are not of plain temporal logic). Not `generalised`: a Büchi automaton, with at most
    one acceptance set, in which all transitions of a state are, or none. `closed`: instead, the automaton of the words
    that no finite prefix shows to violate the formula; it has no acceptance sets.
    AutomatonTooLarge: the limits are passed by what is made before it is reduced. `implies`: see `Simplifier`.
    """
    keys = tuple(atoms(formula) if atom_order is None else atom_order)
    if not is_plain(formula):
        raise ValueError("only plain temporal logic is translated: no past, bounds or regular expressions")
    missing = [key for key in atoms(formula) if key not in keys]
    if missing:
        raise ValueError(f"atoms not listed: {', '.join(missing)}")
    simplifier = Simplifier(implies)
    simple = simplifier.simplify(nnf(formula, negate))
    used = atoms(simple)
    places = [keys.index(key) for key in used]
    translator = Translator(alphabet_of(len(used)), used, simplifier, max_states, max_transitions)
    graph = closure(translator.graph(simple)) if closed else translator.smallest(simple, generalised=generalised)
    return to_automaton(graph, keys, places)


class Translator(Generic[L]):
    """Translations over one alphabet, whose atom i is `keys[i]`."""

    def __init__(
        self,
        alphabet: Alphabet[L],
        keys: Sequence[str],
        simplifier: Simplifier,
        max_states: int = MAX_STATES,
        max_transitions: int = MAX_TRANSITIONS,
    ) -> None:
        self._alphabet = alphabet
        self._bits = {key: i for i, key in enumerate(keys)}
        self._simplifier = simplifier
        self._max_states = max_states
        self._max_transitions = max_transitions

    def graph(self, formula: Formula, max_transitions: int | None = None) -> Symbolic[L]:
        """The reduced automaton of `formula`, which is in negation normal form; the translator's limits by default."""
        most = self._max_transitions if max_transitions is None else min(max_transitions, self._max_transitions)
        return self._graph(self._simplifier.simplify(formula), MAX_LEVELS, most)

    def unreduced(self, formula: Formula, max_states: int, max_transitions: int) -> Symbolic[L]:
        """The same language without states of empty language, but not made smaller otherwise; beyond the limits
        AutomatonTooLarge."""
        simple = self._simplifier.simplify(formula)
        expansion = Expansion(self._alphabet, self._bits, self._simplifier.implies, max_transitions)
        return useful(expansion.graph(simple, max_states, max_transitions))

    def _graph(self, simple: Formula, levels: int, most: int) -> Symbolic[L]:
        """The automaton made at once, unless it is large and the one put together from parts is smaller."""
        parts = _parts(simple)
        if len(parts) < 2 or levels == 0:
            return self._expanded(simple, self._max_states, most)
        found: list[Symbolic[L]] = []
        try:
            states, transitions = min(MANY_STATES, self._max_states), min(MANY_TRANSITIONS, most)
            found.append(self._expanded(simple, states, transitions))
            if len(found[0].rows) <= FEW_STATES:
                return found[0]
        except AutomatonTooLarge:
            pass
        try:
            found.append(self._composed(simple, parts, levels - 1, most))
        except AutomatonTooLarge:
            pass
        if not found:
            return self._expanded(simple, self._max_states, most)
        return min(found, key=lambda graph: len(graph.rows))

    def _expanded(self, simple: Formula, max_states: int, max_transitions: int) -> Symbolic[L]:
        expansion = Expansion(self._alphabet, self._bits, self._simplifier.implies, max_transitions)
        return reduce_automaton(expansion.graph(simple, max_states, max_transitions))

    def _composed(self, simple: Formula, parts: Sequence[Formula], levels: int, most: int) -> Symbolic[L]:
        """From the automata of `parts`, the small ones first; what is put together is reduced before it goes on."""
        graphs = sorted((self._graph(part, levels, most) for part in parts), key=lambda graph: len(graph.rows))
        if simple.op in ("or", "F"):
            return reduce_automaton(union(graphs))
        total = graphs[0]
        for graph in graphs[1:]:
            total = reduce_automaton(intersection(total, graph, self._max_states, most))
        return total

    def smallest(self, formula: Formula, *, generalised: bool) -> Symbolic[L]:
        """The smaller of the reduced automaton and, for an obligation, the minimal deterministic weak one."""
        graph = self.graph(formula)
        small = graph if generalised else reduce_by_state(state_based(graph))
        if len(small.rows) > 1:
            weak = self._weak(formula, graph, len(small.rows))
            if weak is not None:
                small = weak
        return without_sets(small)

    def _weak(self, formula: Formula, graph: Symbolic[L], max_states: int) -> Symbolic[L] | None:
        """The minimal deterministic weak automaton; None: it is too large, or the language has none."""
        try:
            most = STEPS_PER_TRANSITION * (20 + sum(map(len, graph.rows)))
            determined = Determined(graph, MAX_SUBSETS, min(MAX_STEPS, most))
            weak = determined.minimal_weak()
            if len(weak.rows) > max_states:
                return None
            if form(formula).obligation:
                return weak
            opposite = self.graph(nnf(formula, negate=True), MAX_OPPOSITE)
            return weak if determined.is_obligation(opposite) else None
        except AutomatonTooLarge:
            return None


class Determined(Generic[L]):
    """An automaton with its subsets, and what the loops among them say about its language."""

    def __init__(self, graph: Symbolic[L], max_subsets: int, max_steps: int) -> None:
        """AutomatonTooLarge beyond the limits."""
        self.graph = graph
        self.subsets: Subsets[L] = subsets(graph, max_subsets, max_steps)
        self.augmented: Augmented[L] = augment(graph, self.subsets, max_steps)
        self._component = self.subsets.components()
        self._accepting = weak_components(self.augmented, self._component)

    def minimal_weak(self) -> Symbolic[L]:
        """If the language is an obligation: its minimal deterministic weak automaton, acceptance by states."""
        return useful(minimal_weak(self.graph.alphabet, self.subsets, self._component, self._accepting))

    def is_obligation(self, opposite: Symbolic[L]) -> bool:
        """Whether the language is an obligation; `opposite` is an automaton of its complement."""
        return is_obligation(self.subsets, self._component, self._accepting, opposite)


def _parts(simple: Formula) -> list[Formula]:
    """The formulas whose conjunction or disjunction `simple` is; itself if it is neither."""
    if simple.op in ("and", "or"):
        return list(simple.args)
    inner = simple.args[0] if simple.op in ("G", "F") else simple
    if inner.op == ("and" if simple.op == "G" else "or"):
        return [apply(simple.op, part) for part in inner.args]
    return [simple]


def without_sets(graph: Symbolic[L]) -> Symbolic[L]:
    """Without acceptance sets when all transitions are in all of them."""
    if any(acceptance != graph.full for row in graph.rows for _, acceptance, _ in row):
        return graph
    rows = tuple(tuple((label, 0, target) for label, _, target in row) for row in graph.rows)
    return Symbolic(graph.alphabet, rows, 0)


# ---- Automata of conjunctions and disjunctions from automata of the parts


def union(parts: Sequence[Symbolic[L]]) -> Symbolic[L]:
    """The words that one of `parts` accepts, at least one part: a choice at the first letter."""
    sets = max(part.sets for part in parts)
    full = (1 << sets) - 1
    rows: list[tuple[Arc[L], ...]] = [()]
    initial: list[Arc[L]] = []
    for part in parts:
        shift, always = len(rows), full & ~part.full  # a part with fewer sets meets the missing ones at every letter
        rows += (tuple((label, mask | always, target + shift) for label, mask, target in row) for row in part.rows)
        if part.rows:
            initial += rows[shift]
    if not initial:
        return Symbolic(parts[0].alphabet, (), 0)
    rows[0] = merged_row(initial)
    return kept(Symbolic(parts[0].alphabet, tuple(rows), sets), [True] * len(rows))


def intersection(left: Symbolic[L], right: Symbolic[L], max_states: int, max_steps: int) -> Symbolic[L]:
    """The words that both accept: the product. AutomatonTooLarge: it has more states or transitions."""
    if not left.rows or not right.rows:
        return Symbolic(left.alphabet, (), 0)
    numbers = {(0, 0): 0}
    queue = [(0, 0)]
    rows: list[tuple[Arc[L], ...]] = []
    made = 0
    for here, there in queue:
        tick()
        row: list[Arc[L]] = []
        for label, acceptance, target in left.rows[here]:
            for other, further, reached in right.rows[there]:
                both = label & other
                if both:
                    pair = (target, reached)
                    number = numbers.setdefault(pair, len(queue))
                    if number == len(queue):
                        queue.append(pair)
                        if len(queue) > max_states:
                            raise AutomatonTooLarge("states", max_states)
                    row.append((both, acceptance | further << left.sets, number))
        made += len(row)
        if made > max_steps:
            raise AutomatonTooLarge("transitions", max_steps)
        rows.append(merged_row(row))
    return Symbolic(left.alphabet, tuple(rows), left.sets + right.sets)
