"""A program with monitors in it runs as it does without them, and ends where a fatal one comes to *violated*."""

from __future__ import annotations

import random
from collections import Counter

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.monitors import decidable
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.kripke.observing import observed_outputs
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.monitoring.lookup import walk_table
from llfsm_verify.monitoring.states import MonitorVerdict
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.transforms.monitors import monitor_name, with_monitors, within_names
from tests.quick import each, many, spread

TALLY: Counter[str] = Counter()


def kept(document, seed):
    arrangement = build_arrangement(document)
    states = [f"{m.name}@{state.name}" for m in arrangement.machines for state in m.states if not m.nested]
    one, other = states[seed % len(states)], states[seed // 7 % len(states)]
    text = f"never: G !({one} && X X {other})\nafter: G({one} -> X X !{other})"
    try:
        problem = bind(arrangement, parse_properties([Source("test", text)]))
        program = problem.program(keep_all_bits=True)
        monitors = list(decidable(problem)[0].values())
    except DiagnosticError:
        return
    tables = [walk_table(monitor) for monitor in monitors]
    fatal = [number for number in range(len(monitors)) if seed >> number & 1]
    plain, watched = NativeProgram(program), NativeProgram(with_monitors(program, monitors, tables, fatal))
    record, beside = plain.layout.first(), watched.layout.first()
    at, draw = [0] * len(monitors), random.Random(seed)
    for _ in range(60):
        process = draw.choice(plain.enabled(record) or [None])
        given = {c.name: draw.randint(c.type.low, c.type.high) for c in program.choices}
        step, other_step = plain.step(record, process, given), watched.step(beside, process, given)
        if step.status:
            assert other_step.status == step.status
            TALLY["faults"] += 1
            return
        outputs = plain.layout.decode_outputs(step.record)
        whole = process is None or outputs[program.cycle]
        if whole or program.observe == "ringlet":
            letter = {name: bool(outputs[output]) for name, output in observed_outputs(program)}
            for number, monitor in enumerate(monitors):
                before, after = at[number], monitor.step(at[number], monitor.letter({n for n in letter if letter[n]}))
                at[number] = after
                if number in fatal and after != before and monitor.verdicts[after] is MonitorVerdict.FALSE:
                    assert other_step.status == 1 + len(program.faults) + number
                    TALLY["violated"] += 1
                    return
        assert other_step.status == 0
        record, beside = step.record, other_step.record
        values = watched.layout.decode_record(beside)
        assert plain.layout.decode_record(record).items() <= values.items()
        assert [tables[k].states[values[monitor_name(k)]] for k in range(len(monitors))] == at
        assert process is None or values[within_names(program)[process]] == (not whole)
    TALLY["went on"] += 1


@pytest.mark.slow
def test_a_program_with_monitors_runs_as_without_them():
    TALLY.clear()
    amount = settings(max_examples=many(150), deadline=None, suppress_health_check=list(HealthCheck))
    until = each(TALLY, ["violated", "went on", "faults"])
    spread(kept, amount, arrangements(), st.integers(1, 1 << 40), until=until)
