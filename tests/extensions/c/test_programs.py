"""Random step programs in C, by the executor and by plain Python: steps from any state, with any inputs."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from random import Random

import pytest
from hypothesis import HealthCheck, settings

from llfsm_verify.backends.native.executor import OVERFLOW, NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.extensions.c.image import STATUSES, Image
from llfsm_verify.program.program import INT64_MAX, INT64_MIN, Int, Op, Program, Type
from llfsm_verify.program.program import Set as Store
from llfsm_verify.program.terms import applied, const, get, is_wide
from llfsm_verify.program.trees import fold, statements
from llfsm_verify.testing.programs import programs
from llfsm_verify.values import Value
from tests.backends.tiny import tiny, variable
from tests.extensions.c.compiled import Built, needs_gcc
from tests.quick import each, many, spread

pytestmark = needs_gcc
STEPS = 40
ENDED = STATUSES["ENDED"][0] - 10


def any_of(random: Random, kind: Type) -> int:
    """A value of a type, often one of its last."""
    low, high = (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)
    near = min(high, max(low, random.randint(-9, 9)))
    return random.choice((low, high, min(high, low + 1), max(low, high - 1), random.randint(low, high), near))


def any_state(random: Random, program: Program) -> dict[str, Value]:
    """Values of all variables."""
    return {
        v.name: any_of(random, v.type) if v.length is None else tuple(any_of(random, v.type) for _ in range(v.length))
        for v in program.vars
    }


def wide_operations(program: Program) -> Counter[str]:
    """How often each operation of 128 bits stands in what a program stores."""
    found = Counter[str]()

    def visit(node: object, _: list[None]) -> None:
        if isinstance(node, Op) and any(is_wide(x.type) for x in (node, *node.args)):
            found[node.op] += 1

    for slot in program.slots:
        for statement in statements((*slot.prologue, *(s for b in slot.blocks for s in b), *slot.epilogue)):
            if isinstance(statement, Store):
                fold(statement.value, visit)
    return found


def compare(program: Program, random: Random, tally: Counter[str], *flags: str) -> None:
    """Steps of a program in three ways."""
    program = replace(program, name="drawn")
    built, native, plain = Built(Image(program), *flags), NativeProgram(program, effort="quick"), Interpreter(program)
    layout = native.layout
    record = layout.first()
    assert built.start() == layout.decode_record(record)
    for number in range(STEPS):
        if number % 3 == 0:
            record = layout.encode_record(any_state(random, program))
        built.put(layout.decode_record(record))
        held = {c.name: any_of(random, c.type) for c in program.choices}
        status = built.step(held)
        if not native.enabled(record):
            tally["ended"] += 1
            assert status == ENDED
            continue
        wanted = native.step(record, 0, held)
        asked = plain.step(
            layout.decode(record),
            layout.decode_outputs(record),
            0,
            lambda c: held[c.name],  # noqa: B023
        )
        other = OVERFLOW if asked.overflow else 0 if asked.fault is None else 1 + asked.fault
        assert status == wanted.status == other
        assert built.state() == layout.decode_record(wanted.record) == {**asked.values, **asked.outputs}
        tally["done" if status == 0 else "fault" if status > 0 else "overflow"] += 1
        record = wanted.record


@pytest.mark.long
def test_random_programs_do_in_c_what_the_executor_and_plain_python_do():
    tally, random = Counter[str](), Random(5)

    def one(program: Program) -> None:
        if len(program.processes) == 1:
            tally.update(wide_operations(program))
            compare(program, random, tally, *random.choice((("-O0",), ("-O2",))))

    amount = settings(max_examples=many(800), deadline=None, database=None, suppress_health_check=list(HealthCheck))
    kinds = ("add", "sub", "mul", "neg", "min", "max", "wrap", "lt", "done", "fault", "overflow", "ended")
    spread(one, amount, programs(size=6), size=10, until=each(tally, kinds))


@pytest.mark.long
def test_deep_expressions_are_taken_apart():
    kind = Int(-(1 << 40), 1 << 40)
    deep = get("x", kind)
    for i in range(3000):
        deep = Op("wrap", (applied("add", deep, const(i % 7 - 3)),), kind) if i % 2 else applied("max", deep, const(-i))
    program = tiny((Store("x", None, Op("wrap", (deep,), Int(-(1 << 39), (1 << 39) - 1))),), [variable("x", kind, 5)])
    source = Image(program).source()
    assert max(line.count("(") for line in source.splitlines()) < 60
    native, built = NativeProgram(program), Built(Image(program))
    built.start()
    assert built.step({}) == 0
    assert built.state() == native.layout.decode_record(native.step(native.layout.first(), 0, {}).record)


def test_each_element_that_a_caller_stored_is_checked():
    bad_input = STATUSES["BAD_INPUT"][0] - 10
    kind = Int(-3, 4)
    program = tiny((), [variable("x", kind, (0, 0, 0), free=True), variable("y", Int(0, 255), (0,), free=True)])
    built = Built(Image(program))
    first = built.start()
    for values, told in (((4, -3, 0), 0), ((5, 0, 0), bad_input), ((0, 0, -4), bad_input), ((0, 7, 0), bad_input)):
        built.put({**first, "x": values})
        assert built.step({}) == told
        assert (built.state()["x"], told == 0 or built.state() == {**first, "x": values}) == (values, True)
