"""Plans of sweeps: the combinations are those of a product by hand, and each task is the arrangement edited by hand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import product
from pathlib import Path
from random import Random
from typing import Any

import pytest

import llfsm_verify as lv
from llfsm_verify.analysis.coverage.vectorfile import program_hash
from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.sweep import plan as planning
from llfsm_verify.extensions.sweep.plan import Plan, plan
from llfsm_verify.extensions.sweep.reading import read_sweep
from llfsm_verify.extensions.sweep.sweeping import sweep
from llfsm_verify.extensions.sweep.values import names, with_values
from llfsm_verify.semantics.lowering import lower
from tests.extensions.sweep.counting import ARRANGEMENT, MACHINE, written

VALUES: Mapping[str, tuple[str, tuple[Any, ...]]] = {
    "LIMIT": ("constant", (1, 2, 9)),
    "left.LIMIT": ("parameter", (1, 4)),
    "n": ("initial", (0, 7, 20)),
    "left.count": ("initial", (1, 9)),
    "right.COUNT.turns": ("initial", (0, 3)),
    "step": ("initial", (0.1, 1)),
    "light": ("initial", ("RED", "GREEN")),
    "flags": ("initial", ([False, True], [True, True])),
}
KEYS = {"constant": "constants", "parameter": "parameters", "initial": "initial"}


def by_hand(folder: Path, row: Mapping[str, Any]) -> Path:
    """The arrangement with these values, by changes of its text."""
    text, machines = ARRANGEMENT, {"left": MACHINE, "right": MACHINE}

    def instead(old: str, new: str) -> None:
        nonlocal text
        assert text.count(old) == 1
        text = text.replace(old, new)

    for name, value in row.items():
        said = json.dumps(value)
        match name.split("."):
            case ["LIMIT"]:
                instead("LIMIT: 3", f"LIMIT: {said}")
                instead("LIMIT: 5", f"LIMIT: {said}")
            case ["left", "LIMIT"]:
                instead("LIMIT: 3", f"LIMIT: {said}")
            case ["n"]:
                instead("0..20, init: 0", f"0..20, init: {said}")
            case ["step"]:
                instead("1.0}}", f"1.0}}, init: {said}}}")
            case ["light"]:
                instead("type: Colour", f"type: Colour, init: {value}")
            case ["flags"]:
                instead("size: 2}", f"size: 2}}, init: {said}")
            case [owner, "count"]:
                machines[owner] = machines[owner].replace("0..9}}", f"0..9, init: {said}}}}}")
            case [owner, "COUNT", "turns"]:
                machines[owner] = machines[owner].replace("init: 1", f"init: {said}")
    for owner, machine in machines.items():
        (folder / f"{owner}.machine.yaml").write_text(machine)
        text = text.replace(f"{owner}: {{file: m.", f"{owner}: {{file: {owner}.")
    (folder / "by_hand.yaml").write_text(text)
    return folder / "by_hand.yaml"


def some(random: Random, most: int = 3) -> dict[str, tuple[Any, ...]]:
    """Values of a few names, of which none changes what another does."""
    chosen = random.sample(sorted(set(VALUES) - {random.choice(["LIMIT", "left.LIMIT"])}), random.randint(1, most))
    return {name: VALUES[name][1] for name in chosen}


def document(chosen: Mapping[str, tuple[Any, ...]], **more: Any) -> dict[str, Any]:
    """A sweep of these values."""
    found: dict[str, Any] = {"arrangements": ["a.yaml"], **more}
    for key in KEYS.values():
        if values := {name: list(each) for name, each in chosen.items() if KEYS[VALUES[name][0]] == key}:
            found[key] = values
    return found


@pytest.mark.parametrize("seed", range(6))
def test_values_in_a_draft_are_those_written_into_the_text(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    random = Random(seed)
    row = {name: random.choice(values) for name, values in some(random, 5).items()}
    draft = read_arrangement(Given(by_hand(tmp_path, {})))
    changed = with_values(draft, [(VALUES[name][0], name, value) for name, value in row.items()])  # type: ignore[misc]
    assert changed.digest != draft.digest
    ours, theirs = (lower(each) for each in (resolve(changed), load_arrangement(by_hand(tmp_path, row))))
    assert program_hash(ours) == program_hash(theirs) != program_hash(lower(resolve(draft)))


def test_everything_that_has_a_value_is_named(tmp_path: Path) -> None:
    written(tmp_path)
    arrangement = read_arrangement(Given(tmp_path / "a.yaml")).arrangement
    assert tuple(names(arrangement, "constant")) == ("LIMIT",)  # type: ignore[arg-type]
    assert tuple(names(arrangement, "parameter")) == ("left.LIMIT", "left.total", "right.LIMIT", "right.total")  # type: ignore[arg-type]
    assert set(VALUES) - {"LIMIT", "left.LIMIT"} < set(names(arrangement, "initial"))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(12))
def test_the_combinations_are_those_of_a_product(seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    random = Random(100 + seed)
    chosen = some(random)
    files = ["a.yaml", "b/faulty.yaml"][: random.randint(1, 2)]
    properties = ["p.ltl", "q.ltl"][: random.randint(1, 2)]
    excluded = [
        {"arrangements": random.choice(files)}
        | {name: random.sample(chosen[name], random.randint(1, 2)) for name in chosen if random.random() < 0.7}
        for _ in range(random.randint(0, 2))
    ]
    data = document(chosen, arrangements=files, properties=properties, **({"exclude": excluded} if excluded else {}))
    order = [name for key in KEYS.values() for name in data.get(key, ())]
    wanted = []
    for file, *values, asked in product(files, *(chosen[name] for name in order), properties):
        row = {"arrangement": file, **dict(zip(order, values, strict=True)), "properties": asked}
        if not any(e["arrangements"] == file and all(row[n] in v for n, v in e.items() if n != "arrangements")
                   for e in excluded):  # fmt: skip
            wanted.append(row)
    if not wanted:
        with pytest.raises(DiagnosticError, match="everything is excluded"):
            plan(read_sweep(data))
        return
    found = plan(read_sweep(data))
    assert [dict(each.values) for each in found.combinations] == wanted
    assert [each.number for each in found.combinations] == list(range(1, len(wanted) + 1))
    assert len({each.task.key for each in found.combinations}) == len(wanted)


def test_what_excludes_nothing_is_a_warning(tmp_path: Path) -> None:
    text = "arrangements: [a.yaml]\nproperties: p.ltl\nconstants: {LIMIT: [1, 2]}\n"
    text += "exclude: [{LIMIT: {from: 3, to: 9}}, {LIMIT: 0x1}]\n"
    found = plan(read_sweep(written(tmp_path, text)))
    assert [dict(each.values) for each in found.combinations] == [
        {"arrangement": "a.yaml", "LIMIT": 2, "properties": "p.ltl"}
    ]
    (warning,) = found.warnings
    assert warning.code == "W590" and warning.span is not None
    assert (warning.span.line, warning.span.column) == (4, 11)


def keys(found: Plan) -> list[str]:
    return [each.task.key for each in found.combinations]


def test_keys_are_of_all_that_decides(tmp_path: Path) -> None:
    text = "arrangements: [b/faulty.yaml]\nproperties: [p.ltl]\nconstants: {LIMIT: [1, 2]}\n"
    path = written(tmp_path, text)
    before = keys(plan(read_sweep(path)))
    for name in ("b/faulty.yaml", "m.machine.yaml", "faulty.machine.yaml", "p.ltl"):
        kept = (tmp_path / name).read_text()
        if name == "m.machine.yaml":
            continue  # not read by the faulty one's machines
        (tmp_path / name).write_text(f"{kept}# changed\n")
        assert not set(before) & set(keys(plan(read_sweep(path)))), name
        (tmp_path / name).write_text(kept)
    assert keys(plan(read_sweep(path))) == before
    for more in ("options: {timeout: 3}", "options: {memory: 1G}", "options: {max_states: 5}"):
        path.write_text(f"{text}{more}\n")
        assert not set(before) & set(keys(plan(read_sweep(path)))), more
    path.write_text(text.replace("[1, 2]", "[0x2, 3, 1]"))
    assert keys(plan(read_sweep(path)))[::2] == before[::-1]


def test_a_folder_that_moved_has_the_same_keys(tmp_path: Path) -> None:
    text = "arrangements: [a.yaml, b/faulty.yaml]\nproperties: [p.ltl]\n"
    (tmp_path / "x").mkdir()
    (tmp_path / "y").mkdir()
    assert keys(plan(read_sweep(written(tmp_path / "x", text)))) == keys(
        plan(read_sweep(written(tmp_path / "y", text)))
    )


def test_a_task_has_all_texts_and_no_others(tmp_path: Path) -> None:
    (tmp_path / "never.hoa").write_text("HOA: v1 Start: 0 AP: 0 Acceptance: 0 t --BODY-- State: 0 [t] 0 --END--")
    text = "arrangements: [b/faulty.yaml]\nproperties: [p.ltl]\n"
    path = written(tmp_path, text, p_ltl='automaton all: "never.hoa"\nfew: G n <= 5\n')
    (one,) = plan(read_sweep(path)).combinations
    assert dict(one.task.files) == {
        name: (tmp_path / name).read_text()
        for name in ("b/faulty.yaml", "faulty.machine.yaml", "m.machine.yaml", "never.hoa", "p.ltl")
    }
    assert (one.task.arrangement, one.task.properties) == ("b/faulty.yaml", ("p.ltl",))


def test_without_properties_those_beside_are_asked(tmp_path: Path) -> None:
    path = written(tmp_path, "arrangements: [a.yaml, b/faulty.yaml]\n", a_ltl="beside: G n <= 5\n")
    found = plan(read_sweep(path))
    assert [each.task.properties for each in found.combinations] == [("a.ltl",), ()]
    (warning,) = found.warnings
    said = "warning[W593]: no property file stands beside `b/faulty.yaml`, so nothing but faults is looked for"
    assert warning.render().splitlines()[0].endswith(f"SWEEP.yaml:1:24: {said}")
    path.write_text("arrangements: [a.yaml, b/faulty.yaml]\nproperties: [p.ltl]\n")
    assert not plan(read_sweep(path)).warnings


def test_values_of_long_sweeps_are_looked_at_one_by_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(planning, "LOOKED_AT", 10)
    text = "arrangements: [a.yaml]\nconstants: {LIMIT: {from: 1, to: 10}}\ninitial: {n: {from: 0, to: 20}}\n"
    with pytest.raises(DiagnosticError) as raised:
        plan(read_sweep(written(tmp_path, text)))
    (found,) = raised.value.diagnostics
    assert found.code == "E128" and found.span is not None and found.span.column == 34


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_each_row_is_the_check_of_the_text_edited_by_hand(
    seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written(tmp_path)
    monkeypatch.chdir(tmp_path)
    chosen = some(Random(200 + seed))
    rows = sweep(document(chosen, properties=["p.ltl"], options={"engine": "explicit"}), jobs=1)
    assert len(rows) == rows.combinations > 1
    for row in rows:
        values = {name: value for name, value in row.values.items() if name in chosen}
        found = lv.load(by_hand(tmp_path, values)).check(Path("p.ltl"), engine="explicit")
        verdicts = {each.name: str(each.verdict) for each in found} | {"faults": str(found.faults.verdict)}
        assert (row.verdicts, row.exit_code, row.states) == (verdicts, found.exit_code, found.states), values
    assert len({json.dumps(dict(row.verdicts)) for row in rows} | {""}) >= 2
