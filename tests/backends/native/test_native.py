"""Facts about the native executor that random programs seldom meet."""

from __future__ import annotations

import signal
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from types import FrameType

import pytest

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.native import machine_code
from llfsm_verify.backends.native.executor import ENDED, OVERFLOW, Effort, NativeProgram
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.program.program import (
    BOOL,
    INT64_MAX,
    INT64_MIN,
    UNBOUNDED,
    Choice,
    Const,
    Emit,
    Expr,
    Fault,
    Get,
    If,
    Int,
    Ite,
    Local,
    Op,
    OpName,
    Process,
    Program,
    Sample,
    Set,
    Stmt,
    Type,
    Var,
)
from tests.backends.tiny import constant, tiny, variable

WIDE = Int(INT64_MIN, INT64_MAX)
EFFORTS: tuple[Effort, ...] = ("quick", "full")


def results(expression: Expr, variables: list[Var]) -> tuple[int | str, int | str]:
    """What an expression is natively and by the reference; "overflow" when it leaves 64 bits."""
    start = expression.type.low if isinstance(expression.type, Int) else 0
    program = tiny((Set("result", None, expression),), [*variables, variable("result", expression.type, start)])
    native, interpreter = NativeProgram(program), Interpreter(program)
    first = native.layout.first()
    step = native.step(first, 0, {})
    outcome = interpreter.step(
        native.layout.decode(first), native.layout.decode_outputs(first), 0, lambda c: c.type.low
    )
    found: int | str = "overflow" if step.status == OVERFLOW else native.layout.get(step.record, "result")
    wanted = outcome.values["result"]
    assert isinstance(wanted, int)
    return found, "overflow" if outcome.overflow else wanted


@pytest.mark.parametrize(
    ("op", "args", "expected"),
    [
        ("add", (INT64_MAX, 1), "overflow"),
        ("add", (INT64_MAX, 0), INT64_MAX),
        ("sub", (INT64_MIN, 1), "overflow"),
        ("sub", (-1, INT64_MAX), INT64_MIN),
        ("mul", (1 << 32, 1 << 31), "overflow"),
        ("mul", (1 << 32, -(1 << 31)), INT64_MIN),
        ("neg", (INT64_MIN,), "overflow"),
        ("neg", (INT64_MAX,), -INT64_MAX),
        ("abs", (INT64_MIN,), "overflow"),
        ("abs", (-5,), 5),
        ("div", (INT64_MIN, -1), "overflow"),
        ("div", (-7, 2), -3),
        ("div", (7, -2), -3),
        ("div", (-7, -2), 3),
        ("mod", (INT64_MIN, -1), 0),
        ("mod", (-7, -1), 0),
        ("mod", (-7, 2), -1),
        ("mod", (7, -2), 1),
        ("min", (INT64_MIN, 3), INT64_MIN),
        ("max", (INT64_MIN, 3), 3),
    ],
)
def test_arithmetic_of_unbounded_integers_at_its_ends(op: OpName, args: tuple[int, ...], expected: int | str) -> None:
    names = ["a", "b"][: len(args)]
    variables = [variable(n, UNBOUNDED, x) for n, x in zip(names, args, strict=True)]
    expression = Op(op, tuple(Get(n, None, UNBOUNDED) for n in names), UNBOUNDED)
    assert results(expression, variables) == (expected, expected)


@pytest.mark.parametrize("op", ["mod", "div"])
def test_the_quotient_that_traps_in_hardware(op: OpName) -> None:
    variables = [variable("a", WIDE, INT64_MIN), variable("b", Int(-1, 1), -1)]
    expression = Op(op, (Get("a", None, WIDE), Get("b", None, Int(-1, 1))), UNBOUNDED if op == "div" else Int(0, 0))
    expected = "overflow" if op == "div" else 0
    assert results(expression, variables) == (expected, expected)


def test_a_constant_beyond_64_bits_is_an_overflow_only_where_it_is_evaluated() -> None:
    flag = variable("flag", BOOL)
    huge = Const(1 << 70, UNBOUNDED)
    chosen = Op("min", (huge, constant(3)), UNBOUNDED)
    assert results(chosen, []) == ("overflow", "overflow")
    assert results(Ite(Get("flag", None, BOOL), chosen, constant(5), UNBOUNDED), [flag]) == (5, 5)


