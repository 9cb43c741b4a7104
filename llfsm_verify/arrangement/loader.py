"""From an arrangement file, a text or Python data to a validated arrangement, or to everything wrong with it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TextIO

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.formats.data import draft_data
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import Span


def load_arrangement(
    path: str | Path,
    *,
    stdin: TextIO | None = None,
    integer_guards: bool = False,
    named_at: Span | None = None,
    format_name: str | None = None,
) -> Arrangement:
    """Read the arrangement file `path` (``-``: standard input) and the machine files it names.

    `named_at`: the path stands at this place in a file, so it is read with the care of `read_named`. `format_name`: one
    from `formats.ARRANGEMENTS` (None: the one that the ending of the path stands for). Raises DiagnosticError with
    everything found wrong, sorted by place, at most 50 diagnostics. Unregistered: there is no such format.
    """
    draft = read_arrangement(Given(path, stdin=stdin, named_at=named_at), format_name)
    return resolve(draft, integer_guards=integer_guards)


def load_arrangement_text(
    text: str, name: str = "<text>", *, integer_guards: bool = False, format_name: str | None = None
) -> Arrangement:
    """The same for a text; its machine files are looked up from the current directory."""
    return resolve(read_arrangement(Given(name, text), format_name), integer_guards=integer_guards)


def build_arrangement(document: Mapping[str, object], *, integer_guards: bool = False) -> Arrangement:
    """An arrangement from Python values in the shape of the file; machines by `inline` or `file`.

    `document` holds mappings, lists, strings, bools, ints and None. With `integer_guards` an integer where a condition
    is expected is read as `!= 0`, as in C. Raises DiagnosticError as `load_arrangement` does; places are such as
    `machines.ns.inline.states[0].name`.
    """
    return resolve(draft_data(document), integer_guards=integer_guards)
