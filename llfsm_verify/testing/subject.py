"""The front of random tests: an arrangement with properties, from files or from values, and its runs."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import names_file, read_source
from llfsm_verify.testing.run import Subject
from llfsm_verify.testing.wrapped import Wrapper, unwrap

Asked = str | Path | Sequence[str | Path]
"""Properties: the text of a property file, the path of one (a Path, or a str that ends in `.ltl`), or several."""


def load(arrangement: str | Path | Arrangement | Wrapper, properties: Asked = ()) -> Subject:
    """The arrangement of a file, or what `lv.load` or `lv.build` gives, with properties.

    Raises DiagnosticError: one of them is wrong.
    """
    if isinstance(arrangement, str | Path):
        from llfsm_verify.arrangement import load_arrangement

        found = load_arrangement(arrangement)
    else:
        found = unwrap(arrangement)
    given = [properties] if isinstance(properties, (str, Path)) else list(properties)
    sources = [read_source(p) if names_file(p) else Source("properties", str(p)) for p in given]
    return Subject(found, parse_properties(sources, features=CHECKED), given)


def found_beside(path: str | Path, folder: Path) -> str:
    """`path` as seen from here, when it is relative to `folder`; absolute paths stay."""
    whole = os.path.normpath(folder / path)
    here = os.path.relpath(whole)
    return whole if here.startswith(os.pardir) else Path(here).as_posix()
