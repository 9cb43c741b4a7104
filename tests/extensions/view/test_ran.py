"""The lines that ran in a step: those of the guards that were tried, and of the actions of the states it went through.

What is expected is derived from the values and transitions of the same rows, and by hand for branches.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import llfsm_verify as lv
from llfsm_verify.extensions.view.document import document_of_result
from tests.cli.running import FAULTY

BRANCHES = """\
name: branches
whiteboard: {n: {type: 0..9, init: 0}, m: {type: 0..9, init: 0}}
schedule: [one]
machines:
  one:
    inline:
      machine: One
      states:
        - name: LOW
          on_entry: |
            if (n > 0) {
              m = 1;
            } else {
              m = 2;
            }
            m = 3;
          internal: n = 1;
          on_exit: m = 4;
          transitions:
            - {to: HIGH, when: m == 9}
            - {to: HIGH, when: n == 1}
        - {name: HIGH, on_entry: m = 5;, transitions: [{to: LOW, when: m == 5}]}
"""
STEPS = [
    [],
    ["n > 0", "m = 2", "m = 3", "m == 9", "n == 1", "n = 1"],
    ["m == 9", "n == 1", "m = 4"],
    ["m = 5", "m == 5"],
]


def shown(path: str | Path, text: str) -> dict[str, Any]:
    model = lv.load(path)
    return document_of_result(model.check(text).wrapped, model.wrapped)


def texts(document: dict[str, Any], run: dict[str, Any], row: int) -> list[str]:
    """What stands at the places that ran."""
    found = []
    for number, line, column, last, end in run["ran"]["sets"][run["ran"]["rows"][row]]:
        lines = document["files"][number]["text"].split("\n")[line - 1 : last]
        lines[-1] = lines[-1][: end - 1]
        found.append("\n".join(lines)[column - 1 :])
    return found


@pytest.mark.slow
def test_actions_and_branches(tmp_path: Path) -> None:
    path = tmp_path / "branches.yaml"
    path.write_text(BRANCHES)
    document = shown(path, "never: G !(one@LOW && m == 5)")
    (run,) = document["runs"]
    assert [texts(document, run, row) for row in range(len(run["ran"]["rows"]))] == STEPS


@pytest.mark.slow
def test_guards_are_tried_up_to_the_one_that_holds() -> None:
    document = shown(FAULTY, "both: G !(ns@GREEN && ew@GREEN)")
    (run,) = document["runs"]
    fired = {row: (machine, number) for row, machine, number in run["fired"]}
    assert len(fired) > 2
    for row, turn in enumerate(run["rows"]["turn"][1:], 1):
        machine = document["machines"][turn]
        changes = run["changes"][machine["signal"]]
        state = [v for at, v in zip(changes["at"], changes["values"], strict=True) if at < row][-1]
        every = enumerate(machine["transitions"])
        own = [(number, t["place"]) for number, t in every if machine["states"][t["source"]]["name"] == state]
        last = fired.get(row, (turn, len(machine["transitions"])))
        ran = run["ran"]["sets"][run["ran"]["rows"][row]]
        places = [taken["place"] for taken in machine["transitions"]]
        assert last[0] == turn
        assert [place for place in ran if place in places] == [place for number, place in own if number <= last[1]]
