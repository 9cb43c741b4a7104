"""A solver on single turns and short runs: outcomes that no turn can have, from whatever values inside the declared
ranges, and outcomes that an exploration has no time to show, where inputs or numbers are wide.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import z3

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.smt.arithmetic import BitVectors, truth
from llfsm_verify.backends.smt.relation import NumberTooLarge, Relation, Terms
from llfsm_verify.backends.smt.unrolling import Unrolling
from llfsm_verify.checking.replay.confirm import Schedule
from llfsm_verify.engines.unrolled.question import Exhausted, Question, schedule_of
from llfsm_verify.limits import Budget, LimitReached
from llfsm_verify.program.program import MachineInfo
from llfsm_verify.semantics.probes import DEAD, Outcome, Probe
from llfsm_verify.transforms.probing import Probed
from llfsm_verify.values import Value

EFFORT = 3_000_000
"""Z3's resource units for one question: some seconds, and the same on every computer."""


@dataclass(frozen=True, slots=True)
class Situation:
    """A configuration before a turn, and the choices that the turn samples."""

    values: Mapping[str, Value]
    samples: Mapping[str, int]


@dataclass(slots=True)
class Locally:
    """What single turns can do."""

    impossible: set[Outcome] = field(default_factory=set)
    possible: dict[Outcome, Situation] = field(default_factory=dict)
    """With a configuration inside the ranges, which need not be reachable. What is in neither was too hard."""


def decide_locally(arrangement: Arrangement, probed: Probed, budget: Budget) -> Locally:
    """Every outcome of `probed`, decided by Z3 as far as `budget` goes.

    States that only such transitions lead to as can never fire are left out of the ranges, again and again.
    """
    relations = {info.name: (number, info) for number, info in _slots(probed)}
    terms = Terms(probed.program)
    try:
        steps = {name: terms.slot(number) for name, (number, _) in relations.items()}
    except NumberTooLarge:
        return Locally()
    states = {name: frozenset(range(len(info.states))) for name, (_, info) in relations.items()}
    while True:
        found = Locally()
        try:
            for name, relation in steps.items():
                mine = {o: text for o, text in probed.outputs.items() if o.probe.machine == name}
                never = _never(arrangement, probed, relations[name][0])
                _Turn(terms, relation, states, never, budget).decide(mine, found)
        except LimitReached:
            return found
        closed = {name: _reached(arrangement, name, info, found) for name, (_, info) in relations.items()}
        for outcome in probed.outputs:
            if outcome.probe.state >= 0 and outcome.probe.state not in closed[outcome.probe.machine]:
                found.impossible.add(outcome)
                found.possible.pop(outcome, None)
        if closed == states:
            return found
        states = closed


def _slots(probed: Probed) -> Iterator[tuple[int, MachineInfo]]:
    for number, slot in enumerate(probed.program.slots):
        yield number, probed.program.machines[slot.machine]


def _never(arrangement: Arrangement, probed: Probed, number: int) -> list[str]:
    """The flags that are false when a slot has its turn: nothing has faulted, its process has not ended, its machine
    has not left the schedule."""
    program = probed.program
    slot = program.slots[number]
    wanted = {DEAD, program.processes[slot.process].ended}
    if arrangement.finished == "leave":
        wanted.add(f"{program.machines[slot.machine].name}.$finished")
    return [v.name for v in program.vars if v.name in wanted]


def _reached(arrangement: Arrangement, name: str, info: MachineInfo, found: Locally) -> frozenset[int]:
    """The states that a machine can be in: it starts in one, commands lead to that or to the suspend state or back to
    where it was, operators may let it enter any, and all else is transitions that can fire."""
    machine = arrangement.machine(name)
    implicit = range(len(machine.states), len(info.states))  # the suspend state that is not declared
    seen = {machine.initial, *implicit} | (set() if machine.suspend is None else {machine.suspend})
    if any(o.kind == "enter" and o.target == name for o in arrangement.operators):
        return frozenset(range(len(info.states)))
    todo = list(seen)
    while todo:
        state = todo.pop()
        for number, transition in enumerate(info.transitions[state]):
            fired = Outcome(Probe("fired", name, machine.states[state].transitions[number].span, state, number), 1)
            if fired not in found.impossible and transition.target not in seen:
                seen.add(transition.target)
                todo.append(transition.target)
    return frozenset(seen)


