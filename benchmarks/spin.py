"""SPIN on a task: `spin -a`, `gcc -O2`, and the verifier once for each property, with enough stack and table."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from benchmarks.children import ChildFailed, Usage, expect, run
from benchmarks.measure import Measurement, Wrong
from benchmarks.tasks import Peer, Task
from tools import oracles

NAME = "SPIN"
TIMEOUT = 900
MEGABYTES = 16_000
"""What the verifier may take; beyond that it gives up, and says so."""
CUT_SHORT = ("max search depth too small", "-DMEMLIM bound", "out of memory", "memory exhausted", "hash table full")


def missing() -> str | None:
    """Which of the programs needed is not installed."""
    return next((name for name in ("spin", "gcc") if oracles.find(name) is None), None)


def version() -> str:
    """What SPIN and the compiler call themselves."""
    spin = run(["spin", "-V"], timeout=60).output.partition(" -- ")[0].split()[-1]
    return f"SPIN {spin}, gcc {run(['gcc', '-dumpfullversion'], timeout=60).output.strip()} -O2"


def measure(task: Task, peer: Peer, folder: Path) -> Measurement:
    """One measurement; files go to `folder`. One verifier is built for all claims. Raises Wrong and ChildFailed."""
    build = _build(peer, folder)
    verifier = ["./pan", f"-m{peer.depth}", f"-w{peer.table}"]
    idle = run(["./pan", "-m10", "-w10"], timeout=TIMEOUT, cwd=folder).peak
    runs: list[Usage] = []
    states = transitions = 0
    verdicts: dict[str, str] = {}
    for claim in peer.claims or (None,):
        command = verifier if claim is None else [*verifier, "-a", "-N", claim]
        done = expect(run(command, timeout=TIMEOUT, cwd=folder), command, 0)
        runs.append(done)
        stored, steps, errors = read(done.output)
        states += stored
        transitions += steps
        if claim is not None:
            verdicts[claim] = "violated" if errors else "holds"
        elif errors:
            raise Wrong(f"{task.key}: {NAME} found {errors} errors")
    if peer.states is not None and states != peer.states:
        raise Wrong(f"{task.key}: {NAME} found {states} states instead of {peer.states}")
    if verdicts != task.verdicts:
        raise Wrong(f"{task.key}: {NAME} says {verdicts} instead of {dict(task.verdicts)}")
    wall, cpu = sum(r.wall for r in runs), sum(r.cpu for r in runs)
    build_wall, build_cpu = sum(b.wall for b in build), sum(b.cpu for b in build)
    peak = max(runs, key=lambda r: r.peak).peak
    return Measurement(
        NAME, states, transitions, verdicts, build_wall + wall, build_cpu + cpu, wall, cpu, build_cpu, peak - idle
    )


def _build(peer: Peer, folder: Path) -> list[Usage]:
    shutil.copy(peer.model, folder / "model.pml")
    # -o2: variables that are only written are kept, so that states are counted as everybody else does.
    generate = ["spin", "-a", "-o2", *peer.defines, "model.pml"]
    # One process: there is nothing to reduce, and trying costs time.
    safety = () if peer.claims else ("-DSAFETY",)
    translate = ["gcc", "-w", "-O2", *safety, "-DNOREDUCE", f"-DMEMLIM={MEGABYTES}", "-o", "pan", "pan.c"]
    return [expect(run(command, timeout=TIMEOUT, cwd=folder), command, 0) for command in (generate, translate)]


def read(report: str) -> tuple[int, int, int]:
    """States, transitions and errors in a verifier's report.

    Raises Wrong when it was cut short: what it then says about the whole space is not known to be true.
    """
    for words in CUT_SHORT:
        if words in report:
            raise Wrong(f"{NAME} did not search everything: {words}")
    numbers = []
    for pattern in (r"(\d+) states, stored", r"(\d+) transitions", r"errors: (\d+)"):
        found = re.search(pattern, report)
        if found is None:
            raise ChildFailed(f"this is no report of a verifier made by {NAME}:\n{report[-2000:]}")
        numbers.append(int(found[1]))
    stored, steps, errors = numbers
    if not errors and "Search not completed" in report:
        raise Wrong(f"{NAME} did not search everything")
    return stored, steps, errors
