"""Formulas of linear temporal logic: immutable, hash-consed (equal formulas are one object), of any depth; and their
text in the syntax of property files, with the parentheses that reading them back needs."""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterable
from dataclasses import dataclass
from itertools import count
from threading import RLock
from typing import Literal
from weakref import WeakValueDictionary

from llfsm_verify.logic.parsing.tokens import needs_quotes

Op = Literal[
    "true", "false", "atom", "not", "and", "or", "xor", "implies", "iff", "X", "F", "G", "U", "W", "R", "M",
    "Y", "Z", "O", "H", "S", "T", "X[]", "F[]", "G[]", "F<=", "G<=", "U<=", "R<=",
    "O[]", "H[]", "S[]", "T[]", "O<=", "H<=", "S<=", "T<=",
    "empty", "seq", "fuse", "alt", "inter", "nlm", "repeat", "first_match", "[]->", "<>->", "closure", "initially",
]  # fmt: skip

ARITY: dict[Op, int | None] = {
    "true": 0, "false": 0, "atom": 0, "not": 1, "X": 1, "F": 1, "G": 1,
    "and": None, "or": None, "xor": 2, "implies": 2, "iff": 2, "U": 2, "W": 2, "R": 2, "M": 2,
}  # fmt: skip
"""The number of arguments of each operator of plain temporal logic; None: two or more."""

EXTENDED_ARITY: dict[Op, int | None] = {
    **ARITY,
    # past: Y previous (false at the start), Z previous (true there), O once, H historically, S since, T triggered
    "Y": 1, "Z": 1, "O": 1, "H": 1, "S": 2, "T": 2,
    # steps: the bound is `n` for X[n], and `n:m` for F[n:m] and the others
    "X[]": 1, "F[]": 1, "G[]": 1, "O[]": 1, "H[]": 1, "S[]": 2, "T[]": 2,
    # time: the bound is the largest number of milliseconds, whole or with a decimal point, or the least, `:`, and the
    # largest or nothing
    "F<=": 1, "G<=": 1, "U<=": 2, "R<=": 2, "O<=": 1, "H<=": 1, "S<=": 2, "T<=": 2,
    # regular expressions over formulas without temporal operators; the bound of `repeat` is `i:j`, or `i:` without end
    "empty": 0, "seq": None, "fuse": None, "alt": None, "inter": None, "nlm": None, "repeat": 1, "first_match": 1,
    # an expression with a formula: after every match, after some match; and the weak closure of an expression
    "[]->": 2, "<>->": 2, "closure": 1,
    # only in formulas as they are written: it means its argument
    "initially": 1,
}  # fmt: skip
"""The number of arguments of every operator; None: two or more (docs/property-reference.md says what each means)."""

