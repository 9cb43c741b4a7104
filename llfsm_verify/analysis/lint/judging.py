"""From outcomes to findings: what never comes out, what comes out in some run, and what is not known."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

from llfsm_verify.analysis.lint.finding import Finding, Level, OpenQuestion, Proof, Witness
from llfsm_verify.analysis.lint.witnesses import Known, Shower
from llfsm_verify.arrangement.files import STDIN
from llfsm_verify.arrangement.model import Arrangement, Machine, Suppression, Transition
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.trees import nodes, of_kind
from llfsm_verify.language.typed import After, AtState, Expression, Literal, Observe, Query, Read, ReadLocal
from llfsm_verify.logic.formula import atom, disjunction, to_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.semantics.expressions import SURROUNDINGS
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.semantics.probes import ACTIONS, Outcome, Probe

MOST_PAIRS = 3
"""Pairs that are named beside the first one."""


@dataclass(frozen=True, slots=True)
class Overlap:
    """Two transitions of a state whose guards can be true together, and how that is known, in which machines."""

    earlier: Transition
    later: Transition
    target: str
    """Where the earlier one leads."""
    machines: tuple[str, ...]
    proof: Proof
    witness: Witness


def fold_overlaps(overlaps: Sequence[Overlap], hint: str) -> Finding:
    """One note for the overlaps of a state (at least one), at the first of them that a run shows, if one does."""
    overlaps = sorted(overlaps, key=lambda o: (o.later.span.start, o.earlier.span.start))
    first = next((o for o in overlaps if o.proof == "run"), overlaps[0])
    message = f"`{first.earlier.text}` and `{first.later.text}` can be true together: the first one decides"
    notes = (f"it is at line {first.earlier.span.line}, and leads to {first.target}", *_others(overlaps, first))
    return Finding("L003", "note", message, first.later.span, first.machines, first.proof, notes, hint, first.witness)


def _others(overlaps: Sequence[Overlap], first: Overlap) -> Iterator[str]:
    others = [o for o in overlaps if o is not first]
    for o in others[:MOST_PAIRS]:
        known = " (not known to be reachable)" if o.proof == "ranges" and first.proof != "ranges" else ""
        where = "" if o.machines == first.machines else f", in {', '.join(f'`{m}`' for m in o.machines)}"
        yield f"so can `{o.earlier.text}` and `{o.later.text}` at line {o.later.span.line}{where}{known}"
    if len(others) > MOST_PAIRS:
        yield f"and so can {len(others) - MOST_PAIRS} more pairs of guards of this state"


FAULTS = {
    "F001": ("L007", "may leave its range"),
    "F002": ("L008", "may divide by zero"),
    "F003": ("L009", "may use an index outside the array"),
    "F004": ("L018", "may take the root of a negative number"),
    "F005": ("L019", "may shift by too many bits"),
}
FAULTS |= {SURROUNDINGS[code]: finding for code, finding in FAULTS.items()}
"""By the code of a fault: the finding that it may happen, in words."""
HINTS = {
    "L001": "remove it, or correct the guards; `lint: {L001: why}` on it accepts it",
    "L002": "remove it, or add a transition to it that can fire; `lint: {L002: why}` on it accepts it",
    "L003": "make the guards exclude each other if the order should not matter",
    "L004": "remove the condition if it is redundant; otherwise correct it",
    "L005": "remove the condition if it is redundant; otherwise correct it",
    "L006": "correct the value or the declared range",
    "L007": "guard the statement, or declare a wider range",
    "L008": "guard the division",
    "L009": "guard the access, or make the array longer",
    "L018": "guard the root, or take that of `max(0, …)`",
    "L019": "guard the shift, or declare a smaller range for the count",
    "L025": "remove it, or correct the guards; `lint: {L025: why}` in the state accepts it",
}
UNRUN = {
    "exit": ("on_exit", "no transition of the state ever fires"),
    "internal": ("internal", "in every turn that is spent in the state, a transition fires"),
    "on_suspend": ("on_suspend", "the machine is never suspended in this state"),
    "on_resume": ("on_resume", "the machine never comes to this state out of suspension"),
}
"""By the event of an action: its key, and why it never runs."""


class Judge:
    """The findings that follow from what is known of the outcomes."""

    def __init__(
        self, arrangement: Arrangement, known: Known, shower: Shower, *, explored: bool, atoms: Sequence[Observed] = ()
    ) -> None:
        """`atoms` are those of properties."""
        fired = (o for a in atoms for o in of_kind(a.expression, Observe) if o.kind == "fired")
        self._told = {(o.machine, o.state, o.transition) for o in fired}
        """The transitions by whose numbers properties ask."""
        self._arrangement = arrangement
        self._known = known
        self._shower = shower
        self._explored = explored
        self.open: list[OpenQuestion] = []
        self._places: dict[Probe, list[Probe]] = {}
        """By what is the same in all instances of a machine: the probes there."""
        for outcome in known.probed.outputs:
            same = self._places.setdefault(replace(outcome.probe, machine=""), [])
            if outcome.probe not in same:
                same.append(outcome.probe)
        self._constant: list[Span] = []
        """Where a finding explains what the parts of an expression are."""

    def findings(self) -> Iterator[Finding]:
        """All of them; `open` has the questions that are not decided when they are exhausted."""
        yield from self._states()
        yield from self._transitions()
        yield from self._actions()
        yield from self._overlaps()
        yield from self._conditions()
        yield from self._faults()

    # ------------------------------------------------ what can never happen

    def _of_kind(self, kind: str) -> Iterator[list[Probe]]:
        for place, probes in self._places.items():
            if place.kind == kind:
                yield probes

    def _never(self, probes: Sequence[Probe], value: int = 1) -> dict[str, Proof]:
        """The machines in which an outcome never comes out, and how that is known."""
        found = {p.machine: self._known.never(p, value) for p in probes}
        return {machine: proof for machine, proof in found.items() if proof is not None}

    def _states(self) -> Iterator[Finding]:
        spent = list(self._of_kind("spent"))
        unused = {m.name: m for m in self._arrangement.machines if not m.loaded}
        for probes in spent:
            for name in {p.machine for p in probes} - self._never(probes).keys():
                unused.pop(name, None)
        for name, machine in unused.items():
            own = [p for probes in spent for p in probes if p.machine == name]
            yield self._made("L002", f"no turn is ever spent in machine `{name}`", machine.span, own, self._never(own))
        for found in spent:
            probes = [p for p in found if p.machine not in unused]
            if not probes:
                continue
            first = probes[0]
            machine = self._arrangement.machine(first.machine)
            if first.state >= len(machine.states):
                continue  # the suspend state that is not declared
            state = machine.states[first.state]
            never = self._never(probes)
            if never:
                message = f"no turn is ever spent in state `{state.name}`"
                notes = self._ways_in(machine, first.state, frozenset(never))
                yield self._made("L002", message, state.span, probes, never, notes)
            self._ask("L002", f"whether a turn is ever spent in state `{state.name}`", state.span, probes)

    def _ways_in(self, machine: Machine, state: int, names: frozenset[str]) -> tuple[str, ...]:
        """A note on the transitions to a state, where none of them fires in the machines `names`."""
        places = enumerate(machine.states)
        ways = {
            (s, i) for s, other in places if s != state for i, t in enumerate(other.transitions) if t.target == state
        }
        if not ways:
            return ("no transition leads to it",) if state != machine.initial else ()
        tried = [
            p for probes in self._of_kind("fired") for p in probes if p.machine in names and (p.state, p.number) in ways
        ]
        if {(p.state, p.number) for p in tried} != ways or any(self._known.never(p) is None for p in tried):
            return ()
        only = len(ways) == 1
        return (
            "the only transition to it never fires" if only else f"none of the {len(ways)} transitions to it fires",
        )

    def _transitions(self) -> Iterator[Finding]:
        for probes in self._of_kind("fired"):
            transition = self._transition(probes[0])
            if isinstance(transition.guard, Literal) and not transition.guard.value:
                continue  # who writes `false` means it
            entered = [p for p in probes if self._known.never(self._spent(p)) is None]
            never = self._never(entered)
            if never:
                why = {self._why(p) for p in entered if p.machine in never}
                message = f"the transition {self._arrow(probes[0])} can never fire"
                # Instances whose state is never reached have a finding of their own.
                finding = self._made("L001", message, transition.span, entered, never, tuple(sorted(why)))
                self._constant.append(transition.span)
                yield finding
            message = f"whether the transition {self._arrow(probes[0])} ever fires"
            self._ask("L001", message, transition.span, entered, self._query)

    def _actions(self) -> Iterator[Finding]:
        """Actions that never run in states in which turns are spent."""
        places: dict[tuple[Span, int], list[Probe]] = {}
        for machine in self._arrangement.machines:
            for (number, state), (kind, event) in product(enumerate(machine.states), enumerate(ACTIONS)):
                probe = Probe("action", machine.name, state.span, number, kind)
                if getattr(state, UNRUN[event][0]) and self._known.never(self._spent(probe)) is None:
                    places.setdefault((state.span, kind), []).append(probe)
        for (span, kind), probes in places.items():
            key, why = UNRUN[ACTIONS[kind]]
            name = self._arrangement.machine(probes[0].machine).states[probes[0].state].name
            never = self._never(probes)
            if never:
                if key == "on_resume" and probes[0].state == self._arrangement.machine(probes[0].machine).suspend:
                    why = "the machine is never resumed"
                yield self._made("L025", f"the action `{key}` of `{name}` can never run", span, probes, never, (why,))
            self._ask("L025", f"whether the action `{key}` of `{name}` ever runs", span, probes)

    def _why(self, fired: Probe) -> str:
        known, guard = self._known, replace(fired, kind="guard")
        if self._unevaluated(guard):
            start = self._arrangement.machine(fired.machine).states[fired.state].transitions[0]
            if self._unevaluated(replace(guard, number=0, span=start.span)):
                return "no turn gets as far as its guard: each ends in a fault before"
            return "whenever its turn would come, a transition before it has fired"
        alone = replace(fired, kind="alone")
        if Outcome(alone, 1) in known.probed.outputs or Outcome(alone, 0) in known.probed.outputs:
            if known.never(alone) is not None:
                return "its guard is never true"
            return "whenever its guard is true, a transition before it fires"
        return "its guard is never true when it is evaluated"

    def _unevaluated(self, guard: Probe) -> bool:
        return all(self._known.never(guard, value) is not None for value in (0, 1))

    def _conditions(self) -> Iterator[Finding]:
        # What is around comes first: it explains its parts.
        conditions = sorted(self._of_kind("condition"), key=lambda probes: -_length(probes[0]))
        for probes in (*self._of_kind("alone"), *conditions):
            place = probes[0]
            written = self._known.probed.expressions.get(place)
            assert place.span is not None
            if written is None or not _reads(written) or self._explained(written.span):
                continue
            for value, code in ((1, "L004"), (0, "L005")):
                if place.kind == "alone" and value == 0:
                    continue  # a guard that is never true is a transition that never fires
                evaluated = [p for p in probes if self._known.never(p, value) is None]
                never = self._never(evaluated, 1 - value)
                if never:
                    text = " ".join(place.span.text.split())
                    what = "guard" if place.kind == "alone" else "condition"
                    message = f"the {what} `{text}` is always {'true' if value else 'false'}"
                    yield self._made(code, message, place.span, evaluated, never, level=None)
                    self._constant.append(place.span)

    def _explained(self, span: Span) -> bool:
        """Something around it is reported, or the loader has warned of it."""
        around = [*self._constant, *(w.span for w in self._arrangement.warnings if w.span is not None)]
        return any(o.source is span.source and o.start <= span.start and span.end <= o.end for o in around)

    # ------------------------------------------------ what can happen

    def _overlaps(self) -> Iterator[Finding]:
        """One note for the pairs of a state that the same suppressions accept."""
        states: dict[tuple[Span, tuple[Suppression, ...]], list[Overlap]] = {}
        for probes in self._of_kind("both"):
            first = probes[0]
            machine = self._arrangement.machine(first.machine)
            earlier, later = (machine.states[first.state].transitions[n] for n in (first.number, first.other))
            if any(_inside(s, later.span) or _inside(s, earlier.span) for s in self._constant):
                continue
            # The guards decide about the target alone: `on_exit` is the state's, whichever transition fires.
            numbers = {(p.machine, p.state, n) for p in probes for n in (p.number, p.other)}
            if earlier.target == later.target and not numbers & self._told:
                continue
            witness, proof, mine = self._witness(probes, 1, (earlier.guard, later.guard))
            if witness is not None:
                state = machine.states[first.state]
                accepted = tuple(s for s in self._arrangement.suppressions if s.covers("L003", later.span))
                target = machine.states[earlier.target].name
                found = Overlap(earlier, later, target, mine, proof, witness)
                states.setdefault((state.span, accepted), []).append(found)
        for overlaps in states.values():
            yield fold_overlaps(overlaps, HINTS["L003"])

    def _faults(self) -> Iterator[Finding]:
        for probes in self._of_kind("fault"):
            site = self._sites[probes[0].number]
            if site.span is None:
                continue
            can = [p for p in probes if self._known.never(p) is None]
            always = self._never([p for p in can if self._known.shown(p) or not self._known.complete], 0)
            read = self._around(probes[0].machine, site.span)
            witness, proof, mine = self._witness(can, 1, read)
            code, words = FAULTS[site.code]
            detail = site.message.partition(": ")[2]  # before it is what the words say
            if proof != "run":
                self._ask(code, f"whether this {words} in a run: {detail}", site.span, can)
            if witness is None:
                continue
            if len(always) == len(can):
                message = f"this always faults ({site.message})"
                yield Finding("L006", "warning", message, site.span, mine, proof, (), HINTS["L006"], witness)
                continue
            level: Level = "warning" if proof == "run" else "note"
            message = f"this {words}: {detail}"
            yield Finding(code, level, message, site.span, mine, proof, (), HINTS[code], witness)

    def _witness(
        self, probes: Sequence[Probe], value: int, read: Sequence[Expression | Read]
    ) -> tuple[Witness | None, Proof, tuple[str, ...]]:
        """A witness of an outcome, by a run if there is one; how it is known, and the machines in which it is."""
        runs = [(p, reach) for p in probes if (reach := self._known.shown(p, value)) is not None]
        if runs:
            probe, reach = runs[0]
            outcome = Outcome(probe, value)
            witness = self._shower.of_run(reach.run_to(outcome), outcome, reach.probed.wide, read)
            return witness, "run", tuple(p.machine for p, _ in runs)
        for probe in probes:
            situation = self._known.somewhere(probe, value)
            if situation is not None and self._known.never(probe, value) is None:
                machines = tuple(p.machine for p in probes if self._known.never(p, value) is None)
                return self._shower.of_ranges(situation, read), "ranges", machines
        return None, "ranges", ()

    # ------------------------------------------------ making them

    def _made(
        self,
        code: str,
        message: str,
        span: Span,
        probes: Sequence[Probe],
        never: dict[str, Proof],
        notes: tuple[str, ...] = (),
        level: Level | None = "warning",
    ) -> Finding:
        """A finding that something never is; a note where it is so in some instances only, or (`level` None) where only
        the reachable configurations tell."""
        proof: Proof = "reachable" if "reachable" in never.values() else "local"
        others = [p.machine for p in probes if p.machine not in never]
        if level is None:
            level = "warning" if proof == "local" else "note"
        if others:
            level = "note"
            notes = (*notes, f"so in {_listed(list(never))}, not in {_listed(others)}")
        return Finding(code, level, message, span, tuple(never), proof, notes, HINTS[code])

    def _ask(
        self,
        code: str,
        message: str,
        span: Span,
        probes: Sequence[Probe],
        hint: Callable[[Sequence[Probe]], str] | None = None,
    ) -> None:
        """An open question, where an outcome was neither shown nor shown to be impossible in any instance.

        `hint` says what may decide it about the probes that are not decided.
        """
        undecided = [p for p in probes if self._known.never(p) is None]
        if self._explored:
            answered = any(self._known.shown(p) is not None for p in undecided)
        else:  # only single turns were asked about: those that were too hard are open
            answered = any(self._known.somewhere(p) is not None for p in undecided)
        if undecided and not answered:
            self.open.append(OpenQuestion(code, message, span, None if hint is None else hint(undecided)))

    def _query(self, fired: Sequence[Probe]) -> str:
        """The command that asks all engines whether one of these transitions fires."""
        names = [(p.machine, self._arrangement.machine(p.machine).states[p.state].name, p.number) for p in fired]
        formula = to_text(disjunction(atom(f"{m}.fired({state},{number})") for m, state, number in names))
        path = "-" if self._arrangement.path == STDIN else self._arrangement.path
        return f"`llfsm query {shlex.quote(path)} {shlex.quote(formula)}` may decide it, by a proof or a run"

    @property
    def _sites(self) -> tuple[FaultSite, ...]:
        return self._known.probed.program.faults

    def _transition(self, probe: Probe) -> Transition:
        return self._arrangement.machine(probe.machine).states[probe.state].transitions[probe.number]

    def _spent(self, probe: Probe) -> Probe:
        span = self._arrangement.machine(probe.machine).states[probe.state].span
        return Probe("spent", probe.machine, span, probe.state)

    def _arrow(self, probe: Probe) -> str:
        states = self._arrangement.machine(probe.machine).states
        return f"{states[probe.state].name} -> {states[self._transition(probe).target].name}"

    def _around(self, machine: str, span: Span) -> list[Expression | Read]:
        """What the text of a check reads."""
        found: list[Expression | Read] = []
        for state in self._arrangement.machine(machine).states:
            texts = (state.on_entry, state.on_exit, state.internal, state.on_suspend, state.on_resume)
            guards = tuple(t.guard for t in state.transitions)
            found += [r for r in of_kind((texts, guards), Read) if _inside(r.span, span)]
        return found


def _length(probe: Probe) -> int:
    return 0 if probe.span is None else probe.span.end - probe.span.start


def _inside(inner: Span, outer: Span) -> bool:
    return inner.source is outer.source and outer.start <= inner.start and inner.end <= outer.end


def _reads(e: Expression) -> bool:
    """Something decides the expression; else who writes it means it."""
    return any(isinstance(n, Read | ReadLocal | AtState | Query | After) for n in nodes(e))


def _listed(names: Sequence[str]) -> str:
    return ", ".join(f"`{n}`" for n in names)
