"""Words: letters, and the ultimately periodic words that lassos write down."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from fractions import Fraction

from llfsm_verify.logic.formula import Formula, Op, postorder

Letter = Mapping[str, bool] | AbstractSet[str]
"""The truth of atoms by key: a mapping that has all of them, or the set of those that hold."""


@dataclass(frozen=True, slots=True)
class Lasso:
    """The word `letters` whose last letter is followed by number `back`, with the milliseconds behind each letter."""

    letters: Sequence[Letter]
    back: int
    delays: Sequence[float | Fraction] | None = None

    def after(self, i: int) -> int:
        """The position behind position `i`."""
        return i + 1 if i + 1 < len(self.letters) else self.back


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
