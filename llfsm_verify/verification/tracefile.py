"""Trace files: a trace on disk, complete enough to be run again and checked against its property."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import Literal, cast

from llfsm_verify.arrangement.codes import HINTS
from llfsm_verify.arrangement.files import STDIN, read_source
from llfsm_verify.arrangement.model import Arrangement, Profile
from llfsm_verify.checking.trace import Trace, TraceStep
from llfsm_verify.checking.verdict import GoalKind, PropertyResult
from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.fileformat import FORMAT, judge_format
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.program.program import FaultSite
from llfsm_verify.verification.tracefile_fields import EXPECTED, FAULT, GOAL, KINDS, STEP, TRACE
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping as MappingNode
from llfsm_verify.yaml.nodes import Node, Scalar, mark
from llfsm_verify.yaml.vocabulary import Vocabulary

DETAILED_STEPS = 2_000
"""A longer trace is saved without what is only there for the reader, so that reading it stays inside YAML's limits."""

Expected = Literal["violated", "holds"]
"""What a replay is to find: the failure, which is known, or no failure, because it is mended or must be."""

VOCABULARY = Vocabulary(hints=HINTS)


@dataclass(frozen=True, slots=True)
class SavedProperty:
    """The property that a trace violates. The text of an automaton kind is a file, relative to the trace file."""

    name: str
    kind: GoalKind
    text: str

    @property
    def names_a_file(self) -> bool:
        return self.kind.startswith("automaton")


@dataclass(frozen=True, slots=True)
class SavedStep:
    """What determines a step: the process that takes it (None: the arrangement has ended) and the choices it reads,
    by name, with their values as written."""

    process: str | None
    choices: tuple[tuple[str, str], ...]
    span: Span


@dataclass(frozen=True, slots=True)
class TraceFile:
    """A trace file as read. Either `goal` (the property) or `fault` (code and message) says what fails in it."""

    path: str
    place: Span
    """Where `arrangement` stands in it."""
    arrangement: str
    """The arrangement's path relative to the trace file, as written."""
    digest: str
    profile: tuple[tuple[str, str], ...]
    goal: SavedProperty | None
    assumptions: tuple[tuple[str, str], ...]
    """Name and text of each `assume` line."""
    syntaxes: tuple[tuple[str, str], ...]
    """The syntax of each formula, by the name of its line, that is not in our own."""
    fault: tuple[str, str] | None
    expect: Expected
    free: tuple[tuple[str, int], ...]
    steps: tuple[SavedStep, ...]
    loop: int | None
    """Index in `steps` from which on they repeat forever."""

    @property
    def from_stdin(self) -> bool:
        """The arrangement was not in a file when the trace was saved."""
        return self.arrangement == STDIN

    @property
    def arrangement_path(self) -> str:
        """The arrangement's path as seen from where we are; it has none when `from_stdin`."""
        return os.path.normpath(Path(self.path).parent / self.arrangement)


# ---------------------------------------------------------------- writing


def trace_document(
    trace: Trace,
    arrangement: Arrangement,
    what: SavedProperty | FaultSite,
    assumptions: tuple[tuple[str, str], ...],
    directory: Path,
    syntaxes: Mapping[str, str] = MappingProxyType({}),
    expect: Expected = "violated",
) -> str:
    """The text of the trace file of `trace`, to stand in `directory`.

    `syntaxes` are those of formulas, by the names of their lines, that are not in our own. `expect` is what a replay
    of the file shall find (of a witness, that its property holds).
    """
    import yaml

    head: dict[str, object] = {
        "trace": str(FORMAT),
        "arrangement": _relative(arrangement.path, directory),
        "digest": arrangement.digest,
        "profile": dict(profile_words(arrangement.profile)),
    }
    if isinstance(what, FaultSite):
        head["fault"] = {"code": what.code, "message": what.message}
    else:
        head["property"] = {"name": what.name, "kind": what.kind, "text": what.text}
    head["assumptions"] = dict(assumptions)
    named = [name for name, _ in assumptions] + ([] if isinstance(what, FaultSite) else [what.name])
    if foreign := {name: syntaxes[name] for name in named if name in syntaxes}:
        head["syntaxes"] = foreign
    head["expect"] = "holds" if trace.witness or trace.escape else expect
    head["initial"] = dict(trace.initial)
    head["free"] = {name: str(value) for name, value in trace.initial_free}
    if trace.loop is not None:
        head["loop"] = str(trace.loop + 1)
    detailed = len(trace.steps) <= DETAILED_STEPS
    lines = [
        f"# A run of {arrangement.name}; `llfsm replay` runs it again. Steps count from 1"
        + (", and those from `loop` on repeat forever." if trace.loop is not None else ".")
    ]
    lines.append(yaml.dump(head, Dumper=_dumper(), sort_keys=False, allow_unicode=True, width=10_000).rstrip())
    lines.append("steps:" if trace.steps else "steps: []")
    for number, step in enumerate(trace.steps, 1):
        item = _step(number, step, detailed)
        text = yaml.dump(
            item, Dumper=_dumper(), sort_keys=False, allow_unicode=True, width=1 << 30, default_flow_style=True
        )
        lines.append(f"  - {text.rstrip()}")
    return "\n".join(lines) + "\n"


