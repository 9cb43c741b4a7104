"""How many of a sample of mutants the tests kill: `make mutants N=200 SEED=7`.

No library at hand fits. mutmut leaves out functions with decorators, so every kernel, mutates within functions only and
has no seeded sample; cosmic-ray runs one fixed command for each mutant, which would be the whole suite, and changes
files in place; mutatest is for Python 3.8. coverage.py does the recording. The rest is here: operators (operators.py),
the sample (sampling.py), which tests run which line (recording.py), one mutant (trying.py, steering.py).

How a mutant is counted:

    quick, slow  killed by a test of `make check`, or by one marked slow or long where the quick ones passed
    limit        killed: a test took more than 20 s and ten times its usual processor time, or 4 minutes on the clock
    import       killed: nothing could be imported any more
    survived     the tests that run the changed line passed, or those for which there was time (a minute of quick and
                 two of slow tests); a mutant whose line no test runs is one of these

Mutants listed in equivalent.yaml change nothing that could be asked for, each for the reason given there: they are left
out of the share. At the end every test that killed a mutant is run on the unmutated source once more: if it fails
there, its mutants count as survivors.
"""

from __future__ import annotations

import argparse
import datetime as dt
import json
import os
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import yaml

from tests.mutation.operators import Mutant
from tests.mutation.recording import Recording, record
from tests.mutation.sampling import room, sample
from tests.mutation.scratch import Project, copy_again, copy_of, environment
from tests.mutation.trying import RUNNING, Batch, Outcome, Trial, end

REQUIRED = 0.9
ROOT = Path(__file__).resolve().parents[2]
PROJECT = Project(
    root=ROOT,
    package="llfsm_verify",
    beside=("models", "properties", "examples"),
    whole=("project", "outputs", "test_registry.py"),
    left_out=("tests/mutation",),
    compiled="llfsm_verify/kripke/kernels/",
    caller="llfsm_verify/kripke/compiled.py",
    prepare=(
        "from llfsm_verify.kept import cache_folder; from llfsm_verify.kripke.compiled import kernels; "
        "kernels().load_all(); print(cache_folder())"
    ),
)
EQUIVALENT = Path(__file__).parent / "equivalent.yaml"
KEPT = ROOT / ".mutants"


def equivalent(path: Path) -> dict[tuple[str, str, str, str], str]:
    """The reasons by mutant."""
    entries = yaml.safe_load(path.read_text()) or []
    return {(e["file"], e["in"] or "", e["before"].strip(), e["after"].strip()): e["reason"] for e in entries}


def try_all(
    project: Project,
    recording: Recording,
    chosen: list[Mutant],
    jobs: int,
    tell: Callable[[Mutant, Outcome], None],
    *,
    slow_too: bool = True,
) -> list[tuple[Mutant, Outcome]]:
    """The outcome of each mutant, in the order of the list; `tell` gets each when it is known."""
    lock = threading.Lock()
    with tempfile.TemporaryDirectory(prefix="mutants-") as scratch:
        trials: queue.SimpleQueue[Trial] = queue.SimpleQueue()
        for i in range(jobs):
            folder = Path(scratch).resolve() / str(i)
            root = copy_of(project, folder) if not i else copy_again(Path(scratch).resolve() / "0", folder)
            _check_copy(project, root)
            trials.put(Trial(project, recording, root, folder / "runs", slow_too=slow_too))

        def outcome(mutant: Mutant) -> Outcome:
            trial = trials.get()
            try:
                found = trial.outcome(mutant)
            finally:
                trials.put(trial)
            with lock:
                tell(mutant, found)
            return found

        first = trials.get()
        _check_unmutated(first)
        trials.put(first)
        with ThreadPoolExecutor(jobs) as pool:
            try:
                outcomes = list(pool.map(outcome, chosen))
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for process in list(RUNNING):
                    end(process)
                raise
        wrong = failing_without_mutant(
            trials.get(), [found for found in outcomes if found.verdict in {"quick", "slow", "limit"}]
        )
    return [
        (mutant, Outcome("survived", message=f"{found.test} fails without it too") if found.test in wrong else found)
        for mutant, found in zip(chosen, outcomes, strict=True)
    ]


def _check_copy(project: Project, root: Path) -> None:
    """Processes that tests start, wherever they run, import the package of the copy."""
    command = [sys.executable, "-c", f"import {project.package}; print({project.package}.__file__)"]
    done = subprocess.run(
        command, cwd=root.parent, env=environment(project, root), capture_output=True, text=True, check=True
    )
    if not Path(done.stdout.strip()).is_relative_to(root):
        raise RuntimeError(f"{done.stdout.strip()} is imported instead of the copy in {root}")


def _check_unmutated(trial: Trial) -> None:
    """Without a mutant a test passes, so that what is killed is killed by its mutant."""
    quick = set(trial.recording.seconds) - trial.recording.slow
    test = min(quick, key=lambda name: trial.recording.seconds[name])
    run = trial.run(Batch((test.partition("::")[0],), (test,)), 1e9, slow=False)
    if run.verdict != "survived" or run.tried != 1:
        raise RuntimeError(f"{test} does not pass without a mutant: {run.message}")


