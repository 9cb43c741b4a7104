"""Does one formula imply another? Decided by their forms: yes is always right, no means not seen."""

from __future__ import annotations

from llfsm_verify.logic.formula import FALSE, TRUE, Formula, postorder
from llfsm_verify.logic.rewriting.normal_form import nnf

MAX_DEPTH = 80
"""Pairs of formulas that are together deeper are not compared: the comparison is recursive."""
MAX_ATOMS = 10
"""Boolean formulas are compared exactly when they speak of the first so many atoms met."""


class Implication:
    """`implies(f, g)` for formulas in negation normal form, remembered.

    Source: Somenzi and Bloem, Efficient Büchi automata from LTL formulae, CAV 2000; extended to `W` and `M` and to
    eventual and universal formulas.
    """

    def __init__(self) -> None:
        self.purity = Purity()
        self._known: dict[tuple[Formula, Formula], bool] = {}
        self._depths: dict[Formula, int] = {}
        self._tables: dict[Formula, int | None] = {}
        self._atoms: dict[str, int] = {}
        self._negations: dict[Formula, Formula] = {}

    def __len__(self) -> int:
        """The number of answers remembered."""
        return len(self._known)

    def __call__(self, f: Formula, g: Formula) -> bool:
        """Whether every word that satisfies `f` satisfies `g`, as far as is seen."""
        if f is g or f is FALSE or g is TRUE:
            return True
        if f is TRUE or g is FALSE:
            return False
        known = self._known.get((f, g))
        if known is None:
            known = self._comparable(f, g) and self._decide(f, g)
            self._known[f, g] = known
        return known

    def excludes(self, f: Formula, g: Formula) -> bool:
        """Whether no word satisfies both, as far as is seen."""
        return self._comparable(f, g) and (self(f, self.negated(g)) or self(g, self.negated(f)))

    def exhausts(self, f: Formula, g: Formula) -> bool:
        """Whether every word satisfies one of the two, as far as is seen."""
        return self._comparable(f, g) and (self(self.negated(f), g) or self(self.negated(g), f))

    def negated(self, f: Formula) -> Formula:
        """The negation normal form of the negation."""
        found = self._negations.get(f)
        if found is None:
            found = self._negations[f] = nnf(f, True)
        return found

    def table(self, f: Formula) -> int | None:
        """The truth table of a Boolean formula over the first atoms met; None: temporal, or it has other atoms."""
        if f not in self._tables:
            for node in postorder(f, known=self._tables):
                self._tables[node] = self._computed(node)
        return self._tables[f]

    def _computed(self, f: Formula) -> int | None:
        every = (1 << (1 << MAX_ATOMS)) - 1
        if f.op in ("true", "false"):
            return every if f.op == "true" else 0
        if f.op == "atom":
            i = self._atoms.setdefault(f.key, len(self._atoms))
            if i >= MAX_ATOMS:
                return None
            return (((1 << (1 << i)) - 1) << (1 << i)) * (every // ((1 << (2 << i)) - 1))
        if f.op not in ("not", "and", "or"):
            return None
        tables = [self._tables[a] for a in f.args]
        total = every if f.op == "and" else 0
        for table in tables:
            if table is None:
                return None
            total = total & table if f.op == "and" else total | table
        return every ^ total if f.op == "not" else total

    def _comparable(self, f: Formula, g: Formula) -> bool:
        return self._depth(f) + self._depth(g) <= MAX_DEPTH

    def _depth(self, f: Formula) -> int:
        if f not in self._depths:
            for node in postorder(f, known=self._depths):
                self._depths[node] = 1 + max((self._depths[a] for a in node.args), default=0)
        return self._depths[f]

    def _decide(self, f: Formula, g: Formula) -> bool:
        boolean = self.purity.is_boolean(f), self.purity.is_boolean(g)
        if all(boolean):
            left, right = self.table(f), self.table(g)
            if left is not None and right is not None:
                return left & ~right == 0
        if f.op == "or":
            return all(self(a, g) for a in f.args)
        if g.op == "and":
            return all(self(f, b) for b in g.args)
        if f.op == "and" and any(self(a, g) for a in f.args):
            return True
        if g.op == "or" and any(self(f, b) for b in g.args):
            return True
        return self._by_left(f, g) or self._by_right(f, g) or self._by_both(f, g)

    def _by_left(self, f: Formula, g: Formula) -> bool:
        eventual = self.purity.is_eventual(g)
        a, b = f.args[0] if f.args else f, f.args[-1] if f.args else f
        match f.op:
            case "F" | "X":
                return eventual and self(a, g)
            case "G" | "R":
                return self(b, g)
            case "U":
                return (eventual or self(a, g)) and self(b, g)
            case "W":
                return self(a, g) and self(b, g)
            case "M":
                return self(b, g) or (eventual and self(a, g))
        return False

    def _by_right(self, f: Formula, g: Formula) -> bool:
        universal = self.purity.is_universal(f)
        a, b = g.args[0] if g.args else g, g.args[-1] if g.args else g
        match g.op:
            case "F" | "U":
                return self(f, b)
            case "G" | "X":
                return universal and self(f, b)
            case "W":
                return self(f, b) or (universal and self(f, a))
            case "R":
                return (universal or self(f, a)) and self(f, b)
            case "M":
                return self(f, a) and self(f, b)
        return False

    def _by_both(self, f: Formula, g: Formula) -> bool:
        if not f.args or not g.args:
            return False
        if f.op == "X":
            return g.op == "X" and self(f.args[0], g.args[0])
        left, right = _normal(f), _normal(g)
        if left is None or right is None:
            return False
        (strong, a, b), (demanded, c, d) = left, right
        if demanded and not strong:
            return False
        # a until b implies c until d when a implies c and b implies d; b may be a conjunction, d too.
        return self(a, c) and all(any(self(x, y) for x in b) for y in d)


def _normal(f: Formula) -> tuple[bool, Formula, tuple[Formula, ...]] | None:
    """A binary operator as `left U right` (True) or `left W right` (False), the right side a conjunction."""
    match f.op:
        case "U" | "W":
            return f.op == "U", f.args[0], (f.args[1],)
        case "M" | "R":
            return f.op == "M", f.args[1], f.args
        case "F":
            return True, TRUE, f.args
        case "G":
            return False, f.args[0], (FALSE,)
    return None


# ---- Formulas whose truth spreads: pure eventualities towards earlier letters, purely universal ones towards later


class Purity:
    """Answers for formulas in negation normal form, remembered.

    An *eventual* formula holds at a position when it holds at a later one; a *universal* one holds at all later
    positions when it holds at one. Formulas that are both do not depend on the position. Only the form is looked at:
    yes is always right. Source: Etessami and Holzmann, Optimizing Büchi automata, CONCUR 2000.
    """

    def __init__(self) -> None:
        self._known: dict[Formula, tuple[bool, bool, bool]] = {}

    def is_eventual(self, f: Formula) -> bool:
        """True at a position when it is true at a later one."""
        return self._of(f)[0]

    def is_universal(self, f: Formula) -> bool:
        """True at all later positions when it is true at one."""
        return self._of(f)[1]

    def is_suspendable(self, f: Formula) -> bool:
        """Eventual and universal: `G F p`, and the like."""
        eventual, universal, _ = self._of(f)
        return eventual and universal

    def is_boolean(self, f: Formula) -> bool:
        """There is no temporal operator."""
        return self._of(f)[2]

    def _of(self, f: Formula) -> tuple[bool, bool, bool]:
        known = self._known.get(f)
        if known is None:
            for node in postorder(f, known=self._known):
                self._known[node] = self._computed(node)
            known = self._known[f]
        return known

    def _computed(self, f: Formula) -> tuple[bool, bool, bool]:
        args = [self._known[a] for a in f.args]
        eventual = all(a[0] for a in args)
        universal = all(a[1] for a in args)
        boolean = all(a[2] for a in args)
        match f.op:
            case "true" | "false":
                return True, True, True
            case "atom" | "not":
                return False, False, True
            case "and" | "or":
                return eventual, universal, boolean
            case "X":
                return eventual, universal, False
            case "F":
                return True, universal, False
            case "G":
                return eventual, True, False
            case "U" | "R":
                return args[1][0], args[1][1], False
            case "W":
                return eventual, args[1][1], False
            case "M":
                return args[1][0], universal, False
        raise ValueError(f"not in negation normal form: {f.op}")
