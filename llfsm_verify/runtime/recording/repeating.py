"""A recording performed again: whether each frame is the same, and how the run ended."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Schedule, perform
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.trace import Trace
from llfsm_verify.diagnostics import counted
from llfsm_verify.runtime.live.frame import ENDING, ENDINGS
from llfsm_verify.runtime.recording.file import GOES_ON, Recording
from llfsm_verify.runtime.recording.origin import Load, arrangement_of, code_of, free_of
from llfsm_verify.runtime.recording.replay import Differs, performed, ringlets
from llfsm_verify.semantics.lowering import lower


@dataclass(frozen=True, slots=True)
class Repeated:
    """What came of a recording that was performed again."""

    path: Path
    arrangement: Arrangement
    """As it ran."""
    frames: int
    """Those that are the same, bit for bit."""
    ending: str
    """Of the last of them: one of `live.frame.ENDINGS`."""
    differs: str | None
    """What is different in the next one."""
    damaged: str | None
    """Why the next one cannot be read."""
    lost: str | None
    """Why the last frame of the run is not there."""
    notes: tuple[str, ...]

    @property
    def same(self) -> bool | None:
        """Whether all frames are the same; None: the recording is damaged."""
        return None if self.damaged is not None else self.differs is None

    @property
    def sentence(self) -> str:
        """Whether they are the same, and how the run ended."""
        if self.differs is not None:
            return f"differs: {self.differs}"
        if self.damaged is not None:
            so_far = f"damaged after frame {self.frames:,}, and the same until then" if self.frames else "damaged"
            return f"{so_far}: {self.damaged}"
        happened = f"{counted(self.frames, 'frame')}, the same bit for bit"
        if self.frames <= (self.ending != "running"):
            happened = "0 cycles"  # it was over before the first frame of a run, which no cycle comes before
        if self.lost == GOES_ON:
            return f"{happened}, and {GOES_ON}"
        return f"{happened}, and then {self.ending if self.lost is None else f'nothing: {self.lost}'}"


def replay_recording(path: str | Path, instead: str | None, load: Load) -> Repeated:
    """Perform a recording again, with the arrangement in it or the one in the file `instead`.

    DiagnosticError (E481, E482): it is no recording, or its arrangement cannot be made.
    """
    frames, ending, differs = 0, 0, None
    with Recording(path) as recording:
        arrangement = arrangement_of(recording, load, instead)
        try:
            for turn in performed(recording, code_of(recording, arrangement)):
                frames, ending = frames + 1, turn.frame[ENDING]
        except Differs as difference:
            differs = str(difference)
        return Repeated(
            recording.path, arrangement, frames, ENDINGS[ending], differs, recording.damaged, recording.lost,
            recording.notes,
        )  # fmt: skip


def trace_of(again: Repeated) -> Trace | None:
    """The ringlets of a recording that is the same; None: it is not, or goes on with an earlier one."""
    with Recording(again.path) as recording:
        if recording.goes_on or not again.same:
            return None
        code = code_of(recording, again.arrangement)
        program = lower(again.arrangement, keep_all_bits=True)
        taken = ringlets(performed(recording, code), code, program)
        moves = tuple(ringlet.move for ringlet in taken if ringlet.move.process is not None)
        schedule = Schedule(tuple(free_of(recording, code.program).items()), moves, None)
        return perform(Execution(program), schedule, frozenset(), open_end=True).trace
