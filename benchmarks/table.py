"""The table of `make bench`: llfsm-verify beside SPIN and plain Python, on the same questions, answers checked.

`python -m benchmarks.table [--quick] [--all] [--json] [--runs N] [--only TEXT] [--write PAGE]`. Tools take turns, so
that what else the computer does hits all of them. The exit code is 1 when an answer is not the one that is known to be
right; nothing is written then.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict
from pathlib import Path

from benchmarks import ours, spin, writing
from benchmarks.children import ChildFailed, expect, run
from benchmarks.measure import Measurement, Wrong, medians
from benchmarks.tasks import Task, tasks

ROOT = Path(__file__).parents[1]
NAME = "benchmarks.table"
NAIVE = "Python dictionary"
TIMEOUT = 900

HEADINGS = (
    "question", "tool", "states", "transitions", "build CPU", "whole wall", "whole CPU", "search wall", "search CPU",
    "states/CPU s", "bytes/state", "whole", "search",
)  # fmt: skip
FRONT = [
    "question", "states", "ours: whole, search", "bytes a state", "two jobs: whole, search", "bytes a state",
    "SPIN: whole, search", "bytes a state", "plain Python",
]  # fmt: skip
"""Of the table in docs/benchmarks.md."""
FEW = 100_000
"""Below so many states, neither their rate nor their size says anything."""


def naive(task: Task, root: Path) -> Measurement:
    """The search in plain Python, in a process of its own. Raises Wrong and ChildFailed."""
    command = [sys.executable, "-m", "benchmarks.naive", *task.naive]
    done = expect(run(command, timeout=TIMEOUT, cwd=root), command, 0)
    idle = expect(run([*command[:3], "ring", "2", "2"], timeout=TIMEOUT, cwd=root), command, 0)
    found = json.loads(done.output)
    if found["states"] != task.states:
        raise Wrong(f"{task.key}: plain Python found {found['states']} states instead of {task.states}")
    return Measurement(
        NAIVE, found["states"], found["transitions"], {}, done.wall, done.cpu, found["wall"], found["cpu"], 0.0,
        max(0, done.peak - idle.peak),
    )  # fmt: skip


def measure(task: Task, runs: int, with_spin: bool, all_runs: bool) -> list[Measurement]:
    """Medians for each tool, ours first. Raises Wrong and ChildFailed."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        tools: list[tuple[Callable[[], Measurement], int]] = [(lambda: ours.measure(task, folder, ROOT), runs)]
        if task.shared:
            tools.append((lambda: ours.measure(task, folder, ROOT, shared=True), runs))
        peer = task.peer
        if with_spin and peer is not None:
            tools.append((lambda: spin.measure(task, peer, folder), 1 if task.once and not all_runs else runs))
        if task.naive:
            tools.append((lambda: naive(task, ROOT), runs))
        found: list[list[Measurement]] = [[] for _ in tools]
        for turn in range(runs):
            for (tool, times), results in zip(tools, found, strict=True):
                if turn < times:
                    results.append(tool())
        return [medians(results) for results in found]


def rows(task: Task, measured: list[Measurement], with_spin: bool) -> Iterator[tuple[str, ...]]:
    """Cells, one row a tool; the last two say how many times as long as ours the whole and the search took."""
    mine = measured[0]
    for m in measured:
        many = m.states >= FEW
        ratios = (
            ("", "") if m is mine else (_times(m.whole_cpu / mine.whole_cpu), _times(m.search_cpu / mine.search_cpu))
        )
        yield (
            task.key if m is mine else "", m.tool, _count(m.states), _count(m.transitions),
            f"{m.build_cpu:.2f}" if m.build_cpu else "", f"{m.whole_wall:.2f}", f"{m.whole_cpu:.2f}",
            f"{m.search_wall:.3f}", f"{m.search_cpu:.3f}",
            f"{m.rate:,.0f}" if many else "", f"{m.bytes_each:.0f}" if many else "", *ratios,
        )  # fmt: skip
    if task.peer is not None and not with_spin:
        yield ("", f"SPIN: {spin.missing()} is not installed", *[""] * (len(HEADINGS) - 2))


def _times(ratio: float) -> str:
    return f"{ratio:.1f}x"


def _count(number: int) -> str:
    return f"{number:,}" if number else ""


