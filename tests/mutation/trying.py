"""One mutant, tried with the tests that are most likely to notice it, until one fails or the time is spent."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any, Literal

from tests.mutation.operators import Mutant
from tests.mutation.recording import Recording
from tests.mutation.sampling import room
from tests.mutation.scratch import Project, environment, journal

QUICK_SECONDS = 60.0
"""Of processor time: so much is spent on quick tests, then, where none failed, ..."""
SLOW_SECONDS = 120.0
"""... so much on the slow ones that run the mutated line, and then on slow and long ones near to it."""
SLACK, FACTOR = 20.0, 10.0
"""A test is ended after 20 s of processor time and ten times its usual."""
STALLED = 240.0
"""Seconds on the clock without the end of a test, after which the whole run is ended."""
COMPILING = 600.0
"""Seconds on the clock for compiling the kernels of a mutant."""
MEMORY = 8 << 30
FIRST, SECOND = 3, 9
"""Test files in the first process, which most mutants do not survive, and in the second; a third has the others."""
NEAR = 8
"""Test files that do not run the mutated line, but others of its file."""
SLOW_FILES = 8

RUNNING: set[subprocess.Popen[bytes]] = set()
"""The pytest processes of now; each is the leader of its group."""

Verdict = Literal["quick", "slow", "limit", "import", "survived"]


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a mutant."""

    verdict: Verdict
    """Killed by a quick or a slow test, ended by a limit, nothing could be imported, or survived."""
    test: str = ""
    message: str = ""
    tried: int = 0
    """Tests that ran on it."""
    of: int = 0
    """Quick tests that run the mutated line."""
    seconds: float = 0.0


@dataclass(frozen=True, slots=True)
class Batch:
    """Tests for one process."""

    files: tuple[str, ...]
    tests: tuple[str, ...] | None
    """In this order; None: all slow and long tests of the files ..."""
    without: tuple[str, ...] = ()
    """... but for these."""


