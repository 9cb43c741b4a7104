"""All engines that come to an answer come to the same one."""

from __future__ import annotations

import pytest

from tests.quick import examples, many
from tests.verification.agreeing import run


@pytest.mark.slow
def test_engines_agree() -> None:
    run(examples(8), kinds=["decided by two or more"])


@pytest.mark.long
def test_engines_agree_on_many() -> None:
    run(many(60), kinds=["decided by two or more", "induction holds", "pdr holds", "explicit holds"])
