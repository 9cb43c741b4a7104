"""The files that a command is to write: looked at before its work begins, so that no input is replaced and no work
lost, and written as a whole or not at all."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.files import replacing, special_kind, unfinished

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.logic.properties import PropertySet

KINDS = {"arrangement": "the arrangement", "machine": "one of its machines"}
"""What an input is called; the others are properties."""


def ready(
    arrangement: Arrangement,
    properties: PropertySet | None,
    output: str | None,
    codes: tuple[str, str],
    what: str,
    *,
    whole: bool = False,
) -> None:
    """Raises DiagnosticError when `output`, which is for `what` ("the drawing"), is a file that has been read (the
    first of `codes`), or when nothing can be written there (the second). None and "-" are standard output.

    `whole`: what is written is of use as a file only, so a pipe or device is refused.
    """
    if output is None or output == "-":
        return
    for kind, name in _inputs(arrangement, properties):
        spare(name, KINDS.get(kind, "one of the properties"), output, codes[0], what)
    if whole:
        _refuse_special(Path(output), codes[1], what)
    try_place(output, codes[1], what)


def spare(name: str, is_what: str, output: str, code: str, what: str) -> None:
    """Raises DiagnosticError (`code`) when the input `name` is the file that would be written."""
    if is_same_file(name, output):
        message = f"{name} is {is_what}, and {what} would replace it"
        raise DiagnosticError(Diagnostic(code, message, hint="name another file", file=output))


def ready_beside(names: Iterable[str], output: str | None, code: str, what: str) -> None:
    """`ready` for a command whose inputs are `names`, as far as they are files."""
    if output is None or output == "-":
        return
    for name in names:
        spare(name, "an input", output, code, what)
    try_place(output, code, what)


def _refuse_special(path: Path, code: str, what: str) -> None:
    try:
        kind = special_kind(path.stat().st_mode)
    except (OSError, ValueError):
        return  # nothing is there, or `try_place` says more
    if kind is not None and not path.is_dir():
        hint = "name a file that is not there yet"
        raise DiagnosticError(
            Diagnostic(code, f"{path} is {kind}, and {what} must be a file", hint=hint, file=str(path))
        )


def traces_ready(
    arrangement: Arrangement, properties: PropertySet, directory: str | None, formats: Sequence[str] = ()
) -> None:
    """Raises DiagnosticError (E405) when traces saved in `directory`, also in these formats of timelines, might replace
    an input or a file that is no trace, or when they cannot be saved there. ModuleNotFoundError: a format needs it."""
    if directory is None:
        return
    from llfsm_verify.report.saving import SUFFIX, refuse_others, refuse_special

    folder = Path(directory)
    for kind, name in _inputs(arrangement, properties):
        if name.endswith(SUFFIX) and is_same_file(str(Path(name).parent), directory):
            message = f"{name} is {KINDS.get(kind, 'one of the properties')}, and has the name of a trace"
            hint = "name another folder, or give that file another name"
            raise DiagnosticError(Diagnostic("E405", message, hint=hint, file=directory))
    names = {goal.name for goal in properties.goals}
    there = folder.glob(f"*{SUFFIX}")
    ours = [p for p in there if p.name.partition(".")[0] in names or p.name.startswith("fault-")]
    refuse_special(ours)
    refuse_others(ours)
    if formats:
        from llfsm_verify.report.timeline.saving import refuse_strangers, try_formats

        try_formats(formats)
        refuse_strangers(folder, formats, names)
    try_place(str(folder / f"any{SUFFIX}"), "E405", "traces", made=True)


def try_place(output: str, code: str, what: str, *, made: bool = False) -> None:
    """Raises DiagnosticError (`code`) when no file can be written beside `output`. `made`: folders are made later.

    A pipe or device is left alone: opening it may already be too much.
    """
    try:
        path = Path(output)
        if path.is_dir():
            raise DiagnosticError(Diagnostic(code, f"{what} cannot be written there: Is a directory", file=output))
        if is_special(path):
            return
        path = path.resolve()
        folder = path.parent
        while made and not folder.exists():
            folder = folder.parent
        with unfinished(folder / path.name):
            pass
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "input/output error"
        message = f"{what} cannot be {'saved' if made else 'written'} there: {reason}"
        raise DiagnosticError(Diagnostic(code, message, file=str(path.parent) if made else output)) from None


def _inputs(arrangement: Arrangement, properties: PropertySet | None) -> Iterator[tuple[str, str]]:
    """Kind and name of each file that has been read."""
    from llfsm_verify.analysis.certificates.inputs import input_files
    from llfsm_verify.logic.properties import PropertySet

    for kind, read in input_files(arrangement, properties or PropertySet()):
        yield kind, read.name if isinstance(read, Source) else str(read)


def announce(path: Path) -> None:
    """Say where a trace is; one that is too long to be read again is said to be so."""
    from llfsm_verify.verification.tracefile import read_trace_file

    tell(f"trace saved: {path}")
    try:
        read_trace_file(path)
    except DiagnosticError as error:
        first = error.diagnostics[0]
        tell(Diagnostic("W401", f"it cannot be replayed: {first.message}", file=str(path)))


def write_whole(content: str | bytes | Callable[[BinaryIO], None], output: str | None, code: str, what: str) -> None:
    """Write `content`, or what it writes, to the file `output`, or, if that is text, to standard output (None, "-").

    A file appears, or is replaced, when it is whole; a pipe or device is written as it is. DiagnosticError with `code`:
    `what` ("the drawing") cannot be written there; E412: standard output cannot.
    """
    if isinstance(content, str) and output in (None, "-"):
        Output().plain(content)
        return
    if output is None or output == "-":
        assert callable(content), "bytes go to files"
        buffer = io.BytesIO()
        content(buffer)
        Output().plain(buffer.getvalue().decode("utf-8"))
        return
    try:
        path = Path(output)
        with path.open("wb") if is_special(path) else replacing(path.resolve()) as file:  # a link stays one
            if callable(content):
                content(file)
            else:
                file.write(content.encode() if isinstance(content, str) else content)
    except OSError as e:
        reason = e.strerror or "input/output error"
        message = f"{what} cannot be written there: {reason}"
        raise DiagnosticError(Diagnostic(code, message, file=output)) from None


def is_special(path: Path) -> bool:
    """Whether there is a pipe or device, which must be written as it is (or a folder, which cannot be written)."""
    return path.exists() and not path.is_file()


def is_same_file(name: str, other: str) -> bool:
    """Both names are those of one file; False also where one of them is not there."""
    try:
        return Path(name).samefile(other)
    except (OSError, ValueError):
        return False
