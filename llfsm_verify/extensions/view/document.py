"""The view document (`view.schema.json`) of a check, of a saved trace, of a recording and of a coverage."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from itertools import chain, islice
from pathlib import Path
from tempfile import gettempdir
from typing import Any

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.view.codes import ABSENT, WINDOW
from llfsm_verify.extensions.view.colours import colours_of
from llfsm_verify.extensions.view.performing import Performing, Step, Taken
from llfsm_verify.extensions.view.sources import Files, arrangement_svg, machines_of
from llfsm_verify.extensions.view.values import drawn_as_shown, exact, signal_of
from llfsm_verify.plug import (
    FRAME_HEADER,
    Arrangement,
    Coverage,
    Move,
    PropertyResult,
    Recorded,
    Recording,
    Result,
    Trace,
    arrangement_of,
    asked_text,
    code_of,
    compared,
    is_recording,
    load_arrangement,
    named_runs,
    replay_file,
    slots_of,
    vacuity_texts,
    verdict_text,
)

MOST_ROWS = 10_000
"""Rows of a run that a page has at once."""
MOST_RUNS = 50
"""Runs of a page; a note says how many are left out."""
UNPACKED = re.compile(rf"^{re.escape(str(Path(gettempdir()).resolve()))}/llfsm-[^/]+/")
"""Where the files of a recording are while it is read."""
TRACE_KEYS, MOST_HEAD = ("trace:", "digest:", "expect:", '"digest"'), 10_000
"""Keys of saved traces, and lines among which they are."""
Document = dict[str, Any]


def document_of_result(result: Result, arrangement: Arrangement) -> Document:
    """The verdicts of a check, with a run for each trace that it has."""
    page = _Page(arrangement, "check")
    shown = list(named_runs(result))
    runs: dict[str, list[int]] = {}
    for name, what, trace in shown[:MOST_RUNS]:
        steps = max(0, len(trace.steps) + 1 - MOST_ROWS), None  # of a long run its end, which shows why
        if isinstance(what, PropertyResult):
            runs.setdefault(what.name, []).append(len(page.runs))
            title = f"{what.name}: {asked_text(what.kind, what.text)}"
            kind = "witness" if trace.witness or trace.escape else "violation"
            page.add_trace(name, kind, title, trace, what.name, steps)
        else:
            page.add_trace(name, "fault", f"{what.code}: {what.message}", trace, None, steps)
    notes = [*result.notes, *(f"{warning.message} ({warning.code})" for warning in result.warnings)]
    if len(shown) > MOST_RUNS:
        notes.append(f"only {MOST_RUNS} of {len(shown):,} runs are here; `--save-traces DIR` saves all of them")
    verdicts = [_verdict(result, item, page, runs.get(item.name, [])) for item in result.properties]
    faults = [number for number, run in enumerate(page.runs) if run["kind"] == "fault"]
    verdicts.append({
        "name": "faults", "verdict": result.faults.verdict.value, "words": result.faults.verdict.value,
        "text": "no run ends in a fault", "reason": result.faults.reason, "notes": [], "engine": None, "place": None,
        "runs": faults,
    })  # fmt: skip
    return page.document(notes=notes, verdicts=verdicts, statistics=_statistics(result))


def document_of_file(path: str, instead: str | None, first: int = 0, last: int | None = None) -> Document:
    """A saved trace or a recording, from step `first` to step `last`; of a long one, MOST_ROWS rows. `instead`: the
    file of another arrangement than it names or has.

    DiagnosticError: what is wrong with the file or the arrangement, or it has no step `first` (E555).
    """
    with ExitStack() as left:
        if path != "-" and is_recording(path):
            recording = left.enter_context(Recording(path))
            left.enter_context(compared(recording))
            return _recorded(recording, path, instead, first, last)
    if path != "-" and not _is_trace(path):
        message = f"`{path}` is neither a recording nor a saved trace"
        hint = "`llfsm verify --save-traces DIR` saves traces; `--report out.html` makes a page of a check"
        raise DiagnosticError(Diagnostic(ABSENT, message, hint=hint))
    done = replay_file(path, instead, load_arrangement)
    trace = done.replay.trace
    page = _Page(done.arrangement, "trace")
    if trace is None:
        raise DiagnosticError(Diagnostic(WINDOW, f"this trace cannot be shown: {done.replay.reason}", file=path))
    goal = done.file.goal
    page.add_trace(path, "trace", done.title, trace, None if goal is None else goal.name, (first, last))
    return page.document(notes=[done.sentence, *done.notes])


def _is_trace(path: str) -> bool:
    """Whether a file may be a saved trace: what else is wrong in it, its reader says."""
    try:
        with open(path, encoding="utf-8", errors="replace") as file:
            return any(line.startswith(TRACE_KEYS) for line in islice(file, MOST_HEAD))
    except OSError:
        return True


def document_of_coverage(found: Coverage, arrangement: Arrangement) -> Document:
    """What runs cover, with the machines, and without runs."""
    page = _Page(arrangement, "coverage")
    goals = [
        {
            "kind": judged.goal.kind, "status": judged.status, "span": page.files.place(judged.goal.span),
            "name": f"{judged.goal.machine}: {judged.goal.text}"
            + ("" if judged.goal.outcome is None else f" is {str(judged.goal.outcome).lower()}"),
        }
        for judged in found.goals
    ]  # fmt: skip
    explored = "all of them" if found.complete else found.reason or "not all of them"
    lines = [["configurations", f"{found.configurations:,}, {explored}"], ["time", f"{found.seconds:.2f} s"]]
    lines += [[run.name, f"{run.steps:,} steps"] for run in found.runs]
    notes = [f"{name} is a model, of which nothing is to be covered" for name in found.modelled]
    counts = {kind: dict(of) for kind, of in found.counts().items()}
    statistics = [{"title": "Runs and exploration", "lines": lines}]
    return page.document(notes=notes, statistics=statistics, coverage={"counts": counts, "goals": goals})


class _Page:
    """Collects what pages of one arrangement have in common."""

    def __init__(self, arrangement: Arrangement, source: str) -> None:
        self.arrangement = arrangement
        self.source = source
        self.files = Files()
        self.runs: list[Document] = []
        self._performing: Performing | None = None

    @property
    def performing(self) -> Performing:
        """Made when there is something to perform."""
        if self._performing is None:
            self._performing = Performing(self.arrangement)
        return self._performing

    def add_trace(
        self, name: str, kind: str, title: str, trace: Trace, asked: str | None,
        steps: tuple[int, int | None] = (0, None),
    ) -> None:  # fmt: skip
        """The run of a trace."""
        performing, arrangement = self.performing, self.arrangement
        processes = {process.name: number for number, process in enumerate(arrangement.processes)}
        moves = (
            Move(None if s.process is None else processes[s.process], {c.choice: c.value for c in s.choices})
            for s in trace.steps
        )
        taken = performing.run(lambda execution: execution.start(trace.initial_free), map(Step, moves))
        run = _Run(self, taken, *steps, begins=1)
        run.cause(0, trace.initial_causes)
        for number, step in enumerate(trace.steps, 1):
            run.cause(number, step.causes)
        end = trace.failed_at
        if trace.fault is None and end is not None:
            words = "reached" if kind == "witness" else "violation"
            because = f": {trace.because}" if trace.because else ""
            run.mark(end, words, ("it is reached here" if kind == "witness" else "it is violated here") + because)
        made = run.made(name, kind, title, asked)
        made["loop"] = run.row_of(trace.loop) if trace.loop is not None else None
        if trace.fault is not None:
            made["ending"] = "it ends in a fault"
        elif trace.loop is None:
            made["ending"] = trace.because
        self.runs.append(made)

    def signals(self) -> list[Document]:
        """Those of the slots, if something was performed."""
        return [] if self._performing is None else [signal_of(slot) for slot in self._performing.slots]

    def document(
        self, *, notes: list[str], verdicts: list[Document] | None = None,
        statistics: list[Document] | None = None, coverage: Document | None = None,
    ) -> Document:  # fmt: skip
        """The whole."""
        arrangement, signals = self.arrangement, self.signals()
        drawn_as_shown(signals, self.runs)
        states = {signal["name"]: number for number, signal in enumerate(signals) if signal["kind"] == "state"}
        machines = machines_of(arrangement, self.files, states)
        names = chain.from_iterable([s["name"] for s in machine["states"]] for machine in machines)
        labels = chain(names, chain.from_iterable(signal.get("labels", ()) for signal in signals))
        cycle = arrangement.cycle_ms
        return {
            "format": "llfsm-view", "version": 1, "source": self.source, "title": arrangement.name, "notes": notes,
            "arrangement": {
                "name": arrangement.name, "path": arrangement.path, "cycle_ms": None if cycle is None else float(cycle),
                "processes": [{"name": of.name, "machines": list(of.schedule)} for of in arrangement.processes],
                "svg": arrangement_svg(arrangement),
            },
            "files": self.files.entries, "machines": machines, "signals": signals,
            "colours": colours_of(dict.fromkeys(labels)), "verdicts": verdicts or [], "statistics": statistics or [],
            "coverage": coverage, "runs": self.runs,
        }  # fmt: skip


class _Run:
    """Collects the rows of one run between two steps, and what is marked in them."""

    def __init__(self, page: _Page, taken: Iterable[Taken], first: int, last: int | None, *, begins: int) -> None:
        self._page = page
        self._numbers = {slot.name: number for number, slot in enumerate(page.performing.slots)}
        machines = {machine.name: number for number, machine in enumerate(page.arrangement.texts)}
        offsets = {m.name: _offsets(m.states) for m in page.arrangement.texts}
        self._first = self._last = first
        self.total: int | None = None
        self._rows: dict[str, list[Any]] = {"step": [], "cycle": [], "time_ms": [], "turn": []}
        self._changes: list[dict[str, list[Any]]] = [{"at": [], "values": []} for _ in self._numbers]
        self._fired: list[list[int]] = []
        self._sets: dict[tuple[Any, ...], int] = {(): 0}
        self._ran: list[int] = []
        self.marks: list[Document] = []
        self.frames: dict[int, int] = {}
        """The last row of each frame of a recording."""
        self.damaged: str | None = None
        before: tuple[Any, ...] = ()
        cycle_ms = page.arrangement.cycle_ms
        until = first + MOST_ROWS - 1 if last is None else min(last, first + MOST_ROWS - 1)
        for one in taken:
            self.total = one.step + 1
            if one.step < first:
                continue
            if one.step > until:
                self.total = None
                break
            row, self._last = len(self._ran), one.step
            time = None if cycle_ms is None else float(max(one.cycle - begins, 0) * cycle_ms)
            turn = -1 if one.machine is None else machines[one.machine]
            for column, cell in zip(self._rows.values(), (one.step, one.cycle, time, turn), strict=True):
                column.append(cell)
            for number, value in enumerate(one.values):
                if not before or value != before[number]:
                    self._changes[number]["at"].append(row)
                    self._changes[number]["values"].append(exact(value))
            before = one.values
            if one.machine is not None and one.fired is not None:
                state, number = one.fired
                self._fired.append([row, turn, offsets[one.machine][state] + number])
            places = tuple(tuple(place) for span in one.ran if (place := page.files.place(span)) is not None)
            self._ran.append(self._sets.setdefault(places, len(self._sets)))
            for kind, text, span in one.events:
                self.mark(one.step, "event", f"{kind}: {text}", place=span)
            if one.fault is not None:
                self.mark(one.step, "fault", one.fault[0], place=one.fault[1])
            if one.frame is not None:
                self.frames[one.frame] = one.step
        if not self._ran:
            steps = (self.total or 1) - 1
            message = f"there is no step {first:,}: the run has {steps:,} steps"
            raise DiagnosticError(Diagnostic(WINDOW, message, hint=f"write `--steps 0:{steps}`"))

    def row_of(self, step: int) -> int | None:
        """The row of a step; None: it is not in the window."""
        return step - self._first if self._first <= step <= self._last else None

    def mark(
        self, step: int | None, kind: str, text: str, signals: Iterable[str] = (), place: Any = None
    ) -> None:  # fmt: skip
        """Mark a step, if it is in the window."""
        row = None if step is None else self.row_of(step)
        if row is not None:
            numbers = [self._numbers[name] for name in signals if name in self._numbers]
            where = self._page.files.place(place)
            self.marks.append({"row": row, "kind": kind, "text": text, "signals": numbers, "place": where})

    def cause(self, step: int, causes: Iterable[Any]) -> None:
        """Mark what caused the failure."""
        for cause in causes:
            words = ", ".join(f"{name} = {value}" for name, value in cause.variables)
            text = f"{cause.atom} is {str(cause.value).lower()}" + (f" ({words})" if words else "")
            self.mark(step, "cause", text, (name for name, _ in cause.variables))

    def made(self, name: str, kind: str, title: str, asked: str | None) -> Document:
        """The document's run."""
        whole = self._first == 0 and self.total == len(self._ran)
        rows = self._rows | ({"time_ms": None} if self._page.arrangement.cycle_ms is None else {})
        sets = [[list(place) for place in places] for places in self._sets]
        return {
            "name": name, "kind": kind, "title": title, "property": asked, "loop": None, "ending": None,
            "window": None if whole else {"first": self._first, "total": self.total},
            "rows": rows, "changes": self._changes, "fired": self._fired, "ran": {"sets": sets, "rows": self._ran},
            "marks": sorted(self.marks, key=lambda mark: int(mark["row"])),
        }  # fmt: skip


