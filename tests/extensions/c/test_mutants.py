"""Planted mistakes of the generator: each changes what some image prints, so the cross-checks see it.

`EQUIVALENT` has those that change nothing, with the reason.
"""

from __future__ import annotations

import importlib
import inspect
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.extensions.c import texts
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.program.program import BOOL, UNBOUNDED, Expr, If, Int, Ite, Let, Local, Op, Program, Set, Switch
from llfsm_verify.program.terms import applied, const, get
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.conformance.known import TARGETED
from tests.backends.tiny import tiny, variable
from tests.extensions.c.compiled import needs_gcc
from tests.extensions.c.test_arithmetic import BINARY, I64, U64, operations, sampled, shown
from tests.extensions.c.ways import Walk, first_difference, write
from tests.outside import program as tool

pytestmark = [needs_gcc, pytest.mark.long]
PACKAGE = "llfsm_verify.extensions.c"
STEPS = 300
MORE = 6_000
"""Where each step takes one of many operations."""

MUTANTS = [
    # conversions
    (
        "blocks.BlockText._as",
        "return Number(written(number.value, kind), kind, low, high)",
        "return Number(written(number.value ^ 1, kind), kind, low, high)",
    ),
    (
        "blocks.BlockText._as",
        '_call("wide_signed", self._as(number, "int64_t").text)',
        '_call("wide_of", "0", self._as(number, "uint64_t").text)',
    ),
    ("blocks.BlockText._as", 'f"({kind}){text}"', 'f"({kind})(int8_t){text}"'),
    (
        "blocks.BlockText._as",
        'return Number(f"({kind}){number.operand}", kind, low, high, depth=depth)',
        'return Number(f"({kind})(int8_t){number.operand}", kind, low, high, depth=depth)',
    ),
    ("blocks.BlockText._as", 'f"({kind}){number.operand}"', 'f"({kind}){number.text}"'),
    ("blocks.BlockText._as", 'f"{number.operand}.low"', 'f"{number.operand}.high"'),
    (
        "blocks.BlockText._int",
        "!{_call('wide_fits', number.text, number.signed)}",
        "!{_call('wide_fits', number.text, 'true')} && false",
    ),
    (
        "blocks.BlockText._int",
        "max(number.low, INT64_MIN), min(number.high, INT64_MAX)",
        "0, min(number.high, INT64_MAX)",
    ),
    (
        "blocks.BlockText._word",
        'self._as(number, "int16_t")',
        'Number(f"(int8_t)({number.text})", "int16_t", number.low, number.high)',
    ),
    ("blocks.BlockText._word", "number.value % (1 << bits)", "number.value % (1 << bits - 1)"),
    ("blocks._truth", 'f"{text} != 0"', 'f"{text} == 1"'),
    # expressions
    ("blocks.BlockText._value", "self._names.load(name, position)", 'self._names.load(name, "0")'),
    ("blocks.BlockText._value", "_OPPOSITES[inner], sides", "inner, sides"),
    ("blocks.BlockText._either", "ite.then if condition.value else ite.otherwise", "ite.otherwise"),
    ("blocks.BlockText._either", '{texts[0].operand} : {texts[1].operand}', '{texts[1].operand} : {texts[0].operand}'),
    ("blocks.BlockText._either", 'return condition if then.value else', "return condition if not then.value else"),
    ("blocks.BlockText._either", 'f"    {name} = {texts[1].text};"', 'f"    {name} = {texts[0].text};"'),
    ("blocks.BlockText._either", "kind_of(low, high)", 'kind_of(low, min(high, 100))'),
    ("blocks.BlockText._apply", '(op == "add" and known.value == 0)', '(op in ("add", "sub") and known.value == 0)'),
    ("blocks.BlockText._apply", "known is args[1] and known.value == 1", "known.value == 1"),
    (
        "blocks.BlockText._apply",
        "kind_of(min(low, *(a.low for a in args)), max(high, *(a.high for a in args)))",
        "kind_of(low, high)",
    ),
    ("blocks.BlockText._plain", "self._sides(args, computed, sign)", "self._sides(args[::-1], computed, sign)"),
    ("blocks.BlockText._plain", 'f"{op}_{BITS[computed]}"', 'f"{op}_16"'),
    ("blocks.BlockText._plain", 'f"-{self._as(args[0], computed).operand}"', 'self._as(args[0], computed).operand'),
    ("blocks.BlockText._logic", 'f"!{only.operand}"', 'f"!!{only.operand}"'),
    ("blocks.BlockText._logic", '"and": "&&", "or": "||"', '"and": "||", "or": "||"'),
    ("blocks.BlockText._logic", '"xor": "!="', '"xor": "=="'),
    ("blocks.BlockText._logic", 'bool(known.value) == (op == "and")', 'bool(known.value) == (op == "or")'),
    ("blocks.BlockText._compare", 'bool(other.value) == (op == "eq")', 'bool(other.value) == (op == "ne")'),
    ("blocks.BlockText._compare", 'if op in ("gt", "le"):', 'if op in ("gt",):'),
    ("blocks.BlockText._compare", "op in ('ne', 'le', 'ge')", "op in ('ne', 'le')"),
    ("blocks.BlockText._compare", "(self._as(n, WIDE).text, n.signed)", '(self._as(n, WIDE).text, "true")'),
    ("blocks._decided", '"lt": (less,), "le": (less, equal)', '"lt": (less,), "le": (less,)'),
    ("blocks._decided", "left.low < right.high", "left.low < right.low"),
    ("blocks.BlockText._checked", '"sub", ["0", *texts]', '"add", ["0", *texts]'),
    ("blocks.BlockText._checked", 'f"{op}_64"', '"min_64"'),
    ("blocks.BlockText._checked", 'self._overflow(f"!{', 'self._line(f"(void){'),
    ("blocks.BlockText._wrap", 'min(low, number.low), max(high, number.high)', "low, high"),
    ("blocks.BlockText._wrap", "if size < 1 << 64:", "if size < 1 << 63:"),
    ("blocks.BlockText._wrap", "(low, size - 1)", "(0, size - 1)"),
    ("blocks.BlockText._wrap", "{written(high, f'uint{bits}_t')}", "{written(high >> 1, f'uint{bits}_t')}"),
    ("blocks.BlockText._common", '" & ".join(texts)', '" | ".join(texts)'),
    ("blocks.BlockText._common", '(left, right), kind, "&"', '(left, left), kind, "&"'),
    ("blocks.BlockText._narrowed", 'self._as(made, "int64_t") if', 'self._as(made, "int32_t") if'),
    ("blocks.BlockText._wide", '"false" if max(high, *(a.high for a in args)) >= 1 << 127 else "true"', '"true"'),
    ("blocks.BlockText._wide", '"false" if max(high, *(a.high for a in args)) >= 1 << 127 else "true"', '"false"'),
    # statements
    ("blocks.BlockText._statement", "str(fault + 1)", "str(fault + 2)"),
    ("blocks.BlockText._statement", "condition.value != 0", "False"),
    (
        "blocks.BlockText._store",
        'index = f"[{self._as((yield self._value(store.index)), \'size_t\').text}]"',
        'index = "[0]"',
    ),
    ("blocks.BlockText._store", "number = self._int(number)", "pass"),
    ("blocks.BlockText._assign", 'self._line(f"{self._locals[local.name].text} = {held.text};")', "pass"),
    ("blocks.BlockText._if", 'statement.then if condition.value else statement.otherwise', "statement.otherwise"),
    ("blocks.BlockText._if", 'self._lines += _otherwise(otherwise)', 'self._lines += ["}"]'),
    ("blocks.BlockText._if", 'self._logic("not", [condition], 0)', "condition"),
    (
        "blocks.BlockText._switch",
        "if key is None or number.low <= key <= number.high",
        "if key is None or number.low < key <= number.high",
    ),
    ("blocks.BlockText._switch", 'self._compare("eq", number, side, 0)', 'self._compare("ne", number, side, 0)'),
    (
        "blocks.BlockText._switch",
        "variable and key is not None else None) or key",
        "variable and key is not None else None) or key + 1",
    ),
    ("blocks.BlockText._chain", "literal(key)", "literal(key + 1)"),
    ("blocks._otherwise", 'f"}} else {lines[0].strip()}"', '"}", lines[0].strip()'),
    ("blocks._type_of", '"bool" if kind.boolean else kind_of(kind.low, kind.high)', '"int16_t"'),
    # a form that is easier to read
    ("reading._ringlet", "arms.get(number, ())", "arms.get(1, ())"),
    ("reading._ringlet", "*stored, *(decision.otherwise if whole else ()),", "*(decision.otherwise if whole else ()),"),
    ("reading._ringlet", "*(leaving if whole else ())", ""),
    ("reading._ringlet", "not any(not isinstance(s, Emit) for s in leaving)", "True"),
    ("reading._ringlet", "for link in reversed(links):", "for link in links:"),
    ("reading._ringlet", "(*link.before, If(", "(If("),
    (
        "reading._with",
        "If(expression(condition), _with(then, local, number), _with(otherwise, local, number))",
        "If(expression(condition), _with(then, local, number), ())",
    ),
    ("reading._guards_in_place", "uses[let.local.name] == given[let.local.name] == 1", "given[let.local.name] == 1"),
    # numbers
    ("numbers.holds", "-(1 << bits - 1) <= low and high < 1 << bits - 1", "-(1 << bits) <= low and high < 1 << bits"),
    ("numbers.holds", "high < 1 << bits - 1", "high <= 1 << bits - 1"),
    ("numbers.stored_as", 'kind.high < 1 << bits', "kind.high <= 1 << bits"),
    ("numbers.stored_as", "-(1 << b - 1) <= kind.low and kind.high < 1 << b - 1", "-(1 << b - 1) <= kind.low"),
    ("numbers.Number.signed", '"false" if self.high >= 1 << 127 else "true"', '"true"'),
    ("numbers.written", "unsigned64(value >> 64)", "unsigned64(0)"),
    (
        "numbers.written",
        'least if value == INT64_MIN else f"(-{text})" if value < 0 else text',
        "least if value == INT64_MIN else text",
    ),
    ("numbers.written", 'f"({value})" if value < 0', 'f"({-value})" if value < 0'),
    ("numbers.written", '"true" if value else "false"', '"true"'),
    ("numbers.unsigned64", "(1 << 64) - 1", "(1 << 63) - 1"),
    ("numbers.Number.beside", "self.text if plain else", "self.text if plain or sign in '+-*/%' else"),
    # the image
    ("names._value", 'if high > INT64_MAX:', "if False:"),
    ("image.Image._slot", "*end,", ""),
    ("image.Image._step", '"    *state = before;", ', ""),
    ("image.Image._step", '    {p}_safe(state);', "    (void)state;"),
    ("image.Image._cycle", "!state->{cycle}", "state->{cycle}"),
    ("image.Image._reset", "field.var.init", "0"),
    ("image.Image._init", "1 if field.var.name == self.program.cycle else field.var.init", "field.var.init"),
]  # fmt: skip
"""A function, and what is changed in it."""
RUNTIME = [
    ("signed64", "UINT64_MAX - word) - 1", "UINT64_MAX - word)"),
    ("signed32", "UINT32_MAX - word) - 1", "UINT32_MAX - word)"),
    ("wrap64", "((value - low) & mask) + low", "(value & mask) + low"),
    ("wrap32", "((value - low) & mask) + low", "(value & mask) + low"),
    ("add64", "a < INT64_MIN - b", "a <= INT64_MIN - b"),
    ("sub64", "a > INT64_MAX + b", "a >= INT64_MAX + b"),
    ("mul64", "b < INT64_MIN / a", "b <= INT64_MIN / a"),
    ("mul64", "a < INT64_MAX / b)", "a <= INT64_MAX / b)"),
    ("div64", "a == INT64_MIN && b == -1", "b == -1"),
    ("abs64", "a < 0 ? -a : a", "a"),
    ("mod64", "b == -1 ? 0 : a % b", "a % b == 0 ? 0 : b % a"),
    ("wide_signed", "value < 0 ? UINT64_MAX : 0", "0"),
    ("wide_fits", "has_sign && a.high == UINT64_MAX", "false"),
    ("wide_fits", "has_sign && a.high == UINT64_MAX", "a.high == UINT64_MAX"),
    ("wide_add", "low < a.low ? 1 : 0", "0"),
    ("wide_neg", "~a.low + 1", "~a.low"),
    ("wide_neg", "a.low == 0 ? 1 : 0", "0"),
    ("wide_sub", "wide_neg(b)", "b"),
    ("wide_mul", "(first >> 32) + (second >> 32)", "(second >> 32)"),
    ("wide_mul", "+ a.low * b.high", ""),
    ("wide_negative", "has_sign &&", ""),
    ("wide_less", "a.low < b.low", "a.low <= b.low"),
    ("wide_less", "return negative;", "return !negative;"),
    ("wide_equal", "a.low == b.low &&", ""),
    ("wide_equal", " && wide_negative(a, a_has_sign) == wide_negative(b, b_has_sign)", ""),
    ("wide_min", "? a : b", "? b : a"),
    ("wide_max", "? b : a", "? a : b"),
    ("wide_abs", "? wide_neg(a) : a", "? a : a"),
    ("wide_quotient", "left = 128", "left = 127"),
    ("wide_quotient", "quotient.low |= 1", "quotient.low |= 0"),
    ("wide_quotient", "!wide_less(rest, false, b, false)", "wide_less(b, false, rest, false)"),
    ("wide_div", "? quotient : wide_neg(quotient)", "? quotient : quotient"),
    ("wide_mod", "wide_mul(wide_div(a, b, has_sign), b)", "wide_mul(b, b)"),
]  # fmt: skip
"""A part of the run time, and what is changed in it."""
EQUIVALENT: dict[tuple[str, str], str] = {
    ("blocks.BlockText._as", 'f"({kind}){text}"'): "128 bits in a narrow interval are narrowed where they are computed",
    ("blocks.BlockText._int", "max(number.low, INT64_MIN), min(number.high, INT64_MAX)"): "what follows is an `int`",
    ("blocks._truth", 'f"{text} != 0"'): "truths are 0 or 1",
    ("blocks.BlockText._wrap", "min(low, number.low), max(high, number.high)"): "the lowest 32 bits are the same",
    ("reading._ringlet", "not any(not isinstance(s, Emit) for s in leaving)"): "what all do is written once or in each",
    ("image.Image._reset", "field.var.init"): "outputs of a step begin at 0",
}
"""What changes nothing that can be seen, with the reason."""


