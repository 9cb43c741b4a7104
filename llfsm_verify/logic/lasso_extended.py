"""The truth of past, bounded and regular operators at each position of an ultimately periodic word, by definition."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import inf

from llfsm_verify.logic.bounds import step_bound, time_bound
from llfsm_verify.logic.expressions import DerivationBudget, derivative, has_word, letters, nullable
from llfsm_verify.logic.formula import FALSE, PAST, STEPS, TIMED, Formula
from llfsm_verify.logic.word import Lasso, Times

Row = list[bool]
STEP_EFFORT = 3
"""A letter read takes as long as a derivative with so many arguments."""


def extended_row(node: Formula, truth: Mapping[Formula, Row], word: Lasso) -> Row:
    """The truth of `node` at each position of `word`; `truth` has the rows of its arguments."""
    if node.op in PAST:
        return _past(node, [truth[a] for a in node.args])
    if node.op in STEPS:
        return _steps(node, truth[node.args[0]], word)
    if node.op in TIMED:
        return _timed(node, [truth[a] for a in node.args], word)
    return _matches(node, truth, word)


def _past(node: Formula, args: Sequence[Row]) -> Row:
    """Forwards once: the loop has been unrolled until its turns no longer differ."""
    n = len(args[0])
    row = [node.op in ("Z", "H", "T")] * n
    for i in range(n):
        before = row[i - 1] if i else node.op in ("Z", "H", "T")
        match node.op:
            case "Y" | "Z":
                row[i] = args[0][i - 1] if i else node.op == "Z"
            case "O":
                row[i] = args[0][i] or before
            case "H":
                row[i] = args[0][i] and before
            case "S":
                row[i] = args[1][i] or (args[0][i] and before)
            case "T":
                row[i] = args[1][i] and (args[0][i] or before)
            case _:
                raise AssertionError(node.op)
    return row


def _steps(node: Formula, argument: Row, word: Lasso) -> Row:
    first, last = step_bound(node)
    n = len(argument)
    # A stretch that is longer than the word shows no more of it.
    last = min(last, first + n - 1)
    row = []
    for i in range(n):
        at = i
        for _ in range(first):
            at = word.after(at)
        seen = []
        for _ in range(first, last + 1):
            seen.append(argument[at])
            at = word.after(at)
        row.append(all(seen) if node.op == "G[]" else any(seen))
    return row


def _timed(node: Formula, args: Sequence[Row], word: Lasso) -> Row:
    """By the time until the operand of `F`, the second one of `U`, is next met; `G` and `R` are the duals."""
    if word.delays is None:
        raise ValueError("a time bound needs the delays between letters")
    least, most = time_bound(node.key)
    times = Times(word) if least else None
    n = len(args[0])
    dual = node.op in ("G<=", "R<=")
    keep, goal = [True] * n if len(args) == 1 else args[0], args[-1]
    if dual:
        keep, goal = keep if len(args) == 1 else [not holds for holds in keep], [not holds for holds in goal]
    until: list[float | Fraction] = [inf] * n
    kept: list[float] = [inf if all(keep[word.back :]) else 0] * n
    """The letters from each position on at which `keep` holds."""
    for _ in range(2):  # the second sweep brings what the first learned at the start of the loop to its end
        for i in reversed(range(n)):
            if goal[i]:
                until[i] = Fraction(0)
            elif keep[i]:
                until[i] = word.delays[i] + until[word.after(i)]
            kept[i] = kept[word.after(i)] + 1 if keep[i] else 0
    row = []
    for i in range(n):
        later = (0, Fraction(0), i) if times is None else times.later(i, least)
        met = later is not None and later[0] <= kept[i]
        if later is not None and met:
            time = later[1] + until[later[2]]
            met = time < inf if most is None else time <= most
        row.append(met != dual)
    return row


def _matches(node: Formula, truth: Mapping[Formula, Row], word: Lasso) -> Row:
    """Whether every match (`[]->`) or some match (`<>->`) ends where the formula holds; or the weak closure.

    ExpressionTooLarge: it takes too many continuations of the expression, or too long ones.
    """
    expression = node.args[0]
    alphabet = letters(expression)
    shown = [frozenset(f for f in alphabet if truth[f][at]) for at in range(len(word.letters))]
    known: dict[Formula, bool] = {}
    steps: dict[tuple[Formula, frozenset[Formula]], tuple[Formula, bool, bool]] = {}
    budget = DerivationBudget()

    def after(rest: Formula, letter: frozenset[Formula]) -> tuple[Formula, bool, bool]:
        """What remains of `rest`, whether it is matched now, and whether it can still be."""
        if (rest, letter) not in steps:
            budget.derive(rest)
            following = derivative(rest, letter.__contains__)
            alive = node.op != "closure" or (following is not FALSE and has_word(following, known, budget))
            steps[rest, letter] = following, nullable(following), alive
        return steps[rest, letter]

    row = []
    for i in range(len(word.letters)):
        ends: set[int] = set()
        alive = True  # every beginning read so far can still become a match
        seen = {(expression, i)}
        queue = [(expression, i)]
        for rest, at in queue:
            budget.spend(STEP_EFFORT)
            following, matched, possible = after(rest, shown[at])
            if matched:
                ends.add(at)
            alive = alive and possible
            state = (following, word.after(at))
            if following is not FALSE and state not in seen:
                seen.add(state)
                queue.append(state)
        if node.op == "closure":
            row.append(bool(ends) or alive)
        else:
            formula = truth[node.args[1]]
            row.append(all(formula[k] for k in ends) if node.op == "[]->" else any(formula[k] for k in ends))
    return row
