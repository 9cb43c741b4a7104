"""The suite for targets: the files that one makes, what it refuses, and that its programs do what a run does."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.program.program import Choice
from llfsm_verify.registry import Entry
from llfsm_verify.runtime.live.plan import safe_values, starting_values
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import TARGETS, Made, Target, Wanted
from llfsm_verify.testing.conformance.known import SAMPLES, TARGETED
from llfsm_verify.testing.conformance.outcome import Case, Wrong
from llfsm_verify.testing.conformance.plugs import demand, entry_of
from llfsm_verify.values import elements, text, value_text

Rows = Sequence[Mapping[str, str]]
"""Values by their names, as arrangements write them: `true`, `RED`, `-0.5`."""
Run = Callable[[Path, Arrangement, Rows], Rows]
"""Build the files of a folder, and take a cycle with each row of inputs, which hold until another row gives others.
What outputs are after each cycle; where one ends in a fault, its safe values, and nothing after it."""
CYCLES = 60
HARD = ("double", "class", "main", "begin", "end", "PORTB", "int16_t", "self", "None", "x_1")


def target_cases(target: Entry | str, worlds: Sequence[str], run: Run | None = None) -> list[Case]:
    """Of a target: for each of these worlds, which need nothing else from a user. `run` runs programs of the first.
    Unregistered."""
    entry = entry_of(target, TARGETS)

    def of() -> Target:
        return cast(Target, entry.load())

    def made(arrangement: Arrangement, world: str, optimize: str = "speed") -> Made:
        found = of().make(arrangement, Wanted(world, "size" if optimize == "size" else "speed"))
        demand(isinstance(found, Made), f"it gives a {type(found).__name__}, not what it has made")
        return found

    def declares() -> None:
        demand(of().worlds, "it is for no world")
        demand(all(known.about for known in of().worlds.values()), "of a world nothing is said")
        demand(set(worlds) <= set(of().worlds), "it is not for each of these worlds")
        demand(
            of().mark and len(of().mark.splitlines()) == 1 and len(of().mark) < 200, "its mark takes more than a line"
        )

    def makes() -> None:
        for arrangement, world in ((a, w) for a in _arrangements() for w in worlds):
            for optimize in ("speed", "size"):
                found = made(arrangement, world, optimize)
                demand(found.files, "it makes no file")
                for name, content in found.files.items():
                    portable = re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}", name)
                    demand(portable, f"`{name}` cannot be the name of a file in one folder")
                    demand(
                        of().mark in content.partition("\n")[0][:1000], f"the first line of {name} is without its mark"
                    )
                    demand(content.endswith("\n"), f"{name} ends within a line")
                demand(len({n.lower() for n in found.files}) == len(found.files), "two files differ in case only")
                demand(all(isinstance(note, str) for note in found.notes), "a note of it cannot be printed")

    def repeats() -> None:
        for world in worlds:
            files = [dict(made(arrangement, world).files) for arrangement in _arrangements()]
            again = [dict(made(arrangement, world).files) for arrangement in _arrangements()]
            demand(files == again, "the same arrangement gives other files")
            demand(
                len({str(sorted(each.items())) for each in files}) == len(files), "two arrangements give the same files"
            )

    def names() -> None:
        for name in HARD:
            document = {**SAMPLES["lamp"], "name": name}
            try:
                made(image_of(build_arrangement(document)), worlds[0])
            except DiagnosticError as refused:
                demand(
                    all(found.hint for found in refused.diagnostics), f"it refuses `{name}` and does not say what to do"
                )

    def runs() -> None:
        assert run is not None
        for document in (SAMPLES["lamp"], *TARGETED.values()):
            arrangement = image_of(build_arrangement(document))
            given, wanted = _cycles(arrangement)
            with TemporaryDirectory() as name:
                for file, content in made(arrangement, worlds[0]).files.items():
                    (Path(name) / file).write_text(content, encoding="utf-8")
                found = list(run(Path(name), arrangement, given))
            for number, (one, other) in enumerate(zip(wanted, found, strict=False), 1):
                if dict(one) != dict(other):
                    raise Wrong(
                        f"after {number} cycles of `{arrangement.name}` outputs are {dict(other)}, not {dict(one)}"
                    )
            demand(len(found) == len(wanted), f"`{arrangement.name}` takes {len(found)} cycles, not {len(wanted)}")

    cases = [
        Case("declares", "its worlds and its mark", declares),
        Case("makes", "files of a few arrangements: their names, their first lines", makes),
        Case("repeats", "the same files of the same arrangement, others of another", repeats),
        Case("names", "names that are words of languages are taken, or refused with what to do", names),
    ]
    return [*cases, Case("runs", "cycles with inputs by chance, faults, safe values", runs)] if run else cases


def _arrangements() -> Iterator[Arrangement]:
    yield image_of(build_arrangement(SAMPLES["lamp"]))
    for document in TARGETED.values():
        yield image_of(build_arrangement(document))


def _cycles(arrangement: Arrangement) -> tuple[Rows, Rows]:
    """Inputs by chance, and the outputs by the executor, up to a fault."""
    program = lower(arrangement, keep_all_bits=True)
    chance = random.Random(arrangement.name)  # noqa: S311 - nothing secret
    native, held = NativeProgram(program), dict(starting_values(program))
    outputs = [v for v in program.vars if v.origin.kind == "whiteboard" and v.name in _outputs(arrangement)]
    given: list[dict[str, str]] = []
    wanted: list[dict[str, str]] = []
    record = native.layout.first()

    def chosen(choice: Choice) -> int:
        return chance.choice((choice.type.low, choice.type.high, chance.randint(choice.type.low, choice.type.high)))

    while len(given) < CYCLES:
        changed = {c: chosen(c) for c in program.choices if chance.random() < 0.7}
        given.append({c.name: value_text(c.type, c.labels, number) for c, number in changed.items()})
        held |= {c.name: number for c, number in changed.items()}
        ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=held)
        record = ran.record
        values = {**native.layout.decode_record(record), **(safe_values(arrangement) if ran.status else {})}
        wanted.append({name: text(value) for v in outputs for name, value in elements(v, values[v.name])})
        if ran.status:
            break
    return given, wanted


def _outputs(arrangement: Arrangement) -> set[str]:
    return {entry.variable.name for entry in arrangement.whiteboard if entry.role == "output"}
