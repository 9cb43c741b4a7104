"""All diagnostic codes with what each means; `python -m llfsm_verify.report.codes` prints docs/diagnostics.md.

An extension or another package registers a list of its own, a mapping of codes to meanings, under `llfsm_verify.codes`:

    ENTRIES = {"llfsm_verify.codes": (Entry("avr", f"{__name__}.codes:CODES", "Images on AVR microcontrollers"),)}

Examples of them are in `examples.json` beside that module. `llfsm explain` notes what it leaves out:

    note: E110 of the list of codes `bikes` of another package has a meaning already
    note: the list of codes `bikes` of another package cannot be used (E910 has no meaning)
    note: the list of codes `bikes` of another package cannot be used (ModuleNotFoundError: No module named 'bikes')
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from importlib.resources import files

from llfsm_verify.analysis.coverage import CODES as COVERAGE
from llfsm_verify.arrangement.codes import CODES as ARRANGEMENT
from llfsm_verify.arrangement.suppressions import CODES as LINT
from llfsm_verify.engines.explicit.checkpoints import CODES as CHECKPOINTS
from llfsm_verify.knowledge.codes import CODES as THEORIES
from llfsm_verify.kripke.export.formats import CODES as STRUCTURES
from llfsm_verify.language.codes import CODES as LANGUAGE
from llfsm_verify.logic.codes import MEANINGS as PROPERTIES
from llfsm_verify.monitoring.codes import CODES as MONITORS
from llfsm_verify.registry import Registry, Unusable
from llfsm_verify.report.drawing import CODES as DRAWINGS
from llfsm_verify.report.timeline import CODES as TIMELINES
from llfsm_verify.runtime.live import CODES as RUNS
from llfsm_verify.runtime.ports import CODES as PORTS
from llfsm_verify.runtime.recording import CODES as RECORDINGS
from llfsm_verify.runtime.whiteboard.audit import CODES as AUDIT
from llfsm_verify.targets import CODES as TARGETS

LOWERING = {
    "E193": "What is calculated may leave 128 bits.",
}
FILES = {
    "E401": "A trace file of another version.",
    "E402": "A number in a trace file is not a valid number.",
    "E403": "The loop of a trace starts after its last step.",
    "E404": "A trace file has neither a property nor a fault, or both.",
    "E405": "A trace cannot be saved there, or would replace a file that is not a trace.",
    **DRAWINGS,
    "E408": "A key in a file of inputs is not a valid step number or time, or it is a time in an untimed arrangement.",
    "E409": "A file of inputs names an input or a value that the arrangement does not have.",
    "E410": "The arrangement of a trace did not come from a file.",
    "E411": "A step of a trace names a process or a value that the arrangement does not have any more.",
    "E412": "Standard output cannot be written.",
    "E490": "A report cannot be written there, or would replace a file that was read.",
    **CHECKPOINTS,
    "E429": "A check of several was ended by a signal; what it would have found is unknown.",
    "E450": "A certificate cannot be written or read there.",
    "E451": "A certificate would replace a file that is an input of the check.",
    "E452": "Invariants cannot be written or read there.",
    "E453": "A file is not a file of invariants, or is one of another version.",
    "E454": "Invariants would replace a file that is an input of the check.",
    "E463": "A value of a trace file cannot be rewritten, because it has an anchor.",
    "E464": "A package that the command needs is not installed.",
    "W401": "A trace has been saved that is too long to be read again.",
}
TESTING = {
    "E470": "A strict test has a property that no finite run can violate, or whose monitor was not made.",
    "E471": "A strict test has a property that is tested in part only: no finite part of some runs violates it.",
}
FAULTS = {
    "F001": "A value is stored in a variable whose range does not contain it.",
    "F002": "A division by zero.",
    "F003": "An index outside its array.",
    "F004": "The square root of a negative number.",
    "F005": "A shift by a negative number of bits, or by the width or more.",
    "F011": "The model of the surroundings stores a value in a variable whose range does not have it (as F001).",
    "F012": "The model of the surroundings divides by zero (as F002).",
    "F013": "The model of the surroundings uses an index outside its array (as F003).",
    "F014": "The model of the surroundings takes the square root of a negative number (as F004).",
    "F015": "The model of the surroundings shifts by a number of bits that is outside the width (as F005).",
}
_SHOWN = "`llfsm verify` prints a run that leads there."
_ELSEWHERE = "Name a file in a folder that is there and can be written."
_TRACE = "Write the trace anew with `--save-traces`; steps count from 1."
MENDS = {
    "E301": "Check the path; in a property file it is relative to that file.",
    "E304": "Split it into several property files.",
    "E305": "Split the file, or let definitions use each other less often.",
    "E306": "Give a part of the formula a name with `define NAME: …`, and use the name.",
    "E308": "Write `\"` at the end of the name.",
    "E314": "Write a formula there, or remove the line.",
    "E330": "Write the formula outside: for each index in turn, or as an operand of `&&` or `||`.",
    "E363": "Keep one automaton in the file.",
    "E402": _TRACE,
    "E403": _TRACE,
    "E404": _TRACE,
    "E409": "Correct the name or the value; `whiteboard:` in the arrangement has the inputs with their types.",
    "E411": "The arrangement changed since: check the property again with `--save-traces`, or name the arrangement of "
    "that time with `--arrangement`.",
    "E412": "Make room on the disk, or write elsewhere.",
    "E435": "Name a variable of type `bool`, or a machine, that the arrangement has.",
    "E436": "Leave out --set and --suspend, or bound the waiting, such as `F[0:100] p`.",
    "E450": _ELSEWHERE,
    "E452": _ELSEWHERE,
    "E487": _ELSEWHERE,
    "E490": _ELSEWHERE,
    "F001": f"Guard the statement, or declare a wider range. {_SHOWN}",
    "F002": f"Guard the division. {_SHOWN}",
    "F003": f"Guard the access, or make the array longer. {_SHOWN}",
    "F004": f"Guard the root, or take that of `max(0, …)`. {_SHOWN}",
    "F005": f"Guard the shift, or declare a smaller range for the count. {_SHOWN}",
    **{f"F01{i}": f"Correct the model of the surroundings; the machines may be right. {_SHOWN}" for i in range(1, 6)},
    "W301": "Ask about a shorter formula or smaller bounds.",
    "W401": "Read the run where it was printed, or ask another engine for a shorter one.",
    "W402": "Make room on the disk; without a checkpoint the next check starts from the beginning.",
}  # fmt: skip
"""What to do, of those whose message does not say it itself."""

SECTIONS: tuple[tuple[str, Mapping[str, str]], ...] = (
    ("Arrangements and machines", ARRANGEMENT),
    ("Guards, actions and atoms of properties", {**LANGUAGE, **LOWERING}),
    ("Theories of plausible logic", THEORIES),
    ("Properties", PROPERTIES),
    ("Traces, drawings and inputs", FILES),
    ("Kripke structures and models for other checkers", STRUCTURES),
    ("Monitors", MONITORS),
    ("Tests with random runs", TESTING),
    ("Runs and recordings", {**RECORDINGS, **RUNS, **TIMELINES, **PORTS, **AUDIT, **TARGETS}),
    ("Coverage and test vectors", COVERAGE),
    ("Faults of a run", FAULTS),
    ("Findings of `llfsm lint`", LINT),
)


INTRODUCTION = """# Diagnostics

