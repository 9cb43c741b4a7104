"""Why a regular property fails, in words."""

from __future__ import annotations

import pytest

from llfsm_verify.analysis.explanation.sentences import regular_reason
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import FEATURES, parse_properties

P, Q, NONE = frozenset("p"), frozenset("q"), frozenset[str]()


@pytest.mark.parametrize(
    ("line", "word", "possible", "reason"),
    [
        ("forbid x: p q", [P, P, Q], None, "the run shows `p`, then `q` at step 2, which is forbidden"),
        ("forbid x: p q p", [P, Q, P], None, "the run shows `p`, then `q`, then `p` at step 2, which is forbidden"),
        ("forbid x: q", [Q], None, "the run shows `q` at step 0, which is forbidden"),
        ("forbid x: p q", [Q, P], None, None),
        ("forbid initially x: p q", [P, Q], None, "the run shows `p`, then `q` at step 1, which is forbidden"),
        ("forbid initially x: p q", [Q, P, Q], None, None),
        ("enforce x: (p q)*", [Q], None, "the run shows `q` at step 0, and has to begin with `p`"),
        ("enforce x: (p q)*", [P, NONE], None,
         "the run shows none of its letters at step 1, and after `p` only `q` may follow"),
        ("enforce x: (p (p | q))*", [P, NONE], None,
         "the run shows none of its letters at step 1, and after `p` only `p` or `q` may follow"),
        ("enforce x: (p (p | q))*", [P, NONE], [P],
         "the run shows none of its letters at step 1, and after `p` only `p` may follow"),
        ("enforce x: (p q)*", [P, NONE], [],
         "the run shows none of its letters at step 1, and nothing may follow after `p`"),
        ("enforce x: (p q)*", [Q], [], None),
        ("enforce x: (p q)*", [Q, P, P], None, None),
    ],
)  # fmt: skip
def test_reasons(
    line: str, word: list[frozenset[str]], possible: list[frozenset[str]] | None, reason: str | None
) -> None:
    (read,) = parse_properties([Source("t", line)], features=FEATURES)
    assert read.expression is not None
    found = regular_reason(read.kind, read.expression, word, lambda i: f"at step {i}", possible)  # type: ignore[arg-type]
    assert found == reason


def test_of_a_long_match_the_end_is_shown(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("llfsm_verify.analysis.explanation.sentences.MOST_SHOWN", 2)
    (read,) = parse_properties([Source("t", "forbid x: p q p q")], features=FEATURES)
    assert read.expression is not None
    found = regular_reason("forbid", read.expression, [P, Q, P, Q], lambda i: f"at step {i}", None)
    assert found == "the run shows … then `p`, then `q` at step 3, which is forbidden"
    (short,) = parse_properties([Source("t", "forbid x: p q")], features=FEATURES)
    assert short.expression is not None
    found = regular_reason("forbid", short.expression, [P, Q], lambda i: f"at step {i}", None)
    assert found == "the run shows `p`, then `q` at step 1, which is forbidden"
