"""From any formula to its automaton: with the past, bounds in time and regular expressions.

Plain temporal logic is translated as it is; the past is remembered or guessed, expressions run beside the automaton as
small ones of their own, and times are counted.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from llfsm_verify.automata.automaton import Automaton, AutomatonTooLarge, Edge
from llfsm_verify.automata.ltl.translate import translate
from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.omega.reduction import smaller
from llfsm_verify.automata.safety import BadPrefix, PrefixMonitor, SubsetReader, safety
from llfsm_verify.logic.bounds import HIDDEN, Clock, rebuilt, without_steps
from llfsm_verify.logic.formula import (
    BINDING,
    BOUNDED_PAST,
    PAST,
    TIMED,
    Formula,
    apply,
    atom,
    atoms,
    conjunction,
    is_plain,
    negation,
    operators,
    postorder,
)

if TYPE_CHECKING:
    from llfsm_verify.automata.ltl.counting import Counting
    from llfsm_verify.automata.ltl.history import Memory, Remembering

LONG = 1_000
"""The sum of bounds of the past from which on states are made when they are asked for."""
MAX_PAIRS = 50_000
"""Pairs of states up to which it is decided whether an automaton is one of a safety property."""


class Untranslatable(Exception):
    """A formula has an operator whose automaton needs more than letters: a bound in time."""


def automaton_of(formula: Formula, atom_order: Sequence[str] | None = None, *, negate: bool = False) -> Automaton:
    """The automaton of the words that satisfy `formula` (`negate`: that do not), whatever operators it has.

    `atom_order` and the limits are those of `translate`. Untranslatable: bounds in time (see `reader_of`).
    """
    keys = tuple(atoms(formula) if atom_order is None else atom_order)
    plain = without_steps(formula)
    if operators(plain) & TIMED:
        raise Untranslatable("a bound in time needs the time of each step, and words of letters have none")
    if is_plain(plain):
        return translate(plain, keys, negate=negate)
    return _over(*_remembered(negation(plain) if negate else plain, keys))


def reader_of(
    formula: Formula, atom_order: Sequence[str], clock: Clock | None = None, *, negate: bool = False
) -> Automaton | Lazy:
    """`automaton_of`, and for formulas with bounds in time an automaton that counts how much passes by `clock`.

    TICK is then one of `atom_order`, and only words in which time passes forever are right. Untranslatable: there are
    bounds in time and no clock. AutomatonTooLarge: the limits of `translate`, and those of `Counting` later.
    """
    claim = negation(formula) if negate else formula
    lazy = lazily(claim, atom_order, clock, LONG)
    if lazy is not None:
        return lazy
    try:
        if clock is None or not operators(formula) & TIMED:
            return automaton_of(formula, atom_order, negate=negate)
        return counting_of(claim, atom_order, clock)
    except AutomatonTooLarge:
        lazy = lazily(claim, atom_order, clock)
        if lazy is None:
            raise
        return lazy


def monitor_of(formula: Formula, atom_order: Sequence[str], clock: Clock | None = None) -> PrefixMonitor:
    """The monitor of the bad prefixes of `formula`; arguments and errors are those of `reader_of`."""
    plain = without_steps(formula)
    if is_plain(plain):
        return BadPrefix(plain, atom_order)
    automaton = reader_of(plain, atom_order, clock)
    if not isinstance(automaton, Automaton):
        from llfsm_verify.automata.ltl.counting import Counting, CountingMonitor

        return CountingMonitor(automaton) if isinstance(automaton, Counting) else SubsetReader(automaton)
    from llfsm_verify.automata.omega.reduction import closure_of

    return BadPrefix.of_closure(closure_of(automaton) if automaton.acceptance_sets else automaton)


def is_safety_property(formula: Formula, atom_order: Sequence[str], clock: Clock | None = None) -> bool:
    """Whether every word that violates `formula` has a bad prefix; False also where limits left that unknown.

    With bounds in time: every word in which time passes forever. Arguments are those of `reader_of`.
    """
    plain = without_steps(formula)
    if is_plain(plain):
        return safety(plain).holds
    from llfsm_verify.automata.omega.products import disjoint

    try:
        allowed = reader_of(plain, atom_order, clock)
        if allowed.acceptance_sets == 0 or not isinstance(allowed, Automaton):
            return allowed.acceptance_sets == 0
        wrong = automaton_of(plain, atom_order, negate=True)
        small = len(allowed.edges) * len(wrong.edges) <= MAX_PAIRS
        return small and disjoint(allowed, wrong, closure=True)
    except AutomatonTooLarge:
        return False


def counting_of(formula: Formula, keys: Sequence[str], clock: Clock) -> Counting:
    """`reader_of` for a formula with bounds in time, with what is remembered of the past written out."""
    from llfsm_verify.automata.ltl.counting import Counting
    from llfsm_verify.automata.ltl.timed import separate

    rest, _, memories, ahead = _remembered(without_steps(formula), keys, clock)
    parts = separate(rest, clock, keys)
    return Counting(_over(parts.formula, (*keys, *parts.hidden), memories, ahead), parts.counters, keys)


def _remembered(
    formula: Formula, keys: Sequence[str], clock: Clock | None = None
) -> tuple[Formula, Sequence[str], Sequence[Memory], Sequence[str]]:
    """The arguments of `_over`: with memories for past operators over `keys`, and for all of those with bounds."""
    from llfsm_verify.automata.ltl.history import guess_future, memories_of

    ahead: tuple[str, ...] = ()
    if operators(formula) & BOUNDED_PAST:
        formula, ahead = guess_future(formula)
    rest, memories = memories_of(formula, (*keys, *ahead), clock)
    return rest, keys, memories, ahead


def lazily(formula: Formula, keys: Sequence[str], clock: Clock | None, ticks: int = 0) -> Remembering | None:
    """The automaton of a formula whose past has bounds, with states that are made when they are asked for.

    None: the bounds come to at most `ticks`, or other parts of the formula need all states at once.
    """
    plain = without_steps(formula)
    if not operators(plain) & BOUNDED_PAST or (clock is None and operators(plain) & TIMED):
        return None
    from llfsm_verify.automata.ltl.history import Remembering, counted

    rest, _, memories, ahead = _remembered(plain, keys, clock)
    if ahead or operators(rest) & TIMED or counted(memories) < ticks:
        return None
    return Remembering(_present(rest, keys, memories), memories, len(keys))


def _over(formula: Formula, keys: Sequence[str], memories: Sequence[Memory], ahead: Sequence[str] = ()) -> Automaton:
    """The automaton over `keys` of a formula without bounds in time, in which the atoms of `memories` are what they
    say of the letters up to there, also of what those of `ahead` are guessed to be, and other atoms can be chosen
    freely. What is left of the past is guessed."""
    kept = (*keys, *ahead)
    automaton = _present(formula, kept, memories)
    if not memories:
        return automaton
    from llfsm_verify.automata.ltl.history import remembering

    found = remembering(automaton, memories, len(kept))
    return smaller(project(found, len(keys)) if ahead else found)


def _present(formula: Formula, keys: Sequence[str], memories: Sequence[Memory]) -> Automaton:
    """The automaton over `keys` and the atoms of `memories`, which can be chosen freely."""
    present, guessed = without_past(formula)
    shown = (*keys, *(m.atom.key for m in memories))
    if operators(present) & BINDING:
        from llfsm_verify.automata.ltl.psl import expression_automaton

        automaton = expression_automaton(present, shown, guessed)
    else:
        automaton = translate(present, (*shown, *guessed))
        if guessed:
            automaton = smaller(project(automaton, len(shown)))
    return automaton


def without_past(formula: Formula) -> tuple[Formula, tuple[str, ...]]:
    """A formula of the future over more atoms, true for the one right choice of these exactly when `formula` is.

    Each past subformula becomes an atom whose history the result demands: `O p`, say, holds when `p` does or when it
    held before. The new atoms' keys are returned too. Source: the temporal testers of Pnueli and Zaks (FM 2006).
    """
    done: dict[Formula, Formula] = {}
    demands: list[Formula] = []
    names: list[str] = []
    for node in postorder(formula):
        args = tuple(done[a] for a in node.args)
        if node.op not in PAST:
            done[node] = negation(args[0]) if node.op == "not" else rebuilt(node, args)
            continue
        names.append(f"{HIDDEN}past{len(names)}")
        now = done[node] = atom(names[-1])
        then, a, b = apply("X", now), args[0], args[-1]
        after_a, after_b = apply("X", a), apply("X", b)
        match node.op:
            case "Y":
                start, step = negation(now), a
            case "Z":
                start, step = now, a
            case "O":
                start, step = apply("iff", now, a), apply("or", after_a, now)
            case "H":
                start, step = apply("iff", now, a), apply("and", after_a, now)
            case "S":
                start, step = apply("iff", now, b), apply("or", after_b, apply("and", after_a, now))
            case _:
                start, step = apply("iff", now, b), apply("and", after_b, apply("or", after_a, now))
        demands += [start, apply("G", apply("iff", then, step))]
    return conjunction((done[formula], *demands)), tuple(names)


def project(automaton: Automaton, kept: int) -> Automaton:
    """The automaton over the first `kept` atoms: a word is accepted when some choice of the others makes it so."""
    mask = (1 << kept) - 1
    edges = tuple(
        tuple(dict.fromkeys(Edge(e.positive & mask, e.negative & mask, e.target, e.acceptance) for e in row))
        for row in automaton.edges
    )
    return Automaton(automaton.atoms[:kept], edges, automaton.acceptance_sets)
