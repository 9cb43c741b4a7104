"""Bounded past in monitors beside reelay and rtamt: `python -m benchmarks.timescales [--get]`.

The properties are those of *timescales* (Ulus, Timescales: a benchmark generator for MTL monitoring tools, RV 2019),
with bounds of 10, 100 and 1000, and once within 10,000 steps. Each monitor reads letters that keep the property open,
then random ones, many or few of whose atoms hold; what the tools say after each letter must be the same. Nanoseconds of
processor time a step, the best of several runs: ours in machine code, from memory, and ours, reelay and rtamt a step at
a time from Python. `--get` installs both from PyPI, in an environment of their own beside the other oracles."""

from __future__ import annotations

import argparse
import itertools
import json
import random
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.measure import Wrong
from benchmarks.monitors import best, monitors_of, undecided
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.monitoring.lookup import WalkTable, walk_table
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict
from tools import oracles

PEER = Path(__file__).parent / "peers" / "mtl.py"
PACKAGES = {"reelay": "25.0.0", "rtamt": "0.4.10"}
BOUNDS = (10, 100, 1000)
FAR = 10_000
"""The bound of the last row."""

BETWEEN = "r && !q && O q -> "
OURS = {
    "AbsentAQ": "O[0:B] q -> (!p S q)",
    "AbsentBR": "r -> H[0:B] !p",
    "AbsentBQR": BETWEEN + "(!p S[A:B] q)",
    "AlwaysAQ": "O[0:B] q -> (p S q)",
    "AlwaysBR": "r -> H[0:B] p",
    "AlwaysBQR": BETWEEN + "(p S[A:B] q)",
    "RecurGLB": "O[0:B] p",
    "RecurBQR": BETWEEN + "(O[0:B] (p || q) S q)",
    "RespondGLB": "(s -> O[A:B] p) && (p -> X F[0:C] s)",
    "RespondBQR": BETWEEN + "(((s -> O[A:B] p) && !(H[0:C] !s && O[B:B] (!s S p))) S q)",
}
"""Without the `G` around them. Published are bounds from below alone, `!(!s S[B:] p)`, which we write otherwise; C is
B - 1."""
AFTER = "({r} and not {q} and once {q}) -> "
THEIRS = {
    "AbsentAQ": "(once[0:B] {q}) -> ((not {p}) since {q})",
    "AbsentBR": "{r} -> (historically[0:B] (not {p}))",
    "AbsentBQR": AFTER + "((not {p}) since[A:B] {q})",
    "AlwaysAQ": "(once[0:B] {q}) -> ({p} since {q})",
    "AlwaysBR": "{r} -> (historically[0:B] {p})",
    "AlwaysBQR": AFTER + "({p} since[A:B] {q})",
    "RecurGLB": "once[0:B] {p}",
    "RecurBQR": AFTER + "((once[0:B] ({p} or {q})) since {q})",
    "RespondGLB": "({s} -> once[A:B] {p}) and not ((not {s}) since[B:] {p})",
    "RespondBQR": AFTER + "((({s} -> once[A:B] {p}) and not ((not {s}) since[B:] {p})) since {q})",
}
"""As published, without the `historically` around them."""
STEPS = {"reelay": 20_000, "rtamt": 2_000}
"""Letters that a peer reads while its time is measured: so many take some hundredths of a second."""


LONGEST = 2_500
"""Letters of each of the two parts of a word on which the tools are compared; rtamt takes 0.1 ms for one."""


@dataclass(frozen=True, slots=True)
class Row:
    """One property: states, bytes of the tables, and nanoseconds a step; or why there is no monitor."""

    name: str
    failed: str = ""
    states: int = 0
    size: int = 0
    seconds: float = 0.0
    """To make it."""
    machine_code: float = 0.0
    python: float = 0.0
    peers: Mapping[str, str] = field(default_factory=dict)


def python() -> Path:
    """The interpreter of the environment that has the peers."""
    return oracles.folder() / "-".join(["mtl", *PACKAGES.values()]) / "bin" / "python"


def get() -> None:
    """Install the peers. CalledProcessError when that fails."""
    subprocess.run([sys.executable, "-m", "venv", str(python().parents[1])], check=True)
    packages = [f"{name}=={version}" for name, version in PACKAGES.items()]
    subprocess.run([str(python()), "-m", "pip", "install", "--quiet", *packages], check=True)


