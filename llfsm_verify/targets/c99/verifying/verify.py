"""Whether a built image does what its program means, and what it costs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from llfsm_verify.analysis.coverage.search import find_vectors
from llfsm_verify.analysis.coverage.vectorfile import program_hash
from llfsm_verify.analysis.coverage.vectors import Unit, Vectors
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import Limits
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.targets.c99.image import Image
from llfsm_verify.targets.c99.verifying import FAILED
from llfsm_verify.targets.c99.verifying.harness import HIDDEN
from llfsm_verify.targets.c99.verifying.run import Ran
from llfsm_verify.targets.c99.verifying.vectors import all_steps, drawn
from llfsm_verify.targets.c99.worlds import WORLDS
from llfsm_verify.targets.target import Made, Verified, Wanted

SEARCHED = 20_000
"""Configurations in the search for vectors."""
LARGEST = 2_500_000
"""Values in all records that are compared one after the other."""


@dataclass(frozen=True, slots=True)
class Means:
    """An image, and what it should do: the arrangement that it is of, and its whole program."""

    image: Image
    arrangement: Arrangement
    program: Program


def verify(means: Means, wanted: Wanted, made: Made, vectors: Vectors | None) -> Verified:
    """See `Target`."""
    image, program = means.image, means.program
    where = WORLDS.load(wanted.world).bench(wanted)
    if vectors is not None and vectors.program != program_hash(lower(means.arrangement, keep_all_bits=True)):
        message = "the vectors are of another program"
        raise DiagnosticError(Diagnostic(FAILED, message, hint="make them again from this arrangement"))
    lost = [v.name for v in program.vars if v.origin.kind not in HIDDEN and v.name not in image.names.fields]
    if lost:
        raise DiagnosticError(Diagnostic(FAILED, f"the image does not store {', '.join(lost)}"))
    texts = (made.files[f"{image.prefix}.h"], made.files[f"{image.prefix}.c"])
    found: dict[str, tuple[Ran, bool]] = {}
    for unit in ("ringlet", "cycle") if vectors is None else (vectors.unit,):
        every = all_steps(program, unit, _limit(program)) if vectors is None else None
        ran = where.run(image, texts, vectors or every or _some(means, unit))
        found[unit] = ran, every is not None
        if ran.difference is not None:
            return Verified((f"On {where.name}: {ran.difference}.",), ran.difference)
    counted = " and ".join(f"{ran.steps} {unit}s" for unit, (ran, _) in found.items())
    lines = [f"Verified on {where.name}: {counted}, 0 differences.", *_about(found, ours=vectors is None)]
    if image.monitors is not None:
        call = f"{image.prefix}_monitors_step"
        lines.append(f"The monitors were not run: no verdict is compared, and no time has that of {call} in it.")
    return Verified((*lines, *where.costs(image, made, found)), None)


def _some(means: Means, unit: Unit) -> Vectors:
    """Those that a search finds, and drawn ones."""
    made = drawn(means.program, unit)
    if means.program != lower(means.arrangement, keep_all_bits=True):
        return made  # of monitors, whose outputs a search of the arrangement does not have
    first = starting_values(means.program)
    search = find_vectors(means.arrangement, means.arrangement, first, unit, Limits(max_states=SEARCHED))
    return replace(made, sequences=search.vectors.sequences + made.sequences)


def _limit(program: Program) -> int:
    return LARGEST // max(1, sum(v.length or 1 for v in program.vars))


def _about(found: Mapping[str, tuple[Ran, bool]], *, ours: bool) -> Iterator[str]:
    for unit, (_, every) in found.items() if ours else ():
        if every:
            yield f"These are all {unit}s that there can be, with each combination of the inputs that they read."
        else:
            yield f"There can be too many {unit}s for all: the inputs of these were drawn, or found by a search."
