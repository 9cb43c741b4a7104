"""Formulas of the same meaning that make smaller automata."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import rebuilt, without_steps
from llfsm_verify.logic.formula import ARITY, EXPRESSIONS, FALSE, TRUE, Formula, Op, apply, negation, postorder
from llfsm_verify.logic.rewriting.implication import Implication
from llfsm_verify.logic.rewriting.normal_form import both, either, nnf, temporal
from llfsm_verify.logic.rewriting.simplify_joins import after_next, join, later, leading_next

Relation = Callable[[Formula, Formula], bool]
Test = Callable[[Formula], bool]

MAX_ROUNDS = 6
"""Passes over a formula at most; each ends with a formula of the same meaning."""
MAX_NESTED = 30
"""So many rules may call each other, which takes some frames of Python's stack each."""


def simplified(formula: Formula, negate: bool = False) -> Formula:
    """An equivalent of `formula` (`negate`: of its negation) in negation normal form."""
    return Simplifier().simplify(nnf(formula, negate))


@dataclass(slots=True, eq=False)
class Side:
    """The operators and relations that a rule names, or in their place the duals.

    The negations of a rule's two formulas are equivalent as well, and in negation normal form each operator has become
    its dual. So a rule is written once: about `F`, `U` and `W`, and read with the duals it is about `G`, `R` and `M`.
    """

    eventually: Op
    always: Op
    until: Op
    weak_until: Op
    release: Op
    strong_release: Op
    conjunction: Op
    disjunction: Op
    true: Formula
    false: Formula
    implies: Relation
    exhausts: Relation
    is_eventual: Test
    is_universal: Test
    leaves: Test
    """Parts of a disjunction that `F` is applied to by themselves."""
    dual: Side = field(init=False)


def side_of_eventually(implies: Implication) -> Side:
    """The side of `F`, `U` and `W`, with that of `G`, `R` and `M` as its dual."""
    pure = implies.purity
    here = Side(
        "F", "G", "U", "W", "R", "M", "and", "or", TRUE, FALSE, implies, implies.exhausts,
        pure.is_eventual, pure.is_universal,
        leaves=lambda a: pure.is_eventual(a) and not pure.is_suspendable(a),
    )  # fmt: skip
    there = Side(
        "G", "F", "R", "M", "U", "W", "or", "and", FALSE, TRUE, lambda a, b: implies(b, a), implies.excludes,
        pure.is_universal, pure.is_eventual,
        leaves=lambda a: pure.is_universal(a) or pure.is_eventual(a),  # more than the dual
    )  # fmt: skip
    here.dual, there.dual = there, here
    return here


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
        self._side = side_of_eventually(self.implies)
        """For rules about `F`, `U` and `W`; its dual is for those about `G`, `R` and `M`."""
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
                return self._eventually(self._side, args[0])
            case "G":
                return self._eventually(self._side.dual, args[0])
            case "U" | "W":
                return self._until(self._side, op, *args)
        return self._until(self._side.dual, op, *args)

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
        return self._canonical(join(op, args, self.implies, self.make))

    def _next(self, a: Formula) -> Formula:
        return a if self._pure.is_suspendable(a) else apply("X", a)

    # ------------------------------------------------------------ F, and dually G

    def _eventually(self, side: Side, a: Formula) -> Formula:
        """`F a`."""
        steps = leading_next(a)
        inner = after_next(a, steps)
        now = self._within(lambda: self._eventually_now(side, inner), side.eventually, inner)
        return later(steps, now, self.make)

    def _eventually_now(self, side: Side, a: Formula) -> Formula:
        both, either = side.conjunction, side.disjunction
        if side.is_eventual(a):
            return a
        match a.op:
            case side.until:  # F (b U c) = F c
                return self._eventually(side, a.args[1])
            case side.strong_release:  # F (b M c) = F (b & c)
                return self._eventually(side, self._join(both, a.args))
            case side.weak_until:  # F (b W c) = F c | F G b
                return self._join(either, [self._eventually(side, a.args[1]), self._stable(side, a.args[0])])
            case side.release:  # F (b R c) = F (b & c) | F G c
                joint = self._eventually(side, self._join(both, a.args))
                return self._join(either, [joint, self._stable(side, a.args[1])])
            case side.always:
                return self._stable(side, a.args[0])
            case side.disjunction:
                out, rest = _split(a, side.leaves)
                if out:
                    parts = [self._eventually(side, b) for b in out]
                    return self._join(either, [*parts, self._eventually(side, self._join(either, rest))])
            case side.conjunction:
                out, rest = _split(a, self._pure.is_suspendable)
                if out:
                    return self._join(both, [*out, self._eventually(side, self._join(both, rest))])
        return apply(side.eventually, a)

    def _stable(self, side: Side, a: Formula) -> Formula:
        """`F G a`."""
        return self._within(lambda: self._stable_now(side, a), side.eventually, temporal(side.always, a))

    def _stable_now(self, side: Side, a: Formula) -> Formula:
        both, either = side.conjunction, side.disjunction
        if side.is_eventual(a):
            return self._eventually(side.dual, a)
        if side.is_universal(a):
            return self._eventually(side, a)
        match a.op:
            case "X":
                return self._stable(side, _bare(a))
            case side.until:  # F G (b U c) = G F c & F G (b | c)
                repeated = self._stable(side.dual, a.args[1])
                return self._join(both, [repeated, self._stable(side, self._join(either, a.args))])
            case side.strong_release:  # F G (b M c) = G F b & F G c
                return self._join(both, [self._stable(side.dual, a.args[0]), self._stable(side, a.args[1])])
            case side.weak_until:  # F G (b W c) = F G (b | c)
                return self._stable(side, self._join(either, a.args))
            case side.release:  # F G (b R c) = F G c
                return self._stable(side, a.args[1])
            case "and" | "or":
                out, rest = _split(a, lambda b: side.is_eventual(b) or side.is_universal(b))
                if out:
                    return self._join(a.op, [self._stable(side, b) for b in (*out, self._join(a.op, rest))])
                if a.op == both and any(b.op == "X" for b in rest):
                    return self._stable(side, self._join(both, [_bare(b) for b in rest]))
        return apply(side.eventually, apply(side.always, a))

    # ------------------------------------------------------------ U and W, and dually R and M

    def _until(self, side: Side, op: Op, a: Formula, b: Formula) -> Formula:
        """`a U b` or `a W b`."""
        pure, implies, exhausts = self._pure, side.implies, side.exhausts
        both, either = side.conjunction, side.disjunction
        strong = op == side.until
        if implies(a, b) or (strong and side.is_eventual(b)):
            return b
        if exhausts(a, b):
            return self._eventually(side, b) if strong else side.true
        if b is side.false:
            return side.false if strong else self._eventually(side.dual, a)
        if a.op == "X" and b.op == "X":
            steps = min(leading_next(a), leading_next(b))
            return later(steps, self.make(op, after_next(a, steps), after_next(b, steps)), self.make)
        if strong and side.is_universal(a):
            return self._join(either, [b, self._join(both, [a, self._eventually(side, b)])])
        if not strong and side.is_universal(a):
            return self._join(either, [a, b])
        if not strong and side.is_eventual(b):
            return self._join(either, [self._eventually(side.dual, a), b])
        if b.op == either:  # a U (b | s) = (a U b) | s
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._join(either, [*out, self.make(op, a, self._join(either, rest))])
        if b.op == both and strong:
            out, rest = _split(b, pure.is_suspendable)
            if out:
                return self._join(both, [*out, self.make(op, a, self._join(both, rest))])
        if b.op == both and any(implies(a, c) for c in b.args):  # a U (b & c) = b M a, when a and c are the same
            same = [c for c in b.args if implies(a, c)]
            if any(implies(c, a) for c in same):
                others = [c for c in b.args if c not in same]
                return self.make(side.strong_release if strong else side.release, self._join(both, others), a)
        if a.op in (side.until, side.weak_until) and implies(a.args[1], b) and (not strong or a.op == side.until):
            return self._join(either, [a, b])
        if a.op == either:  # (a | c) U b = a U b, when c implies b
            rest = [c for c in a.args if not implies(c, b)]
            if len(rest) < len(a.args):
                return self.make(op, self._join(either, rest), b)
        if a.op == both:  # (a & c) U b = a U b, when c holds where b does not
            rest = [c for c in a.args if not exhausts(c, b)]
            if len(rest) < len(a.args):
                return self.make(op, self._join(both, rest), b)
        return apply(op, a, b)


