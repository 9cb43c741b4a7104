"""The bounds of operators: how many steps, how much time, how often."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from fractions import Fraction
from math import ceil, floor
from typing import Final

from llfsm_verify.logic.formula import (
    PAST_STEPS,
    STEPS,
    TIMED,
    Formula,
    Op,
    apply,
    conjunction,
    disjunction,
    mapped,
    postorder,
)

MAX_STEPS = 1_000
"""The largest step bound: writing it out makes a formula as deep as that. Of the past: the largest from below, which
takes as many bits."""
MAX_STEPS_IN_ALL = 50_000
"""The largest sum of the step bounds of a formula: so many operators are written out."""
MAX_TICKS = 1 << 20
"""The largest bound in time, in cycles, and the largest one of the past in steps: so many states of a counter."""
HIDDEN = "\0"
"""The keys of atoms that users do not write start with this character."""
TICK = HIDDEN + "tick"
"""The key of the atom that tells whether time passes after a letter."""

IN_STEPS: Final[dict[str, Op]] = {op[0]: op for op in STEPS | PAST_STEPS}
"""The operators with a bound in steps, by the letter that is written."""

TimeBound = tuple[Fraction, Fraction | None]
"""The least and the largest number of milliseconds (None: any)."""


@dataclass(frozen=True, slots=True)
class Clock:
    """How time passes along a word: `period` milliseconds pass after a letter in which TICK holds, none after others.

    Runs let time pass forever: TICK holds in infinitely many letters.
    """

    period: Fraction

    def ticks(self, bound: TimeBound) -> tuple[int, int | None]:
        """The least and the largest number of periods (None: any) within a bound; exact, since nothing happens between
        two multiples of the period. The largest is the smaller one where no multiple is within."""
        least, most = bound
        return ceil(least / self.period), None if most is None else floor(most / self.period)

    def delays(self, letters: Iterable[AbstractSet[str]]) -> list[Fraction]:
        """The milliseconds after each of `letters`, given by the keys of their true atoms."""
        return [self.period if TICK in letter else Fraction(0) for letter in letters]


def step_bound(f: Formula) -> tuple[int, int]:
    """The first and the last step that `X[n]`, `F[n:m]`, `G[n:m]` or an operator of the past looks at."""
    first, _, last = f.key.partition(":")
    return int(first), int(last or first)


def steps_in_all(f: Formula) -> int:
    """The sum of the step bounds of `f`, those of a shared part once."""
    return sum(step_bound(node)[1] for node in postorder(f) if node.op in STEPS)


def time_bound(key: str) -> TimeBound:
    """The bound in time that an operator has as its `key`."""
    least, _, most = key.rpartition(":")
    return Fraction(least or 0), Fraction(most) if most else None


def least_of(f: Formula) -> int | Fraction:
    """Where the bound of an operator begins: a number of steps or of milliseconds."""
    return time_bound(f.key)[0] if f.op in TIMED else step_bound(f)[0]


def repeat(f: Formula, low: int, high: int | None) -> Formula:
    """`f` from `low` to `high` times (None: any number), as a node unless it is `f` itself or empty."""
    if high == 0:
        return apply("empty")
    if (low, high) == (1, 1):
        return f
    return apply("repeat", f, bound=f"{low}:{'' if high is None else high}")


def without_steps(f: Formula) -> Formula:
    """`f` with step bounds written out by `X`; linear in the bounds, because the result shares its parts."""
    if not any(node.op in STEPS for node in postorder(f)):
        return f
    joined = _joined_steps(f)
    done: dict[Formula, Formula] = {}
    for node in postorder(joined):
        args = tuple(done[a] for a in node.args)
        if node.op not in STEPS:
            done[node] = node if args == node.args else rebuilt(node, args)
            continue
        first, last = step_bound(node)
        join: Op = "and" if node.op == "G[]" else "or"
        result = args[0]
        for _ in range(last - first):
            result = apply(join, args[0], apply("X", result))
        for _ in range(first):
            result = apply("X", result)
        done[node] = result
    return done[joined]


def _joined_steps(f: Formula) -> Formula:
    """`f` with one bound in the place of two that stand directly inside each other: `F[a:b] F[c:d] p` looks at the
    steps from a + c to b + d, as do `G` in `G`, `X` in any, and any in `X`."""
    done: dict[Formula, Formula] = {}
    for node in postorder(f):
        args = tuple(done[a] for a in node.args)
        inner = args[0] if args else node
        if node.op in STEPS and inner.op in STEPS and (node.op == inner.op or "X[]" in (node.op, inner.op)):
            op = inner.op if node.op == "X[]" else node.op
            first, last = (a + b for a, b in zip(step_bound(node), step_bound(inner), strict=True))
            done[node] = apply(op, inner.args[0], bound=str(first) if op == "X[]" else f"{first}:{last}")
        else:
            done[node] = node if args == node.args else rebuilt(node, args)
    return done[f]


def without_bounded_since(f: Formula) -> Formula:
    """`f` with bounds in steps at `O` and `H` only: `p S[0:n] q` is `(p S q) && O[0:n] q`, and `T` is the dual."""

    def change(node: Formula, args: tuple[Formula, ...]) -> Formula | None:
        if node.op not in ("S[]", "T[]"):
            return None
        (first, last), strong = step_bound(node), node.op == "S[]"
        join = conjunction if strong else disjunction
        reached = apply("O[]" if strong else "H[]", args[1], bound=f"0:{last - first}")
        result = join((apply("S" if strong else "T", *args), reached))
        for _ in range(first):
            result = apply("Y" if strong else "Z", result)
        return join((apply("H[]" if strong else "O[]", args[0], bound=f"0:{first - 1}"), result)) if first else result

    return mapped(f, change)


def written_out(f: Formula) -> tuple[Formula, int] | None:
    """What `p || X (p || X p)` (or the same with `&&`), the form in which `F[0:2] p` is written out, says of how many
    further steps: `p` and 2. None: it is of another form."""
    op, first, steps = f.op, f.args[0] if f.args else f, 0
    while f.op == op and op in ("and", "or") and len(f.args) == 2 and f.args[0] is first and f.args[1].op == "X":
        f, steps = f.args[1].args[0], steps + 1
    return (first, steps) if steps and f is first else None


def rebuilt(node: Formula, args: tuple[Formula, ...]) -> Formula:
    """`node` with other arguments."""
    return apply(node.op, *args, bound=node.key) if args else node
