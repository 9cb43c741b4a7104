"""`llfsm-verify --watch`: the same check again whenever one of its files is saved."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from llfsm_verify.checking.verdict import FAULTS, Result
from llfsm_verify.cli.inputs import files_read
from llfsm_verify.cli.io.interrupt import INTERRUPTED
from llfsm_verify.cli.io.output import tell
from llfsm_verify.cli.kinds import by_kind
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.diagnostics import DiagnosticError, counted
from llfsm_verify.report.wording import verdict_text

INTERVAL = 0.25
"""Seconds between two looks at the files."""
PATIENCE = 4
"""Looks for which a file may be missing while an editor replaces it."""

Stamp = tuple[int, int, int] | None
"""Time, size and inode of a file; None: it is not there."""

CLEAR = "\x1b[H\x1b[2J\x1b[3J"
"""Empties a terminal, with what has scrolled away."""


class Checked(NamedTuple):
    """The exit code of a check, whether the reader of its output has gone, and the verdicts in words by name."""

    code: int
    gone: bool = False
    verdicts: Mapping[str, str] = MappingProxyType({})


def verdicts_of(result: Result) -> dict[str, str]:
    """What was found of each property, and of faults."""
    found = {item.name: verdict_text(result, item) for item in result.properties}
    return {**found, FAULTS: result.faults.verdict.value}


def changes(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    """Each verdict that is another one: ``never_stuck: violated → holds``."""
    for name, verdict in now.items():
        if name not in before:
            yield f"{name}: new, {verdict}"
        elif before[name] != verdict:
            yield f"{name}: {before[name]} → {verdict}"
    yield from (f"{name}: not asked any more" for name in before if name not in now)


def watch(options: Namespace, check: Callable[[Namespace], Checked]) -> int:
    """Check, and check again whenever a file has changed, until Ctrl-C (130) or until no one reads the output (0).

    A terminal is cleared before each check, and verdicts that have changed are said after it. Mistakes in files are
    shown, and the files watched on.
    """
    _refuse_misuse(options)
    do_more_tasks()
    known: dict[Path, Stamp] = {}
    before: Mapping[str, str] = {}
    while True:
        # Looked at before they are read: what changes meanwhile is checked again at once.
        known = stamps({**known, **dict.fromkeys(_files(options))})
        try:
            checked = check(options)
        except DiagnosticError as error:
            checked = Checked(0)
            for diagnostic in by_kind(error.diagnostics, options):
                tell(diagnostic.render())
        except UsageError as error:
            checked = Checked(0)
            tell(error.said())
        if checked.gone or checked.code == INTERRUPTED:
            return checked.code if checked.code == INTERRUPTED else 0
        if before and checked.verdicts:
            for change in changes(before, checked.verdicts):
                tell(change)
        before = checked.verdicts or before
        tell(f"watching {counted(len(known), 'file')}; Ctrl-C ends")
        changed = wait_for_change(known)
        if sys.stdout.isatty():
            print(CLEAR, end="", flush=True)
        tell(f"\n{time.strftime('%H:%M:%S')} changed: {', '.join(map(str, changed))}")


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: something does not go together with --watch."""
    if "-" in (options.arrangement, *options.properties):
        raise UsageError("--watch needs files, and standard input is not a file")
    if options.checkpoint is not None:
        raise UsageError("--watch and --checkpoint do not go together")
    if options.format != "text":
        raise UsageError("--watch reports as text")


def _files(options: Namespace) -> list[Path]:
    return files_read(options.arrangement, options.properties, options.property, options.syntax)


def stamps(files: Iterable[Path]) -> dict[Path, Stamp]:
    """What tells whether files have changed."""
    return {file: _stamp(file) for file in files}


def _stamp(file: Path) -> Stamp:
    try:
        status = file.stat()
    except (OSError, ValueError):
        return None
    return status.st_mtime_ns, status.st_size, status.st_ino


def wait_for_change(known: Mapping[Path, Stamp]) -> list[Path]:
    """Sleep until files are others than they were, and have stayed so for a look; those that changed.

    A file that is missing is waited for, for a while: editors replace files.
    """
    before, missing = dict(known), 0
    while True:
        time.sleep(INTERVAL)
        now = stamps(known)
        changed = [file for file in known if now[file] != known[file]]
        gone = [file for file in changed if now[file] is None]
        missing = missing + 1 if gone else 0
        if changed and now == before and (not gone or missing > PATIENCE):
            return changed
        before = now
