"""The table of `make bench-running`: runs and whiteboards beside ROS 1, Python's queues and raw shared memory.

`python -m benchmarks.running [--quick] [--runs N] [--write PAGE]`. All rows are measured in one run, in turns, so that
what else the computer does hits all of them; figures are medians of the turns.
"""

from __future__ import annotations

import argparse
import ctypes
import mmap
import multiprocessing
import os
import queue
import select
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path

from benchmarks import guarding, ros, writing
from llfsm_verify.arrangement.loader import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.monitoring.properties import monitor_properties
from llfsm_verify.runtime.launch import serve
from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.frame import COMMITTED
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.runtime.live.run import Lateness
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.whiteboard.client import Whiteboard
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.segment import Attached
from llfsm_verify.runtime.whiteboard.server import Server
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower

NAME = "benchmarks.running"
ROOT = Path(__file__).parents[1]
LIGHTS = str(ROOT / "models" / "traffic_lights" / "arrangement.yaml")
HEADINGS = ["what", "ours", "beside it"]
SEEDS = "get_Message 0.0024 µs, add_Message 0.0120 µs; ROS subscribe() 20.14 µs, publish() 20.87 µs"
"""The table on the slides of clfsm, measured on another computer."""
SLOTS = 32


def machines(count: int, *, inputs: int = 0, outputs: int = 0) -> Arrangement:
    """So many machines that change state each turn; the first one also reads inputs and writes outputs."""
    board = {f"x{i}": {"type": "uint8", "role": "input", "init": 0} for i in range(SLOTS)}
    board |= {f"o{i}": {"type": "uint8", "init": 0} for i in range(SLOTS)}
    work = "".join(f"o{i} = 255 - o{i};" for i in range(outputs))
    work += "".join(f"n = x{i};" for i in range(inputs))

    def machine(name: str, actions: str) -> dict[str, object]:
        states = [
            {"name": here, "on_entry": actions, "transitions": [{"when": "true", "to": there}]}
            for here, there in (("A", "B"), ("B", "A"))
        ]
        return {"machine": name, "variables": {"n": {"type": "uint8", "init": 0}}, "states": states}

    named = {f"m{i}": {"inline": machine(f"M{i}", work if i == 0 else "")} for i in range(count)}
    return build_arrangement(
        {"name": "bench", "cycle_ms": 1, "whiteboard": board, "machines": named, "schedule": list(named)}
    )


@contextmanager
def looping(
    arrangement: Arrangement, *, frames: bool = False, record: Path | None = None, properties: str = ""
) -> Iterator[Callable[[int], float]]:
    """A function from numbers of cycles to the seconds of one cycle, without waiting."""
    bound = bind(arrangement, parse_properties([Source("bench", properties)]))
    program = lower(arrangement, bound.atoms, keep_all_bits=True)
    lines = parse_properties([Source("bench", properties)]).goals
    monitors = {line.name: monitor_properties(line).monitor for line in lines}
    loop = Loop(LiveCode(program, monitors), held=starting_values(program))
    shared = Shared("bench", loop) if frames else None
    if shared is not None:
        shared.posts.post({f"x{i}": 1 for i in range(SLOTS) if f"x{i}" in shared.posts.inputs})
    recorder = Recorder(record, {}, loop) if record is not None else None
    loop.begin(time.monotonic_ns())

    def cycles(count: int) -> float:
        begin, left = time.perf_counter(), count
        while (reason := loop.go(left)) == control.FULL:
            assert recorder is not None
            recorder.grow()
            left = loop.control[control.TURNS]
        assert reason == control.DONE, reason
        return (time.perf_counter() - begin) / count

    try:
        cycles(100)
        yield cycles
    finally:
        if recorder is not None:
            recorder.close()
        if shared is not None:
            shared.close()


@contextmanager
def served(name: str, *, period: int, priority: int | None = None) -> Iterator[Supervised]:
    """The traffic lights run under a supervisor on a thread of this process."""
    program = lower(load_arrangement(LIGHTS), keep_all_bits=True)
    loop = Loop(LiveCode(program), period=period, held=starting_values(program))
    with (
        closing(Shared(name, loop)) as shared,
        closing(Server(name, shared, Permissions())) as server,
        Supervised(loop, shared, priority=priority) as run,
    ):
        thread = threading.Thread(target=serve, args=(run, [server]))
        run.start()
        thread.start()
        try:
            yield run
        finally:
            run.stop()
            thread.join()


def each(action: Callable[[], object], count: int) -> float:
    """Seconds of one call."""
    begin = time.perf_counter()
    for _ in range(count):
        action()
    return (time.perf_counter() - begin) / count


