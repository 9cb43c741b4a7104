"""The place of a property in the hierarchy of Manna and Pnueli, decided by its meaning."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from functools import partial

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.labels import L, alphabet_of
from llfsm_verify.automata.ltl.translate import MAX_STATES, MAX_TRANSITIONS, Translator
from llfsm_verify.automata.omega.augmented import augment, persists
from llfsm_verify.automata.omega.pruning import useful
from llfsm_verify.automata.omega.reduction import reduce_automaton
from llfsm_verify.automata.omega.subsets import subsets
from llfsm_verify.automata.omega.symbolic import Symbolic, share_a_word
from llfsm_verify.limits import ticking
from llfsm_verify.logic.formula import Formula, atoms, is_plain
from llfsm_verify.logic.hierarchy import Form, form
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import Simplifier

MAX_SUBSETS = 5_000
MAX_STEPS = 200_000
MAX_PAIRS = 200_000
"""Sizes of subset constructions and of products at which the class is unknown."""
FEW_STATES, FEW_TRANSITIONS = 24, 200
"""Sizes up to which automata are not reduced before it is known whether the property is one of safety or guarantee."""


class PropertyClass(StrEnum):
    """The smallest class that a property belongs to; the values are the letters that users see."""

    BOTH = "B"
    """Safety and guarantee: decided by the first letters, as many as there are `X` in a row."""
    SAFETY = "S"
    """Every word that violates it has a finite prefix that no word satisfying it has."""
    GUARANTEE = "G"
    """Every word that satisfies it has a finite prefix that no word violating it has; also called co-safety."""
    OBLIGATION = "O"
    """A Boolean combination of safety and guarantee properties."""
    RECURRENCE = "R"
    """Some deterministic Büchi automaton accepts it."""
    PERSISTENCE = "P"
    """Its negation is a recurrence."""
    REACTIVITY = "T"
    """None of the above."""


@dataclass(frozen=True, slots=True)
class Membership:
    """The classes a property belongs to; None: not known, because a construction passed its limit."""

    safety: bool | None
    guarantee: bool | None
    recurrence: bool | None
    persistence: bool | None

    @property
    def smallest(self) -> PropertyClass | None:
        """The smallest class; None: what is not known could change it."""
        if self.safety is None or self.guarantee is None:
            return None
        if self.safety or self.guarantee:
            if self.safety and self.guarantee:
                return PropertyClass.BOTH
            return PropertyClass.SAFETY if self.safety else PropertyClass.GUARANTEE
        if self.recurrence is None or self.persistence is None:
            return None
        if self.recurrence and self.persistence:  # the obligations are just these
            return PropertyClass.OBLIGATION
        if self.recurrence:
            return PropertyClass.RECURRENCE
        return PropertyClass.PERSISTENCE if self.persistence else PropertyClass.REACTIVITY


def classify(
    formula: Formula, *, max_subsets: int = MAX_SUBSETS, simplifier: Simplifier | None = None
) -> PropertyClass | None:
    """The smallest class of `formula`; None: its automata are too large to tell. ValueError as for `translate`.

    Sources: Manna and Pnueli, A hierarchy of temporal properties, PODC 1990; for the procedure see `membership`.
    """
    return membership(formula, max_subsets=max_subsets, simplifier=simplifier).smallest


def membership(formula: Formula, *, max_subsets: int = MAX_SUBSETS, simplifier: Simplifier | None = None) -> Membership:
    """The classes that `formula` belongs to, each decided exactly or not at all.

    Safety: no word of the closure violates it (Alpern and Schneider 1987). Guarantee: the negation is safety.
    Persistence: by the augmented subset construction (Boker and Kupferman 2009), which needs no determinisation.
    Recurrence: the negation is persistence. What the form shows is taken from the form.
    `simplifier`: one that may have simplified other formulas.
    """
    shared, simple, keys = _simple(formula, simplifier)
    translator = Translator(alphabet_of(len(keys)), keys, shared, MAX_STATES, MAX_TRANSITIONS)
    sides = (simple, nnf(simple, negate=True))
    finish: Callable[[Symbolic[L]], Symbolic[L]] = reduce_automaton
    try:
        graph, opposite = (translator.unreduced(side, FEW_STATES, FEW_TRANSITIONS) for side in sides)
    except AutomatonTooLarge:
        try:
            graph, opposite = map(translator.graph, sides)
        except AutomatonTooLarge:
            return _by_form(form(simple))
        finish = _as_it_is
    return _decided(form(simple), graph, opposite, max_subsets, finish)


def closed_by_prefixes(
    formula: Formula,
    *,
    max_states: int = MAX_STATES,
    max_transitions: int = MAX_TRANSITIONS,
    max_pairs: int = MAX_PAIRS,
) -> bool | None:
    """Whether `formula` is a safety property: the first part of `membership`, with limits of its own."""
    simplifier, simple, keys = _simple(formula)
    translator = Translator(alphabet_of(len(keys)), keys, simplifier, max_states, max_transitions)

    def decide() -> bool:
        graph, opposite = translator.graph(simple), translator.graph(nnf(simple, negate=True))
        with _at_most(max_pairs):
            return _closure_avoids(graph, opposite)

    return _unless_too_large(decide)


def _simple(formula: Formula, simplifier: Simplifier | None = None) -> tuple[Simplifier, Formula, tuple[str, ...]]:
    """`formula` in simplified negation normal form, what simplified it, and its atoms."""
    if not is_plain(formula):
        raise ValueError("only plain temporal logic is classified: no past, bounds or regular expressions")
    simplifier = simplifier or Simplifier()
    simple = simplifier.simplify(nnf(formula))
    return simplifier, simple, atoms(simple)


def _by_form(shown: Form) -> Membership:
    """Without automata: what the form does not show is not known."""
    return Membership(
        shown.safety or None, shown.guarantee or None, shown.recurrence or None, shown.persistence or None
    )


def _as_it_is(graph: Symbolic[L]) -> Symbolic[L]:
    return graph


def of_automata(graph: Symbolic[L], opposite: Symbolic[L], *, max_subsets: int = MAX_SUBSETS) -> Membership:
    """`membership` of the language of `graph`; `opposite` is an automaton of the complement, over the same alphabet."""
    nothing = Form(False, False, False, False, False)
    return _decided(nothing, useful(graph), useful(opposite), max_subsets, _as_it_is)


def _decided(
    shown: Form,
    graph: Symbolic[L],
    opposite: Symbolic[L],
    max_subsets: int,
    finish: Callable[[Symbolic[L]], Symbolic[L]],
) -> Membership:
    """From automata with an accepted word from each state; `finish` makes them smaller when it is worth the time."""
    if not graph.rows or not opposite.rows:
        return Membership(True, True, True, True)

    def avoids(left: Symbolic[L], right: Symbolic[L]) -> bool | None:
        with _at_most(MAX_PAIRS):
            return _unless_too_large(lambda: _closure_avoids(left, right))

    def persistent(left: Symbolic[L], right: Symbolic[L]) -> bool | None:
        with _at_most(MAX_PAIRS):
            return _unless_too_large(lambda: _persists(left, right, max_subsets))

    safety = shown.safety or avoids(graph, opposite)
    guarantee = shown.guarantee or avoids(opposite, graph)
    if safety or guarantee:
        return Membership(safety, guarantee, True, True)
    if shown.recurrence and shown.persistence:
        return Membership(safety, guarantee, True, True)
    graph, opposite = finish(graph), finish(opposite)
    deterministic = [_unless_too_large(partial(_is_deterministic, side)) for side in (graph, opposite)]
    recurrence = shown.recurrence or deterministic[0] or persistent(opposite, graph)
    persistence = shown.persistence or deterministic[1] or persistent(graph, opposite)
    return Membership(safety, guarantee, recurrence, persistence)


def _closure_avoids(graph: Symbolic[L], opposite: Symbolic[L]) -> bool:
    """Whether no word of `opposite` has only prefixes of words of `graph`."""
    rows = [[(label, 0, target) for label, _, target in row] for row in graph.rows]
    return not share_a_word(rows, 0, opposite)


def _is_deterministic(graph: Symbolic[L]) -> bool:
    """No letter has two transitions from one state (in two acceptance sets of one target, or to two)."""
    for row in graph.rows:
        seen = graph.alphabet.false
        for label, _, _ in row:
            if seen & label:
                return False
            seen = seen | label
    return True


def _persists(graph: Symbolic[L], opposite: Symbolic[L], max_subsets: int) -> bool:
    found = subsets(graph, max_subsets, MAX_STEPS)
    return persists(augment(graph, found, MAX_STEPS), opposite)


def _unless_too_large(decide: Callable[[], bool]) -> bool | None:
    try:
        return decide()
    except AutomatonTooLarge:
        return None


def _at_most(pairs: int) -> AbstractContextManager[None]:
    """Within, what makes more than so many nodes raises AutomatonTooLarge."""
    left = pairs

    def counted() -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise AutomatonTooLarge("pairs of states", pairs)

    return ticking(counted)
