"""Control variables that no longer matter make no difference between configurations.

What matters is defined here by bisimulation: two configurations in which all variables of the arrangement and all
states agree, and so again after every step with the same choices, are one.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.backends.reference import Interpreter
from llfsm_verify.checking.problem import Problem

CONTROL = ("$entered", "$previous", "$clock", "$age", "$pending", "$remembered")


def counted(text: str) -> tuple[int, int]:
    """The reachable configurations, and the classes of those that behave alike."""
    program = Problem(load_arrangement_text(text)).program()
    interpreter = Interpreter(program)
    start = {v.name: v.init for v in program.vars if not v.output}
    fresh = {v.name: v.init for v in program.vars if v.output}

    def key(values: Mapping[str, Any]) -> tuple[Any, ...]:
        return tuple(values[name] for name in start)

    numbers, queue, rows = {key(start): 0}, [start], list[list[tuple[Any, int]]]()
    for values in queue:
        row = []
        for process, outcome in interpreter.successors(values, fresh):
            if outcome.fault is not None:
                row.append(((process, outcome.samples, outcome.fault), -1))
                continue
            number = numbers.setdefault(key(outcome.values), len(queue))
            if number == len(queue):
                queue.append(outcome.values)
            row.append(((process, outcome.samples, tuple(outcome.outputs.items())), number))
        rows.append(row)
        assert len(queue) < 2_000
    seen = [tuple(v for n, v in values.items() if not n.endswith(CONTROL)) for values in queue]
    classes = [sorted(set(seen), key=repr).index(s) for s in seen] + [-1]
    while True:
        finer = [(classes[i], tuple(sorted(((c, classes[t]) for c, t in row), key=repr))) for i, row in enumerate(rows)]
        names = {s: i for i, s in enumerate(dict.fromkeys(finer))}
        refined = [names[s] for s in finer] + [-1]
        if len(names) == len(set(classes[:-1])):
            return len(queue), len(names)
        classes = refined


HEAD = "name: t\ncycle_ms: 100\nwhiteboard:\n  go: {type: bool, role: input}\n  n: {type: 0..3}\nmachines:\n"


def machine(name: str, *states: str, **keys: str) -> str:
    more = "".join(f", {key}: {value}" for key, value in keys.items())
    return f"  {name}: {{inline: {{machine: {name.upper()}{more}, states: [{', '.join(states)}]}}}}\n"


def state(name: str, *moves: tuple[str, str], **actions: str) -> str:
    made = ", ".join(f'{{when: "{when}", to: {to}}}' for when, to in moves)
    return f"{{name: {name}, transitions: [{made}]" + "".join(f', {k}: "{v}"' for k, v in actions.items()) + "}"


def arrangement(*machines: str, more: str = "") -> str:
    names = [m.split(":", 1)[0].strip() for m in machines]
    head = HEAD.replace("cycle_ms: 100\n", "") if more == UNTIMED else HEAD
    return f"{head}{''.join(machines)}schedule: [{', '.join(names)}]\n{more}"


UNTIMED = "timing: untimed\n"
COMMANDER = machine("c", state("A", ("false", "A"), internal="if (go) { suspend(m); } else { resume(m); }"))
CASES = {
    "entries without actions": arrangement(machine("m", state("A", ("go", "B")), state("B", ("go", "A")))),
    "entries with actions": arrangement(
        machine("m", state("A", ("go", "B"), on_entry="n = 1;"), state("B", ("go", "A"), on_entry="n = 2;"))
    ),
    "a clock that one state reads": arrangement(
        machine("m", state("A", ("after(0.2)", "B")), state("B", ("go", "C")), state("C", ("go", "A")))
    ),
    "a clock of a state that finishes": arrangement(
        machine("m", state("A", ("go", "B")), state("B", internal="if (after(0.3)) { n = 3; }")),
        machine("k", state("A", ("false", "A"), internal="if (n == 0) { n = 1; }")),
    ),
    "ages": arrangement(
        machine("m", state("A", ("after(1)", "B")), state("B", ("go", "C")), state("C", ("after(2)", "A"))),
        more=UNTIMED,
    ),
    "suspended without actions": arrangement(machine("m", state("A", ("go", "B")), state("B", ("go", "A"))), COMMANDER),
    "suspended with an action in one state": arrangement(
        machine("m", state("A", ("go", "B")), state("B", ("go", "A"), on_suspend="n = 1;")), COMMANDER
    ),
    "resumed with an action in one state": arrangement(
        machine("m", state("A", ("go", "B"), on_resume="n = 2;"), state("B", ("go", "A"))), COMMANDER
    ),
    "resumed with an action of the suspend state": arrangement(
        machine("m", state("A", ("go", "B")), state("B", ("go", "A")), state("S", on_resume="n = 1;"), suspend="S"),
        COMMANDER,
    ),
    "a suspend state with transitions": arrangement(
        machine(
            "m",
            state("A", ("go", "B"), on_suspend="n = 1;"),
            state("B", ("go", "S"), on_resume="n = 2;"),
            state("S", ("n == 1", "B")),
            suspend="S",
        )
    ),
    "suspended with a clock": arrangement(
        machine("m", state("A", ("after(0.2)", "B")), state("B", ("go", "A"))), COMMANDER
    ),
    "finished after having been suspended": arrangement(
        machine("m", state("A", ("go", "B"), on_suspend="n = 1;"), state("B", on_resume="n = 2;")), COMMANDER
    ),
    "finished in a state with an age": arrangement(
        machine("m", state("A", ("go", "B")), state("B", internal="if (after(1)) { n = 3; }")),
        machine("k", state("A", ("false", "A"), internal="if (n == 0) { n = 1; }")),
        more=UNTIMED,
    ),
    "restarted into the suspend state": arrangement(
        machine(
            "m", state("A", ("go", "B"), on_suspend="n = 1;"), state("B", ("go", "A"), on_suspend="n = 2;"), suspend="A"
        ),
        machine("c", state("A", ("false", "A"), internal="if (go) { restart(m); } else { resume(m); }")),
    ),
    "an action before entry reads the clock": arrangement(
        machine(
            "m",
            state("A", ("go", "B"), on_suspend="if (after(0.2)) { n = 1; }"),
            state("B", ("go", "A")),
        ),
        COMMANDER,
    ),
    "suspended in the beginning with an action due": arrangement(
        machine("m", state("A", ("go", "B"), on_suspend="n = 1;"), state("B", ("go", "A"))).replace(
            "m: {", "m: {suspended: true, "
        ),
        machine("c", state("A", ("false", "A"), internal="if (go) { resume(m); }")),
    ),
    "suspended in the beginning": arrangement(
        machine("m", state("A", ("go", "B")), state("B", ("go", "A"))).replace("m: {", "m: {suspended: true, "),
        machine("c", state("A", ("false", "A"), internal="if (go) { resume(m); }")),
    ),
}


LEFT = {
    "suspended without actions": 1,
    "suspended with an action in one state": 1,
    "resumed with an action in one state": 1,
    "resumed with an action of the suspend state": 1,
    "suspended with a clock": 4,
    "finished after having been suspended": 1,
    "restarted into the suspend state": 5,
    "an action before entry reads the clock": 86,
    "suspended in the beginning with an action due": 2,
    "suspended in the beginning": 2,
}
"""Configurations more than there need be: a command is pending that will change nothing, or a clock is kept because an
action that runs before `on_entry` reads it."""


@pytest.mark.parametrize("case", CASES)
def test_configurations_that_behave_alike_are_one(case: str) -> None:
    found, classes = counted(CASES[case])
    assert found == classes + LEFT.get(case, 0)
