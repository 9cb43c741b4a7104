"""The llfsm and clfsm profiles reproduce what the real clfsm did, event by event."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.backends.native.layout import Layout
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower
from tests.outside import GOLDEN, needs

FILES = sorted(GOLDEN.glob("*.json"))
LATER = {
    "Abandoner": "abandon is not part of the semantics",
}

SILENT = ("accept", "load", "unload")
"""What clfsm does not print."""


def document(golden: dict, profile: str) -> dict:
    """The golden file as an arrangement document; C's int is int32."""
    machines = {}
    pool = golden.get("pool", [])
    for name in (*golden["schedule"], *pool):
        machine = golden["machines"][name]
        states = []
        for state in machine["states"]:
            entry = {k: v for k, v in state.items() if k != "transitions"}
            entry["transitions"] = [{"when": t["guard"], "to": t["target"]} for t in state["transitions"]]
            states.append(entry)
        inline = {"machine": name, "initial": machine["initial"], "states": states}
        if machine["suspend"]:
            inline["suspend"] = machine["suspend"]
        if machine["variables"]:
            inline["variables"] = {v["name"]: {"type": "int32", "init": v["init"]} for v in machine["variables"]}
        machines[name] = {"inline": inline}
    return {
        "name": golden["case"],
        "profile": profile,
        "timing": "untimed",
        "finished": "keep" if "-u" in golden["options"] else "leave",
        "machines": machines,
        "schedule": golden["schedule"],
        **({"pool": pool} if pool else {}),
    }


def text(program: Program, kind: str, machine: int, args: tuple[int, ...]) -> str:
    info = program.machines[machine]
    names = ["Suspended" if s == "__suspend" else s for s in info.states]
    if kind == "guard":
        state, transition, value = args
        target = info.transitions[state][transition].target
        return f"{'T' if value else 'F'}({names[state]}>{names[target]})"
    if kind in ("suspend", "resume"):
        return f"CMD_{kind.upper()}({names[args[0]]}>{names[args[1]]})"
    if kind == "restart":
        return f"CMD_RESTART({names[args[0]]})"
    prefix = {"entry": "ON_ENTRY", "exit": "ON_EXIT", "internal": "INTERNAL"}.get(kind, kind.upper())
    return f"{prefix}({names[args[0]]})"


def passed(line: str) -> int:
    """The age to choose in a ringlet: SelfClock's wall clock passed its bound where clfsm fired `after_ms`."""
    return int("T(A>B)" in line)


def reference_steps(program: Program, expected: list[str]):
    interpreter = Interpreter(program)
    layout = Layout.of(program)
    values, outputs = layout.decode(layout.first()), layout.initial_outputs()
    for line in expected:
        if not interpreter.enabled(values):
            return
        outcome = interpreter.step(values, outputs, 0, lambda choice, line=line: passed(line))
        values, outputs = outcome.values, outcome.outputs
        yield values, outputs, outcome.events


def native_steps(program: Program, expected: list[str]):
    from llfsm_verify.backends.native.executor import NativeProgram

    native = NativeProgram(program, events=True)
    record = native.layout.initial()[0]
    ended = program.processes[0].ended
    for line in expected:
        if ended and native.layout.decode(record)[ended]:
            return
        result = native.step(record, 0, {c.name: passed(line) for c in program.choices})
        record = result.record
        yield native.layout.decode(record), native.layout.decode_outputs(record), result.events


def ringlets(program: Program, steps, expected: list[str]) -> list[str]:
    lines: list[str] = []
    cycle = 1
    for values, outputs, events in steps(program, expected):
        machine = program.slots[outputs[program.ran] - 1].machine
        info = program.machines[machine]
        state = info.states[values[program.slots[outputs[program.ran] - 1].state]]
        kinds = [k for k, _, _ in events]
        status = "accepting" if "accept" in kinds else "fired" if outputs[program.fired] else "stayed"
        shown = " ".join(text(program, k, m, a) for k, m, a in events if k not in SILENT)
        lines.append(f"c{cycle} m{machine} {'Suspended' if state == '__suspend' else state} {status}: {shown}")
        cycle += outputs[program.cycle]
    return lines


@needs("golden")
@pytest.mark.parametrize("steps", [reference_steps, native_steps], ids=["reference", "native"])
@pytest.mark.parametrize("profile", ["llfsm", "clfsm"])
@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_reproduces_clfsm(path: Path, profile: str, steps) -> None:
    golden = json.loads(path.read_text())
    if golden["case"] in LATER or path.stem in LATER:
        pytest.skip(f"needs {LATER[golden['case']]}")
    program = lower(build_arrangement(document(golden, profile), integer_guards=True), keep_all_bits=True)
    expected = golden["ringlets"]
    assert ringlets(program, steps, expected) == expected


@needs("golden")
def test_every_golden_file_is_known() -> None:
    assert len(FILES) >= 34
