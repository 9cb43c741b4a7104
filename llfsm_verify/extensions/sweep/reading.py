"""Sweep files: what is varied, with the places of all values; combinations are counted before any is made."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from math import log10, prod
from pathlib import Path

from llfsm_verify import CheckOptions, DiagnosticError
from llfsm_verify.extensions.sweep.codes import NO_FILE, TOO_MANY, TWICE, WRONG_EXCLUSION, WRONG_OPTION, WRONG_RANGE
from llfsm_verify.extensions.sweep.spelling import number, read_timeout, read_value, words
from llfsm_verify.extensions.sweep.task import ValueKind
from llfsm_verify.plug import (
    DEFAULT_ENGINE,
    ENGINES,
    FORMAT_KEY,
    SYNTAXES,
    ByName,
    Either,
    Field,
    Json,
    MappingNode,
    Node,
    Report,
    Scalar,
    Sequence,
    Several,
    Single,
    Span,
    Table,
    Vocabulary,
    check_options,
    checked_options,
    compose,
    did_you_mean,
    implied,
    is_arrangement,
    mark,
    node_of_data,
    other_kind,
    parse_size,
    read_source,
    schema_of,
)  # fmt: skip

MOST = 100_000
"""Combinations of a sweep."""
ARRANGEMENT, PROPERTIES = "arrangement", "properties"
KINDS: Mapping[str, ValueKind] = {"constants": "constant", "parameters": "parameter", "initial": "initial"}
"""By key of the file, which values stand below it."""
NOT_HERE = ("progress", "decided", "tell", "checkpoint", "checkpoint_every", "resume", "jobs")
"""Options of a check that a sweep has not: its tasks run elsewhere, each on one core."""

_DOTS = re.compile(r"\s*([+-]?\w+(?:\.\d+)?)\s*\.\.\.?\s*([+-]?\w+(?:\.\d+)?)\s*\Z", re.ASCII)
"""A range as a type has it, such as `1..3`."""
_WORD = Single(("string", "number", "boolean"))
_PATHS = Either((Single(("string",)), Several(Single(("string",)), different=False)))
RANGE = Table(
    "the numbers from one to another",
    (
        Field("from", "the first", Single(("number", "string")), required=True),
        Field("to", "the last", Single(("number", "string")), required=True),
        Field("step", "from one to the next: 1 unless given", Single(("number", "string"))),
    ),
)
_VALUES = Either((_WORD, RANGE, Several(Either((_WORD, Several(_WORD, different=False), ByName(_WORD))))))
SWEEP = Table(
    "many checks: every combination of arrangements, property files and values (`llfsm sweep FILE`)",
    (
        FORMAT_KEY,
        Field("arrangements", "paths and patterns such as `faulty/*.yaml`, relative to this file", _PATHS,
              required=True, called="arrangement models model"),
        Field(PROPERTIES, "property files, each a combination of its own; without them those that stand beside each "
              "arrangement, as `llfsm check` takes them", _PATHS, called="property"),
        Field("constants", "values of constants of machines: a list, or `{from: 1, to: 60}`, for all machines that "
              "have a constant of that name", ByName(_VALUES), called="constant"),
        Field("parameters", "values of single parameters, by `INSTANCE.PARAMETER`", ByName(_VALUES),
              called="parameter"),
        Field("initial", "initial values, by `VARIABLE`, `INSTANCE.VARIABLE` or `INSTANCE.STATE.VARIABLE`",
              ByName(_VALUES), called="init initials"),
        Field("exclude", "combinations that are left out: each says of some of the above which values meet",
              Several(ByName(Either((_WORD, RANGE, Several(_WORD)))), different=False), called="excluded except"),
        Field("options", "options of each check, called as in Python: `engine`, `timeout: 10 s`, `memory: 1 GiB`, …",
              ByName(_WORD), called="option"),
    ),
)  # fmt: skip
VOCABULARY = Vocabulary(called={one.name: one.called for one in SWEEP.fields if one.called})


@dataclass(frozen=True, slots=True)
class Given:
    """One value, and how it is written."""

    value: Json
    node: Node
    """A path that a pattern stands for is marked at the pattern."""


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers, counted without being made."""

    first: Fraction
    step: Fraction
    count: int
    places: tuple[Node, Node]
    """Of the first one, and of the others."""

    def __len__(self) -> int:
        return self.count

    def __iter__(self) -> Iterator[Given]:
        for i in range(self.count):
            value = number(self.first + i * self.step)
            yield Given(value, implied(words(value), mark(self.places[min(i, 1)])))


