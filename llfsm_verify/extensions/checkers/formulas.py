"""Formulas of linear temporal logic in the languages of other checkers: every operator in parentheses, or as the Büchi
automaton of a never claim, which reads one letter a step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.plug import (
    Automaton,
    AutomatonEdge,
    Formula,
    FormulaOp,
    LimitReached,
    apply,
    atom,
    conjunction,
    mapped,
    negation,
    nnf,
    postorder,
)

MAX_TEXT = 1 << 20
"""Characters of a formula; no other checker reads one that long in reasonable time."""
READABLE, TEMPORAL = 60, 5
"""Subformulas, and temporal operators among them (those of two arguments count twice), up to which SPIN's own
translation is quick."""


@dataclass(frozen=True, slots=True)
class Dialect:
    """How a language writes formulas: a template for each operator, ``{0}`` and ``{1}`` its arguments.

    `and` and `or` have their sign in place of a template.
    """

    operators: Mapping[FormulaOp, str]

    def text(self, f: Formula, proposition: Callable[[str], str]) -> str:
        """`f`, with `proposition` giving the text of an atom by its key. LimitReached: it is longer than MAX_TEXT."""
        done: dict[Formula, str] = {}
        for node in postorder(f):
            if sum(len(done[a]) for a in node.args) > MAX_TEXT:
                raise LimitReached(f"the formula takes more than {MAX_TEXT >> 20} MiB when its bounds are written out")
            args = [done[a] for a in node.args]
            if node.op == "atom":
                done[node] = proposition(node.key)
            elif node.op in ("and", "or"):
                done[node] = f"({f' {self.operators[node.op]} '.join(args)})"
            else:
                done[node] = self.operators[node.op].format(*args)
        return done[f]


PROMELA = Dialect(
    {
        "true": "true", "false": "false", "not": "(! {0})", "and": "&&", "or": "||", "implies": "({0} -> {1})",
        "iff": "({0} <-> {1})", "xor": "(! ({0} <-> {1}))", "X": "(X {0})", "F": "(<> {0})", "G": "([] {0})",
        "U": "({0} U {1})", "W": "({0} W {1})", "R": "({0} V {1})", "M": "({1} U ({0} && {1}))",
    }
)  # fmt: skip
SMV = Dialect(
    {
        "true": "TRUE", "false": "FALSE", "not": "(! {0})", "and": "&", "or": "|", "implies": "({0} -> {1})",
        "iff": "({0} <-> {1})", "xor": "({0} xor {1})", "X": "(X {0})", "F": "(F {0})", "G": "(G {0})",
        "U": "({0} U {1})", "W": "({1} V ({0} | {1}))", "R": "({0} V {1})", "M": "({1} U ({0} & {1}))",
    }
)  # fmt: skip


def weaken(f: Formula) -> Formula:
    """`f` on runs that may be cut off, over the atoms ``$+p`` and ``$-p``: p and its negation, both true after the cut.

    A cut-off run then violates the result when its letters are an informative bad prefix of `f` (Kupferman and Vardi,
    Model Checking of Safety Properties, FMSD 2001; the weak view of Eisner et al., Reasoning with Temporal Logic on
    Truncated Paths, CAV 2003). On runs that are not cut off the result means `f`.
    """

    def change(node: Formula, _: tuple[Formula, ...]) -> Formula | None:
        if node.op == "atom":
            return atom(YES + node.key)
        return atom(NO + node.args[0].key) if node.op == "not" else None

    return mapped(nnf(f), change)


def fair(premise: str | None, goal: str) -> Formula:
    """`goal` comes about infinitely often, when `premise` does (None: always); both are keys of atoms."""
    often = apply("G", apply("F", atom(goal)))
    return often if premise is None else apply("implies", apply("G", apply("F", atom(premise))), often)


YES, NO = "$+", "$-"
"""What the keys of `weaken` atoms begin with."""
STOPPED, STARTED = atom("$stopped"), atom("$started")
"""Propositions of the models' own; no atom of a user is called so."""


def readable(f: Formula) -> bool:
    """SPIN can make an automaton of `f`: many builds know no X, and long formulas take it minutes or more."""
    parts = postorder(f)
    weight = sum(len(node.args) for node in parts if node.op in ("F", "G", "U", "W", "R", "M"))
    return all(node.op != "X" for node in parts) and weight <= TEMPORAL and len(parts) <= READABLE


def under(goal: Formula, assumptions: Sequence[Formula], demands: Sequence[Formula], *, faulty: bool) -> Formula:
    """A goal under assumptions and demands of fairness, on runs that a fault may cut off (`faulty`)."""
    if faulty and assumptions:
        assumptions = [*assumptions, apply("G", negation(STOPPED))]
    elif faulty:
        goal, demands = weaken(goal), [weaken(f) for f in demands]
    premises = [*assumptions, *demands]
    return apply("implies", conjunction(premises), goal) if premises else goal


State = tuple[int, int]
"""A state of the automaton, and the acceptance set that has to come next; after the last one comes acceptance."""


def never_claim(name: str, automaton: Automaton, proposition: Callable[[str], str]) -> str:
    """The claim that the automaton accepts the letters of the states in which `tick` holds.

    `tick` has to hold in one state of each step and not in the next, and infinitely often. Acceptance sets are waited
    for one after the other (degeneralization: Gastin and Oddoux, Fast LTL to Büchi Automata Translation, CAV 2001).
    """
    if automaton.is_empty:
        return f"never {name} {{ /* no word */\nT0:\n  if\n  :: false -> goto T0\n  fi\n}}"
    sets = automaton.acceptance_sets
    texts = [proposition(key) for key in automaton.atoms]
    first: State = (0, 0)
    found, queue, lines = {first}, [first], [f"never {name} {{"]
    for state in queue:
        lines += [f"{_label(state, sets)}:", "  if", f"  :: (!tick) -> goto {_label(state, sets)}"]
        for edge in automaton.edges[state[0]]:
            target = edge.target, _waiting(edge, state[1] % sets if sets else 0, sets)
            lines.append(f"  :: ({' && '.join(['tick', *_guard(edge, texts)])}) -> goto {_label(target, sets)}")
            if target not in found:
                found.add(target)
                queue.append(target)
        lines.append("  fi;")
    lines[-1] = "  fi"
    return "\n".join([*lines, "}"])


def _waiting(edge: AutomatonEdge, waiting: int, sets: int) -> int:
    while waiting < sets and edge.acceptance >> waiting & 1:
        waiting += 1
    return waiting


def _guard(edge: AutomatonEdge, texts: list[str]) -> list[str]:
    yes = [text for i, text in enumerate(texts) if edge.positive >> i & 1]
    no = [f"!{text}" for i, text in enumerate(texts) if edge.negative >> i & 1]
    return [*yes, *no]


def _label(state: State, sets: int) -> str:
    accepting = state[1] == sets
    return f"{'accept' if accepting else 'T'}_{state[0]}_{state[1]}"
