"""The truth of a formula on an ultimately periodic word, straight from the definition, without automata."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Mapping, Sequence
from fractions import Fraction
from itertools import accumulate
from math import ceil, floor, inf

from llfsm_verify.limits import tick
from llfsm_verify.logic.bounds import step_bound, time_bound
from llfsm_verify.logic.formula import (
    BOOLEAN,
    BOUNDED_PAST,
    EXPRESSIONS,
    FALSE,
    PAST,
    PAST_STEPS,
    PAST_TIMED,
    Formula,
    Op,
    operators,
    postorder,
)
from llfsm_verify.logic.word import CONNECTIVES, Lasso, Letter, Times, holds_in

Row = list[bool]
LETTERS = 64
"""Truth values of one subformula for each tick, beside those of operators that take longer."""
ALL_TURNS = 4096
"""As far as a bound of the past is unrolled where not only truth is asked for."""
STEP_EFFORT = 3
"""A letter read takes as long as a derivative with so many arguments."""
_REACHING, _GREATEST = frozenset("FUWOS"), frozenset("GWRHT")


def evaluate(
    formula: Formula, stem: Sequence[Letter], loop: Sequence[Letter], delays: Sequence[float | Fraction] | None = None
) -> bool:
    """Whether the word `stem` `loop` `loop` … satisfies `formula`.

    Every subformula gets its truth at each position of stem and loop; the temporal ones as the least (`F U M`) or
    greatest (`G W R`) solution of their expansion law, in two sweeps backwards. Time: size of the formula times
    positions. `delays` are the milliseconds from each letter of stem and loop to the next one (the last: to the start
    of the loop), which operators with a time bound need. ValueError: the loop is empty, or delays are missing.
    KeyError: a mapping lacks an atom. ExpressionTooLarge: the closure of a regular expression over too many atoms.
    """
    word = _word(stem, loop, delays)
    if formula.op in ("F", "G") and BOUNDED_PAST & operators(formula) and operators(formula.args[0]) <= BOOLEAN | PAST:
        # What is seen in the first turn needs no other.
        found, truth = formula.op == "F", dict[Formula, Row]()
        for node in postorder(formula.args[0]):
            truth[node] = _row(node, truth, word)
        if found in truth[formula.args[0]]:
            return found
    return truth_of((formula,), stem, loop, delays, sparing=True)[1][formula][0]


def truth_of(
    formulas: Sequence[Formula],
    stem: Sequence[Letter],
    loop: Sequence[Letter],
    delays: Sequence[float | Fraction] | None = None,
    *,
    sparing: bool = False,
) -> tuple[Lasso, dict[Formula, list[bool]]]:
    """The truth of every subformula of `formulas` at each position of the word, whose loop is unrolled so often that
    what was makes no difference any more; arguments and errors as for `evaluate`.

    `sparing`: only as often as the truth of this word needs. Otherwise also until bounds of up to `ALL_TURNS` turns
    allow, from the loop on, nothing before it any more, and longer ones a whole turn.
    """
    word = _word(stem, loop, delays)
    # What has been changes with each turn of the loop, so many for each past operator inside another; then no more.
    time = None if delays is None else sum((Fraction(delay) for delay in delays[len(stem) :]), Fraction(0))
    truth: dict[Formula, Row] = {}
    settled: dict[Formula, int] = {}
    """After so many turns a subformula is in each one as in the one before."""
    for node in postorder(*formulas):
        turns = max((settled[a] for a in node.args), default=0)
        if node.op in PAST:
            start = len(stem) + turns * len(loop)
            turns += _lasting(node, [truth[a] for a in node.args], word, start, time, sparing=sparing)
            missing = turns - (word.back - len(stem)) // len(loop)
            if missing > 0:
                word = _unrolled(word, missing)
                for row in truth.values():
                    row += row[-len(loop) :] * missing
        settled[node] = turns
        for _ in range(0, len(word.letters), LETTERS):
            tick()
        if node.op not in EXPRESSIONS:
            truth[node] = _row(node, truth, word)
    return word, truth


def _word(stem: Sequence[Letter], loop: Sequence[Letter], delays: Sequence[float | Fraction] | None) -> Lasso:
    if not loop:
        raise ValueError("a lasso needs a loop")
    if delays is not None and len(delays) != len(stem) + len(loop):
        raise ValueError("there is one delay for each letter of stem and loop")
    return Lasso((*stem, *loop), len(stem), None if delays is None else tuple(delays))


def _unrolled(word: Lasso, turns: int) -> Lasso:
    """The same word with so many more turns of its loop before it."""
    back, delays = word.back, word.delays
    loop = len(word.letters) - back
    return Lasso(
        (*word.letters, *list(word.letters[back:]) * turns),
        back + turns * loop,
        None if delays is None else (*delays, *list(delays[back:]) * turns),
    )


def _turns(node: Formula, letters: int, time: Fraction | None) -> int:
    """How many turns of a loop of so many letters and milliseconds a past operator sees from its end."""
    if node.op in PAST_STEPS:
        return ceil(step_bound(node)[1] / letters)
    if node.op not in PAST_TIMED or not time:
        return 1
    least, most = time_bound(node.key)
    return 1 + floor((least if most is None else most) / time) + (most is None)


def _lasting(
    node: Formula, args: Sequence[Row], word: Lasso, start: int, time: Fraction | None, *, sparing: bool
) -> int:
    """After how many turns a past operator is in each one as in the one before, where its operands are from `start` on.

    `time`: the milliseconds that a turn takes. `sparing` as for `truth_of`.
    """
    loop = len(word.letters) - word.back
    most = _turns(node, loop, time)
    if node.op not in BOUNDED_PAST:
        return most
    whole = _to_whole_turn(node, loop, time)
    if not sparing and (whole is None or most <= ALL_TURNS):
        return most
    least = 0 if sparing or whole is None else whole
    dual = node.op[0] in "HT"
    turn = range(start, start + loop)
    kept_from = 0
    if len(args) == 2:
        if any(args[0][i] == dual for i in turn):
            return min(most, max(1, least))  # nothing from before the turn counts in the next one
        kept_from = next((i for i in reversed(range(start)) if args[0][i] == dual), 0)
    goal = args[-1]
    if any(goal[i] != dual for i in turn):
        return most if whole is None else min(most, whole)
    last = next((i for i in reversed(range(kept_from, start)) if goal[i] != dual), None)
    return min(most, max(least, 0 if last is None else _to_last_sight(node, word, last, start, time)))


def _to_whole_turn(node: Formula, loop: int, time: Fraction | None) -> int | None:
    """After how many turns the bound allows letters of a whole turn wherever it is; None: it allows fewer."""
    if node.op in PAST_STEPS:
        first, last = step_bound(node)
        return 1 + ceil(first / loop) if last - first >= loop else None
    if not time:
        return None
    least, most = time_bound(node.key)
    return 2 + ceil(least / time) if most is None or most - least >= time else None


def _to_last_sight(node: Formula, word: Lasso, seen: int, start: int, time: Fraction | None) -> int:
    """After how many turns from `start` the bound allows position `seen`, before it, no more (or from then on)."""
    loop = len(word.letters) - word.back
    if node.op in PAST_STEPS:
        return max(0, ceil((seen + step_bound(node)[1] + 1 - start) / loop))
    if not time or word.delays is None:
        return _turns(node, loop, time)
    least, most = time_bound(node.key)
    passed = sum((Fraction(delay) for delay in word.delays[seen:start]), Fraction(0))
    return max(0, 1 + floor(((least if most is None else most) - passed) / time))


def _row(node: Formula, truth: Mapping[Formula, Row], word: Lasso) -> Row:
    """The truth of `node` at each position of `word`; `truth` has the rows of its arguments."""
    if node.op in ("[]->", "<>->", "closure"):
        return _matches(node, truth, word)
    args = [truth[a] for a in node.args]
    if node.op in CONNECTIVES:
        connective = CONNECTIVES[node.op]
        return [connective(column) for column in zip(*args, strict=True)]
    match node.op:
        case "true" | "false":
            return [node.op == "true"] * len(word.letters)
        case "atom":
            return [holds_in(node.key, letter) for letter in word.letters]
        case "X":
            return [*args[0][1:], args[0][word.back]]
        case "Y" | "Z":
            return [node.op == "Z", *args[0][:-1]]
        case "X[]" | "F[]" | "G[]":
            return _steps(node, args[0], word)
        case "F<=" | "G<=" | "U<=" | "R<=":
            return _timed(node, args, word)
        case "O[]" | "H[]" | "S[]" | "T[]" | "O<=" | "H<=" | "S<=" | "T<=":
            return _bounded_past(node, args, word)
        case "F" | "G" | "U" | "W" | "R" | "M" | "O" | "H" | "S" | "T":
            return _unfolded(node.op, args, word)
    raise AssertionError(node.op)


def _unfolded(op: Op, args: Sequence[Row], word: Lasso) -> Row:
    """By the expansion law: `b || (a && rest)`, and for the duals `b && (a || rest)`, with the rest from the position
    after, or from the one before."""
    n, past, reaching, greatest = len(word.letters), op in PAST, op in _REACHING, op in _GREATEST
    a, b = args if len(args) == 2 else ([reaching] * n, args[0])
    row = [greatest] * n
    # The second sweep backwards brings what the first learned at the start of the loop to its end. Forwards one is
    # enough: the loop has been unrolled until its turns no longer differ.
    for i in range(n) if past else [*reversed(range(n))] * 2:
        tick()
        rest = row[i - 1 if past else word.after(i)]  # the last one, before the first, is as it was
        row[i] = b[i] or (a[i] and rest) if reaching else b[i] and (a[i] or rest)
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
            tick()
            seen.append(argument[at])
            at = word.after(at)
        row.append(all(seen) if node.op == "G[]" else any(seen))
    return row


def looked_back(node: Formula, word: Lasso) -> list[tuple[int, int]]:
    """From where to where a bounded past operator looks at each position; nowhere, where the second is less.

    ValueError: a bound in time, and no delays.
    """
    if node.op in PAST_STEPS:
        first, last = step_bound(node)
        return [(max(0, i - last), i - first) for i in range(len(word.letters))]
    if word.delays is None:
        raise ValueError("a time bound needs the delays between letters")
    least, most = time_bound(node.key)
    at = [Fraction(0)]
    for delay in word.delays[:-1]:
        tick()
        at.append(at[-1] + Fraction(delay))
    windows = []
    for i, now in enumerate(at):
        tick()
        first = 0 if most is None else bisect_left(at, now - most)
        windows.append((first, min(i, bisect_right(at, now - least) - 1)))
    return windows


def _bounded_past(node: Formula, args: Sequence[Row], word: Lasso) -> Row:
    """By the letters in which the second operand of `S` held: one that the bound allows, and after which the first one
    never failed. `O` has no first one, and `H` and `T` are the duals."""
    dual = node.op[0] in "HT"
    goal = [holds != dual for holds in args[-1]]
    held = list(accumulate(goal, initial=0))
    row: Row = []
    kept_from = 0
    for i, (first, last) in enumerate(looked_back(node, word)):
        tick()
        if len(args) == 2 and args[0][i] == dual:
            kept_from = i
        first = max(first, kept_from)
        row.append((first <= last and held[last + 1] > held[first]) != dual)
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
            tick()
            if goal[i]:
                until[i] = Fraction(0)
            elif keep[i]:
                until[i] = word.delays[i] + until[word.after(i)]
            kept[i] = kept[word.after(i)] + 1 if keep[i] else 0
    row = []
    for i in range(n):
        tick()
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
    from llfsm_verify.logic.expressions import (  # few formulas have one
        DerivationBudget,
        derivative,
        has_word,
        letters,
        nullable,
    )

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
            tick()
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