def with_bounds(formula: str, bound: int) -> str:
    """The formula with numbers in the places of B, of A, three tenths of it, and of C, one less."""
    numbers = {"A": 3 * bound // 10, "B": bound, "C": bound - 1}
    return "".join(str(numbers.get(c, c)) if formula[i - 1] in "[:" else c for i, c in enumerate(formula))


def stream(monitor: Monitor, letters: Sequence[int]) -> list[bool]:
    """Whether the property is not lost after each letter."""
    state, found = 0, []
    for letter in letters:
        state = monitor.step(state, letter)
        found.append(monitor.verdicts[state] is not MonitorVerdict.FALSE)
    return found


def table_bytes(table: WalkTable) -> int:
    """Of the tables in machine code: the smallest numbers that hold their entries."""
    return sum(len(s) * (1 if max(s) < 1 << 8 else 2 if max(s) < 1 << 16 else 4) for s in table.stages)


def walked(table: WalkTable, letters: Sequence[int]) -> None:
    """The monitor, a step at a time in Python."""
    number = table.numbers[0]
    for letter in letters:
        number = table.step(number, letter)


def ask(tool: str, formula: str, atoms: Sequence[str], letters: Sequence[int], runs: int) -> dict[str, object]:
    """What a peer says. CalledProcessError when it cannot be started."""
    asked = {"formula": formula, "atoms": atoms, "letters": letters, "runs": runs}
    done = subprocess.run([str(python()), str(PEER), tool], input=json.dumps(asked), capture_output=True, text=True,
                          check=True)  # fmt: skip
    answer: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    return answer


def in_words_of(tool: str, formula: str, atoms: Sequence[str]) -> str:
    """A formula for one of the peers. In rtamt, which has no Boolean variables, one holds where it is positive."""
    for name in atoms if tool == "rtamt" else ():
        formula = formula.replace(f"{{{name}}}", f"({name} > 0)")
    return f"historically({formula})"


def compare(name: str, bound: int, monitor: Monitor, letters: Sequence[int], runs: int) -> dict[str, str]:
    """Nanoseconds of each peer, or why it has none. Wrong: it says what we do not."""
    found = {}
    source = random.Random(bound)
    for tool, steps in STEPS.items():
        formula = in_words_of(tool, with_bounds(THEIRS[name], bound), monitor.atoms)
        answer = ask(tool, formula, monitor.atoms, letters[:steps], runs)
        if "failed" in answer:
            found[tool] = "not in its language"
            continue
        found[tool] = f"{answer['ns']:,.0f}"
        # A property that is lost stays lost: the interesting letters are those until then.
        for often, open_letters in itertools.product((0.5, 1 / bound), (0, 3 * bound)):
            some = range(min(2 * bound + 50, LONGEST))
            rest = [sum((source.random() < often) << i for i, _ in enumerate(monitor.atoms)) for _ in some]
            word = [*letters[: min(open_letters, LONGEST)], *rest]
            if ask(tool, formula, monitor.atoms, word, 1)["stream"] != stream(monitor, word):
                raise Wrong(f"{name}{bound}: {tool} says what we do not")
    return found


def row(name: str, bound: int, count: int, runs: int, *, peers: bool) -> Row:
    """One line of the table. Raises Wrong."""
    key = f"{name}{bound}"
    begin = time.process_time()
    try:
        _, monitors = monitors_of(f"property: G ({with_bounds(OURS[name], bound)})")
    except AutomatonTooLarge:
        return Row(key, "no monitor: too many states")
    monitor = monitors["property"]
    seconds = time.process_time() - begin
    letters = undecided(monitor, count, random.Random(1))
    compiled, table = CompiledMonitors({key: monitor}), walk_table(monitor)
    data = compiled.pack(letters)
    code = best(lambda: (compiled.reset(), compiled.feed(data)), count, runs)
    few = letters[: max(STEPS.values())]
    alone = best(lambda: walked(table, few), len(few), runs)
    found = compare(name, bound, monitor, letters, runs) if peers else {}
    return Row(key, "", len(monitor.edges), table_bytes(table), seconds, code, alone, found)


def main(arguments: list[str] | None = None) -> int:
    """Print the table; exit code 1 when a peer disagrees."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--get", action="store_true", help="install reelay and rtamt from PyPI")
    parser.add_argument("--letters", type=int, default=1_000_000, help="that we read (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=3, help="runs, of which the best counts (default: %(default)s)")
    parser.add_argument("--bounds", type=int, nargs="+", default=[*BOUNDS, FAR], help="(default: %(default)s)")
    options = parser.parse_args(arguments)
    if options.get:
        get()
    there = python().exists()
    columns = "".join(f"{name:>22}" for name in PACKAGES) if there else "   (no peers: --get installs them)"
    print(
        f"{'property':16}{'states':>7}{'bytes':>9}{'s to make':>10}{'ours':>7}{'from Python':>13}{columns}   ns a step"
    )
    wrong = False
    for bound in options.bounds:
        for name in OURS if bound != FAR else ["RecurGLB"]:
            try:
                found = row(name, bound, options.letters, options.runs, peers=there)
            except Wrong as error:
                wrong = True
                print(f"wrong: {error}", file=sys.stderr)
                continue
            ours = (
                f"{found.states:7,}{found.size:9,}{found.seconds:10.2f}{found.machine_code:7.1f}{found.python:13,.0f}"
            )
            peers = "".join(f"{found.peers.get(tool, ''):>22}" for tool in PACKAGES)
            print(f"{found.name:16}{found.failed or ours}{peers}", flush=True)
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
