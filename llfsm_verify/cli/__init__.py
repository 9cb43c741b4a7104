"""The commands `llfsm` and `llfsm-verify`: arguments in, exit code out, never a Python traceback."""

from __future__ import annotations

import os
import sys
import time

# Nothing else is imported up here, not even typing: until `main` runs, Ctrl-C shows Python's traceback.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from argparse import ArgumentParser, Namespace
    from collections.abc import Sequence

    from llfsm_verify.diagnostics import Diagnostic

INTERNAL_ERROR, INTERRUPTED, DISAGREEMENT, BAD_INPUT, USAGE, VIOLATED, UNKNOWN = 70, 130, 5, 3, 2, 1, 4
"""The exit codes besides 0 (docs/command-line.md)."""

DEBUG = "LLFSM_DEBUG"
"""With this environment variable set to 1 an internal error shows its traceback."""

STARTED = time.perf_counter()
"""When this process began, but for the time in which Python starts."""

COMPLETES = "_ARGCOMPLETE"
"""Shells set this environment variable to ask how a command may go on (`llfsm completion`)."""

COLLECT_EVERY = 200_000
"""Objects made between two looks for garbage."""


def main(arguments: Sequence[str] | None = None) -> int:
    """The command `llfsm`; `arguments` are those of the process unless given. Returns the exit code."""
    return _command("llfsm", arguments)


def main_verify(arguments: Sequence[str] | None = None) -> int:
    """The command `llfsm-verify`, the same as `llfsm verify`."""
    return _command("llfsm-verify", arguments)


def _parser(name: str, words: Sequence[str]) -> ArgumentParser:
    from llfsm_verify.cli.commands import llfsm_parser, verify_parser

    return llfsm_parser(words) if name == "llfsm" else verify_parser()


def _command(name: str, arguments: Sequence[str] | None) -> int:
    """Parse and run. Signals are served only where the process is ours: a caller that gives arguments keeps its own."""
    if arguments is not None:
        return _guarded(name, arguments, time.perf_counter())
    try:
        if COMPLETES in os.environ:
            from argcomplete import autocomplete

            autocomplete(_parser(name, os.environ.get("COMP_LINE", "").split()[1:]))
        from llfsm_verify.cli.io import interrupt
        from llfsm_verify.cli.io.standard_error import drop_what_no_one_reads

        interrupt.serve()
        from llfsm_verify.collector import do_one_task

        do_one_task(COLLECT_EVERY)
        drop_what_no_one_reads()
        try:
            return _guarded(name, sys.argv[1:], STARTED)
        finally:
            interrupt.finish()
    except KeyboardInterrupt:
        return _interrupted()


def _guarded(name: str, words: Sequence[str], started: float) -> int:
    """Run the command that is written in `words`; whatever comes out of it is an exit code and at most a few lines.
    `started`: when it began."""
    from argparse import Namespace
    from pathlib import Path

    # Both are None where the caller has closed them.
    nowhere = Path(os.devnull)
    sys.stdout, sys.stderr = sys.stdout or nowhere.open("w"), sys.stderr or nowhere.open("w")
    for stream in (sys.stdout, sys.stderr):
        # A name that the terminal cannot show must not end a run.
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    options = Namespace()
    try:
        from llfsm_verify.cli.commands import COMMANDS

        _parser(name, words).parse_args(words, options)
        options.started = started
        code = COMMANDS.entry(options.command).run(options)
        sys.stdout.flush()
        return code
    except KeyboardInterrupt:
        return _interrupted()
    except BrokenPipeError:
        # The reader has seen enough. What is still buffered must not fail a second time at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except Exception as error:  # noqa: BLE001 - the one place where everything is caught, said and given its exit code
        return report_failure(error, options)


def _interrupted() -> int:
    from llfsm_verify.kept import forget_waiting

    forget_waiting()  # it would take a while
    print("interrupted", file=sys.stderr)
    return INTERRUPTED


def report_failure(error: Exception, options: Namespace, of: str = "") -> int:
    """Say what went wrong, `of` which file where there are several; the exit code for that."""
    from llfsm_verify.cli.missing import missing_package
    from llfsm_verify.cli.parser import UsageError
    from llfsm_verify.diagnostics import DiagnosticError
    from llfsm_verify.registry import Unusable

    if isinstance(error, Unusable):
        error = UsageError(str(error))
    if isinstance(error, UsageError):
        print(error.said(of), file=sys.stderr)
        return USAGE
    if isinstance(error, DiagnosticError):
        return _bad_input(options, error.diagnostics)
    if isinstance(error, MemoryError):
        advice = "--memory SIZE ends a search with its partial result before that"
        print(f"{of}{': ' * bool(of)}out of memory; {advice}", file=sys.stderr)
        return UNKNOWN
    missing = missing_package(error) if isinstance(error, ModuleNotFoundError) else None
    return _internal(error, of) if missing is None else _bad_input(options, [missing])


def _bad_input(options: Namespace, diagnostics: Sequence[Diagnostic]) -> int:
    """Say what is wrong with the files: to people on standard error, to programs that asked for JSON also as that."""
    from llfsm_verify.cli.kinds import by_kind
    from llfsm_verify.report.formats import REPORTS

    diagnostics = by_kind(diagnostics, options)
    for diagnostic in diagnostics:
        print(diagnostic.render(), file=sys.stderr)
    try:
        failed = REPORTS.failed(getattr(options, "format", None))
        if failed is not None:
            _write(failed(diagnostics, BAD_INPUT) + "\n")
    except Exception as error:  # noqa: BLE001 - what is wrong with the files has been said
        print(f"llfsm-verify: the report has no text for this ({type(error).__name__}: {error})", file=sys.stderr)
    return BAD_INPUT


def _write(text: str) -> None:
    """Write to standard output; where that fails, say so as well."""
    from llfsm_verify.cli.io.output import Output
    from llfsm_verify.diagnostics import DiagnosticError

    try:
        Output().plain(text)
    except DiagnosticError as error:
        print(error.diagnostics[0].render(), file=sys.stderr)


def _internal(error: Exception, of: str) -> int:
    """Say what to report. A check of a result that failed has an exit code of its own."""
    import traceback

    from llfsm_verify.diagnostics import Disagreement

    disagreement = isinstance(error, Disagreement)
    if os.environ.get(DEBUG) == "1":
        traceback.print_exc()
    place = traceback.extract_tb(error.__traceback__)[-1]
    what = "two parts of the toolkit disagree" if disagreement else f"internal error: {type(error).__name__}"
    text = " ".join(str(error).split())[:300]
    told = f"llfsm-verify: {of}{': ' * bool(of)}{what}"
    print(
        f"{told}: {text} ({place.name}, line {place.lineno}); this is our bug: please report this line "
        f"with your files ({DEBUG}=1 shows more)",
        file=sys.stderr,
    )
    return DISAGREEMENT if disagreement else INTERNAL_ERROR
