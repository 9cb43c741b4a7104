"""What saved traces, recordings and test vectors cover of an arrangement."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

from llfsm_verify.analysis.coverage import OTHER, UNCOUNTED
from llfsm_verify.analysis.coverage.measure import Performer
from llfsm_verify.analysis.coverage.result import Run
from llfsm_verify.analysis.coverage.running import field_names, performed
from llfsm_verify.analysis.coverage.vectorfile import is_vectors, program_hash, read_vectors
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.confirm import Misfit
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Span
from llfsm_verify.runtime.live.plan import runnable
from llfsm_verify.runtime.recording.file import Recording, Turn, is_recording
from llfsm_verify.runtime.recording.origin import arrangement_of, code_of, free_of, loaded_into
from llfsm_verify.runtime.recording.replay import Differs, ringlets
from llfsm_verify.runtime.recording.replay import performed as performed_again
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.semantics.probes import Outcome
from llfsm_verify.verification.replay import saved_run

CHANGED: Final = "save it again with this arrangement, or name the arrangement as it was"


@dataclass(frozen=True, slots=True)
class Covered:
    """What came out in the runs of some files."""

    seen: frozenset[Outcome]
    runs: tuple[Run, ...]


def covered_by(arrangement: Arrangement, paths: Sequence[str], cycle_ms: Fraction | None = None) -> Covered:
    """Perform the runs in these files. `cycle_ms`: of test vectors of an untimed arrangement.

    DiagnosticError: a file cannot be read, is of another arrangement (E520), or has no run that can be counted (E521).
    """
    seen: set[Outcome] = set()
    runs = []
    for path in paths:
        if is_recording(path):
            performer = _recorded(path, arrangement)
        elif is_vectors(path):
            performer = _tested(path, arrangement, cycle_ms)
        else:
            performer = _saved(path, arrangement)
        seen |= performer.seen
        runs.append(Run(path, performer.steps))
    return Covered(frozenset(seen), tuple(runs))


def _saved(path: str, arrangement: Arrangement) -> Performer:
    def load(_: str, /, *, named_at: Span | None = None) -> Arrangement:
        del named_at  # the command line says which arrangement it is
        return arrangement

    file, _, schedule = saved_run(path, arrangement.path, load)
    if file.digest != arrangement.digest:
        raise _other(path, arrangement)
    performer = Performer(arrangement)
    try:
        performer.follow(schedule, open_end=file.fault is not None)
    except Misfit as misfit:
        raise _uncounted(path, f"the trace cannot be performed: {misfit}") from None
    return performer


def _recorded(path: str, arrangement: Arrangement) -> Performer:
    with Recording(path) as recording:
        if recording.header.get("digest") != arrangement.digest or loaded_into(recording):
            raise _other(path, arrangement)
        if recording.goes_on:
            raise _uncounted(path, "the recording goes on with an earlier run, so it does not tell how that began")
        ran = arrangement_of(recording, lambda _: arrangement, arrangement.path)
        code, performer, frames = code_of(recording, ran), Performer(ran), 0

        def counted() -> Iterator[Turn]:
            nonlocal frames
            for turn in performed_again(recording, code):
                frames += 1
                yield turn

        free = free_of(recording, performer.probed.program)
        try:
            turns = counted()
            taken = ringlets(turns, code, performer.probed.program)
            performer.take(free.items(), (ringlet.move for ringlet in taken if ringlet.move.process is not None))
            deque(turns, 0)  # up to the end of the file, which may be damaged
        except Differs as differs:
            raise _uncounted(path, f"the recording cannot be performed again: {differs}") from None
        if recording.damaged is not None:
            so_far = f"damaged after frame {frames:,}" if frames else "damaged"
            raise _uncounted(path, f"the recording is {so_far}: {recording.damaged}")
    return performer


def _tested(path: str, arrangement: Arrangement, cycle_ms: Fraction | None) -> Performer:
    vectors, image = read_vectors(path), runnable(arrangement, simulated=False, cycle_ms=cycle_ms)
    program = lower(image, keep_all_bits=True)
    names = tuple(choice.name for choice in program.choices), field_names(program)
    if program_hash(program) != vectors.program or names != (vectors.inputs, vectors.fields):
        raise _other(path, arrangement)
    execution, performer = Execution(program), Performer(image)
    for number, wanted in enumerate(vectors.sequences):
        if any(
            not c.type.low <= v <= c.type.high
            for row in wanted.inputs
            for c, v in zip(program.choices, row, strict=True)
        ):
            raise _uncounted(path, f"an input of `sequences[{number}]` is outside its range")
        run, moves = performed(execution, vectors, wanted.inputs)
        if run != wanted:
            raise _uncounted(path, f"`sequences[{number}]` has other records than the executor makes of its inputs")
        performer.take((), moves)
    return performer


def _other(path: str, arrangement: Arrangement) -> DiagnosticError:
    message = f"this is a run of another arrangement than `{arrangement.name}` as it is in {arrangement.path}"
    return DiagnosticError(Diagnostic(OTHER, message, hint=CHANGED, file=path))


def _uncounted(path: str, why: str) -> DiagnosticError:
    return DiagnosticError(Diagnostic(UNCOUNTED, why, hint="leave the file out", file=path))
