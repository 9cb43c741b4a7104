"""What claims say of runs: refuted is a beginning that no continuation which we try mends."""

from __future__ import annotations

from fractions import Fraction

import pytest

from llfsm_verify.checking.claims import Claim, continuations
from llfsm_verify.diagnostics import Fragment, Source
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.parsing.formulas import parse_formula

P, NONE = frozenset({"p"}), frozenset[str]()
NOW = frozenset({TICK})
SECOND = Clock(Fraction(1000))


def claim(text: str, clock: Clock | None = None) -> Claim:
    return Claim(parse_formula(Fragment.whole(Source("t", text))).formula, clock)


@pytest.mark.parametrize(
    ("text", "prefix", "refuted"),
    [
        ("F p", [NONE, NONE], False),
        ("G p", [P, NONE], True),
        ("G p", [P, P], False),
        ("G !p", [NONE, NONE], False),
        ("X X p", [NONE], False),
        ("X p", [NONE, NONE], True),
        ("G (p -> X p)", [P], False),
        ("G F p && F G !p", [NONE], True),
    ],
)
def test_what_nothing_mends_is_refuted(text: str, prefix: list[frozenset[str]], refuted: bool) -> None:
    assert claim(text).refuted_by(prefix) is refuted


@pytest.mark.parametrize(
    ("prefix", "refuted"),
    [([NOW], False), ([NOW, NOW], True), ([NOW, NONE], False), ([NONE] * 5, False), ([NOW, P, NOW, NOW], False)],
)
def test_time_is_part_of_what_nothing_mends(prefix: list[frozenset[str]], refuted: bool) -> None:
    assert claim("F[<=1s] p", SECOND).refuted_by(prefix) is refuted


def test_continuations_keep_or_turn_around_what_was_last() -> None:
    loops = continuations(frozenset("a"), ["b", "a", "c"])
    assert (frozenset("a"),) in loops and (frozenset("bc"),) in loops
    assert loops[-2:] == [(NONE, frozenset("abc")), (frozenset("abc"), NONE)]
    assert loops[:2] == [(NONE,), (frozenset("abc"),)]
    assert loops[4:7] == [(frozenset("a"),), (frozenset("b"),), (frozenset("c"),)]
    many = [f"x{i:02}" for i in range(20)]
    assert len(continuations(NONE, many)) == 4 + 16 + 2
