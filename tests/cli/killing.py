"""Every way of saving, ended at each of its steps: `python -m tests.cli.killing KIND FOLDER` prints what was left.

Each run is a fork of this process, which has one thread and everything imported, so a run is quick. It is ended by
`kill -9` just before its k-th change of a folder or file, or by a signal in the middle of what it writes, or it meets a
disk that is full after so many bytes. No way depends on a clock.
"""

from __future__ import annotations

import atexit
import json
import os
import random
import resource
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from hashlib import sha256
from pathlib import Path

from benchmarks.ring import ring
from llfsm_verify import cli
from llfsm_verify import kept as cache
from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.kripke import compiled
from llfsm_verify.report import saving
from llfsm_verify.testing.failure import keep_trace
from llfsm_verify.verification import replay, tracefile
from tests.quick import examples

FAULTY = "models/traffic_lights/faulty.yaml"
BOTH = ("-p", "both: G !(ns@GREEN && ew@GREEN)")
CHANGES = ("os.rename", "os.remove", "os.link", "os.mkdir", "os.chmod", "os.truncate")
MOST = examples(40)
"""Steps of a run that are tried; of longer runs, so many of them at random."""
SEED = 12

Run = Callable[[], int]


@dataclass(frozen=True, slots=True)
class Kind:
    """A way of saving, with the current directory as the folder that it saves in."""

    run: Run
    before: Callable[[], None] = lambda: None
    """Makes what is there already."""
    again: Run | None = None
    """The run that goes on after one that was ended; None: the same."""


def command(*words: str) -> Run:
    return partial(cli.main, words)


def old(*names: str, text: str = "") -> Callable[[], None]:
    def make() -> None:
        for name in names:
            Path(name).parent.mkdir(exist_ok=True)
            Path(name).write_text(text)

    return make


def kinds(root: Path) -> dict[str, Kind]:
    faulty = str(root / FAULTY)
    made, run = Path("made/run.trace.yaml"), Path("run.trace.yaml")
    trace = "trace: 1\nexpect: violated # old\narrangement: x\ndigest: '0'\nsteps: []\n"

    def keep() -> int:
        text = made.read_text()
        arrangement = load_arrangement(faulty)
        goal = tracefile.read_trace_file(made).goal
        assert goal is not None
        path, _ = keep_trace(Path("kept"), "both", goal, text, arrangement, load_arrangement)
        return 0 if path.read_text() == text else 1

    def saved_run() -> None:
        made.parent.mkdir()
        assert forked(command("query", faulty, "ns@GREEN && ew@GREEN", "--save", str(made)))[0] == 0

    def update() -> int:
        return 0 if saving.update_trace_file(run, "holds", "12") or "holds" in run.read_text() else 1

    def kernel() -> int:
        path, code = Path("cache/rebuild.o").absolute(), random.Random(SEED).randbytes(20_000)
        known = cache.kept(path)
        assert known in (None, code), "a damaged kernel is used"
        note = None if known is not None else cache.keep(path, code)
        sys.stdout.write(f"{note}\n")
        return 0 if note is None else 1

    def searched() -> None:
        Path("ring.yaml").write_text(ring(4, 3))

    search = ("verify", "ring.yaml", "-q", "--keep-all-bits", "--checkpoint", "c.ckpt", "--resume")
    often = (*search, "--checkpoint-every", "0.0001", "--max-states", "9000")
    return {
        "certificate": Kind(
            command("verify", faulty, "-q", *BOTH, "--certificate", "c.json"), old("c.json", text="old")
        ),
        "traces": Kind(
            command("verify", faulty, "-q", *BOTH, "--save-traces", "traces"),
            old("traces/both.trace.yaml", text="trace: 1\n# old\n"),
        ),
        "new traces": Kind(command("verify", faulty, "-q", *BOTH, "--save-traces", "traces")),
        "structure": Kind(command("kripke", faulty, "-o", "x.json"), old("x.json", text="old")),
        "matrix": Kind(command("kripke", faulty, "-o", "x.npz"), old("x.npz", text="old")),
        "drawing": Kind(command("draw", faulty, "-o", "x.dot"), old("x.dot", text="old")),
        "query": Kind(
            command("query", faulty, "ns@GREEN", "--save", "q.yaml"), old("q.yaml", text="trace: 1\n# old\n")
        ),
        "init": Kind(command("init", "there", "--name", "crossing")),
        "kept run": Kind(keep, saved_run),
        "update": Kind(update, old("run.trace.yaml", text=trace)),
        "kernel": Kind(kernel),
        "checkpoint": Kind(command(*often), searched, command(*search)),
    }


