"""Inputs that never change and have no `init`: any value, drawn once for a run, or given to it."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path

import pytest
import yaml

import llfsm_verify as lv
from llfsm_verify.arrangement.loader import build_arrangement
from llfsm_verify.runtime.stepping.drawing import drawing_of, free_values
from llfsm_verify.semantics.lowering import lower
from tests.cli.running import llfsm

NEVER = """\
name: never
cycle_ms: 10
whiteboard:
  k: {type: 1..4, role: input, changes: never}
  j: {type: bool, role: input, changes: never}
  fixed: {type: 0..3, init: 2, role: input, changes: never}
  go: {type: bool, role: input}
  n: {type: 0..9}
machines:
  m:
    inline:
      machine: M
      states: [{name: A, internal: "if (go && j && n < k + fixed) n += 1;", stays: true}]
schedule: [m]
"""


@pytest.fixture
def never(tmp_path: Path) -> str:
    (tmp_path / "never.yaml").write_text(NEVER, "utf-8")
    return str(tmp_path / "never.yaml")


@pytest.mark.slow
def test_inputs_that_never_change_have_one_value_for_each_seed(never: str, tmp_path: Path) -> None:
    """The same in every command and in Python; the rest of the run is that of the same value given."""
    model, seen = lv.load(never), Counter[tuple[str, str]]()
    for seed in range(40):
        run = model.simulate(6, seed=seed)
        k, j = str(run.values(0)["k"]), str(run.values(0)["j"])
        seen[k, j] += 1
        again = model.simulate(6, seed=seed, inputs={"k": int(k), "j": j == "True"})
        assert str(again) == str(run)
        started = model.start(seed).values
        assert (str(started["k"]), str(started["j"])) == (k, j)
    assert len(seen) == 8
    run = model.simulate(6, seed=1)
    k, j = str(run.values(0)["k"]), str(run.values(0)["j"]).lower()
    table = llfsm("simulate", never, "--seed", "1", "--steps", "2")
    assert f"initially  k = {k}, j = {j}" in table.stdout
    assert json.loads(llfsm("simulate", never, "--seed", "1", "--format", "json").stdout)["trace"]["free"]["k"] == int(
        k
    )
    record = str(tmp_path / "r")
    assert (
        llfsm("run", never, "--simulate", "--seed", "1", "--rate", "0", "--for", "1s", "--record", record).returncode
        == 0
    )
    assert llfsm("check-recording", record, "-p", f"!G !(k == {k} && j == {j})").returncode == 0
    assert llfsm("replay", record).returncode == 0
    assert llfsm("debug", never, "--seed", "1", "--command", f"expect k == {k} && j == {j}").returncode == 0


@pytest.mark.slow
def test_they_can_be_set_and_drawn_everywhere(never: str, tmp_path: Path) -> None:
    model = lv.load(never)
    always = {"k": {3: 1.0}, "j": 0}
    assert {str(model.simulate(1, seed=s, draw=always).values(0)["k"]) for s in range(5)} == {"3"}
    assert {str(model.start(s, draw=always).values["k"]) for s in range(5)} == {"3"}
    for command in (("simulate", never, "--seed", "1"), ("run", never, "--simulate", "--rate", "0", "--for", "50ms")):
        for option in (("--set", "k=3"), ("--draw", "k=3:1")):
            record = ("--record", str(tmp_path / f"{command[0]}{option[0]}")) if command[0] == "run" else ()
            done = llfsm(*command, *option, *record)
            assert done.returncode == 0, done
            if record:
                assert llfsm("check-recording", record[1], "-p", "!G k != 3").returncode == 0
            else:
                assert "initially  k = 3," in done.stdout
    (tmp_path / "inputs.yaml").write_text("0: {k: 4}\n3: {go: true}\n", "utf-8")
    assert "initially  k = 4," in llfsm("simulate", never, "--inputs", str(tmp_path / "inputs.yaml")).stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--set", "k=9"), "--set k: `9` is not a number from 1 to 4"),
        (("--set", "fixed=1"), "--set `fixed` never changes: it has its `init` throughout"),
        (("--draw", "fixed=1:1"), "--draw `fixed` never changes: it has its `init` throughout"),
        (("--draw", "k=1:1", "--set", "k=1"), "--draw `k` has a value, so it is not drawn"),
        (("--set", "n=1"), "--set `n` is not an input of the arrangement; inputs: go, k, j"),
    ],
)
@pytest.mark.parametrize("command", [("simulate",), ("run", "--simulate", "--rate", "0", "--for", "50ms")])
def test_what_cannot_be_set_is_said(
    command: tuple[str, ...], arguments: tuple[str, ...], message: str, never: str
) -> None:
    done = llfsm(command[0], never, *command[1:], "--seed", "1", *arguments)
    assert (done.returncode, done.stderr) == (2, f"error: {message}\n")


def test_what_never_changes_is_set_for_the_whole_run(never: str, tmp_path: Path) -> None:
    said = "`k` never changes while it runs: set it for the whole run"
    with pytest.raises(ValueError, match=f"^step 3: {said}$"):
        lv.load(never).simulate(5, script={3: {"k": 1}})
    with pytest.raises(ValueError, match=f"^{said}$"):
        lv.load(never).start().ringlet({"k": 1})
    (tmp_path / "inputs.yaml").write_text("2: {k: 4}\n", "utf-8")
    done = llfsm("simulate", never, "--inputs", str(tmp_path / "inputs.yaml"))
    assert done.returncode == 3 and f"error[E409]: {said}" in done.stderr
    told = llfsm("debug", never, "--command", "set fixed 1")
    assert told.returncode == 2 and "`fixed` never changes: it has its `init` throughout" in told.stdout


def test_the_values_of_free_inputs_are_as_often_as_their_law_says() -> None:
    program = lower(build_arrangement(yaml.safe_load(NEVER)), keep_all_bits=True)
    law = drawing_of(program, None, {"k": "2:0.4"})
    values = Counter(free_values(program, {}, law, seed)["k"] for seed in range(2000))
    assert [values[k] for k in (1, 2, 3, 4)] == pytest.approx([400, 800, 400, 400], rel=0.2)
    assert free_values(program, {"k": "2"}) == {"k": 2, "j": 0} != free_values(program, {}) == {"k": 1, "j": 0}
