"""The plug for engines: what an engine is asked, and what it answers.

An engine is a `Session`, made for one problem. The harness (`verification/harness.py`) owns all that engines have in
common: limits, Ctrl-C, memory, the replay and confirmation of every run that an engine gives, vacuity, witnesses, more
counterexamples, and the result. docs/decisions/0028-engine-plug.md says why it is cut like this.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from llfsm_verify.automata.omega.moves import Lazy
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.checking.goals.goal import Goal
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Letter, Schedule
from llfsm_verify.checking.verdict import Exploration, Options
from llfsm_verify.limits import Budget

if TYPE_CHECKING:
    from llfsm_verify.checking.verdict import Proof


@dataclass(frozen=True, slots=True)
class Violated:
    """A run that violates a goal, or that ends in a fault. It counts only after the executor has performed it.

    Without a loop in its schedule the run is a bad prefix of the goal; under assumptions there has to be a loop.
    """

    schedule: Schedule
    letters: tuple[Letter, ...] | None = None
    """The letters that the engine saw in one pass of the schedule, without the first one, which no step shows: the
    executor must show the same. None: they are not compared."""
    recurs: bool = True
    """The loop's configuration comes back after one pass. False: it may do so late, because the engine left variables
    out."""


@dataclass(frozen=True, slots=True)
class Holds:
    """No run violates the goal."""

    proofs: tuple[Proof, ...] = ()


@dataclass(frozen=True, slots=True)
class Unknown:
    """`reason`: why it is not known, as a sentence without its full stop."""

    reason: str
    refuted: bool = False
    """The engine says that the goal is violated, but has no run to show."""


Answer = Violated | Holds | Unknown


@dataclass(frozen=True, slots=True)
class Excluded:
    """Violations that are not wanted, told apart by the goal's atoms and the atoms `names` after them.

    `prefixes` makes of the goal's monitor that of the wanted bad prefixes, `runs` (of its monitor, if there are bad
    prefixes at all) the automaton of the wanted infinite runs, which have no bad prefix.
    """

    names: tuple[str, ...]
    prefixes: Callable[[PrefixMonitor], PrefixMonitor]
    runs: Callable[[PrefixMonitor | None], Lazy]


class Explored(Protocol):
    """A state space that was explored, for questions beside the verdicts. Each question may raise LimitReached."""

    @property
    def names(self) -> Sequence[str]:
        """The atoms that letters show, by their bits."""
        ...

    @property
    def masks(self) -> Sequence[int]:
        """Every letter that some configuration shows, in increasing order."""
        ...

    def violates(self, goal: Goal, *, assuming: bool = True) -> bool:
        """Whether some run of the space violates another goal over the same atoms; `assuming` False: one that may
        violate the assumptions as well. AutomatonTooLarge."""
        ...

    def find(self, goal: Goal, excluded: Excluded | None = None) -> Violated | None:
        """A violation of any goal over the same atoms that is not excluded; None: there is none in what was explored.
        AutomatonTooLarge."""
        ...

    def escape(self) -> Violated | None:
        """A shortest run, without a loop, to where the arrangement escapes its assumptions, where some run meets them;
        None: there is none. AutomatonTooLarge."""
        ...

    @property
    def unfinished(self) -> str | None:
        """Why there may be more than was explored; None: there is no more."""
        ...

    def close(self) -> None:
        """Give its memory back."""
        ...


@dataclass(slots=True)
class Given:
    """What a session is made for. `goals` are those of the problem's properties, in their order."""

    problem: Problem
    goals: Sequence[Goal]
    options: Options
    budget: Budget
    """In force while any method of the session runs."""
    found: Callable[[Goal | None], None] = lambda _: None
    """May be called in `search` when a goal, or faults (None), has an answer already: who waits is told of it."""


class Session(ABC):
    """One engine at work on one problem.

    The harness calls `search`, then `ended`, then asks for answers, and at last calls `close`. Only `search`,
    `answers`, `fault_runs` and `faults` must be written; the rest says that the engine can do no more than that.
    """

    asks_again: bool = False
    """Goals that are stronger than those that hold may be put to a new session, with little `Options.effort`, to see
    whether they hold vacuously."""

    @abstractmethod
    def search(self) -> None:
        """Work until all is answered that the engine can answer.

        LimitReached, MemoryError and KeyboardInterrupt may end it at any point: they are let through. Long loops call
        `limits.tick()`, which raises when the budget is used up.
        """

    def ended(self, why: str | None) -> None:  # noqa: B027 - an engine need not do anything
        """The search has ended: by itself (None), or by a limit or Ctrl-C, which `why` names."""

    @abstractmethod
    def answers(self, goal: Goal) -> Iterable[Answer]:
        """What is known of a goal: runs that violate it, those first that are preferred, and what is to be said where
        none of them is confirmed. At least one answer; after a `Holds` or `Unknown` nothing more is asked for."""

    def length(self, goal: Goal | None) -> int | None:
        """About how many steps a run has that violates a goal, or faults (None), where one was found that takes time to
        be made. After a time limit short ones are asked for first, and what is not given is said to be found."""
        del goal
        return None

    @abstractmethod
    def fault_runs(self) -> Iterable[tuple[int, Violated]]:
        """Runs that end in a fault, with its number in the program, those of one fault that are preferred first."""

    @abstractmethod
    def faults(self) -> Holds | Unknown:
        """What is known of faults where no run ends in one that was confirmed."""

    def possible(self) -> bool | None:
        """Whether some run satisfies the assumptions, where there are any; None: that is not known."""
        return None

    def explored(self) -> Explored | None:
        """The whole space, where it was explored to its end, and so decides what holds; None: it was not."""
        return None

    def watching(self, problem: Problem, nodes: int) -> Explored | None:
        """A space whose letters show the atoms of `problem`, which has more of them, up to so many configurations;
        None: the engine explores none."""
        del problem, nodes
        return None

    def count(self) -> None:  # noqa: B027
        """Count what verdicts do not need. KeyboardInterrupt ends it."""

    def exploration(self) -> Exploration:
        """What was explored."""
        return Exploration()

    def pulse(self) -> None:  # noqa: B027
        """Called now and then in long work, for signs of life."""

    def blamed(self, error: Exception) -> Exception | None:
        """What to raise in place of an exception that says that this check contradicts itself; None: the exception."""
        del error
        return None

    def close(self) -> None:  # noqa: B027
        """Give memory and files back."""


Start = Callable[[Given], Session]
"""Makes a session. DiagnosticError: what the user asked for cannot be done."""
