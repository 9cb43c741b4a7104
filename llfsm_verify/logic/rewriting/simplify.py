"""Formulas of the same meaning that make smaller automata."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from llfsm_verify.limits import tick
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, postorder
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import both, either, nnf, temporal
from llfsm_verify.logic.rewriting.simplify_joins import after_next, joined, later, leading_next

MAX_ROUNDS = 6
"""Passes over a formula at most; each ends with a formula of the same meaning."""
MAX_NESTED = 30
"""So many rules may call each other, which takes some frames of Python's stack each."""


def simplified(formula: Formula, negate: bool = False) -> Formula:
    """An equivalent of `formula` (`negate`: of its negation) in negation normal form."""
    return Simplifier().simplify(nnf(formula, negate))


class Simplifier:
    """Rewrites formulas in negation normal form; what was found out is remembered from call to call.

    Sources: Etessami and Holzmann, Optimizing Büchi automata, CONCUR 2000; Somenzi and Bloem, Efficient Büchi automata
    from LTL formulae, CAV 2000; Babiak, Křetínský, Řehák and Strejček, LTL to Büchi automata translation: fast and more
    deterministic, TACAS 2012. Each rule is an equivalence that holds at every position of every word.
    """

    def __init__(self, implies: Implication | None = None) -> None:
        """`implies`: what it found out is shared with others; answers about ten atoms at most do not depend on that."""
        self.implies = Implication() if implies is None else implies
        self._nested = 0
        self._pure = self.implies.purity
        self._done: dict[Formula, Formula] = {}
        self._boolean: dict[int, Formula] = {}

    def simplify(self, formula: Formula) -> Formula:
        """`formula`, which is in negation normal form, passed over until nothing changes."""
        for _ in range(MAX_ROUNDS):
            following = self._pass(formula)
            if following is formula:
                break
            formula = following
        return formula

    def _pass(self, formula: Formula) -> Formula:
        done = self._done
        for node in postorder(formula):
            if node not in done:
                literal = node.op in ("true", "false", "atom", "not")
                done[node] = node if literal else self.make(node.op, *(done[a] for a in node.args))
        return done[formula]

    def make(self, op: Op, *args: Formula) -> Formula:
        """`op` applied to simplified formulas, simplified."""
        return self._within(lambda: self._made(op, *args), op, *args)

    def _within(self, simplify: Callable[[], Formula], op: Op, *args: Formula) -> Formula:
        """What `simplify` gives; `op` applied to `args` where rules have called each other too often to go on."""
        tick()
        if self._nested == MAX_NESTED:
            return both(args) if op == "and" else either(args) if op == "or" else temporal(op, *args)
        self._nested += 1
        try:
            return simplify()
        finally:
            self._nested -= 1

    def _made(self, op: Op, *args: Formula) -> Formula:
        match op:
            case "and" | "or":
                return self._join(op, args)
            case "X":
                return self._next(args[0])
            case "F":
                return self._eventually(args[0])
            case "G":
                return self._always(args[0])
            case "U" | "W":
                return self._until(op, *args)
        return self._release(op, *args)

    def _canonical(self, f: Formula) -> Formula:
        """One formula for all equivalent Boolean ones: the first that was met, unless this one is shorter."""
        table = self.implies.table(f)
        if table is None:
            return f
        known = self._boolean.get(table)
        if known is None or len(postorder(f)) < len(postorder(known)):
            self._boolean[table] = f
            return f
        return known

    def _join(self, op: Op, args: Iterable[Formula]) -> Formula:
        return self._canonical(joined(op, args, self.implies, self.make))

    def _and(self, *args: Formula) -> Formula:
        return self._join("and", args)

    def _or(self, *args: Formula) -> Formula:
        return self._join("or", args)

    def _next(self, a: Formula) -> Formula:
        return a if self._pure.is_suspendable(a) else apply("X", a)

    # ------------------------------------------------------------ F and G

    def _eventually(self, a: Formula) -> Formula:
        steps = leading_next(a)
        inner = after_next(a, steps)
        return later(steps, self._within(lambda: self._eventually_now(inner), "F", inner), self.make)

    def _always(self, a: Formula) -> Formula:
        steps = leading_next(a)
        inner = after_next(a, steps)
        return later(steps, self._within(lambda: self._always_now(inner), "G", inner), self.make)

    def _eventually_now(self, a: Formula) -> Formula:
        pure = self._pure
        if pure.is_eventual(a):
            return a
        match a.op:
            case "U":
                return self._eventually(a.args[1])
            case "M":
                return self._eventually(self._and(*a.args))
            case "W":
                return self._or(self._eventually(a.args[1]), self._stable(a.args[0]))
            case "R":
                return self._or(self._eventually(self._and(*a.args)), self._stable(a.args[1]))
            case "G":
                return self._stable(a.args[0])
            case "or":
                out, rest = _split(a, lambda b: pure.is_eventual(b) and not pure.is_suspendable(b))
                if out:
                    return self._or(*out, self._eventually(self._or(*rest)))
            case "and":
                out, rest = _split(a, pure.is_suspendable)
                if out:
                    return self._and(*out, self._eventually(self._and(*rest)))
        return apply("F", a)

    def _always_now(self, a: Formula) -> Formula:
        pure = self._pure
        if pure.is_universal(a):
            return a
        match a.op:
            case "R":
                return self._always(a.args[1])
            case "W":
                return self._always(self._or(*a.args))
            case "M":
                return self._and(self._always(a.args[1]), self._repeated(a.args[0]))
            case "U":
                return self._and(self._always(self._or(*a.args)), self._repeated(a.args[1]))
            case "F":
                return self._repeated(a.args[0])
            case "and":
                out, rest = _split(a, lambda b: pure.is_universal(b) or pure.is_eventual(b))
                if out:
                    return self._and(*map(self._always, out), self._always(self._and(*rest)))
            case "or":
                out, rest = _split(a, pure.is_suspendable)
                if out:
                    return self._or(*out, self._always(self._or(*rest)))
        return apply("G", a)

    def _stable(self, a: Formula) -> Formula:
        """`F G a`."""
        return self._within(lambda: self._stable_now(a), "F", temporal("G", a))

    def _stable_now(self, a: Formula) -> Formula:
        pure = self._pure
        if pure.is_eventual(a):
            return self._always(a)
        if pure.is_universal(a):
            return self._eventually(a)
        match a.op:
            case "X":
                return self._stable(_bare(a))
            case "U":
                return self._and(self._repeated(a.args[1]), self._stable(self._or(*a.args)))
            case "M":
                return self._and(self._repeated(a.args[0]), self._stable(a.args[1]))
            case "W":
                return self._stable(self._or(*a.args))
            case "R":
                return self._stable(a.args[1])
            case "and" | "or":
                out, rest = _split(a, lambda b: pure.is_eventual(b) or pure.is_universal(b))
                if out:
                    return self._join(a.op, [self._stable(b) for b in (*out, self._join(a.op, rest))])
                if a.op == "and" and any(b.op == "X" for b in rest):
                    return self._stable(self._and(*(_bare(b) for b in rest)))
        return apply("F", apply("G", a))

    def _repeated(self, a: Formula) -> Formula:
        """`G F a`."""
        return self._within(lambda: self._repeated_now(a), "G", temporal("F", a))

    def _repeated_now(self, a: Formula) -> Formula:
        pure = self._pure
        if pure.is_eventual(a):
            return self._always(a)
        if pure.is_universal(a):
            return self._eventually(a)
        match a.op:
            case "X":
                return self._repeated(_bare(a))
            case "R":
                return self._or(self._stable(a.args[1]), self._repeated(self._and(*a.args)))
            case "W":
                return self._or(self._stable(a.args[0]), self._repeated(a.args[1]))
            case "M":
                return self._repeated(self._and(*a.args))
            case "U":
                return self._repeated(a.args[1])
            case "and" | "or":
                out, rest = _split(a, lambda b: pure.is_eventual(b) or pure.is_universal(b))
                if out:
                    return self._join(a.op, [self._repeated(b) for b in (*out, self._join(a.op, rest))])
                if a.op == "or" and any(b.op == "X" for b in rest):
                    return self._repeated(self._or(*(_bare(b) for b in rest)))
        return apply("G", apply("F", a))

    # ------------------------------------------------------------ U W R M

    def _until(self, op: Op, a: Formula, b: Formula) -> Formula:
        """`a U b` or `a W b`."""
        pure, implies = self._pure, self.implies
        strong = op == "U"
        if implies(a, b) or (strong and pure.is_eventual(b)):
            return b
        if implies.exhausts(a, b):
            return self._eventually(b) if strong else TRUE
        if b is FALSE:
            return FALSE if strong else self._always(a)
        if a.op == "X" and b.op == "X":
            steps = min(leading_next(a), leading_next(b))
            return later(steps, self.make(op, after_next(a, steps), after_next(b, steps)), self.make)
        if strong and pure.is_universal(a):
            return self._or(b, self._and(a, self._eventually(b)))
        if not strong and pure.is_universal(a):
            return self._or(a, b)
        if not strong and pure.is_eventual(b):
            return self._or(self._always(a), b)
        if b.op == "or":  # a U (b | s) = (a U b) | s
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._or(*out, self.make(op, a, self._or(*rest)))
        if b.op == "and" and strong:
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._and(*out, self.make(op, a, self._and(*rest)))
        if b.op == "and" and any(implies(a, c) for c in b.args):  # a U (b & c) = b M a, when a and c are the same
            same = [c for c in b.args if implies(a, c)]
            if any(implies(c, a) for c in same):
                others = [c for c in b.args if c not in same]
                return self.make("M" if strong else "R", self._and(*others), a)
        if a.op in ("U", "W") and implies(a.args[1], b) and (not strong or a.op == "U"):
            return self._or(a, b)
        if a.op == "or":  # (a | c) U b = a U b, when c implies b
            rest = [c for c in a.args if not implies(c, b)]
            if len(rest) < len(a.args):
                return self.make(op, self._or(*rest), b)
        if a.op == "and":  # (a & c) U b = a U b, when c holds where b does not
            rest = [c for c in a.args if not implies.exhausts(c, b)]
            if len(rest) < len(a.args):
                return self.make(op, self._and(*rest), b)
        return apply(op, a, b)

    def _release(self, op: Op, a: Formula, b: Formula) -> Formula:
        """`a R b` or `a M b`."""
        pure, implies = self._pure, self.implies
        strong = op == "M"
        if implies(b, a) or (not strong and pure.is_universal(b)):
            return b
        if implies.excludes(a, b):
            return FALSE if strong else self._always(b)
        if b is TRUE:
            return self._eventually(a) if strong else TRUE
        if a.op == "X" and b.op == "X":
            steps = min(leading_next(a), leading_next(b))
            return later(steps, self.make(op, after_next(a, steps), after_next(b, steps)), self.make)
        if not strong and pure.is_eventual(a):
            return self._and(b, self._or(a, self._always(b)))
        if strong and pure.is_eventual(a):
            return self._and(a, b)
        if strong and pure.is_universal(b):
            return self._and(self._eventually(a), b)
        if b.op == "and":
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._and(*out, self.make(op, a, self._and(*rest)))
        if b.op == "or" and not strong:
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._or(*out, self.make(op, a, self._or(*rest)))
        if b.op == "or" and any(implies(c, a) for c in b.args):  # a R (b | c) = b W a, when a and c are the same
            same = [c for c in b.args if implies(c, a)]
            if any(implies(a, c) for c in same):
                others = [c for c in b.args if c not in same]
                return self.make("U" if strong else "W", self._or(*others), a)
        if a.op in ("R", "M") and implies(b, a.args[1]) and (strong or a.op == "R"):
            return self._and(a, b)
        if a.op == "and":  # (a & c) R b = a R b, when b implies c
            rest = [c for c in a.args if not implies(b, c)]
            if len(rest) < len(a.args):
                return self.make(op, self._and(*rest), b)
        if a.op == "or":  # (a | c) R b = a R b, when c and b exclude each other
            rest = [c for c in a.args if not implies.excludes(c, b)]
            if len(rest) < len(a.args):
                return self.make(op, self._or(*rest), b)
        return apply(op, a, b)


def _split(f: Formula, wanted: Callable[[Formula], bool]) -> tuple[list[Formula], list[Formula]]:
    """The arguments of `f` that are `wanted`, and the others."""
    return [a for a in f.args if wanted(a)], [a for a in f.args if not wanted(a)]


def _bare(a: Formula) -> Formula:
    return after_next(a, leading_next(a))
