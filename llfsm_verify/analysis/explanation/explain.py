"""A confirmed trace with the causes of its failure marked and the reason in words, and notes beside a violation that
name the word of the property language for what may have been meant.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import nullcontext
from dataclasses import replace
from fractions import Fraction

from llfsm_verify.analysis.explanation.causes import Pair, Reading, causes, changes, possible
from llfsm_verify.analysis.explanation.sentences import Sentences
from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.checking.goals.goal import Goal, Unconfirmed, lost_at, shown_atoms
from llfsm_verify.checking.problem import Problem
from llfsm_verify.checking.replay.confirm import Letter, ReplayedRun
from llfsm_verify.checking.trace import Cause, Trace, letter_steps
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import After, Assign, AtState, Observe, Query, Read, Sampled
from llfsm_verify.limits import LimitReached, budget_in_force, ticking, unlimited
from llfsm_verify.logic.bounds import HIDDEN
from llfsm_verify.logic.formula import BINDING, operators, time_text
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import Property
from llfsm_verify.logic.regular import ExpressionTooLarge
from llfsm_verify.semantics.letters import Observed, TimePasses
from llfsm_verify.semantics.samples import scalars_of
from llfsm_verify.semantics.walk import elements

MOST_TRIED = 600
"""Values of an infinite run that are changed, one at a time, where only the judge of the property knows it."""


def explain(replayed: ReplayedRun, goal: Goal, problem: Problem) -> Trace:
    """The trace of a run that violates a property, with its causes and the reason.

    Where a limit is reached nothing is marked, and the reason says so. Of the budget in force only the time counts.
    """
    budget = budget_in_force()
    with unlimited(), nullcontext() if budget is None else ticking(budget.check_time):
        return _explained(replayed, goal, problem)


def _explained(replayed: ReplayedRun, goal: Goal, problem: Problem) -> Trace:
    trace = replayed.trace
    try:
        letters, loop = failing_part(replayed, goal)
        trace = replace(trace, failed_at=letter_steps(trace)[len(letters) - 1] if loop is None else None)
        pairs, why = _explanation(trace, letters, loop, goal, problem)
    except (AutomatonTooLarge, ExpressionTooLarge, LimitReached, Unconfirmed) as limit:
        return unexplained(trace, limit)
    return mark_causes(trace, pairs, replayed.letters, why, problem)


def unexplained(trace: Trace, limit: Exception) -> Trace:
    """`trace` with a reason that only says why none was found."""
    return replace(trace, because=f"of what was not found out ({limit})")


def mark_causes(trace: Trace, pairs: Iterable[Pair], letters: Sequence[Letter], why: str, problem: Problem) -> Trace:
    """`trace` with marks at (letter, atom) pairs."""
    read = by_key(problem.atoms)
    at: dict[int, set[str]] = {}
    numbers = letter_steps(trace)
    for letter, key in pairs:
        if not key.startswith(HIDDEN):
            at.setdefault(letter, set()).add(key)
    by_step = {numbers[letter]: letter for letter in at}
    marks: dict[int, tuple[Cause, ...]] = {}
    for number, values in enumerate(values_along(trace)):
        if number not in by_step:
            continue
        letter = by_step[number]
        marks[number] = tuple(
            Cause(key, key in letters[letter], tuple((n, values[n]) for n in read.get(key, ()) if n in values))
            for key in sorted(at[letter])
        )
    steps = tuple(replace(s, causes=marks[i]) if i in marks else s for i, s in enumerate(trace.steps, 1))
    return replace(trace, steps=steps, initial_causes=marks.get(0, ()), because=why)


def failing_part(replayed: ReplayedRun, goal: Goal) -> tuple[Sequence[Letter], int | None]:
    """The letters of the first failure, and the letter to which the last leads back (None: they are a bad prefix).

    What follows a bad prefix only shows that the assumptions can hold.
    """
    letters, loop = replayed.letters, replayed.loop_letter
    if loop is not None:
        monitor = goal.monitor()
        lost = None if monitor is None else lost_at(monitor, goal.atoms, letters)
        if lost is not None:
            return letters[: lost + 1], None
    return letters, loop


_JUDGEMENTS = {
    "automaton": "the automaton does not accept the run",
    "automaton never": "the automaton accepts the run",
}
_HOPELESS = {
    "automaton": "the automaton accepts nothing that could follow",
    "automaton never": "the automaton accepts all that could follow",
}


def _explanation(
    trace: Trace, letters: Sequence[Letter], loop: int | None, goal: Goal, problem: Problem
) -> tuple[frozenset[Pair], str]:
    numbers = letter_steps(trace)

    def place(letter: int) -> str:
        return f"at step {numbers[letter]}" if numbers[letter] else "in the initial configuration"

    formula = goal.line.formula
    if formula is not None and not operators(formula) & BINDING:
        reading = Reading(formula, letters, loop, problem.clock)
        if reading.fails:
            sentences = Sentences(reading, place, lambda letter, key: key in letters[letter])
            return exact_causes(reading)[0], sentences.why()
    if loop is not None:
        judgement = _JUDGEMENTS.get(goal.line.kind, "the run as a whole does not satisfy it")
        return _mending(goal, letters, loop), judgement
    monitor = goal.monitor()
    last = len(letters) - 1
    keys = changes(monitor, goal.atoms, letters) if monitor is not None else frozenset[str]()
    pairs = frozenset((last, key) for key in keys & set(shown_atoms(goal.line)))
    kind, expression = goal.line.kind, goal.line.expression
    if expression is not None and kind in ("enforce", "forbid", "forbid initially"):
        from llfsm_verify.analysis.explanation.sentences import regular_reason

        others = None if monitor is None else possible(monitor, goal.atoms, letters)
        why = regular_reason(kind, expression, letters, place, others)
        if why is not None:
            return pairs, why
    hopeless = _HOPELESS.get(kind, "nothing that could follow satisfies the property")
    return pairs, f"after what it shows {place(last)} {hopeless}"


def _mending(goal: Goal, letters: Sequence[Letter], loop: int) -> frozenset[Pair]:
    """The values whose change alone makes a run have the property; none are looked for in longer runs."""
    keys = shown_atoms(goal.line)
    if len(letters) * len(keys) > MOST_TRIED:
        return frozenset()
    found: set[Pair] = set()
    for i, letter in enumerate(letters):
        for key in keys:
            word = [*letters[:i], letter ^ {key}, *letters[i + 1 :]]
            if not goal.violated_by(word[:loop], word[loop:]):
                found.add((i, key))
    return frozenset(found)


# ---- Few marks are tried out: those of them that are causes by the definition stay


EFFORT = 400_000
"""Truth values of subformulas at letters that are computed for it (some tenths of a second)."""


def exact_causes(reading: Reading) -> tuple[frozenset[Pair], bool]:
    """`causes` of the whole formula, and whether marks that are not causes have been left out.

    All contingencies are sets of causes, so sets of marks are enough: a mark is a cause when some set of others leaves
    the formula false, and no longer with it.
    """
    marks = sorted(causes(reading))
    if reading.size << len(marks) > EFFORT:
        return frozenset(marks), False
    false = [
        reading.fails_with([m for i, m in enumerate(marks) if chosen >> i & 1]) for chosen in range(1 << len(marks))
    ]
    kept = (
        mark
        for i, mark in enumerate(marks)
        if any(false[s] and not false[s | 1 << i] for s in range(len(false)) if not s >> i & 1)
    )
    return frozenset(kept), True


# ---- From atoms to the variables, inputs and machines that they read, with their values at a step


def names_of(atom: Observed) -> tuple[str, ...]:
    """What an atom reads, by the names that traces use: scalars (``a[1].x``) and machines, each once."""
    if isinstance(atom.expression, TimePasses):
        return ()
    found: dict[str, None] = {}
    for read in of_kind(atom.expression, Read):
        found.update(dict.fromkeys(elements(read)))
    for at in of_kind(atom.expression, AtState):
        found[at.machine] = None
    for query in of_kind(atom.expression, Query):
        found[query.machine] = None
    for sample in of_kind(atom.expression, Sampled):
        found.update(dict.fromkeys(_sampled(sample.machine, name) for name in scalars_of(sample)))
    for seen in of_kind(atom.expression, Observe):
        if seen.machine:
            found[f"{seen.machine}.{seen.kind}" if seen.kind in ("finished", "loaded") else seen.machine] = None
    return tuple(found)


def values_along(trace: Trace) -> Iterator[dict[str, str]]:
    """The text of every variable's value at the start and after each step; of an input, the one shown last.

    The same dictionary each time, changed."""
    values = dict(trace.initial)
    yield values
    for step in trace.steps:
        values.update((change.variable, change.after) for change in step.changes)
        values.update((sampled.input, sampled.text) for sampled in step.choices if sampled.input)
        for sampled in step.sampled:
            values[_sampled("", sampled.input)] = values[_sampled(step.machine or "", sampled.input)] = sampled.text
        yield values


def _sampled(machine: str, scalar: str) -> str:
    """What a machine ("": any) sampled last, as a property writes it."""
    return f"{machine}.sampled({scalar})" if machine else f"sampled({scalar})"


def by_key(atoms: Sequence[Observed]) -> dict[str, tuple[str, ...]]:
    """`names_of` by the key of each atom."""
    return {atom.name: names_of(atom) for atom in atoms}


def hints(trace: Trace, problem: Problem, line: Property) -> tuple[str, ...]:
    """Notes on the causes of a violation: inputs that no machine sampled, states whose `on_entry` has not run, clocks
    that are a cycle late for a bound in time."""
    return (*_unsampled(trace), *_unentered(trace, problem), *_late(trace, problem, line))


def _unsampled(trace: Trace) -> Iterator[str]:
    found: dict[str, int] = {}
    for number, step in enumerate(trace.steps, 1):
        read = {name for cause in step.causes for name, _ in cause.variables}
        for s in step.world:
            if s.input in read:
                found.setdefault(s.input, number)
    where = "it was in the surroundings only"
    for name, number in found.items():
        yield f"no machine sampled `{name}` at step {number}, {where}; `sampled({name})` is what machines saw last"


def _unentered(trace: Trace, problem: Problem) -> Iterator[str]:
    """Of states that are causes, those whose `on_entry` sets what is also a cause, and has not run yet."""
    states = {
        a.name: [at for at in of_kind(a.expression, AtState) if at.state >= 0]
        for a in problem.atoms
        if not isinstance(a.expression, TimePasses)
    }
    said: set[tuple[str, int]] = set()
    for number, marked in ((0, trace.initial_causes), *((i, s.causes) for i, s in enumerate(trace.steps, 1))):
        read = {name for cause in marked for name, _ in cause.variables}
        for at in (at for cause in marked if cause.value for at in states.get(cause.atom, ())):
            if at.machine in problem.arrangement.surroundings:
                continue  # its ringlets are no steps, so a trace does not show when it entered a state
            state = problem.arrangement.machine(at.machine).states[at.state]
            sets = _written_in(state.on_entry)
            if (at.machine, at.state) in said or not sets & read or not _before_entry(trace, number, at.machine):
                continue
            said.add((at.machine, at.state))
            place = f"at step {number}" if number else "in the initial configuration"
            there = f"`{at.machine}@{state.name}` is true {place}, and `on_entry` has not run yet"
            yield f"{there}; `{at.machine}.entered({state.name})` is true when it has"


def _late(trace: Trace, problem: Problem, line: Property) -> Iterator[str]:
    """The clock conditions, no longer than a bound of the property, of machines that the causes speak of, where a turn
    from the first cause on comes exactly when their time is over, or the trace ends before that.

    There people take `after` to be true, and do not count the cycle in which the machine comes to the state.
    """
    period = problem.arrangement.cycle_ms
    causes = [trace.initial_causes, *(step.causes for step in trace.steps)]
    first = next((number for number, found in enumerate(causes) if found), len(causes))
    most = max((time for _, bound in line.bounds for time in bound if time is not None), default=None)
    if most is None or period is None:
        return
    read = {name for found in causes for cause in found for name, _ in cause.variables}
    machines = {m.name: m for m in problem.arrangement.machines if m.name in read or _written_in(m.states) & read}
    began: dict[str | None, tuple[str, int]] = {}
    last = {step.machine: number for number, step in enumerate(trace.steps, 1) if trace.loop is None}
    cycle, told = 0, set[str]()
    for number, step in enumerate(trace.steps, 1):
        if began.get(step.machine, (None, 0))[0] != step.state:
            began[step.machine] = (step.state, cycle)
        machine, passed = machines.get(step.machine or ""), period * (cycle - began[step.machine][1])
        states = machine.states if machine is not None and number >= first else ()
        for after in (a for state in states if state.name == step.state for a in of_kind(state, After)):
            bound = after.bound
            if not isinstance(bound, Fraction) or bound % period or not period <= bound <= most:
                continue
            said = f"`{after.span.text}` of `{step.machine}@{step.state}`"
            if said not in told and (passed == bound or (passed < bound and last.get(step.machine) == number)):
                told.add(said)
                came = ", a cycle after it came" if began[step.machine][1] else ""
                cycles = f"{bound // period + 1:,} cycles of {time_text(decimal(period), ' ')} later"
                time = f"more than {time_text(decimal(bound), ' ')} have passed since its first turn there{came}"
                yield f"{said} is true when {time}: {cycles}, not {bound // period:,}"
        cycle += step.cycle


def _written_in(actions: object) -> set[str]:
    """The variables that statements assign to as a whole."""
    return {s.target.variable.name for s in of_kind(actions, Assign) if isinstance(s.target, Read)}


def _before_entry(trace: Trace, number: int, machine: str) -> bool:
    """Whether a machine has had no ringlet in its present state after step `number`."""
    own = [step for step in trace.steps[:number] if step.machine == machine]
    if not own:
        return True
    return own[-1].fired is not None and any(change.variable == machine for change in own[-1].changes)