def document_of(
    trace: Trace,
    arrangement: Arrangement,
    what: SavedProperty | FaultSite,
    properties: PropertySet,
    directory: Path,
    expect: Expected,
) -> str:
    """The text of the file of one trace; `properties` are all those of the check, with their assumptions."""
    assumptions = tuple((p.name, p.text) for p in properties.assumptions)
    syntaxes = {p.name: p.syntax for p in properties if p.syntax != "llfsm"}
    return trace_document(trace, arrangement, what, assumptions, directory, syntaxes, expect)


def saved_text(item: PropertyResult | Property, directory: Path) -> str:
    """The property's text; the file of an automaton as seen from `directory`."""
    if not item.kind.startswith("automaton"):
        return item.text
    return Path(os.path.relpath(Path(item.span.source.name).parent / item.text, directory)).as_posix()


def _step(number: int, step: TraceStep, detailed: bool) -> dict[str, object]:
    item: dict[str, object] = {"step": str(number)} if detailed else {}
    if step.process is None:
        item["ended"] = "true"
    else:
        item["process"] = step.process
    if detailed and step.machine is not None:
        item["machine"] = step.machine
        item["state"] = step.state
        if step.fired is not None:
            item["fired"] = step.fired
    if step.choices:
        item["choices"] = {s.choice: s.text for s in step.choices}
    if detailed and step.changes:
        item["changes"] = {c.variable: f"{c.before} -> {c.after}" for c in step.changes}
    return item


def _dumper() -> type:
    """A dumper for strings that are typed by their position: `true` and `3` need no quotes."""
    import yaml

    class Dumper(yaml.SafeDumper):
        yaml_implicit_resolvers = {}  # noqa: RUF012 - the library's own spelling of it

    return Dumper


def profile_words(profile: Profile) -> tuple[tuple[str, str], ...]:
    """Each choice of a profile with its value as a trace file writes it."""
    values = ((f.name, getattr(profile, f.name)) for f in fields(Profile))
    return tuple((name, str(value).lower() if isinstance(value, bool) else str(value)) for name, value in values)


def _relative(path: str, directory: Path) -> str:
    if path == STDIN:
        return STDIN
    return Path(os.path.relpath(path, directory)).as_posix()


# ---------------------------------------------------------------- reading


