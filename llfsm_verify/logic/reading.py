"""Reading a property file, or standard input, as text."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from itertools import accumulate
from pathlib import Path

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, hint_of_near
from llfsm_verify.files import read_start
from llfsm_verify.logic import codes

MAX_BYTES = 4 << 20


class GivenLines(Source):
    """Texts given one by one on a command line, as one source: so each has lines of its own to be named after.

    `starts` are the offsets at which they start: no property goes on from one to the next.
    """

    def __init__(self, name: str, texts: Sequence[str]) -> None:
        super().__init__(name, "\n".join(texts))
        lengths = (len(text) + 1 for text in texts[:-1])
        self.starts = tuple(accumulate(lengths, initial=0))
        self.texts = tuple(texts)


def read_source(path: str | os.PathLike[str], *, regular: bool = False) -> Source:
    """The UTF-8 text of the file at `path` (``-``: standard input). `regular`: a pipe or device is not waited for.

    DiagnosticError when there is no such text (E301 to E304).
    """
    name = os.fspath(path)
    try:
        if name == "-" and not regular:
            if sys.stdin is None:  # it was closed before we began
                raise _error(codes.UNREADABLE, "<stdin>", "standard input is closed")
            name, data = "<stdin>", sys.stdin.buffer.read(MAX_BYTES + 1)
        else:
            data = read_start(name, MAX_BYTES + 1, regular=regular)
    except IsADirectoryError:
        raise _error(codes.DIRECTORY, name, "this is a directory", "name a property file in it") from None
    except FileNotFoundError:
        hint = None if regular else hint_of_near(name)
        raise _error(codes.UNREADABLE, name, "there is no such file", hint) from None
    except (OSError, ValueError) as e:
        reason = e.strerror if isinstance(e, OSError) and e.strerror else str(e)
        raise _error(codes.UNREADABLE, name, f"cannot read the property file: {reason}") from None
    if len(data) > MAX_BYTES:
        raise _error(codes.FILE_TOO_LARGE, name, f"the property file is larger than {MAX_BYTES >> 20} MiB")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as e:
        raise _error(
            codes.NOT_TEXT, name, f"this is not UTF-8 text (byte {data[e.start]:#04x} at offset {e.start})",
            "save the file as UTF-8",
        ) from None  # fmt: skip
    if "\0" in text:
        raise _error(codes.NOT_TEXT, name, f"this is not text (NUL at offset {text.index(chr(0))})")
    return Source(name, text)


def _error(code: str, name: str, message: str, hint: str | None = None) -> DiagnosticError:
    return DiagnosticError(Diagnostic(code, message, hint=hint, file=name))


def names_file(text: str | Path) -> bool:
    """Whether properties are given by a path: a Path, or one line that ends in `.ltl`."""
    return isinstance(text, Path) or (text.endswith(".ltl") and "\n" not in text)
