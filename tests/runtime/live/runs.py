"""Runs for tests: an arrangement, its machine code, and a recording of it."""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import drawn_choices, starting_values
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.recording.file import Recorder, Recording, Turn
from llfsm_verify.semantics.lowering import lower


def code_of(arrangement: Arrangement) -> LiveCode:
    return LiveCode(lower(arrangement, keep_all_bits=True))


def pids(run: Supervised) -> list[int]:
    """The processes of a run."""
    return [child.pid for child in run._reports.values()]


def recorded(code: LiveCode, path: Path, turns: int, seed: int) -> tuple[Loop, list[Turn]]:
    """A run with random choices, and what its recording says."""
    held = starting_values(code.program)
    loop = Loop(code, seed=seed, drawn=drawn_choices(code.program, {}), held=held)
    path.unlink(missing_ok=True)
    recorder = Recorder(path, {"name": "test"}, loop)
    loop.begin(0)
    reason = loop.go(turns)
    while reason == control.FULL:
        recorder.grow()
        reason = loop.go(loop.control[control.TURNS])
    failed = reason == control.FAILED
    ending = "fault" if failed and loop.status > 0 else "overflow" if failed else "ended"
    loop.end("stopped" if reason == control.DONE else ending, loop.status if failed else 0)
    recorder.close()
    return loop, turns_of(path)


def turns_of(path: Path) -> list[Turn]:
    """All turns of a recording, which is whole."""
    with Recording(path) as recording:
        found = list(recording)
        assert not recording.damaged
    return found
