"""Every operation at the borders of ranges, from 1 to 128 bits, in C and by the executor."""

from __future__ import annotations

from collections import Counter
from itertools import product
from random import Random

import pytest

from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    UNBOUNDED,
    Choice,
    Expr,
    Int,
    Ite,
    Let,
    Local,
    Op,
    OpName,
    Program,
    Sample,
    Set,
    Stmt,
    Switch,
    Type,
    Unbounded,
)
from llfsm_verify.program.terms import applied, const, get, is_wide, join, may_overflow
from tests.backends.tiny import tiny, variable
from tests.extensions.c.compiled import Built, needs_gcc

U64, I64 = Int(0, (1 << 64) - 1), Int(INT64_MIN, INT64_MAX)
TYPES = (
    BOOL, Int(-128, 127), Int(0, 65535), Int(-3, 200), Int(-(1 << 31), (1 << 31) - 1), Int(0, (1 << 32) - 1), I64, U64,
)  # fmt: skip
BINARY: tuple[OpName, ...] = (
    "add", "sub", "mul", "div", "mod", "min", "max", "eq", "ne", "lt", "le", "gt", "ge",
)  # fmt: skip
UNARY: tuple[OpName, ...] = ("neg", "abs")
WRAPS = (
    Int(-128, 127),
    Int(0, 255),
    Int(-(1 << 31), (1 << 31) - 1),
    I64,
    U64,
    Int(5, 12),
    Int(-(1 << 62), (1 << 62) - 1),
)
PAIRS = 200


def operations(operands: list[Expr]) -> list[Expr]:
    """All operations on all pairs of operands whose results fit in 128 bits."""
    found: list[Expr] = []
    for a, b in product(operands, repeat=2):
        for op in BINARY:
            made = applied(op, a, b)
            if isinstance(made.type, Unbounded):
                continue
            if op in ("div", "mod"):
                made = Ite(applied("ne", b, const(0)), made, const(1), join(made.type, Int(1, 1)))
            found.append(made)
    for a in operands:
        found += [made for op in UNARY if isinstance((made := applied(op, a)).type, Int)]
        found += [Op("wrap", (a,), into) for into in WRAPS]
    return found


def shown(results: list[Expr], samples: list[Stmt], choices: list[Choice]) -> Program:
    """A program that keeps the lowest 64 bits of each result, and whether it is negative or beyond 64 bits."""
    body, variables = list(samples), []
    for number, result in enumerate(results):
        local = Local(f"r{number}", result.type)
        body.append(Let(local, result))
        variables += [variable(f"low{number}", U64), variable(f"is{number}", BOOL), variable(f"far{number}", BOOL)]
        body += [
            Set(f"low{number}", None, Op("wrap", (local,), U64)),
            Set(f"is{number}", None, applied("lt", local, const(0))),
            Set(f"far{number}", None, applied("gt", local, const((1 << 64) - 1))),
        ]
    return tiny(tuple(body), variables, choices)


def border(random: Random, kind: Type) -> int:
    """A value of a type, most often where something begins or ends."""
    low, high = (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)
    edges = [low, low + 1, high - 1, high, 0, 1, -1, 2, 127, 128, -128, 255, 256, 32767, 32768, -32768, 65536]
    edges += [1 << 31, -(1 << 31), (1 << 32) - 1, 1 << 32, 1 << 63, random.randint(low, high), random.randint(-9, 9)]
    return random.choice([edge for edge in edges if low <= edge <= high])


def compare(program: Program, built: Built, count: int) -> Counter[int]:
    """Steps from the beginning with inputs at their borders; how many there were by status."""
    random, native, found = Random(1), NativeProgram(program, effort="quick"), Counter[int]()
    first = native.layout.first()
    for _ in range(count):
        choices = {c.name: border(random, c.type) for c in program.choices}
        wanted = native.step(first, 0, choices)
        built.start()
        assert built.step(choices) == wanted.status, choices
        mine, theirs = built.state(), native.layout.decode_record(wanted.record)
        differ = {name: (mine[name], theirs[name]) for name in mine if mine[name] != theirs[name]}
        assert not differ, (choices, differ)
        found[wanted.status] += 1
    return found