def _split(f: Formula, wanted: Callable[[Formula], bool]) -> tuple[list[Formula], list[Formula]]:
    """The arguments of `f` that are `wanted`, and the others."""
    return [a for a in f.args if wanted(a)], [a for a in f.args if not wanted(a)]


def _bare(a: Formula) -> Formula:
    return after_next(a, leading_next(a))


def simplify_any(formula: Formula) -> Formula:
    """An equivalent of `formula`: step bounds written out, each largest subformula of plain temporal logic simplified.

    The rules for plain formulas hold at every position of every word, so they hold below operators of the past, of time
    and after expressions as well. Expressions themselves stay as they are.
    """
    written = without_steps(formula)
    order = postorder(written)
    plain: set[Formula] = set()
    for node in order:
        if node.op in ARITY and all(a in plain for a in node.args):
            plain.add(node)
    simplifier = Simplifier()
    if written in plain:
        return simplifier.simplify(nnf(written))
    done: dict[Formula, Formula] = {}
    for node in order:
        if node not in plain:
            done[node] = _joined(node, tuple(_part(node, a, done, simplifier) for a in node.args))
    return done[written]


def _part(owner: Formula, part: Formula, done: dict[Formula, Formula], simplifier: Simplifier) -> Formula:
    if part in done:
        return done[part]
    if owner.op in EXPRESSIONS or (owner.op in ("[]->", "<>->", "closure") and part is owner.args[0]):
        return part  # a letter
    done[part] = simplifier.simplify(nnf(part))
    return done[part]


def _joined(node: Formula, args: tuple[Formula, ...]) -> Formula:
    match node.op:
        case "and":
            return both(args)
        case "or":
            return either(args)
        case "not":
            return negation(args[0])
        case "X" | "F" | "G" | "U" | "W" | "R" | "M":
            return temporal(node.op, *args)
    return rebuilt(node, args)
