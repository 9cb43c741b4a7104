"""How late the reaction of an outside guard is at worst, in cycles of the watched arrangement and of the guard.

An outside guard is another process: in each of its cycles it looks at the frames that have come and, when one of them
breaks a rule, hands over commands. Nothing makes it as fast as the arrangement that it watches, so this is assumed: in
any `every` cycles of the watched arrangement it takes a whole look. Then, for a frame at the end of cycle c,

- the first whole look comes at the latest in cycle c + every, perhaps just before its end;
- a guard that needs several of its cycles to decide hands its commands over `every` cycles later for each;
- a command acts where the next cycle begins, and one command is taken in a cycle, so the j-th of them acts in the j-th
  cycle after that one;
- with several processes the cycle at whose beginning the command is taken may be that of another process, and the
  machine that is commanded has its turn in the round that begins then.

All of this is reached: `extensions/guards/outside.py` makes arrangements of it, in which the bound is proved, and
violated when it is less by one.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Pace:
    """What is assumed of an outside guard."""

    every: int = 1
    """In any so many cycles of the watched arrangement the guard takes a whole cycle of its own, a look."""
    looks: int = 1
    """Cycles of the guard from the one that sees the frame to the one that commands."""


@dataclass(frozen=True, slots=True)
class ReactionTime:
    """The worst reaction to a frame that breaks a rule."""

    cycles: int
    """Of the watched arrangement: so many frames after it at most, all commands have acted."""
    first: int
    """The same for the first of the commands."""
    looks: int
    """Cycles of the guard, from the one that sees the frame on."""

    def milliseconds(self, cycle_ms: int) -> int:
        """In logical time."""
        return self.cycles * cycle_ms


def reaction_time(pace: Pace, commands: int = 1, processes: int = 1) -> ReactionTime:
    """The worst reaction of a guard with so many commands, for an arrangement of so many processes, when no other
    commands wait and no frame is missed.
    """
    if min(pace.every, pace.looks, commands, processes) < 1:
        raise ValueError("all of these are at least 1")
    handed_over = pace.every * pace.looks
    others = processes - 1
    return ReactionTime(handed_over + commands + others, handed_over + 1 + others, pace.looks)


@dataclass(frozen=True, slots=True)
class Order:
    """An operator's command, or (`kind` None) a post of an input."""

    kind: str | None
    target: str
    value: str | None = None

    @property
    def text(self) -> str:
        """As users write it."""
        if self.kind is None:
            return f"{self.target} = {self.value}"
        return " ".join(part for part in (self.kind, self.target, self.value) if part is not None)

    @property
    def statement(self) -> str:
        """A command as a machine gives it."""
        assert self.kind is not None, "machines post no inputs"
        return f"{self.target} = {self.value};" if self.value is not None else f"{self.kind}({self.target});"