def sampled(types: tuple[Int, ...]) -> tuple[list[Expr], list[Stmt], list[Choice]]:
    """Locals that are sampled, the statements for that, and their choices."""
    choices = [Choice(f"c{i}", kind, "input", f"c{i}") for i, kind in enumerate(types)]
    found: list[Expr] = [Local(f"a{i}", kind) for i, kind in enumerate(types)]
    samples: list[Stmt] = [Sample(Local(f"a{i}", kind), f"c{i}") for i, kind in enumerate(types)]
    return found, samples, choices


@needs_gcc
@pytest.mark.long
@pytest.mark.parametrize("flags", [("-O0", "-fsanitize=undefined", "-fno-sanitize-recover=all"), ("-O2",)])
def test_operations_up_to_64_bits_equal_the_executor_s(flags):
    operands, samples, choices = sampled(TYPES)
    program = shown(operations(operands), samples, choices)
    compare(program, Built(Image(program), *flags), PAIRS)


@needs_gcc
@pytest.mark.long
@pytest.mark.parametrize("flags", [("-O0", "-fsanitize=undefined", "-fno-sanitize-recover=all"), ("-O2",)])
def test_operations_of_128_bits_equal_the_executor_s(flags):
    a, samples, choices = sampled((I64, I64, U64, U64, Int(-128, 127)))
    products = [applied("mul", a[0], a[1]), applied("mul", a[2], a[3]), applied("mul", a[0], a[2])]
    results = operations([*products, a[0], a[2], a[4]])
    kinds = Counter(e.op for e in results if isinstance(e, Op) and any(is_wide(x.type) for x in e.args))
    assert set(kinds) == {*BINARY, *UNARY, "wrap"} - {"div", "mod"}
    divided = [e.then for e in results if isinstance(e, Ite) and is_wide(e.type)]
    assert {e.op for e in divided if isinstance(e, Op)} == {"div", "mod"}
    assert sum(isinstance(e.type, Int) and e.type.high >= 1 << 127 for e in results) > 5
    program = shown(results, samples, choices)
    compare(program, Built(Image(program), *flags), PAIRS)


@needs_gcc
@pytest.mark.slow
def test_an_int_that_leaves_64_bits_ends_the_step_as_in_the_executor():
    operands: list[Expr] = [get("x", UNBOUNDED), get("y", UNBOUNDED)]
    results = [applied(op, *operands) for op in BINARY if op not in ("div", "mod")]
    safe = applied("ne", operands[1], const(0))
    results += [Ite(safe, applied(op, *operands), const(1), UNBOUNDED) for op in ("div", "mod")]
    results += [applied(op, operands[0]) for op in UNARY]
    wide = applied("mul", *(Local(f"a{i}", I64) for i in range(2)))
    results += [Ite(applied("lt", operands[0], const(0)), wide, operands[1], UNBOUNDED)]
    results += [applied("add", operands[0], wide), applied("add", results[0], results[2])]
    assert sum(map(may_overflow, results)) > 10
    _, samples, choices = sampled((I64, I64, Int(0, len(results) - 1)))
    arms = tuple((i, (Set("z", None, result),)) for i, result in enumerate(results))
    body = (*samples, Switch(Local("a2", choices[2].type), arms), Set("x", None, Local("a0", I64)))
    variables = [variable(name, UNBOUNDED, 7) for name in "xyz"]
    program = tiny((*body, Set("y", None, Local("a1", I64))), variables, choices)
    native, built, random, statuses = NativeProgram(program), Built(Image(program)), Random(2), Counter[int]()
    for _ in range(40 * len(results)):
        values = {**built.start(), **{name: border(random, UNBOUNDED) for name in "xyz"}}
        choices_now = {c.name: border(random, c.type) for c in choices[:2]} | {"c2": random.randrange(len(results))}
        built.put(values)
        wanted = native.step(native.layout.encode_record(values), 0, choices_now)
        assert built.step(choices_now) == wanted.status, (values, choices_now)
        assert built.state() == native.layout.decode_record(wanted.record), (values, choices_now)
        statuses[wanted.status] += 1
    assert min(statuses[0], statuses[-1]) > 40
