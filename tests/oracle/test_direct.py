"""The oracle itself against the runs of the real clfsm: it must not be wrong in the same way as the lowering."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.arrangement.model import Arrangement
from tests.oracle.direct import Direct, Event, Scalar
from tests.outside import needs
from tests.semantics.test_golden import FILES, LATER, SILENT, document, passed


def text(arrangement: Arrangement, event: Event) -> str:
    kind, name, args = event
    machine = arrangement.machine(name)
    names = [*(s.name for s in machine.states), "Suspended"]
    if kind == "guard":
        state, number, value = args
        target = machine.states[state].transitions[number].target
        return f"{'T' if value else 'F'}({names[state]}>{names[target]})"
    if kind in ("suspend", "resume"):
        return f"CMD_{kind.upper()}({names[args[0]]}>{names[args[1]]})"
    if kind == "restart":
        return f"CMD_RESTART({names[args[0]]})"
    prefix = {"entry": "ON_ENTRY", "exit": "ON_EXIT", "internal": "INTERNAL"}.get(kind, kind.upper())
    return f"{prefix}({names[args[0]]})"


def ringlets(arrangement: Arrangement, expected: list[str]) -> Iterator[str]:
    direct = Direct(arrangement)
    (c,) = direct.initial()
    cycle = 1
    for line in expected:
        if direct.enabled(c) == [None]:
            return

        def choose(kind: str, name: str, values: Sequence[Scalar], line: str = line) -> Scalar:
            return max(passed(line), values[0])

        step = direct.step(c, 0, choose)
        assert step.after is not None
        c = step.after
        (name,) = c.ran
        index = direct.by_name[name]
        names = [*(s.name for s in arrangement.machine(name).states), "Suspended"]
        accepts = any(e[0] == "accept" for e in step.events)
        status = "accepting" if accepts else "fired" if c.fired else "stayed"
        shown = " ".join(text(arrangement, e) for e in step.events if e[0] not in SILENT)
        yield f"c{cycle} m{index} {names[c.machines[index].state]} {status}: {shown}"
        cycle += c.cycle


@needs("golden")
@pytest.mark.parametrize("profile", ["llfsm", "clfsm"])
@pytest.mark.parametrize("path", FILES, ids=lambda p: p.stem)
def test_oracle_reproduces_clfsm(path: Path, profile: str) -> None:
    golden = json.loads(path.read_text())
    if golden["case"] in LATER or path.stem in LATER:
        pytest.skip("needs a part of the semantics that is not there yet")
    arrangement = build_arrangement(document(golden, profile), integer_guards=True)
    assert list(ringlets(arrangement, golden["ringlets"])) == golden["ringlets"]
