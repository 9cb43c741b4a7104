"""Arrangements that ask theories do in C what they do in the executor, which does what truth tables say."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.targets.images import image_of
from tests.extensions.c.compiled import needs_gcc
from tests.extensions.c.test_arrangements import walk
from tests.knowledge.asking import asking
from tests.knowledge.test_asking import seeds
from tests.quick import examples


@needs_gcc
@pytest.mark.slow
def test_theories_in_c() -> None:
    tally = Counter[str]()
    for seed in seeds(examples(60)):
        random = Random(seed)
        try:
            arrangement = image_of(asking(random).inlined)
        except DiagnosticError:
            tally["refused"] += 1
            continue
        walk(arrangement, random, tally)
    assert {"a fault", "done"} <= tally.keys()
    assert tally["refused"] < tally["done"]
