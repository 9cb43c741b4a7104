"""Labels in the words of users: intervals of one input, or what holds of several."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.backends.smt.solver import GaveUp
from llfsm_verify.kripke.labels.labels import Labels, Read
from llfsm_verify.kripke.labels.planning import Split, filled_in
from llfsm_verify.language.types import decimal_text
from llfsm_verify.program.outcomes import PREFIX
from llfsm_verify.program.program import Const, Expr, Get, Int, Ite, Local, Op
from llfsm_verify.program.trees import fold, nodes, rebuilt
from llfsm_verify.values import element_names, value_text

MOST_INTERVALS = 4
_SIGNS = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "%", "eq": "==", "ne": "!=", "lt": "<", "le": "<=",
    "gt": ">", "ge": ">=", "and": "&&", "or": "||", "xor": "xor",
}  # fmt: skip


class Words:
    """The labels of one program, each written once."""

    def __init__(self, labels: Labels) -> None:
        self._planner = labels.planner
        self._known: dict[tuple[Split, tuple[int, ...], tuple[int, ...]], str] = {}
        self._variables = {v.name: v for v in labels.original.vars}
        self._choices = {c.name: c for c in labels.original.choices}

    def of(self, read: Read) -> str:
        """The class that was read: ``distance in 100..499``, ``a < b``."""
        key = read.split, read.valuation, read.member
        if key not in self._known:
            intervals = self._intervals(read) if len(read.split.choices) == 1 else None
            self._known[key] = intervals or " && ".join(dict.fromkeys(self._holding(read))) or self._any(read.split)
        return self._known[key]

    def _any(self, split: Split) -> str:
        return f"any {', '.join(dict.fromkeys(c.source for c in split.choices))}"

    def _intervals(self, read: Read) -> str | None:
        """None: there are too many, or the solver has no answer."""
        split = read.split
        (choice,) = split.choices
        try:
            label = self._planner.class_of(split, read.valuation, read.member).label
            intervals = self._planner.group(split).intervals(label, MOST_INTERVALS)
        except GaveUp:
            return None
        if intervals is None:
            return None
        if intervals == [(choice.type.low, choice.type.high)]:
            return self._any(split)
        ends = [[value_text(choice.type, choice.labels, x) for x in pair] for pair in intervals]
        parts = [a if a == b else f"{a}..{b}" for a, b in ends]
        sign = "==" if len(parts) == 1 and ".." not in parts[0] else "in"
        return f"{choice.source} {sign} {' or '.join(parts)}"

    def _holding(self, read: Read) -> Iterator[str]:
        """What the members of a class have in common: the values of its terms."""
        split = read.split
        given = {PREFIX + c.name: x for c, x in zip(split.choices, read.member, strict=True)}
        keys = dict(zip(split.keys, read.valuation, strict=True))
        for term in split.asked:
            value = evaluate(rebuilt(term, lambda e: filled_in(e, keys)), {}, given)
            text, digits = self._text(term)
            if not (isinstance(term.type, Int) and term.type.boolean):
                yield f"{text} == {decimal_text(value, digits)}"
            else:
                yield text if value else f"!({text})"

    def _text(self, root: Expr) -> tuple[str, int]:
        """An expression as users write it, and the digits of what it is in steps."""
        decimal = any(isinstance(e.type, Int) and e.type.digits for e in nodes(root))

        def visit(node: Expr, args: list[_Text]) -> _Text:
            match node:
                case Const(value, _):
                    return _Text(str(value), None, value)
                case Local(name, _):
                    return _Text(self._choices[name.removeprefix(PREFIX)].source, _digits(node))
                case Get(name, index, _):
                    names = element_names(self._variables[name])
                    return _Text(names[index.value if isinstance(index, Const) else 0], _digits(node))
                case Ite():
                    (then, otherwise), digits = _aligned(args[1:])
                    return _Text(f"({args[0].text} ? {then} : {otherwise})", digits)
                case Op(op, inner, kind):
                    power = args[1].power if decimal and op in ("mul", "div") else None
                    if power is not None and op == "mul" and args[0].digits is not None:
                        return replace(args[0], digits=args[0].digits + power)
                    if power is not None and op == "div" and args[0].digits == power:
                        return _Text(f"trunc({args[0].text})", 0)
                    # An argument that is an operation itself is put into parentheses, unless it looks like a call.
                    grouped = [
                        replace(a, text=f"({a.text})") if isinstance(e, Op) and e.op in _SIGNS and " " in a.text else a
                        for a, e in zip(args, inner, strict=True)
                    ]
                    if op in ("mul", "div"):
                        left, right = (a.digits or 0 for a in args)
                        text = f" {_SIGNS[op]} ".join(a.text for a in grouped)
                        return _Text(text, left + right if op == "mul" else left - right)
                    parts, digits = _aligned(grouped if op in _SIGNS or op in ("not", "neg") else args)
                    digits = 0 if isinstance(kind, Int) and kind.boolean else digits
                    if op in _SIGNS:
                        return _Text(f" {_SIGNS[op]} ".join(parts), digits)
                    if op in ("not", "neg"):
                        return _Text(f"{'!' if op == 'not' else '-'}{parts[0]}", digits)
                    return _Text(parts[0] if op == "wrap" else f"{op}({', '.join(parts)})", digits)
            raise AssertionError(node)

        found = fold(root, visit)
        return found.text, found.digits or 0


@dataclass(frozen=True, slots=True)
class _Text:
    """A number as users write it, which the program has as steps of ``10 ** -digits``. A constant, which has a `value`,
    takes the digits of what is beside it (None)."""

    text: str
    digits: int | None
    value: int = 0

    @property
    def power(self) -> int | None:
        """That of ten which a constant is."""
        power = len(self.text) - 1
        return power if self.digits is None and self.value == 10**power else None


def _aligned(args: Sequence[_Text]) -> tuple[list[str], int]:
    """Texts of numbers that are added or compared as steps, so that the numbers can be, and the digits of these."""
    digits = min((a.digits for a in args if a.digits is not None), default=0)
    texts = []
    for a in args:
        times = 10 ** ((a.digits or 0) - digits) if a.digits is not None else 1
        texts.append(
            decimal_text(a.value, digits) if a.digits is None else a.text if times == 1 else f"{a.text} * {times}"
        )
    return texts, digits


def _digits(node: Get | Local) -> int:
    return node.type.digits if isinstance(node.type, Int) else 0
