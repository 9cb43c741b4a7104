"""Which inputs are split into classes where, and what represents each class.

Where the classes depend on variables, these ways are tried in order: a table for each valuation, if there are few;
expressions such as the bound of a comparison, if Z3 proves that they represent every outcome whatever the variables
are; a table for more valuations; a table for those that can be reached (`labels.reaching`). Else the input is
enumerated.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import product
from math import prod

from llfsm_verify.backends.broken import BrokenProgramError
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.backends.smt.classes import Class, Group
from llfsm_verify.backends.smt.relation import Terms
from llfsm_verify.backends.smt.solver import GaveUp, SolverBudget
from llfsm_verify.kripke.labels.candidates import candidates, suggest
from llfsm_verify.kripke.labels.sizes import WIDE, is_wide, size
from llfsm_verify.program.labelling import Classes, Plan
from llfsm_verify.program.outcomes import (
    PREFIX,
    Place,
    TermTooLarge,
    Touched,
    outcome,
    places,
    possible_values,
    sampled_in,
)
from llfsm_verify.program.program import BOOL, Choice, Const, Expr, Get, Local, Program
from llfsm_verify.program.trees import nodes, rebuilt

MOST_CLASSES, MOST_JOINT = 256, 64
"""Classes of one input, and of several together, at one place and for one valuation of the variables."""
WORTH = 4
"""So many times as many values as classes are to be there: else it is less work to try them all."""
FEW_VALUES = 1_024
"""Valuations of a group up to which it is counted what they tell apart, before the solver is asked."""
MOST_ROWS = 1_024
"""Representatives in one table."""
FEW_VALUATIONS, MOST_VALUATIONS = 8, 256
"""Valuations of variables for each of which a table is made: before, and after representatives that are expressions."""


@dataclass(frozen=True, slots=True)
class Split:
    """A group of choices at a place, with the terms that its classes come from."""

    place: Place
    choices: tuple[Choice, ...]
    touched: tuple[Touched, ...]
    keys: tuple[Get, ...]

    @property
    def asked(self) -> tuple[Expr, ...]:
        return tuple(dict.fromkeys(t.term for t in self.touched))

    @property
    def names(self) -> frozenset[str]:
        return frozenset(c.name for c in self.choices)


@dataclass(slots=True)
class Decided:
    """What is known of the groups of a program."""

    classes: dict[Split, Classes] = field(default_factory=dict)
    open: list[Split] = field(default_factory=list)
    """Those whose classes depend on variables in a way that only reachable valuations settle."""
    refused: list[tuple[Place, tuple[Choice, ...], str]] = field(default_factory=list)
    """Choices that are enumerated at a place, with the reason."""

    def plan(self) -> Plan:
        found: dict[Place, dict[str, Classes]] = {}
        for split, classes in self.classes.items():
            found.setdefault(split.place, {}).update(dict.fromkeys(split.names, classes))
        return found


def filled_in(e: Expr, values: Mapping[Get, int]) -> Expr | None:
    """The value in place of a variable."""
    return Const(values[e], e.type) if isinstance(e, Get) else None


def most_classes(choices: Sequence[Choice]) -> int:
    """The classes that a group may have."""
    most = MOST_CLASSES if len(choices) == 1 else MOST_JOINT
    return min(most, max(WIDE, prod(map(size, choices)) // WORTH))


class Planner:
    """Splits the wide choices of one program; `check` is called while the solver works, and may raise to stop."""

    def __init__(self, program: Program, check: Callable[[], None]) -> None:
        self.program = program
        self._check = check
        self._terms = Terms(program)
        self._choices = {c.name: c for c in program.choices}
        self._possible = possible_values(program, MOST_VALUATIONS)
        self._inits = {v.name: v.init for v in program.vars}
        self._known: dict[tuple[object, ...], list[Class] | None] = {}
        self._effort = SolverBudget()

    @contextmanager
    def spending(self, most: int | None) -> Iterator[None]:
        """Within, the solver does `most` units of work in all (None: as many as it needs). LimitReached beyond."""
        self._effort = SolverBudget(most)
        try:
            yield
        finally:
            self._effort = SolverBudget()

    # ------------------------------------------------------------ groups

    def decide(self) -> Decided:
        """The classes of all groups that have some, but for those that are left open. Raises what `check` does."""
        decided = Decided()
        self._prologues(decided)
        letters = dict.fromkeys(c for p, block in places(self.program) if p.slot is None for c in sampled_in(block))
        for place, block in places(self.program):
            own = sampled_in(block)
            read = own if place.slot is None else (*own, *letters)
            if not own or not any(is_wide(self._choices[c]) for c in read):
                continue
            try:
                touched = outcome(self.program, place)
            except TermTooLarge:
                taken = tuple(self._choices[c] for c in dict.fromkeys((*own, *letters)))
                decided.refused.append((place, taken, "what depends on it is too large"))
                continue
            for split in self._groups(place, own, touched):
                self._decide(split, decided, letters)
        self._spare_letters(decided)
        return decided

    def _prologues(self, decided: Decided) -> None:
        """Inputs that are stored before a machine's turn (``changes: cycle``)."""
        for index, slot in enumerate(self.program.slots):
            for name in sampled_in(slot.prologue):
                if is_wide(self._choices[name]):
                    why = "it is stored (it changes with the cycle, or the profile's snapshot is one for all machines)"
                    decided.refused.append((Place(index, 0), (self._choices[name],), why))

    def _groups(self, place: Place, own: Sequence[str], touched: Sequence[Touched]) -> Iterator[Split]:
        """Choices that meet in a term are one group; those with a wide choice that is sampled here."""
        group_of: dict[str, frozenset[str]] = {c: frozenset((c,)) for c in own}
        for t in touched:
            joined = frozenset().union(*(group_of.get(c, frozenset((c,))) for c in t.choices))
            group_of |= dict.fromkeys(joined, joined)
        order = {name: i for i, name in enumerate(own)}
        for group in dict.fromkeys(group_of[c] for c in own):
            members = sorted((self._choices[c] for c in group), key=lambda c: (order.get(c.name, len(order)), c.name))
            if any(map(is_wide, members)):
                mine = tuple(t for t in touched if t.choices & group)
                keys = {n for t in mine for n in t.variables}
                yield Split(place, tuple(members), mine, tuple(sorted(keys, key=lambda g: (g.var, repr(g.index)))))

    def _decide(self, split: Split, decided: Decided, letters: Mapping[str, None]) -> None:
        """Find the classes of a group, or why it has none, or leave it open."""
        told = split.place.slot is not None and self.program.observe == "cycle" and split.names & letters.keys()
        why: str | None = "a letter that comes later asks for it" if told else self._refusal(split)
        try:
            if why is None:
                found = self._classes(split)
                if found is not None:
                    decided.classes[split] = found
                elif split.keys:
                    decided.open.append(split)
                else:
                    why = f"more than {most_classes(split.choices):,} classes are told apart"
        except GaveUp as gave_up:
            why = str(gave_up)
        if why is not None:
            decided.refused.append((split.place, split.choices, why))

    def _refusal(self, split: Split) -> str | None:
        """What speaks against classes at first sight."""
        if any(c.kind == "age" for c in split.choices):
            return "it is compared with a clock"
        for t in split.touched:
            if isinstance(t.term, Local) and t.term.type != BOOL and is_wide(self._choice(t.term)):
                if "$sampled." in t.into:
                    return "a property asks for the value that was sampled last"
                if t.into.startswith("$before."):
                    return "a property asks whether it has changed"
                if "$" in t.into:
                    return "it is kept for the next `on_entry` (the profile's snapshot comes after that)"
                return f"it is stored in `{t.into}`" if t.into else "its value is kept for a letter that comes later"
        if self._is_diverse(split):
            return f"more than {most_classes(split.choices):,} classes are told apart"
        return None

    def _choice(self, local: Local) -> Choice:
        return self._choices[local.name.removeprefix(PREFIX)]

    def _is_diverse(self, split: Split) -> bool:
        """Values alone show more classes than there may be."""
        if prod(map(size, split.choices)) > FEW_VALUES:
            return self._are_numbers_diverse(split)
        seen: set[tuple[int, ...]] = set()
        for values in product(*(range(c.type.low, c.type.high + 1) for c in split.choices)):
            given = {PREFIX + c.name: value for c, value in zip(split.choices, values, strict=True)}
            try:
                seen.add(tuple(evaluate(e, self._inits, given) for e in split.asked))
            except (OverflowError, BrokenProgramError):
                continue
            if len(seen) > most_classes(split.choices):
                return True
        return False

    def _are_numbers_diverse(self, split: Split) -> bool:
        """Some values alone show more classes than there may be; of numbers that mention no variable.

        Conditions hardly ever do, and trying so many values takes longer than finding their classes.
        """
        numbers = (e for e in split.asked if e.type != BOOL)
        asked = [e for e in numbers if not any(isinstance(n, Get) for n in nodes(e))]
        if not asked:
            return False
        for choice in split.choices:
            low, count = choice.type.low, size(choice)
            stride = max(1, count // (2 * MOST_CLASSES))
            lows = {PREFIX + c.name: c.type.low for c in split.choices}
            for tried in (range(low, low + min(count, 2 * MOST_CLASSES)), range(low, low + count, stride)):
                seen: set[tuple[int, ...]] = set()
                for value in tried:
                    given = lows | {PREFIX + choice.name: value}
                    try:
                        seen.add(tuple(evaluate(e, {}, given) for e in asked))
                    except OverflowError:
                        continue
                if len(seen) > most_classes(split.choices):
                    return True
        return False

    # ------------------------------------------------------------ classes

    def group(self, split: Split) -> Group:
        """The group, for questions about its labels."""
        return Group(self._terms, split.choices, split.asked, self._check, self._effort)

    def _classes(self, split: Split) -> Classes | None:
        values = [self._possible.get(k.var) for k in split.keys]
        known = [v for v in values if v is not None]
        count = prod(map(len, known)) if len(known) == len(values) else None
        if count is None or count > FEW_VALUATIONS:
            found = self._expressions(split)
            if found is not None or count is None or count > MOST_VALUATIONS:
                return found
        return self.table(split, list(product(*known)), partial=False)

    def table(self, split: Split, valuations: Sequence[tuple[int, ...]], *, partial: bool) -> Classes | None:
        """Classes by valuation; None: there are too many for one of them. Raises GaveUp."""
        rows: dict[tuple[int, ...], tuple[tuple[int, ...], ...]] = {}
        for valuation in valuations:
            found = self.classes(split, valuation)
            if found is None:
                return None
            rows[valuation] = tuple(c.member for c in found)
            if sum(map(len, rows.values())) > MOST_ROWS:
                return None
        return Classes(self._name(split), split.choices, split.keys, rows, partial=partial)

    def classes(self, split: Split, valuation: tuple[int, ...]) -> list[Class] | None:
        """The classes of one valuation of the keys; None: there are too many. Raises GaveUp."""
        known = split.choices, split.asked, valuation
        if known not in self._known:
            self._check()
            variables = dict(zip(split.keys, valuation, strict=True))
            guessed = self._guessed(split, variables) if len(split.choices) == 1 else []
            self._known[known] = self.group(split).classes(variables, most_classes(split.choices), guessed)
        return self._known[known]

    def _guessed(self, split: Split, variables: Mapping[Get, int]) -> list[int]:
        """Values at which classes may begin."""
        filled = [rebuilt(e, lambda n: filled_in(n, variables)) for e in split.asked]
        found: list[int] = []
        for e in suggest(split.choices[0], filled):
            try:
                found.append(evaluate(e, {}, {}))
            except OverflowError:
                continue  # no class begins outside of 64 bits
        return found

    def class_of(self, split: Split, valuation: tuple[int, ...], member: tuple[int, ...]) -> Class:
        """The class of a valuation of the group's choices. Raises GaveUp; KeyError when the classes are too many."""
        group = self.group(split)
        for found in self.classes(split, valuation) or []:
            if found.member == member or group.has(found.label, member):
                return found
        raise KeyError(member)

    def _expressions(self, split: Split) -> Classes | None:
        if len(split.choices) > 1:
            return None
        free = replace(split, touched=tuple(t for t in split.touched if not t.variables), keys=())
        fixed = self.classes(free, ())
        if fixed is None:
            return None
        made = candidates(split.choices[0], split.asked, [c.member[0] for c in fixed])
        if made is None or not self.group(split).suffices(made):
            return None
        return Classes(self._name(split), split.choices, split.keys, candidates=made)

    def _name(self, split: Split) -> str:
        slot, state = split.place.slot, split.place.state
        where = f"letter{state}" if slot is None else f"{slot}.{state}"
        return f"{'+'.join(c.name for c in split.choices)}~{where}"

    # ------------------------------------------------------------ letters

    def _spare_letters(self, decided: Decided) -> None:
        """What a block enumerates, the letter after it must not split with others: it cannot know the value."""
        poisoned = {c.name for place, choices, _ in decided.refused if place.slot is not None for c in choices}
        for split in [*decided.classes, *decided.open]:
            if split.place.slot is None and split.names & poisoned:
                self.refuse(split, decided, "a ringlet that is followed by this letter tries all its values")

    def refuse(self, split: Split, decided: Decided, why: str) -> None:
        """Enumerate a group after all, and letters that depend on it."""
        decided.classes.pop(split, None)
        if split in decided.open:
            decided.open.remove(split)
        decided.refused.append((split.place, split.choices, why))
        if split.place.slot is not None:
            self._spare_letters(decided)

    def valuation(self, keys: Sequence[Get], variables: Mapping[str, object]) -> tuple[int, ...]:
        """The values of keys."""
        return tuple(evaluate(k, variables, {}) for k in keys)  # type: ignore[arg-type]
