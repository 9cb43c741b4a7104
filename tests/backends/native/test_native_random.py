"""The native executor against the reference interpreter on random step programs."""

from __future__ import annotations

import os
from itertools import islice

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from llfsm_verify.backends.native.executor import ENDED, OVERFLOW, Edge, NativeProgram
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.program.program import Program
from llfsm_verify.testing.programs import programs
from tests.quick import examples, many

PROGRAMS = int(os.environ.get("LLFSM_RANDOM_PROGRAMS", "150"))
MANY_PROGRAMS = int(os.environ.get("LLFSM_MANY_RANDOM_PROGRAMS", many(800)))
SUCCESSORS, STEPS = 60, 6

slow_inside = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]


def checked(count: int) -> settings:
    return settings(max_examples=examples(count), deadline=None, suppress_health_check=slow_inside)


def status_of(outcome: Outcome) -> int:
    if outcome.overflow:
        return OVERFLOW
    return 0 if outcome.fault is None else 1 + outcome.fault


def edges_of(interpreter: Interpreter, layout: Layout, record: bytes) -> list[tuple[Edge, Outcome]]:
    """The first successors by the reference, as the native executor should report them."""
    indices = {c.name: i for i, c in enumerate(interpreter.program.choices)}
    edges = []
    steps = interpreter.successors(layout.decode(record), layout.decode_outputs(record))
    for process, outcome in islice(steps, SUCCESSORS):
        after = layout.encode(outcome.values) + layout.encode_outputs(outcome.outputs)
        samples = tuple((indices[name], value) for name, value in outcome.samples)
        edges.append((Edge(0, -1 if process is None else process, status_of(outcome), after, samples), outcome))
    return edges


def compare(program: Program, native: NativeProgram, walk: list[int]) -> None:
    """Every successor of every record along a walk, whose turns `walk` chooses."""
    interpreter, layout = Interpreter(program), native.layout
    names = [c.name for c in program.choices]
    record = layout.first()
    for turn in walk:
        expected = edges_of(interpreter, layout, record)
        found = list(islice(native.successors(record), SUCCESSORS))
        assert [(e.process, e.status, e.samples) for e in found] == [
            (e.process, e.status, e.samples) for e, _ in expected
        ]
        following = []
        for edge, (wanted, outcome) in zip(found, expected, strict=True):
            process = None if edge.process < 0 else edge.process
            step = native.step(record, process, {names[i]: value for i, value in edge.samples})
            assert step.status == edge.status
            assert step.samples == edge.samples
            assert step.record == wanted.record
            assert step.events == (outcome.events if native.events else ())
            if edge.status == 0:
                assert edge.record == wanted.record
                following.append(edge.record)
        assert native.enabled(record) == interpreter.enabled(layout.decode(record))
        check_runs(native, record, expected, turn)
        if not following:
            return
        record = following[turn % len(following)]


def check_runs(native: NativeProgram, record: bytes, expected: list[tuple[Edge, Outcome]], seed: int) -> None:
    """One step of a run is one of the successors; one of kind `first` is the first process with its lowest choices."""
    first = expected[0][0]
    for mode in ("first", "random"):
        ran = native.run(record, 1, mode=mode, seed=seed)
        ended = first.process < 0
        if len(expected) < SUCCESSORS:
            wanted = [first] if mode == "first" else [e for e, _ in expected]
            outcomes = {(e.status or (ENDED if ended else 0), e.record, 0 if e.status else 1) for e in wanted}
            assert (ran.status, ran.record, ran.steps) in outcomes


walks = st.lists(st.integers(0, 1 << 16), min_size=1, max_size=STEPS)


@pytest.mark.long
@checked(PROGRAMS)
@given(programs(), walks)
def test_native_quick_start_equals_reference(program: Program, walk: list[int]) -> None:
    compare(program, NativeProgram(program, events=True, effort="quick"), walk)


@pytest.mark.slow
@checked(max(1, PROGRAMS // 8))
@given(programs(), walks)
def test_native_optimised_equals_reference(program: Program, walk: list[int]) -> None:
    compare(program, NativeProgram(program, events=False, effort="full"), walk)


@pytest.mark.slow
@checked(MANY_PROGRAMS)
@given(programs(size=6), walks, st.integers(0, 5))
def test_native_equals_reference_on_many_programs(program: Program, walk: list[int], kind: int) -> None:
    compare(program, NativeProgram(program, events=True, effort="full" if kind == 5 else "quick"), walk)


@pytest.mark.slow
@checked(40)
@given(programs(), st.integers(1, 4), st.integers(0, 1 << 16))
def test_expand_with_tiny_buffers_resumes_where_it_stopped(program: Program, edges: int, turn: int) -> None:
    native = NativeProgram(program, effort="quick")
    start = native.layout.first()
    after = [e.record for e in islice(native.successors(start), 50) if e.status == 0] or [start]
    records = [start, after[turn % len(after)], after[-1]]
    joined = [
        (i, e.process, e.status, e.record if e.status == 0 else b"", e.samples)
        for i, r in enumerate(records)
        for e in native.successors(r)
    ]
    expansion = native.expand(b"".join(records), len(records), chunk_edges=edges)
    assert all(1 <= n <= edges and len(view) == n * native.edge_size for view, n in expansion)
    resumed = [
        (e.source, e.process, e.status, e.record if e.status == 0 else b"", e.samples) for e in expansion.edges()
    ]
    assert resumed == joined


@pytest.mark.slow
@checked(50)
@given(programs())
def test_layout_round_trips(program: Program) -> None:
    layout = Layout.of(program)
    limit = 1 << 12
    for record in islice(layout.initial_records(), 20):
        assert len(record) == layout.record_bytes
        assert layout.encode(layout.decode(record)) == record[: layout.configuration_bytes]
        assert layout.encode_outputs(layout.decode_outputs(record)) == record[layout.configuration_bytes :]
        for v in program.vars:
            whole = (layout.decode_outputs if v.output else layout.decode)(record)[v.name]
            elements = [layout.get(record, v.name, None if v.length is None else i) for i in range(v.length or 1)]
            assert elements == (list(whole) if isinstance(whole, tuple) else [whole])
    if layout.initial_count() <= limit:
        initial = layout.initial(limit)
        assert len(set(initial)) == len(initial) == layout.initial_count()
        assert layout.first() in initial