class Trial:
    """What is tried, and with what; `root` is a copy of the project for this thread alone."""

    def __init__(
        self, project: Project, recording: Recording, root: Path, folder: Path, *, slow_too: bool = True
    ) -> None:
        self.project, self.recording, self.root, self.folder = project, recording, root, folder
        self.slow_too = slow_too
        self._runs = 0
        self._own = folder / "kernels of the mutant"

    def outcome(self, mutant: Mutant) -> Outcome:
        """Try a mutant. The copy is as it was afterwards."""
        path = self.root / mutant.file
        source = path.read_bytes()
        path.write_bytes(mutant.apply(source))
        try:
            if self.project.is_compiled(mutant.file):
                self._compile()
            return self._outcome(mutant)
        finally:
            path.write_bytes(source)
            shutil.rmtree(self._own, ignore_errors=True)

    def _compile(self) -> None:
        """Compile the mutant's kernels beforehand: the first test that runs one would take too long.

        Where this does not go through, the tests show it.
        """
        shutil.copytree(self.project.kernels(self.root), self._own)
        command = [sys.executable, "-c", self.project.prepare]
        variables = environment(self.project, self.root, kernels=self._own)
        try:
            subprocess.run(command, cwd=self.root, env=variables, capture_output=True, check=False, timeout=COMPILING)
        except subprocess.TimeoutExpired:
            pass

    def _outcome(self, mutant: Mutant) -> Outcome:
        running, beside = tests_for(self.project, self.recording, mutant)
        covering, near = running - self.recording.slow, beside - self.recording.slow
        quick = batches(self.project, self.recording, mutant, covering, near)
        if mutant.imported:
            quick += self._of_the_whole_and_quick()
        tried, spent = 0, 0.0
        for batch in quick if covering or mutant.imported else ():
            if spent >= QUICK_SECONDS:
                break
            run = self.run(batch, QUICK_SECONDS - spent, slow=False)
            tried, spent = tried + run.tried, spent + run.seconds
            if run.verdict != "survived":
                return Outcome(run.verdict, run.test, run.message, tried, len(covering), spent)
        if not self.slow_too:
            return Outcome("survived", tried=tried, of=len(covering), seconds=spent)
        slow_left = SLOW_SECONDS
        slow_tests = self._slow(mutant, (running or beside) & self.recording.slow)
        if slow_tests.tests:
            run = self.run(slow_tests, slow_left, slow=True)
            tried, spent, slow_left = tried + run.tried, spent + run.seconds, slow_left - run.seconds
            if run.verdict != "survived":
                return Outcome(run.verdict, run.test, run.message, tried, len(covering), spent)
        files = [file for batch in quick for file in batch.files]
        files += [
            str(path.relative_to(self.project.root)) for path in self.project.test_files() if _in_room(path, mutant)
        ]
        nearest = sorted(dict.fromkeys(files), key=lambda name: -_closeness(name, mutant.file))
        slow = [name for name in nearest if _has_slow(self.root / name)][:SLOW_FILES]
        if mutant.imported:
            slow += [name for name in self._of_the_whole() if name not in slow]
        if slow and slow_left > 0:
            run = self.run(Batch(tuple(slow), None, slow_tests.tests or ()), slow_left, slow=True)
            tried, spent = tried + run.tried, spent + run.seconds
            if run.verdict != "survived":
                return Outcome(run.verdict, run.test, run.message, tried, len(covering), spent)
        return Outcome("survived", tried=tried, of=len(covering), seconds=spent)

    def _slow(self, mutant: Mutant, tests: set[str]) -> Batch:
        """Slow tests, those of the nearest files first and in each file the cheap ones."""

        def rank(test: str) -> tuple[float, float, str]:
            return (-_closeness(test.partition("::")[0], mutant.file), self.recording.seconds[test], test)

        ordered = sorted(tests, key=rank)
        return Batch(tuple(dict.fromkeys(test.partition("::")[0] for test in ordered)), tuple(ordered))

    def _of_the_whole_and_quick(self) -> list[Batch]:
        files = self._of_the_whole()
        quick = set(self.recording.seconds) - self.recording.slow
        tests = tuple(sorted(test for test in quick if test.partition("::")[0] in files))
        return [Batch(tuple(files), tests)] if tests else []

    def _of_the_whole(self) -> list[str]:
        """Test files that look at the project as a whole: its tables, pages and help."""
        found = [path.relative_to(self.project.root) for path in self.project.test_files()]
        return [path.as_posix() for path in found if path.parts[1] in self.project.whole]

    def run(self, batch: Batch, seconds: float, *, slow: bool) -> Outcome:
        """One pytest process on the copy as it is."""
        self._runs += 1
        folder = self.folder / str(self._runs)
        folder.mkdir(parents=True)
        kernels = folder / "kernels"
        shutil.copytree(self._own if self._own.exists() else self.project.kernels(self.root), kernels)
        plan = {
            "journal": str(folder / "journal"),
            "tests": batch.tests,
            "kinds": ("slow", "long") if slow else ("quick",),
            "without": batch.without,
            "spent": seconds,
            "slack": SLACK,
            "factor": FACTOR,
            "usual": {test: self.recording.seconds.get(test, 1.0) for test in batch.tests or ()},
            "memory": MEMORY,
        }
        (folder / "plan.json").write_text(json.dumps(plan))
        variables = environment(self.project, self.root, folder / "plan.json", kernels, quick=not slow)
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-x",
            "-p",
            "tests.mutation.steering",
            "-p",
            "no:cacheprovider",
        ]
        command += [f"--basetemp={folder / 'temp'}", *batch.files]
        with (folder / "output").open("w") as output:
            code = _run(command, self.root, variables, output, folder / "journal")
        outcome = self._judged(
            code, journal(folder / "journal"), (folder / "output").read_text(errors="replace"), slow=slow
        )
        shutil.rmtree(folder, ignore_errors=True)
        return outcome

    def _judged(self, code: int | None, entries: list[dict[str, Any]], output: str, *, slow: bool) -> Outcome:
        """What a process says about the mutant; `code` is None where it was ended because nothing moved."""
        for entry in entries:
            if entry.get("package") and not Path(entry["package"]).is_relative_to(self.root):
                raise RuntimeError(f"the tests imported {entry['package']}, not the copy in {self.root}")
        ended = [entry for entry in entries if "end" in entry]
        started = [entry["start"] for entry in entries if "start" in entry]
        tried, seconds = len(ended), sum(entry["seconds"] for entry in ended)
        for entry in ended:
            if entry["failure"] is not None:
                killed: Verdict = "quick" if entry["kind"] == "quick" else "slow"
                return Outcome(killed, entry["end"], entry["failure"], tried, seconds=seconds)
        if code in {0, 5} or any("stopped" in entry for entry in entries):
            return Outcome("survived", tried=tried, seconds=seconds)
        if code in {None, -signal.SIGPROF}:
            return Outcome("limit", started[-1] if started else "", "a time limit", tried, seconds=seconds)
        if not started:
            errors = [line for line in output.splitlines() if re.match(r"(E  +)?\w*(Error|Exception)\b", line)]
            return Outcome("import", message=(errors or output.splitlines() or ["?"])[-1].strip())
        return Outcome("slow" if slow else "quick", started[-1], f"pytest ended with {code}", tried, seconds=seconds)


