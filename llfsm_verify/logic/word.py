"""Words: letters, and the ultimately periodic words that lassos write down."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from fractions import Fraction

from llfsm_verify.logic.formula import Formula, Op, postorder

Letter = Mapping[str, bool] | AbstractSet[str]
"""The truth of atoms by key: a mapping that has all of them, or the set of those that hold."""


@dataclass(frozen=True, slots=True)
class Lasso:
    """The word `letters` whose last letter is followed by number `back`, with the milliseconds after each letter."""

    letters: Sequence[Letter]
    back: int
    delays: Sequence[float | Fraction] | None = None

    def after(self, i: int) -> int:
        """The position after position `i`."""
        return i + 1 if i + 1 < len(self.letters) else self.back


class Times:
    """The time at the positions of a lasso that has delays, from its first letter on."""

    def __init__(self, word: Lasso) -> None:
        """ValueError: there are no delays."""
        if word.delays is None:
            raise ValueError("a time bound needs the delays between letters")
        self._word = word
        at = [Fraction(0)]
        for i in (*range(len(word.letters)), *range(word.back, len(word.letters))):
            at.append(at[-1] + Fraction(word.delays[i]))
        self._at = at
        """Of the positions and one more turn of the loop, and where that ends."""
        self._turn = at[-1] - at[len(word.letters)]

    def later(self, i: int, time: Fraction) -> tuple[int, Fraction, int] | None:
        """The first letter at which at least `time` (more than 0) has passed since position `i`.

        Letters and milliseconds from there to it, and its position. None: so much time never passes.
        """
        goal, count, loop = self._at[i] + time, len(self._word.letters), len(self._word.letters) - self._word.back
        turns = 0
        if goal > self._at[count]:
            if self._turn == 0:
                return None
            turns = (goal - self._at[count]) // self._turn
        at = bisect_left(self._at, goal - turns * self._turn)
        position = at if at < count else self._word.back + (at - count) % loop
        return at + turns * loop - i, self._at[at] + turns * self._turn - self._at[i], position


def holds_in(key: str, letter: Letter) -> bool:
    """The truth of the atom `key` in `letter`; KeyError when a mapping lacks it."""
    return letter[key] if isinstance(letter, Mapping) else key in letter


CONNECTIVES: Mapping[Op, Callable[[Sequence[bool]], bool]] = {
    "not": lambda values: not values[0],
    "and": all,
    "or": any,
    "xor": lambda values: values[0] != values[1],
    "iff": lambda values: values[0] == values[1],
    "implies": lambda values: not values[0] or values[1],
}
"""What the Boolean operators make of the truth of their arguments."""


def truth(f: Formula, letter: Letter) -> bool:
    """The truth of a state formula in a letter. KeyError as for `holds_in`."""
    values: dict[Formula, bool] = {}
    for node in postorder(f):
        match node.op:
            case "true" | "false":
                values[node] = node.op == "true"
            case "atom":
                values[node] = holds_in(node.key, letter)
            case _:
                values[node] = CONNECTIVES[node.op](tuple(values[a] for a in node.args))
    return values[f]
