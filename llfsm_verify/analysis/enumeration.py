"""More counterexamples to the same property, each of which takes another path than all before.

The signature of a run is the order in which transitions fire for the first time. The tree of the signatures found is
run beside a property: as a monitor of new bad prefixes, and for infinite runs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.analysis.explanation.explain import explain
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.safety import PrefixMonitor
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.engine import Excluded, Explored, Session
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.replayer import Replayer
from llfsm_verify.checking.trace import Trace
from llfsm_verify.checking.verdict import Options, PropertyResult
from llfsm_verify.diagnostics import Disagreement
from llfsm_verify.language.expressions import BOOL
from llfsm_verify.language.typed import Observe
from llfsm_verify.limits import LimitReached, check_time
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.transforms.cone import cone

Transition = tuple[str, str]
"""A machine, and a transition as traces write it: ``RED -> GREEN when car``."""
Signature = tuple[Transition, ...]

PREFIX = HIDDEN + "fired:"
"""The keys of the atoms that tell which transition fired start so."""


@dataclass(frozen=True, slots=True)
class Firing:
    """The atom `key` holds in a letter when this transition fired in the step, or cycle, before it."""

    key: str
    machine: str
    state: int
    number: int
    transition: Transition


def firings(program: Program) -> list[Firing]:
    """Every transition of a program, in the order of turns."""
    found: list[Firing] = []
    for slot in program.slots:
        info = program.machines[slot.machine]
        for state, row in enumerate(info.transitions):
            for number in range(len(row)):
                key = f"{PREFIX}{info.name}.{state}.{number}"
                transition = info.name, info.transition_text(state, number)
                found.append(Firing(key, info.name, state, number, transition))
    return found


def observe(firing: Firing, program: Program) -> Observed | None:
    """The state formula of a firing; None: the transition has no text, since it is not the user's."""
    info = next(m for m in program.machines if m.name == firing.machine)
    span = info.transitions[firing.state][firing.number].span
    if span is None:
        return None
    return Observed(firing.key, Observe("fired", firing.machine, firing.state, firing.number, BOOL, span))


def signature_of(trace: Trace, machines: Iterable[str]) -> Signature:
    """The transitions of these machines that fire in a trace until the property has failed, each where it is first."""
    kept = set(machines)
    steps = trace.steps if trace.failed_at is None else trace.steps[: trace.failed_at]
    fired = ((s.machine, s.fired) for s in steps if s.machine in kept)
    return tuple(dict.fromkeys((m, text) for m, text in fired if m is not None and text is not None))


class Tree:
    """The signatures found so far, as a tree; a run goes through it until it differs from all of them.

    Letters are masks over the firings given. States are numbers: ROOT at the start, AWAY from then on.
    """

    ROOT, AWAY = 0, 1

    def __init__(self, transitions: Sequence[Transition], found: Iterable[Signature]) -> None:
        numbers: dict[Transition, int] = {}
        self._of_bit = [numbers.setdefault(t, len(numbers)) for t in transitions]
        self._children: list[dict[int, int]] = [{}, {}]
        self._fired: list[frozenset[int]] = [frozenset(), frozenset()]
        self.ends: set[int] = set()
        """The states in which a run that ends has a signature that was found."""
        for signature in found:
            state = self.ROOT
            for transition in signature:
                state = self._child(state, numbers[transition])
            self.ends.add(state)

    def _child(self, state: int, number: int) -> int:
        children = self._children[state]
        if number not in children:
            children[number] = len(self._children)
            self._children.append({})
            self._fired.append(self._fired[state] | {number})
        return children[number]

    def after(self, state: int, fired: int) -> int:
        """The state after a letter."""
        for bit, number in enumerate(self._of_bit):
            if state == self.AWAY:
                break
            if fired >> bit & 1 and number not in self._fired[state]:
                state = self._children[state].get(number, self.AWAY)
        return state

    def is_new(self, state: int) -> bool:
        """Whether a run that ends in this state has another signature than those found."""
        return state not in self.ends


class NewPrefixes:
    """A monitor of the bad prefixes of another one whose signature is new. Protocol `automata.safety.PrefixMonitor`.

    The low `bits` bits of letters are those of the property, the others tell what fired. A bad prefix with a signature
    that was found before leads to a state in which nothing is new any more: the first failure counts.
    """

    OLD = 0

    def __init__(self, monitor: PrefixMonitor, bits: int, tree: Tree) -> None:
        self._monitor = monitor
        self._bits = bits
        self._tree = tree
        self._pairs: list[tuple[int, int]] = [(-1, -1)]
        self._numbers: dict[tuple[int, int], int] = {}

    def initial(self) -> int | None:
        """The state before the first letter; None: the empty word is a bad prefix, and new."""
        state = self._monitor.initial()
        if state is None:
            return None if self._tree.is_new(Tree.ROOT) else self.OLD
        return self._number(state, Tree.ROOT)

    def step(self, state: int, letter: int) -> int | None:
        """The state after `letter`; None: a new bad prefix."""
        if state == self.OLD:
            return self.OLD
        watching, place = self._pairs[state]
        place = self._tree.after(place, letter >> self._bits)
        following = self._monitor.step(watching, letter & ((1 << self._bits) - 1))
        if following is None:
            return None if self._tree.is_new(place) else self.OLD
        return self._number(following, place)

    def _number(self, state: int, place: int) -> int:
        number = self._numbers.setdefault((state, place), len(self._pairs))
        if number == len(self._pairs):
            self._pairs.append((state, place))
        return number


