"""All engines that come to an answer come to the same one."""

from __future__ import annotations

import pytest

from tests.quick import examples, many
from tests.verification.agreeing import run


def test_engines_agree() -> None:
    tally = run(examples(8))
    assert tally["decided by two or more"] > 0, tally


@pytest.mark.long
def test_engines_agree_on_many() -> None:
    tally = run(many(60))
    assert tally["decided by two or more"] > 0, tally
    assert min(tally["induction holds"], tally["pdr holds"], tally["explicit holds"]) > 0, tally
