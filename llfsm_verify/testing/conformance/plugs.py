"""Suites for formats of others: readers and writers of arrangements, logs, timelines, drawings, reports.

Each gives cases, as `engine_cases` does. What needs a file of the format is given one that is right.
"""

from __future__ import annotations

import io
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction
from functools import partial
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any, cast

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.formats import ARRANGEMENTS, WRITERS, Given
from llfsm_verify.arrangement.formats.writing import Writer
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.program.program import Int
from llfsm_verify.registry import Entry, Registry
from llfsm_verify.report.drawing.extract import arrangement_graph, machine_graph
from llfsm_verify.report.drawing.formats import DRAWINGS
from llfsm_verify.report.drawing.graph import Graph
from llfsm_verify.report.entry import ReportEntry
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.report.plain import plain_text
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.deciding.logs import LOGS, NoColumn, Row, Unreadable, Wanted
from llfsm_verify.runtime.recording.timeline import Row as Moment
from llfsm_verify.runtime.recording.timeline import Signal, Timeline
from llfsm_verify.runtime.stepping.random_run import RandomRun, Script
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.testing.conformance.known import SAMPLES
from llfsm_verify.testing.conformance.outcome import Case, Wrong
from llfsm_verify.values import Shown

ODD = "\x01\n\t\\\"'<&>{}[]:,;§´𝄞"
"""Characters that mean something in some format."""
STEPS = 60


def entry_of(found: Entry | str, registry: Registry[Any]) -> Entry:
    """The entry itself, or the registered one of this name. Unregistered."""
    return registry.entry(found) if isinstance(found, str) else found


def demand(truth: object, wrong: str) -> None:
    """Wrong: it is not so."""
    if not truth:
        raise Wrong(wrong)


# -------------------------------------------------- readers and writers of arrangements