def changes_something(event: str, arguments: tuple[object, ...]) -> bool:
    if event == "open":
        flags = arguments[2]
        return isinstance(flags, int) and bool(flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT))
    return event in CHANGES


def end_before(step: int) -> None:
    """End this process before its change number `step`."""
    left = step

    def hook(event: str, arguments: tuple[object, ...]) -> None:
        nonlocal left
        if changes_something(event, arguments):
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            left -= 1

    sys.addaudithook(hook)


def full_after(size: int, *, killed: bool) -> None:
    """No file may be larger; whatever writes more fails as on a full disk, or ends this process as a signal would."""
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL if killed else signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


def forked(run: Run, prepare: Callable[[], None] = lambda: None) -> tuple[int | None, str]:
    """The exit code of a run in a process of its own (None: a signal has ended it), and what it said."""
    reading, writing = os.pipe()
    sys.stdout.flush()
    process = os.fork()
    if process == 0:
        try:
            for number in (1, 2):
                os.dup2(writing, number)
            sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))  # noqa: SIM115
            prepare()
            try:
                code = run()
            except DiagnosticError as error:
                sys.stdout.write(f"{error}\n")
                code = 3
            atexit._run_exitfuncs()  # which `os._exit` leaves out
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)
        except BaseException as error:  # noqa: BLE001 - it is told to whoever waits
            os.write(2, repr(error).encode())
            os._exit(99)
    os.close(writing)
    with open(reading, "rb") as pipe:
        said = pipe.read().decode()
    status = os.waitpid(process, 0)[1]
    return (os.WEXITSTATUS(status) if os.WIFEXITED(status) else None), said


def found() -> dict[str, str]:
    """The hash of each file of the current directory and below it."""
    files = sorted(path for path in Path().rglob("*") if path.is_file())
    return {path.as_posix(): sha256(path.read_bytes()).hexdigest() for path in files}


def steps(kind: Kind, folder: Path) -> int:
    """How many changes a run makes."""
    reading, writing = os.pipe()

    def count() -> None:
        def hook(event: str, arguments: tuple[object, ...]) -> None:
            if changes_something(event, arguments):
                os.write(writing, b".")

        sys.addaudithook(hook)

    fresh(kind, folder)
    forked(kind.run, count)
    os.close(writing)
    with open(reading, "rb") as pipe:
        return len(pipe.read())


def fresh(kind: Kind, folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    os.chdir(folder)
    kind.before()


def tried(kind: Kind, folder: Path) -> Iterator[dict[str, object]]:
    fresh(kind, folder)
    before = found()
    code, said = forked(kind.run)
    yield {"mode": "undisturbed", "before": before, "code": code, "said": said, "after": found()}
    sizes = [path.stat().st_size for path in folder.rglob("*") if path.is_file()]
    generator = random.Random(SEED)
    count = steps(kind, folder)
    chosen = range(count) if count <= MOST else sorted(generator.sample(range(count), MOST))
    ways = [("kill", k, partial(end_before, k)) for k in chosen]
    bytes_ = sorted({0, 1, *(size - 1 for size in sizes), *(generator.randrange(max(sizes)) for _ in range(3))})
    ways += [("kill in writing", n, partial(full_after, n, killed=True)) for n in bytes_]
    ways += [("full", n, partial(full_after, n, killed=False)) for n in bytes_]
    for mode, point, prepare in ways:
        fresh(kind, folder)
        code, said = forked(kind.run, prepare)
        left = found()
        again = forked(kind.again or kind.run)
        yield {
            "mode": mode, "point": point, "code": code, "said": said, "left": left, "again": again, "after": found(),
        }  # fmt: skip


def main() -> None:
    name, folder = sys.argv[1:]
    root = Path.cwd()
    compiled.kernels().load_all()
    assert replay
    for result in tried(kinds(root)[name], Path(folder).absolute()):
        sys.stdout.write(json.dumps(result) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
