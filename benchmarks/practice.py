"""Models as people write them, in turns with SPIN and NuSMV: `python -m benchmarks.practice`, a part of `make bench`.

A trip chain of many inputs (`chain.py`), a level crossing whose parts fail (`models/crossing.yaml`), a lift with people
(`lift.py`). The models of the others say the same in the way of their users. Seconds are from the shell to all answers;
what has not ended within the limit of its row, of processor time, or does not decide all, says so. Exit code 1: two
disagree, or one is wrong.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import re
import signal
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks import chain, lift, ours, spin, writing
from benchmarks.children import ChildFailed, TooLong, Usage, expect, run
from benchmarks.measure import Wrong
from benchmarks.ring import ring
from tools import oracles

HERE = Path(__file__).parent
NAME = "benchmarks.practice"
TOOLS = (ours.NAME, spin.NAME, "NuSMV")
HEADINGS = ["CPU/wall", "ours", "SPIN", "NuSMV"]
MEGABYTES = 8_000
"""What SPIN's verifier may take."""
LONG = 10.0
"""Seconds of processor time."""
SPECIFICATION = re.compile(r"^(LTL|INVAR)SPEC NAME (\w+) :=", re.MULTILINE)
ANSWER = re.compile(r"^-- (specification|invariant) .* is (true|false)$", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Row:
    """One model with what is asked of it, three times, and the answers that must come."""

    name: str
    arrangement: str
    properties: str
    promela: str
    smv: str
    verdicts: Mapping[str, str]
    limit: int
    """Seconds of processor time of each tool."""
    depth: int = 100_000
    """Steps on SPIN's stack."""
    fair: bool = False
    """Several processes: SPIN is asked about weakly fair runs."""
    reorders: bool = False
    """NuSMV orders its variables itself: it is faster so with this model."""


@dataclass(frozen=True, slots=True)
class Answer:
    """What one tool took, or why it has no answer."""

    cpu: float
    wall: float
    failed: str = ""


def rows() -> list[Row]:
    """All rows of the table."""
    found = []
    for kind in chain.KINDS:
        for n in (8, 16, 24):
            verdicts = {f"{letter}{i}": "holds" for i in range(n) for letter in "qrd"}
            texts = [write(n, kind) for write in (chain.arrangement, chain.properties, chain.promela, chain.smv)]
            found.append(Row(f"chain({n}), {kind}", *texts, verdicts, 15))
    crossing = [_text("models", "crossing.yaml"), _text("models", "crossing.ltl")]
    crossing += [_text("peers", "crossing.pml"), _text("peers", "crossing.smv")]
    found.append(Row("crossing", *crossing, {"safe": "violated"}, 30, reorders=True))
    for people in (2, 3, 4):
        texts = [lift.arrangement(people), lift.PROPERTIES, lift.promela(people), lift.smv(people)]
        name = f"lift, {people} people"
        found.append(Row(name, *texts, lift.verdicts(people), 30, 4_000_000, fair=True, reorders=True))
    return found


def _text(*parts: str) -> str:
    return HERE.joinpath(*parts).read_text(encoding="utf-8")


def ask_us(row: Row, folder: Path) -> Answer:
    """The command as users run it. Raises ChildFailed and Wrong."""
    for name, text in (("a.yaml", row.arrangement), ("p.ltl", row.properties)):
        (folder / name).write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(folder / "a.yaml"), str(folder / "p.ltl")]
    command += ["--format", "json"]
    done = expect(_within(row, [], command, HERE.parent), command, 0, 1, 4)
    said = json.loads(done.output)
    verdicts = {item["name"]: item["verdict"] for item in said["properties"]}
    return judge(row, ours.NAME, verdicts | {"faults": said["faults"]["verdict"]}, [done])


def ask_spin(row: Row, folder: Path) -> Answer:
    """`spin -a`, `gcc -O2`, and the verifier once for each claim. Raises ChildFailed and Wrong."""
    (folder / "model.pml").write_text(row.promela, encoding="utf-8")
    translate = ["gcc", "-w", "-O2", f"-DMEMLIM={MEGABYTES}", *(["-DNFAIR=3"] if row.fair else ["-DNOREDUCE"])]
    used: list[Usage] = []
    for command in (["spin", "-a", "model.pml"], [*translate, "-o", "pan", "pan.c"]):
        used.append(expect(_within(row, used, command, folder), command, 0))
    verdicts = {}
    for claim in row.verdicts:
        command = ["./pan", "-a", f"-m{row.depth}", "-w22", *(["-f"] if row.fair else []), "-N", claim]
        done = expect(_within(row, used, command, folder), command, 0)
        used.append(done)
        if "-DMEMLIM bound" in done.output:
            return Answer(*_sums(used), f">{MEGABYTES // 1000}GB")
        verdicts[claim] = "violated" if spin.read(done.output)[2] else "holds"
    return judge(row, spin.NAME, verdicts, used)


def ask_nusmv(row: Row, folder: Path) -> Answer:
    """Its decision diagrams, as the command without a script does. Raises ChildFailed and Wrong."""
    (folder / "model.smv").write_text(row.smv, encoding="utf-8")
    command = [str(oracles.find("nusmv")), "-dcx", *(["-dynamic"] if row.reorders else []), "model.smv"]
    done = expect(_within(row, [], command, folder), command, 0)
    verdicts = {}
    for kind, said in (("LTL", "specification"), ("INVAR", "invariant")):
        names = [name for k, name in SPECIFICATION.findall(row.smv) if k == kind]
        answers = [answer for what, answer in ANSWER.findall(done.output) if what == said]
        if len(names) != len(answers):
            raise ChildFailed(f"NuSMV gave {len(answers)} answers to {len(names)} questions:\n{done.errors[-1000:]}")
        verdicts |= {n: {"true": "holds", "false": "violated"}[a] for n, a in zip(names, answers, strict=True)}
    return judge(row, TOOLS[2], verdicts, [done])


