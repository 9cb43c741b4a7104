"""Formulas of linear temporal logic: immutable, hash-consed (equal formulas are one object), of any depth."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from threading import RLock
from typing import Literal
from weakref import WeakValueDictionary

Op = Literal[
    "true", "false", "atom", "not", "and", "or", "xor", "implies", "iff", "X", "F", "G", "U", "W", "R", "M"
]  # fmt: skip

ARITY: dict[Op, int | None] = {
    "true": 0, "false": 0, "atom": 0, "not": 1, "X": 1, "F": 1, "G": 1,
    "and": None, "or": None, "xor": 2, "implies": 2, "iff": 2, "U": 2, "W": 2, "R": 2, "M": 2,
}  # fmt: skip
"""The number of arguments of each operator; None: two or more."""


@dataclass(frozen=True, slots=True, eq=False, repr=False, weakref_slot=True)
class Formula:
    """A node of a formula. Made only by the functions below, so that equal formulas are the same object.

    `key` names the proposition of an atom ("" elsewhere). `number` counts formulas in the order in which they were
    made: it is the hash, so that sets of formulas have the same order in every run, and a sort key.
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
        from llfsm_verify.logic.printing import to_text

        return to_text(self)

    def __repr__(self) -> str:
        from llfsm_verify.logic.printing import to_text

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


def apply(op: Op, *args: Formula) -> Formula:
    """`op` applied to `args` without rewriting, but that `and` and `or` are flattened. ValueError: wrong number."""
    arity = ARITY[op]
    if op == "atom" or (len(args) < 2 if arity is None else len(args) != arity):
        raise ValueError(f"{op} with {len(args)} arguments")
    if op in ("and", "or"):
        flat: list[Formula] = []
        for a in args:
            flat.extend(a.args if a.op == op else (a,))
        return _make(op, tuple(flat))
    return _make(op, args)


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


def postorder(*roots: Formula) -> list[Formula]:
    """Every distinct subformula of `roots` once, arguments before the formulas they stand in."""
    order: list[Formula] = []
    seen: set[Formula] = set()
    stack: list[tuple[Formula, bool]] = [(root, False) for root in reversed(roots)]
    while stack:
        node, ready = stack.pop()
        if ready:
            order.append(node)
        elif node not in seen:
            seen.add(node)
            stack.append((node, True))
            stack.extend((a, False) for a in reversed(node.args) if a not in seen)
    return order


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
