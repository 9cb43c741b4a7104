"""Plausible logic: rules of several strengths that conclude literals, and which rule is stronger than which.

This is defeasible logic with ambiguity blocking and team defeat (D. Billington, Defeasible logic is stable, J. Logic
Computat. 3(4), 1993; G. Antoniou, D. Billington, G. Governatori, M. J. Maher, Representation results for defeasible
logic, ACM TOCL 2(2), 2001). For a literal q, with ~q its complement:

- q is *strictly* proved (+D) where it is a fact, or the body of a strict rule for q is strictly proved;
- q is *proved* (+d) where it is strictly proved; or ~q is not strictly proved, a strict or defeasible rule for q
  applies (its body is proved), and each rule for ~q that applies, defeaters too, is beaten: some strict or defeasible
  rule for q that applies is stronger. It need not always be the same one: rules for q are a team.

Inputs are closed: of an input `a`, the fact is `a` where it is true, and `~a` where it is false. Atoms do not depend on
themselves, so each literal is either proved or not, by recursion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from graphlib import TopologicalSorter
from typing import Literal as OneOf

from llfsm_verify.diagnostics import Source, Span


@dataclass(frozen=True, slots=True)
class Literal:
    """An atom, or (not `positive`) its negation."""

    atom: str
    positive: bool = True

    @property
    def complement(self) -> Literal:
        return Literal(self.atom, not self.positive)

    def __str__(self) -> str:
        return self.atom if self.positive else f"~{self.atom}"


@dataclass(frozen=True, slots=True)
class Rule:
    """If all of `body` is proved, then (strictly, or by default) `head`; a defeater only speaks against the complement
    of its head. `label` may be ""."""

    label: str
    body: tuple[Literal, ...]
    kind: OneOf["strict", "defeasible", "defeater"]
    head: Literal
    span: Span
    """Of the whole rule, without the dot."""

    @property
    def proves(self) -> bool:
        """Whether it can prove its head."""
        return self.kind != "defeater"


@dataclass(frozen=True, slots=True)
class Output:
    """An atom that is of interest outside, where it has the name `text`."""

    atom: str
    text: str
    span: Span


@dataclass(frozen=True, slots=True)
class Theory:
    """A `.d` file that has no mistakes: atoms do not depend on themselves, and no rule concludes an input."""

    name: str
    inputs: Mapping[str, Span]
    rules: tuple[Rule, ...]
    superior: frozenset[tuple[int, int]]
    """Numbers of rules with complementary heads, the stronger one first. As written: not made transitive."""
    outputs: tuple[Output, ...]
    source: Source

    def output(self, name: str | None = None) -> Output | None:
        """The output of this atom or text, or without a name the only one."""
        found = [o for o in self.outputs if name is None or name in (o.atom, o.text)]
        return found[0] if len(found) == 1 or (found and name is not None) else None

    def concluding(self) -> dict[Literal, list[int]]:
        """By literal the numbers of the rules for it, defeaters too."""
        found: dict[Literal, list[int]] = {}
        for number, rule in enumerate(self.rules):
            found.setdefault(rule.head, []).append(number)
        return found

    def stronger(self) -> dict[int, list[int]]:
        """By rule the numbers of those that are stronger, in order."""
        found: dict[int, list[int]] = {}
        for strong, weak in sorted(self.superior):
            found.setdefault(weak, []).append(strong)
        return found

    def atoms(self, wanted: str) -> list[str]:
        """The atoms on which an atom depends, inputs left out, each after those on which it depends itself."""
        needs, after = dependence(self.rules), {}
        stack = [wanted]
        while stack:
            atom = stack.pop()
            if atom not in after and atom not in self.inputs:
                after[atom] = [a for a in needs.get(atom, ()) if a not in self.inputs]
                stack += after[atom]
        return list(TopologicalSorter(after).static_order())


def dependence(rules: Iterable[Rule]) -> dict[str, dict[str, None]]:
    """By atom those in the bodies of rules for it or for its negation, in order."""
    found: dict[str, dict[str, None]] = {}
    for rule in rules:
        found.setdefault(rule.head.atom, {}).update((literal.atom, None) for literal in rule.body)
    return found


def asked(rules: Iterable[Rule], outputs: Iterable[Output]) -> dict[str, None]:
    """The atoms for which an output or a body asks."""
    names = (*(output.atom for output in outputs), *(literal.atom for rule in rules for literal in rule.body))
    return dict.fromkeys(names)
