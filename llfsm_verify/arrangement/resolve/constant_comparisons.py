"""Comparisons that the declared types decide: always true or always false, whatever the variables hold."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from fractions import Fraction

from llfsm_verify.arrangement.model import Machine
from llfsm_verify.diagnostics import Diagnostic
from llfsm_verify.language import typed
from llfsm_verify.language.constants import interval
from llfsm_verify.language.types import decimal_text, digits_of, is_number

_HINT = "check the value and the type of the variable, or leave the comparison out"


def constant_comparisons(machines: Iterable[Machine]) -> Iterator[Diagnostic]:
    """A warning (W002) for each comparison of integers in a guard or action that has one value only.

    Where a parameter's constant takes part nothing is said: the comparison can be right for another instance. Neither
    is it where nothing is read: who writes `1 == 1` means it.
    """
    for machine in machines:
        for state in machine.states:
            for transition in state.transitions:
                yield from _found(transition.guard)
            for block in (state.on_entry, state.on_exit, state.internal, state.on_suspend, state.on_resume):
                for e in _expressions(block):
                    yield from _found(e)


def _found(root: typed.Expression) -> Iterator[Diagnostic]:
    for e in _parts(root):
        value = _decided(e) if isinstance(e, typed.Binary) else None
        if isinstance(e, typed.Binary) and value is not None:
            sides = " and ".join(_side(side) for side in (e.left, e.right))
            message = f"this comparison is always {'true' if value else 'false'}: it compares {sides}"
            yield Diagnostic("W002", message, e.span, hint=_HINT)


def _decided(e: typed.Binary) -> bool | None:
    """The value of a comparison, None when the types do not decide it, or when it compares more than variables."""
    if e.op not in ("eq", "ne", "lt", "le", "gt", "ge") or not (is_number(e.left.type) and is_number(e.right.type)):
        return None
    left, right = interval(e.left), interval(e.right)
    if left is None or right is None:
        return None
    read = False
    for part in _parts(e):
        read = read or isinstance(part, typed.Read | typed.ReadLocal)
        # The place of a constant's literal is where its name is written.
        if isinstance(part, typed.Literal) and not part.span.text.lstrip("-+( ")[:1].isdigit():
            return None
    if not read or e.left.span == e.right.span:  # the same place: an integer guard, read as `!= 0`
        return None
    below, above = left[1] < right[0], left[0] > right[1]
    same = left == right and left[0] == left[1]
    match e.op:
        case "eq" | "ne":
            return (e.op == "eq") == same if same or below or above else None
        case "lt" | "ge":
            return (e.op == "lt") == below if below or left[0] >= right[1] else None
        case _:
            return (e.op == "gt") == above if above or left[1] <= right[0] else None


def _side(e: typed.Expression) -> str:
    bounds = interval(e)
    assert bounds is not None
    text = " ".join(e.span.text.split())[:60]
    digits = digits_of(e.type)
    low, high = (decimal_text(int(b * 10**digits), digits) for b in bounds)
    values = low if low == high else f"{low}..{high}"
    return values if text == values else f"`{text}` ({values})"


def _expressions(statements: Iterable[typed.Statement]) -> Iterator[typed.Expression]:
    """The expressions of an action; blocks nest at most as deep as the parser allows."""
    for statement in statements:
        match statement:
            case typed.Assign():
                yield statement.target
                yield statement.value
            case typed.Declare():
                yield statement.value
            case typed.IfElse():
                yield statement.condition
                yield from _expressions(statement.then)
                yield from _expressions(statement.otherwise)
            case typed.For():
                yield from _expressions(statement.body)


def _parts(root: typed.Expression) -> Iterator[typed.Expression]:
    """`root` and all expressions below it; iterative."""
    stack = [root]
    while stack:
        e = stack.pop()
        yield e
        match e:
            case typed.Read():
                if e.path:
                    stack += [step.value for step in e.path if isinstance(step, typed.Index)]
            case typed.Binary():
                stack += (e.right, e.left)
            case typed.Unary():
                stack.append(e.operand)
            case typed.Conditional():
                stack += (e.otherwise, e.then, e.condition)
            case typed.LetIn():
                stack += (defined for _, defined in e.definitions)
            case typed.Lookup():
                stack.append(e.index)
            case typed.After() if not isinstance(e.bound, Fraction):
                stack.append(e.bound)
