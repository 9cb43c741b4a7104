"""Regular expressions over letters, read one letter at a time: what must follow, and whether nothing must.

The expressions are those of PSL as Spot reads them (Duret-Lutz, Spot's temporal logic formulas, section 2.5): a state
formula stands for one letter in which it holds.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import product

from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.formula import EXPRESSIONS, FALSE, Formula, Op, apply, atoms, repetition
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.logic.word import truth

EMPTY = apply("empty")
MAX_ATOMS = 12
"""The emptiness of an expression is decided letter by letter for so many atoms."""
MAX_DERIVATIVES = 20_000
MAX_EFFORT = 5_000_000
"""The most arguments of subexpressions that the derivatives of one question look at (a few seconds)."""


def nullable(f: Formula) -> bool:
    """Whether the empty word matches `f`."""
    done: dict[Formula, bool] = {}
    for node in pieces(f):
        match node.op:
            case "empty":
                done[node] = True
            case "seq" | "inter" | "nlm":
                done[node] = all(done[a] for a in node.args)
            case "alt":
                done[node] = any(done[a] for a in node.args)
            case "repeat":
                done[node] = repetition(node)[0] == 0 or done[node.args[0]]
            case "first_match":
                done[node] = done[node.args[0]]
            case _:
                done[node] = False  # one letter, or a fusion, which has one at least
    return done[f]


def derivative(f: Formula, holds: Callable[[Formula], bool]) -> Formula:
    """The expression of the words that may follow a letter for the whole to match `f`; `false` when none may.

    `holds` tells the truth of a state formula in the letter. Source: Brzozowski, Derivatives of regular expressions,
    JACM 11 (1964); a fusion shares the letter, the other operators are closed under the same law.
    """
    done: dict[Formula, Formula] = {}
    for node in pieces(f):
        done[node] = _derivative(node, done, holds)
    return done[f]


def _derivative(node: Formula, done: dict[Formula, Formula], holds: Callable[[Formula], bool]) -> Formula:
    args = node.args
    match node.op:
        case "empty":
            return FALSE
        case "seq":
            options: list[Formula] = []
            for i, a in enumerate(args):
                options.append(sequence((done[a], *args[i + 1 :])))
                if not nullable(a):
                    break
            return union(options)
        case "fuse":
            result = done[args[0]]
            for a in args[1:]:
                later = fusion(result, a)
                result = union((later, done[a])) if nullable(result) else later
            return result
        case "alt":
            return union(done[a] for a in args)
        case "inter":
            return intersection("inter", (done[a] for a in args))
        case "nlm":
            result, rest = done[args[0]], args[0]
            for a in args[1:]:
                options = [intersection("nlm", (result, done[a]))]
                options += [done[a]] if nullable(rest) else []
                options += [result] if nullable(a) else []
                result, rest = union(options), apply("nlm", rest, a)
            return result
        case "repeat":
            low, high = repetition(node)
            if high == 0:
                return FALSE
            rest = repeat(args[0], max(0, low - 1), None if high is None else high - 1)
            return sequence((done[args[0]], rest))
        case "first_match":
            return FALSE if nullable(args[0]) else first_match(done[args[0]])
    return EMPTY if holds(node) else FALSE


def effort(f: Formula) -> int:
    """How many arguments of subexpressions a derivative of `f` looks at; known before it is made."""
    result = 1
    for node in pieces(f):
        if node.op == "seq":
            # A rest is written for each beginning that may be empty.
            empty = next((i for i, a in enumerate(node.args) if not nullable(a)), len(node.args))
            result += len(node.args) * (empty + 1)
        else:
            result += 1 + len(node.args)
    return result


class DerivationBudget:
    """What is left of `MAX_EFFORT` and `MAX_DERIVATIVES` for one question."""

    def __init__(self) -> None:
        self._derivatives, self._effort = MAX_DERIVATIVES, MAX_EFFORT

    def derive(self, f: Formula, times: int = 1) -> None:
        """Before `f` is derived so often; ExpressionTooLarge when nothing is left."""
        self._derivatives -= 1
        if self._derivatives < 0:
            raise ExpressionTooLarge(f"an expression with more than {MAX_DERIVATIVES:,} continuations")
        self.spend(effort(f) * times)

    def spend(self, effort: int) -> None:
        """ExpressionTooLarge when less than that is left."""
        self._effort -= effort
        if self._effort < 0:
            raise ExpressionTooLarge("an expression whose continuations are too long")


def pieces(f: Formula) -> list[Formula]:
    """The subexpressions of `f`, arguments first; state formulas are not taken apart."""
    order: list[Formula] = []
    seen: set[Formula] = set()
    stack: list[tuple[Formula, bool]] = [(f, False)]
    while stack:
        node, ready = stack.pop()
        if ready:
            order.append(node)
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            if node.op in EXPRESSIONS:
                stack.extend((a, False) for a in dict.fromkeys(node.args) if a not in seen)
    return order


def letters(f: Formula) -> list[Formula]:
    """The state formulas that stand for one letter each in `f`, in order of first appearance."""
    found: dict[Formula, None] = {}
    stack = [f]
    seen: set[Formula] = set()
    while stack:
        node = stack.pop()
        if node in seen:
            continue
        seen.add(node)
        if node.op in EXPRESSIONS:
            stack.extend(reversed(node.args))
        else:
            found[node] = None
    return list(found)


# ---------------------------------------------------------------- constructors that keep derivatives finite in number


def union(options: Iterable[Formula]) -> Formula:
    """The union, flat, in one order, without repetitions and without `false`."""
    kept: set[Formula] = set()
    for option in options:
        kept.update(option.args if option.op == "alt" else (option,))
    kept.discard(FALSE)
    parts = sorted(kept, key=lambda f: f.number)
    return FALSE if not parts else parts[0] if len(parts) == 1 else apply("alt", *parts)


def sequence(parts: Iterable[Formula]) -> Formula:
    """The concatenation, without empty words; `false` when a part is."""
    kept = [p for p in parts if p is not EMPTY]
    if FALSE in kept:
        return FALSE
    return EMPTY if not kept else kept[0] if len(kept) == 1 else apply("seq", *kept)


def fusion(left: Formula, right: Formula) -> Formula:
    """The concatenation that shares a letter; it has no empty word."""
    return FALSE if FALSE in (left, right) or EMPTY in (left, right) else apply("fuse", left, right)


def intersection(op: Op, parts: Iterable[Formula]) -> Formula:
    """`inter` (of the same length) or `nlm` (of any length) of `parts`, without repetitions."""
    kept = sorted(set(parts), key=lambda f: f.number)
    if FALSE in kept:
        return FALSE
    if op == "nlm":
        kept = [p for p in kept if p is not EMPTY] or [EMPTY]
    elif EMPTY in kept:
        return EMPTY if all(map(nullable, kept)) else FALSE
    return kept[0] if len(kept) == 1 else apply(op, *kept)


def first_match(f: Formula) -> Formula:
    """The matches of `f` of which no shorter beginning matches."""
    return EMPTY if nullable(f) else f if f is FALSE or f.op == "first_match" else apply("first_match", f)


# ---------------------------------------------------------------- emptiness


def has_word(f: Formula, known: dict[Formula, bool], budget: DerivationBudget | None = None) -> bool:
    """Whether any word matches `f`, by trying all letters of its atoms; ExpressionTooLarge: too many of them.

    `known` remembers answers between calls (for expressions over the same atoms). `budget`: of a larger question.
    """
    budget = budget or DerivationBudget()
    keys = atoms(f)
    if len(keys) > MAX_ATOMS:
        raise ExpressionTooLarge(f"an expression over more than {MAX_ATOMS} atoms")
    worlds = [dict(zip(keys, values, strict=True)) for values in product((False, True), repeat=len(keys))]
    tests = [lambda g, w=world: truth(g, w) for world in worlds]
    came: dict[Formula, Formula | None] = {f: None}
    queue = [f]
    for node in queue:
        if nullable(node) or known.get(node):
            at: Formula | None = node
            while at is not None:
                known[at] = True
                at = came[at]
            return True
        if known.get(node) is False:
            continue
        budget.derive(node, len(tests))
        for test in tests:
            following = derivative(node, test)
            if following is not FALSE and following not in came:
                came[following] = node
                queue.append(following)
    for node in queue:
        known[node] = False
    return False
