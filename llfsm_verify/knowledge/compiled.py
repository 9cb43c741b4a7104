"""Theories as Boolean expressions of their inputs: each proof is defined once, so that the size is linear.

What is proved of a literal is a conjunction of clauses: some rule for it applies, and each rule against it does not
apply, or a stronger one does. The parts of clauses are inputs and definitions, affirmed or negated.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal as OneOf

from llfsm_verify.diagnostics import Span
from llfsm_verify.knowledge.theory import Literal, Theory
from llfsm_verify.language import typed
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.types import BoolType

BOOL = BoolType()


@dataclass(frozen=True, slots=True)
class Compiled:
    """Whether a literal is proved: `value`, in which the inputs and each of the `definitions` are locals, a definition
    also in those after it. No expression is deep. Spans are those of rules, in the `.d` file."""

    inputs: tuple[str, ...]
    """What is read, in the order of the file: an input `a` is `ReadLocal` of `Local(prefix + "a", BOOL)`."""
    definitions: tuple[tuple[typed.Local, typed.Expression], ...]
    """Their keys are no names of inputs."""
    value: typed.Expression


_Part = bool | tuple[str, bool]
"""A constant; or an input or a definition, by its key, and whether it is affirmed."""
_Placed = tuple[_Part, Span]
_Clause = dict[tuple[str, bool], Span]
"""A disjunction: false where it is empty."""


def compiled(theory: Theory, literal: Literal, prefix: str = "") -> Compiled:
    """Whether the literal is proved, by what the inputs are. False where nothing concludes it. The keys of locals begin
    with `prefix`."""
    proofs = _Proofs(theory, prefix)
    for atom in theory.atoms(literal.atom):
        proofs.add(atom)
    numbers = proofs.concluding.get(literal) or proofs.concluding.get(literal.complement) or ()
    places = [theory.rules[number].span for number in numbers[:1]] + [theory.inputs.get(literal.atom)]
    span = next((s for s in places if s is not None), Span(theory.source, 0, 0))
    value = _expression(proofs.proved.get(literal, False), span)
    if isinstance(value, typed.ReadLocal):
        value = proofs.definitions.pop(value.local.key, value)  # that of the literal, which no other one reads
    needed, definitions = _keys(value), []
    for key, expression in reversed(proofs.definitions.items()):
        if key in needed:
            needed |= _keys(expression)
            definitions.append((typed.Local(key, BOOL), expression))
    return Compiled(tuple(a for a in theory.inputs if prefix + a in needed), tuple(reversed(definitions)), value)


def _keys(expression: typed.Expression) -> set[str]:
    """Of the locals in it."""
    return {read.local.key for read in of_kind(expression, typed.ReadLocal)}


class _Proofs:
    """The proofs of literals, atom by atom: each one a constant, or a part of clauses."""

    def __init__(self, theory: Theory, prefix: str) -> None:
        self.rules, self._prefix = theory.rules, prefix
        self.concluding, self.stronger = theory.concluding(), theory.stronger()
        self.definitions: dict[str, typed.Expression] = {}
        self.strictly: dict[Literal, _Part]
        self.strictly = {Literal(a, sign): (prefix + a, sign) for a in theory.inputs for sign in (True, False)}
        self.proved = dict(self.strictly)
        self._applying: dict[str, _Part] = {}

    def add(self, atom: str) -> None:
        """The proofs of an atom and of its negation; those of what they depend on are there."""
        for literal in (Literal(atom), Literal(atom, False)):
            strict = [n for n in self.concluding.get(literal, ()) if self.rules[n].kind == "strict"]
            clause = _clause(self._applies(number, strictly=True) for number in strict)
            self.strictly[literal] = self._define(f"strictly {literal}", [clause])
        for literal in (Literal(atom), Literal(atom, False)):
            team = [n for n in self.concluding.get(literal, ()) if self.rules[n].proves]
            if not team:
                continue
            span = self.rules[team[0]].span
            clauses = [_clause([(_negated(self.strictly.get(literal.complement, False)), span)])]
            clauses.append(_clause(map(self._applies, team)))
            for attacker in self.concluding.get(literal.complement, ()):
                beating = [n for n in self.stronger.get(attacker, ()) if self.rules[n].proves]
                applies, place = self._applies(attacker)
                clauses.append(_clause([(_negated(applies), place), *map(self._applies, beating)]))
            self.proved[literal] = self._define(str(literal), clauses, (self.strictly[literal], span))

    def _applies(self, number: int, *, strictly: bool = False) -> _Placed:
        rule = self.rules[number]
        key = f"strictly rule {number}" if strictly else f"rule {number}"
        if key not in self._applying:
            proof = self.strictly if strictly else self.proved
            self._applying[key] = self._define(
                key, [_clause([(proof.get(literal, False), rule.span)]) for literal in rule.body]
            )
        return self._applying[key], rule.span

    def _define(self, key: str, clauses: Iterable[_Clause | None], strictly: _Placed | None = None) -> _Part:
        """The conjunction of clauses, or what is proved `strictly`: a part that is there, or else a definition."""
        certain = () if strictly is None else (strictly,)
        left = _simplified(_clause([*certain, *clause.items()]) for clause in _simplified(clauses))
        if len(left) == 1 and len(left[0]) < 2:
            return next(iter(left[0]), False)
        if not left:
            return True
        strict = strictly[0] if strictly is not None and len(left) > 1 else False  # it is in each clause
        ors = [[_expression(*part) for part in clause.items() if part[0] != strict] for clause in left]
        value = _tree("and", [_tree("or", parts) for parts in ors])
        if strictly is not None and strict is not False:
            value = _tree("or", [_expression(*strictly), value])
        self.definitions[self._prefix + key] = value
        return self._prefix + key, True


def _negated(part: _Part) -> _Part:
    return not part if isinstance(part, bool) else (part[0], not part[1])


def _clause(parts: Iterable[_Placed]) -> _Clause | None:
    """The disjunction; None: it is always true."""
    found: _Clause = {}
    for part, span in parts:
        if part is True or (part is not False and _negated(part) in found):
            return None
        if part is not False:
            found.setdefault(part, span)
    return found


def _simplified(clauses: Iterable[_Clause | None]) -> list[_Clause]:
    """The clauses without those that follow from others or are always true; only an empty one, where all are false."""
    kept = {frozenset(clause): clause for clause in clauses if clause is not None}
    units = {part for clause in kept.values() if len(clause) == 1 for part in clause}
    if frozenset() in kept or any((name, not affirmed) in units for name, affirmed in units):
        return [{}]
    return [clause for clause in kept.values() if len(clause) == 1 or units.isdisjoint(clause)]


def _expression(part: _Part, span: Span) -> typed.Expression:
    if isinstance(part, bool):
        return typed.Literal(part, BOOL, span)
    name = typed.ReadLocal(typed.Local(part[0], BOOL), BOOL, span)
    return name if part[1] else typed.Unary("not", name, BOOL, span)


def _tree(op: OneOf["and", "or"], parts: list[typed.Expression]) -> typed.Expression:
    """The parts joined as a balanced tree: what reads it is recursive."""
    while len(parts) > 1:
        pairs = zip(parts[::2], parts[1::2], strict=False)
        joined: list[typed.Expression] = [
            typed.Binary("and" if op == "and" else "or", a, b, BOOL, a.span) for a, b in pairs
        ]
        parts = joined + parts[len(joined) * 2 :]
    return parts[0]
