"""Files of ports: what is wrong with one is said at its place, and the schema knows the same keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.registry import Entry
from llfsm_verify.runtime.ports.callback import CallbackPort
from llfsm_verify.runtime.ports.file import PORT, asked_of, schema
from llfsm_verify.runtime.ports.port import PORTS, Link, Started
from llfsm_verify.yaml.tables import rows
from tests.runtime.ports.bench import bench, declared

GOOD = [
    "{kind: stream, read: stdin, inputs: [go, level], on_failure: stale}",
    "{kind: stream, write: out, outputs: {m: state, now: mode}, safe: {now: HIGH, m: S}}",
    "{kind: stream, read: 4, write: 5, inputs: {mode: m}, outputs: ['a[1]'], on_failure: safe, safe: {mode: LOW}}",
    "{kind: callback, call: a.b:c.d, inputs: [go], on_failure: stop, timeout: 500}",
]
WRONG = [
    ("ports: §[a]", "E030", ""), ("§{}", "E034", "ports"), ("ports: §{}", "E034", "kind"),
    ("{§port: 3, ports: {a: {CALL, outputs: [m]}}}", "E033", "ports"),
    ("format: §2\nports: {}", "E097", "later version"), ("ports: {§a-b: {kind: stream}}", "E036", "letters"),
    ("ports: {a: §{inputs: [go]}}", "E034", "`stream`"),
    ("ports: {a: {kind: §streem}}", "E493", "did you mean `stream`"),
    ("ports: {a: §{kind: callback, outputs: [m]}}", "E034", "call"),
    ("ports: {§a: {CALL}}", "E034", "inputs"),
    ("ports: {§a: {CALL, inputs: [go]}}", "E034", "`stale`, `safe` or `stop`"),
    ("ports: {a: {CALL, on_failure: stale, inputs: [§goo]}}", "E493", "`go`"),
    ("ports: {a: {CALL, on_failure: stale, inputs: {§kept: x}}}", "E493", "only be named under `outputs`"),
    ("ports: {a: {CALL, on_failure: stale, inputs: §{}}}", "E034", "name some"),
    ("ports: {a: {CALL, on_failure: stale, inputs: §3}}", "E030", ""),
    ("ports: {a: {CALL, outputs: [§moode]}}", "E493", "`mode`"),
    ("ports: {a: {CALL, outputs: [m, §m]}}", "E017", ""),
    ("ports: {a: {CALL, outputs: {m: x, n: §x}}}", "E494", "a field of its own"),
    ("ports: {a: {CALL, outputs: [m], timeout: §3s}}", "E493", "leave out"),
    ("ports: {a: {CALL, outputs: [m], on_failure: §stop}}", "E493", "leave out"),
    ("ports: {a: {kind: callback, call: §a, outputs: [m]}}", "E493", "module:function"),
    ("ports: {a: {CALL, inputs: [go], on_failure: §sale}}", "E035", "stale"),
    ("ports: {a: {CALL, inputs: [go], on_failure: stale, timeout: §-3s}}", "E493", "500ms"),
    ("ports: {a: {CALL, inputs: [go, level], on_failure: §safe, safe: {go: true}}}", "E034", "level"),
    ("ports: {a: {CALL, inputs: [go], on_failure: safe, safe: {go: §1}}}", "E493", "its type"),
    ("ports: {a: {CALL, outputs: [m], safe: {m: §T}}}", "E493", "its type"),
    ("ports: {a: {CALL, outputs: [m], safe: {§now: LOW}}}", "E493", "`m`"),
    ("ports: {a: {kind: stream, outputs: §[m]}}", "E034", "write `write: …`"),
    ("ports: {a: {kind: stream, read: §stdin, write: stdout, outputs: [m]}}", "E034", "write `inputs: …`"),
    ("ports: {a: {kind: stream, write: §stdin, outputs: [m]}}", "E493", "stdout"),
    ("ports: {a: {kind: stream, write: stdout, outputs: [m]}, §b: {kind: stream, write: 1, outputs: [n]}}", "E494", ""),
    ("ports: {a: {CALL, inputs: [go], on_failure: stop}, b: {CALL, inputs: {§go: x}, on_failure: stop}}", "E494", ""),
]  # fmt: skip


WRONG = [(text.replace("CALL", "kind: callback, call: a:b"), code, hint) for text, code, hint in WRONG]


@pytest.mark.parametrize(("text", "code", "hint"), WRONG)
def test_what_is_wrong_is_said_at_its_place(text: str, code: str, hint: str, tmp_path: Path) -> None:
    with pytest.raises(DiagnosticError) as caught:
        declared(text.replace("§", ""), tmp_path)
    place = Source("x", text.replace("§", "")).position(text.index("§"))
    found = [(d.code, d.span and (d.span.line, d.span.column)) for d in caught.value.diagnostics]
    assert found == [(code, place)]
    assert hint in (caught.value.diagnostics[0].hint or "") and caught.value.diagnostics[0].hint


@pytest.mark.parametrize("reader", [yaml.SafeLoader, yaml.BaseLoader], ids=["typed", "texts"])
def test_the_schema_takes_what_the_reader_takes(reader: Any, tmp_path: Path) -> None:
    validator = jsonschema.Draft202012Validator(schema("ports"))
    for port in GOOD:
        text = f"format: 1\nports: {{a: {port}}}\n"
        (spec,) = declared(text, tmp_path)
        assert spec.name == "a" and (spec.inputs or spec.outputs)
        validator.validate(yaml.load(text, Loader=reader))


def test_the_schema_refuses_what_it_can() -> None:
    validator = jsonschema.Draft202012Validator(schema("ports"))
    structural = [
        t for t, c, _ in WRONG if c in ("E030", "E033", "E034", "E035", "E036", "E097") and "safe: {go" not in t
    ]
    assert len(structural) > 12
    for text in structural:
        assert not validator.is_valid(yaml.safe_load(text.replace("§", ""))), text


def test_the_schema_has_every_kind_with_its_keys() -> None:
    found: Any = schema("ports")
    jsonschema.Draft202012Validator.check_schema(found)
    port = found["properties"]["ports"]["additionalProperties"]
    ours = [name for name in PORTS if PORTS[name].place.startswith("llfsm_verify.")]
    assert [branch["if"]["properties"]["kind"]["const"] for branch in port["allOf"]] == ours
    for name, branch in zip(ours, port["allOf"], strict=True):
        kind = PORTS.load(name)
        asks = ["requests"] if asked_of(kind) is not None else []
        assert branch["then"]["propertyNames"]["enum"] == [*PORT.keys, *kind.keys, *asks]
        assert {*branch["then"].get("required", ())} <= {*kind.required}
        assert all("description" in field for field in branch["then"]["properties"].values())


def test_the_page_says_of_keys_what_their_tables_say() -> None:
    page = Path("docs/ports.md").read_text("utf-8").splitlines()
    others = [field for field in PORT.fields if field.name != "kind"]  # extensions add kinds
    assert [row for row in rows(others) if row not in page] == []


class Broken(CallbackPort):
    """A port of another package, with a mistake."""

    def serve(self, ready: object, now: float) -> None:
        raise ZeroDivisionError("their mistake")


class Theirs:
    keys = ("colour",)
    required = ()

    def settings(self, report: object, found: object, what: str, folder: str) -> Started:
        def start(link: Link) -> Broken:
            return Broken(link, lambda _: None)

        return Started(start)

    def field_problem(self, name: str, *, output: bool) -> str | None:
        return None


KIND = Theirs()


class Point:
    """An entry point."""

    dist = None

    def __init__(self, name: str, what: object) -> None:
        self.name, self.value, self._what = name, f"theirs:{name}", what

    def load(self) -> object:
        return self._what


def test_kinds_of_other_packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = [Point("number", 3), Point("theirs", Entry("theirs", f"{__name__}:KIND", "for this test"))]
    monkeypatch.setattr("importlib.metadata.entry_points", lambda group: points if group == PORTS.group else [])
    monkeypatch.setattr(PORTS, "_entries", dict(PORTS._entries))
    monkeypatch.setattr(PORTS, "_broken", None)
    with pytest.raises(DiagnosticError) as caught:
        declared("ports: {a: {kind: nothing, outputs: [m]}}", tmp_path)
    assert caught.value.diagnostics[0].notes == (
        "the kind of port `number` cannot be used (TypeError: theirs:number is not an Entry)",
    )
    text = (
        "ports: {a: {kind: theirs, colour: red, inputs: [level], on_failure: safe, safe: {level: 3}}, "
        "b: {kind: stream, write: out, outputs: [level]}}"
    )
    (tmp_path / "out").touch()
    with bench(*declared(text, tmp_path)) as made:
        made.until(made.has("level", 3))
        made.end("ended")
        assert made.said == [
            "port a: the port has failed: ZeroDivisionError: their mistake: `level` gets its safe value"
        ]
    assert (tmp_path / "out").read_text().endswith('{"level": 3}\n')