def front(results: Iterable[tuple[Task, list[Measurement]]]) -> str:
    """The table of docs/benchmarks.md: the rows that are for it, in Markdown."""
    lines = []
    for task, (mine, *others) in results:
        if task.front:
            by_tool = {m.tool: m for m in others}
            peer, naive, shared = by_tool.get(spin.NAME), by_tool.get(NAIVE), by_tool.get(ours.SHARED)
            lines.append([
                f"{task.name}, {task.question}", _count(mine.states), f"{mine.whole_cpu:.2f}, {mine.search_cpu:.2f}",
                _bytes(mine), _faster(mine, shared), _bytes(shared), _beside(mine, peer), _bytes(peer),
                _beside(mine, naive),
            ])  # fmt: skip
    return writing.markdown(FRONT, lines)


def _bytes(m: Measurement | None) -> str:
    return "" if m is None or m.states < FEW else f"{m.bytes_each:.0f}"


def _faster(mine: Measurement, shared: Measurement | None) -> str:
    """How many times as fast two jobs are on the clock."""
    if shared is None:
        return ""
    return f"{mine.whole_wall / shared.whole_wall:.2f}×, {mine.search_wall / shared.search_wall:.2f}×"


def _beside(mine: Measurement, other: Measurement | None) -> str:
    """How many times as much processor time as ours another tool took."""
    if other is None:
        return ""
    return f"{other.whole_cpu / mine.whole_cpu:.1f}×, {other.search_cpu / mine.search_cpu:.1f}×"


def lay_out(cells: list[tuple[str, ...]]) -> str:
    """Columns as wide as needed: words to the left, numbers to the right."""
    columns = []
    for number, column in enumerate(zip(HEADINGS, *cells, strict=True)):
        width = max(map(len, column))
        columns.append([text.ljust(width) if number < 2 else text.rjust(width) for text in column])
    return "\n".join("  ".join(line).rstrip() for line in zip(*columns, strict=True))


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.table", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="one ring of 4 machines, one run")
    parser.add_argument("--all", action="store_true", help="repeat SPIN's longest runs too")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.add_argument("--runs", type=int, default=3, help="runs of which medians are shown (default: 3)")
    parser.add_argument("--only", default="", metavar="TEXT", help="questions that contain the text")
    parser.add_argument(
        "--write", type=Path, metavar="PAGE", help="put the table of docs/benchmarks.md into this page as well"
    )
    options = parser.parse_args(arguments)
    if options.write is not None:
        writing.check(parser, options.write, NAME)
    runs = 1 if options.quick else max(1, options.runs)
    lacking = spin.missing()
    chosen = [t for t in tasks(range(4, 5 if options.quick else 8), ROOT) if options.only in t.key]
    about = {
        "tools": f"Python {platform.python_version()}" + ("" if lacking else f", {spin.version()}"),
        "processors": os.cpu_count() or 0,
        "runs": runs,
        "load before": round(os.getloadavg()[0], 2),
    }
    results: list[tuple[Task, list[Measurement]]] = []
    wrong: list[str] = []
    for task in chosen:
        if sys.stderr.isatty():
            print(task.key, end="\033[K\r", file=sys.stderr)
        try:
            results.append((task, measure(task, runs, lacking is None, options.all)))
        except (Wrong, ChildFailed) as error:
            wrong.append(str(error))
            print(f"wrong: {error}", file=sys.stderr)
    about["load after"] = round(os.getloadavg()[0], 2)
    if options.json:
        objects = [{"question": t.key, **asdict(m), "bytes_each": m.bytes_each} for t, found in results for m in found]
        print(json.dumps({**about, "missing": lacking, "wrong": wrong, "rows": objects}, indent=2))
    else:
        print(lay_out([row for task, found in results for row in rows(task, found, lacking is None)]))
        print("\n" + ", ".join(f"{name}: {value}" for name, value in about.items()))
        print("Seconds; medians. The last two columns: how many times as much processor time as llfsm-verify.")
    if wrong or not results:
        return 1
    if options.write is not None:
        how = f"medians of {runs} runs" if runs > 1 else "one run"
        if any(m.runs < runs for _, found in results for m in found):
            how += ", of SPIN's longest one"
        how += f"; load {about['load before']} before and {about['load after']} after"
        tools = [f"without SPIN: {lacking} is not installed" if lacking else spin.version()]
        body = f"{front(results)}\n\n{writing.signature(NAME, how, *tools)}"
        writing.replace(options.write, NAME, body)
    return 0


def with_bytecode(main: Callable[[], int]) -> int:
    """`main`, where Python may keep what it compiled, as it does for users, also when the caller forbids it."""
    if not os.environ.pop("PYTHONDONTWRITEBYTECODE", None):
        return main()
    with tempfile.TemporaryDirectory() as folder:
        os.environ["PYTHONPYCACHEPREFIX"] = folder
        return main()


if __name__ == "__main__":
    sys.exit(with_bytecode(main))
