"""What a monitor remembers, in words: what is left to satisfy, or by what letters it is remembered."""

from __future__ import annotations

from itertools import groupby

from llfsm_verify.checking.goals.formulas import FormulaGoal
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.engines.unrolled.runs import BAD, Table
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.formula import Formula, is_plain, to_text
from llfsm_verify.logic.progression import progress
from llfsm_verify.logic.rewriting.normal_form import nnf
from llfsm_verify.logic.rewriting.simplify import simplified

MAX_TEXT = 160
"""Characters up to which a formula says more than letters do."""


def monitor_states(table: Table, goal: Goal) -> tuple[str, ...]:
    """For each state of the monitor of a goal what it stands for."""
    words = _shortest(table)
    plain = isinstance(goal, FormulaGoal) and is_plain(goal.claim.formula)
    found: list[str] = []
    for word in words:
        text = _left(goal.claim.formula, table, word) if plain and isinstance(goal, FormulaGoal) else None
        found.append(text or _letters(table, word))
    return tuple(found)


def _shortest(table: Table) -> list[tuple[int, ...]]:
    """Letters that lead to each state."""
    words: dict[int, tuple[int, ...]] = {0: ()}
    queue = [0]
    for state in queue:
        for move in table.moves:
            if move.source == state and move.target != BAD and move.target not in words:
                words[move.target] = (*words[state], min(positive for positive, _ in move.cubes))
                queue.append(move.target)
    return [words.get(i, ()) for i in range(table.states)]


def _left(formula: Formula, table: Table, word: tuple[int, ...]) -> str | None:
    rest = nnf(formula)
    for letter in word:
        rest = progress(rest, frozenset(a for i, a in enumerate(table.atoms) if letter >> i & 1))
    text = to_text(simplified(rest), MAX_TEXT)
    return f"from here on the run has to satisfy {text}" if len(text) < MAX_TEXT else None


def _letters(table: Table, word: tuple[int, ...]) -> str:
    if not word:
        return "nothing was shown yet"
    parts: list[str] = []
    for letter, same in groupby(word):
        times = len(list(same))
        text = " && ".join(_literal(a, bool(letter >> i & 1)) for i, a in enumerate(table.atoms)) or "true"
        parts.append(f"`{text}`" if times == 1 else f"{times} times `{text}`")
    return f"what was shown leaves as much open as {', then '.join(parts)}"


def _literal(key: str, holds: bool) -> str:
    text = "cycle" if key == TICK else key
    return text if holds else f"!{text}"
