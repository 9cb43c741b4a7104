"""The fixture `check`: properties in a test, answered and shown as on the command line. The run that fails a check is
saved as a trace file, which goes on failing until the model is mended.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify import DiagnosticError, SweepRows, Verdict, sweep
from llfsm_verify.extensions.pytest_plugin.session import failure, session_of, width, without_traceback
from llfsm_verify.extensions.pytest_plugin.texts import SAVE
from llfsm_verify.plug import (
    DEFAULT_ENGINE,
    ENGINES,
    Arrangement,
    FaultResult,
    GivenLines,
    Limits,
    Options,
    PropertyResult,
    PropertySet,
    Result,
    Trace,
    Unregistered,
    asked_text,
    fault_text,
    has_header,
    parse_properties,
    plain_text,
    read_properties,
    result_text,
    trace_documents,
    vacuity_texts,
)
from llfsm_verify.testing.failure import keep_trace
from llfsm_verify.testing.stretches import Wrapper, unwrap

if TYPE_CHECKING:
    import pytest


PACKAGE = Path(__file__).parent
INTERRUPTED = 130
MOST_ROWS = 20
"""Of those that fail a sweep, how many are told."""


class Check:
    """Checks properties of one arrangement: that of the fixture `arrangement`, unless `on` names another."""

    def __init__(self, request: pytest.FixtureRequest, arrangement: Arrangement | None = None) -> None:
        self._request = request
        self._config = request.config
        self._given = arrangement

    def on(self, arrangement: Arrangement | Wrapper | str | Path) -> Check:
        """The same for another arrangement; a relative path is taken from the folder of the test file."""
        __tracebackhide__ = True
        if not isinstance(arrangement, str | Path):
            return Check(self._request, unwrap(arrangement))
        with without_traceback(self._config):
            return Check(self._request, session_of(self._config).arrangement(self._folder / arrangement))

    def holds(
        self,
        *properties: str,
        assume: str | Sequence[str] = (),
        faults: bool = True,
        strict: bool = False,
        allow_contradiction: bool = False,
        engine: str = DEFAULT_ENGINE,
        max_states: int | None = None,
        memory: int | None = None,
        timeout: float | None = None,
    ) -> Result:
        """Fails unless every property holds, and no run ends in a fault (`faults=False`: on fault-free runs).

        `properties` and `assume` are lines of a property file; a name may be left out. The limits are configurations,
        bytes and seconds: what they leave undecided fails. `strict` fails passes that are empty, as `--strict` does.
        Where no run satisfies the assumptions, a property is unknown and fails; with `allow_contradiction` it holds. A
        failing run is saved where `--llfsm-save` says.
        """
        __tracebackhide__ = True
        options = _options(Limits(max_states, memory, timeout), strict=strict, contradiction=allow_contradiction)
        with without_traceback(self._config):
            found = self._properties(properties, (assume,) if isinstance(assume, str) else assume)
            result = self._result(found, options, engine)
            self._judge(result, found, frozenset(), faults=faults)
        return result

    def violated(
        self,
        *properties: str,
        assume: str | Sequence[str] = (),
        engine: str = DEFAULT_ENGINE,
        max_states: int | None = None,
        memory: int | None = None,
        timeout: float | None = None,
    ) -> tuple[Trace, ...]:
        """Fails unless every property is violated; the run that violates each. The arguments are those of `holds`."""
        __tracebackhide__ = True
        options = Options(Limits(max_states, memory, timeout))
        with without_traceback(self._config):
            found = self._properties(properties, (assume,) if isinstance(assume, str) else assume)
            result = self._result(found, options, engine)
            self._judge(result, found, frozenset(p.name for p in found.goals), faults=False)
        return tuple(item.trace for item in result.properties if item.trace is not None)

    def file(
        self,
        path: str | Path,
        *,
        violated: Sequence[str] = (),
        faults: bool = True,
        strict: bool = False,
        accept_vacuity: Sequence[str] = (),
        allow_contradiction: bool = False,
        engine: str = DEFAULT_ENGINE,
        max_states: int | None = None,
        memory: int | None = None,
        timeout: float | None = None,
    ) -> Result:
        """Fails unless every property of a file holds, but for those named in `violated`, which must be violated.

        A relative path is taken from the folder of the test file. With `strict`, the properties named in
        `accept_vacuity` may hold vacuously. The other arguments are those of `holds`.
        """
        __tracebackhide__ = True
        limits = Limits(max_states, memory, timeout)
        options = _options(limits, strict=strict, accepted=accept_vacuity, contradiction=allow_contradiction)
        with without_traceback(self._config):
            found = parse_properties([read_properties(self._folder / path)])
            unknown = sorted({*violated, *accept_vacuity} - {p.name for p in found.goals})
            if unknown:
                raise failure([f"{path} has no property {', '.join(f'`{name}`' for name in unknown)}"], self._config)
            result = self._result(found, options, engine)
            self._judge(result, found, frozenset(violated), faults=faults)
        return result

    def sweep(
        self,
        given: str | Path | Mapping[str, object],
        *,
        violated: Sequence[str] = (),
        jobs: int | None = None,
        scheduler: str | None = None,
        results: str | Path | None = None,
        timeout: float | None = None,
        memory: int | str | None = None,
    ) -> SweepRows:
        """Fails unless each row of a sweep holds, but for the arrangements named in `violated`, each of which must be
        violated in some row. A relative path is taken from the folder of the test file, paths in a mapping from where
        pytest runs. The other arguments are those of `llfsm_verify.sweep`.
        """
        __tracebackhide__ = True
        path = given if isinstance(given, Mapping) else self._folder / given
        violated = [violated] if isinstance(violated, str) else violated
        with without_traceback(self._config):
            rows = sweep(path, jobs=jobs, scheduler=scheduler, results=results, timeout=timeout, memory=memory)
            wrong = [
                f"row {number} is {row.verdict}: {', '.join(f'{name} = {value}' for name, value in row.values.items())}"
                for number, row in enumerate(rows, 1)
                if row.exit_code not in ((0, 1) if row.values["arrangement"] in violated else (0,))
            ]
            caught = {row.values["arrangement"] for row in rows if row.verdict == "violated"}
            wrong += [
                f"no row of {name} is violated, and one was expected to be" for name in violated if name not in caught
            ]
            if wrong or rows.exit_code == INTERRUPTED:
                raise failure([*wrong[:MOST_ROWS], f"asked at {self._place()}", "", str(rows).rstrip()], self._config)
        return rows

    # ------------------------------------------------------------ asking

    @property
    def _folder(self) -> Path:
        return Path(self._request.path).parent

    def _arrangement(self) -> Arrangement:
        __tracebackhide__ = True
        if self._given is None:
            arrangement = self._request.getfixturevalue("arrangement")
            try:
                self._given = unwrap(arrangement)
            except TypeError:
                what = "the fixture `arrangement` returns something else than an arrangement"
                raise failure([what], self._config) from None
        return self._given

    def _properties(self, properties: Sequence[str], assume: Sequence[str]) -> PropertySet:
        """The lines as properties. A formula without a name is called after the test."""
        __tracebackhide__ = True
        if not properties:
            raise failure(["a check needs a property, such as check.holds('G !(a@GREEN && b@GREEN)')"], self._config)
        named = [
            text if has_header(text.lstrip()) else f"assumption_{number}: {text}"
            for number, text in enumerate(assume, 1)
        ]
        lines = [*properties, *(text if text.lstrip().startswith("assume ") else f"assume {text}" for text in named)]
        # Automata are looked up from the folder of the test file.
        source = GivenLines(str(self._folder / "<check>"), lines)
        parsed = parse_properties([source])
        bare = [p.name for p in parsed if p.kind == "ltl" and re.fullmatch(r"L\d+", p.name)]
        names = {}
        for number, name in enumerate(bare, 1):
            names[name] = self._test_name if len(bare) == 1 else f"{self._test_name}-{number}"
        return PropertySet(tuple(replace(p, name=names.get(p.name, p.name)) for p in parsed))

    @property
    def _test_name(self) -> str:
        return re.sub(r"[^A-Za-z0-9_]+", "-", str(self._request.node.name)).strip("-")

    def _result(self, properties: PropertySet, options: Options, engine: str) -> Result:
        __tracebackhide__ = True
        try:
            ENGINES.entry(engine)
        except Unregistered as error:
            raise failure([str(error)], self._config) from None
        return session_of(self._config).result(self._arrangement(), properties, options, engine)

    # ------------------------------------------------------------ answering

    def _judge(self, result: Result, properties: PropertySet, violated: frozenset[str], *, faults: bool) -> None:
        """End the test with the text of the command line when a verdict is another one than wanted."""
        __tracebackhide__ = True
        headlines: list[str] = []
        for item in result.properties:
            wanted = Verdict.VIOLATED if item.name in violated else Verdict.HOLDS
            if item.verdict is not wanted:
                headlines.append(_headline(item, wanted))
            elif result.is_empty(item) or result.is_unseen(item):
                headlines.append(
                    "; ".join([f"{item.name} holds: {asked_text(item.kind, item.text)}", *vacuity_texts(result, item)])
                )
        if faults and result.faults.verdict is not Verdict.HOLDS:
            headlines.append(f"faults: {result.faults.verdict.value}: {fault_text(result)}")
        if not headlines:
            return
        shown = plain_text(result_text(result), width(self._config)).rstrip()
        try:
            saved = save_failure(result, self._arrangement(), properties, violated, self._request, faults=faults)
        except DiagnosticError as error:
            saved = [d.render() for d in error.diagnostics]
        raise failure([*headlines, f"asked at {self._place()}", "", shown, *saved], self._config)

    def _place(self) -> str:
        """The line of the test that called."""
        frame = sys._getframe()
        while frame.f_back is not None and Path(frame.f_code.co_filename).parent == PACKAGE:
            frame = frame.f_back
        return f"{frame.f_code.co_filename}:{frame.f_lineno}"


def _options(limits: Limits, *, strict: bool, accepted: Sequence[str] = (), contradiction: bool) -> Options:
    return Options(
        limits,
        vacuity="all" if strict else "antecedents",
        strict=strict,
        accepted=frozenset(accepted),
        allow_contradiction=contradiction,
    )


def _headline(item: PropertyResult, wanted: Verdict) -> str:
    because = f" (because {item.reason})" if item.reason is not None else ""
    expected = ", and was expected to be violated" if wanted is Verdict.VIOLATED else ""
    words = item.verdict.value if item.verdict is Verdict.HOLDS else f"is {item.verdict.value}"
    return f"{item.name} {words}{expected}: {asked_text(item.kind, item.text)}{because}"


def save_failure(
    result: Result,
    arrangement: Arrangement,
    properties: PropertySet,
    violated: frozenset[str],
    request: pytest.FixtureRequest,
    *,
    faults: bool,
) -> list[str]:
    """Save the traces that were not expected where `--llfsm-save` or the ini key says; a line about each.

    A failure that a file of that name already shows is not saved a second time; another one gets a name with a number.
    Raises DiagnosticError (E405).
    """
    named = str(request.config.getoption(SAVE) or request.config.getini(SAVE))
    items = tuple(item for item in result.properties if item.trace is not None and item.name not in violated)
    unexpected = replace(result, properties=items, faults=result.faults if faults else _none(result.faults))
    if not named or not (items or unexpected.faults.findings):
        return []
    if not Path(arrangement.path).is_file():
        return ["no trace saved: the arrangement does not come from a file"]
    if _is_expected(request):
        return ["no trace saved: the test is marked xfail, and a saved run would fail by itself"]
    directory = Path(request.path).parent / named
    load = session_of(request.config).arrangement
    lines = []
    for name, what, text in trace_documents(unexpected, arrangement, properties, directory, "holds"):
        path, new = keep_trace(directory, name, what, text, arrangement, load)
        lines.append(f"trace saved{'' if new else ' before'}: {path}")
    return lines


def _is_expected(request: pytest.FixtureRequest) -> bool:
    """Whether a mark says that the test fails: not where its condition is a value that is false."""
    conditions = [mark.args or (mark.kwargs.get("condition", True),) for mark in request.node.iter_markers("xfail")]
    return not request.config.getoption("runxfail", default=False) and any(any(each) for each in conditions)


def _none(faults: FaultResult) -> FaultResult:
    return replace(faults, findings=())
