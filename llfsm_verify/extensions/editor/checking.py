"""The check of one property, as a lens asks for it: its verdict in a few words, and a page of the trace.

This runs in a child process (`child.py`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from llfsm_verify import DiagnosticError, Progress, Verdict
from llfsm_verify.plug import (
    REPORTS,
    Arrangement,
    Limits,
    Options,
    Result,
    Style,
    counted,
    load_arrangement,
    parse_properties,
    read_properties,
    verdict_text,
    verify,
)

PAGE = "html"


@dataclass(frozen=True, slots=True)
class Wanted:
    """A property of an arrangement with its property files, and the seconds that a check may take."""

    arrangement: str
    properties: tuple[str, ...]
    name: str
    seconds: float


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of it. `page` is a page for browsers; where there is none, `without` says why."""

    verdict: str
    text: str
    page: str | None = None
    without: str = ""


def check(wanted: Wanted, tell: Callable[[str], None]) -> Checked:
    """The verdict on one property; what is wrong with the files is told as one that is unknown."""
    try:
        arrangement = load_arrangement(wanted.arrangement)
        asked = parse_properties([read_properties(file) for file in wanted.properties])
        chosen = tuple(line for line in asked if line.kind == "assume" or line.name == wanted.name)
        if not any(line.kind != "assume" for line in chosen):
            return Checked("unknown", f"there is no property `{wanted.name}` any more")

        def progress(known: Progress) -> None:
            tell(known.doing or f"{counted(known.states, 'configuration')}, {known.seconds:.0f} s")

        options = Options(Limits(timeout=wanted.seconds), faults=False, progress=progress)
        result = verify(arrangement, replace(asked, properties=chosen), options)
    except DiagnosticError as error:
        return Checked("unknown", f"{error.diagnostics[0].code}: {error.diagnostics[0].message}")
    item = result.properties[0]
    said = verdict_text(result, item)
    if item.verdict is Verdict.UNKNOWN:
        return Checked("unknown", item.reason or said)
    page, without = _page(result, arrangement) if item.verdict is Verdict.VIOLATED else (None, "it is not violated")
    return Checked(item.verdict.value, said, page, without)


def _page(result: Result, arrangement: Arrangement) -> tuple[str | None, str]:
    """The page of a result, or why there is none."""
    if PAGE not in REPORTS.result:
        return None, "this installation has no extension that makes pages (`llfsm_verify/extensions/view`)"
    try:
        written = REPORTS.result.load(PAGE)(result, arrangement, Style())
    except ModuleNotFoundError as error:
        package = REPORTS.result[PAGE].package
        name = error.name if package is None else package.name
        return None, f"pages need the package {name}: install it with `pip install {name}`"
    return (written, "") if isinstance(written, str) else (None, "the page has several parts")
