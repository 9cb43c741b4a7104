"""A sweep's checks in one process, with one worker and with two, side by side: what workers cost, and what they give.

`python -m benchmarks.sweep` performs 100 checks of the traffic lights in each way, in turns, and prints medians in
seconds of wall time, and how many times as fast two workers are as one, both with the start of their processes. *a
task's overhead* is the processor time that a task takes with one worker, here and there, beyond the same check by
`Model.check` in one process, again and again: that is little changed by other programs. `--cluster` also performs them
on a scheduler of Dask with two workers on this computer, if `distributed` is installed. `--json` prints the figures.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

from llfsm_verify import load
from llfsm_verify.extensions.sweep.task import Task
from llfsm_verify.extensions.sweep.worker import guarded
from llfsm_verify.plug import SCHEDULERS

ROOT = Path(__file__).parents[1]
ARRANGEMENTS = ("arrangement.yaml", "faulty.yaml")
FOLDER, PROPERTIES = ROOT / "models" / "traffic_lights", ROOT / "properties" / "traffic_lights.ltl"


def tasks(number: int) -> list[Task]:
    """So many checks."""
    files = (*((p.name, p.read_text()) for p in sorted(FOLDER.glob("*.yaml"))), ("asked.ltl", PROPERTIES.read_text()))
    return [
        Task(str(n), files, ARRANGEMENTS[n % len(ARRANGEMENTS)], ("asked.ltl",), (), (), None, None)
        for n in range(number)
    ]


@dataclass(frozen=True, slots=True)
class Took:
    """Seconds."""

    wall: float
    cpu: float = 0.0
    """Of all processes, since the workers have begun."""
    start: float = 0.0
    """Of the wall time, until the workers have begun."""


def checked(task: Task) -> tuple[str, float]:
    """What a worker does: perform, and say how the task ended and what its process has used so far."""
    return guarded(task).state, time.process_time()


def bare(given: Iterable[Task]) -> Took:
    """The checks in this process, with the traces that they save."""
    started, cpu = time.perf_counter(), time.process_time()
    with TemporaryDirectory() as folder:
        for task in given:
            result = load(FOLDER / task.arrangement).check(PROPERTIES, jobs=1)
            Path(folder, "result.json").write_text(result.to_json())
            for item in result:
                for trace in item.traces:
                    trace.save(Path(folder, f"{item.name}.trace.yaml"))
    return Took(time.perf_counter() - started, time.process_time() - cpu)


def performed(given: list[Task], address: str, workers: int) -> Took:
    """A sweep of them. Its processor time is that of all processes where there is one worker."""
    from benchmarks.sweep import checked  # workers do not import the main module

    warm = tasks(workers * len(ARRANGEMENTS))
    found: list[tuple[str, float]] = []
    started = time.perf_counter()
    scheduler = SCHEDULERS.load(address.partition("://")[0])(address, workers)
    try:
        scheduler.run(checked, warm, lambda _, end: found.append(end))
        before = max(used for _, used in found)
        begun, cpu = time.perf_counter(), time.process_time()
        scheduler.run(checked, iter(given), lambda _, end: found.append(end))
        here = time.process_time() - cpu
    finally:
        scheduler.close()
    wall = time.perf_counter() - started
    if len(found) != len(given) + len(warm) or any(state != "done" for state, _ in found):
        raise SystemExit(f"{len(found)} of {len(given) + len(warm)} tasks ended, some in another way than they should")
    there = max(used for _, used in found) - before
    return Took(wall, here + there, begun - started)


def measured(number: int, rounds: int, cluster: str | None = None) -> Mapping[str, float]:
    """Seconds by what was done, and what follows of them."""
    given = tasks(number)
    ways: dict[str, Callable[[], Took]] = {
        "one process": lambda: bare(given),
        "one worker": lambda: performed(given, "processes", 1),
        "two workers": lambda: performed(given, "processes", 2),
    }
    if cluster is not None:
        ways["two workers of Dask"] = lambda: performed(given, cluster, 2)
    bare(given[: len(ARRANGEMENTS)])  # kernels are compiled, and modules imported
    runs = [{name: way() for name, way in ways.items()} for _ in range(rounds)]
    found = {name: median(run[name].wall for run in runs) for name in ways}
    found["start of one worker"] = median(run["one worker"].start for run in runs)
    found["times as fast with two workers"] = median(run["one worker"].wall / run["two workers"].wall for run in runs)
    overheads = (1000 * (run["one worker"].cpu - run["one process"].cpu) / number for run in runs)
    found["a task's overhead, ms"] = median(overheads)
    return found


def main(words: list[str]) -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--number", type=int, default=100, help="checks (default: 100)")
    parser.add_argument("--rounds", type=int, default=5, help="rounds (default: 5)")
    parser.add_argument("--cluster", action="store_true", help="also with a scheduler of Dask")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    options = parser.parse_args(words)
    with ExitStack() as stack:
        address = None
        if options.cluster:
            from tests.extensions.cluster.dask_cluster import DaskCluster

            cluster = stack.enter_context(DaskCluster(Path(stack.enter_context(TemporaryDirectory()))))
            cluster.start("one", "two")
            address = cluster.address
        found = measured(options.number, options.rounds, address)
    if options.json:
        print(json.dumps(found))
        return 0
    for name, figure in found.items():
        print(f"{name:34} {figure:8.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
