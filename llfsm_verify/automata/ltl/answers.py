"""Answers about formulas, remembered by the formulas' shape: a file of formulas repeats its patterns."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge
from llfsm_verify.automata.labels import alphabet_of
from llfsm_verify.automata.ltl import classes
from llfsm_verify.automata.ltl.classes import PropertyClass
from llfsm_verify.automata.ltl.satisfiability import satisfying_word
from llfsm_verify.automata.ltl.translate import translate, without_sets
from llfsm_verify.automata.ltl.translation import automaton_of
from llfsm_verify.automata.omega.degeneralise import state_based
from llfsm_verify.automata.omega.products import Letter, Word, accepted_word, common_word
from llfsm_verify.automata.omega.reduction import reduce_by_state
from llfsm_verify.automata.omega.symbolic import from_automaton, to_automaton
from llfsm_verify.logic.bounds import HIDDEN, rebuilt, without_steps
from llfsm_verify.logic.formula import Formula, apply, atom, atoms, is_plain, negation, postorder
from llfsm_verify.logic.rewriting.implication import MAX_ATOMS, Implication
from llfsm_verify.logic.rewriting.simplify import Simplifier

MAX_REMEMBERED = 4_096
MAX_NODES = 100
MAX_TRANSITIONS = 200
"""So many answers to each question are remembered, about formulas of so many subformulas, and automata of that size."""
MAX_IMPLICATIONS = 300_000
"""What was found out about pairs of formulas is forgotten when it is more than that."""

K = TypeVar("K")
T = TypeVar("T")
Names = dict[str, str]


class Answers:
    """Asks the other modules, and remembers. AutomatonTooLarge and Untranslatable come through from them."""

    def __init__(self) -> None:
        self._classes: dict[Formula, PropertyClass | None] = {}
        self._automata: dict[Formula, Automaton] = {}
        self._buchi: dict[Formula, Automaton] = {}
        self._words: dict[Formula, Word | None] = {}
        self._opposites: dict[Formula, Word | None] = {}
        self._implies = Implication()
        self._simplifier = Simplifier(self._implies)
        self._differences: dict[tuple[Formula, ...], Word | None] = {}

    def class_of(self, formula: Formula) -> PropertyClass | None:
        """`classify_any`."""
        ((name,), _) = shape(formula)
        simplifier = self._simplifier_for(name)
        return _remembered(self._classes, name, lambda: classify_any(name, simplifier=simplifier), name)

    def automaton(self, formula: Formula, *, buchi: bool = False) -> Automaton:
        """`automaton_of`, or `buchi_of`."""
        ((name,), names) = shape(formula)
        known = self._buchi if buchi else self._automata
        found = known.get(name)
        if found is None:
            found = _automaton(name, self._shared(name), buchi)
            if found.transitions <= MAX_TRANSITIONS:
                _remembered(known, name, lambda: found, name)
        return Automaton(tuple(names[key] for key in found.atoms), found.edges, found.acceptance_sets)

    def word(self, formula: Formula, *, negate: bool = False) -> Word | None:
        """A word that satisfies `formula` (`negate`: that does not); None: no word does."""
        ((name,), names) = shape(formula)
        known = self._opposites if negate else self._words
        found = _remembered(known, name, lambda: _word(name, negate, self._shared(name)), name)
        return _renamed(found, names)

    def difference(self, left: Formula, right: Formula) -> Word | None:
        """A word that satisfies `left` and not `right`; None: no word does."""
        pair, names = shape(left, right)
        shared = self._shared(*pair)
        found = _remembered(self._differences, pair, lambda: _difference(pair[0], pair[1], shared), *pair)
        return _renamed(found, names)

    def _shared(self, *formulas: Formula) -> Implication | None:
        """What is known of the atoms of shapes; None: there are so many that answers could depend on earlier ones."""
        if len(atoms(*formulas)) > MAX_ATOMS:
            return None
        if len(self._implies) > MAX_IMPLICATIONS:
            self._implies = Implication()
            self._simplifier = Simplifier(self._implies)
        return self._implies

    def _simplifier_for(self, formula: Formula) -> Simplifier | None:
        """One that remembers other formulas too: classes do not depend on how a formula is simplified."""
        return None if self._shared(formula) is None else self._simplifier


def _automaton(formula: Formula, implies: Implication | None, buchi: bool) -> Automaton:
    plain = without_steps(formula)
    if is_plain(plain):
        return translate(plain, atoms(formula), generalised=not buchi, implies=implies)
    return buchi_of(plain) if buchi else automaton_of(plain)


def _remembered(known: dict[K, T], name: K, ask: Callable[[], T], *asked: Formula) -> T:
    if name in known:
        return known[name]
    answer = ask()
    if len(postorder(*asked)) <= MAX_NODES:
        if len(known) >= MAX_REMEMBERED:
            del known[next(iter(known))]
        known[name] = answer
    return answer


def _word(formula: Formula, negate: bool, implies: Implication | None) -> Word | None:
    plain = without_steps(formula)
    if is_plain(plain):
        return satisfying_word(plain, negate=negate, implies=implies)
    return accepted_word(automaton_of(plain, negate=negate))


def _difference(left: Formula, right: Formula, implies: Implication | None) -> Word | None:
    if left is right:
        return None
    first, second = without_steps(left), without_steps(right)
    if is_plain(first) and is_plain(second):
        return satisfying_word(apply("and", first, negation(second)), implies=implies)
    keys = atoms(left, right)
    return common_word(automaton_of(first, keys), automaton_of(second, keys, negate=True))


def _renamed(word: Word | None, names: Names) -> Word | None:
    if word is None:
        return None

    def letters(part: tuple[Letter, ...]) -> tuple[Letter, ...]:
        return tuple(tuple((names[key], truth) for key, truth in letter) for letter in part)

    return letters(word[0]), letters(word[1])


# ---- The class of any formula, and its automaton with acceptance on states: also with the past and regular expressions


def classify_any(formula: Formula, *, simplifier: Simplifier | None = None) -> PropertyClass | None:
    """The smallest class of `formula`, whatever operators it has; None: its automata are too large to tell.

    Plain formulas as `classify`, others by the automata of the formula and of its negation. Untranslatable: bounds in
    time, for which words of letters lack the time.
    """
    plain = without_steps(formula)
    if is_plain(plain):
        return classes.classify(plain, simplifier=simplifier)
    try:
        sides = [automaton_of(plain, negate=negate) for negate in (False, True)]
    except AutomatonTooLarge:
        return None
    alphabet = alphabet_of(len(sides[0].atoms))
    graph, opposite = (from_automaton(side, alphabet) for side in sides)
    return classes.of_automata(graph, opposite).smallest


def buchi_of(formula: Formula) -> Automaton:
    """The Büchi automaton of `formula`: at most one acceptance set, with all transitions of a state or none.

    Untranslatable: bounds in time. AutomatonTooLarge as for `translate`.
    """
    plain = without_steps(formula)
    if is_plain(plain):
        return translate(plain, generalised=False)
    automaton = automaton_of(plain)
    size = len(automaton.atoms)
    graph = reduce_by_state(state_based(from_automaton(automaton, alphabet_of(size))))
    return to_automaton(without_sets(graph), automaton.atoms, range(size))


def shape(*formulas: Formula) -> tuple[tuple[Formula, ...], dict[str, str]]:
    """`formulas` with their atoms renamed in order of first appearance, the same for all formulas of one pattern; and
    the atoms' keys by the new ones, in that order."""
    names: dict[str, str] = {}
    done: dict[Formula, Formula] = {}
    for node in postorder(*formulas):
        if node.op == "atom":
            name = f"{HIDDEN}shape{len(names)}"
            names[name] = node.key
            done[node] = atom(name)
        elif node.args:
            done[node] = rebuilt(node, tuple(done[a] for a in node.args))
        else:
            done[node] = node
    return tuple(done[f] for f in formulas), names