def _offsets(states: Iterable[Any]) -> list[int]:
    """The number in the document of the first transition of each state."""
    found, total = [], 0
    for state in states:
        found.append(total)
        total += len(state.transitions)
    return found


def _recorded(recording: Recording, path: str, instead: str | None, first: int, last: int | None) -> Document:
    arrangement = arrangement_of(recording, load_arrangement, instead)
    code = code_of(recording, arrangement)
    page = _Page(arrangement, "recording")
    recorded = Recorded(recording, code)
    performing = page.performing
    said: list[str] = []
    cycles = _cycles(path)
    began, begins = next(cycles, (0, 0))

    def steps() -> Iterator[Step]:
        frame, cycle = began, begins
        for number in range(1, 1 << 62):
            found = recorded.next(b"", number)
            if isinstance(found, str):
                said.append(found)
                return
            while found.frame is not None and frame < found.frame:
                frame, cycle = next(cycles, (found.frame, cycle))
            yield Step(found.move, found.frame, cycle)

    run = _Run(page, performing.run(recorded.start.record, steps(), begins), first, last, begins=0)
    _mark_verdicts(run, path, code)
    made = run.made(path, "recording", f"{arrangement.name}, recorded in {path}", None)
    made["ending"] = said[0] if said else None
    page.runs.append(made)
    notes = [*recording.notes]
    if recording.damaged:
        notes.append(f"the recording is damaged after what is here: {recording.damaged}")
    if made["window"] is not None:
        shown = len(made["rows"]["step"])
        notes.append(f"{shown:,} rows from step {first:,} on are here; `--steps A:B` shows others")
    document = page.document(notes=notes)
    for file in document["files"] if instead is None else ():
        file["name"] = UNPACKED.sub("", file["name"])
    return document


