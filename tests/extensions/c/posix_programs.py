"""Programs for POSIX, compiled once, and what they do with lines of inputs."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from random import Random
from types import MappingProxyType

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.target import C99
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.runtime.live.loop import Prescribed
from llfsm_verify.runtime.live.plan import plan, starting_values
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.recording.origin import header_of
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Made, Wanted
from llfsm_verify.values import value_text
from tests.extensions.c.compiled import STRICT

Cycle = Mapping[str, int]
"""Choices that change before a cycle."""


def written(path: str, folder: Path) -> Made:
    """The files of an arrangement, in a folder."""
    draft = read_arrangement(Given(path))
    made = C99.make(image_of(resolve(draft)), Wanted("posix", sources=draft.sources))
    for name, content in made.files.items():
        (folder / name).write_text(content)
    return made


def compiled(folder: Path, *flags: str, compiler: str = "gcc", name: str = "program") -> Path:
    """The program of all sources in a folder; every warning is an error."""
    sources = sorted(str(path) for path in folder.glob("*.c"))
    done = subprocess.run(
        [compiler, *STRICT, "-O1", *flags, *sources, "-o", name],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[:4000]
    return folder / name


def line_of(choices: Sequence[Choice], cycle: Cycle) -> str:
    """A line that gives inputs these values."""
    known = {c.name: c for c in choices}

    def value(name: str, number: int) -> str:
        choice = known[name]
        shown = value_text(choice.type, choice.labels, number)
        return json.dumps(shown) if choice.labels else shown

    return "{" + ", ".join(f"{json.dumps(n)}: {value(n, number)}" for n, number in cycle.items()) + "}"


def lines_of(program: Program, cycles: Sequence[Cycle]) -> list[str]:
    return [line_of(program.choices, cycle) for cycle in cycles]


def drawn(program: Program, random: Random, count: int) -> list[Cycle]:
    """Inputs that change at random, commands seldom."""
    return [
        {c.name: random.choice((c.type.low, c.type.high, random.randint(c.type.low, c.type.high))) for c in
         program.choices if random.random() < (0.1 if c.name.startswith(OPERATOR) else 0.5)}
        for _ in range(count)
    ]  # fmt: skip


def held(program: Program, cycles: Sequence[Cycle]) -> list[dict[str, int]]:
    """What all choices are in each cycle: inputs keep their values, and commands are over after one cycle."""
    values = {c.name: c.type.low for c in program.choices} | starting_values(program)
    commands = [c.name for c in program.choices if c.name.startswith(OPERATOR) and c.type.boolean]
    found: list[dict[str, int]] = []
    for cycle in cycles:
        values = {**values, **cycle}
        found.append(values)
        values = {**values, **dict.fromkeys(commands, 0)}
    return found


def recorded_by_a_run(
    path: str, cycles: Sequence[Cycle], to: Path, given: Mapping[str, str] = MappingProxyType({})
) -> str:
    """A recording of `llfsm run` with these inputs, and `given` ones that never change, and how it ended. The executor
    tells where its cycles begin."""
    draft = read_arrangement(Given(path))
    ready = plan(resolve(draft), simulated=False, held=given)
    program, native = ready.program, NativeProgram(ready.program)
    record, step = native.layout.first(ready.free), 0
    script: list[Prescribed] = []
    for choices in held(program, cycles):
        script += [Prescribed(step, i, choices[c.name]) for i, c in enumerate(program.choices)]
        ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=choices)
        record, step = ran.record, step + ran.steps
        if ran.status:
            break
    loop = ready.loop(ready.code(), period=0, rounds=len(cycles), script=script)
    header = header_of(draft.sources, ready.arrangement, simulated=False, seed=None, free=ready.free)
    with Run(loop, Recorder(to, header, loop)) as run:
        run.start()
        run.wait()
    return run.report.ending
