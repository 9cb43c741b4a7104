"""Conjunctions and disjunctions simplified: implied parts dropped, temporal parts with a common side joined."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, postorder
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import both, either

Make = Callable[..., Formula]

MAX_PARTS = 60
"""Joins of more parts are only cleared of repetitions: the rest looks at pairs."""
MAX_NODES = 100
"""Larger parts are not looked into."""


def join(op: Op, args: Iterable[Formula], implies: Implication, make: Make) -> Formula:
    """`args` under `and` or `or`. `make` applies another operator, simplifying."""
    f = both(args) if op == "and" else either(args)
    if f.op != op or len(f.args) > MAX_PARTS:
        return f
    parts = _irredundant(op, list(f.args), implies)
    if parts is None:
        return FALSE if op == "and" else TRUE
    for i, a in enumerate(parts):
        for j in range(i):
            pair = _pair(op, parts[j], a, implies, make)
            if pair is not None:
                rest = [b for k, b in enumerate(parts) if k not in (i, j)]
                return make(op, pair, *rest) if rest else pair
    parts = [_assuming(op, a, [b for b in parts if b is not a], implies, make) for a in parts]
    _spread(op, parts, implies, make)
    return both(parts) if op == "and" else either(parts)


def _irredundant(op: Op, parts: list[Formula], implies: Implication) -> list[Formula] | None:
    """`parts` without those that others make needless; None: they contradict (for `or`: exhaust) each other."""
    follows = implies if op == "and" else lambda a, b: implies(b, a)
    decides = implies.excludes if op == "and" else implies.exhausts
    kept: list[Formula] = []
    for a in parts:
        if any(follows(b, a) for b in kept):
            continue
        if any(decides(a, b) for b in kept):
            return None
        kept = [*(b for b in kept if not follows(a, b)), a]
    return kept


def _assuming(op: Op, a: Formula, others: list[Formula], implies: Implication, make: Make) -> Formula:
    """Parts of `a` that the others decide: in `a & (b | c)`, c goes when it contradicts a, and dually."""
    dual: Op = "or" if op == "and" else "and"
    if a.op != dual:
        return a
    decided = implies.excludes if op == "and" else implies.exhausts
    rest = [c for c in a.args if not any(decided(b, c) for b in others)]
    return a if len(rest) == len(a.args) else make(dual, *rest)


def _spread(op: Op, parts: list[Formula], implies: Implication, make: Make) -> None:
    """Parts that hold at all later letters too decide what is inside the others: `G p & F (p & q)` is `G p & F q`.

    Dually an eventual part of a disjunction, where it is false, is false at all later letters: `F p | G (p | q)` is
    `F p | G q`. One part after the other, since what a part decides may be what would decide it.
    """
    pure = implies.purity.is_universal if op == "and" else implies.purity.is_eventual
    for b in list(parts):
        if b in parts and pure(b):
            for i, a in enumerate(parts):
                if a is not b:
                    parts[i] = _given(op, b, a, implies, make)


def _given(op: Op, b: Formula, a: Formula, implies: Implication, make: Make) -> Formula:
    """`a` where `b` holds at all letters from the first on (for `or`: at none)."""
    nodes = postorder(a)
    if len(nodes) == 1 or len(nodes) > MAX_NODES:
        return a
    found: dict[Formula, Formula] = {}
    for node in nodes:
        if implies(b, node) if op == "and" else implies.exhausts(b, node):
            found[node] = TRUE
        elif implies.excludes(b, node) if op == "and" else implies(node, b):
            found[node] = FALSE
        elif all(found[c] is c for c in node.args):
            found[node] = node
        else:
            found[node] = make(node.op, *(found[c] for c in node.args))
    return found[a]


def _pair(op: Op, a: Formula, b: Formula, implies: Implication, make: Make) -> Formula | None:
    """`a` and `b` under `op` as one temporal formula, if there is a rule for them."""
    found = _same_operator(op, a, b, implies, make) or _one_letter(op, a, b) or _one_letter(op, b, a)
    if found is None:
        found = _with_pure(op, a, b, implies, make) or _with_pure(op, b, a, implies, make)
    return found


def _same_operator(op: Op, a: Formula, b: Formula, implies: Implication, make: Make) -> Formula | None:
    if a.op == b.op == "X":
        steps = min(leading_next(a), leading_next(b))
        return later(steps, make(op, after_next(a, steps), after_next(b, steps)), make)
    alone = implies.purity.is_suspendable(a) or implies.purity.is_suspendable(b)
    if a.op == b.op and a.op == ("G" if op == "and" else "F") and not alone:
        return make(a.op, make(op, a.args[0], b.args[0]))
    if a.op == b.op and a.op in ("F", "G") and a.args[0].op == b.args[0].op == ("G" if op == "and" else "F"):
        return make(a.op, make(a.args[0].op, make(op, a.args[0].args[0], b.args[0].args[0])))
    left, right = ("U", "W"), ("R", "M")
    for family in (left, right):
        if a.op in family and b.op in family:
            # (a U b) & (c U b) = (a & c) U b; (a U b) | (a U c) = a U (b | c); R and M: with sides exchanged
            common = 1 if (op == "and") == (family is left) else 0
            if a.args[common] is b.args[common]:
                other = make(op, a.args[1 - common], b.args[1 - common])
                strongest = family[0] if family is left else family[1]
                weakest = family[1] if family is left else family[0]
                kind = strongest if op == "and" and strongest in (a.op, b.op) else weakest
                kind = strongest if op == "or" and a.op == b.op == strongest else kind
                return make(kind, other, a.args[1]) if common else make(kind, a.args[0], other)
    return None


def _one_letter(op: Op, a: Formula, b: Formula) -> Formula | None:
    """Expansion laws read backwards: `b | (a & X (a U b))` is `a U b`, and the like."""
    one, dual, two = ("F", "and", ("U", "W")) if op == "or" else ("G", "or", ("R", "M"))
    if b.op == "X" and b.args[0].op == one and b.args[0].args[0] is a:
        return b.args[0]
    if b.op == dual and len(b.args) == 2:
        for x, y in (b.args, b.args[::-1]):
            if y.op == "X" and y.args[0].op in two and y.args[0].args == (x, a):
                return y.args[0]
    return None


_PROMISED: dict[tuple[Op, Op, Op], tuple[Op, int]] = {
    ("and", "F", "W"): ("U", 1), ("and", "F", "R"): ("M", 0), ("or", "G", "U"): ("W", 0), ("or", "G", "M"): ("R", 1),
}  # fmt: skip
"""What `F a & (b W a)` and the like are; and which argument of the second operator is that of the first."""


def _with_pure(op: Op, a: Formula, b: Formula, implies: Implication, make: Make) -> Formula | None:
    """A strong operator from a weak one and the promise, and back; suspendable formulas go under `X`."""
    promised = _PROMISED.get((op, a.op, b.op))
    if promised is not None and a.args[0] is b.args[promised[1]]:
        return make(promised[0], *b.args)
    if a.op == ("F" if op == "and" else "G") and b.op == ("G" if op == "and" else "F"):
        first = _from_the_first(op, a.args[0], b.args[0], implies)
        if first:
            return make("M" if op == "and" else "W", a.args[0], b.args[0])
    if op == "or" and a.op == "F" and implies.purity.is_suspendable(b):
        return apply("F", make("or", a.args[0], b))
    if b.op == "X" and implies.purity.is_suspendable(a):
        steps = leading_next(b)
        return later(steps, make(op, a, after_next(b, steps)), make)
    return None


def _from_the_first(op: Op, a: Formula, b: Formula, implies: Implication) -> bool:
    """`G !p | F (p & e)` is `!p W (p & e)` for an eventual e: with any p, e holds from the first one on. And dually."""
    if b.op != ("or" if op == "and" else "and") or not implies.purity.is_boolean(a):
        return False
    pure = implies.purity.is_universal if op == "and" else implies.purity.is_eventual
    opposite = implies.negated(a)
    return opposite in b.args and all(c is opposite or pure(c) for c in b.args)


def leading_next(a: Formula) -> int:
    """How many `X` stand in front."""
    steps = 0
    while a.op == "X":
        steps, a = steps + 1, a.args[0]
    return steps


def after_next(a: Formula, steps: int) -> Formula:
    """`a` without the first `steps` operators, which are `X`."""
    for _ in range(steps):
        a = a.args[0]
    return a


def later(steps: int, a: Formula, make: Make) -> Formula:
    """`a`, `steps` letters later."""
    for _ in range(steps):
        a = make("X", a)
    return a
