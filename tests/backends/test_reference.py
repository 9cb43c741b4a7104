"""The oracle itself, against the words of the contract and against plain enumeration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from itertools import product

import pytest
from hypothesis import HealthCheck, given, settings

from llfsm_verify.backends.native.context import heaviest, most_samples, statements
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.program.program import (
    BOOL,
    Block,
    Choice,
    Emit,
    Get,
    If,
    Int,
    Local,
    Op,
    Process,
    Program,
    Sample,
    Set,
    Slot,
    Stmt,
    Switch,
    Var,
)
from llfsm_verify.testing.programs import programs
from tests.backends.tiny import constant, tiny, variable
from tests.quick import examples


def one_step(program: Program) -> Outcome:
    layout = Layout.of(program)
    first = layout.first()
    return Interpreter(program).step(layout.decode(first), layout.decode_outputs(first), 0, lambda c: c.type.low)


def value_in(chosen: Mapping[str, int], choice: Choice) -> int:
    return chosen[choice.name]


def mark(letter: int) -> Block:
    """Appends a digit to `order`, so that the order of blocks can be read off it."""
    kind = Int(0, 10**8)
    tenfold = Op("mul", (Get("order", None, kind), constant(10)), Int(0, 10**9))
    return (Set("order", None, Op("min", (constant(10**8), Op("add", (tenfold, constant(letter)), kind)), kind)),)


def test_the_blocks_of_a_ringlet_run_in_the_order_of_the_contract() -> None:
    select = (*mark(1), Set("state", None, constant(1)))  # the prologue may choose the block
    slot = Slot(0, 0, "state", select, (mark(9), mark(2)), mark(3), mark(5))
    process = Process("main", (0,), "turn", None, mark(4))
    program = tiny((), [variable("order", Int(0, 10**8))], slots=(slot,), processes=(process,), letter=mark(6))
    wider = tuple(Var("state", Int(0, 1), 0, v.origin) if v.name == "state" else v for v in program.vars)
    program = tiny((), wider[3:], slots=(slot,), processes=(process,), letter=mark(6), vars=wider)
    assert one_step(program).values["order"] == 123456


@pytest.mark.parametrize(("observe", "expected"), [("ringlet", [1, 1, 1, 1]), ("cycle", [1, 2, 1, 2])])
def test_outputs_are_reset_before_each_observed_step(observe: str, expected: list[int]) -> None:
    kind = Int(0, 9)
    count = variable("count", kind)
    count = Var("count", kind, 0, count.origin, output=True)
    more = Op("min", (constant(9), Op("add", (Get("count", None, kind), constant(1)), Int(1, 10))), kind)
    first = Op("eq", (Get("turn", None, BOOL), constant(0)), BOOL)
    tick = If(
        first, (Set("turn", None, constant(1)),), (Set("turn", None, constant(0)), Set("cycle", None, constant(1)))
    )
    slots = (Slot(0, 0, "state", (), ((Set("count", None, more),),), (), ()),) * 2
    process = Process("main", (0, 1), "turn", None, (tick,))
    program = tiny((), [count], slots=slots, processes=(process,), observe=observe)
    wider = tuple(Var("turn", BOOL, 0, v.origin) if v.name == "turn" else v for v in program.vars)
    program = tiny((), slots=slots, processes=(process,), observe=observe, vars=wider)
    layout, interpreter = Layout.of(program), Interpreter(program)
    record = layout.first()
    values, outputs, seen = layout.decode(record), layout.decode_outputs(record), []
    for _ in expected:
        outcome = interpreter.step(values, outputs, 0, lambda c: c.type.low)
        values, outputs = outcome.values, outcome.outputs
        seen.append(outputs["count"])
    assert seen == expected


def test_successors_turn_the_choice_read_last_first_and_read_only_what_the_path_reads() -> None:
    a, b = Local("a", BOOL), Local("b", Int(-1, 0))
    body = (Sample(a, "a"), If(a, (Sample(b, "b"),)))
    program = tiny(body, (), [Choice("b", Int(-1, 0), "input", "b"), Choice("a", BOOL, "input", "a")])
    layout = Layout.of(program)
    first = layout.first()
    steps = Interpreter(program).successors(layout.decode(first), layout.decode_outputs(first))
    assert [o.samples for _, o in steps] == [(("a", 0),), (("a", 1), ("b", -1)), (("a", 1), ("b", 0))]


@pytest.mark.slow
@settings(
    max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much]
)
@given(programs())
def test_successors_are_the_steps_with_every_value_of_every_choice(program: Program) -> None:
    ranges = [range(c.type.low, c.type.high + 1) for c in program.choices]
    names = [c.name for c in program.choices]
    layout, interpreter = Layout.of(program), Interpreter(program)
    values, outputs = layout.decode(layout.first()), layout.decode_outputs(layout.first())
    found = [(process, repr(outcome)) for process, outcome in interpreter.successors(values, outputs)]
    every = set()
    processes: Sequence[int | None] = interpreter.enabled(values) or (None,)
    for process in processes:
        for valuation in product(*ranges):
            chosen = dict(zip(names, valuation, strict=True))
            outcome = interpreter.step(values, outputs, process, partial(value_in, chosen))
            every.add((process, repr(outcome)))
    assert len(found) == len(set(found))
    assert set(found) == every


def paths(block: Block) -> list[int]:
    """The number of `Sample`s on each path, by recursion."""
    totals = [0]
    for s in block:
        inner: list[Block] = []
        if isinstance(s, If):
            inner = [s.then, s.otherwise]
        elif isinstance(s, Switch):
            inner = [*(b for _, b in s.cases), s.default]
        more = [n for b in inner for n in paths(b)] if inner else [int(isinstance(s, Sample))]
        totals = sorted({t + m for t in totals for m in more})
    return totals


@pytest.mark.slow
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(programs())
def test_the_heaviest_path_is_the_largest_of_all_paths(program: Program) -> None:
    for slot in program.slots:
        for block in (slot.prologue, *slot.blocks, slot.epilogue):
            assert heaviest(block, lambda s: int(isinstance(s, Sample))) == max(paths(block))
    assert most_samples(program) <= len(program.choices)


def test_statements_come_in_the_order_of_the_text() -> None:
    def told(number: int) -> Stmt:
        return Emit("entry", number, ())

    truth = constant(1)
    block: Block = (
        told(0),
        If(truth, (told(1), If(truth, (told(2),))), (told(3),)),
        Switch(truth, ((0, (told(4),)), (1, ())), (told(5),)),
        told(6),
    )
    assert [s.machine for s in statements(block) if isinstance(s, Emit)] == list(range(7))
    assert heaviest(block, lambda s: 1) == 8
