"""From an arrangement file to a validated arrangement, or to everything that is wrong with it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping as MappingABC
from dataclasses import replace
from pathlib import Path
from typing import Literal, TextIO, cast

from llfsm_verify.arrangement.constant_comparisons import constant_comparisons
from llfsm_verify.arrangement.fields import VERSION, Report, mark
from llfsm_verify.arrangement.files import STDIN, read_named, read_source, read_stdin, source_of
from llfsm_verify.arrangement.instance import InstanceChecker, InstanceText
from llfsm_verify.arrangement.kinds import may_be_shown, other_kind, unlike
from llfsm_verify.arrangement.machine_text import MachineReader, MachineText
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.nodes import Node, Scalar, compose
from llfsm_verify.arrangement.profile import read_profile
from llfsm_verify.arrangement.schedule import read_processes
from llfsm_verify.arrangement.suppressions import KEY, read_suppressions
from llfsm_verify.arrangement.timing import check_time, read_timing
from llfsm_verify.arrangement.type_table import TypeTable
from llfsm_verify.arrangement.whiteboard import read_whiteboard
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span
from llfsm_verify.language.scope import MachineSignature, Scope, enumerators_of
from llfsm_verify.language.types import EnumType

ARRANGEMENT_KEYS = (
    VERSION, "name", "profile", "observe", "cycle_ms", "timing", "finished", "fairness",
    "types", "whiteboard", "machines", "schedule", "processes", KEY,
)  # fmt: skip
INSTANCE_KEYS = ("file", "inline", "parameters", "suspended")
MAX_DIAGNOSTICS = 50


def load_arrangement(
    path: str | Path, *, stdin: TextIO | None = None, integer_guards: bool = False, named_at: Span | None = None
) -> Arrangement:
    """Read the arrangement file `path` (``-``: standard input) and the machine files it names.

    `named_at`: the path stands at this place in a file, so it is read with the care of `read_named`.
    Raises DiagnosticError with everything found wrong, sorted by place, at most 50 diagnostics.
    """
    if named_at is not None:
        source, data = read_named(path, named_at, f"arrangement `{str(path)[:200]}`")
        return _Loader(source, data, Path(path).parent, integer_guards, named_at).load()
    if str(path) == "-":
        source, data = read_stdin(stdin)
        return _Loader(source, data, Path(), integer_guards).load()
    source, data = read_source(path)
    return _Loader(source, data, Path(path).parent, integer_guards).load()


def load_arrangement_text(text: str, name: str = "<text>", *, integer_guards: bool = False) -> Arrangement:
    """The same for a text; its machine files are looked up from the current directory."""
    data = text.encode("utf-8", "surrogatepass")
    return _Loader(source_of(data, name), data, Path(), integer_guards).load()


def build_arrangement(document: MappingABC[str, object], *, integer_guards: bool = False) -> Arrangement:
    """An arrangement from Python values in the shape of the file; machines by `inline` or `file`.

    `document` holds mappings, lists, strings, bools, ints and None. With `integer_guards` an integer where a condition
    is expected is read as `!= 0`, as in C. Raises DiagnosticError as `load_arrangement` does.
    """
    text = json.dumps(_strings(document), ensure_ascii=False, indent=1)
    return load_arrangement_text(text, "<document>", integer_guards=integer_guards)


def _strings(value: object) -> object:
    if isinstance(value, MappingABC):
        return {str(k): _strings(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [_strings(v) for v in value]
    if isinstance(value, bool):
        return "true" if value else "false"
    return "" if value is None else str(value)


class _Loader:
    def __init__(
        self, source: Source, data: bytes, folder: Path, integer_guards: bool, named_at: Span | None = None
    ) -> None:
        self.source = source
        self.named_at = named_at
        self.folder = folder
        self.integer_guards = integer_guards
        self.report = Report()
        self.digest = hashlib.sha256(data)
        self.sources = [source.name]
        """Names of the files read, in order: the order in which their diagnostics are shown."""
        self.files: dict[str, MachineText | None] = {}
        self.broken: set[str] = set()

    def load(self) -> Arrangement:
        try:
            arrangement = self._arrangement(compose(self.source, self.report.diagnostics))
        except DiagnosticError as e:
            self.report.diagnostics = list(e.diagnostics)
            arrangement = None
        diagnostics = self._ordered()
        errors = [d for d in diagnostics if d.is_error]
        if errors or arrangement is None:
            if self.named_at is not None and not may_be_shown(self.source, errors):
                raise DiagnosticError(unlike("arrangement", self.source.name, self.named_at))
            other = other_kind(self.source, "arrangement")
            if other is not None:
                raise DiagnosticError(other)
            raise DiagnosticError(errors[:MAX_DIAGNOSTICS])
        return replace(arrangement, warnings=tuple(diagnostics[:MAX_DIAGNOSTICS]))

    def _ordered(self) -> list[Diagnostic]:
        """Without repetitions (two instances of one machine have the same mistakes), sorted by place."""
        unique: dict[tuple[str, str, int], Diagnostic] = {}
        eaten: set[tuple[str, int]] = set()
        for d in self.report.diagnostics:
            place = (d.span.source.name, d.span.start) if d.span else (d.file or "", -1)
            if place not in eaten:
                unique.setdefault((d.code, *place), d)
            if d.code in ("E016", "E020"):
                eaten.add(place)  # what is left of a value that YAML took apart is no mistake of its own

        def key(d: Diagnostic) -> tuple[int, int]:
            name = d.span.source.name if d.span else d.file or ""
            number = self.sources.index(name) if name in self.sources else len(self.sources)
            return number, d.span.start if d.span else -1

        return sorted(unique.values(), key=key)

    # ------------------------------------------------------------ the arrangement

    def _arrangement(self, root: Node) -> Arrangement | None:
        report = self.report
        if not report.can_read(root, "the arrangement"):
            return None
        fields = report.fields(root, "an arrangement", ARRANGEMENT_KEYS)
        if fields is None:
            return None
        top = Span(self.source, root.span.start, root.span.start + 1)
        name = self._name(fields.get("name"))
        types = TypeTable(report, fields.get("types"))
        world = Scope(
            {}, {}, {}, (), "", types.types, enumerators_of(types.types.values()), frozenset(), self.integer_guards
        )
        whiteboard, bad_variables, accepted = read_whiteboard(report, fields.get("whiteboard"), types, world)
        self.broken |= bad_variables
        instances = self._instances(fields.get("machines"), types, top)
        suppressions = [*read_suppressions(report, fields.get(KEY), root, whole=True), *accepted]
        for text in {id(i.text): i.text for i in instances.values()}.values():
            suppressions += text.suppressions
        for w in whiteboard:
            if w.variable.name in instances:
                message = f"there is a machine `{w.variable.name}`, too"
                report.error("E118", message, w.variable.span, "properties could not tell them apart: rename one")
        places = {n: i.span for n, i in instances.items()}
        processes = read_processes(report, fields, places, self.broken, top) if "machines" in fields else ()
        order = [m for p in processes for m in p.schedule]
        observe = report.choice(fields.get("observe"), "`observe`", ("ringlet", "cycle"), "ringlet")
        if observe == "cycle" and len(processes) > 1:
            hint = "several processes have no common cycle: write `observe: ringlet`"
            report.error("E085", "`observe: cycle` needs a single process", mark(fields["observe"]), hint)
        world = replace(
            world,
            variables={w.variable.name: w.variable for w in whiteboard},
            machines={n: i.signature() for n, i in instances.items()},
            others=tuple(order),
            inputs=frozenset(w.variable.name for w in whiteboard if w.role == "input"),
        )
        checkers = {n: InstanceChecker(report, world, i, frozenset(self.broken)) for n, i in instances.items()}
        checked = {n: c.check() for n, c in checkers.items()}
        machines = tuple(checked[n] for n in order)
        timed, period = read_timing(report, fields)
        check_time(report, [root for c in checkers.values() for root in c.timed], timed, period)
        self._warn_unused(instances)
        report.diagnostics += constant_comparisons(machines)
        return Arrangement(
            name=name,
            path=self.source.name,
            digest=self.digest.hexdigest(),
            profile=read_profile(report, fields.get("profile")),
            observe=cast('Literal["ringlet", "cycle"]', observe),
            timing="timed" if timed else "untimed",
            cycle_ms=period,
            finished=cast(
                'Literal["leave", "keep"]',
                report.choice(fields.get("finished"), "`finished`", ("leave", "keep"), "leave"),
            ),
            fairness=cast(
                'Literal["processes", "none"]',
                report.choice(fields.get("fairness"), "`fairness`", ("processes", "none"), "processes"),
            ),
            types=types.types,
            enumerations=tuple(dict.fromkeys(t for t in types.types.values() if isinstance(t, EnumType))),
            whiteboard=whiteboard,
            machines=machines,
            processes=processes,
            warnings=(),
            span=top,
            suppressions=tuple(suppressions),
        )

    def _name(self, node: Node | None) -> str:
        if node is None:
            stem = Path(self.source.name).name.split(".")[0]
            return stem if stem and not self.source.name.startswith("<") else "arrangement"
        scalar = self.report.scalar(node, "`name`")
        return scalar.text if scalar is not None else "?"

    # ------------------------------------------------------------ machines

    def _instances(self, node: Node | None, types: TypeTable, top: Span) -> dict[str, InstanceText]:
        if node is None:
            hint = "write `machines:` with one `name: {file: …}` a line"
            self.report.error("E034", "an arrangement has no `machines`", top, hint)
            return {}
        mapping = self.report.mapping(node, "`machines`")
        found: dict[str, InstanceText] = {}
        for key, value in mapping.items if mapping else ():
            name = self.report.name(key, "the name of a machine")
            instance = None if name is None else self._instance(name, key, value, types)
            if instance is None:
                self.broken.add(key.text)
            else:
                found[instance.name] = instance
        return found

    def _instance(self, name: str, key: Scalar, node: Node, types: TypeTable) -> InstanceText | None:
        report = self.report
        fields = report.fields(node, f"machine `{name}`", INSTANCE_KEYS)
        if fields is None:
            return None
        if ("file" in fields) == ("inline" in fields):
            hint = "write `{file: NAME.machine.yaml}`"
            report.error("E060", f"machine `{name}` needs either `file` or `inline`", key.span, hint)
            return None
        if "inline" in fields:
            text = MachineReader(report, types).read(fields["inline"])
        else:
            scalar = report.scalar(fields["file"], "`file`")
            text = None if scalar is None else self._machine_file(scalar, types)
        suspended = report.choice(fields.get("suspended"), "`suspended`", ("true", "false"), "false") == "true"
        arguments = report.mapping(fields["parameters"], "`parameters`") if "parameters" in fields else None
        if text is None:
            return None
        given = {k.text: (k, v) for k, v in arguments.items} if arguments else {}
        return InstanceText(name, text, given, suspended, key.span)

    def _machine_file(self, node: Scalar, types: TypeTable) -> MachineText | None:
        path = str(self.folder / node.text)
        if path not in self.files:
            self.files[path] = None
            try:
                source, data = read_named(path, mark(node), f"machine file `{node.text[:200]}`")
            except DiagnosticError as e:
                self.report.add(e)
                return None
            before = len(self.report.diagnostics)
            try:
                self.digest.update(data)
                self.sources.append(source.name)
                self.files[path] = MachineReader(self.report, types).read(self._compose(source))
            except DiagnosticError as e:
                self.report.add(e)
            found = [d for d in self.report.diagnostics[before:] if d.is_error]
            if found:
                other = other_kind(source, "machine")
                if not may_be_shown(source, found):
                    self.files[path], other = None, unlike("machine", node.text, mark(node))
                if other is not None:
                    self.report.diagnostics[before:] = [other]
        return self.files[path]

    def _compose(self, source: Source) -> Node:
        diagnostics: list[Diagnostic] = []
        node = compose(source, diagnostics)
        self.report.diagnostics += diagnostics
        return node

    def _warn_unused(self, instances: dict[str, InstanceText]) -> None:
        for instance in instances.values():
            for parameter in instance.text.parameters:
                if parameter.name not in instance.text.words:
                    message = f"parameter `{parameter.name}` of machine `{instance.text.kind}` is never used"
                    self.report.diagnostics.append(Diagnostic("W001", message, parameter.span, hint="remove it"))


__all__ = ["STDIN", "MachineSignature", "build_arrangement", "load_arrangement", "load_arrangement_text"]
