"""The letter of a record has the bits of its outputs, wherever they lie."""

from __future__ import annotations

from random import Random

import pytest

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.kripke import observing
from llfsm_verify.kripke.observing import Observer, observed_outputs
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.semantics.lowering import lower
from tests.cli.running import COUNTER

FAIR = "processes: {a: [m], b: [k]}\nfairness: processes\n"


@pytest.mark.parametrize("atoms", [1, 3, 64, 150])
@pytest.mark.parametrize("fair", [False, True])
@pytest.mark.parametrize("mixed", [False, True])
def test_a_letter_is_what_the_outputs_say(atoms: int, fair: bool, mixed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    text = COUNTER
    if fair:
        machine = "  k: {inline: {machine: K, states: [{name: S, internal: 'n = 0;'}]}}\n"
        text = text.replace("schedule: [m]\n", machine + FAIR)
    arrangement = load_arrangement_text(text)
    lines = parse_properties([Source("t", "p: " + " && ".join(f"n + {i} > 2" for i in range(atoms)))])
    program = lower(arrangement, bind(arrangement, lines).atoms)
    layout = NativeProgram(program).layout
    random, outputs = Random(1), observed_outputs(program)
    if mixed:  # in another order, and some twice
        outputs = tuple(random.choices(outputs, k=len(outputs)))
        monkeypatch.setattr(observing, "observed_outputs", lambda _: outputs)
    observer = Observer(program, layout)
    assert len(observer.names) >= atoms
    for _ in range(50):
        record = random.randbytes(8 * (layout.words + layout.output_words))
        values = layout.decode_outputs(record)
        shown = [bool(values[output]) for _, output in outputs]
        assert observer.letter(record) == sum(1 << i for i, holds in enumerate(shown) if holds)
