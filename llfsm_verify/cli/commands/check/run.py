"""`llfsm check`: the checks that a change touches, each arrangement with the properties that stand beside it."""

from __future__ import annotations

import gc
import os
import re
import signal
from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from typing import NoReturn

from llfsm_verify.arrangement.files import MAX_FILE_BYTES, read_source
from llfsm_verify.arrangement.formats import ARRANGEMENTS
from llfsm_verify.arrangement.kinds import kind_of
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.cli import INTERRUPTED, UNKNOWN, report_failure
from llfsm_verify.cli.commands.check.forks import Forks
from llfsm_verify.cli.inputs import files_read
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from llfsm_verify.cli.opening import open_arrangement, told
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, hint_of_near, without_controls
from llfsm_verify.engines.explicit.options import ExplicitOptions
from llfsm_verify.limits import Limits, default_memory, processors
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import names_file
from llfsm_verify.logic.reading import read_source as read_property_source
from llfsm_verify.verification.verify import verify

ORDER = (70, 130, 5, 3, 1, 4, 0)
"""Exit codes, the most important one first."""
AHEAD = (
    "llfsm_verify.arrangement.formats.documents", "llfsm_verify.arrangement.formats.yaml",
    "llfsm_verify.arrangement.resolve.arrangement", "llfsm_verify.engines.explicit.engine",
    "llfsm_verify.kripke.sharing",
    "llfsm_verify.report.text", "llfsm_verify.verification.harness", "llfsm_verify.verification.portfolio", "yaml",
)  # fmt: skip
"""Modules that each check imports, or most."""
_MACHINES = re.compile(r"^machines[ \t]*:", re.MULTILINE)


def run(options: Namespace) -> int:
    """The most important exit code over all arrangements; 0 where nothing is to be checked.

    Raises DiagnosticError for a path that is not there (E001) and a folder that cannot be read (E002).
    """
    output = Output(options.color, options.width)
    paths = _arrangements(options.paths)
    jobs = min(options.jobs or processors(), len(paths))
    codes = {0}
    for code in _in_turn(paths, options, output) if jobs <= 1 else _at_once(paths, jobs, options, output):
        codes.add(code)
        if output.closed or code == INTERRUPTED:
            break
    return next(code for code in ORDER if code in codes)


def _in_turn(paths: Sequence[Path], options: Namespace, output: Output) -> Iterator[int]:
    """Check one arrangement after the other; the exit code of each."""
    wanted = Options(own=(ExplicitOptions(jobs=options.jobs),))
    return (_checked(path, wanted, options, output) for path in paths)