class _Turn:
    """One machine's turn from any configuration inside the ranges: machines are in one of their `states`, and the flags
    `never` are false."""

    def __init__(
        self,
        terms: Terms,
        relation: Relation,
        states: Mapping[str, frozenset[int]],
        never: Sequence[str],
        budget: Budget,
    ) -> None:
        self._terms = terms
        self._relation = relation
        self._budget = budget
        arithmetic = terms.arithmetic
        self._question = Question(finite=isinstance(arithmetic, BitVectors), effort=EFFORT)
        self._start = [(terms.before[key].z3, terms.literal(key, init).z3) for key, _, init in terms.outputs]
        read = [*(terms.before[key] for key, _, _ in terms.configuration), *relation.choices.values()]
        self._question.add([arithmetic.within(term) for term in read])
        self._question.add([z3.Not(terms.before[name, None].z3) for name in never])
        for name, allowed in states.items():
            state = terms.before[f"{name}.$state", None]
            values = [arithmetic.literal(s, state.type) for s in sorted(allowed)]
            self._question.add([z3.Or([arithmetic.compare("eq", state, v) for v in values])])

    def decide(self, outcomes: Mapping[Outcome, str], found: Locally) -> None:
        """Put each outcome where it belongs; every model decides all that come out in it."""
        after = self._relation.after
        shown: dict[Outcome, z3.BoolRef] = {}
        for outcome, output in outcomes.items():
            term = after.get((output, None))
            if term is None:
                found.impossible.add(outcome)
            else:
                shown[outcome] = z3.substitute(truth(self._terms.arithmetic, term), *self._start)
        for outcome, wanted in shown.items():
            if outcome in found.possible:
                continue
            self._budget.check()
            try:
                model = self._question.ask([wanted], self._budget)
            except Exhausted:
                continue
            if model is None:
                found.impossible.add(outcome)
                continue
            situation = self._situation(model)
            for other, term in shown.items():
                if other not in found.possible and z3.is_true(model.eval(term, model_completion=True)):
                    found.possible[other] = situation

    def _situation(self, model: z3.ModelRef) -> Situation:
        terms = self._terms
        values: dict[str, Value] = {}
        for key, variable, _ in terms.configuration:
            value = terms.arithmetic.value(model, terms.before[key])
            if variable.length is None:
                values[key[0]] = value
            else:
                before = values.get(key[0], ())
                assert isinstance(before, tuple)
                values[key[0]] = (*before, value)
        samples = {n: terms.arithmetic.value(model, term) for n, term in self._relation.choices.items()}
        return Situation(values, samples)


DEPTH = 20
"""Steps of the longest runs that are looked at."""


class ShortRuns:
    """Shortest runs of up to `depth` steps to as many of the outcomes `wanted` as a solver finds.

    They show outcomes, and prove of none that it never comes out.
    """

    complete = False

    def __init__(self, probed: Probed, wanted: Iterable[Outcome], budget: Budget, depth: int = DEPTH) -> None:
        self.probed = probed
        self._found: dict[Outcome, Schedule] = {}
        self._open = list(wanted)
        self._run = Unrolling(Terms(probed.program))
        self._question = Question(finite=isinstance(self._run.terms.arithmetic, BitVectors), effort=EFFORT)
        try:
            while self._open and len(self._run) < depth:
                self._run.extend()
                self._look(budget)
        except (LimitReached, NumberTooLarge):
            return

    def _look(self, budget: Budget) -> None:
        """Which outcomes can come out in the last step of the run so far; each model tells of several."""
        self._question.learn(self._run.constraints)
        letter, names = self._run.points[-1].letter, self.probed.outputs
        while self._open:
            budget.check()
            try:
                model = self._question.ask([z3.Or([letter[names[o]] for o in self._open])], budget)
            except Exhausted:
                return
            if model is None:
                return
            shown = [o for o in self._open if z3.is_true(model.eval(letter[names[o]], model_completion=True))]
            schedule = schedule_of(self._run, model, len(self._run))
            self._found |= dict.fromkeys(shown, schedule)
            self._open = [o for o in self._open if o not in self._found]

    def keep(self, fits: Callable[[Schedule], bool]) -> None:
        """Forget the runs that the executor cannot perform: the solver's integers have no end."""
        kept = {id(s): fits(s) for s in self._found.values()}
        self._found = {o: s for o, s in self._found.items() if kept[id(s)]}

    def has(self, outcome: Outcome) -> bool:
        """A run was found in which it comes out."""
        return outcome in self._found

    def run_to(self, outcome: Outcome) -> Schedule:
        """A shortest run whose last step has the outcome. KeyError where none was found."""
        return self._found[outcome]