def reader_cases(reader: Entry | str, text: str) -> list[Case]:
    """Of a reader of arrangements; `text` is an arrangement in its format, in one file. Unregistered."""
    entry = entry_of(reader, ARRANGEMENTS)
    name = f"a{entry.suffixes[0] if entry.suffixes else ''}"

    def read(given: Given) -> Draft:
        draft = cast("Callable[[Given], Draft]", entry.load())(given)
        demand(isinstance(draft, Draft), f"it gives a {type(draft).__name__}, not a draft")
        return draft

    def reads() -> None:
        with TemporaryDirectory() as folder:
            path = Path(folder, name)
            path.write_text(text, encoding="utf-8")
            draft = read(Given(path))
            demand(draft.path == str(path), "the path of the draft is not that of the file")
            demand(any(s.text == text for s in draft.sources), "no source of the draft has the text of the file")
            lower(resolve(draft))
            path.write_text(text + "\n", encoding="utf-8")
            demand(read(Given(path)).digest != draft.digest, "another text has the same digest")
            for same in (Given(f"nowhere/{name}", text), Given("-", stdin=io.StringIO(text))):
                demand(read(same).digest == draft.digest, "a text, or standard input, is not read as the file is")

    def misses() -> None:
        with TemporaryDirectory() as folder:
            try:
                read(Given(Path(folder, name)))
            except DiagnosticError:
                return
        raise Wrong("a file that is not there is no DiagnosticError")

    def survives() -> None:
        for cut in range(0, len(text), max(1, len(text) // 60)):
            for broken in (text[:cut], text[:cut] + ODD + text[cut:]):
                try:
                    lower(resolve(read(Given(name, broken))))
                except DiagnosticError as error:
                    demand(error.diagnostics, "what is wrong with a text is not said")

    return [
        Case("reads", "files, texts and standard input", reads),
        Case("missing", "a file that is not there", misses),
        Case("broken", "texts that are cut short or have odd characters", survives),
    ]


def writer_cases(writer: Entry | str, reader: Entry | str) -> list[Case]:
    """Of a writer of arrangements, by the reader of its format. Unregistered."""
    write, read = entry_of(writer, WRITERS), entry_of(reader, ARRANGEMENTS)

    def look(document: Mapping[str, object]) -> None:
        before = repr(document)
        text = cast("Writer", write.load()).arrangement(document)
        demand(isinstance(text, str), "it gives no text")
        demand(repr(document) == before, "it changes what it is given")
        again = resolve(cast("Callable[[Given], Draft]", read.load())(Given("a", text)))
        demand(_shown(again) == _shown(build_arrangement(document)), "it is read again as another arrangement")

    return [Case(name, "what is written is read again", partial(look, of)) for name, of in SAMPLES.items()]


def _shown(arrangement: Arrangement) -> object:
    """What a random run of it shows, without places."""
    execution = Execution(lower(arrangement, keep_all_bits=True))
    run = RandomRun(execution, Script(), random.Random(1))  # noqa: S311 - no secrets
    steps = [(s.process, s.machine, s.state, s.fired, s.changes) for s in run.steps(STEPS, None)]
    return arrangement.name, run.initial, steps


# -------------------------------------------------- logs


def log_cases(
    reader: Entry | str, path: str | Path, rows: Sequence[Mapping[str, str]], topic: str | None = None
) -> list[Case]:
    """Of a reader of logs. `path`: a log of its format with these rows, of this topic. Unregistered."""
    entry = entry_of(reader, LOGS)
    columns = sorted({name for row in rows for name in row})

    def read(wanted: Wanted, file: str | Path = path) -> list[Row]:
        return list(cast("Callable[[str, Wanted], Iterator[Row]]", entry.load())(str(file), wanted))

    def reads() -> None:
        for names in (columns, *([name] for name in columns)):
            cells = [dict(row.cells) for row in read(Wanted(names, topic))]
            given = [{name: row[name] for name in names if name in row} for row in rows]
            demand(cells == given, f"the rows with {', '.join(names)} are not those of the log")
        places = [row.place for row in read(Wanted(columns, topic))]
        demand(all(places) and len(set(places)) == len(places), "two rows have one place, or one has none")

    def names() -> None:
        for wanted in (Wanted(["no such name"], topic), Wanted(columns, "no such name")):
            try:
                read(wanted)
            except NoColumn as told:
                demand(told.name == "no such name", "what is missing is called otherwise")
            else:
                raise Wrong("a column or topic that is not there is no NoColumn")

    def survives() -> None:
        data = Path(path).read_bytes()
        with TemporaryDirectory() as folder:
            broken = Path(folder, Path(path).name)
            try:
                read(Wanted(columns, topic), broken)
            except OSError:
                pass
            else:
                raise Wrong("a log that is not there is no OSError")
            for cut in range(0, len(data), max(1, len(data) // 50)):
                for damaged in (data[:cut], data[:cut] + bytes([data[cut] ^ 0x81]) + data[cut + 1 :]):
                    broken.write_bytes(damaged)
                    with suppress(NoColumn, Unreadable, OSError):
                        read(Wanted(columns, topic), broken)

    return [
        Case("rows", "all rows, by column", reads),
        Case("names", "columns and topics that are not there", names),
        Case("damaged", "logs that are cut short or have a wrong byte", survives),
    ]


# -------------------------------------------------- timelines and drawings


def _timeline(cycle: Fraction | None, last: Shown = 7, loop: int | None = None) -> Timeline:
    signals = (
        Signal("m", "state", Int(0, 2), ("OFF", "ON", "a long name")),
        Signal("go", "input", Int(0, 1, boolean=True), ()),
        Signal("n[0].x", "variable", Int(-5, 300), ()),
        Signal("speed", "output", Int(0, 40, digits=1), ()),
    )

    def rows() -> Iterator[Moment]:
        yield Moment(0, 0, ("OFF", False, 0, Decimal("0.0")))
        for step, state in enumerate(("ON", "a long name", "ON"), 1):
            yield Moment(step, step, (state, step == 2, last if step == 3 else 0, Decimal(step) / 10), ("m: fired",))

    return Timeline("a run", signals, rows(), cycle, loop, begins=1)


def timeline_cases(writer: Entry | str) -> list[Case]:
    """Of a format of timelines. Unregistered."""
    entry = entry_of(writer, TIMELINES)

    def written(timeline: Timeline) -> bytes:
        file = io.BytesIO()
        cast("Callable[[Timeline, io.BytesIO], None]", entry.load())(timeline, file)
        demand(not file.closed, "it closes the file")
        return file.getvalue()

    def writes() -> None:
        demand(entry.suffixes, "no ending of files stands for it, and files beside traces need one")
        written(Timeline("", (), (), None))
        for of in ((Fraction(1500),), (None,), (Fraction(1, 3), 7, 2)):
            data = written(_timeline(*of))
            demand(data, "of a timeline with rows nothing is written")
            demand(data == written(_timeline(*of)), "the same timeline is written in two ways")
            if not entry.binary:
                data.decode("utf-8")
        other = written(_timeline(Fraction(1500), 8))
        demand(written(_timeline(Fraction(1500))) != other, "another value of a signal is not shown")

    return [Case("writes", "timelines of all kinds", writes)]


def drawing_cases(drawing: Entry | str) -> list[Case]:
    """Of a format of drawings. Unregistered."""
    entry = entry_of(drawing, DRAWINGS)

    def drawn(graph: Graph) -> str | bytes:
        found = cast("Callable[[Graph], str | bytes]", entry.load())(graph)
        demand(isinstance(found, str | bytes), f"it gives a {type(found).__name__}, neither text nor bytes")
        demand(not (entry.binary and isinstance(found, str)), "its entry says that it is not text")
        return found

    def draws() -> None:
        arrangement = build_arrangement(next(iter(SAMPLES.values())))
        whole = arrangement_graph(arrangement)
        odd = tuple(replace(node, title=ODD + node.title, lines=(ODD,)) for node in whole.nodes)
        graphs = [whole, machine_graph(arrangement.machines[0]), replace(whole, nodes=odd, title=ODD)]
        found = [drawn(graph) for graph in graphs]
        demand(all(found), "of a graph nothing is drawn")
        demand(found == [drawn(graph) for graph in graphs], "the same graph is drawn in two ways")
        demand(len(set(found)) == len(found), "two graphs have one drawing")

    return [Case("draws", "an arrangement, a machine, odd characters", draws)]


# -------------------------------------------------- reports


def subjects(kind: str) -> Mapping[str, Callable[[], tuple[object, ...]]]:
    """What reports of a kind are made of, by a name: two of them are different. KeyError: no such kind."""
    return _SUBJECTS[kind]()


def _with_style(*of: object) -> tuple[object, ...]:
    return *of, Style()


def _arrangements() -> Mapping[str, Arrangement]:
    return {name: build_arrangement(document) for name, document in SAMPLES.items()}


def _properties(text: str) -> PropertySet:
    return parse_properties([Source("asked.ltl", text)])


def _results() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.verification.verify import verify

    lamp, counter = _arrangements().values()
    asked = {
        "holds": (lamp, "a: G !(m@ON && m@OFF)"), "violated": (lamp, "a: G !lit"), "faults": (counter, "a: F a@STOP"),
        "nothing": (lamp, ""),
    }  # fmt: skip
    found = {name: (verify(of, _properties(text), Options()), of) for name, (of, text) in asked.items()}
    return {name: partial(_with_style, *pair) for name, pair in found.items()}


def _lints() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.analysis.lint.run import lint

    found = {name: (lint(of, Limits()), of) for name, of in _arrangements().items()}
    return {name: partial(_with_style, *pair) for name, pair in found.items()}


def _coverages() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.analysis.coverage.measure import coverage

    found = {name: (coverage(of), of) for name, of in _arrangements().items()}
    return {name: partial(_with_style, *pair) for name, pair in found.items()}


def _queries() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.verification.query import ask, parse_query

    lamp, _ = _arrangements().values()
    asked = {"reached": "lit", "never": "lit && m@OFF"}
    found = {name: ask(lamp, parse_query(text, "asked"), Options()) for name, text in asked.items()}
    return {name: partial(_with_style, answer, lamp) for name, answer in found.items()}


def _accesses() -> dict[str, Callable[[], tuple[object, ...]]]:
    def made(of: Arrangement) -> tuple[object, ...]:
        return of, policy_digest(of)

    return {name: partial(made, of) for name, of in _arrangements().items()}


def _simulations() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.runtime.stepping.random_run import RandomRun, Script, Simulated

    def made(of: Arrangement, seed: int) -> tuple[object, ...]:
        program = lower(of, keep_all_bits=True)
        run = RandomRun(Execution(program), Script(), random.Random(seed))  # noqa: S311 - no secrets
        return Simulated(of, program, run, seed, False, {}, None, 9, None), Style(width=100)

    lamp, counter = _arrangements().values()
    return {"a run": partial(made, lamp, 1), "a fault": partial(made, counter, 1), "another": partial(made, lamp, 2)}


def _monitors() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.monitoring.machine import Action
    from llfsm_verify.monitoring.properties import monitor_properties
    from llfsm_verify.report.monitor import Monitors

    def made(text: str) -> tuple[object, ...]:
        lines = _properties(text)
        found = [monitor_properties(line, ()) for line in lines.goals]
        return Monitors(found, lines, None, None, Action()), lambda _: None

    return {"never": partial(made, "a: G !x"), "once": partial(made, "b: F (y && X x)")}


def _theories() -> dict[str, Callable[[], tuple[object, ...]]]:
    from llfsm_verify.knowledge.explaining import explained
    from llfsm_verify.knowledge.reading import read_theory
    from llfsm_verify.knowledge.theory import Literal
    from llfsm_verify.report.knowledge import Explained

    theory = read_theory(Source("q.d", 'input {a}. {} => ~q. R: a -> q. output {b q, "q"}.'))
    found = {value: explained(theory, Literal("q"), {"a": value}) for value in (False, True)}
    return {f"a is {value}": partial(lambda of: (Explained(theory, (of,)),), of) for value, of in found.items()}


_SUBJECTS: Mapping[str, Callable[[], Mapping[str, Callable[[], tuple[object, ...]]]]] = MappingProxyType({
    "result": _results, "lint": _lints, "coverage": _coverages, "query": _queries, "access": _accesses,
    "simulation": _simulations, "monitor": _monitors, "knowledge": _theories,
})  # fmt: skip


def report_cases(report: Entry | str, kind: str) -> list[Case]:
    """Of a format of reports about this `kind`, one of `REPORTS`. Unregistered."""
    entry = entry_of(report, getattr(REPORTS, kind))

    def shown(make: Callable[[], tuple[object, ...]]) -> str:
        found = cast("Callable[..., Any]", entry.load())(*make())
        return found if isinstance(found, str) else plain_text(found, width=100)

    def reports() -> None:
        makes = subjects(kind).values()
        texts = [shown(make) for make in makes]
        demand(all(text.strip() for text in texts), "a report is empty")
        demand(texts == [shown(make) for make in makes], "the same is reported in two ways")
        demand(all(one != other for one, other in pairwise(texts)), "what is different is reported alike")

    def fails() -> None:
        failed = entry.failed() if isinstance(entry, ReportEntry) else None
        if failed is not None:
            whole = Diagnostic("E001", "no file", file="a")
            one, two = failed([whole], 3), failed([whole, Diagnostic("E110", ODD, Span(Source("a", "x"), 0, 1))], 3)
            demand(one.strip() and one != two, "it does not say what is wrong with files")

    return [Case("reports", "what is different is reported otherwise", reports), Case("failure", "wrong files", fails)]
