"""What warnings about theories tell to write decides the output in the end."""

from __future__ import annotations

import re
from random import Random

import pytest

from llfsm_verify.diagnostics import Source
from llfsm_verify.knowledge.doubts import undecided_output
from llfsm_verify.knowledge.reading import read_theory
from llfsm_verify.knowledge.theory import Output
from tests.knowledge.theories import random_theory
from tests.quick import examples

MOST_STEPS = 60


def mended(text: str, hint: str, label: str, random: Random) -> str:
    """The text with what the hint tells."""
    ways = re.findall(r"`(\w+ > \w+\.)`", hint) or [f"{label}: {rule}" for rule in re.findall(r"`(\{\} => .*)`", hint)]
    if ways:
        return f"{text} {random.choice(ways)}"
    found = re.fullmatch(r"`(\w+)` is stronger than `\w+`, but concludes nothing: write `=>` in it for `.*`", hint)
    assert found is not None, hint
    return re.sub(rf"\b({found[1]}: [^.]*)~>", r"\1=>", text)


@pytest.mark.slow
def test_what_is_told_decides() -> None:
    steps = 0
    for seed in range(examples(300)):
        random = Random(seed)
        theory = read_theory(Source("some.d", random_theory(random).text(random)))
        for atom in sorted({rule.head.atom for rule in theory.rules}):
            text, hint = theory.source.text, ""
            for step in range(MOST_STEPS):
                found = undecided_output(
                    read_theory(Source("some.d", text)), Output(atom, atom, theory.outputs[0].span)
                )
                hint = next((d.hint or "" for d in found if d.code == "W004"), "")
                if not hint:
                    break
                text = mended(text, hint, f"default{step}", random)
                steps += 1
            assert not hint, text
    assert steps > 20