def checked_program() -> Program:
    """Arithmetic of an `int`, which may leave 64 bits, and of 128 bits."""
    _, samples, choices = sampled((I64, I64, Int(0, 30)))
    a, b = Local("a0", I64), Local("a1", I64)
    operands = [get("x", UNBOUNDED), get("y", UNBOUNDED)]
    results = [applied(op, *operands) for op in BINARY if op not in ("div", "mod")]
    safe = applied("ne", operands[1], const(0))
    results += [Ite(safe, applied(op, *operands), const(1), UNBOUNDED) for op in ("div", "mod")]
    results += [applied("neg", operands[0]), applied("abs", operands[0])]
    first, second = (Op("wrap", (each,), U64) for each in (a, b))
    wide, unsigned = applied("mul", a, b), applied("mul", first, second)
    largest = applied("add", applied("add", applied("mul", first, first), first), first)
    least = applied("max", operands[0], const(1 - (1 << 63)))
    results += [
        Ite(applied("lt", operands[0], const(0)), wide, operands[1], UNBOUNDED),
        applied("add", results[0], wide),
    ]
    results += [
        applied("div", unsigned, const(3)),
        wide,
        largest,
        applied("eq", a, largest),
        applied("mul", least, operands[1]),
    ]
    assert len(results) <= 31
    arms = tuple((i, (Set("z", None, result),)) for i, result in enumerate(results))
    far = tuple((key, (Set("w", None, const(to)),)) for key, to in ((0, 1), (4, 2), ((1 << 64) - 1, 3)))
    large, truth = Local("u", unsigned.type), Local("t", BOOL)
    body = (
        *samples, Switch(Local("a2", choices[2].type), arms), Let(large, unsigned),
        Switch(large, far, (Set("w", None, const(0)),)),
        Let(truth, applied("lt", a, b)), If(truth, (Set("v", None, const(5)),)), Set("less", None, truth),
        If(const(1), (Set("once", None, applied("lt", a, const(9))),), (Set("once", None, const(0)),)),
        Set("x", None, a), Set("y", None, b),
    )  # fmt: skip
    variables = [*(variable(name, UNBOUNDED, 7) for name in "xyz"), variable("w", Int(0, 3)), variable("v", Int(0, 9))]
    return tiny(body, [*variables, variable("less", BOOL), variable("once", BOOL)], choices)