def failing_without_mutant(trial: Trial, killers: list[Outcome]) -> set[str]:
    """The tests among the killers that fail on the unmutated source."""
    wrong: set[str] = set()
    for slow in (False, True):
        tests = {found.test for found in killers if slow == (found.verdict == "slow")}
        while tests:
            run = trial.run(
                Batch(tuple(sorted({t.partition("::")[0] for t in tests})), tuple(sorted(tests))), 1e9, slow=slow
            )
            if run.verdict == "survived":
                break
            wrong.add(run.test)
            tests.discard(run.test)
    return wrong


def main() -> int:
    parser = argparse.ArgumentParser(
        prog="python -m tests.mutation", description=__doc__.splitlines()[0] if __doc__ else ""
    )
    parser.add_argument("--number", type=int, default=200, help="how many mutants")
    parser.add_argument("--seed", type=int, help="chooses the sample; the date unless given")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="how many mutants are tried at a time")
    parser.add_argument(
        "--only", default="", metavar="FILE", help="of the sample, the mutants of files whose name has this"
    )
    parser.add_argument("--quick", action="store_true", help="no slow tests")
    parser.add_argument("--again", action="store_true", help="the survivors of the run before this one")
    options = parser.parse_args()
    seed = options.seed if options.seed is not None else int(dt.datetime.now(dt.UTC).strftime("%Y%m%d"))
    begun = time.monotonic()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # tests interrupt; in the background it would be ignored

    def say(text: str) -> None:
        sys.stdout.write(text + "\n")
        sys.stdout.flush()

    chosen = sample(PROJECT, options.number, seed)
    last = KEPT / "survivors.json"
    if options.again:
        before = json.loads(last.read_text())
        seed, wanted = before["seed"], {tuple(key) for key in before["survivors"]}
        chosen = [mutant for mutant in sample(PROJECT, before["number"], seed) if mutant.key in wanted]
    chosen = [mutant for mutant in chosen if options.only in mutant.file]
    reasons = equivalent(EQUIVALENT)
    left_out = [mutant for mutant in chosen if mutant.key in reasons]
    say(f"{len(chosen)} mutants, SEED={seed}; {len(left_out)} of them are known to be equivalent.")
    for key in reasons:
        if not all(line in _text(ROOT / key[0]) for line in key[2].splitlines()):
            say(f"equivalent.yaml names a line that {key[0]} has no more: {key[2]}")
    recording = record(PROJECT, KEPT, options.jobs, say)
    for test, why in recording.failed.items():
        say(f"{test} fails without a mutant, so none is tried with it: {why}")

    def tell(mutant: Mutant, found: Outcome) -> None:
        say(f"{found.verdict:8} {found.seconds:5.1f} s  {mutant.file}:{mutant.line} {mutant.operator}: {found.test}")

    tried = [mutant for mutant in chosen if mutant.key not in reasons]
    results = try_all(PROJECT, recording, tried, options.jobs, tell, slow_too=not options.quick)
    if not options.again:
        survivors = [mutant.key for mutant, found in results if found.verdict == "survived"]
        last.write_text(json.dumps({"seed": seed, "number": options.number, "survivors": survivors}))
    say(report(results, left_out))
    say(f"{(time.monotonic() - begun) / 60:.0f} minutes.")
    killed = sum(found.verdict != "survived" for _, found in results)
    return 0 if results and killed >= REQUIRED * len(results) else 1


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def report(results: list[tuple[Mutant, Outcome]], left_out: list[Mutant]) -> str:
    """A table by room, the survivors, and the share that was killed."""
    kinds = ("quick", "slow", "limit", "import", "survived")
    rooms = sorted({room(mutant.file) for mutant, _ in results} | {room(mutant.file) for mutant in left_out})
    width = max([4, *map(len, rooms)])
    lines = ["", f"{'room':{width}} {'mutants':>8} {'equivalent':>10} " + " ".join(f"{kind:>8}" for kind in kinds)]
    for name in [*rooms, "all"]:
        own = [found.verdict for mutant, found in results if name in {"all", room(mutant.file)}]
        known = sum(name in {"all", room(mutant.file)} for mutant in left_out)
        counts = Counter(own)
        row = " ".join(f"{counts[kind]:8}" for kind in kinds)
        lines.append(f"{name:{width}} {len(own) + known:8} {known:10} {row}")
    for mutant, found in results:
        if found.verdict == "survived":
            lines += [
                "",
                f"{mutant.file}:{mutant.line} survived in {mutant.function or 'the module'} ({mutant.operator})",
            ]
            lines += [f"  - {line}" for line in mutant.before.splitlines()]
            lines += [f"  + {line}" for line in mutant.after.splitlines()]
            runs = f"{found.of} quick ones run" if found.of else "no quick one was seen to run"
            lines.append("  " + (found.message or f"{found.tried} tests ran on it; {runs} the line"))
    killed = sum(found.verdict != "survived" for _, found in results)
    share = 100 * killed / len(results) if results else 0.0
    lines += ["", f"{killed} of {len(results)} mutants that are not known to be equivalent were killed: {share:.1f} %"]
    return "\n".join(lines)


if __name__ == "__main__":
    sys.exit(main())
