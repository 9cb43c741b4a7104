"""Which test runs which line of the source, and how long each test takes: recorded once, renewed for what changed."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from tests.mutation.scratch import Project, copy_of, environment, journal

CHUNK = 8
"""Test files in one pytest process."""


@dataclass(frozen=True, slots=True)
class Recording:
    """What was recorded, of quick and slow tests."""

    seconds: dict[str, float]
    """Processor time by test, of those that passed."""
    failed: dict[str, str]
    """Tests that failed on the unmutated source, with their message: no mutant is tried with these."""
    data: Path
    """The lines, as coverage.py keeps them."""
    slow: frozenset[str] = frozenset()
    """Those of the tests that are slow."""

    def tests_by_line(self, file: Path) -> dict[int, set[str]]:
        """The tests that run each line of a source file."""
        from coverage import CoverageData

        kept = CoverageData(str(self.data))
        kept.read()
        lines = kept.contexts_by_lineno(str(file))
        return {line: {test for test in tests if test in self.seconds} for line, tests in lines.items()}

    def files(self) -> list[str]:
        """Source files of which a line ran."""
        from coverage import CoverageData

        kept = CoverageData(str(self.data))
        kept.read()
        return sorted(kept.measured_files())


def record(project: Project, folder: Path, jobs: int, say: Callable[[str], None]) -> Recording:
    """The recording kept in `folder`, after the test files that are new or changed were run once more.

    A changed source file, or a changed file of the tests that is not a test file itself, renews all of it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tests, data = folder / "tests.json", folder / "coverage"
    whole = _digest([*_files(project.root, [project.package, *project.beside]), *project.helpers()])
    files = {str(path.relative_to(project.root)): _digest([path]) for path in project.test_files()}
    old = json.loads(tests.read_text()) if tests.is_file() and data.is_file() else None
    if old is None or old["whole"] != whole:
        data.unlink(missing_ok=True)
        old = {"whole": whole, "files": {}}
    kept = {name: entry for name, entry in old["files"].items() if files.get(name) == entry["digest"]}
    new = sorted(set(files) - set(kept))
    chunks = [new[i : i + CHUNK] for i in range(0, len(new), CHUNK)]
    if new:
        say(f"Recording which lines the quick and slow tests of {len(new)} of {len(files)} test files run.")
    with tempfile.TemporaryDirectory(prefix="recording-") as scratch:
        root = copy_of(project, Path(scratch)) if new else project.root
        with ThreadPoolExecutor(jobs) as pool:
            running = [
                pool.submit(_run, project, root, chunk, root.parent / f"chunk{i}") for i, chunk in enumerate(chunks)
            ]
            for done, (chunk, future) in enumerate(zip(chunks, running, strict=True)):
                entries = future.result()
                for name in chunk:
                    own = [entry for entry in entries if entry["end"].partition("::")[0] == name]
                    kept[name] = {"digest": files[name], "tests": own}
                _combine(project, root, root.parent / f"chunk{done}", data)
                tests.write_text(json.dumps({"whole": whole, "files": kept}))
                say(f"  {done + 1} of {len(chunks)}: {len(entries)} tests")
    ran = [entry for kept_file in kept.values() for entry in kept_file["tests"] if not entry["skipped"]]
    return Recording(
        {entry["end"]: entry["seconds"] for entry in ran if entry["failure"] is None},
        {entry["end"]: entry["failure"] for entry in ran if entry["failure"] is not None},
        data,
        frozenset(entry["end"] for entry in ran if entry["kind"] == "slow"),
    )


SETTINGS = """[run]
source = {package}
data_file = {data}
parallel = true
patch = fork, _exit
disable_warnings = no-data-collected, module-not-imported, module-not-measured, couldnt-parse, no-ctracer
"""


def _run(project: Project, root: Path, files: list[str], folder: Path) -> list[dict[str, Any]]:
    """One pytest process; the ends of its tests as journalled."""
    folder.mkdir()
    settings = SETTINGS.format(package=root / project.package, data=folder / "coverage")
    (folder / "own.ini").write_text(settings)
    (folder / "started.ini").write_text(settings + "context = ${MUTANTS_TEST-}\n")
    plan = {"journal": str(folder / "journal"), "tests": None, "kinds": ["quick", "slow"], "spent": 1e9}
    (folder / "plan.json").write_text(json.dumps({**plan, "coverage": str(folder / "started.ini")}))
    command = [sys.executable, "-m", "coverage", "run", f"--rcfile={folder / 'own.ini'}", "-m", "pytest", "-q"]
    command += ["-p", "tests.mutation.steering", "-p", "no:cacheprovider", f"--basetemp={folder / 'temp'}", *files]
    variables = environment(project, root, folder / "plan.json")
    done = subprocess.run(command, cwd=root, env=variables, capture_output=True, text=True, check=False)
    if done.returncode not in {0, 1, 5}:  # all passed, some failed, none collected
        said = done.stdout[-3000:] + done.stderr[-2000:]
        raise RuntimeError(f"recording of {' '.join(files)} ended with {done.returncode}:\n{said}")
    return [entry for entry in journal(folder / "journal") if "end" in entry]


def _combine(project: Project, root: Path, folder: Path, data: Path) -> None:
    """Add what was recorded in a copy to what is kept, under the names of the original files."""
    settings = folder / "combining.ini"
    settings.write_text(f"[paths]\nsource =\n    {project.root}\n    {root}\n")
    command = [sys.executable, "-m", "coverage", "combine", f"--rcfile={settings}", "--quiet", "--append"]
    subprocess.run([*command, f"--data-file={data}", str(folder)], cwd=root, check=True)


def _files(root: Path, folders: Iterable[str]) -> list[Path]:
    found = [path for folder in folders for path in sorted((root / folder).rglob("*")) if path.is_file()]
    return [path for path in found if "__pycache__" not in path.parts and path.suffix != ".pyc"]


def _digest(paths: Iterable[Path]) -> str:
    return sha256(b"".join(sha256(path.read_bytes()).digest() for path in paths)).hexdigest()