@pytest.mark.parametrize("value", [INT64_MIN, -1, 0, 127, 128, 255, 256, INT64_MAX])
@pytest.mark.parametrize("kind", [Int(-128, 127), Int(0, 255), Int(3, 3), Int(3, 6), Int(-5, 2), Int(-2, 1), WIDE])
def test_wrap_brings_every_integer_into_its_type(value: int, kind: Int) -> None:
    found, wanted = results(Op("wrap", (Get("a", None, WIDE),), kind), [variable("a", WIDE, value)])
    assert found == wanted
    assert isinstance(found, int)
    assert kind.low <= found <= kind.high
    assert (found - value) % (kind.high - kind.low + 1) == 0


@pytest.mark.slow
def test_an_expression_500_deep_and_a_block_500_deep() -> None:
    byte = Int(0, 255)
    expression: Expr = Get("x", None, byte)
    for i in range(500):
        more = Op("wrap", (Op("add", (expression, constant(1)), Int(1, 256)),), byte)
        expression = Ite(Op("eq", (more, constant(i)), BOOL), constant(7), more, byte) if i % 50 == 3 else more
    block: tuple[Stmt, ...] = (Set("y", None, expression),)
    for _ in range(500):
        block = (If(Op("lt", (Get("x", None, byte), constant(200)), BOOL), block),)
    program = tiny(block, [variable("x", byte, 10), variable("y", byte)])
    native, interpreter = NativeProgram(program), Interpreter(program)
    first = native.layout.first()
    (_, outcome), *rest = interpreter.successors(native.layout.decode(first), native.layout.decode_outputs(first))
    assert not rest
    assert native.layout.decode(native.step(first, 0, {}).record) == outcome.values
    assert outcome.values["y"] == (10 + 500) % 256


@pytest.mark.slow
@pytest.mark.parametrize("effort", EFFORTS)
def test_packed_arrays_of_every_width(effort: Effort) -> None:
    """An element is written and read through a computed index without touching its neighbours."""
    for kind, length in [(BOOL, 200), (Int(0, 4), 30), (Int(-100, 100), 9), (WIDE, 3), (Int(5, 5), 4), (Int(0, 1), 7)]:
        values = tuple(kind.low + (i * 7) % (kind.high - kind.low + 1) for i in range(length))
        index = Choice("i", Int(0, length - 1), "input", "i")
        fresh = Choice("x", Int(0, 1), "input", "x")
        i, x = Local("i", index.type), Local("x", fresh.type)
        low, high = constant(kind.low), constant(kind.high)
        body: tuple[Stmt, ...] = (
            Sample(i, "i"),
            Sample(x, "x"),
            Set("a", i, Ite(x, high, low, kind)),
            Set("b", None, Get("a", i, kind)),
        )
        program = tiny(body, [variable("b", kind, kind.low), variable("a", kind, values)], [index, fresh])
        native = NativeProgram(program, effort=effort)
        edges = list(native.successors(native.layout.first()))
        assert len(edges) == 2 * length
        for edge in edges:
            at, bit = (value for _, value in edge.samples)
            written = kind.high if bit else kind.low
            decoded = native.layout.decode(edge.record)
            assert decoded["a"] == (*values[:at], written, *values[at + 1 :])
            assert decoded["b"] == written


def test_a_choice_read_twice_is_sampled_once_and_in_order_of_first_reading() -> None:
    kind = Int(0, 3)
    locals_ = [Local(f"l{i}", kind) for i in range(4)]
    body = (
        Sample(locals_[0], "b"),
        Sample(locals_[1], "a"),
        Sample(locals_[2], "b"),
        Fault(2, Op("ne", (locals_[0], locals_[2]), BOOL)),
    )
    choices = [Choice("a", kind, "read", "a"), Choice("b", kind, "read", "b"), Choice("c", kind, "read", "c")]
    native = NativeProgram(tiny(body, (), choices))
    edges = list(native.successors(native.layout.first()))
    assert [e.samples for e in edges] == [((1, b), (0, a)) for b in range(4) for a in range(4)]
    assert all(e.status == 0 for e in edges)


def test_a_failing_step_has_no_successor_and_keeps_what_it_read_and_told() -> None:
    kind = Int(0, 1)
    local = Local("l", kind)
    body = (
        Sample(local, "a"),
        Emit("entry", 0, (constant(4),)),
        Set("x", None, constant(1)),
        Fault(1, Op("eq", (local, constant(1)), BOOL)),
        Emit("exit", 0, ()),
    )
    native = NativeProgram(tiny(body, [variable("x", BOOL)], [Choice("a", kind, "input", "a")]), events=True)
    first = native.layout.first()
    failed = native.step(first, 0, {"a": 1})
    assert failed == (2, first, ((0, 1),), (("entry", 0, (4,)),), 1)
    fine = native.step(first, 0, {"a": 0})
    assert fine.status == 0
    assert fine.events == (("entry", 0, (4,)), ("exit", 0, ()))
    random = native.run(first, 1000, mode="random", seed=1)
    assert random.status == 2
    assert random.steps < 100
    assert native.layout.get(random.record, "x") == (1 if random.steps else 0)


