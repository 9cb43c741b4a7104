"""What guards cost, for the table of `benchmarks.running`: a cycle with a guard and without, beside a rospy node that
relays messages and monitors them; how soon a switch acts; and what a check before loading does to a loop that runs.
"""

from __future__ import annotations

import os
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

import llfsm_verify as lv
from llfsm_verify.cli import main as llfsm
from llfsm_verify.runtime.live.run import Lateness
from llfsm_verify.runtime.whiteboard.permissions import user_name

ROOT = Path(__file__).parents[1]
STROLL = ROOT / "models" / "komodo_stroll"
RULE = "gentle: G !(motion == FORWARD && X motion == BACKWARD)"
"""The robot never turns round without a stop: strolls break it."""
CYCLE_MS, LAP = 10, 100


@dataclass(frozen=True, slots=True)
class Study:
    """A case study of which a machine is replaced by itself, again and again."""

    model: str
    machine: str
    file: str
    arrangement: str = "arrangement.yaml"
    level: str = ""
    """The clearance that who replaces it needs."""

    def text(self, written: str) -> str:
        """The arrangement in which we may replace the machine."""
        replace = f"replace: [{self.machine}]"
        if self.level:
            written = written.replace("access:\n", f"access:\n  users: {{{user_name(os.getuid())}: {self.level}}}\n")
        if "operators: {" in written:
            return written.replace("operators: {", f"operators: {{{replace}, ", 1)
        return f"{written}operators: {{{replace}}}\n"


STUDIES = (
    Study("traffic_lights", "ns", "light.machine.yaml"),
    Study("microwave", "timer", "timer.machine.yaml"),
    Study("komodo_region", "stroll", "stroll.machine.yaml", "stroll.yaml"),
    Study("takeover", "monitor", "monitor.machine.yaml", level="monitoring"),
    Study("xray", "treatment", "treatment.machine.yaml"),
    Study("batman", "avoid", "avoid.machine.yaml"),
)


@contextmanager
def strolls() -> Iterator[tuple[Path, Path]]:
    """The arrangement of the Komodo stroll as it is, and with a guard."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / "guarded"
        arguments = ["guard", str(STROLL / "arrangement.yaml"), "-p", RULE, "--fallback", "motion=TOT_STOP"]
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()) as told:
            code = llfsm([*arguments, "-o", str(target)])
        assert code == 0, told.getvalue()
        yield STROLL / "arrangement.yaml", target / "arrangement.yaml"


def broken_to_switch(guarded: Path, cycles: int) -> tuple[int, int]:
    """How often the stroll broke the rule in so many cycles, and after how many cycles the switch acted, at most.

    `cycles` of simulated runs of a hundred each, since the alarm stays set; 0 is the cycle in which the rule is broken.
    """
    model = lv.load(guarded).start(seed=0)
    before, broken, worst, waiting = "TOT_STOP", 0, 0, None
    for cycle in range(cycles):
        if cycle % LAP == 0:
            simulation, before = model.anew(cycle), "TOT_STOP"
        simulation.cycle({})
        requested, done = simulation.values["motion_requested"], simulation.values["motion"]
        if before == "FORWARD" and requested == "BACKWARD" and waiting is None:
            waiting, broken = cycle, broken + 1
        if waiting is not None and done == "TOT_STOP":
            worst, waiting = max(worst, cycle - waiting), None
        assert not (before == "FORWARD" and done == "BACKWARD"), "the guard does not keep its rule"
        before = str(done)
    return broken, worst


def chain(
    turns: int,
    count: int,
    looping: Callable[..., AbstractContextManager[Callable[[int], float]]],
    load: Callable[[Path], object],
) -> dict[str, float]:
    """Seconds of a cycle of the stroll without its guard and with it, with frames."""
    found: dict[str, list[float]] = {"alone": [], "guarded": []}
    with strolls() as (alone, guarded), ExitStack() as left:
        one, other = (left.enter_context(looping(load(path), frames=True)) for path in (alone, guarded))
        for _ in range(turns):
            found["alone"].append(one(count))
            found["guarded"].append(other(count))
    return {name: statistics.median(values) for name, values in found.items()}


def checked(study: Study, seconds: float) -> tuple[list[float], Lateness, Lateness]:
    """Seconds from each question whether a machine may be loaded to its answer, asked for so many seconds one after
    the other beside a loop of 10 ms; how late its cycles began, and those of the same loop that is asked nothing."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary) / study.model
        shutil.copytree(ROOT / "models" / study.model, folder)
        path = folder / study.arrangement
        path.write_text(study.text(path.read_text()))
        model = lv.load(path)
        rate = float(model.wrapped.cycle_ms or 0) / CYCLE_MS
        answers: list[float] = []
        with model.run(simulate=True, seed=1, rate=rate, processes="separate") as run:
            run.replace(study.machine, folder / study.file)  # what is compiled once is compiled
            until = time.monotonic() + seconds
            while not answers or time.monotonic() < until:
                begin = time.monotonic()
                run.replace(study.machine, folder / study.file)
                answers.append(time.monotonic() - begin)
            run.stop()
            asked = run.wait().lateness
        with model.run(simulate=True, seed=1, rate=rate, processes="separate") as run:
            time.sleep(max(seconds, sum(answers)))
            run.stop()
            alone = run.wait().lateness
        assert asked is not None
        assert alone is not None
        return answers, asked, alone


def rows(
    cycle: Mapping[str, float],
    way: Mapping[str, float],
    seconds: float,
    cycles: int,
    duration: Callable[[float], str],
    studies: Sequence[Study] = STUDIES,
) -> Iterator[list[str]]:
    """The rows of the table. `cycle` is what `chain` gives, `way` what rospy takes, with a relay and without."""
    beside = ""
    if way:
        more = way["relayed"] - way["way"]
        direct, relayed = duration(way["way"]), duration(way["relayed"])
        beside = f"rospy: {direct} from node to node, {relayed} by way of a node that monitors, {duration(more)} more"
    yield ["a cycle of the Komodo stroll", duration(cycle["alone"]), ""]
    extra = cycle["guarded"] - cycle["alone"]
    yield [
        "the same with a guard (monitor and switch)",
        f"{duration(cycle['guarded'])}, {duration(extra)} more",
        beside,
    ]
    with strolls() as (_, guarded):
        broken, worst = broken_to_switch(guarded, cycles)
    most = duration(cycle["guarded"])
    what = f"{worst} cycles after it (of {broken} times), so within {most} of the cycle in which it happens"
    yield ["from a rule that is broken to the switch", what, ""]
    for study in studies:
        what = f"check before loading: {study.machine} of {study.model}"
        try:
            answers, asked, alone = checked(study, seconds)
        except ValueError as refused:
            yield [what, f"refused: {refused}", ""]
            continue
        late = {p: (dict(asked.percentiles)[p], dict(alone.percentiles)[p]) for p in (99,)}
        told = (
            f"{duration(statistics.median(answers))} to a verdict ({len(answers)} checks); lateness of 10 ms cycles: "
        )
        told += ", ".join(f"{p} % {duration(a / 1e9)}" for p, (a, _) in late.items())
        told += f", worst {duration(asked.worst / 1e9)}"
        without = ", ".join(f"{p} % {duration(b / 1e9)} ({a / b:.2g} times)" for p, (a, b) in late.items())
        without += f", worst {duration(alone.worst / 1e9)} ({asked.worst / alone.worst:.2g} times)"
        yield [what, told, f"without checks: {without}"]