def compiled(turns: int, count: int) -> dict[str, float]:
    """Seconds of a get and a post in a compiled machine, and of a cycle of the traffic lights."""
    found: dict[str, list[float]] = {"get": [], "post": [], "lights": [], "recorded": []}
    with (
        tempfile.TemporaryDirectory() as folder,
        looping(machines(1), frames=True) as nothing,
        looping(machines(1, inputs=SLOTS), frames=True) as reading,
        looping(machines(1, outputs=SLOTS), frames=True) as writing_,
        looping(load_arrangement(LIGHTS), frames=True) as lights,
        looping(load_arrangement(LIGHTS), frames=True, record=Path(folder) / "r") as recorded,
    ):
        for _ in range(turns):
            base = nothing(count)
            found["get"].append((reading(count) - base) / SLOTS)
            found["post"].append((writing_(count) - base) / SLOTS)
            found["lights"].append(lights(count))
            found["recorded"].append(recorded(count))
    return {name: statistics.median(values) for name, values in found.items()}


def python(turns: int, count: int) -> dict[str, float]:
    """Seconds of calls from Python: ours, queues, a pipe, and shared memory."""
    found: dict[str, list[float]] = {}
    memory = mmap.mmap(-1, 4096)
    word = ctypes.c_int64.from_buffer(memory)
    inside: queue.Queue[int] = queue.Queue()
    near, far = multiprocessing.Pipe()
    with served("benchmark", period=1_000_000), Whiteboard("benchmark") as board:
        actions: dict[str, tuple[Callable[[], object], int]] = {
            "get": (lambda: board.get("ns"), count), "view": (board.view, count // 4),
            "post": (lambda: board.post(car=True), count // 20),
            "queue": (lambda: (inside.put(1), inside.get()), count // 4),
            "pipe": (lambda: (near.send(1), far.recv()), count // 10),
            "memory": (lambda: word.value, count),
        }  # fmt: skip
        for _ in range(turns):
            for name, (action, times) in actions.items():
                found.setdefault(name, []).append(each(action, max(1, times)))
    with served("benchmark", period=1_000_000), Whiteboard("benchmark") as board, board.writer("car") as writer:
        found["write"] = [each(lambda: writer.post(car=True), count) for _ in range(turns)]
    return {name: statistics.median(values) for name, values in found.items()}


def woken(count: int) -> list[int]:
    """Nanoseconds from the commit of a frame to a subscriber in this process, woken by it."""
    found = []
    with served("benchmark", period=1_000_000), Whiteboard("benchmark") as board, board.subscribe() as updates:
        attached = board._attached
        assert isinstance(attached, Attached)
        poll = select.poll()
        poll.register(updates.fileno())
        updates.read()
        while len(found) < count:
            poll.poll()
            now = time.monotonic_ns()
            frame = attached.newest()
            updates.read()
            if frame is not None:
                found.append(now - frame[COMMITTED])
    return found


def rates(turns: int, count: int) -> dict[int, float]:
    """Ringlets a second, by the number of machines."""
    found = {}
    for number in (1, 4, 16, 100):
        with looping(machines(number), frames=True) as cycles:
            found[number] = number / statistics.median(cycles(count // number) for _ in range(turns))
    return found


def watched(turns: int, count: int) -> dict[int, float]:
    """Seconds of a ringlet of the traffic lights, by the number of monitored properties."""
    pairs = [(a, b) for a in ("RED", "AMBER", "GREEN") for b in ("RED", "AMBER", "GREEN") if a != b]
    lines = [f"G !(ns@{a} && ew@{b} && X ns@{b} && X ew@{a})" for a, b in pairs]
    lines += [f"G (ns@{a} -> (ns@{a} W ns@{b}))" for a, b in pairs]
    lines += [f"G !(ns@{a} && ew@{b} && X ns@{c} && X X ew@{d})" for a, b in pairs for c, d in (*pairs, *pairs[::-1])]
    lines = list(dict.fromkeys(lines))
    lines += [f"G !(ns@{a} && X ns@{b} && X X ns@{c} && X X X ew@{a})" for a, b in pairs for c, _ in pairs]
    found = {}
    for number in (0, 1, 10, 100):
        with looping(load_arrangement(LIGHTS), properties="\n".join(lines[:number])) as cycles:
            found[number] = statistics.median(cycles(count) for _ in range(turns)) / 3
    return found


def lateness(period: int, seconds: float, *, busy: int, priority: int | None) -> tuple[Lateness, str | None]:
    """How late cycles of so many nanoseconds began, beside so many busy processes; what the system granted."""
    spinning = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(busy)]
    try:
        with served("benchmark", period=period, priority=priority) as run:
            time.sleep(seconds)
        late = run.report.lateness
        assert late is not None
        return late, run.report.priority
    finally:
        for process in spinning:
            process.kill()
            process.wait()


def quantile(values: list[int], part: float) -> float:
    """In seconds, of nanoseconds."""
    return sorted(values)[min(len(values) - 1, int(len(values) * part))] / 1e9


def duration(seconds: float) -> str:
    """With a unit, three digits. A difference below zero is one that the noise of the machine hides."""
    if seconds < 0:
        return "too little to measure"
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if abs(seconds) >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def ros_figures(turns: int, count: int) -> tuple[Mapping[str, float], str]:
    """Seconds of rospy's publish and of its way to a call-back; why there are none."""
    try:
        with ros.master() as surroundings:
            published = statistics.median(ros.publish(surroundings, count) for _ in range(turns))
            ways = ros.latency(surroundings, count)
            relayed = ros.latency(surroundings, count, relayed=True)
    except ros.NoRos as why:
        return {}, str(why)
    found = {"publish": published, "way": quantile(ways, 0.5), "way 99": quantile(ways, 0.99)}
    return found | {"relayed": quantile(relayed, 0.5)}, ""


def table(turns: int, count: int, seconds: float) -> tuple[list[list[str]], str]:
    """The rows, and why ROS is not among them."""
    peer, why = ros_figures(turns, max(20, count // 50))
    inside, outside = compiled(turns, count), python(turns, max(200, count // 10))
    ways = woken(max(20, count // 100))
    median, most = quantile(ways, 0.5), quantile(ways, 0.99)
    found = [
        ["a machine gets an input", duration(inside["get"]), "clfsm's slides: 2.4 ns"],
        ["a machine posts an output", duration(inside["post"]), "clfsm's slides: 12 ns"],
        ["a cycle of the traffic lights, with its frame", duration(inside["lights"]), ""],
        ["the same, recorded", duration(inside["recorded"]), ""],
    ]
    for what, name, others in (
        ("Python: `get` of a slot", "get", ("memory", "queue")),
        ("Python: `view` of a frame", "view", ()),
        ("Python: `post` in memory that was lent", "write", ()),
        ("Python: `post` that another process answers", "post", ("pipe",)),
    ):
        said = [*beside(outside, *others), *rospy(peer, "publish", outside[name])]
        found.append([what, duration(outside[name]), "; ".join(said)])
    way = "from the commit of a frame to a woken subscriber in Python"
    found.append([f"{way}, median", duration(median), "; ".join(rospy(peer, "way", median))])
    found.append([f"{way}, 99 %", duration(most), "; ".join(rospy(peer, "way 99", most))])
    for number, rate in rates(turns, count).items():
        found.append([f"ringlets a second, {number} machine{'s' * (number > 1)}", f"{rate / 1e6:.3g} million", ""])
    steps = watched(turns, count)
    for number, step in steps.items():
        more = f"{duration(step - steps[0])} more" if number else ""
        found.append(
            [f"a ringlet of the traffic lights, {number} monitor{'s' if number != 1 else ''}", duration(step), more]
        )
    cycle = guarding.chain(turns, count, looping, load_arrangement)
    found += guarding.rows(
        cycle, peer, seconds, min(count, 20_000), duration, guarding.STUDIES[: 1 if seconds < 1 else None]
    )
    for period in (10_000_000, 1_000_000):
        for busy in (0, 2):
            for priority in (None, 50):
                late, granted = lateness(period, seconds, busy=busy, priority=priority)
                what = f"lateness of {period // 1_000_000} ms cycles"
                what += ", beside two busy processes" * bool(busy) + ", with --priority 50" * bool(priority)
                told = ", ".join(f"{p:g} % {duration(min(value, late.worst) / 1e9)}" for p, value in late.percentiles)
                found.append([what, f"{told}, worst {duration(late.worst / 1e9)}", granted or ""])
    return found, why


def beside(figures: Mapping[str, float], *names: str) -> list[str]:
    """What others take for the like."""
    said = {
        "memory": "`ctypes` and `mmap`",
        "queue": "`queue.Queue` put and get",
        "pipe": "`multiprocessing.Pipe` send and recv",
    }
    return [f"{said[name]}: {duration(figures[name])}" for name in names]


def rospy(peer: Mapping[str, float], name: str, ours: float) -> list[str]:
    """What rospy takes, and how many times as long that is."""
    what = "publish" if name == "publish" else "publish to call-back"
    return [f"rospy's {what}: {duration(peer[name])}, {peer[name] / ours:.3g} times"] if peer else []


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.running", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--quick", action="store_true", help="so little that only the answers count")
    parser.add_argument("--runs", type=int, default=5, help="turns of which medians are shown (default: 5)")
    parser.add_argument("--write", type=Path, metavar="PAGE", help="put the table into this page as well")
    options = parser.parse_args(arguments)
    if options.write is not None:
        writing.check(parser, options.write, NAME)
    load = round(os.getloadavg()[0], 2)
    turns, count, seconds = (1, 1000, 0.02) if options.quick else (max(1, options.runs), 200_000, 5.0)
    with tempfile.TemporaryDirectory(prefix="llfsm-") as folder:
        os.environ["LLFSM_WHITEBOARDS"] = folder
        rows, why = table(turns, count, seconds)
    body = writing.markdown(HEADINGS, rows)
    print(body)
    print(f"\nOn the slides of clfsm: {SEEDS}." + (f"\nWithout ROS: {why}." if why else ""))
    if options.write is not None and not options.quick:
        how = f"medians of {turns} turns; load {load} before and {round(os.getloadavg()[0], 2)} after"
        writing.replace(options.write, NAME, f"{body}\n\n{writing.signature(NAME, how, *([why] if why else []))}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
