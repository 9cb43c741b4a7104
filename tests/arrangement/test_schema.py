"""The published schemas accept what the loader accepts, and refuse what they can."""

from __future__ import annotations

import copy
import random
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from llfsm_verify.arrangement import build_arrangement, keys
from llfsm_verify.arrangement.keys import schema as load
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.yaml.tables import Table
from tests.bad_input.cases import CASES, FRAMED

MODELS = sorted((Path(__file__).parents[2] / "models").rglob("*.yaml"))


def validator(name: str) -> jsonschema.Draft202012Validator:
    return jsonschema.Draft202012Validator(load(name))


@pytest.mark.parametrize("name", ["arrangement", "machine"])
def test_schema_is_a_schema(name: str) -> None:
    jsonschema.Draft202012Validator.check_schema(load(name))


@pytest.mark.parametrize("reader", [yaml.SafeLoader, yaml.BaseLoader], ids=["typed", "texts"])
@pytest.mark.parametrize("path", MODELS, ids=lambda p: p.name)
def test_models_validate(path: Path, reader: Any) -> None:
    document = yaml.load(path.read_text("utf-8"), Loader=reader)
    if not isinstance(document, dict) or not ("machine" in document or "machines" in document):
        pytest.skip("neither an arrangement nor a machine")
    validator("machine" if "machine" in document else "arrangement").validate(document)


def test_there_are_models() -> None:
    assert len(MODELS) >= 4


def test_a_policy_is_the_same_in_a_file_of_its_own() -> None:
    arrangement: Any = load("arrangement")
    policy: Any = load("policy")
    here, named = arrangement["properties"]["access"]["oneOf"]
    assert policy["properties"] == {"format": arrangement["properties"]["format"], **here["properties"]}
    assert policy["$defs"] == {"name": arrangement["$defs"]["name"]} and tuple(named["properties"]) == ("file",)


def test_every_part_is_described() -> None:
    def walk(part: Any, name: str) -> None:
        for key, value in part.get("properties", {}).items():
            assert "description" in value, f"{name}.{key}"
            walk(value, f"{name}.{key}")

    for schema in (load("arrangement"), load("machine")):
        walk(schema, "")
        for key, value in schema["$defs"].items():  # type: ignore[attr-defined]
            assert "description" in value, key
            walk(value, key)


def test_the_pages_name_every_key() -> None:
    code = re.compile(r"^```.*?^```|`[^`]*`", re.MULTILINE | re.DOTALL)
    named = {
        word
        for page in ("docs/files.md", "docs/semantics.md")
        for part in code.findall(Path(page).read_text("utf-8"))
        for word in re.findall(r"\w+", part)
    }
    tables = [table for table in vars(keys).values() if isinstance(table, Table)]
    assert len(tables) > 10 and [key for table in tables for key in table.keys if key not in named] == []


STRUCTURAL = {"E030", "E033", "E034", "E035", "E060", "E074", "E080", "E084"}


@pytest.mark.parametrize("case", [c for c in CASES if c.code in STRUCTURAL], ids=lambda c: c.reason)
def test_wrong_structure_is_refused(case: Any) -> None:
    document = yaml.load(case.text.replace("§", ""), Loader=yaml.BaseLoader)
    assert not validator("arrangement").is_valid(document)


def test_the_frame_of_the_wrong_ones_is_right() -> None:
    validator("arrangement").validate(yaml.load(FRAMED(), Loader=yaml.BaseLoader))


# ---------------------------------------------------------------- random documents

WHOLE = """
name: whole
profile: {base: clfsm, snapshot: cycle, self_transition_restarts_clock: true, restart_enters_initial: false,
  commands: next_turn}
observe: cycle
cycle_ms: 10
finished: keep
fairness: none
types: {Colour: [RED, GREEN], Tenth: {decimal: 0.1, range: 0.0..1.0},
  Pair: {record: {x: int8, y: {array: bool, size: 2}}}}
tables: {sine: [1, 2, 3]}
whiteboard:
  car: {type: bool, init: false, role: input, lint: {L021: so}}
  out: {type: Colour, init: RED, role: output, safe: RED}
  free: {type: 0..3, init: 1, role: input, changes: never}
  pair: {type: Pair, init: {x: 1, y: [true, false]}, role: shared}
machines:
  a:
    inline:
      machine: A
      parameters: {shown: {whiteboard: Colour}, other: machine, most: {constant: 0..9}}
      variables: {n: {type: uint8, init: 0, lint: {L010: so}}}
      initial: ONE
      suspend: ASIDE
      states:
        - name: ONE
          variables: {m: {type: bool, init: true}}
          on_entry: shown = RED;
          on_exit: n = 1;
          internal: n = 2;
          on_suspend: n = 3;
          on_resume: n = 4;
          transitions: [{when: other@UP, to: TWO, lint: {L001: so}}, {when: after(3), to: ASIDE}]
          lint: {L002: so}
        - {name: TWO, stays: true, runs: [inner]}
        - {name: ASIDE, transitions: [{when: n > most, to: ONE}]}
      lint: {L003: so}
    parameters: {shown: out, other: b, most: 3}
    suspended: true
    on_fault: unload
    model: false
  b: {inline: {machine: B, states: [{name: UP}]}}
  inner: {inline: {machine: Inner, states: [{name: UP, stays: true}]}}
environment:
  inline: {machine: Env, parameters: {p: {whiteboard: bool}}, states: [{name: S, internal: "p = choose(bool);"}]}
  parameters: {p: car}
schedule: [a, inner]
pool: [b]
operators: {suspend: [a], resume: [a], restart: [a], load: [b], unload: [b], load_suspended: [b],
  write: [out], replace: [b], policy: [alice]}
access: {levels: [low, high], machines: {a: high}, write: {out: high}, command: {b: high},
  users: {alice: high}, on_violation: refuse}
lint: {L003: so}
"""
"""An arrangement with every key but those that exclude others."""
INSTEAD: list[Any] = ["", "true", "7", "A", "no name", "-", [], ["A", "A"], {}, {"A": "b"}]


