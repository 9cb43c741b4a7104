"""The truth of a formula on an ultimately periodic word, straight from the definition, without automata."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction

from llfsm_verify.logic.bounds import past_depth
from llfsm_verify.logic.formula import BINDING, EXPRESSIONS, PAST, STEPS, TIMED, Formula, postorder
from llfsm_verify.logic.word import CONNECTIVES, Lasso, Letter, holds_in


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
    return truth_of((formula,), stem, loop, delays)[1][formula][0]


def truth_of(
    formulas: Sequence[Formula],
    stem: Sequence[Letter],
    loop: Sequence[Letter],
    delays: Sequence[float | Fraction] | None = None,
) -> tuple[Lasso, dict[Formula, list[bool]]]:
    """The truth of every subformula of `formulas` at each position of the word, whose loop is unrolled so often that
    what was makes no difference any more; arguments and errors as for `evaluate`."""
    if not loop:
        raise ValueError("a lasso needs a loop")
    if delays is not None and len(delays) != len(stem) + len(loop):
        raise ValueError("there is one delay for each letter of stem and loop")
    # What has been changes with each turn of the loop, one turn for each past operator inside another; then no more.
    turns = max(map(past_depth, formulas))
    word = Lasso(
        (*stem, *list(loop) * turns, *loop),
        len(stem) + turns * len(loop),
        None if delays is None else (*delays, *list(delays[len(stem) :]) * turns),
    )
    truth: dict[Formula, list[bool]] = {}
    for node in postorder(*formulas):
        if node.op in EXPRESSIONS:
            continue
        if node.op in PAST | STEPS | TIMED | BINDING:
            from llfsm_verify.logic.lasso_extended import extended_row

            truth[node] = extended_row(node, truth, word)
        else:
            truth[node] = _row(node, [truth[a] for a in node.args], word.letters, word.back)
    return word, truth


def _row(node: Formula, args: list[list[bool]], letters: Sequence[Letter], back: int) -> list[bool]:
    n = len(letters)
    if node.op in CONNECTIVES:
        connective = CONNECTIVES[node.op]
        return [connective(column) for column in zip(*args, strict=True)]
    match node.op:
        case "true" | "false":
            return [node.op == "true"] * n
        case "atom":
            return [holds_in(node.key, letter) for letter in letters]
        case "X":
            return [*args[0][1:], args[0][back]]
    a, b = (args[0], args[1]) if len(args) == 2 else ([node.op == "F"] * n, args[0])
    row = [node.op in ("G", "W", "R")] * n
    for _ in range(2):  # the second sweep brings what the first learned at the start of the loop to its end
        for i in reversed(range(n)):
            later = row[i + 1] if i + 1 < n else row[back]
            match node.op:
                case "U" | "F" | "W":
                    row[i] = b[i] or (a[i] and later)
                case "R" | "M":
                    row[i] = b[i] and (a[i] or later)
                case "G":
                    row[i] = b[i] and later
                case _:
                    raise AssertionError(node.op)
    return row
