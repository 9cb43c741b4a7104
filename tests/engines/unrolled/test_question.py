"""Questions that limits end leave the solver's context as it was."""

from __future__ import annotations

from itertools import pairwise

import pytest
import z3

from llfsm_verify.backends.smt import solver as asking
from llfsm_verify.engines.unrolled.question import Question
from llfsm_verify.limits import Budget, LimitReached, Limits


@pytest.mark.slow
@pytest.mark.parametrize("finite", [True, False])
def test_a_limit_while_constraints_are_taken_in(monkeypatch: pytest.MonkeyPatch, finite: bool) -> None:
    monkeypatch.setattr(asking, "LOOK_SECONDS", 0.002)
    hard = Question(finite=finite, effort=10**9)
    bools = [z3.Bool(f"b{i}") for i in range(100)]
    words = [z3.BitVec(f"w{i}", 16) for i in range(60)]
    one, other = (z3.BitVec(name, 128) for name in "pq")
    hard.add([z3.Or(z3.Not(a), z3.Not(b)) for i, a in enumerate(bools) for b in bools[:i]])
    hard.add([z3.URem(a * b, a + 1) == a for a, b in pairwise(words)])
    hard.add([one * other == (2**61 - 1) * (2**61 - 31), *(z3.UGT(f, 1) for f in (one, other)), z3.ULE(one, other)])
    hard.add([z3.ULT(other, 2**62)])  # to be answered takes hours
    with pytest.raises(LimitReached, match="time limit"):
        hard.ask([bools[0]], Budget(Limits(timeout=0.0)))
    word = z3.BitVec("w", 8)
    assert z3.simplify(word + word - word).eq(word)
    for small in (False, True):
        fresh = Question(finite=small, effort=10**6)
        fresh.add([z3.UGT(word, 3)])
        assert fresh.ask([word == 4], Budget(Limits())) is not None
        assert fresh.ask([word == 2], Budget(Limits())) is None


def test_a_constraint_is_told_once() -> None:
    question = Question(finite=True)
    known = [z3.Bool(f"b{i}") for i in range(4)]
    for most, count in ((2, 2), (2, 2), (1, 2), (None, 4), (None, 4), (3, 4)):
        question.learn(known, most)
        assert question.told == known[:count]
    known.append(z3.Bool("b4"))
    question.learn(known)
    assert question.told == known
