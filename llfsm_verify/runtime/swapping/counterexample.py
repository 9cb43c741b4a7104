"""What a refused machine would do: the executor performs the run that was found, and records it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import DiagnosticError, Disagreement
from llfsm_verify.jsonvalue import Json
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.moves import Move
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.frame import CYCLE, PROCESS
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.plan import monitored, safe_values, starting_values
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.verification.changes.update_check import Counterexample, Refusal


class Interleaved(Exception):
    """The run takes turns of several processes in the middle of each other's cycles, which no run does."""


def record_counterexample(
    refusal: Refusal, following: Arrangement, properties: PropertySet, header: Mapping[str, Json], path: Path | None
) -> int:
    """Perform what `refusal` says would happen, and record it at `path`; how many cycles it takes.

    Interleaved: it cannot be performed so. Disagreement: the executor does something else. DiagnosticError: the
    recording cannot be written.
    """
    counterexample = refusal.counterexample
    assert counterexample is not None
    program, monitors, _ = monitored(following, properties)
    turns = list(_turns(program, counterexample))
    loop = Loop(LiveCode(program, monitors, safe_values(following)), held=starting_values(program))
    loop.begin_at(counterexample.record, counterexample.states)
    recorder = None if path is None else Recorder(path, header, loop)
    try:
        loop.begin(0)
        status = 0
        for turn in turns:
            status = _perform(loop, turn)
            if status:
                break
            loop.commit()
            if recorder is not None:
                recorder.reach()
        watched = refusal.broken is not None and refusal.broken in monitors
        seen = watched and loop.verdicts[list(monitors).index(str(refusal.broken))] == "violated"
        if watched and not seen and not counterexample.endless:
            raise Disagreement(f"the executor does not violate `{refusal.broken}` in the run that was found")
        if (refusal.broken is None) != bool(status):
            raise Disagreement("the executor does not end in a fault where the run that was found does")
        loop.end("fault" if status else "violated" if seen else "stopped", status)
    except OSError as error:  # no room, for example
        if recorder is None:
            raise
        recorder.path.unlink()
        raise DiagnosticError([recorder.problem(error)]) from None
    finally:
        if recorder is not None:
            recorder.close()
    return len(turns)


def _perform(loop: Loop, moves: Sequence[Move]) -> int:
    """One turn; the status of its last ringlet."""
    code = loop.code
    numbers = {choice.name: number for number, choice in enumerate(code.program.choices)}
    at = code.context.defaults
    choices = list(loop._context[at : at + len(numbers)])
    for name, value in moves[0].choices.items():
        choices[numbers[name]] = value
    script = [
        Prescribed(loop.steps + ringlet, numbers[name], value)
        for ringlet, move in enumerate(moves)
        if ringlet
        for name, value in move.choices.items()
    ]
    process, last = moves[0].process, loop.frame[PROCESS]
    assert process is not None
    loop.frame[CYCLE] += 0 <= last >= process
    loop.frame[PROCESS] = process
    return loop.perform(process, choices, script)


def _turns(program: Program, counterexample: Counterexample) -> Iterator[list[Move]]:
    """The moves of each turn. What the executor does alone decides where a cycle ends."""
    execution = Execution(program)
    record, turn = counterexample.record, list[Move]()
    cycle = execution.layout.reader(program.cycle)
    for move in counterexample.moves:
        if move.process is None:
            break  # the arrangement has ended, and so has its run
        if turn and turn[0].process != move.process:
            raise Interleaved
        result = execution.step(record, move)
        turn.append(move)
        record = result.record
        if result.status or cycle(record):
            yield turn
            turn = []
    if turn:
        yield turn
