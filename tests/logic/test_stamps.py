"""What is left of formulas with bounds in time on stamped words, against the definition on words that go on."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from random import Random

import pytest

from llfsm_verify.logic.formula import FALSE, PAST, TIMED, TRUE, Formula, apply, atom, operators, postorder
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.stamps import Stamped, Unstamped

A, B = atom("a"), atom("b")
HORIZON = 40


def formula(random: Random, depth: int, *, future: bool = True) -> Formula:
    if not depth:
        return random.choice([A, B, apply("not", A), TRUE])
    kinds = ["and", "or", "not", "past"] + (["timed", "timed", "timed", "steps", "future"] if future else [])
    kind = random.choice(kinds)

    def part(*, later: bool = future) -> Formula:
        return formula(random, depth - 1, future=later)

    if kind in ("and", "or"):
        return apply(kind, part(), part())
    if kind == "not":
        return apply("not", part())
    if kind == "past":
        op = random.choice(["Y", "Z", "O", "H", "S", "T"])
        parts = [part(later=False) for _ in range(2 if op in "ST" else 1)]
        if op in "YZ" or random.random() < 0.3:
            return apply(op, *parts)
        least = random.choice([0, 0, 1, 2])
        if random.random() < 0.3:
            return apply(f"{op}[]", *parts, bound=f"{least}:{least + random.randrange(4)}")
        most = "" if least and random.random() < 0.2 else str(least + random.choice([0, 1, 3.5, 6]))
        return apply(f"{op}<=", *parts, bound=f"{least}:{most}")
    if kind == "timed":
        op = random.choice(["F<=", "G<=", "U<=", "R<="])
        least = random.choice([0, 0, 1, 3])
        most = random.choice(["", str(least + random.choice([0, 2, 5]))]) if random.random() < 0.2 else str(least + 4)
        return apply(op, *(part() for _ in range(2 if op in ("U<=", "R<=") else 1)), bound=f"{least}:{most}")
    if kind == "steps":
        return apply(random.choice(["F[]", "G[]"]), part(), bound="1:2")
    op = random.choice(["X", "F", "G", "U", "W", "R", "M"])
    return apply(op, *(part() for _ in range(2 if op in "UWRM" else 1)))


def word(random: Random, letters: int) -> tuple[list[frozenset[str]], list[Fraction]]:
    stamps, now = [], Fraction(0)
    for _ in range(letters):
        stamps.append(now)
        now += random.choice([Fraction(0), Fraction(1, 2), Fraction(1), Fraction(3), Fraction(7, 3)])
    return [frozenset(n for n in "ab" if random.random() < 0.4) for _ in range(letters)], stamps


def verdict(stamped: Stamped, letters: list[frozenset[str]], stamps: list[Fraction]) -> tuple[bool, int] | None:
    for number, (letter, stamp) in enumerate(zip(letters, stamps, strict=True)):
        found = stamped.read(letter, stamp)
        if found is not None:
            return found, number
    return None


def meant(asked: Formula, letters: list[frozenset[str]], stamps: list[Fraction], loop: frozenset[str]) -> bool:
    """By the definition, where `loop` is repeated after the letters, a second apart."""
    delays = [b - a for a, b in pairwise(stamps)] + [Fraction(1), Fraction(1)]
    return evaluate(asked, letters, (loop,), delays)


def agrees(seed: int) -> None:
    random = Random(seed)
    asked = formula(random, 3)
    letters, stamps = word(random, random.randrange(1, 9))
    loop = random.choice([frozenset[str](), frozenset("a"), frozenset("b"), frozenset("ab")])
    # What goes on for long enough: all windows have ended, and what is left asks for the loop alone.
    longer = letters + [loop] * HORIZON
    later = stamps + [stamps[-1] + 1 + n for n in range(HORIZON)]
    found = verdict(Stamped(asked), longer, later)
    truth = meant(asked, letters, stamps, loop)
    assert found is None or found[0] is truth, (asked, letters, stamps, loop)
    open_ended = operators(asked) & {"F", "G", "U", "W", "R", "M"}
    unbounded = any(node.op in TIMED - PAST and node.key.endswith(":") for node in postorder(asked))
    if not open_ended and not unbounded:
        assert found is not None, (asked, letters, stamps, loop)


@pytest.mark.parametrize("block", range(4))
def test_verdicts_are_those_of_the_definition(block: int) -> None:
    for seed in range(block * 100, block * 100 + 100):
        agrees(seed)


@pytest.mark.long
def test_verdicts_are_those_of_the_definition_at_length() -> None:
    for seed in range(1000, 11_000):
        agrees(seed)


def test_a_deadline_is_missed_at_the_first_letter_that_is_later() -> None:
    soon = apply("G", apply("implies", A, apply("F<=", B, bound="2000")))
    none, fire, alarm = frozenset[str](), frozenset("a"), frozenset("b")
    stamped = Stamped(soon)
    for letter, at in ((none, 0), (fire, 1000), (none, 3000), (none, 3000)):  # the deadline itself has not passed
        assert stamped.read(letter, Fraction(at)) is None
    assert stamped.read(alarm, Fraction(3001)) is False and stamped.deadline == 3000
    just = Stamped(soon)
    assert [just.read(x, Fraction(at)) for x, at in ((fire, 1000), (none, 3000), (alarm, 3000))] == [None] * 3


def test_windows_that_others_make_superfluous_are_dropped() -> None:
    for asked in (
        apply("G", apply("F<=", B, bound="1000000")),
        apply("G", apply("implies", A, apply("U<=", A, B, bound="1000000"))),
        apply("F", apply("G<=", B, bound="1000000")),
    ):
        stamped = Stamped(asked)
        letter = frozenset("b") if "F" in operators(asked) else frozenset("a")
        for at in range(300):
            assert stamped.read(letter, Fraction(at)) is None
        assert len(postorder(stamped.rest)) < 12


def test_a_past_operator_keeps_what_its_window_may_still_come_to(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.logic.stamps.MOST_MET", 5)
    both = frozenset("ab")
    for bound, far in (("0:1000000", 30), ("2:", 30), ("2:4", 30), ("2:9", 6)):
        stamped = Stamped(apply("G", apply("implies", apply("not", B), apply("O<=", A, bound=bound))))
        for at in range(far - 1):
            assert stamped.read(both, Fraction(at)) is None
        if far == 6:
            with pytest.raises(Unstamped, match="more than 5 rows lie in the window"):
                stamped.read(both, Fraction(far))


def test_what_is_not_decided_in_this_way_is_refused() -> None:
    with pytest.raises(Unstamped, match="past operator"):
        Stamped(apply("O", apply("F<=", A, bound="1")))
    assert Stamped(TRUE).read(frozenset(), Fraction(0)) is True
    assert Stamped(FALSE).read(frozenset(), Fraction(0)) is False