def places(part: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if path:
        yield path
    for key, value in part.items() if isinstance(part, dict) else enumerate(part) if isinstance(part, list) else ():
        yield from places(value, (*path, key))


def mutated(document: Any, rng: random.Random) -> Any:
    """The document with one part taken out, replaced or added."""
    found = copy.deepcopy(document)
    all_places = list(places(found))
    *path, key = rng.choice(all_places)
    owner = found
    for step in path:
        owner = owner[step]
    edit = rng.randrange(3)
    if edit == 0:
        del owner[key]
    elif edit == 1:
        owner[key] = rng.choice(INSTEAD)
    elif isinstance(owner, list):
        owner.append(rng.choice(INSTEAD))
    else:
        owner[rng.choice(["knob", *(place[-1] for place in all_places if isinstance(place[-1], str))])] = rng.choice(
            INSTEAD
        )
    return found


@pytest.mark.long
def test_reader_and_schema_agree_on_random_documents() -> None:
    """What the loader takes the schema takes, and what is wrong in structure it refuses."""
    document = yaml.load(WHOLE, Loader=yaml.BaseLoader)
    build_arrangement(document)
    schema, rng = validator("arrangement"), random.Random(7)
    taken = refused = 0
    for _ in range(400):
        found = mutated(document, rng)
        try:
            build_arrangement(found)
        except DiagnosticError as error:
            codes = {d.code for d in error.diagnostics}
            if codes & {*STRUCTURAL, "E031"}:
                refused += 1
                assert not schema.is_valid(found), (codes, found)
        else:
            taken += 1
            schema.validate(found)
    assert taken > 50 and refused > 100


def small(machine: str = "m", slot: str = "lit", kind: str = "Pair", **changes: Any) -> dict[str, Any]:
    """An arrangement with these names."""
    return {
        "types": {kind: {"record": {"a": "bool", "b": "bool"}}},
        "whiteboard": {slot: {"type": kind, "init": {"a": True, "b": False}}},
        "machines": {machine: {"inline": {"machine": "m", "initial": "A", "states": [{"name": "A"}]}}},
        "schedule": [machine],
        **changes,
    }


@pytest.mark.parametrize("name", ["1m", "a b", "", "é"])
@pytest.mark.parametrize("place", ["machine", "slot", "kind"])
def test_names_are_those_that_the_reader_takes(place: str, name: str) -> None:
    validator("arrangement").validate(small())
    build_arrangement(small())
    wrong = small(**{place: name})
    assert not validator("arrangement").is_valid(wrong)
    with pytest.raises(DiagnosticError):
        build_arrangement(wrong)


def test_codes_of_lint_that_there_are_not_are_refused() -> None:
    for code, taken in (("L001", True), ("L999", False)):
        document = small(lint={code: "a reason"})
        assert validator("arrangement").is_valid(document) is taken
        if not taken:
            with pytest.raises(DiagnosticError):
                build_arrangement(document)


ARRAY: dict[str, Any] = {"array": "bool", "size": 2}
TYPES: list[tuple[Any, bool]] = [
    ("bool", True), ("0..15", True), ("-8 .. -1", True), ("int8", True), ("uint64", True), ("Pair", True),
    (ARRAY, True), ({"array": ARRAY, "size": "2"}, True), ({"record": {"x": ARRAY}}, True),
    ({"decimal": "0.1", "range": "0.0..1.0"}, True),
    ("0..", False), ("..3", False), ("0.5..1", False), ("0...1", False), ("1x", False), ("int 8", False), ("", False),
    ({"array": "bool"}, False), ({"record": {}}, False), ({"decimal": "0.1"}, False), ({}, False), (["bool"], False),
    (None, False),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "taken"), TYPES, ids=str)
def test_a_type_is_one_of_its_alternatives(kind: Any, taken: bool) -> None:
    assert validator("arrangement").is_valid(small(whiteboard={"lit": {"type": kind}})) is taken


VALUES: list[Any] = [
    1, -0.5, True, None, "RED", "2 * n", [], [1, 1], [[True], [None]], {}, {"x": {"y": [1]}}, [{"x": {}}],
]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=str)
def test_a_value_has_any_shape(value: Any) -> None:
    """Whether it fits its type the reader says."""
    validator("arrangement").validate(small(whiteboard={"lit": {"type": "int", "init": value}}))