@dataclass(frozen=True, slots=True)
class Axis:
    """What is varied, with its values in order. `kind`: of values, None for files."""

    name: str
    kind: ValueKind | None
    values: tuple[Given, ...] | Range
    place: Span


@dataclass(frozen=True, slots=True)
class Exclusion:
    """Values that are not combined, by the names of axes."""

    values: Mapping[str, frozenset[str]]
    place: Span

    def meets(self, combination: Mapping[str, Json]) -> bool:
        """Whether it excludes a combination."""
        return all(words(combination[name]) in values for name, values in self.values.items())


@dataclass(frozen=True, slots=True)
class SweepFile:
    """What a file says. Axes are in the order of columns; property files, where they are named, come last."""

    path: str
    folder: Path
    """What paths are relative to."""
    axes: tuple[Axis, ...]
    exclude: tuple[Exclusion, ...] = ()
    options: Mapping[str, Json] = field(default_factory=dict)
    timeout: float | None = None
    memory: int | None = None


def read_sweep(given: str | Path | Mapping[str, object]) -> SweepFile:
    """The sweep in a file, or in Python data of its shape, whose paths are relative to where we are.

    DiagnosticError: what any YAML file can have (E001 to E018, E030 to E036), a pattern without files (E590), more
    than 100,000 combinations (E592), a value twice (E593), a wrong range (E594), exclusion (E595) or option (E597).
    """
    report = Report(VOCABULARY)
    if isinstance(given, Mapping):
        path, folder = "<sweep>", Path()
        root, _ = node_of_data(given, report.diagnostics, path)
    else:
        path, folder = str(given), Path(given).parent
        source, _ = read_source(given)
        if (other := other_kind(source, "sweep")) is not None:
            raise DiagnosticError(other)
        root = compose(source, report.diagnostics)
    found = _Reader(report, path, folder).file(root)
    if report.diagnostics or found is None:
        raise DiagnosticError(sorted(report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return found


def schema(name: str) -> dict[str, object]:
    """The JSON Schema of a sweep file."""
    return schema_of(name, "Sweep of llfsm-verify", SWEEP)


class _Reader:
    def __init__(self, report: Report, path: str, folder: Path) -> None:
        self.report = report
        self.path = path
        self.folder = folder
        self.timeout: float | None = None
        self.memory: int | None = None

    def file(self, root: Node) -> SweepFile | None:
        report = self.report
        if not report.can_read(root, "the sweep"):
            return None
        fields = report.fields(root, "a sweep", SWEEP.keys, SWEEP.required)
        if fields is None:
            return None
        axes = [self._files(ARRANGEMENT, fields["arrangements"])]
        for key, kind in KINDS.items():
            mapping = report.mapping(fields[key], f"`{key}`") if key in fields else None
            axes += [self._axis(name, kind, node) for name, node in (() if mapping is None else mapping.items)]
        self._distinct(axes)
        if PROPERTIES in fields:
            axes.append(self._files(PROPERTIES, fields[PROPERTIES]))
        options = self._options(fields["options"]) if "options" in fields else {}
        if report.diagnostics:
            return None
        self._count(axes)
        exclude = self._exclusions(fields["exclude"], axes) if "exclude" in fields else ()
        return SweepFile(self.path, self.folder, tuple(axes), exclude, options, self.timeout, self.memory)

    def _count(self, axes: list[Axis]) -> None:
        counts = [(values.count if isinstance(values := a.values, Range) else len(values), a) for a in axes]
        number = prod(count for count, _ in counts)
        if number > MOST:
            largest = max(counts, key=lambda each: each[0])[1]
            several = [f"{count:,} of `{axis.name[:40]}`" for count, axis in counts if count > 1]
            parts = " × ".join(several[:6]) + (" × …" if len(several) > 6 else "")
            said = f"{number:,}" if number < 10**18 else f"more than 10^{int(log10(number))}"
            message = f"this is {said} combinations ({parts}), and a sweep has at most {MOST:,}"
            hint = "take fewer values, or write several sweeps"
            self.report.error(TOO_MANY, message, largest.place, hint)
            raise DiagnosticError(self.report.diagnostics)

    def _distinct(self, axes: list[Axis]) -> None:
        """No name stands below two keys, and no parameter that is a constant of the sweep."""
        seen = {ARRANGEMENT: axes[0], PROPERTIES: axes[0]}
        for axis in axes[1:]:
            other = seen.get(axis.name) or seen.get(axis.name.rpartition(".")[2] if axis.kind == "parameter" else "")
            if other is not None:
                note = f"the first one is at {other.place.nearby}"
                message = f"`{axis.name}` is given values as a {_said(other)} already"
                self.report.error(TWICE, message, axis.place, "leave one of them out", (note,))
            seen[axis.name] = axis

    # ------------------------------------------------------------ values

    def _axis(self, name: Scalar, kind: ValueKind, node: Node) -> Axis:
        if isinstance(node, MappingNode):
            found: tuple[Given, ...] | Range | None = self._range(name.text, node)
        else:
            items = node.items if isinstance(node, Sequence) else (node,)
            found = tuple(Given(self._value(name.text, item), item) for item in items)
            if not items:
                self.report.error("E034", f"`{name.text[:60]}` has no value", mark(node), "write at least one")
            self._different(name.text, found)
        return Axis(name.text, kind, () if found is None else found, mark(name))

    def _value(self, name: str, node: Node) -> Json:
        if isinstance(node, Sequence):
            return [self._value(name, item) for item in node.items]
        if isinstance(node, MappingNode):
            return {key.text: self._value(name, item) for key, item in node.items}
        scalar = self.report.scalar(node, f"a value of `{name[:60]}`")
        if scalar is not None and (ends := _DOTS.match(scalar.text)):
            message = f"`{scalar.text[:40]}` is not a value of `{name[:60]}`"
            self.report.error(WRONG_RANGE, message, mark(node), f"write `{{from: {ends[1]}, to: {ends[2]}}}`")
            return None
        return None if scalar is None else read_value(scalar.text)

    def _different(self, name: str, values: tuple[Given, ...]) -> None:
        """Two values that are one are two combinations that are one."""
        seen: dict[str, Node] = {}
        for each in values:
            text = words(each.value)
            if text in seen and each.value is not None:
                first, again = (_written(node) for node in (seen[text], each.node))
                self._twice(first, seen[text], again, each.node, f"a value of `{name[:60]}`")
            seen.setdefault(text, each.node)

    def _twice(self, first: str, at: Node, again: str, node: Node, what: str) -> None:
        message = f"`{again}` is {what} that was there before: two combinations would be one"
        note = f"the first one, `{first}`, is at {mark(at).nearby}"
        self.report.error(TWICE, message, mark(node), "leave one of them out", (note,))

    def _range(self, name: str, node: Node) -> Range | None:
        fields = self.report.fields(node, f"the range of `{name[:60]}`", RANGE.keys, RANGE.required)
        if fields is None:
            return None
        first, last = self._bound(fields["from"], "from"), self._bound(fields["to"], "to")
        step = self._bound(fields["step"], "step") if "step" in fields else Fraction(1)
        if first is None or last is None or step is None:
            return None
        if step <= 0:
            hint = "write a positive one, or leave it out: it is 1 then"
            self.report.error(WRONG_RANGE, "a step is more than 0", mark(fields["step"]), hint)
            return None
        if last < first:
            message = f"there is no number from {words(number(first))} to {words(number(last))}"
            self.report.error(WRONG_RANGE, message, mark(fields["to"]), "write the smaller one under `from`")
            return None
        return Range(first, step, int((last - first) / step) + 1, (fields["from"], fields["to"]))

    def _bound(self, node: Node, key: str) -> Fraction | None:
        scalar = self.report.scalar(node, f"`{key}`")
        value = None if scalar is None else read_value(scalar.text)
        if scalar is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            message = f"`{key}` cannot be `{scalar.text[:40]}`"
            hint = "write a number, or a list of the values instead of a range"
            self.report.error(WRONG_RANGE, message, mark(node), hint)
            return None
        return None if value is None else Fraction(str(value))

    # ------------------------------------------------------------ files

    def _files(self, name: str, node: Node) -> Axis:
        key = f"{name}s" if name == ARRANGEMENT else name
        found: list[Given] = []
        for item in node.items if isinstance(node, Sequence) else (node,):
            scalar = self.report.scalar(item, f"a path of `{key}`")
            if scalar is not None:
                found += [Given(path, item) for path in self._paths(name, scalar)]
        if isinstance(node, Sequence) and not node.items:
            self.report.error("E034", f"`{key}` has no path", mark(node), "write at least one")
        seen: dict[str, Given] = {}
        for each in found:
            path = self._real(each.value)
            if path in seen:
                self._twice(str(seen[path].value), seen[path].node, str(each.value), each.node, "a file")
            seen.setdefault(path, each)
        return Axis(name, None, tuple(found), mark(node))

    def _real(self, path: Json) -> str:
        try:
            return os.path.realpath(self.folder / str(path))
        except ValueError:  # which is said when it is opened
            return str(path)

    def _paths(self, name: str, at: Scalar) -> list[str]:
        """The files that a path or a pattern stands for, as they are named from the folder."""
        if not re.search(r"[*?\[]", at.text):
            return [at.text]
        try:
            there = sorted(path for path in self.folder.glob(at.text) if path.is_file())
        except (ValueError, NotImplementedError, OSError):
            there = []
        fits = [path for path in there if name == PROPERTIES or is_arrangement(path)]
        if not fits:
            what = "an arrangement" if name == ARRANGEMENT else "a property file"
            hint = "check the pattern; it is relative to the folder of this file"
            self.report.error(NO_FILE, f"`{at.text[:80]}` matches no file that is {what}", mark(at), hint)
        return [path.relative_to(self.folder).as_posix() for path in fits]

    # ------------------------------------------------------------ the rest

    def _exclusions(self, node: Node, axes: list[Axis]) -> tuple[Exclusion, ...]:
        known = {"arrangements" if axis is axes[0] else axis.name: axis for axis in axes}
        found: list[Exclusion] = []
        items = self.report.sequence(node, "`exclude`")
        for item in () if items is None else items.items:
            mapping = self.report.mapping(item, "an exclusion")
            values: dict[str, frozenset[str]] = {}
            for key, inner in () if mapping is None else mapping.items:
                axis = known.get(key.text)
                if axis is None:
                    hint = did_you_mean(key.text, known) or f"what is varied: {', '.join(known)}"
                    message = f"an exclusion names `{key.text[:60]}`, which this sweep does not vary"
                    self.report.error(WRONG_EXCLUSION, message, mark(key), hint)
                    continue
                values[axis.name] = frozenset(self._excluded(axis, key.text, inner))
            if mapping is not None and not mapping.items:
                self.report.error("E034", "an exclusion has no values", mark(item), "write `NAME: VALUE`")
            found.append(Exclusion(values, mark(item)))
        return tuple(found)

    def _excluded(self, axis: Axis, name: str, node: Node) -> Iterator[str]:
        if isinstance(node, MappingNode) and axis.kind is not None:
            numbers = self._range(name, node)
            if numbers is not None and numbers.count <= MOST:
                yield from (words(each.value) for each in numbers)
            return
        for item in node.items if isinstance(node, Sequence) else (node,):
            if axis.kind is not None:
                yield words(self._value(name, item))
                continue
            scalar = self.report.scalar(item, f"a path of `{name}`")
            for path in () if scalar is None else self._paths(axis.name, scalar):
                yield from (str(g.value) for g in axis.values if self._real(g.value) == self._real(path))

    def _options(self, node: Node) -> dict[str, Json]:
        names = tuple(name for name in ("engine", "syntax", *CheckOptions.__annotations__) if name not in NOT_HERE)
        fields = self.report.fields(node, "`options`", names) or {}
        found: dict[str, Json] = {}
        for name, value in sorted(fields.items(), key=lambda item: item[0] != "engine"):
            try:
                self._option(name, value, found)
            except ValueError as wrong:
                self.report.error(WRONG_OPTION, f"`{name}`: {wrong}", mark(value), "write it as in Python")
        return found

    def _option(self, name: str, node: Node, found: dict[str, Json]) -> None:
        """Take one option more. ValueError: it cannot be, or not beside those that are there."""
        value = self._value(name, node)
        if value is None:
            return
        if name in ("timeout", "memory", "engine", "syntax") and (scalar := self.report.scalar(node, f"`{name}`")):
            if name == "timeout":
                self.timeout = read_timeout(scalar.text)
            elif name == "memory":
                self.memory = parse_size(scalar.text)
            elif name == "engine":
                ENGINES.entry(scalar.text)
            elif scalar.text not in SYNTAXES:
                raise ValueError(f"there is no syntax `{scalar.text[:40]}`; there are: {', '.join(SYNTAXES)}")
        if name not in ("timeout", "memory"):
            engine = str(found.get("engine", DEFAULT_ENGINE))
            own = {key: each for key, each in {**found, name: value}.items() if key not in ("engine", "syntax")}
            check_options(checked_options("a sweep", own, CheckOptions, engine), engine)
            found[name] = value


def _written(node: Node) -> str:
    return node.span.source.text[node.span.start : node.span.end][:40]


def _said(axis: Axis) -> str:
    return {"constant": "constant", "parameter": "parameter", "initial": "variable"}.get(axis.kind or "", "file")
