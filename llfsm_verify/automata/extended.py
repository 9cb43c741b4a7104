"""The automaton of any formula: step bounds written out, the past guessed and checked, expressions run beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.diagrams import Diagrams
from llfsm_verify.automata.labels import MAX_TABLE, Alphabet, L, TruthTables, of_cube
from llfsm_verify.automata.reduction import reduced
from llfsm_verify.automata.symbolic import Symbolic, merged_row, to_automaton
from llfsm_verify.automata.translate import translate
from llfsm_verify.logic.bounds import rebuilt, without_steps
from llfsm_verify.logic.formula import (
    BINDING,
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

Tick = Callable[[], None]

HIDDEN = "\0"
"""The keys of atoms made here start with this character, which no atom of users has."""


class Untranslatable(Exception):
    """A formula has an operator whose automaton needs more than letters: a bound in time."""


def automaton_of(
    formula: Formula, atom_order: Sequence[str] | None = None, *, negate: bool = False, tick: Tick | None = None
) -> Automaton:
    """The automaton of the words that satisfy `formula` (`negate`: that do not), whatever operators it has.

    `atom_order` and the limits are those of `translate`. Untranslatable: bounds in time.
    """
    keys = tuple(atoms(formula) if atom_order is None else atom_order)
    plain = without_steps(formula)
    if operators(plain) & TIMED:
        raise Untranslatable("a bound in time needs the time of each step, and words of letters have none")
    if is_plain(plain):
        return translate(plain, keys, negate=negate, tick=tick)
    present, history = without_past(negation(plain) if negate else plain)
    if operators(present) & BINDING:
        from llfsm_verify.automata.psl import expression_automaton

        return expression_automaton(present, keys, history, tick)
    fresh = [key for key in atoms(present) if key.startswith(HIDDEN)]
    return smaller(projected(translate(present, (*keys, *fresh), tick=tick), len(keys)), tick)


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


def projected(automaton: Automaton, kept: int) -> Automaton:
    """The automaton over the first `kept` atoms: a word is accepted when some choice of the others makes it so."""
    mask = (1 << kept) - 1
    edges = tuple(
        tuple(dict.fromkeys(Edge(e.positive & mask, e.negative & mask, e.target, e.acceptance) for e in row))
        for row in automaton.edges
    )
    return Automaton(automaton.atoms[:kept], edges, automaton.acceptance_sets)


def smaller(automaton: Automaton, tick: Tick | None = None) -> Automaton:
    """The same language with fewer states, transitions and acceptance sets."""
    used = 0
    for row in automaton.edges:
        for e in row:
            used |= e.positive | e.negative
    places = [i for i in range(len(automaton.atoms)) if used >> i & 1]
    narrow = {place: i for i, place in enumerate(places)}

    def over(alphabet: Alphabet[L]) -> Automaton:
        def label(mask: int) -> int:
            return sum(1 << narrow[p] for p in places if mask >> p & 1)

        rows = tuple(
            merged_row((of_cube(alphabet, label(e.positive), label(e.negative)), e.acceptance, e.target) for e in row)
            for row in automaton.edges
        )
        graph = reduced(Symbolic(alphabet, rows, automaton.acceptance_sets), tick)
        return to_automaton(graph, automaton.atoms, places)

    return over(TruthTables(len(places))) if len(places) <= MAX_TABLE else over(Diagrams(len(places)))
