"""What stands beside a run: of Bools one is true."""

from __future__ import annotations

import pytest
import z3

from llfsm_verify.engines.inductive import observers as readers


@pytest.mark.parametrize("paired", [1, 2, 3, 32])
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7])
def test_one_is_true_in_both_ways_to_write_it(monkeypatch: pytest.MonkeyPatch, paired: int, count: int) -> None:
    monkeypatch.setattr(readers, "MOST_PAIRED", paired)
    bools = [z3.Bool(f"b{i}") for i in range(count)]
    formula = z3.And(readers.exactly_one(bools))
    for letter in range(1 << count):
        values = [(b, z3.BoolVal(bool(letter >> i & 1))) for i, b in enumerate(bools)]
        found = z3.simplify(z3.substitute(formula, *values))
        assert z3.is_true(found) == (letter.bit_count() == 1)
        assert z3.is_true(found) or z3.is_false(found)


@pytest.mark.slow
def test_many_are_written_in_few_clauses() -> None:
    bools = [z3.Bool(f"b{i}") for i in range(2_000)]
    assert len(readers.exactly_one(bools)) < 40_000
