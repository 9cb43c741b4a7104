"""Labels in the words of users: intervals of one input, or what holds of several."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.backends.reference import evaluate
from llfsm_verify.backends.smt.solver import GaveUp
from llfsm_verify.kripke.labels.labels import Labels, Read
from llfsm_verify.kripke.labels.planning import Split, filled_in
from llfsm_verify.kripke.values import element_names, value_text
from llfsm_verify.program.outcomes import PREFIX
from llfsm_verify.program.program import Const, Expr, Get, Int, Ite, Local, Op
from llfsm_verify.program.trees import fold, rebuilt

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
            text = self._text(term)
            if not (isinstance(term.type, Int) and term.type.boolean):
                yield f"{text} == {value}"
            else:
                yield text if value else f"!({text})"

    def _text(self, root: Expr) -> str:
        """An expression as users write it."""

        def visit(node: Expr, args: list[str]) -> str:
            match node:
                case Const(value, _):
                    return str(value)
                case Local(name, _):
                    return self._choices[name.removeprefix(PREFIX)].source
                case Get(name, index, _):
                    names = element_names(self._variables[name])
                    return names[index.value if isinstance(index, Const) else 0]
                case Ite():
                    return f"({args[0]} ? {args[1]} : {args[2]})"
                case Op(op, inner, _):
                    # An argument that is an operation itself is put into parentheses, unless it looks like a call.
                    parts = [
                        f"({a})" if isinstance(e, Op) and e.op in _SIGNS else a
                        for a, e in zip(args, inner, strict=True)
                    ]
                    if op in _SIGNS:
                        return f" {_SIGNS[op]} ".join(parts)
                    if op in ("not", "neg"):
                        return f"{'!' if op == 'not' else '-'}{parts[0]}"
                    return args[0] if op == "wrap" else f"{op}({', '.join(args)})"
            raise AssertionError(node)

        return fold(root, visit)
