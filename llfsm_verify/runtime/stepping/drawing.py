"""How a random run draws what is not given: inputs keep values for stretches, and some values come more often."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from random import Random
from typing import NamedTuple

from llfsm_verify.program.dependence import blocks
from llfsm_verify.program.program import Choice, Int, Program, Set
from llfsm_verify.program.trees import statements
from llfsm_verify.registry import meant
from llfsm_verify.semantics.operators import OPERATOR, is_command
from llfsm_verify.values import ValueProblem, choice_value
from llfsm_verify.yaml.duration import duration_ms, excess

FEWEST = 5
"""Cycles of a stretch by default, at least."""
LONGEST_MS = 60_000
"""Of a stretch by default, unless that is fewer cycles."""
MOST_CYCLES = 10**12 - 1
"""Of a stretch."""
ALL = (1 << 64) - 1
ROW = 3
"""Words of a choice in `table`, and of a piece."""


class DrawingError(ValueError):
    """A law is written wrongly; the message begins with the option."""


class Piece(NamedTuple):
    """Values of which each is as likely: from `low`, so many. Drawn where a random word is at most `until`."""

    until: int
    low: int
    size: int


@dataclass(frozen=True, slots=True)
class Drawing:
    """The law by which values are drawn.

    An input, and what a model of the surroundings chooses, keeps its value for `hold` cycles on average: it is drawn
    anew in a cycle with the probability 1 / `hold`. None: each is drawn whenever it may change. The age of an untimed
    state is always drawn anew. With `hold`, each command of an operator comes in a cycle with that probability.
    """

    hold: Fraction | None = None
    pieces: Mapping[str, tuple[Piece, ...]] = field(default_factory=dict)
    """By the name of an input: values that are not all as likely."""

    def change(self, parts: int) -> Fraction:
        """The probability of a new value in one of so many equal parts of a cycle."""
        return Fraction(1) if self.hold is None else min(Fraction(1), 1 / (self.hold * parts))

    def of(self, choice: Choice) -> tuple[Piece, ...]:
        """The pieces from which a choice is drawn; none: each of its values is as likely."""
        if choice.source in self.pieces or self.hold is None or not is_command(choice.name):
            return self.pieces.get(choice.source, ())
        return _pieces(choice, {1: self.change(1)})

    def holds(self, choice: Choice) -> bool:
        """Whether it keeps its value for stretches."""
        return self.hold is not None and choice.kind != "age" and not choice.name.startswith(OPERATOR)

    def drawn(self, choice: Choice, source: Random) -> int:
        """A new value."""
        pieces = self.of(choice)
        if not pieces:
            return source.randint(choice.type.low, choice.type.high)
        word = source.getrandbits(64)
        piece = next(piece for piece in pieces if word <= piece.until)
        return piece.low + source.randrange(piece.size)

    def table(self, choices: Sequence[Choice], represented: Sequence[int], parts: int) -> list[int]:
        """For machine code (`backends.native.loops`, draw), as words with a sign.

        For each choice its own number, that of the choice that represents it, or -1 (`represented`); up to which random
        word it keeps its value (0: never), and where its pieces begin (0: there are none). Then the pieces.
        """
        rows, tail = list[int](), list[int]()
        for choice, by in zip(choices, represented, strict=True):
            pieces = self.of(choice)
            at = ROW * len(choices) + len(tail) if pieces else 0
            rows += (by, int(ALL * (1 - self.change(parts))) if self.holds(choice) else 0, at)
            tail += [word for piece in pieces for word in piece]
        return [word - (1 << 64) if word >> 63 > 0 else word for word in rows + tail]


ANEW = Drawing()
"""Everything is drawn whenever it may change."""


class Draws:
    """The values that one run draws, part of a cycle after part (ringlets, or turns), by a law."""

    def __init__(self, how: Drawing, parts: int) -> None:
        self.how = how
        self._parts = parts
        self._change = float(how.change(parts))
        self.values: dict[str, int] = {}
        """What is held, by the names of users."""

    def next(self, choices: Sequence[Choice], source: Random) -> dict[str, int]:
        """Values for these choices, by name, in the next part of a cycle."""
        known: set[str] = set()
        found = {}
        for choice in choices:
            name = choice.source
            if not self.how.holds(choice):
                found[choice.name] = self.how.drawn(choice, source)
                continue
            if name not in known:
                known.add(name)
                if name not in self.values or source.random() < self._change:
                    self.values[name] = self.how.drawn(choice, source)
            found[choice.name] = self.values[name]
        return found

    def in_code(self, program: Program, source: Random) -> tuple[dict[str, int], list[int]]:
        """For machine code that goes on with the run: the values of choices now, and its table (none: of no use)."""
        if self.how == ANEW:
            return {}, []
        represented = representatives(
            program, {choice.name for choice in program.choices}, single=self.how.hold is None
        )
        return self.next(program.choices, source), self.how.table(program.choices, represented, self._parts)

    def note(self, choices: Sequence[Choice], values: Sequence[int]) -> None:
        """What machine code has drawn, as words with a sign."""
        for choice, value in zip(choices, values, strict=True):
            if self.how.holds(choice) and choice.source in self.values:
                self.values[choice.source] = value + (1 << 64) if value < choice.type.low else value


def free_inputs(program: Program) -> dict[str, Choice]:
    """The inputs that have any value at first and keep it (`changes: never` without `init`), as choices."""
    free = [(v, v.type) for v in program.vars if v.free and isinstance(v.type, Int)]
    return {v.name: Choice(v.name, kind, "input", v.name, v.origin.labels) for v, kind in free}


def free_values(
    program: Program, held: Mapping[str, str], law: Drawing = ANEW, seed: int | None = None
) -> dict[str, int]:
    """The values of `free_inputs` in a run: those of `held`, else drawn, else what `init` would be.

    The value of one depends on its name and the seed alone, and no other one on it. ValueProblem: see `choice_value`.
    """
    found = {v.name: v.init for v in program.vars if v.free and isinstance(v.init, int)}
    for name, choice in free_inputs(program).items():
        if name in held:
            found[name] = choice_value(choice, held[name])
        elif seed is not None:
            found[name] = law.drawn(choice, Random(f"{name} {seed}"))  # noqa: S311 - no secrets
    return found


def representatives(program: Program, names: set[str], *, single: bool = False) -> list[int]:
    """For each choice its own number where it is drawn, that of the first choice of the same input (unless `single`
    reads have values of their own), or -1."""
    first: dict[str, int] = {}
    represented = []
    for number, choice in enumerate(program.choices):
        if choice.name in names:
            represented.append(first.setdefault(choice.input, number) if choice.input and not single else number)
        else:
            represented.append(-1)
    return represented


# ---------------------------------------------------------------- as users write it


def default_hold(program: Program) -> Fraction:
    """Cycles of a stretch by default: as the longest timer of the arrangement, at least `FEWEST` and
    (unless these are more) at most `LONGEST_MS`."""
    clocks = [v.type.high for v in program.vars if v.name.endswith(".$clock") and isinstance(v.type, Int)]
    if program.period is None or not clocks:
        return Fraction(FEWEST)
    return max(Fraction(FEWEST), min(Fraction(max(clocks)), LONGEST_MS / program.period))


def hold_of(text: str, program: Program) -> Fraction | None:
    """Cycles of a stretch: ``5s``, ``20cycles``, or ``none``. ValueError."""
    if text == "none":
        return None
    count = re.fullmatch(r"0*([1-9][0-9]*) ?cycles?", text, re.ASCII)
    if count and len(count[1]) > len(str(MOST_CYCLES)):
        raise ValueError(f"`{text[:40]}` is more than the largest number of cycles, {MOST_CYCLES:,}")
    if count:
        return Fraction(int(count[1]))
    time = duration_ms(text) if text[-1:].isalpha() else None
    if time is None:
        usual = f"`{text[:40]}` is neither a time such as 5s, a number of cycles such as 20cycles, nor `none`"
        raise ValueError(excess(text) or usual)
    if program.period is None:
        raise ValueError(f"`{text[:40]}` is a time, and the arrangement is untimed: write cycles, such as 20cycles")
    return time / program.period


def drawing_of(program: Program, hold: str | None, draw: Mapping[str, str], given: Collection[str] = ()) -> Drawing:
    """The law as users write it.

    `draw` has for an input the probability that it is true (``0.02``), or those of values (``3:0.1,4:0.2``); the others
    are as likely as each other. `given`: inputs that are not drawn. DrawingError.
    """
    what = "hold"
    try:
        cycles = default_hold(program) if hold is None else hold_of(str(hold).strip(), program)
        what = "draw"
        return Drawing(cycles, {name: _pieces(*_weights(program, name, draw[name], given)) for name in draw})
    except (ValueError, ValueProblem) as wrong:
        raise DrawingError(f"{what} {wrong}") from None


def _weights(program: Program, name: str, text: str, given: Collection[str]) -> tuple[Choice, dict[int, Fraction]]:
    choices = drawable(program) | free_inputs(program)
    if name not in choices:
        raise ValueError(unknown_input(program, name))
    if name in given:
        raise ValueError(f"`{name}` has a value, so it is not drawn")
    choice, weights = choices[name], dict[int, Fraction]()
    if ":" not in text:
        if not choice.type.boolean:
            raise ValueError(f"`{name}` is not true or false: write {name}=VALUE:PROBABILITY")
        text = f"true:{text}"
    for part in text.split(","):
        word, _, weight = (piece.strip() for piece in part.partition(":"))
        try:
            value, found = (
                choice_value(choice, word),
                Fraction(weight if re.fullmatch(r"[0-9.]{1,30}(e-[0-9]{1,2})?", weight) else -1),
            )
        except ValueError:
            found = Fraction(-1)
        except ValueProblem as problem:
            raise ValueError(f"{name}: {problem}") from None
        if not 0 <= found <= 1:
            raise ValueError(f"{name}: `{weight[:40]}` is not a probability, a number from 0 to 1")
        if value in weights:
            raise ValueError(f"{name}: the value `{word}` is given twice")
        weights[value] = found
    total = sum(weights.values())
    if total > 1 or (len(weights) > choice.type.high - choice.type.low and total != 1):
        raise ValueError(f"{name}: its probabilities add up to {float(total):g}, not to 1")
    return choice, weights


def _pieces(choice: Choice, weights: Mapping[int, Fraction]) -> tuple[Piece, ...]:
    """The values of `weights` by themselves, and the ranges between them, which share what is left."""
    low, high = choice.type.low, choice.type.high
    rest, others = 1 - sum(weights.values(), Fraction(0)), high - low + 1 - len(weights)
    spans = [(value, 1, weight) for value, weight in weights.items()]
    for value in [*sorted(weights), high + 1]:
        if value > low:
            spans.append((low, value - low, rest * (value - low) / others))
        low = value + 1
    found, total = list[Piece](), Fraction(0)
    for first, size, weight in spans:
        total += weight
        if weight:
            found.append(Piece(int(total * (ALL + 1)) - 1, first, size))
    return tuple(found)


def drawable(program: Program) -> dict[str, Choice]:
    """By the names of users: what a step may choose, but the ages of untimed states."""
    return {choice.source: choice for choice in program.choices if choice.kind != "age"}


def unknown_input(program: Program, name: str) -> str:
    """What is said of a name that is not that of an input, or of one that has its value already."""
    free = free_inputs(program)
    choices = drawable(program) | free
    if name in free:
        return f"`{name}` never changes while it runs: set it for the whole run"
    if any(v.name == name and v.origin.kind == "input" for v in program.vars):
        sets = (s for block, _ in blocks(program) for s in statements(block) if isinstance(s, Set))
        if all(s.var != name for s in sets):
            return f"`{name}` never changes: it has its `init` throughout"
        chosen = ", ".join(c.name for c in program.choices if c.kind == "choose")
        can = f"; what it chooses can be set: {chosen}" if chosen else ""
        return f"`{name}` is written by the model of the surroundings{can}"
    known = ", ".join(choices) or "none that a step reads"
    return f"`{name}` is not an input of the arrangement; inputs: {known}{meant(name, choices)}"