def test_steps_that_may_not_be_taken_are_refused() -> None:
    ended = variable("ended", BOOL)
    process = Process("main", (0,), "turn", "ended", (Set("cycle", None, constant(1)), Set("ended", None, constant(1))))
    choice = Choice("a", Int(0, 3), "input", "a")
    native = NativeProgram(tiny((), [ended], [choice], processes=(process,)))
    first = native.layout.first()
    with pytest.raises(ValueError, match="may not step"):
        native.step(first, None, {})
    with pytest.raises(ValueError, match="outside"):
        native.step(first, 0, {"a": 4})
    with pytest.raises(KeyError):
        native.step(first, 0, {"b": 0})
    with pytest.raises(ValueError, match="bytes"):
        native.step(first + b"\0", 0, {})
    with pytest.raises(ValueError, match="bytes"):
        native.expand(first, 2)
    after = native.step(first, 0, {}).record
    with pytest.raises(ValueError, match="may not step"):
        native.step(after, 0, {})
    stutter = native.step(after, None, {})
    assert native.layout.decode(stutter.record) == native.layout.decode(after)
    assert native.layout.get(stutter.record, "cycle") == 0
    assert native.run(first, 10) == (stutter.record, 2, ENDED, 0, (0,))


def ending(observe: str) -> Program:
    """Ends after one ringlet; the output `count` is incremented by each stutter, and reset before it."""
    kind = Int(0, 9)
    ended, count = variable("ended", BOOL), replace(variable("count", kind), output=True)
    more = Op("min", (constant(9), Op("add", (Get("count", None, kind), constant(1)), Int(1, 10))), kind)
    process = Process("main", (0,), "turn", "ended", (Set("cycle", None, constant(1)), Set("ended", None, constant(1))))
    counted = (Set("count", None, more),)
    return tiny((), [ended, count], processes=(process,), letter_stutter=counted, observe=observe)


@pytest.mark.parametrize("observe", ["ringlet", "cycle"])
def test_every_stutter_begins_with_fresh_outputs(observe: str) -> None:
    native = NativeProgram(ending(observe))
    record = native.step(native.layout.first(), 0, {}).record
    for _ in range(3):
        record = native.step(record, None, {}).record
        assert native.layout.decode_outputs(record) == {"cycle": 0, "count": 1}


def test_live_and_ended_configurations_expand_side_by_side() -> None:
    native = NativeProgram(ending("ringlet"))
    live = native.layout.first()
    ended = native.step(live, 0, {}).record
    assert [(e.source, e.process) for e in native.edges(live + ended + live + ended + ended, 5)] == [
        (0, 0),
        (1, -1),
        (2, 0),
        (3, -1),
        (4, -1),
    ]


@pytest.mark.parametrize(
    "body",
    [
        (Set("x", None, Get("y", None, Int(0, 9))),),
        (Set("x", None, Get("a", Get("y", None, Int(0, 9)), Int(0, 3))),),
        (Set("a", Get("y", None, Int(0, 9)), constant(0)),),
        (Set("x", None, Op("div", (constant(1), Get("x", None, Int(0, 3))), Int(0, 3))),),
    ],
    ids=["store outside the type", "read outside the array", "write outside the array", "division by zero"],
)
def test_a_program_that_breaks_its_contract_is_noticed(body: tuple[Stmt, ...]) -> None:
    program = tiny(body, [variable("x", Int(0, 3)), variable("y", Int(0, 9), 9), variable("a", Int(0, 3), (0, 1, 2))])
    native = NativeProgram(program)
    first = native.layout.first()
    with pytest.raises(BrokenProgramError):
        native.step(first, 0, {})
    with pytest.raises(BrokenProgramError):
        native.run(first, 1)
    with pytest.raises(BrokenProgramError):
        list(native.successors(first))
    with pytest.raises((BrokenProgramError, ZeroDivisionError)):
        Interpreter(program).step(
            native.layout.decode(first), native.layout.decode_outputs(first), 0, lambda c: c.type.low
        )


