"""Writing something to a file as a whole or not at all."""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.cli.io.output import Output
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.files import replacing


def write_whole(content: str | bytes, output: str | None, code: str, what: str) -> None:
    """Write `content` to the file `output`, or, if it is text, to standard output (None, "-").

    A file appears, or is replaced, when it is whole; a pipe or device is written as it is. DiagnosticError with `code`:
    `what` ("the drawing") cannot be written there; E412: standard output cannot.
    """
    if output is None or output == "-":
        assert isinstance(content, str), "bytes go to files"
        Output().plain(content)
        return
    data = content.encode() if isinstance(content, str) else content
    try:
        if is_special(Path(output)):
            Path(output).write_bytes(data)
            return
        with replacing(Path(output).resolve()) as file:  # a link stays one
            file.write(data)
    except (OSError, ValueError) as e:
        reason = (e.strerror if isinstance(e, OSError) else None) or "input/output error"
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
