"""Why a literal is proved or not for given inputs: which rules apply, which are beaten by which, which win.

It follows the definition (`theory.py`) rule by rule, and not the compiled expression.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal as OneOf

from llfsm_verify.knowledge.theory import Literal, Theory

MOST = 100
"""Rules that are named as the cause of what became of another."""


@dataclass(frozen=True, slots=True)
class Fate:
    """What became of a rule: it *wins* (its head is proved), is *beaten* by stronger rules, is *blocked* by rules for
    the opposite that are not beaten themselves, *blocks* (a defeater that is not beaten), or does not apply: *idle*."""

    rule: int
    outcome: OneOf["wins", "beaten", "blocked", "blocks", "idle"]
    missing: tuple[Literal, ...] = ()
    """Of a rule that is idle: what of its body is not proved."""
    by: tuple[int, ...] = ()
    """The rules that beat it or block it; of one that wins by its team, those that are stronger, all beaten. Of many
    the first MOST ones."""


@dataclass(frozen=True, slots=True)
class Decision:
    """What is known of an atom, and what became of the rules for it and for its negation, in the order of the file."""

    atom: str
    proved: bool
    refuted: bool
    """Whether its negation is proved."""
    fates: tuple[Fate, ...]


@dataclass(frozen=True, slots=True)
class Explanation:
    """Whether a literal is `proved`, and the decisions about the atoms on which it depends, its own as the last one."""

    literal: Literal
    valuation: Mapping[str, bool]
    proved: bool
    decisions: tuple[Decision, ...]


def explained(theory: Theory, literal: Literal, valuation: Mapping[str, bool]) -> Explanation:
    """Decide the literal where the inputs are as given; those that are not named are false."""
    inputs = {name: valuation.get(name, False) for name in theory.inputs}
    facts = {Literal(name, value) for name, value in inputs.items()}
    strictly, proved = set(facts), set(facts)
    concluding, stronger = theory.concluding(), theory.stronger()
    decisions = []
    for atom in theory.atoms(literal.atom):
        sides = (Literal(atom), Literal(atom, False))
        numbers = {side: concluding.get(side, []) for side in sides}
        applying = {n for side in sides for n in numbers[side] if proved.issuperset(theory.rules[n].body)}
        beaten = {
            n: tuple(t for t in stronger.get(n, ()) if t in applying and theory.rules[t].proves) for n in applying
        }
        certain = {
            n for n in applying if theory.rules[n].kind == "strict" and strictly.issuperset(theory.rules[n].body)
        }
        strictly |= {theory.rules[n].head for n in certain}
        against = {
            side: [n for n in numbers[side.complement] if n in certain]
            or [n for n in numbers[side.complement] if n in applying and not beaten[n]]
            for side in sides
        }
        for side in sides:
            team = any(n in applying and theory.rules[n].proves for n in numbers[side])
            if side in strictly or (team and not against[side]):
                proved.add(side)
        fates = []
        for n in sorted(numbers[sides[0]] + numbers[sides[1]]):
            rule = theory.rules[n]
            if n not in applying:
                fates.append(Fate(n, "idle", tuple(b for b in rule.body if b not in proved)))
            elif rule.proves and rule.head in proved:
                fates.append(Fate(n, "wins", by=() if rule.head in strictly else beaten[n][:MOST]))
            elif beaten[n]:
                fates.append(Fate(n, "beaten", by=beaten[n][:MOST]))
            elif rule.proves:
                fates.append(Fate(n, "blocked", by=tuple(against[rule.head][:MOST])))
            else:
                fates.append(Fate(n, "blocks"))
        decisions.append(Decision(atom, sides[0] in proved, sides[1] in proved, tuple(fates)))
    return Explanation(literal, inputs, literal in proved, tuple(decisions))
