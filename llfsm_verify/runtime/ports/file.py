"""Files of ports: which port feeds which input, and shows which slot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import cast

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.program.program import Choice
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.ports import SHARED, UNKNOWN
from llfsm_verify.runtime.ports.port import ON_FAILURE, PORTS, Kind, OnFailure, PortSpec
from llfsm_verify.values import ValueProblem, choice_value
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.duration import duration_ms
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Mapping as MappingNode
from llfsm_verify.yaml.nodes import Node, Scalar, mark
from llfsm_verify.yaml.nodes import Sequence as SequenceNode
from llfsm_verify.yaml.tables import (
    FORMAT,
    NAME,
    ByName,
    Either,
    Field,
    Schema,
    Several,
    Single,
    Table,
    Words,
    schema_of,
)

_FIELDS = Either((ByName(Single()), Several(Single(("string",)))))
PORT = Table(
    "one port. Its kind says which other keys it has; packages may bring kinds of their own",
    (
        Field(
            "kind",
            f"{', '.join(f'`{kind}`' for kind in PORTS)}, or a kind of another package",
            Single(("string",)),
            required=True,
        ),
        Field(
            "inputs",
            "the field of a message that feeds each input: `{car: sensor}`, or `[car]` where both names are the same",
            _FIELDS,
        ),
        Field(
            "outputs",
            "the field that shows each slot: a variable of the whiteboard or of a machine, an input, or the state of a "
            "machine",
            _FIELDS,
        ),
        Field(
            "on_failure",
            "what happens when an input has failed: `stale`, `safe` or `stop`. It is required for a port with inputs",
            Words(ON_FAILURE),
        ),
        Field("timeout", "how long an input may be without a message before it has failed: `500ms`, `5s`, `1min`"),
        Field("safe", "safe values of inputs and of outputs", ByName(Single(), least=0)),
    ),
    some=("inputs", "outputs"),
    needs={"inputs": ("on_failure",), "on_failure": ("inputs",), "timeout": ("inputs",)},
)
"""What every port may have; its kind has more."""
FILE = Table(
    "how the inputs of a run come from the world, and its outputs go there: `llfsm run --ports FILE`",
    (FORMAT, Field("ports", "the ports by name", ByName(PORT, NAME), required=True)),
)


def read_ports(path: str, inputs: Mapping[str, Choice], slots: Sequence[Slot]) -> tuple[PortSpec, ...]:
    """The ports in a file, for an arrangement with these inputs and slots.

    DiagnosticError: what any YAML file can have (E001 to E018, E030 to E036), a kind, input, slot or value that there
    is not (E493), and what two want (E494).
    """
    source, _ = read_source(path)
    reader = _Reader(path, inputs, slots)
    root = compose(source, reader.report.diagnostics)
    found = reader.file(root)
    if reader.report.diagnostics:
        raise DiagnosticError(sorted(reader.report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return found


def schema(name: str) -> Schema:
    """The JSON Schema of a file of ports, with all kinds that are known by a table."""
    tables = {word: getattr(PORTS.load(word), "table", None) for word in PORTS}
    port = replace(PORT, variants={word: table for word, table in tables.items() if isinstance(table, Table)})
    ports = replace(FILE.fields[1], value=ByName(port, NAME))
    return schema_of(name, "Ports of a running arrangement", replace(FILE, fields=(FORMAT, ports)))


class _Reader:
    def __init__(self, path: str, inputs: Mapping[str, Choice], slots: Sequence[Slot]) -> None:
        self.report = Report()
        self._folder = str(Path(path).parent)
        self._inputs = inputs
        self._slots = {slot.name: slot for slot in slots}
        self._taken: dict[str, Span] = {}
        """Where each input and each thing that a port holds was named first, in words."""

    def file(self, root: Node) -> tuple[PortSpec, ...]:
        if not self.report.can_read(root, "the file of ports"):
            return ()
        fields = self.report.fields(root, "a file of ports", FILE.keys, FILE.required)
        mapping = None if fields is None else self.report.mapping(fields["ports"], "`ports`")
        if mapping is None:
            return ()
        if not mapping.items:
            self.report.error("E034", "there are no ports", mark(mapping), "write `name: {kind: …}`")
        found = [self._port(key, node) for key, node in mapping.items]
        return tuple(spec for spec in found if spec is not None)

    def _port(self, key: Scalar, node: Node) -> PortSpec | None:
        report, what = self.report, f"port `{key.text[:60]}`"
        name, mapping = report.name(key, "the name of a port"), report.mapping(node, what)
        if name is None or mapping is None:
            return None
        kind = self._kind(mapping, what)
        if kind is None:
            return None
        found = report.fields(node, what, (*PORT.keys, *kind.keys), (*PORT.required, *kind.required))
        if found is None:
            return None
        inputs = self._entries(found.get("inputs"), "inputs", kind, what)
        outputs = self._entries(found.get("outputs"), "outputs", kind, what)
        if "inputs" not in found and "outputs" not in found:
            report.error(
                "E034", f"{what} has neither `inputs` nor `outputs`", key.span, "write `inputs: {NAME: FIELD}`"
            )
        safe = self._safe(found.get("safe"), inputs, outputs, what)
        on_failure, timeout = self._failing(found, key, inputs, safe, what)
        started = kind.settings(report, found, what, self._folder)
        if started is None:
            return None
        if started.paces:
            self._take("the clock", key.span, "two ports begin the cycles of the run")
        for held in started.holds:
            self._take(held, key.span, f"{what} needs {held}, which another port has")
        return PortSpec(
            name,
            started.start,
            inputs,
            outputs,
            on_failure,
            timeout,
            safe,
            started.holds,
            key.span,
            started.paces,
        )

    def _kind(self, mapping: MappingNode, what: str) -> Kind | None:
        node = next((value for key, value in mapping.items if key.text == "kind"), None)
        if node is None:
            self.report.error("E034", f"{what} has no `kind`", mark(mapping), f"write `kind:` and {_or(PORTS)}")
            return None
        scalar = self.report.scalar(node, f"the kind of {what}")
        if scalar is None:
            return None
        broken = [] if scalar.text in PORTS else PORTS.find_others()
        if scalar.text not in PORTS:
            hint = did_you_mean(scalar.text, PORTS) or f"write {_or(PORTS)}"
            message = f"there is no kind of port `{scalar.text[:60]}`"
            self.report.error(UNKNOWN, message, mark(scalar), hint, tuple(broken))
            return None
        return PORTS.load(scalar.text)

    def _entries(self, node: Node | None, key: str, kind: Kind, what: str) -> dict[str, str]:
        """The field of each input or slot; in a list, each has its own name."""
        if node is None:
            return {}
        pairs: list[tuple[Scalar, Node]]
        if isinstance(node, SequenceNode):
            scalars = [self.report.scalar(item, f"what `{key}` has") for item in node.items]
            named = [scalar for scalar in scalars if scalar is not None]
            self.report.distinct(named)
            pairs = [(one, one) for one in {scalar.text: scalar for scalar in named}.values()]
        else:
            mapping = self.report.mapping(node, f"`{key}`")
            pairs = [] if mapping is None else list(mapping.items)
        if not pairs and (isinstance(node, SequenceNode | MappingNode)):
            self.report.error("E034", f"{what} has no {key}", mark(node), f"leave out `{key}`, or name some")
        found: dict[str, str] = {}
        fields: dict[str, Span] = {}
        for name, value in pairs:
            field = self.report.scalar(value, f"the field of `{name.text[:60]}`")
            if field is None or not self._is_there(name, key):
                continue
            problem = kind.field_problem(field.text, output=key == "outputs")
            if problem is not None:
                self.report.error(UNKNOWN, f"`{field.text[:60]}`: {problem}", mark(field), "write another name")
            elif key == "inputs":
                self._take(f"the input `{name.text}`", mark(name), f"two ports feed the input `{name.text}`")
            elif field.text in fields:
                note = f"the first one is at {fields[field.text].nearby}"
                message = f"two outputs of {what} have the field `{field.text[:60]}`"
                self.report.error(SHARED, message, mark(field), "give each a field of its own", (note,))
            fields.setdefault(field.text, mark(field))
            found[name.text] = field.text
        return found

    def _is_there(self, name: Scalar, key: str) -> bool:
        known = self._inputs if key == "inputs" else self._slots
        if name.text in known:
            return True
        hint = did_you_mean(name.text, known) or f"there are {len(known)}; `llfsm whiteboard get` shows slots of a run"
        if not known:
            hint = "the arrangement has none"
        elif key == "inputs" and name.text in self._slots:
            hint = f"`{name.text}` is not an input from outside, so it can only be named under `outputs`"
        kind = "input" if key == "inputs" else "slot"
        self.report.error(UNKNOWN, f"there is no {kind} `{name.text[:60]}`", mark(name), hint)
        return False

    def _take(self, thing: str, at: Span, message: str) -> None:
        if thing in self._taken:
            note = f"the first one is at {self._taken[thing].nearby}"
            self.report.error(SHARED, message, at, "remove one of the two", (note,))
        self._taken.setdefault(thing, at)

    def _safe(
        self, node: Node | None, inputs: Mapping[str, str], outputs: Mapping[str, str], what: str
    ) -> dict[str, str]:
        mapping = None if node is None else self.report.mapping(node, "`safe`")
        found: dict[str, str] = {}
        for key, value in () if mapping is None else mapping.items:
            scalar = self.report.scalar(value, f"the safe value of `{key.text[:60]}`")
            if key.text not in inputs and key.text not in outputs:
                hint = did_you_mean(key.text, (*inputs, *outputs)) or "also name it under `inputs` or `outputs`"
                self.report.error(UNKNOWN, f"{what} has no input or output `{key.text[:60]}`", key.span, hint)
            elif scalar is not None:
                choice = self._inputs[key.text] if key.text in inputs else self._slots[key.text].choice
                found[key.text] = scalar.text
                try:
                    choice_value(choice, scalar.text)
                except ValueProblem as problem:
                    self.report.error(UNKNOWN, f"{key.text}: {problem}", mark(scalar), "write a value of its type")
        return found

    def _failing(
        self, found: Mapping[str, Node], key: Scalar, inputs: Mapping[str, str], safe: Mapping[str, str], what: str
    ) -> tuple[OnFailure, float | None]:
        """What happens when inputs fail, and after which time they do."""
        for word in ("on_failure", "timeout"):
            if word in found and "inputs" not in found:
                message = f"{what} has `{word}`, which is about inputs, and no inputs"
                self.report.error(UNKNOWN, message, mark(found[word]), f"leave out `{word}`")
        if "inputs" in found and "on_failure" not in found:
            hint = f"write `on_failure:` and {_or(ON_FAILURE)}"
            self.report.error("E034", f"{what} does not say what happens when its inputs fail", key.span, hint)
        on_failure = self.report.choice(found.get("on_failure"), f"`on_failure` of {what}", ON_FAILURE, "stale")
        lacking = [name for name in inputs if name not in safe] if on_failure == "safe" else []
        if lacking:
            message = f"the input `{lacking[0]}` of {what} has no safe value"
            self.report.error("E034", message, mark(found["on_failure"]), f"write `safe: {{{lacking[0]}: …}}`")
        scalar = self.report.scalar(found["timeout"], "`timeout`") if "timeout" in found else None
        milliseconds = None if scalar is None else duration_ms(scalar.text)
        if scalar is not None and milliseconds is None:
            message = f"`{scalar.text[:40]}` is not a positive time"
            self.report.error(UNKNOWN, message, mark(scalar), "write a time such as 500ms, 90s, 5min or 2h")
        return cast(OnFailure, on_failure), None if milliseconds is None else float(milliseconds / 1000)


def _or(words: Sequence[str] | Mapping[str, object]) -> str:
    *most, last = [f"`{word}`" for word in words]
    return f"{', '.join(most)} or {last}"