A diagnostic says what is wrong in a file. It shows the place, the line with a mark below the place, and what to write
instead. Every diagnostic has a stable code: `E` is an error (exit code 3), `W` a warning, `F` a fault in which a run
ends, `L` a [finding of `llfsm lint`](lint.md). This page is written by `python -m llfsm_verify.report.codes`."""


OF_OTHERS: Registry[Mapping[str, str]] = Registry("list of codes", (), group="llfsm_verify.codes")
CODE = re.compile(r"[EFLW][0-9]{3}")


@dataclass(frozen=True, slots=True)
class Section:
    """Codes of one subject with their meanings, and examples of them (of some, where they are of another package)."""

    title: str
    codes: Mapping[str, str]
    examples: Mapping[str, str]
    mends: Mapping[str, str]
    """What to do, of those whose message does not say it; of extensions it is `MENDS` beside their codes."""


@cache
def ours() -> tuple[Section, ...]:
    """The sections of the core and of extensions. ValueError: what an extension registers is not a list of codes."""
    examples = _examples(__package__)
    core = [Section(title, codes, examples, MENDS) for title, codes in SECTIONS]
    return (*core, *map(_section, OF_OTHERS.ours))


def everyone() -> tuple[tuple[Section, ...], list[str]]:
    """Also the sections of other packages, and sentences about what of them is left out."""
    broken, found = list(OF_OTHERS.find_others()), list(ours())
    for name in OF_OTHERS:
        if name in OF_OTHERS.ours:
            continue
        what = f"the list of codes `{name}` of another package"
        try:
            section = _section(name)
        except Unusable as error:
            broken.append(str(error))
        except (ValueError, OSError) as error:
            broken.append(f"{what} cannot be used ({error})")
        else:
            taken = section.codes.keys() & meanings(found).keys()
            broken += [f"{code} of {what} has a meaning already" for code in sorted(taken)]
            codes = {code: meaning for code, meaning in section.codes.items() if code not in taken}
            found.append(replace(section, codes=codes))
    return tuple(found), broken


def _section(name: str) -> Section:
    entry, codes = OF_OTHERS[name], OF_OTHERS.load(name)
    if not isinstance(codes, Mapping):
        raise ValueError(f"{entry.place} is not a mapping")
    for code, meaning in codes.items():
        if not CODE.fullmatch(str(code)):
            raise ValueError(f"`{code}` is not one of the letters EFLW with three digits")
        if not isinstance(meaning, str) or not meaning.strip():
            raise ValueError(f"{code} has no meaning")
    module = import_module(entry.place.partition(":")[0])
    return Section(entry.about or name, codes, _examples(module.__package__), getattr(module, "MENDS", {}))


def all_codes() -> dict[str, str]:
    """Every code of ours with its meaning."""
    return meanings(ours())


def meanings(sections: Iterable[Section]) -> dict[str, str]:
    """Every code of these sections with its meaning."""
    return {code: meaning for section in sections for code, meaning in section.codes.items()}


def sentence(meaning: str) -> str:
    """A meaning as a sentence."""
    return f"{meaning[0].upper()}{meaning[1:].rstrip('.')}."


def _examples(package: str | None) -> Mapping[str, str]:
    file = files(package).joinpath("examples.json") if package else None
    found = json.loads(file.read_text("utf-8")) if file is not None and file.is_file() else {}
    return {code: str(text) for code, text in dict(found).items()}


def explained(code: str, sections: tuple[Section, ...] | None = None) -> str:
    """What a diagnostic means, how it looks, and (in its last line) what to do. StopIteration: no such code."""
    section = next(section for section in sections or ours() if code in section.codes)
    lines = [f"{code}: {sentence(section.codes[code])}"]
    if code in section.examples:
        lines += ["", *(f"    {line}".rstrip() for line in section.examples[code].split("\n"))]
    if code in section.mends:
        lines += ["", f"What to do: {section.mends[code]}"]
    return "\n".join(lines)


def page() -> Iterator[str]:
    """The lines of docs/diagnostics.md."""
    yield INTRODUCTION
    for section in ours():
        yield ""
        yield f"## {section.title}"
        yield ""
        yield "| code | meaning |"
        yield "|---|---|"
        for code, meaning in section.codes.items():
            yield f"| {code} | {sentence(meaning)} |"


if __name__ == "__main__":
    import sys

    sys.stdout.write("\n".join(page()) + "\n")
