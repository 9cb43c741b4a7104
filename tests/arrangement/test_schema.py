"""The published schemas accept what the loader accepts, refuse what they can, and know the same keys."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from llfsm_verify.arrangement import keys, model
from llfsm_verify.arrangement.resolve import access, timing, whiteboard
from llfsm_verify.arrangement.schema import load
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


def test_keys_are_those_of_the_loader() -> None:
    arrangement: Any = load("arrangement")
    machine: Any = load("machine")
    definitions = arrangement["$defs"]
    assert tuple(arrangement["properties"]) == keys.ARRANGEMENT_KEYS
    assert tuple(definitions["instance"]["properties"]) == keys.INSTANCE_KEYS
    assert tuple(machine["properties"]) == keys.MACHINE_KEYS
    assert tuple(definitions["machine"]["properties"]) == keys.MACHINE_KEYS
    assert tuple(definitions["state"]["properties"]) == keys.STATE_KEYS
    assert tuple(definitions["transition"]["properties"]) == keys.TRANSITION_KEYS
    assert tuple(definitions["variable"]["properties"]) == keys.VARIABLE_KEYS
    board = arrangement["properties"]["whiteboard"]["additionalProperties"]["properties"]
    assert tuple(board) == keys.WHITEBOARD_KEYS
    assert tuple(board["role"]["enum"]) == whiteboard.ROLES
    assert tuple(board["changes"]["enum"]) == whiteboard.CHANGES
    named, changed = arrangement["properties"]["profile"]["anyOf"]
    assert tuple(named["enum"]) == tuple(model.PROFILES)
    assert tuple(changed["properties"]) == timing.PROFILE_KEYS
    assert tuple(changed["properties"]["snapshot"]["enum"]) == timing.SNAPSHOTS


def test_a_policy_is_the_same_in_a_file_of_its_own() -> None:
    arrangement: Any = load("arrangement")
    policy: Any = load("policy")
    inner = arrangement["$defs"]["policy"]["properties"]
    assert policy["properties"] == {"format": arrangement["properties"]["format"], **inner}
    assert tuple(inner) == access.KEYS
    assert policy["$defs"]["name"] == arrangement["$defs"]["name"]


def test_every_part_is_described() -> None:
    def walk(part: Any, name: str) -> None:
        for key, value in part.get("properties", {}).items():
            assert "description" in value or "$ref" in value, f"{name}.{key}"
            walk(value, f"{name}.{key}")

    for schema in (load("arrangement"), load("machine")):
        walk(schema, "")
        for key, value in schema["$defs"].items():  # type: ignore[attr-defined]
            assert "description" in value, key
            walk(value, key)


STRUCTURAL = {"E030", "E033", "E034", "E035", "E060", "E074", "E080", "E084"}


@pytest.mark.parametrize("case", [c for c in CASES if c.code in STRUCTURAL], ids=lambda c: c.reason)
def test_wrong_structure_is_refused(case: Any) -> None:
    document = yaml.load(case.text.replace("§", ""), Loader=yaml.BaseLoader)
    assert not validator("arrangement").is_valid(document)


def test_the_frame_of_the_wrong_ones_is_right() -> None:
    validator("arrangement").validate(yaml.load(FRAMED(), Loader=yaml.BaseLoader))