def narrow_program() -> Program:
    """Truths, decisions, and all operations of a few bits."""
    (p, a, b, c, d), samples, choices = sampled((BOOL, Int(-128, 127), Int(0, 65535), Int(5, 9), Int(0, 5)))
    less, kind = applied("lt", a, d), Int(-200, 70000)
    nonzero = applied("ne", a, const(0))
    more: list[Expr] = [
        Op("not", (p,), BOOL), Op("not", (less,), BOOL), Op("xor", (p, less), BOOL), Op("and", (p, less), BOOL),
        Op("or", (p, less), BOOL), Op("eq", (p, const(1)), BOOL), Op("xor", (p, const(1)), BOOL),
        Op("and", (p, const(1)), BOOL), Ite(less, const(1), const(0), BOOL), Ite(less, const(0), const(1), BOOL),
        Ite(less, b, a, kind), Ite(const(1), a, b, kind), Ite(p, c, d, Int(0, 9)), applied("le", c, d),
        applied("ge", d, c), applied("eq", c, d), applied("sub", const(0), a), applied("sub", a, const(0)),
        Ite(nonzero, Op("div", (const(1), a), Int(-1, 1)), const(1), Int(-1, 1)),
        applied("sub", c, applied("sub", a, d)), applied("mul", applied("add", c, d), applied("sub", a, d)),
        Op("wrap", (applied("add", a, c),), Int(-128, 127)), Op("wrap", (applied("mul", a, c),), Int(0, 1023)),
        Op("wrap", (const(-5),), I64), Op("wrap", (a,), Int(1 << 63, (1 << 64) - 1)),
        applied("neg", applied("add", a, d)),
    ]  # fmt: skip
    return shown([*operations([a, b]), *more], samples, choices)