def _at_once(paths: Sequence[Path], jobs: int, options: Namespace, output: Output) -> Iterator[int]:
    """The same in so many processes at a time, which share the memory and print in the order of the arrangements."""
    wanted = Options(Limits(memory=default_memory() // jobs), own=(ExplicitOptions(jobs=1),))
    assert output.width  # that of our terminal, which forks do not see
    import_ahead()
    forks = Forks(len(paths), jobs, lambda number: _checked(paths[number], wanted, options, output))
    for done in forks.results():
        output.plain(done.said)
        if done.code < 0:
            message = f"the check was ended by the signal {-done.code} ({signal.strsignal(-done.code)})"
            hint = "where memory is short, `--jobs 1` checks one arrangement at a time"
            tell(Diagnostic("E429", message, hint=hint, file=str(paths[done.number])))
        yield done.code if done.code >= 0 else UNKNOWN


def import_ahead() -> None:
    """Import what most checks use, once for all forks; the kernels as well."""
    for name in AHEAD:
        import_module(name)
    from llfsm_verify.kripke.compiled import kernels

    kernels().load("explore_1", "explore_2", "explore_cycles", "cycle_pairs", "rebuild", "rehash", "spread")
    gc.freeze()  # else the collectors of forks write to all memory that they share


def _checked(path: Path, wanted: Options, options: Namespace, output: Output) -> int:
    """Check one arrangement, and show the result; the exit code."""
    properties = properties_beside(path)
    title = " ".join(map(str, [path, *properties]))
    try:
        result = _check(path, properties, wanted, quiet=options.quiet)
    except Exception as error:  # noqa: BLE001 - what is wrong with one arrangement does not hide the others
        return report_failure(error, options, str(path))
    _show(title, result, output, quiet=options.quiet)
    return result.exit_code


def properties_beside(arrangement: Path) -> list[Path]:
    """The property files of `X.yaml`: `X.ltl`, and for `arrangement.yaml` also `properties.ltl`, where they are."""
    named = [arrangement.with_suffix(".ltl")]
    if arrangement.stem == "arrangement":
        named.append(arrangement.with_name("properties.ltl"))
    return [path for path in named if path.is_file()]


def _check(path: Path, properties: Sequence[Path], wanted: Options, *, quiet: bool) -> Result:
    arrangement = open_arrangement(str(path))
    asked = told(parse_properties([read_property_source(file) for file in properties]), arrangement)
    with EarlyVerdicts((p.name for p in asked.goals), str(path)) as early:
        return verify(arrangement, asked, replace(wanted, decided=None if quiet else early.add))


def _show(title: str, result: Result, output: Output, *, quiet: bool) -> None:
    """A line when all is well, unless that is to be `quiet`; else a line for each verdict that is not `holds`."""
    from llfsm_verify.report.text import failures

    if result.exit_code:
        output.plain(f"fails  {title}\n")
        output.rich(failures(result))
        output.plain(f"  `llfsm verify {title}` shows the runs\n")
    elif not quiet:
        count = len(result.properties)
        output.plain(f"holds  {title}: {count} propert{'y' if count == 1 else 'ies'}, no faults\n")


# ---------------------------------------------------------------- what is to be checked


def _arrangements(names: Sequence[str]) -> list[Path]:
    """Every arrangement that one of the paths is, holds (a folder), or belongs to."""
    found: dict[Path, Path] = {}
    for name in names:
        path = Path(name)
        if not name or not path.exists():
            hint = hint_of_near(path)
            raise DiagnosticError(Diagnostic("E001", "there is no such file", file=name or "<empty path>", hint=hint))
        if path.is_file() and ARRANGEMENTS.named_by(name) not in (None, *ARRANGEMENTS.ours):
            new = [path]  # in a format of another package
        else:
            new = list(filter(is_arrangement, _below(path)) if path.is_dir() else find_owners(path))
        if not new and names_file(name):
            note = f"note: {path} belongs to no arrangement, so it was not checked; "
            tell(without_controls(f"{note}`llfsm verify ARRANGEMENT {path}` checks it"))
        elif not new and _is_sweep(path):
            tell(without_controls(f"note: {path} is a sweep, so it was not checked; `llfsm sweep {path}` checks it"))
        for arrangement in new:
            found.setdefault(arrangement.resolve(), arrangement)
    return list(found.values())


def _below(folder: Path) -> Iterator[Path]:
    """The files in a folder and in all below it, but for what is hidden (`.git`, `.venv`)."""
    for name, folders, texts in os.walk(folder, onerror=_unreadable):
        folders[:] = sorted(each for each in folders if not each.startswith("."))
        yield from (Path(name) / each for each in sorted(texts) if not each.startswith("."))


def _unreadable(error: OSError) -> NoReturn:
    reason = error.strerror or "input/output error"
    message = f"the folder cannot be read: {reason}"
    raise DiagnosticError(Diagnostic("E002", message, file=str(error.filename))) from None


def find_owners(path: Path) -> Iterator[Path]:
    """The arrangements that read the file at `path`, in its folder and in those above, up to where we are."""
    if is_arrangement(path):
        yield path
        return
    here, target = Path.cwd().resolve(), path.resolve()
    for folder in target.parents:
        try:
            candidates = sorted(folder.iterdir())
        except OSError as error:
            _unreadable(error)
        for candidate in filter(is_arrangement, candidates):
            files = files_read(candidate, properties_beside(candidate))
            if any(file.resolve() == target for file in files):
                yield candidate.relative_to(here) if candidate.is_relative_to(here) else candidate
        if folder == here or here not in folder.parents:
            return


def is_arrangement(path: Path) -> bool:
    """Whether the file looks like an arrangement: the YAML of other tools is not looked at."""
    if path.suffix not in ARRANGEMENTS.suffixes or not path.is_file():
        return False
    try:
        source, _ = read_source(path)
    except DiagnosticError:
        # One of ours in another encoding, say, is no pass: loading it tells what is wrong.
        return _has_machines(path)
    looks = kind_of(source) == "arrangement" and _MACHINES.search(source.text) is not None
    return looks or ARRANGEMENTS.told_by(source.text) is not None


def _is_sweep(path: Path) -> bool:
    try:
        return path.suffix in ARRANGEMENTS.suffixes and kind_of(read_source(path, regular=True)[0]) == "sweep"
    except DiagnosticError:
        return False


def _has_machines(path: Path) -> bool:
    """The same of a file that cannot be read as text."""
    try:
        with path.open(encoding="latin-1") as file:
            return _MACHINES.search(file.read(MAX_FILE_BYTES)) is not None
    except OSError:
        return True