class NewRuns:
    """The automaton of the infinite runs that are new (`automata.omega.moves.Lazy`): no beginning of them is a bad
    prefix of the monitor (those are looked for by themselves), and their signature is not among those found.

    Letters are those of `NewPrefixes`. Transitions fire for the first time finitely often, so a run stays in one state
    of the tree in the end.
    """

    acceptance_sets = 1

    def __init__(self, monitor: PrefixMonitor | None, bits: int, firings: int, tree: Tree) -> None:
        """`monitor` None: there are no bad prefixes. `bits` of the property and `firings` bits make a letter."""
        self._monitor = monitor
        self._bits = bits
        self._tree = tree
        first = 0 if monitor is None else monitor.initial()
        self.is_empty = first is None
        self._pairs: list[tuple[int, int]] = [(first or 0, Tree.ROOT)]
        self._numbers = {self._pairs[0]: 0}
        self.relevant = (1 << bits + firings) - 1

    def __call__(self, state: int, letter: int) -> tuple[tuple[int, int], ...]:
        """(acceptance, target) of the one move, if there is one."""
        watching, place = self._pairs[state]
        if self._monitor is not None:
            following = self._monitor.step(watching, letter & ((1 << self._bits) - 1))
            if following is None:
                return ()
            watching = following
        place = self._tree.after(place, letter >> self._bits)
        pair = (watching, place)
        number = self._numbers.setdefault(pair, len(self._pairs))
        if number == len(self._pairs):
            self._pairs.append(pair)
        return ((int(self._tree.is_new(place)), number),)


MOST_NODES = 1_000_000
"""Nodes of the graph in which other counterexamples are looked for."""
NO_MORE = "in every other run that violates it the transitions fire for the first time in one of these orders"


class Others:
    """Looks for other counterexamples, in a space of its own whose letters also tell which transitions fired."""

    def __init__(self, problem: Problem, options: Options, session: Session) -> None:
        """`session`: whose engine explores that space."""
        self._problem = problem
        self._assumed = [claim_of(p, problem.clock) for p in problem.assumptions]
        program = problem.program(keep_all_bits=options.keep_all_bits)
        self._firings: list[Firing] = []
        atoms = list(problem.atoms)
        for firing in firings(program):
            atom = observe(firing, program)
            if atom is not None:
                self._firings.append(firing)
                atoms.append(atom)
        wide = replace(problem, atoms=tuple(atoms))
        self._explored = session.watching(wide, MOST_NODES)
        self._replayer = Replayer(wide)

    def of(self, result: PropertyResult, goal: Goal, wanted: int) -> PropertyResult:
        """`result`, which has a trace, with up to `wanted` traces in all, and why there are no more."""
        assert result.trace is not None
        if self._explored is None:
            return replace(result, only=f"the engine {result.engine} looks for one only")
        machines = self._machines(goal)
        mine = [f for f in self._firings if f.machine in machines]
        traces = [result.trace]
        only: str | None = None
        try:
            while len(traces) < wanted:
                check_time()
                found = {signature_of(trace, machines): None for trace in traces}
                other = self._next(self._explored, goal, mine, list(found))
                if other is None:
                    only = self._explored.unfinished or NO_MORE
                    break
                if signature_of(other, machines) in found:
                    raise Disagreement(f"property {result.name}: a counterexample is not as different as it was found")
                traces.append(other)
        except (LimitReached, AutomatonTooLarge, Unconfirmed, MemoryError) as limit:
            only = str(limit) or "the memory ran out"
        return replace(result, more=tuple(traces[1:]), only=only)

    def _next(self, explored: Explored, goal: Goal, mine: list[Firing], found: list[Signature]) -> Trace | None:
        tree = Tree([f.transition for f in mine], found)
        keys = tuple(f.key for f in mine)
        bits = len(goal.atoms)
        excluded = Excluded(keys, lambda m: NewPrefixes(m, bits, tree), lambda m: NewRuns(m, bits, len(keys), tree))
        run = explored.find(goal, excluded)
        if run is None:
            return None
        return explain(self._replayer.violation(goal, run), goal, self._problem)

    def _machines(self, goal: Goal) -> frozenset[str]:
        """The machines that a property and the assumptions depend on."""
        read = {*goal.atoms, *(name for claim in self._assumed for name in claim.atoms)}
        program = replace(self._problem, atoms=tuple(a for a in self._problem.atoms if a.name in read)).program()
        left_out = set(cone(program).left_out)
        return frozenset(m.name for m in program.machines if m.name not in left_out)

    def close(self) -> None:
        """Give the memory of the space back."""
        if self._explored is not None:
            self._explored.close()
