"""The specification patterns by name, as formulas.

Source: Dwyer, Avrunin and Corbett, Patterns in property specifications for finite-state verification, ICSE 1999, with
the formulas of their collection; the bounds in time are those of Konrad and Cheng, Real-time specification patterns,
ICSE 2005. A scope that ends in `before` an event says nothing of runs in which the event does not happen. Three
formulas of chains are mended: after q, `s, t precede p` lacks brackets, and `s, t respond to p` an F, also after q
until r.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

from llfsm_verify.logic.formula import Formula, apply, negation

ScopeKind = Literal["globally", "before", "after", "between", "after until"]


@dataclass(frozen=True, slots=True)
class Scope:
    """Where a pattern is to hold: `start` (q) opens a part of a run, `end` (r) closes it."""

    kind: ScopeKind = "globally"
    start: Formula | None = None
    end: Formula | None = None


def conj(*args: Formula) -> Formula:
    return apply("and", *args)


def disj(*args: Formula) -> Formula:
    return apply("or", *args)


def implies(a: Formula, b: Formula) -> Formula:
    return apply("implies", a, b)


def always(f: Formula) -> Formula:
    return apply("G", f)


def eventually(f: Formula, within: str | None = None) -> Formula:
    return apply("F", f) if within is None else apply("F<=", f, bound=within)


def until(a: Formula, b: Formula, within: str | None = None) -> Formula:
    return apply("U", a, b) if within is None else apply("U<=", a, b, bound=within)


def weak(a: Formula, b: Formula) -> Formula:
    return apply("W", a, b)


def _ends(scope: Scope) -> tuple[Formula, Formula]:
    """Q and r of a scope that has both, or r alone."""
    assert scope.end is not None
    return scope.start if scope.start is not None else scope.end, scope.end


def absence(p: Formula, scope: Scope) -> Formula:
    """P does not happen."""
    never = negation(p)
    if scope.kind == "globally":
        return always(never)
    if scope.kind == "after":
        assert scope.start is not None
        return always(implies(scope.start, always(never)))
    q, r = _ends(scope)
    if scope.kind == "before":
        return implies(eventually(r), until(never, r))
    if scope.kind == "between":
        return always(implies(conj(q, negation(r), eventually(r)), until(never, r)))
    return always(implies(conj(q, negation(r)), weak(never, r)))


def universality(p: Formula, scope: Scope) -> Formula:
    """P holds throughout."""
    return absence(negation(p), scope)


def existence(p: Formula, scope: Scope) -> Formula:
    """P happens."""
    if scope.kind == "globally":
        return eventually(p)
    if scope.kind == "after":
        assert scope.start is not None
        return disj(always(negation(scope.start)), eventually(conj(scope.start, eventually(p))))
    q, r = _ends(scope)
    found = conj(p, negation(r))
    if scope.kind == "before":
        return weak(negation(r), found)
    if scope.kind == "between":
        return always(implies(conj(q, negation(r)), weak(negation(r), found)))
    return always(implies(conj(q, negation(r)), until(negation(r), found)))


def bounded_existence(p: Formula, scope: Scope) -> Formula:
    """P begins at most twice."""
    no = negation(p)
    if scope.kind in ("globally", "after"):
        twice = weak(no, weak(p, weak(no, weak(p, always(no)))))
        if scope.kind == "globally":
            return twice
        assert scope.start is not None
        q = scope.start
        return implies(eventually(q), until(negation(q), conj(q, twice)))
    q, r = _ends(scope)
    inside, outside = conj(p, negation(r)), conj(no, negation(r))
    rest = until(no, r) if scope.kind != "after until" else disj(weak(no, r), always(p))
    part = rest
    for stretch in (inside, outside, inside, outside):
        part = until(stretch, disj(r, part))
    if scope.kind == "before":
        return implies(eventually(r), part)
    if scope.kind == "between":
        return always(implies(conj(q, eventually(r)), part))
    return always(implies(q, part))


def precedence(s: Formula, p: Formula, scope: Scope) -> Formula:
    """S precedes p: p does not happen before s has."""
    never = negation(p)
    if scope.kind == "globally":
        return weak(never, s)
    if scope.kind == "after":
        assert scope.start is not None
        return disj(always(negation(scope.start)), eventually(conj(scope.start, weak(never, s))))
    q, r = _ends(scope)
    if scope.kind == "before":
        return implies(eventually(r), until(never, disj(s, r)))
    if scope.kind == "between":
        return always(implies(conj(q, negation(r), eventually(r)), until(never, disj(s, r))))
    return always(implies(conj(q, negation(r)), weak(never, disj(s, r))))


def response(s: Formula, p: Formula, scope: Scope, within: str | None = None) -> Formula:
    """S responds to p: whenever p happens, s does then or later. `within`: so many milliseconds at most."""
    if scope.kind in ("globally", "after"):
        answered = always(implies(p, eventually(s, within)))
        if scope.kind == "globally":
            return answered
        assert scope.start is not None
        return always(implies(scope.start, answered))
    q, r = _ends(scope)
    answered = implies(p, until(negation(r), conj(s, negation(r)), within))
    if scope.kind == "before":
        return implies(eventually(r), until(answered, r))
    if scope.kind == "between":
        return always(implies(conj(q, negation(r), eventually(r)), until(answered, r)))
    return always(implies(conj(q, negation(r)), weak(answered, r)))


def _next(f: Formula) -> Formula:
    return apply("X", f)


def _at_first(q: Formula, f: Formula) -> Formula:
    """F holds where q does first."""
    return disj(always(negation(q)), until(negation(q), conj(q, f)))


def precedence_2_1(s: Formula, t: Formula, p: Formula, scope: Scope) -> Formula:
    """S, and t after it, precede p: p does not happen before."""
    never = negation(p)
    causes = conj(s, never, _next(until(never, t)))
    if scope.kind in ("globally", "after"):
        whole = implies(eventually(p), until(never, causes))
        return whole if scope.start is None else _at_first(scope.start, whole)
    q, r = _ends(scope)
    part = until(never, disj(r, causes))
    if scope.kind == "before":
        return implies(eventually(r), part)
    if scope.kind == "between":
        return always(implies(conj(q, eventually(r)), part))
    return always(implies(q, implies(eventually(p), part)))


def precedence_1_2(s: Formula, t: Formula, p: Formula, scope: Scope) -> Formula:
    """P precedes s, t: s does not happen before p has, where t comes after it."""
    effects = conj(s, _next(eventually(t)))
    if scope.kind in ("globally", "after"):
        whole = implies(eventually(effects), until(negation(s), p))
        return whole if scope.start is None else _at_first(scope.start, whole)
    q, r = _ends(scope)
    inside = conj(s, negation(r), _next(until(negation(r), conj(t, negation(r)))))
    part = until(negation(inside), disj(r, p))
    if scope.kind == "before":
        return implies(eventually(r), part)
    if scope.kind == "between":
        return always(implies(conj(q, eventually(r)), part))
    return always(implies(q, disj(part, always(negation(effects)))))


def response_2_1(s: Formula, t: Formula, p: Formula, scope: Scope) -> Formula:
    """P responds to s, t: after each s that t comes after, p happens then or later."""
    asked, answer = conj(s, _next(eventually(t))), conj(t, eventually(p))
    if scope.kind == "globally":
        return always(implies(asked, _next(eventually(answer))))
    if scope.kind == "after":
        assert scope.start is not None
        return always(implies(scope.start, always(implies(asked, _next(until(negation(t), answer))))))
    r = _ends(scope)[1]
    inside = implies(conj(s, _next(until(negation(r), t))), _next(until(negation(r), answer)))
    return _answered(inside, inside, scope)


def response_1_2(s: Formula, t: Formula, p: Formula, scope: Scope) -> Formula:
    """S, t respond to p: whenever p happens, s does then or later, and t after it."""
    answered = implies(p, eventually(conj(s, _next(eventually(t)))))
    if scope.kind == "globally":
        return always(answered)
    if scope.kind == "after":
        assert scope.start is not None
        return always(implies(scope.start, always(answered)))
    r = _ends(scope)[1]
    inside = implies(p, until(negation(r), conj(s, negation(r), _next(until(negation(r), t)))))
    return _answered(inside, answered, scope)


def _answered(inside: Formula, endless: Formula, scope: Scope) -> Formula:
    """`inside` until r; where r need not come, `endless` is enough from some point on."""
    q, r = _ends(scope)
    if scope.kind == "before":
        return implies(eventually(r), until(inside, r))
    if scope.kind == "between":
        return always(implies(conj(q, eventually(r)), until(inside, r)))
    return always(implies(q, until(inside, disj(r, always(endless)))))


SIMPLE: Final[dict[str, Callable[[Formula, Scope], Formula]]] = {
    "absence": absence,
    "existence": existence,
    "universality": universality,
    "bounded existence": bounded_existence,
}
"""The patterns of one event, by the words before `of`."""
