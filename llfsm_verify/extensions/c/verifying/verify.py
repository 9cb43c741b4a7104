"""Whether a built image does what its program means, and what it costs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.codes import FAILED
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.extensions.c.verifying.harness import HIDDEN
from llfsm_verify.extensions.c.verifying.run import Ran
from llfsm_verify.extensions.c.verifying.vectors import all_steps, drawn
from llfsm_verify.extensions.c.worlds import world
from llfsm_verify.plug import (
    INT64_MAX,
    INT64_MIN,
    Arrangement,
    Int,
    Limits,
    Made,
    Program,
    Type,
    Unit,
    Vectors,
    Verified,
    element_names,
    find_vectors,
    lower,
    program_hash,
    starting_values,
)
from llfsm_verify.plug import TargetWanted as Wanted

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
    where = world(wanted.world).bench(wanted)
    if vectors is not None:
        _check(vectors, lower(means.arrangement, keep_all_bits=True))
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


def _check(vectors: Vectors, program: Program) -> None:
    """DiagnosticError (E509): they are not of the program, or have what none of its runs has."""
    wrong = (
        "the vectors are of another program" if vectors.program != program_hash(program) else _wrong(vectors, program)
    )
    if wrong is not None:
        raise DiagnosticError(Diagnostic(FAILED, wrong, hint="make them again from this arrangement"))


def _wrong(vectors: Vectors, program: Program) -> str | None:
    """What no image can be given, or has to tell."""
    inputs: dict[str, Type] = {choice.name: choice.type for choice in program.choices}
    fields = {name: var.type for var in program.vars for name in element_names(var)}
    if vectors.inputs != tuple(inputs) or vectors.fields != tuple(fields):
        return "the vectors have not the inputs and variables of the program"
    if not any(sequence.inputs for sequence in vectors.sequences):
        return "the vectors have no step"
    for number, sequence in enumerate(vectors.sequences):
        of = f"`sequences[{number}]`"
        if sequence.fault > len(program.faults):
            return f"{of} ends with fault {sequence.fault}, but the program has {len(program.faults)}"
        for table, rows, kinds in ("inputs", sequence.inputs, inputs), ("records", sequence.records, fields):
            bounds = [(k.low, k.high) if isinstance(k, Int) else (INT64_MIN, INT64_MAX) for k in kinds.values()]
            for at, row in enumerate(rows):
                for name, value, (low, high) in zip(kinds, row, bounds, strict=True):
                    if not low <= value <= high:
                        return f"row {at} of `{table}` of {of} has {value} for `{name}`, which is not in {low}..{high}"
    return None


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
