"""NuSMV on our exported models, three ways: decision diagrams, bounded model checking, k-induction of invariants."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.children import ChildFailed, TooLong, expect, run
from tools import oracles

ROOT = Path(__file__).parents[1]
WAYS = ("NuSMV diagrams", "NuSMV bmc", "NuSMV induction")
BMC_DEPTH, INDUCTION_DEPTH = 60, 30
"""Those of our engines."""
SPECIFICATION = re.compile(r"^LTLSPEC NAME (\w+) := (.*);$", re.MULTILINE)
MARK = "@@"


@dataclass(frozen=True, slots=True)
class Answer:
    """Of one way: seconds from the shell and the verdicts by property, or why there are none."""

    seconds: float
    verdicts: Mapping[str, str]
    failed: str = ""


def missing() -> bool:
    """NuSMV is not installed."""
    return oracles.find("nusmv") is None


def exported(arrangement: Path, lines: Path, model: Path) -> bool:
    """Write the model; False: it cannot be written in NuSMV's language, which has no integers without bounds."""
    command = [sys.executable, "-m", "llfsm_verify", "kripke", str(arrangement), str(lines), "--format", "smv"]
    command += ["-o", str(model)]
    return expect(run(command, timeout=300, cwd=ROOT), command, 0, 3).code == 0


def asked(way: str, model: Path, timeout: float) -> Answer:
    """What NuSMV says within so many seconds. Raises ChildFailed."""
    specifications = SPECIFICATION.findall(model.read_text(encoding="utf-8"))
    script = model.with_suffix(".cmd")
    script.write_text("\n".join(commands(way, model.name, specifications)) + "\n", encoding="utf-8")
    # Wide ranges are deep decision diagrams, and it crashes where its stack is short.
    program = shlex.quote(str(oracles.find("nusmv")))
    command = ["sh", "-c", f"ulimit -s unlimited 2>/dev/null; exec {program} -dcx -source {script.name}"]
    try:
        done = run(command, timeout=timeout, cwd=model.parent)
    except TooLong:
        return Answer(timeout, {}, f"more than {timeout:.0f} s")
    if done.code < 0:
        return Answer(done.wall, {}, f"crashed (signal {-done.code})")
    expect(done, command, 0)
    if "aborting" in done.output + done.errors:  # a command that it did not understand, and nothing after that was done
        raise ChildFailed(f"NuSMV did not go through its script:\n{(done.output + done.errors)[-1000:]}")
    return Answer(done.wall, read(done.output, [name for name, _ in specifications]))


def commands(way: str, model: str, specifications: Sequence[tuple[str, str]]) -> list[str]:
    """The lines of a script that asks about each specification, a name and a formula."""
    lines = [f"read_model -i {model}", "go" if way == WAYS[0] else "go_bmc"]
    for name, formula in specifications:
        lines.append(f"echo {MARK}{name}")
        inside = invariant(formula)
        if way == WAYS[0]:
            lines.append(f'check_ltlspec -P "{name}"')
        elif way == WAYS[1]:
            lines.append(f'check_ltlspec_bmc_inc -k {BMC_DEPTH} -P "{name}"')
        elif inside is not None:
            lines.append(f'check_invar_bmc -a een-sorensson -k {INDUCTION_DEPTH} -p "{inside}"')
    return [*lines, "quit"]


def invariant(formula: str) -> str | None:
    """What holds always, of `G` of a formula without temporal operators; None: it is none such."""
    found = re.fullmatch(r"\(G (.*)\)", formula)
    if found is None or re.search(r"\b[GFXURWVM]\b", found[1]):
        return None
    return found[1]


def read(output: str, names: Sequence[str]) -> dict[str, str]:
    """The verdicts in what a script has printed. What is neither true nor false is unknown."""
    verdicts = dict.fromkeys(names, "unknown")
    for part in output.split(MARK)[1:]:
        name = part.split(None, 1)[0]
        found = re.search(r"^-- (?:specification|invariant) .* is (true|false)$", part, re.MULTILINE)
        if found is not None:
            verdicts[name] = {"true": "holds", "false": "violated"}[found[1]]
    return verdicts