def _within(row: Row, used: Sequence[Usage], command: Sequence[str], folder: Path) -> Usage:
    """One of the commands that have the limit together. Raises TooLong."""
    left = math.ceil(row.limit - sum(u.cpu for u in used))
    if left > 0:
        limited = ["sh", "-c", 'ulimit -t "$1"; shift; exec "$@"', "sh", str(left), *command]
        done = run(limited, timeout=10 * row.limit, cwd=folder)  # others use the computer as well
        if done.code not in (-signal.SIGXCPU, -signal.SIGKILL):
            return done
    raise TooLong(f"`{' '.join(command)}` took more than {row.limit} s")


def _sums(used: Sequence[Usage]) -> tuple[float, float]:
    return sum(u.cpu for u in used), sum(u.wall for u in used)


def judge(row: Row, tool: str, verdicts: Mapping[str, str], used: Sequence[Usage]) -> Answer:
    """An answer of a tool. Raises Wrong where it says what the others do not."""
    unknown = [name for name, verdict in verdicts.items() if verdict == "unknown"]
    expected = dict(row.verdicts) | ({"faults": "holds"} if "faults" in verdicts else {})
    wrong = {n: v for n, v in verdicts.items() if n not in unknown and v != expected.get(n)}
    if wrong or verdicts.keys() != expected.keys():
        raise Wrong(f"{row.name}: {tool} says {wrong or dict(verdicts)}")
    return Answer(*_sums(used), f"{len(unknown)} of {len(verdicts)} unknown" if unknown else "")


ASK: dict[str, Callable[[Row, Path], Answer]] = {ours.NAME: ask_us, spin.NAME: ask_spin, TOOLS[2]: ask_nusmv}


def missing(tool: str) -> bool:
    """The tool is not installed."""
    if tool == spin.NAME:
        return spin.missing() is not None
    return tool == TOOLS[2] and oracles.find("nusmv") is None


def measure(row: Row, runs: int) -> dict[str, Answer]:
    """Medians of the tools that are installed, which take turns; what took LONG, or gave no answer, is not asked again.

    Raises ChildFailed and Wrong.
    """
    found: dict[str, list[Answer]] = {tool: [] for tool in TOOLS if not missing(tool)}
    for _ in range(runs):
        for tool, answers in found.items():
            if not answers or (not answers[-1].failed and answers[-1].cpu < LONG):
                with tempfile.TemporaryDirectory() as name:
                    try:
                        answers.append(ASK[tool](row, Path(name)))
                    except TooLong:
                        answers.append(Answer(row.limit, row.limit, f">{row.limit}"))
    return {tool: _median(answers) for tool, answers in found.items()}


def _median(answers: Sequence[Answer]) -> Answer:
    failed = next((a for a in answers if a.failed), None)
    return failed or Answer(median(a.cpu for a in answers), median(a.wall for a in answers))


def cells(row: Row, found: Mapping[str, Answer]) -> list[str]:
    """A line of the table."""
    line = [row.name]
    for tool in TOOLS:
        answer = found.get(tool)
        if answer is None:
            line.append("not installed")
        else:
            line.append(answer.failed or f"{answer.cpu:.2f}/{answer.wall:.2f}")
    return line


def main(arguments: list[str] | None = None) -> int:
    """Print the table and, with --write, put it into a page."""
    parser = argparse.ArgumentParser(prog=f"python -m {NAME}", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--runs", type=int, default=3, help="runs of which medians are shown (default: 3)")
    parser.add_argument("--only", default="", metavar="TEXT", help="questions that contain the text")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page as well")
    options = parser.parse_args(arguments)
    if options.write is not None:
        writing.check(parser, options.write, NAME)
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as name:  # compiles the kernels, once for an installation
        tiny = Row("tiny", ring(2, 2), ours.TINY, "", "", {"tiny": "violated"}, ours.TIMEOUT)
        ask_us(tiny, Path(name))
    lines, wrong = [], False
    for row in rows():
        if options.only in row.name:
            try:
                lines.append(cells(row, measure(row, max(1, options.runs))))
            except (ChildFailed, Wrong) as error:
                wrong = True
                print(f"wrong: {error}", file=sys.stderr)
            else:
                print("  ".join(f"{cell:{width}}" for cell, width in zip(lines[-1], (16, 20, 20, 20), strict=True)))
    runs = "one run" if options.runs <= 1 else f"medians of {options.runs} runs"
    how = f"{runs}; load {load:.2f} before and {os.getloadavg()[0]:.2f} after"
    signed = writing.signature(NAME, how, *([] if missing(spin.NAME) else [spin.version()]))
    print(f"\nSeconds, CPU/wall: {', '.join(HEADINGS[1:])}; >: not within so many.\n{signed}")
    if options.write is not None and not wrong:
        writing.replace(options.write, NAME, f"{writing.markdown(HEADINGS, lines)}\n\n{signed}")
    return int(wrong or not lines)


if __name__ == "__main__":
    from benchmarks.table import with_bytecode

    sys.exit(with_bytecode(main))
