"""Random theories as plain data and as texts, and a second definition of what they prove: the proof conditions of
Antoniou, Billington, Governatori and Maher (2001), iterated over all literals until nothing is added.

It shares nothing with the package. A literal is a text, such as `q` or `~q`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from random import Random
from typing import NamedTuple

STRICT, DEFEASIBLE, DEFEATER = "->", "=>", "~>"


class R(NamedTuple):
    """A rule."""

    label: str
    body: tuple[str, ...]
    arrow: str
    head: str


@dataclass(frozen=True)
class Plain:
    """A theory; `beats` has pairs of labels."""

    inputs: tuple[str, ...]
    rules: tuple[R, ...]
    beats: frozenset[tuple[str, str]] = frozenset()

    def text(self, random: Random | None = None) -> str:
        """The `.d` file, spelled in one way or (with `random`) another."""
        spelled = [*(f"{r.label}: {_body(r.body, random)} {r.arrow} {r.head}." for r in self.rules)]
        spelled += [f"{one} > {other}." for one, other in sorted(self.beats)]
        if random is not None:
            random.shuffle(spelled)
        head = [f"input {{{', '.join(self.inputs)}}}."] if self.inputs else []
        proved = next(r.head for r in self.rules if r.arrow != DEFEATER)
        atom = proved.removeprefix("~")
        return "\n".join((*head, *spelled, f"dummy: {{}} => {atom}_.", f'output {{b {atom}_, "x"}}.')) + "\n"

    def atoms(self) -> list[str]:
        """Those that rules are about."""
        return list(dict.fromkeys(r.head.removeprefix("~") for r in self.rules))

    def valuations(self) -> Iterator[dict[str, bool]]:
        """Every one, in the order of binary numbers."""
        for values in product((False, True), repeat=len(self.inputs)):
            yield dict(zip(self.inputs, values, strict=True))


def _body(body: tuple[str, ...], random: Random | None) -> str:
    inside = ", ".join(body)
    return inside if body and random is not None and random.random() < 0.5 else f"{{{inside}}}"


def opposite(literal: str) -> str:
    return literal[1:] if literal.startswith("~") else f"~{literal}"


class Tags(NamedTuple):
    """What is strictly proved, demonstrably not so, proved, demonstrably not proved."""

    strict: set[str]
    not_strict: set[str]
    proved: set[str]
    not_proved: set[str]


def tags(theory: Plain, valuation: Mapping[str, bool]) -> Tags:
    """The least sets that the eight proof conditions close."""
    facts = {name if value else opposite(name) for name, value in valuation.items()}
    named = {*theory.inputs, *(r.head for r in theory.rules), *(b for r in theory.rules for b in r.body)}
    literals = sorted(named | {opposite(name) for name in named})
    known = Tags(set(), set(), set(), set())
    while True:
        before = [len(s) for s in known]
        for q in literals:
            for_q = [r for r in theory.rules if r.head == q]
            against = [r for r in theory.rules if r.head == opposite(q)]
            if q in facts or any(r.arrow == STRICT and known.strict >= set(r.body) for r in for_q):
                known.strict.add(q)
            if q not in facts and all(r.arrow != STRICT or known.not_strict & set(r.body) for r in for_q):
                known.not_strict.add(q)
            supporting = [r for r in for_q if r.arrow != DEFEATER]

            def beaten(s: R, supporting: list[R] = supporting) -> bool:
                return any((t.label, s.label) in theory.beats and known.proved >= set(t.body) for t in supporting)

            def unbeaten(s: R, supporting: list[R] = supporting) -> bool:
                return all((t.label, s.label) not in theory.beats or known.not_proved & set(t.body) for t in supporting)

            if q in known.strict or (
                any(known.proved >= set(r.body) for r in supporting)
                and opposite(q) in known.not_strict
                and all(known.not_proved & set(s.body) or beaten(s) for s in against)
            ):
                known.proved.add(q)
            if q in known.not_strict and (
                all(known.not_proved & set(r.body) for r in supporting)
                or opposite(q) in known.strict
                or any(known.proved >= set(s.body) and unbeaten(s) for s in against)
            ):
                known.not_proved.add(q)
        if before == [len(s) for s in known]:
            return known


# ---------------------------------------------------------------- random ones


def random_theory(random: Random) -> Plain:
    """A theory of a few levels, with at least one of the hard cases at a random place in it."""
    inputs = tuple("abcd"[: random.randint(1, 4)])
    known = [literal for name in inputs for literal in (name, f"~{name}")]
    rules: list[R] = []
    beats: set[tuple[str, str]] = set()
    for level in range(random.randint(2, 4)):
        atom = f"p{level}"
        made = (_case if random.random() < 0.6 else _any)(random, atom, known, len(rules))
        rules += made[0]
        beats |= made[1]
        known += {r.head for r in made[0] if r.arrow != DEFEATER and r.head not in known}
        known.sort()
    order = {label: n for n, label in enumerate(random.sample([r.label for r in rules], len(rules)))}
    of = {r.label: r for r in rules}
    for one, other in product(of, of):
        opposed = of[one].head == opposite(of[other].head)
        if opposed and order[one] < order[other] and (other, one) not in beats and random.random() < 0.15:
            beats.add((one, other))
    return Plain(inputs, tuple(rules), frozenset(beats if acyclic(beats) else ()))


def acyclic(beats: Iterable[tuple[str, str]]) -> bool:
    left = set(beats)
    while left:
        beaten = {other for _, other in left}
        kept = {(one, other) for one, other in left if one in beaten}
        if kept == left:
            return False
        left = kept
    return True


_Made = tuple[list[R], set[tuple[str, str]]]


def _some(random: Random, known: list[str], most: int = 3) -> tuple[str, ...]:
    return tuple(random.sample(known, min(len(known), random.randint(0, most))))


def _any(random: Random, atom: str, known: list[str], number: int) -> _Made:
    rules = []
    for i in range(random.randint(1, 6)):
        head = random.choice((atom, f"~{atom}"))
        arrow = random.choice((STRICT, DEFEASIBLE, DEFEASIBLE, DEFEASIBLE, DEFEATER)) if i else DEFEASIBLE
        rules.append(R(f"r{number + i}", _some(random, known), arrow, head))
    return rules, {
        (r.label, s.label)
        for i, r in enumerate(rules)
        for s in rules[i + 1 :]
        if r.head == opposite(s.head) and random.random() < 0.4
    }


def _case(random: Random, atom: str, known: list[str], number: int) -> _Made:
    """One of the hard cases: a team, equal strength, a defeater (beaten or not), a strict conflict."""
    q, nq = random.sample((atom, f"~{atom}"), 2)
    one, other, third = (_some(random, known, 2) for _ in range(3))
    label = [f"r{number + i}" for i in range(5)]
    match random.randrange(6):
        case 0:  # each attacker is beaten by another member of the team
            rules = [R(label[0], one, DEFEASIBLE, q), R(label[1], other, random.choice((STRICT, DEFEASIBLE)), q)]
            rules += [R(label[2], third, DEFEASIBLE, nq), R(label[3], (), random.choice((DEFEASIBLE, DEFEATER)), nq)]
            return rules, {(label[0], label[2]), (label[1], label[3])}
        case 1:  # equal strength: where both apply, neither is proved, which is what ambiguity is made of
            return [R(label[0], one, DEFEASIBLE, q), R(label[1], other, DEFEASIBLE, nq)], set()
        case 2:  # a defeater that nothing beats, and one that is beaten
            rules = [R(label[0], one, DEFEASIBLE, q), R(label[1], other, DEFEATER, nq)]
            return [*rules, R(label[2], third, DEFEATER, nq)], {(label[0], label[1])}
        case 3:  # a defeater cannot beat
            rules = [R(label[0], one, DEFEASIBLE, q), R(label[1], other, DEFEASIBLE, nq), R(label[2], (), DEFEATER, q)]
            return rules, {(label[2], label[1])}
        case 4:  # strict rules for both
            return [R(label[0], one, STRICT, q), R(label[1], other, STRICT, nq), R(label[2], (), DEFEASIBLE, q)], set()
    chain = [R(label[0], one, DEFEASIBLE, q), R(label[1], other, DEFEASIBLE, nq), R(label[2], third, DEFEASIBLE, q)]
    return chain, {(label[1], label[0]), (label[2], label[1])}  # not transitive
