"""Actions, lowered: typed statements become statements of a step program."""

from __future__ import annotations

from typing import cast

from llfsm_verify.diagnostics import Span
from llfsm_verify.language import types as lt
from llfsm_verify.language.typed import Assign, Choose, Command, Declare, For, IfElse, Index, Read, ReadLocal, Statement
from llfsm_verify.language.typed import Local as TypedLocal
from llfsm_verify.language.types import digits_of
from llfsm_verify.limits import tick
from llfsm_verify.program.program import Const, Expr, Let, OpName, Set
from llfsm_verify.program.terms import TRUE, TooWideError, const
from llfsm_verify.semantics.commands import command
from llfsm_verify.semantics.expressions import Code, text_of
from llfsm_verify.semantics.numbers import arithmetic, too_wide
from llfsm_verify.semantics.storage import machine_type
from llfsm_verify.semantics.vocabulary import emit


def run(code: Code, statements: tuple[Statement, ...]) -> None:
    """Append the statements' code."""
    tick()
    for statement in statements:
        _statement(code, statement)


def _statement(code: Code, s: Statement) -> None:
    if isinstance(s, Assign):
        _assign(code, s)
    elif isinstance(s, Declare):
        _declare(code, s)
    elif isinstance(s, IfElse):
        condition = code.condition(s.condition)
        then, otherwise = code.inner(), code.inner()
        run(then, s.then)
        run(otherwise, s.otherwise)
        code.branch(condition, tuple(then.out), tuple(otherwise.out))
    elif isinstance(s, For):
        for value in range(s.first, s.last + 1):
            code.locals[s.local.key] = const(value)
            run(code, s.body)
    else:
        _command(code, s)


def _declare(code: Code, s: Declare) -> None:
    value = code.stored(s.local.type, code.expr(s.value), digits_of(s.value.type), s.span, s.local.key)
    _set_local(code, s.local, value)


def _set_local(code: Code, local: TypedLocal, value: Expr) -> None:
    target = code.local(f"v.{local.key}", machine_type(local.type))
    code.out.append(Let(target, value))
    code.locals[local.key] = target


def _assign(code: Code, s: Assign) -> None:
    if isinstance(s.target, ReadLocal):
        value, digits = code.expr(s.value), digits_of(s.value.type)
        if s.op is not None:
            value, digits = _arithmetic(code, s, code.locals[s.target.local.key], value)
        _set_local(code, s.target.local, code.stored(s.target.local.type, value, digits, s.span, text_of(s.target)))
        return
    if isinstance(s.target.type, (lt.ArrayType, lt.RecordType)):
        assert isinstance(s.value, Read)
        values = [code.let(code.load(p)) for p in code.places(s.value)]
        places = code.places(s.target)
        if _is_refused(code, s.target):
            return
        for place, value in zip(places, values, strict=True):
            code.store(place, value, digits_of(place.type), s.span, text_of(s.target))
        return
    value = code.choose(s.value, _written(code, s.target)) if isinstance(s.value, Choose) else code.expr(s.value)
    place, digits = code.place(s.target), digits_of(s.value.type)
    if s.op is not None:
        value, digits = _arithmetic(code, s, code.load(place), value)
    if _is_refused(code, s.target):
        return
    code.store(place, value, digits, s.span, text_of(s.target))


def _is_refused(code: Code, target: Read) -> bool:
    """Whether the machine may not write there; then the refusal is told. Its own variables it may write."""
    access, machine = code.context.arrangement.access, code.control.machine.name
    if access is None or target.variable.scope != "whiteboard" or access.may_write(machine, target.variable.name):
        return False
    _refuse(code, access.write_denial(machine, target.variable.name), target.span)
    return True


def _refuse(code: Code, denial: str, span: Span) -> None:
    number = const(code.context.refusal(denial, span))
    code.out += [emit(code.control, "refused", number), Set(code.control.var("refused"), None, TRUE)]


def _written(code: Code, target: Read) -> str:
    """A target as it is written, with the numbers that indices have in a loop that is unrolled."""
    text, start = target.span.text, target.span.start
    for step in reversed(target.path):
        if isinstance(step, Index) and isinstance(step.value, ReadLocal):
            number = code.locals.get(step.value.local.key)
            if isinstance(number, Const):
                text = f"{text[: step.span.start - start]}[{number.value}]{text[step.span.end - start :]}"
    return " ".join(text.split())


def _arithmetic(code: Code, s: Assign, old: Expr, value: Expr) -> tuple[Expr, int]:
    """What ``target op= value`` stores, and its digits."""
    assert s.op is not None
    if s.op in ("div", "mod"):
        value = code.divisor(value, s.value, s.span)
    if s.op in ("band", "bor", "bxor", "shl", "shr"):
        assert isinstance(s.target.type, lt.FixedType)
        return code.bits(s.op, s.target.type, old, value, s.value, s.span), 0
    try:
        return arithmetic(cast(OpName, s.op), old, digits_of(s.target.type), value, digits_of(s.value.type))
    except TooWideError:
        raise too_wide(s.span) from None


def _command(code: Code, s: Command) -> None:
    access, machine = code.context.arrangement.access, code.control.machine.name
    if access is not None and not access.may_command(machine, s.kind, s.machine):
        _refuse(code, access.command_denial(machine, s.kind, s.machine), s.span)
        return
    code.out += command(code.context, code.control, s.kind, s.machine)