def tests_for(project: Project, recording: Recording, mutant: Mutant) -> tuple[set[str], set[str]]:
    """The tests that run the mutant's statement, and those that run another line of a function of its file.

    What is run when a module is imported, and what caches answered later, belong to whichever test was first: for these
    the second set counts. Compiled kernels run unseen: theirs are the tests that call one.
    """
    path = project.root / mutant.file
    if project.is_compiled(mutant.file):
        path = project.root / project.caller
        return _inside(recording, path), set()
    by_line = recording.tests_by_line(path)
    first, last = mutant.lines
    covering = set().union(*(by_line.get(line, set()) for line in range(first, last + 1)))
    near = _inside(recording, path)
    if not near:
        module = ".".join(PurePosixPath(mutant.file).with_suffix("").parts)
        for other in project.sources():
            if re.search(rf"^\s*(from|import) {re.escape(module)}\b", other.read_text(), re.MULTILINE):
                near |= _inside(recording, other)
    return (set(), near | covering) if mutant.imported else (covering, near - covering)


def _inside(recording: Recording, path: Path) -> set[str]:
    """The tests that run a line of a function of a file."""
    lines: set[int] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            lines |= set(range(node.body[0].lineno, (node.end_lineno or 0) + 1))
    return set().union(*(tests for line, tests in recording.tests_by_line(path).items() if line in lines))


def batches(project: Project, recording: Recording, mutant: Mutant, covering: set[str], near: set[str]) -> list[Batch]:
    """Quick tests in the order in which they are tried: those of the mutant's room and file first, cheap ones first."""
    ranked = _ranked(project, recording, mutant, covering)
    groups = [ranked[:FIRST], ranked[FIRST : FIRST + SECOND], ranked[FIRST + SECOND :]]
    rest = [name for name in _ranked(project, recording, mutant, near) if name not in set(ranked[: FIRST + SECOND])]
    groups += [rest[:FIRST], rest[FIRST : FIRST + NEAR]]
    found = []
    for i, group in enumerate(groups):
        chosen = covering if i < 3 else near
        tests = [test for test in chosen if test.partition("::")[0] in group]
        tests.sort(key=lambda test: (recording.seconds[test], test))
        if tests:
            found.append(Batch(tuple(group), tuple(tests)))
    return found


def _ranked(project: Project, recording: Recording, mutant: Mutant, chosen: set[str]) -> list[str]:
    every: dict[str, int] = {}
    for test in recording.seconds:
        every[test.partition("::")[0]] = every.get(test.partition("::")[0], 0) + 1
    share: dict[str, float] = {}
    for test in chosen:
        name = test.partition("::")[0]
        share[name] = share.get(name, 0) + 1 / every[name]
    stem = PurePosixPath(mutant.file).stem

    def rank(name: str) -> tuple[float, str]:
        same = 2 * (PurePosixPath(name).stem.removeprefix("test_") == stem)
        return (-(same + _in_room(project.root / name, mutant) + share[name]), name)

    return sorted(share, key=rank)


def _closeness(test: str, file: str) -> float:
    """How near a test file is to a file of the source: the folders that both are in, and half of one for a like name.

    What a test starts in processes of its own is not always recorded, so its place has to tell.
    """
    own, other = PurePosixPath(file).parts[1:-1], PurePosixPath(test).parts[1:-1]
    shared = next((i for i, (a, b) in enumerate(zip(own, other, strict=False)) if a != b), min(len(own), len(other)))
    stem = PurePosixPath(test).stem.removeprefix("test_")
    return shared + 0.5 * (stem in PurePosixPath(file).stem or PurePosixPath(file).stem in stem)


def _has_slow(path: Path) -> bool:
    text = path.read_text()
    return "mark.slow" in text or "mark.long" in text


def _in_room(path: Path, mutant: Mutant) -> bool:
    """Whether a test file is in a folder of the tests that is called like the mutant's room or one above it."""
    parts = room(mutant.file).split("/")
    return any(f"/{'/'.join(parts[:i])}/" in path.as_posix() for i in range(1, len(parts) + 1))


def _run(command: list[str], cwd: Path, variables: dict[str, str], output: Any, progress: Path) -> int | None:
    """The exit code; None where nothing was written into the journal for too long. No process of it is left."""
    process = subprocess.Popen(
        command, cwd=cwd, env=variables, stdout=output, stderr=output, stdin=subprocess.DEVNULL, start_new_session=True
    )
    RUNNING.add(process)
    try:
        for moved in _progress(process, progress):
            if time.monotonic() - moved > STALLED:
                return None
        return process.returncode
    finally:
        end(process)
        RUNNING.discard(process)


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process with all that it started."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except ProcessLookupError:
        pass
    process.wait()


def _progress(process: subprocess.Popen[bytes], path: Path) -> Iterator[float]:
    """Twice a second, until the process ends, when the journal last grew."""
    size, moved = -1, time.monotonic()
    while True:
        try:
            process.wait(timeout=0.5)
        except subprocess.TimeoutExpired:
            now = path.stat().st_size if path.exists() else 0
            if now != size:
                size, moved = now, time.monotonic()
            yield moved
        else:
            return
