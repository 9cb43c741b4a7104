"""Why a regular property fails, as a clause: what was shown, and what could have followed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from llfsm_verify.analysis.explanation.sentences import listed
from llfsm_verify.logic.expressions import derivative, letters, nullable
from llfsm_verify.logic.formula import FALSE, Formula, to_text
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import RegularKind
from llfsm_verify.logic.regular_evaluate import Valuation, valuations

MOST_SHOWN = 6
"""Valuations of a forbidden sequence that are written out."""


def regular_reason(
    kind: RegularKind,
    expression: Formula,
    word: Sequence[frozenset[str]],
    place: Callable[[int], str],
    possible: Sequence[frozenset[str]] | None,
) -> str | None:
    """Why `word`, whose last letter closes a bad prefix, violates `kind expression`; None: there are no words for it.

    `place` says where a letter is: `at step 35`. `possible` are the letters with which, instead of the last, it would
    be no bad prefix (None: not known).
    """
    shown = valuations(expression, word)
    where = place(len(word) - 1)
    if kind == "enforce":
        return _unexpected(expression, shown, where, possible)
    return _completed(kind, expression, shown, where)


def _unexpected(
    expression: Formula, shown: Sequence[Valuation], where: str, possible: Sequence[frozenset[str]] | None
) -> str | None:
    rest = expression
    for valuation in shown[:-1]:
        rest = derivative(rest, valuation.__contains__)
        if rest is FALSE:
            return None
    following = [letter for letter in letters(expression) if _begins(rest, letter)]
    if possible is not None:
        # A match may begin with what no word goes on with: of `p p`, no two neighbours of which may be equal, nothing.
        following = [f for f in following if any(evaluate(f, (), (letter,)) for letter in possible)]
    now = f"{_valuation(expression, shown[-1])} {where}"
    if len(shown) == 1:
        return f"the run shows {now}, and has to begin with {_choice(following)}" if following else None
    before = f"after {_valuation(expression, shown[-2])}"
    if not following:
        return f"the run shows {now}, and nothing may follow {before}"
    return f"the run shows {now}, and {before} only {_choice(following)} may follow"


def _begins(expression: Formula, letter: Formula) -> bool:
    """Whether a match can begin with a letter."""
    return derivative(expression, lambda other: other is letter) is not FALSE


def _completed(kind: RegularKind, expression: Formula, shown: Sequence[Valuation], where: str) -> str | None:
    starts = range(len(shown) - 1, -1, -1) if kind == "forbid" else [0]
    for start in starts:
        rest = expression
        for valuation in shown[start:]:
            rest = derivative(rest, valuation.__contains__)
        if rest is not FALSE and nullable(rest):
            part = shown[start:]
            texts = [_valuation(expression, v) for v in part[-MOST_SHOWN:]]
            dots = "… then " if len(part) > MOST_SHOWN else ""
            return f"the run shows {dots}{', then '.join(texts)} {where}, which is forbidden"
    return None


def _valuation(expression: Formula, valuation: Valuation) -> str:
    names = [f"`{to_text(letter)}`" for letter in letters(expression) if letter in valuation]
    return listed(names) if names else "none of its letters"


def _choice(options: Sequence[Formula]) -> str:
    return " or ".join(f"`{to_text(option)}`" for option in options)
