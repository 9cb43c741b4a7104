"""Formulas with bounds in time on finite words whose letters have stamps: what is left of one after some letters.

Nothing is between two letters, and letters of one stamp are one after the other. A bound that was met is a window of
stamps from then on (`@low:high` in the place of the bound). A window whose end has passed is decided as soon as a later
stamp is known, with the stamp of its end. Past operators are computed forwards, and are atoms to the rest. Source:
Bacchus and Kabanza, Planning for temporally extended goals, Annals of Mathematics and Artificial Intelligence 22 (1998)
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from copy import copy
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache

from llfsm_verify.logic import formula as f
from llfsm_verify.logic.bounds import HIDDEN, rebuilt, step_bound, time_bound, without_steps
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, postorder, size
from llfsm_verify.logic.progression import MAX_SIZE, progressed
from llfsm_verify.logic.rewriting.normal_form import Negations, both, either, rewritten, temporal
from llfsm_verify.logic.word import CONNECTIVES, Letter, holds_in

REACHING: frozenset[Op] = frozenset({"F<=", "U<="})
"""False where their window ends without what they wait for; the others are true there."""
MOST_MET = 1 << 20
"""Letters that are kept for one bounded past operator."""


class Unstamped(Exception):
    """The formula, or what is left of it, is not decided in this way; the message says why."""


class Stamped:
    """What is left of a formula. `rest` TRUE or FALSE: however the word goes on, it is satisfied or violated."""

    def __init__(self, formula: Formula) -> None:
        """Unstamped: past operators about the future, or regular expressions."""
        formula = without_steps(formula)
        self._past = [node for node in postorder(formula) if node.op in f.PAST]
        names = {node: f.atom(f"{HIDDEN}past {number}") for number, node in enumerate(self._past)}
        self._now = list(postorder(*self._past)) if self._past else []
        if any(node.op not in f.BOOLEAN | f.PAST for node in self._now):
            raise Unstamped("a past operator that speaks of the future is not decided where rows have times")
        if any(node.op in f.BINDING for node in postorder(formula)):
            raise Unstamped("regular expressions beside bounds in time are not decided where rows have times")
        done: dict[Formula, Formula] = {}
        for node in postorder(formula):
            done[node] = names.get(node) or rebuilt(node, tuple(done[a] for a in node.args))
        self._atoms = f.atoms(formula)
        self._names = {node: names[node].key for node in self._past}
        self._before: dict[Formula, bool] = {}
        self._met: dict[Formula, deque[Fraction | int]] = {n: deque() for n in self._past if n.op in f.BOUNDED_PAST}
        """Where the goals were, since what has to be kept failed, that bounds of the past may yet come to."""
        self._count = 0
        self.rest = rewritten(done[formula], False, _NORMAL)[done[formula], False]
        self.deadline: Fraction | None = None
        """The end of the window by which it was decided, if it was by one."""

    def copied(self) -> Stamped:
        """The same, which then reads for itself."""
        other = copy(self)
        other._met = {node: deque(met) for node, met in self._met.items()}
        return other

    def read(self, letter: Letter, stamp: Fraction) -> bool | None:
        """The verdict after a further letter, whose stamp is not before the last one; None: not yet.
        Unstamped: too much is left over."""
        for end in sorted({high for low, high in map(_window, _open(self.rest)) if high is not None and high < stamp}):
            self.rest = _ended(self.rest, end)
            if self.rest in (TRUE, FALSE):
                self.deadline = end
                return self.rest is TRUE
        true = (key for key in self._atoms if holds_in(key, letter))
        self.rest = _progress(self.rest, frozenset(true) | self._past_of(letter, stamp), stamp)
        if size(self.rest) > MAX_SIZE:
            raise Unstamped(f"more than {MAX_SIZE:,} obligations are open at once")
        return None if self.rest not in (TRUE, FALSE) else self.rest is TRUE

    def _past_of(self, letter: Letter, stamp: Fraction) -> frozenset[str]:
        """The atoms that stand for past operators which hold now."""
        now: dict[Formula, bool] = {}
        self._count += 1
        for node in self._now:
            args = [now[a] for a in node.args]
            match node.op:
                case "true" | "false":
                    now[node] = node.op == "true"
                case "atom":
                    now[node] = holds_in(node.key, letter)
                case "Y" | "Z":
                    now[node] = self._before.get(node.args[0], node.op == "Z")
                case "O" | "S":
                    kept = len(args) == 1 or args[0]
                    now[node] = args[-1] or (kept and self._before.get(node, False))
                case "H" | "T":
                    freed = len(args) == 2 and args[0]
                    now[node] = args[-1] and (freed or self._before.get(node, True))
                case op if op in f.BOUNDED_PAST:
                    now[node] = self._within(node, args, stamp if op in f.TIMED else self._count)
                case _:
                    now[node] = CONNECTIVES[node.op](args)
        self._before = now
        return frozenset(key for node, key in self._names.items() if now[node])

    def _within(self, node: Formula, args: list[bool], here: Fraction | int) -> bool:
        """`keep S goal` with a bound, at this stamp or number of a letter; `O` keeps nothing, `H` and `T` are duals."""
        met, dual = self._met[node], node.op[0] in "HT"
        least, most = time_bound(node.key) if node.op in f.TIMED else step_bound(node)
        if len(args) == 2 and args[0] == dual:
            met.clear()
        if args[-1] != dual and not (most is None and met):  # without an end the first one is enough
            if not least:  # the last one is enough
                met.clear()
            met.append(here)
        while most is not None and met and met[0] < here - most:
            met.popleft()
        if len(met) > MOST_MET:
            raise Unstamped(f"more than {MOST_MET:,} rows lie in the window of a past operator")
        return bool(met and met[0] <= here - least) != dual


_NORMAL = Negations(
    lambda node, negative: f.negation(node) if negative else node,
    both,
    either,
    lambda op, args, key: apply(op, *args, bound=key) if key else temporal(op, *args),
)


def _is_window(node: Formula) -> bool:
    return node.op in f.TIMED and node.key.startswith("@")


@lru_cache(1 << 12)
def _window(node: Formula) -> tuple[Fraction | None, Fraction | None]:
    """The stamps of the first and the last letter that a window still looks at (None: any)."""
    low, _, high = node.key[1:].partition(":")
    return Fraction(low) if low else None, Fraction(high) if high else None


def _open(rest: Formula) -> list[Formula]:
    """The windows that the letters so far have opened."""
    return [node for node in postorder(rest) if _is_window(node)]


def _ended(rest: Formula, end: Fraction) -> Formula:
    """What is left where no letter up to `end` is to come any more."""
    done: dict[Formula, Formula] = {}
    for node in postorder(rest):
        high = _window(node)[1] if _is_window(node) else None
        if high is not None and high <= end:
            done[node] = FALSE if node.op in REACHING else TRUE
        elif node.op in ("and", "or"):
            done[node] = (both if node.op == "and" else either)(done[a] for a in node.args)
        else:
            done[node] = node
    return done[rest]


def _progress(rest: Formula, letter: Letter, stamp: Fraction) -> Formula:
    done: dict[Formula, Formula] = {}
    for node in postorder(rest):
        if node.op in f.TIMED:
            done[node] = _in_window(node, [done[a] for a in node.args], stamp)
        else:
            done[node] = progressed(node, letter, done)
            if node.op in ("and", "or"):
                done[node] = _merged(done[node])
    return _merged(done[rest])


def _in_window(node: Formula, args: list[Formula], stamp: Fraction) -> Formula:
    """A bound is met at this letter, or a window sees it."""
    if _is_window(node):
        low, high = _window(node)
    else:
        least, most = time_bound(node.key)
        low, high = stamp + least, None if most is None else stamp + most
    if high is not None and (high < stamp or (low is not None and high < low)):
        return FALSE if node.op in REACHING else TRUE
    is_open = low is None or low <= stamp
    same = _is_window(node) and (low is None or not is_open)
    rest = (
        node if same else apply(node.op, *node.args, bound=f"@{'' if is_open else low}:{'' if high is None else high}")
    )
    reaching, goal = node.op in REACHING, args[-1]
    if reaching:
        later = both((args[0], rest)) if len(args) == 2 else rest
        return either((goal, later)) if is_open else later
    later = either((args[0], rest)) if len(args) == 2 else rest
    return both((goal, later)) if is_open else later


@dataclass(slots=True)
class _Group:
    """Windows about the same, of which one decides for all."""

    kept: Formula
    high: Fraction | None


def _merged(rest: Formula) -> Formula:
    """Without windows that others make superfluous: of those that are open now, the one that ends first or last."""
    if rest.op not in ("and", "or"):
        return rest
    groups: dict[tuple[Op, tuple[Formula, ...]], _Group] = {}
    others: list[Formula] = []
    count = 0
    for node in rest.args:
        if not node.key.startswith("@:") or not _is_window(node):
            others.append(node)
            continue
        count += 1
        high = _window(node)[1]
        group = groups.setdefault((node.op, node.args), _Group(node, high))
        shorter = high is not None and (group.high is None or high < group.high)
        if shorter == ((node.op in REACHING) == (rest.op == "and")) and high != group.high:
            group.kept, group.high = node, high
    if count == len(groups):
        return rest
    parts: Iterable[Formula] = [*others, *(group.kept for group in groups.values())]
    return both(parts) if rest.op == "and" else either(parts)