def many_edges(bits: int) -> Program:
    """2 ** bits successors of one configuration."""
    locals_ = [Local(f"l{i}", BOOL) for i in range(bits)]
    choices = [Choice(f"c{i}", BOOL, "input", f"c{i}") for i in range(bits)]
    body: list[Stmt] = [Sample(x, c.name) for x, c in zip(locals_, choices, strict=True)]
    body += [Set("x", None, Op("xor", (locals_[0], locals_[-1]), BOOL))]
    return tiny(tuple(body), [variable("x", BOOL)], choices)


def test_a_configuration_with_many_successors_streams() -> None:
    native = NativeProgram(many_edges(16))
    sizes = [(count, len(view)) for view, count in native.expand(native.layout.first(), 1)]
    assert sum(count for count, _ in sizes) == 1 << 16
    assert len(sizes) > 10
    assert max(size for _, size in sizes) <= 1 << 19


def test_interleaved_expansions_do_not_disturb_each_other() -> None:
    native = NativeProgram(many_edges(6))
    first = native.layout.first()
    alone = list(native.successors(first))
    both = list(zip(native.successors(first), native.expand(first, 1, chunk_edges=3).edges(), strict=True))
    assert [x for x, _ in both] == [y for _, y in both] == alone


def test_random_choices_and_processes_are_uniform_and_reproducible() -> None:
    kind = Int(-1, 1)
    local = Local("l", kind)
    program = tiny(
        (Sample(local, "a"), Set("x", None, local)), [variable("x", kind)], [Choice("a", kind, "input", "a")]
    )
    native = NativeProgram(program)
    first = native.layout.first()
    seen = Counter(
        native.layout.get(native.run(first, 3, mode="random", seed=seed).record, "x") for seed in range(3000)
    )
    assert set(seen) == {-1, 0, 1}
    assert min(seen.values()) > 850
    two = replace(program, processes=(program.processes[0], replace(program.processes[0], name="other")))
    turns = NativeProgram(two)
    assert len({turns.run(first, 1, mode="random", seed=seed).process for seed in range(20)}) == 2
    assert turns.run(first, 7, mode="random", seed=5) == turns.run(first, 7, mode="random", seed=5)


def test_a_run_is_the_same_in_portions_and_after_recompiling(monkeypatch: pytest.MonkeyPatch) -> None:
    kind: Type = Int(0, 1000)
    x, a = Get("x", None, kind), Local("l", Int(0, 9))
    more = Op("min", (Op("add", (x, a), Int(0, 1009)), constant(1000)), kind)
    again = Ite(Op("eq", (x, constant(1000)), BOOL), constant(0), more, kind)
    program = tiny(
        (Sample(a, "a"), Set("x", None, again)), [variable("x", Int(0, 1000))], [Choice("a", Int(0, 9), "input", "a")]
    )
    whole = NativeProgram(program, effort="full")
    first = whole.layout.first()
    expected = whole.run(first, 10_000, mode="random", seed=3)
    monkeypatch.setattr("llfsm_verify.backends.native.executor.RUN_PORTION", 7)
    monkeypatch.setattr("llfsm_verify.backends.native.executor.PATIENCE", 0.001)
    monkeypatch.setitem(machine_code.SECONDS_A_LINE, "full", 0.0)
    portions = NativeProgram(program)
    portions.compile()
    efforts: list[Effort] = [portions.effort]
    assert portions.run(first, 10_000, mode="random", seed=3) == expected
    efforts.append(portions.effort)
    assert efforts == ["quick", "full"]


class Interrupt(Exception):
    """What the signal handler raises, as Python's own raises KeyboardInterrupt."""


@contextmanager
def interrupt_soon() -> Iterator[None]:
    """After a tenth of a second of processor time; the clock's signal is for the limit of the test."""

    def handler(number: int, frame: FrameType | None) -> None:
        raise Interrupt

    old = signal.signal(signal.SIGVTALRM, handler)
    signal.setitimer(signal.ITIMER_VIRTUAL, 0.1)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, old)


def test_a_signal_interrupts_a_run_that_takes_hours() -> None:
    native = NativeProgram(many_edges(2))
    native.compile()
    with pytest.raises(Interrupt), interrupt_soon():
        native.run(native.layout.first(), 1 << 50)


def test_a_signal_interrupts_an_expansion_that_takes_hours() -> None:
    native = NativeProgram(many_edges(40))
    native.compile()
    with pytest.raises(Interrupt), interrupt_soon():
        for _ in native.expand(native.layout.first(), 1):
            pass
