"""Where a run leaves the 64 bits in which the executor holds numbers without bounds: variable, line and run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from llfsm_verify.arrangement.model import Arrangement, State
from llfsm_verify.backends.reference import Interpreter, Outcome
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.diagnostics import Span
from llfsm_verify.kripke.graph import OVERFLOW
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, Declare, Read
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.values import Value

MOST_TURNS, MOST_PLACES = 6, 3
"""Turns at the end of a run, and lines, that a sentence names."""
ACTIONS = {"entry": "on_entry", "exit": "on_exit"}
"""The key of the action that an event begins, where the two have different names."""


def overflow_text(arrangement: Arrangement, program: Program, schedule: Schedule) -> str:
    """OVERFLOW, with the place and the run; OVERFLOW alone where the interpreter performs the run to its end."""
    interpreter = Interpreter(program)
    values: dict[str, Value] = {v.name: v.init for v in program.vars if not v.output} | dict(schedule.free)
    outputs: dict[str, Value] = {v.name: v.init for v in program.vars if v.output}
    turns: list[str] = []
    for number, move in enumerate(schedule.ringlets, 1):

        def choose(choice: Choice, given: Mapping[str, int] = move.choices) -> int:
            return given.get(choice.name, choice.type.low)

        done = interpreter.step(values, outputs, move.process, choose)
        if done.fault is not None or move.process is None:
            break
        process = program.processes[move.process]
        turn = values[process.turn]
        assert isinstance(turn, int)
        slot = program.slots[process.slots[turn]]
        machine, at = program.machines[slot.machine], values[slot.state]
        assert isinstance(at, int)
        read = ", ".join(f"{name} = {value}" for name, value in done.samples)
        turns.append(f"{machine.name}@{machine.states[at]}" + (f" ({read})" if read else ""))
        if done.overflow:
            states = arrangement.machine(machine.name).states
            where = _where(done, program, states[at] if at < len(states) else None)
            run = ("…, " if len(turns) > MOST_TURNS else "") + ", ".join(turns[-MOST_TURNS:])
            return f"{OVERFLOW}: {where}in step {number:,} of the run {run}"
        values, outputs = done.values, done.outputs
    return OVERFLOW


def _where(done: Outcome, program: Program, state: State | None) -> str:
    """The variable that was to hold it, with the lines that may store it there, as far as they are known."""
    if any(v.name == done.beyond and v.output for v in program.vars):
        return "what a property reads, "
    events = [kind for kind, _, _ in done.events if kind != "guard"]
    action = getattr(state, ACTIONS.get(events[-1], events[-1]), ()) if events else ()
    stores = [(text, span) for name, text, span in _stores(action) if f"{done.beyond}.".startswith(f"{name}.")]
    if not stores:
        return ""
    name, first = stores[0]
    places = " or ".join(list(dict.fromkeys(f"{span.source.name}:{span.line}" for _, span in stores))[:MOST_PLACES])
    text = f" (`{' '.join(first.text.split())}`)" if len(stores) == 1 else ""
    return f"`{name}` at {places}{text}, "


def _stores(action: object) -> Iterator[tuple[str, str, Span]]:
    """The name of what is stored to in step programs, and as it is written."""
    for node in of_kind(action, Assign):
        target = node.target
        name = target.variable.name if isinstance(target, Read) else f"v.{target.local.key}"
        yield name, target.span.text, node.span
    for declared in of_kind(action, Declare):
        yield f"v.{declared.local.key}", declared.span.text.split("=")[0].split()[-1], declared.span