STEPS: frozenset[Op] = frozenset({"X[]", "F[]", "G[]"})
"""The operators of the future with a bound in steps, which are written out by `X`."""
PAST_STEPS: frozenset[Op] = frozenset({"O[]", "H[]", "S[]", "T[]"})
PAST_TIMED: frozenset[Op] = frozenset({"O<=", "H<=", "S<=", "T<="})
BOUNDED_PAST = PAST_STEPS | PAST_TIMED
PAST: frozenset[Op] = BOUNDED_PAST | {"Y", "Z", "O", "H", "S", "T"}
TIMED: frozenset[Op] = PAST_TIMED | {"F<=", "G<=", "U<=", "R<="}
BOUNDED: frozenset[Op] = STEPS | PAST_STEPS | TIMED | {"repeat"}
"""The operators that carry a bound."""
EXPRESSIONS: frozenset[Op] = frozenset({"empty", "seq", "fuse", "alt", "inter", "nlm", "repeat", "first_match"})
"""The operators of regular expressions (whose smallest pieces are formulas without temporal operators)."""
BINDING: frozenset[Op] = frozenset({"[]->", "<>->", "closure"})
"""The operators that make a formula of an expression."""
BOOLEAN: frozenset[Op] = frozenset({"true", "false", "atom", "not", "and", "or", "xor", "implies", "iff"})
"""The operators of state formulas."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, weakref_slot=True)
class Formula:
    """A node of a formula. Made only by the functions below, so that equal formulas are the same object.

    `key` names the proposition of an atom, or is the bound of a bounded operator ("" elsewhere). `number` counts
    formulas in the order in which they were made: it is the hash, so that sets of formulas have the same order in every
    run, and a sort key.
    """

    op: Op
    args: tuple[Formula, ...]
    key: str
    number: int

    def __hash__(self) -> int:
        return self.number

    def __reduce__(self) -> tuple[Callable[[tuple[Packed, ...]], Formula], tuple[tuple[Packed, ...]]]:
        nodes = postorder(self)
        index = {node: i for i, node in enumerate(nodes)}
        return _unpack, (tuple((n.op, n.key, tuple(index[a] for a in n.args)) for n in nodes),)

    def __str__(self) -> str:
        return to_text(self)

    def __repr__(self) -> str:
        return f"<Formula {to_text(self, limit=80)}>"


Packed = tuple[Op, str, tuple[int, ...]]
"""One node of a pickled formula: operator, key, and the places of its arguments in the list."""

_table: WeakValueDictionary[tuple[Op, tuple[Formula, ...], str], Formula] = WeakValueDictionary()
_numbers = count()
_lock = RLock()  # collecting garbage inside may run code that makes formulas


def _make(op: Op, args: tuple[Formula, ...] = (), key: str = "") -> Formula:
    name = (op, args, key)
    with _lock:
        found = _table.get(name)
        if found is None:
            found = Formula(op, args, key, next(_numbers))
            _table[name] = found
        return found


def _unpack(nodes: tuple[Packed, ...]) -> Formula:
    made: list[Formula] = []
    for op, key, args in nodes:
        made.append(_make(op, tuple(made[i] for i in args), key))
    return made[-1]


TRUE = _make("true")
FALSE = _make("false")


def atom(key: str) -> Formula:
    """The atomic proposition called `key`, which is not empty."""
    if not key:
        raise ValueError("an atom needs a key")
    return _make("atom", (), key)


def apply(op: Op, *args: Formula, bound: str = "") -> Formula:
    """`op` applied to `args` without rewriting, but that operators of any number of arguments are flattened.

    ValueError: the wrong number of arguments, or a bound where none belongs or none where one does.
    """
    arity = EXTENDED_ARITY[op]
    if op == "atom" or (len(args) < 2 if arity is None else len(args) != arity):
        raise ValueError(f"{op} with {len(args)} arguments")
    if bool(bound) != (op in BOUNDED):
        raise ValueError(f"{op} with the bound {bound!r}")
    if arity is None:
        flat: list[Formula] = []
        for a in args:
            flat.extend(a.args if a.op == op else (a,))
        return _make(op, tuple(flat))
    return _make(op, args, bound)


def operators(f: Formula) -> frozenset[Op]:
    """The operators that `f` uses."""
    return frozenset(node.op for node in postorder(f))


def is_plain(f: Formula) -> bool:
    """`f` is of plain temporal logic: no past, no bounds, no regular expressions."""
    return all(node.op in ARITY for node in postorder(f))


def is_boolean(f: Formula) -> bool:
    """`f` is a state formula: it has no temporal operator and is no regular expression."""
    return all(node.op in BOOLEAN for node in postorder(f))


def negation(f: Formula) -> Formula:
    """`!f`; two negations cancel."""
    return f.args[0] if f.op == "not" else _make("not", (f,))


def conjunction(formulas: Iterable[Formula]) -> Formula:
    """The conjunction of any number of formulas, none of them rewritten."""
    args = tuple(formulas)
    return TRUE if not args else args[0] if len(args) == 1 else apply("and", *args)


def disjunction(formulas: Iterable[Formula]) -> Formula:
    """The disjunction of any number of formulas, none of them rewritten."""
    args = tuple(formulas)
    return FALSE if not args else args[0] if len(args) == 1 else apply("or", *args)


# ---------------------------------------------------------------- walks (after pysmt's walkers/dag.py: no recursion)


def postorder(*roots: Formula, known: Container[Formula] = ()) -> list[Formula]:
    """Every distinct subformula of `roots` once, arguments before the formulas they stand in; those that are `known`,
    and what is below them alone, are left out."""
    order: list[Formula] = []
    seen: set[Formula] = set()
    stack: list[tuple[Formula, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        node, ready = stack.pop()
        if ready:
            order.append(node)
        elif node not in seen and node not in known:
            seen.add(node)
            if node.args:
                stack.append((node, True))
                stack.extend([(a, False) for a in reversed(node.args) if a not in seen])
            else:
                order.append(node)
    return order


def mapped(f: Formula, change: Callable[[Formula, tuple[Formula, ...]], Formula | None]) -> Formula:
    """`f` with what `change` makes of each subformula, of which it is told what became of the arguments; None: the same
    operator over these."""
    done: dict[Formula, Formula] = {}
    for node in postorder(f):
        args = tuple(done[a] for a in node.args)
        made = change(node, args)
        if made is None and args == node.args:
            made = node
        elif made is None:
            made = negation(*args) if node.op == "not" else apply(node.op, *args, bound=node.key)
        done[node] = made
    return done[f]


def size(f: Formula) -> int:
    """The number of distinct subformulas."""
    return len(postorder(f))


def depth(f: Formula) -> int:
    """The number of operators on the longest path from the top to an atom or constant."""
    depths: dict[Formula, int] = {}
    for node in postorder(f):
        depths[node] = 1 + max(depths[a] for a in node.args) if node.args else 0
    return depths[f]


def atoms(*formulas: Formula) -> tuple[str, ...]:
    """The keys of the atoms of `formulas`, each once, in order of first appearance."""
    return tuple(node.key for node in postorder(*formulas) if node.op == "atom")


def repetition(f: Formula) -> tuple[int, int | None]:
    """The least and the largest number of repetitions (None: any) of a `repeat`."""
    low, _, high = f.key.partition(":")
    return int(low), int(high) if high else None


# ---------------------------------------------------------------- as text

_LEVEL: dict[Op, int] = {
    "iff": 1, "implies": 2, "or": 3, "xor": 4, "and": 5,
    "U": 6, "W": 6, "R": 6, "M": 6, "S": 6, "T": 6, "U<=": 6, "R<=": 6,
    "S[]": 6, "T[]": 6, "S<=": 6, "T<=": 6,
    "not": 7, "X": 7, "F": 7, "G": 7, "Y": 7, "Z": 7, "O": 7, "H": 7,
    "initially": 7, "X[]": 7, "F[]": 7, "G[]": 7, "F<=": 7, "G<=": 7,
    "O[]": 7, "H[]": 7, "O<=": 7, "H<=": 7, "atom": 8, "true": 8, "false": 8,
}  # fmt: skip
"""How tightly an operator binds (the levels of grammar.lark)."""

_SIGN: dict[Op, str] = {"and": " && ", "or": " || ", "xor": " xor ", "implies": " -> ", "iff": " <-> "}


def to_text(f: Formula, limit: int | None = None) -> str:
    """`f` as `parse_formula` reads it. `limit`: stop after about that many characters, with an ellipsis."""
    pieces: list[str] = []
    length = 0
    stack: list[Formula | str] = [f]
    while stack:
        top = stack.pop()
        if isinstance(top, str):
            pieces.append(top)
            length += len(top)
            if limit is not None and length > limit:
                pieces.append("…")
                break
        else:
            stack.extend(reversed(_parts(top)))
    return "".join(pieces)


def _parts(f: Formula) -> list[Formula | str]:
    if f.op not in _LEVEL:
        return list(_regular(f))
    if f.op == "atom":
        return [f'"{f.key}"' if needs_quotes(f.key) else f.key]
    if not f.args:
        return [f.op]
    if len(f.args) == 1:
        (a,) = f.args
        sign = "!" if f.op == "not" else f"{written(f)} "
        # An atom of several words would read back without parentheses too, but `!x == 3` misleads people.
        if _LEVEL.get(a.op, 0) < 7 or (a.op == "atom" and " " in a.key and not needs_quotes(a.key)):
            return [sign, "(", a, ")"]
        return [sign, a]
    parts: list[Formula | str] = []
    for i, a in enumerate(f.args):
        if i:
            parts.append(_SIGN.get(f.op, f" {written(f)} "))
        parts += [a] if _LEVEL.get(a.op, 0) > _LEVEL[f.op] else ["(", a, ")"]
    return parts


def written(f: Formula) -> str:
    """The operator of `f` with its bound: `U`, `F[2:5]`, `O[<=500ms]`, `F[1s:2s]`, `G[>=500ms]`."""
    if f.op in TIMED:
        least, most = (time_text(part) for part in f.key.rpartition(":")[::2])
        times = f"{least}:{most}" if least and most else f">={least}" if least else f"<={most}"
        return f"{f.op[0]}[{times}]"
    return f"{f.op[0]}[{f.key}]" if f.op in STEPS | PAST_STEPS else f.op


def time_text(milliseconds: str, gap: str = "") -> str:
    """A time of so many milliseconds with its unit: `30s`, `1500ms`; nothing for no time."""
    if milliseconds.endswith("000") and milliseconds.isdigit():
        return f"{milliseconds[:-3]}{gap}s"
    return milliseconds and f"{milliseconds}{gap}ms"


def _regular(f: Formula) -> list[Formula | str]:
    """Regular expressions in the syntax of `enforce` and `forbid`; what that lacks stands there by its name."""
    args = f.args
    if f.op in ("seq", "alt"):
        parts: list[Formula | str] = ["("]
        for i, a in enumerate(args):
            parts += [*([" | " if f.op == "alt" else " "] if i else []), *_piece(a)]
        return [*parts, ")"]
    if f.op == "repeat":
        low, high = repetition(f)
        simple = {(0, None): "*", (1, None): "+", (0, 1): "?", (low, low): f"{{{low}}}"}
        return [*_piece(args[0]), simple.get((low, high), f"{{{low},{'' if high is None else high}}}")]
    if f.op == "empty":
        return ["true{0}"]
    pieces: list[Formula | str] = [f"{f.op}("]
    for i, a in enumerate(args):
        pieces += [*([", "] if i else []), *_piece(a)]
    return [*pieces, ")"]


def _piece(f: Formula) -> list[Formula | str]:
    """A part of a regular expression: letters are bracketed unless they are one word."""
    if f.op == "repeat":
        return ["(", f, ")"]
    if f.op in EXPRESSIONS or f.op == "true" or (f.op == "atom" and not needs_quotes(f.key) and _WORD.match(f.key)):
        return [f]
    return ["[", f, "]"]


_WORD = re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)*(?:@[A-Za-z_]\w*)?\Z")
"""The atoms that are letters without brackets."""