def read_trace_file(path: str | Path, *, chosen: bool = False) -> TraceFile:
    """The trace file at `path`, which is read only if it is a regular file where the path was `chosen` by us.

    Raises DiagnosticError: what any YAML file can have (E001 to E018, E030 to E034), a format of another version
    (E401), a word out of place (E035), an invalid number (E402), a loop that starts after the last step (E403),
    neither or both of `property` and `fault` (E404).
    """
    source, _ = read_source(path, regular=chosen)
    report = Report(VOCABULARY)
    root = compose(source, report.diagnostics, VOCABULARY)
    file = _Reader(report).file(str(path), root)
    if report.diagnostics or file is None:
        raise DiagnosticError(sorted(report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return file


_HEAD_BYTES = 1 << 16
_VERSION = re.compile(rb"^trace[ \t]*:", re.MULTILINE)


def may_be_replaced(path: Path) -> bool:
    """Whether a new trace may take the place of what is at `path`: nothing, a trace (also one that is cut short or too
    long to be read), an empty file, or none at all, such as a pipe."""
    try:
        if not path.is_file():
            return True
        with path.open("rb") as file:
            head = file.read(_HEAD_BYTES)
    except (OSError, ValueError):
        return True  # writing it will say more
    return not head or _VERSION.search(head) is not None


class _Reader:
    """Reads the parts of a trace file and collects what is wrong with them."""

    def __init__(self, report: Report) -> None:
        self.report = report

    def file(self, path: str, root: Node) -> TraceFile | None:
        found = self.report.fields(root, "a trace file", TRACE.keys, TRACE.required)
        if found is None:
            return None
        version = self.report.scalar(found["trace"], "`trace`")
        mistake = None if version is None else judge_format(version.text, "the trace", "trace")
        if mistake is not None:
            self.report.error("E401", mistake[0], mark(found["trace"]), mistake[1])
            return None
        steps = self.steps(found["steps"])
        loop = self.number(found["loop"], "`loop`") if "loop" in found else None
        if loop is not None and not 1 <= loop <= len(steps):
            message = f"the loop starts at step {loop}, and the last one is step {len(steps)}"
            self.report.error("E403", message, mark(found["loop"]))
        if ("property" in found) == ("fault" in found):
            self.report.error("E404", "a trace file has either `property` or `fault`", mark(root))
        expect = self.report.choice(found["expect"], "`expect`", EXPECTED, "violated")
        return TraceFile(
            path,
            mark(found["arrangement"]),
            self.word(found["arrangement"], "`arrangement`"),
            self.word(found["digest"], "`digest`"),
            self.words(found.get("profile"), "`profile`"),
            self.goal(found["property"]) if "property" in found else None,
            self.words(found.get("assumptions"), "`assumptions`"),
            self.words(found.get("syntaxes"), "`syntaxes`"),
            self.fault(found["fault"]) if "fault" in found else None,
            cast(Expected, expect),
            self.free(found.get("free")),
            steps,
            None if loop is None else loop - 1,
        )

    def goal(self, node: Node) -> SavedProperty:
        found = self.report.fields(node, "`property`", GOAL.keys, GOAL.required)
        if found is None:
            return SavedProperty("", "ltl", "")
        kind = self.report.choice(found["kind"], "`kind`", KINDS, "ltl")
        name, text = (self.word(found[key], f"`{key}`") for key in ("name", "text"))
        return SavedProperty(name, cast(GoalKind, kind), text)

    def fault(self, node: Node) -> tuple[str, str]:
        found = self.report.fields(node, "`fault`", FAULT.keys, FAULT.required)
        return (
            ("", "")
            if found is None
            else (self.word(found["code"], "`code`"), self.word(found["message"], "`message`"))
        )

    def steps(self, node: Node) -> tuple[SavedStep, ...]:
        sequence = self.report.sequence(node, "`steps`")
        return () if sequence is None else tuple(self.step(item) for item in sequence.items)

    def step(self, node: Node) -> SavedStep:
        found = self.report.fields(node, "a step", STEP.keys)
        if found is None:
            return SavedStep(None, (), node.span)
        process = None
        if "ended" in found:
            self.report.choice(found["ended"], "`ended`", ("true",), "true")
        elif "process" in found:
            process = self.word(found["process"], "`process`")
        else:
            self.report.error("E034", "a step has no `process`", mark(node), "write `process: …`, or `ended: true`")
        return SavedStep(process, self.words(found.get("choices"), "`choices`"), mark(node))

    def free(self, node: Node | None) -> tuple[tuple[str, int], ...]:
        if node is None:
            return ()
        mapping = self.report.mapping(node, "`free`")
        if mapping is None:
            return ()
        values = ((key.text, self.number(value, f"`{key.text}`")) for key, value in mapping.items)
        return tuple((name, value) for name, value in values if value is not None)

    def word(self, node: Node, what: str) -> str:
        scalar = self.report.scalar(node, what)
        return "" if scalar is None else scalar.text

    def number(self, node: Node, what: str) -> int | None:
        scalar = self.report.scalar(node, what)
        if scalar is None:
            return None
        digits = scalar.text.removeprefix("-")
        if not (digits.isascii() and digits.isdigit() and len(digits) < 20):
            self.report.error("E402", f"{what} must be a number, not `{scalar.text[:40]}`", mark(scalar))
            return None
        return int(scalar.text)

    def words(self, node: Node | None, what: str) -> tuple[tuple[str, str], ...]:
        """A mapping of words to words; an empty one may also be missing."""
        if node is None or (isinstance(node, Scalar) and not node.text):
            return ()
        mapping: MappingNode | None = self.report.mapping(node, what)
        if mapping is None:
            return ()
        return tuple((key.text, self.word(value, f"`{key.text}`")) for key, value in mapping.items)
