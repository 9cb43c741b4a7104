"""The reference of the suite for engines: what it says of known arrangements is known to be true."""

from __future__ import annotations

import pytest

from llfsm_verify.testing.conformance.drawn import TooLarge, answers_to, problems
from llfsm_verify.testing.conformance.known import ENDLESS, KNOWN, Known

BEYOND = {"past and steps", "bounds in time", "bounds in time from below", "automata", "automata that hold", "commands"}
"""With automata or formulas that the reference does not look at."""
SILENT = {"an unavoidable fault": {"all", "four"}, "a range that is left": {"again"}, "64 bits": {"grows"}}
"""Properties about which it says nothing, since runs end."""


@pytest.mark.parametrize("known", [k for k in KNOWN if k.name not in BEYOND], ids=lambda k: k.name)
def test_it_says_what_is_known(known: Known) -> None:
    found = answers_to(known.problem(), 200, 60_000)
    assert found.holds.items() <= known.holds.items()
    assert found.faults in (known.faults, None)
    assert bool(found.contradictory) == known.contradictory
    if not known.faults and known.name not in SILENT:
        assert found.holds.keys() == known.holds.keys()


@pytest.mark.parametrize("known", [*(k for k in KNOWN if k.name in BEYOND), ENDLESS], ids=lambda k: k.name)
def test_what_is_beyond_it_is_said_to_be(known: Known) -> None:
    with pytest.raises(TooLarge):
        answers_to(known.problem(), 200, 60_000)


@pytest.mark.long
def test_random_problems_are_the_same_again_and_of_all_sorts() -> None:
    drawn = problems(60, 3)
    problems.cache_clear()
    assert problems(60, 3) == drawn
    said = [(name, holds) for d in drawn for name, holds in d.answers.holds.items()]
    assert {holds for _, holds in said} == {True, False} and len(said) > 60
    assert {bool(d.answers.faults) for d in drawn} == {True, False}
    assert {d.answers.contradictory for d in drawn} >= {True, False}
    assert {word for d in drawn for word in ("enforce", "forbid", "assume") if word in d.lines} == {
        "enforce", "forbid", "assume",
    }  # fmt: skip