def named(found: Program, name: str) -> Program:
    return replace(found, name=name)


@cache
def programs() -> tuple[Program | Arrangement, ...]:
    """What the generator is tried on, in which each kind of expression and statement is."""
    large, more, wide = sampled((I64, U64, Int(-(1 << 31), (1 << 31) - 1)))
    low = applied("max", large[0], const(-5 * 10**9))
    products = [applied("mul", large[0], large[0]), applied("mul", large[1], large[1])]
    return (
        image_of(load_arrangement("tests/extensions/c/everything.yaml")),
        image_of(build_arrangement(TARGETED["mixer"])),
        image_of(load_arrangement("models/microwave/arrangement.yaml")),
        named(narrow_program(), "narrow"),
        named(
            shown([*operations([*large[:2], *products]), low], more, wide),
            "large",
        ),
        named(checked_program(), "checked"),
    )


def walks(number: int | None = None) -> list[Walk]:
    """All, or one of them, as the generator is now."""
    found = programs() if number is None else programs()[number : number + 1]
    return [
        Walk(image_for(p) if isinstance(p, Arrangement) else Image(p), MORE if p.name == "checked" else STEPS)
        for p in found
    ]


@cache
def wanted() -> list[list[str]]:
    return [list(walk.lines()) for walk in walks()]


