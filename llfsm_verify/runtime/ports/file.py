"""Files of ports: which port feeds which input, and shows which slot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import cast

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.arrangement.requests import IDLE, STATES, UNDER_WAY, Request, RequestKind
from llfsm_verify.diagnostics import DiagnosticError, Span
from llfsm_verify.language.scope import did_you_mean
from llfsm_verify.program.program import Choice
from llfsm_verify.runtime.live.slots import Slot
from llfsm_verify.runtime.ports import MISFIT, SHARED, UNABLE, UNKNOWN
from llfsm_verify.runtime.ports.port import ON_FAILURE, PORTS, Kind, OnFailure, PortSpec
from llfsm_verify.values import ValueProblem, choice_value
from llfsm_verify.yaml.compose import compose
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
        Field("values", "what texts of the other side are called here: `{Start: START}`", ByName(Single())),
        Field(
            "events",
            "inputs that have the value of a message for one cycle each, and then a value of rest: `{start: NONE}`",
            ByName(Single()),
        ),
        Field("when", "the slot by whose change a message goes out; without it, every change of an output does"),
    ),
    some=("inputs", "outputs", "requests"),
    needs={
        "inputs": ("on_failure",),
        "on_failure": ("inputs",),
        "timeout": ("inputs",),
        "events": ("inputs",),
        "when": ("outputs",),
    },
)
"""What every port may have; its kind has more."""
REQUEST = Table(
    "a service or an action of the other side. Its kind of port may have more keys",
    (
        Field("kind", "`service` or `action`; a plant of the same name says it otherwise", Words(tuple(STATES))),
        Field("ask", "the slot that asks while it is true; a plant of the same name says it otherwise"),
        Field("state", "the input that has the state of the request; a plant of the same name says it otherwise"),
        Field("sends", "the field of the request that shows each slot", _FIELDS),
        Field("answers", "the field of the answer that feeds each input", _FIELDS),
        Field("feedback", "the field of the feedback that feeds each input; of an action", _FIELDS),
        Field("timeout", "the time after which it is `TIMED_OUT`, or as an action `LOST`"),
    ),
)
"""What every request has; its kind of port has more."""
FILE = Table(
    "how the inputs of a run come from the world, and its outputs go there: `llfsm run --ports FILE`",
    (FORMAT, Field("ports", "the ports by name", ByName(PORT, NAME), required=True)),
)


def read_ports(
    path: str,
    inputs: Mapping[str, Choice],
    slots: Sequence[Slot],
    requests: Mapping[str, Request] = MappingProxyType({}),
    free: Mapping[str, Choice] = MappingProxyType({}),
) -> tuple[PortSpec, ...]:
    """The ports in a file, for an arrangement with these inputs and slots, with `requests` that its plants describe,
    and `free` inputs, which never change.

    DiagnosticError: what any YAML file can have (E001 to E018, E030 to E036), a kind, input, slot or value that there
    is not (E493), what two want (E494), a request that does not fit (E526), and what the kind cannot do (E527).
    """
    source, _ = read_source(path)
    reader = _Reader(path, inputs, slots, requests, free)
    root = compose(source, reader.report.diagnostics)
    found = reader.file(root)
    if reader.report.diagnostics:
        raise DiagnosticError(sorted(reader.report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return found


def schema(name: str) -> Schema:
    """The JSON Schema of a file of ports, with all kinds that are known by a table."""
    tables = {word: _variant(PORTS.load(word)) for word in PORTS}
    port = replace(PORT, variants={word: table for word, table in tables.items() if table is not None})
    ports = replace(FILE.fields[1], value=ByName(port, NAME))
    return schema_of(name, "Ports of a running arrangement", replace(FILE, fields=(FORMAT, ports)))


def _variant(kind: Kind) -> Table | None:
    table, requests = getattr(kind, "table", None), asked_of(kind)
    if not isinstance(table, Table) or requests is None:
        return table if isinstance(table, Table) else None
    value = replace(REQUEST, fields=(*REQUEST.fields, *requests.fields))
    return replace(table, fields=(*table.fields, Field("requests", REQUESTS, ByName(value, NAME))))


def asked_of(kind: Kind) -> Table | None:
    """What requests of a kind have beside what all have; None: its ports have none."""
    found = getattr(kind, "requests", None)
    return found if isinstance(found, Table) else None


REQUESTS = "the services and actions of the other side, by name"


class _Reader:
    def __init__(
        self,
        path: str,
        inputs: Mapping[str, Choice],
        slots: Sequence[Slot],
        requests: Mapping[str, Request],
        free: Mapping[str, Choice],
    ) -> None:
        self.report = Report()
        self._folder = str(Path(path).parent)
        self._inputs = {**inputs, **free}
        self._free, self._described = free, requests
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
        refused = getattr(kind, "no_requests", "")
        asks = ("requests",) if refused or asked_of(kind) is not None else ()
        found = report.fields(node, what, (*PORT.keys, *asks, *kind.keys), (*PORT.required, *kind.required))
        if found is None:
            return None
        if refused and "requests" in found:
            report.error(UNKNOWN, f"{what} has no requests: {refused}", mark(found.pop("requests")), "remove them")
        inputs = self._entries(found.get("inputs"), "inputs", kind, what)
        outputs = self._entries(found.get("outputs"), "outputs", kind, what)
        if not {"inputs", "outputs", "requests"} & found.keys():
            report.error(
                "E034", f"{what} has neither `inputs` nor `outputs`", key.span, "write `inputs: {NAME: FIELD}`"
            )
        values = self._values(found.get("values"))
        before = len(report.diagnostics)
        requests = self._requests(found.get("requests"), kind, values, what)
        self._answered(inputs)
        if len(report.diagnostics) == before:  # else it is not known what the port has
            self._fit(found.get("values"), values, inputs, outputs, requests, what)
        never = frozenset(inputs) & self._free.keys()
        if never and asked_of(kind) is None:
            message = f"`{min(never)}` never changes, and a port of this kind reads nothing before the run"
            report.error(
                UNABLE, message, mark(found["inputs"]), f"let a program give it, or write `--set {min(never)}=…`"
            )
        events = self._events(found.get("events"), inputs, what)
        when = self._when(found, what)
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
            name, started.start, inputs, outputs, on_failure, timeout, safe, started.holds, key.span, started.paces,
            values, events, when, requests, never,
        )  # fmt: skip

    def _values(self, node: Node | None) -> dict[str, str]:
        mapping = None if node is None else self.report.mapping(node, "`values`")
        found: dict[str, str] = {}
        for key, value in () if mapping is None else mapping.items:
            scalar = self.report.scalar(value, f"what `{key.text[:60]}` is called here")
            if scalar is not None:
                found[key.text] = scalar.text
        return found

    def _fit(
        self,
        node: Node | None,
        values: Mapping[str, str],
        inputs: Mapping[str, str],
        outputs: Mapping[str, str],
        requests: Sequence[Request],
        what: str,
    ) -> None:
        """Each of `values` is one of something that the port has."""
        asked = [name for r in requests for name in (r.state, *r.answers, *r.feedback, *r.sends)]
        choices = [self._choice(name) for name in (*inputs, *outputs, *asked)]
        shown = [self._choice(name) for name in (*outputs, *(name for r in requests for name in r.sends))]
        told: dict[str, str] = {}
        """The text of each value that goes out."""
        mapping = node.items if isinstance(node, MappingNode) else ()
        for key, value in mapping:
            ours = values.get(key.text)
            if ours is not None and not any(_is_value(choice, ours) for choice in choices):
                message = f"no input or output of {what} can be `{ours[:60]}`"
                known = [label for choice in choices for label in choice.labels]
                hint = did_you_mean(ours, known) or f"write the value that `{key.text[:60]}` stands for"
                self.report.error(UNKNOWN, message, mark(value), hint)
            elif ours is not None and (both := [choice for choice in shown if _is_value(choice, ours)]):
                first = told.setdefault(ours, key.text)
                if first != key.text:
                    message = f"`{ours[:60]}` goes out, and has two texts: `{first[:60]}` and `{key.text[:60]}`"
                    self.report.error(SHARED, message, key.span, "leave out one, or make a port of its own for inputs")
                elif key.text not in values.values() and any(_is_value(choice, key.text) for choice in both):
                    message = f"`{ours[:60]}` would go out as `{key.text[:60]}`, which is another value"
                    self.report.error(SHARED, message, key.span, "write a text that no value of an output has")

    def _choice(self, name: str) -> Choice:
        return self._inputs[name] if name in self._inputs else self._slots[name].choice

    def _events(self, node: Node | None, inputs: Mapping[str, str], what: str) -> dict[str, str]:
        mapping = None if node is None else self.report.mapping(node, "`events`")
        found: dict[str, str] = {}
        for key, value in () if mapping is None else mapping.items:
            rest = self.report.scalar(value, f"the value of rest of `{key.text[:60]}`")
            if key.text not in inputs or key.text in self._free:
                known = [name for name in inputs if name not in self._free]
                hint = did_you_mean(key.text, known) or "also name it under `inputs`"
                self.report.error(UNKNOWN, f"{what} has no input `{key.text[:60]}` that changes", key.span, hint)
            elif rest is not None:
                found[key.text] = rest.text
                self._check(key.text, rest)
        return found

    def _check(self, name: str, scalar: Scalar) -> None:
        """Whether it is a value of an input or slot."""
        try:
            choice_value(self._choice(name), scalar.text)
        except ValueProblem as problem:
            self.report.error(UNKNOWN, f"{name}: {problem}", mark(scalar), "write a value of its type")

    def _when(self, found: Mapping[str, Node], what: str) -> str | None:
        scalar = self.report.scalar(found["when"], "`when`") if "when" in found else None
        if scalar is None or not self._is_there(scalar, "outputs"):
            return None
        if "outputs" not in found:
            message = f"{what} has `when`, which is about outputs, and no outputs"
            self.report.error(UNKNOWN, message, mark(scalar), "leave out `when`")
        return scalar.text

    # ------------------------------------------------------------ requests

    def _answered(self, inputs: Mapping[str, str]) -> None:
        """What only answers and feedback change, as plants have it, is not fed otherwise, unless by who has the state
        as well: it keeps the order of events by itself."""
        for plant in self._described.values():
            for part, fed in (("answers", plant.answers), ("feedback", plant.feedback)):
                for name in (name for name in fed if name in inputs and plant.state not in inputs):
                    message = f"`inputs` have `{name}`, which is in `{part}` of the plant `{plant.name}`"
                    hint = f"write it under `{part}` of the request `{plant.name}`"
                    self.report.error(MISFIT, message, self._taken[f"the input `{name}`"], hint)

    def _requests(self, node: Node | None, kind: Kind, values: Mapping[str, str], what: str) -> tuple[Request, ...]:
        mapping = None if node is None else self.report.mapping(node, "`requests`")
        if mapping is not None and not mapping.items:
            self.report.error("E034", f"{what} names no request", mark(mapping), "leave out `requests`, or name some")
        found = [self._request(key, one, kind, values, what) for key, one in (() if mapping is None else mapping.items)]
        return tuple(request for request in found if request is not None)

    def _request(self, key: Scalar, node: Node, kind: Kind, values: Mapping[str, str], what: str) -> Request | None:
        more, told = asked_of(kind), f"request `{key.text[:60]}` of {what}"
        name = self.report.name(key, "the name of a request")
        assert more is not None
        found = self.report.fields(node, told, (*REQUEST.keys, *more.keys), more.required)
        if name is None or found is None:
            return None
        before = len(self.report.diagnostics)
        plant = self._described.get(name)
        of = self.report.choice(found.get("kind"), f"`kind` of {told}", tuple(STATES), "")
        of = of or next((word for word in more.keys if word in STATES and word in found), "")
        words = {"kind": of} | {w: self._word(found, w) for w in ("ask", "state")}
        for word, given in words.items():
            words[word] = self._agreed(found.get(word), word, given, plant, key, told)
        self._take(f"the request `{name}`", key.span, f"two ports answer the request `{name}`")
        if len(self.report.diagnostics) > before:
            return None
        fields: dict[str, dict[str, str]] = {}
        for part in ("sends", "answers", "feedback"):
            fields[part] = self._entries(found.get(part), part, kind, told)
            if part != "sends" and (never := fields[part].keys() & self._free.keys()):
                message = f"`{min(never)}` never changes, so {told} cannot change it"
                self.report.error(MISFIT, message, mark(found[part]), "name it under `inputs`, or let it change")
        if "feedback" in found and words["kind"] == "service":
            self.report.error(
                MISFIT, f"{told} has `feedback`, and a service has none", mark(found["feedback"]), "leave it out"
            )
        timeout = self._agreed_time(found, plant, told)
        extra = {word: self._word(found, word) for word in more.keys if word in found}
        called = values if plant is None else plant.values
        self._fits(words, timeout, called, found, key, told)
        for part, inputs in (("answers", plant.answers), ("feedback", plant.feedback)) if plant is not None else ():
            for other in [other for other in fields[part] if other not in inputs]:
                message = f"the plant of {told} never changes `{other}`, which is named under `{part}`"
                self.report.error(MISFIT, message, mark(found[part]), f"add it to `{part}` of the plant")
        if len(self.report.diagnostics) > before:
            return None
        kind_of = cast(RequestKind, words["kind"])
        for one in STATES[kind_of]:
            ours = called.get(one, one)
            if values.get(one, ours) != ours and values[one] in self._inputs[words["state"]].labels:
                message = f"`values` call {one} of {told} `{values[one]}`, and its plant calls it `{ours}`"
                self.report.error(MISFIT, message, key.span, "leave it out, so that the plant says it")
        return Request(
            name,
            kind_of,
            words["ask"],
            words["state"],
            fields["sends"],
            fields["answers"],
            fields["feedback"],
            timeout,
            extra,
            called,
        )

    def _word(self, found: Mapping[str, Node], key: str) -> str:
        """The word under a key; none where it is missing, or wrong, which is reported."""
        scalar = self.report.scalar(found[key], f"`{key}`") if key in found else None
        return "" if scalar is None else scalar.text

    def _agreed(self, node: Node | None, word: str, given: str, plant: Request | None, key: Scalar, told: str) -> str:
        """What the file or the plant says; both must say the same."""
        described: str = "" if plant is None else getattr(plant, word)
        if not given and node is None and not described:
            hint = f"write `{word}: …`, or describe the request under `environment` of the arrangement"
            self.report.error("E034", f"{told} has no `{word}`", key.span, hint)
        elif given and described and given != described and node is not None:
            message = f"`{word}` of {told} is `{given[:60]}`, and its plant has `{described}`"
            self.report.error(MISFIT, message, mark(node), "leave it out, so that the plant says it")
        return described or given

    def _agreed_time(self, found: Mapping[str, Node], plant: Request | None, told: str) -> float | None:
        given, described = self._time(found), None if plant is None else plant.timeout
        if given is not None and plant is not None and given != described:
            has = "none" if described is None else f"{described:g} s"
            message = f"`timeout` of {told} is {given:g} s, and its plant has {has}"
            self.report.error(MISFIT, message, mark(found["timeout"]), "write the same at both, or leave it out here")
        return given if plant is None else described

    def _fits(
        self,
        words: Mapping[str, str],
        timeout: float | None,
        values: Mapping[str, str],
        found: Mapping[str, Node],
        key: Scalar,
        told: str,
    ) -> None:
        """Whether `ask` and `state` are a slot and an input that can be those of a request of this kind."""
        ask, state = words["ask"], words["state"]
        at = {word: mark(found[word]) if word in found else key.span for word in ("ask", "state")}
        if ask not in self._slots:
            hint = did_you_mean(ask, self._slots) or "write a variable that machines set"
            self.report.error(UNKNOWN, f"there is no slot `{ask[:60]}`", at["ask"], hint)
        elif not self._slots[ask].boolean or ask in self._inputs:
            what = "an input" if ask in self._inputs else "no truth value"
            self.report.error(MISFIT, f"`{ask}` of {told} is {what}", at["ask"], "write a `bool` that machines set")
        if state not in self._inputs or state in self._free:
            known = [name for name in self._inputs if name not in self._free]
            hint = did_you_mean(state, known) or "write an input whose values are states of a request"
            self.report.error(UNKNOWN, f"there is no input `{state[:60]}` that changes", at["state"], hint)
            return
        self._take(f"the input `{state}`", at["state"], f"two ports feed the input `{state}`")
        kind = cast(RequestKind, words["kind"])
        needed = [one for one in STATES[kind] if one != "TIMED_OUT" or timeout is not None]
        lacking = [one for one in needed if values.get(one, one) not in self._inputs[state].labels]
        parts = ((IDLE,), UNDER_WAY[kind], [one for one in needed if one not in (IDLE, *UNDER_WAY[kind])])
        called = [{values.get(one, one) for one in part} for part in parts]
        if twice := sorted(called[0] & called[1] | called[0] & called[2] | called[1] & called[2]):
            message = f"with `values`, `{twice[0]}` stands for states of {told} that are not alike"
            hint = f"let it stand for {IDLE}, for {' and '.join(UNDER_WAY[kind])}, or for ends"
            self.report.error(MISFIT, message, at["state"], hint)
        elif lacking:
            message = f"the type of `{state}`, the state of {told}, lacks {', '.join(lacking)}"
            hint = f"add it, or write `values: {{{lacking[0]}: …}}`"
            self.report.error(MISFIT, message, at["state"], hint)

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
        nests = asked_of(kind) is not None or getattr(kind, "paths", False)
        for name, value in pairs:
            field = self.report.scalar(value, f"the field of `{name.text[:60]}`")
            feeds = key not in ("outputs", "sends")
            if field is None or not self._is_there(name, "inputs" if feeds else "outputs"):
                continue
            problem = kind.field_problem(field.text, output=not feeds)
            if problem is not None:
                self.report.error(UNKNOWN, f"`{field.text[:60]}`: {problem}", mark(field), "write another name")
            elif feeds:
                self._take(f"the input `{name.text}`", mark(name), f"two ports feed the input `{name.text}`")
            elif nests and (inside := next((one for one in fields if _crosses(one, field.text)), None)):
                message = f"`{field.text[:60]}` and `{inside[:60]}` cannot both be in one message of {what}"
                self.report.error(SHARED, message, mark(field), "name a field, or fields inside it, but not both")
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
                found[key.text] = scalar.text
                self._check(key.text, scalar)
        return found

    def _failing(
        self, found: Mapping[str, Node], key: Scalar, inputs: Mapping[str, str], safe: Mapping[str, str], what: str
    ) -> tuple[OnFailure, float | None]:
        """What happens when inputs fail, and after which time they do."""
        for word in ("on_failure", "timeout"):
            if word in found and "inputs" not in found:
                message = f"{what} has `{word}`, which is about inputs, and no inputs"
                ends = ", and write `restart: false`, so that its end is that of the run"
                hint = f"leave out `{word}`{ends if word == 'on_failure' and 'clock' in found else ''}"
                self.report.error(UNKNOWN, message, mark(found[word]), hint)
        if "inputs" in found and "on_failure" not in found:
            hint = f"write `on_failure:` and {_or(ON_FAILURE)}"
            self.report.error("E034", f"{what} does not say what happens when its inputs fail", key.span, hint)
        on_failure = self.report.choice(found.get("on_failure"), f"`on_failure` of {what}", ON_FAILURE, "stale")
        lacking = [name for name in inputs if name not in safe] if on_failure == "safe" else []
        if lacking:
            message = f"the input `{lacking[0]}` of {what} has no safe value"
            self.report.error("E034", message, mark(found["on_failure"]), f"write `safe: {{{lacking[0]}: …}}`")
        return cast(OnFailure, on_failure), self._time(found)

    def _time(self, found: Mapping[str, Node]) -> float | None:
        milliseconds = self.report.time(found.get("timeout"), "`timeout`", UNKNOWN)
        return None if milliseconds is None else float(milliseconds / 1000)


def _crosses(one: str, other: str) -> bool:
    """Whether one field is a path through the other."""
    return one.startswith(f"{other}.") or other.startswith(f"{one}.")


def _is_value(choice: Choice, text: str) -> bool:
    try:
        choice_value(choice, text)
    except ValueProblem:
        return False
    return True


def _or(words: Sequence[str] | Mapping[str, object]) -> str:
    *most, last = [f"`{word}`" for word in words]
    return f"{', '.join(most)} or {last}"