def _cycles(path: str) -> Iterator[tuple[int, int]]:
    """The number of each frame, and the cycle that is over then."""
    with Recording(path) as recording:
        for turn in recording:
            number = turn.frame[FRAME_HEADER["NUMBER"]]
            yield number, turn.frame[FRAME_HEADER["CYCLE"]] + (number > 1)


def _mark_verdicts(run: _Run, path: str, code: Any) -> None:
    """Mark where verdicts of the monitors changed."""
    slots = [slot for slot in slots_of(code) if slot.kind == "verdict"]
    if not slots:
        return
    before: tuple[Any, ...] = ()
    with Recording(path) as recording:
        for turn in recording:
            verdicts = tuple(slot.value(turn.frame) for slot in slots)
            if verdicts != before:
                for slot, old, new in zip(slots, before or verdicts, verdicts, strict=True):
                    if old != new:
                        kind = "violation" if new == "violated" else "verdict"
                        run.mark(run.frames.get(turn.frame[0]), kind, f"{slot.name} is {new}")
                before = verdicts


def _verdict(result: Result, item: PropertyResult, page: _Page, runs: list[int]) -> Document:
    trace = item.trace
    reason = item.reason or (None if trace is None else trace.because)
    return {
        "name": item.name, "verdict": item.verdict.value, "words": verdict_text(result, item),
        "text": asked_text(item.kind, item.text), "reason": reason,
        "notes": [*item.notes, *vacuity_texts(result, item)], "engine": item.engine,
        "place": page.files.place(item.span), "runs": runs,
    }  # fmt: skip


def _statistics(result: Result) -> list[Document]:
    seen = result.exploration
    lines = [
        ["configurations", f"{seen.states:,}"], ["transitions", f"{seen.transitions:,}"],
        ["complete", "yes" if result.complete else "no"], ["engine", result.engine],
        ["time", f"{result.seconds:.2f} s"],
    ]  # fmt: skip
    found = [{"title": "Exploration", "lines": lines}]
    tried = [
        [attempt.engine, f"{attempt.seconds:.2f} s; decided: {', '.join(attempt.decided) or 'nothing'}"]
        for attempt in result.attempts
    ]
    return [*found, *([{"title": "Engines", "lines": tried}] if tried else [])]
