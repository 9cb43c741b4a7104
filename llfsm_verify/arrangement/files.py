"""Reading the user's files: size, encoding and everything a path can be besides a readable text file."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from llfsm_verify.arrangement.codes import HINTS
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span, hint_of_near
from llfsm_verify.files import read_start

MAX_FILE_BYTES = 4 * 1024 * 1024
STDIN = "<stdin>"
_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f]")
"""What comes before the space, but for white space."""


def _error(code: str, message: str, name: str, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, hint=hint or HINTS.get(code), file=name))


def read_source(path: str | Path, *, regular: bool = False) -> tuple[Source, bytes]:
    """The text of a UTF-8 file and its bytes. `regular`: a pipe or device is refused (E002), not waited for.

    Raises DiagnosticError: not there (E001), cannot be read (E002), a directory (E003), larger than 4 MiB (E004), not
    text (E005).
    """
    name = str(path)
    if not name or "\0" in name:
        raise _error("E001", "the path of a file is expected", name or "<empty path>")
    try:
        if Path(path).is_dir():
            raise _error("E003", "this is a directory, not a file", name, "name a .yaml file")
        data = read_start(path, MAX_FILE_BYTES + 1, regular=regular)
    except FileNotFoundError:
        raise _error("E001", "there is no such file", name, None if regular else hint_of_near(path)) from None
    except OSError as e:
        raise _error("E002", f"the file cannot be read: {e.strerror or 'input/output error'}", name) from None
    except ValueError:
        raise _error("E001", "this is not the path of a file", name) from None
    return source_of(data, name), data


def _near(path: Path, at: Span) -> str:
    """What to write for a file that is not there. Only names of files beside the one that names it, or below, are
    told."""
    folder = Path(at.source.name).parent
    inside = path.is_relative_to(folder) and ".." not in path.relative_to(folder).parts
    return (
        hint_of_near(path, folder) if inside else None
    ) or "check the path; it is relative to the file that names it"


def read_named(path: str | Path, at: Span, what: str) -> tuple[Source, bytes]:
    """The same for a file that another file names, `at` that place: `what` it is (``machine file `M.yaml```).

    Only a regular file is read, and no message says what is in it. Raises DiagnosticError as `read_source` does.
    """
    try:
        return read_source(path, regular=True)
    except DiagnosticError as e:
        found = e.diagnostics[0]
        message = "this is not UTF-8 text" if found.code == "E005" else found.message
        hint = _near(Path(path), at) if found.code == "E001" else found.hint
        raise DiagnosticError(replace(found, message=f"{what}: {message}", span=at, hint=hint)) from None


def read_stdin(stream: TextIO | None) -> tuple[Source, bytes]:
    """The same for standard input (or the text stream that takes its place)."""
    stream = stream or sys.stdin
    if stream is None:  # it was closed before we began
        raise _error("E002", "standard input is closed", STDIN)
    try:
        buffer = getattr(stream, "buffer", None)
        if buffer is not None:
            data = bytes(buffer.read(MAX_FILE_BYTES + 1))
        else:
            data = stream.read(MAX_FILE_BYTES + 1).encode("utf-8", "surrogatepass")
    except (OSError, ValueError):
        raise _error("E002", "standard input cannot be read", STDIN) from None
    return source_of(data, STDIN), data


def source_of(data: bytes, name: str) -> Source:
    """Decode `data`, which is the content of the file called `name`; a byte order mark is dropped."""
    if len(data) > MAX_FILE_BYTES:
        raise _error("E004", f"the file is larger than {MAX_FILE_BYTES // (1024 * 1024)} MiB", name)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        raise _error("E005", f"this is not UTF-8 text: byte {e.start} is 0x{data[e.start]:02X}", name) from None
    control = _CONTROL.search(text)
    if control is not None:
        shown = f"character {control.start()} is the control character U+{ord(control[0]):04X}"
        raise _error("E005", f"this is not a text file: {shown}", name)
    return Source(name, text)