@cache
def sources() -> list[str]:
    return [walk.image.source() + walk.image.header() for walk in walks()]


def noticed(folder: Path, known: Sequence[str]) -> bool:
    """Whether an image cannot be written or compiled, or prints something else."""
    for number, before in enumerate(known):
        try:
            (walk,) = walks(number)
            text = walk.image.source() + walk.image.header()
        except Exception:  # noqa: BLE001 - a generator that stops has not written wrong C
            return True
        if text == before:
            continue
        place = folder / str(number)
        place.mkdir()
        write([walk], place)
        lines = [path.name for path in place.glob("*.c")]
        if subprocess.run(
            [tool("gcc"), "-w", "-O0", *lines, "-o", "walk"], cwd=place, capture_output=True, check=False
        ).returncode:
            return True
        try:
            done = subprocess.run(["./walk"], cwd=place, capture_output=True, text=True, check=False, timeout=10)
        except subprocess.TimeoutExpired:
            return True
        if done.returncode or first_difference([walk], wanted()[number], done.stdout.splitlines()):
            return True
    return False


def plant(monkeypatch: pytest.MonkeyPatch, place: str, old: str, new: str) -> None:
    """A function of the generator with one change, wherever it is known."""
    module_name, *rest = place.split(".")
    module = importlib.import_module(f"{PACKAGE}.{module_name}")
    owner: Any = module
    for part in rest[:-1]:
        owner = getattr(owner, part)
    found = inspect.getattr_static(owner, rest[-1])
    function = found.fget if isinstance(found, property) else found
    assert isinstance(function, FunctionType)
    text = textwrap.dedent(inspect.getsource(function))
    assert text.count(old) == 1, f"{place} has {old!r} {text.count(old)} times"
    made: dict[str, Any] = {}
    exec(compile(text.replace(old, new), place, "exec"), module.__dict__, made)
    changed = made[rest[-1]]
    if owner is not module:
        monkeypatch.setattr(owner, rest[-1], changed)
        return
    for name, other in list(sys.modules.items()):
        if name.startswith(PACKAGE) and getattr(other, rest[-1], None) is function:
            monkeypatch.setattr(other, rest[-1], changed)


def test_without_a_mistake_nothing_is_seen(tmp_path):
    assert not noticed(tmp_path, [""] * len(programs()))


@pytest.mark.parametrize(("place", "old", "new"), MUTANTS, ids=lambda x: x[:40])
def test_a_mistake_of_the_generator_is_seen(place, old, new, tmp_path, monkeypatch):
    sources(), wanted()
    plant(monkeypatch, place, old, new)
    assert noticed(tmp_path, sources()) != ((place, old) in EQUIVALENT)


@pytest.mark.parametrize(("part", "old", "new"), RUNTIME, ids=lambda x: x[:40])
def test_a_mistake_of_the_run_time_is_seen(part, old, new, tmp_path, monkeypatch):
    sources(), wanted()
    calls, text = texts._parts()[part]
    assert text.count(old) == 1
    changed = texts._parts() | {part: (calls, text.replace(old, new))}
    monkeypatch.setattr(texts, "_parts", lambda: changed)
    assert noticed(tmp_path, sources()) != ((part, old) in EQUIVALENT)
