"""A run told again: to the executor, ringlet by ringlet, and to people, as a program to paste."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.logic.reading import names_file
from llfsm_verify.program.moves import Move
from llfsm_verify.testing.stretches import Stretch, Taken
from llfsm_verify.testing.tested import Tested
from llfsm_verify.values import Shown


def schedule_of(subject: Tested, free: Mapping[str, Shown], taken: Sequence[Taken], end: bytes) -> Schedule:
    """The run that ends in the configuration `end` as a schedule, made by stepping it once more."""
    simulation = subject.simulation.anew(free=free)
    chosen = subject.execution.free(simulation.record)
    moves: list[Move] = []
    turn = 0
    count = len(subject.program.processes)
    names = [p.name for p in subject.program.processes]
    record = simulation.record
    for part in taken:
        for number in range(part.ringlets):
            values = {**part.inputs, **(part.stretch.reads if number == 0 else {})}
            choices = simulation.choices(values)
            enabled = subject.execution.enabled(record)
            process = None
            if enabled and part.stretch.process is not None:
                process = names.index(part.stretch.process)
            elif enabled:
                process = min(enabled, key=lambda p: (p - turn) % count)
            moves.append(Move(process, choices))
            result = subject.execution.step(record, moves[-1])
            record = result.record
            if process is not None and not result.status:
                turn = (process + 1) % count
    assert record == end, "the run is told as it was"
    return Schedule(chosen, tuple(moves), None)


def plainly(subject: Tested, taken: Sequence[Taken]) -> list[Stretch]:
    """The same run in as few stretches as possible, each with the inputs that it really changes."""
    now: dict[str, Shown] = {name: knob.shown(knob.start) for name, knob in subject.knobs.items()}
    found: list[Stretch] = []
    for part in taken:
        if not part.ringlets:
            continue
        one = replace(part.stretch, changes={name: value for name, value in part.inputs.items() if now[name] != value})
        now = dict(part.inputs)
        last = found[-1] if found else None
        if last is not None and not (one.changes or one.reads) and (last.unit, last.process) == (one.unit, one.process):
            found[-1] = last.of(last.turns + one.turns)
        else:
            found.append(one)
    return found


def program_of(subject: Tested, free: Mapping[str, Shown], stretches: Sequence[Stretch]) -> str:
    """Python text that makes the run anew and, when it failed, fails again."""
    properties = _properties_text(subject)
    lines: list[str] = []
    given = f", {properties}" if properties else ""
    lines.append(f"subject = load({subject.arrangement.path!r}{given})")
    lines.append(f"run = subject.start({dict(free)!r})" if free else "run = subject.start()")
    lines += [f"run.{stretch.unit}({stretch.arguments})" for stretch in stretches]
    imports = ["from decimal import Decimal", ""] if any("Decimal(" in line for line in lines) else []
    return "\n".join([*imports, "from llfsm_verify.testing import load", "", *lines]) + "\n"


def _properties_text(subject: Tested) -> str:
    """The properties as an argument of `load`: their files, or their lines."""
    given = subject.given
    words = [repr(Path(p).as_posix()) if names_file(p) else _quoted(str(p)) for p in given]
    if not words:
        return ""
    return words[0] if len(words) == 1 else f"[{', '.join(words)}]"


def _quoted(text: str) -> str:
    """A text as Python writes it: over several lines where it has some."""
    plain = "\n" in text and '"""' not in text and "\\" not in text and not text.endswith('"')
    return f'"""{text}"""' if plain else repr(text)
