"""Lint of one arrangement: local proofs, then the reachable configurations, then what the files accept."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from llfsm_verify.analysis.lint.finding import Finding, LintResult, OpenQuestion
from llfsm_verify.analysis.lint.judging import Judge
from llfsm_verify.analysis.lint.local import ShortRuns, decide_locally
from llfsm_verify.analysis.lint.reach import Reach
from llfsm_verify.analysis.lint.starvation import passed_over, stuck, turns
from llfsm_verify.analysis.lint.unread import lost, unread, unused
from llfsm_verify.analysis.lint.witnesses import Known, Shower
from llfsm_verify.arrangement.ending import running_once
from llfsm_verify.arrangement.model import Arrangement, Suppression
from llfsm_verify.diagnostics import Span
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import After
from llfsm_verify.limits import Budget, Limits
from llfsm_verify.semantics.letters import Observed
from llfsm_verify.transforms.probing import probed

MAX_STATES = 1_000_000
"""Configurations up to which lint explores, unless the limits say otherwise."""

ASKED = ("L010", "L021", "L022", "L023")
"""What properties may put right."""
ACCEPT = "`lint: {L010: why}` in its declaration accepts it"


def lint(
    arrangement: Arrangement, limits: Limits | None = None, *, local: bool = False, atoms: Sequence[Observed] = ()
) -> LintResult:
    """What is wrong with an arrangement. `local`: only what single turns and the text tell.

    `atoms` are those of properties: what they read counts as read. Raises DiagnosticError where the arrangement
    has no meaning, and Disagreement when a witness is not confirmed.
    """
    started = time.monotonic()
    limits = limits or Limits()
    budget = Budget(limits)
    program = probed(arrangement, wide=True)
    locally = decide_locally(arrangement, program, budget)
    reaches: list[Reach] = []
    try:
        if not local:
            patient = limits.timeout is not None
            reaches.append(Reach(program, _left(limits, budget, 0.4), patient=patient))
            if not reaches[0].complete and program.wide:
                # With guards alone steps sample more than they do in runs.
                narrow = probed(arrangement, wide=False)
                reaches.append(Reach(narrow, _left(limits, budget, 0.7), patient=patient))
        known = Known(program, locally, reaches)
        # What was found is shown, if the time has ended meanwhile or not.
        shower = Shower(arrangement)
        if reaches and not known.complete:
            wanted = [o for o in locally.possible if known.shown(o.probe, o.value) is None]
            short = ShortRuns(program, wanted, _left(limits, budget, 1.0))
            short.keep(shower.fits)
            known = Known(program, locally, [*reaches, short])
        judge = Judge(arrangement, known, shower, explored=not local, atoms=atoms)
        findings = [
            *judge.findings(),
            *_text(arrangement, atoms),
            *unused(arrangement, atoms),
            *_once(arrangement),
            *_without_inputs(arrangement),
            *_late(arrangement),
            *_kept_clocks(arrangement),
        ]
        unspent = {finding.span for finding in findings if finding.code == "L002"}
        findings += [f for f in turns(arrangement, atoms) if f.code != "L023" or f.span not in unspent]
        questions = judge.open
        complete = next((r for r in reaches if r.complete), None)
        if complete is not None:
            findings += _starving(arrangement, complete, shower)
        elif reaches:
            questions.append(OpenQuestion("L012", "whether a machine can starve", arrangement.span))
        last = reaches[-1] if reaches else None
        # Without the widest exploration, guards that are constant may have been missed.
        certain = not questions and bool(reaches) and reaches[0].complete
        accepted = _suppressed(arrangement, findings, certain=certain, with_properties=bool(atoms))
        return LintResult(
            arrangement=arrangement.name,
            path=arrangement.path,
            findings=tuple(_ordered(arrangement, accepted)),
            open=tuple(q for q in questions if not any(s.covers(q.code, q.span) for s in arrangement.suppressions)),
            explored=not local,
            complete=complete is not None,
            reason=None if complete is not None or last is None else last.reason,
            configurations=max((r.configurations for r in reaches), default=0),
            left_out=() if last is None else last.left_out,
            inputs=() if last is None else last.inputs,
            seconds=time.monotonic() - started,
        )
    finally:
        for reach in reaches:
            reach.close()


def _left(limits: Limits, budget: Budget, share: float) -> Budget:
    """A budget with a share of the time that is left."""
    if limits.timeout is not None:
        limits = limits.within(max(0.0, limits.timeout - budget.seconds) * share)
    return Budget(replace(limits, max_states=limits.max_states or MAX_STATES))


def _text(arrangement: Arrangement, atoms: Iterable[Observed]) -> Iterator[Finding]:
    """Writes never read."""
    instances: dict[tuple[Span, str], list[str]] = {}
    for variable in unread(arrangement, atoms):
        owner, _, name = variable.name.partition(".")
        instances.setdefault((variable.span, name.rpartition(".")[2] or owner), []).append(owner if name else "")
    declared: dict[Span, list[str]] = {}
    for machine in arrangement.texts:
        for variable in (*machine.variables, *(v for s in machine.states for v in s.variables)):
            declared.setdefault(variable.span, []).append(machine.name)
    for (span, name), owners in instances.items():
        if "" in owners:
            hint = f"write `role: output` if the surroundings read it; give lint the property files that do; {ACCEPT}"
            message = f"whiteboard variable `{name}` is written, and no machine's behaviour depends on it"
            yield Finding("L010", "warning", message, span, (), "text", (), hint)
        elif len(owners) == len(declared[span]):
            message = f"variable `{name}` is written, and nothing that the machine does depends on it"
            hint = f"remove it, or give lint the property files that read it; {ACCEPT}"
            yield Finding("L010", "warning", message, span, tuple(owners), "text", (), hint)
    stores: dict[Span, tuple[str, bool, list[str]]] = {}
    for found in lost(arrangement):
        stores.setdefault(found.span, (found.target, found.local, []))[2].append(found.machine)
    for span, (target, is_local, machines) in stores.items():
        never = "nothing reads it" if is_local else "the same action stores another one before anything reads it"
        message = f"the value stored in `{target}` here is lost: {never}"
        yield Finding(
            "L011", "warning", message, span, tuple(dict.fromkeys(machines)), "text", (), "remove it, or correct it"
        )


def _once(arrangement: Arrangement) -> Iterator[Finding]:
    """`internal` actions of states in which machines finish."""
    for span, name, names in running_once(arrangement):
        message = f"the `internal` action of `{name}` runs once: the state has no transitions, so the machine finishes"
        hint = "write `stays: true`, add a transition, or move the action to `on_entry`"
        yield Finding("L015", "note", message, span, tuple(names), "text", (), hint)


def _without_inputs(arrangement: Arrangement) -> Iterator[Finding]:
    """A model of the surroundings that leaves all inputs as they are."""
    if arrangement.plants and not any(w.driven for w in arrangement.whiteboard):
        message = "the model of the surroundings writes no input, so all inputs are free"
        hint = "write `x = choose(…);` in one of its actions, where `x` is an input"
        yield Finding("L016", "note", message, arrangement.plants[0].span, (), "text", (), hint)


def _late(arrangement: Arrangement) -> Iterator[Finding]:
    """Machines inside states that have their turn before their owner."""
    for process in arrangement.processes:
        for owner in (arrangement.machine(name) for name in process.schedule):
            for state in owner.states:
                early = [m for m in state.runs if m in process.schedule[: process.schedule.index(owner.name)]]
                for name in early:
                    message = f"`{name}` has its turn before `{owner.name}`, so it begins and ends a cycle late"
                    hint = f"put it after `{owner.name}` in the schedule"
                    yield Finding("L017", "note", message, state.span, (name, owner.name), "text", (), hint)


def _kept_clocks(arrangement: Arrangement) -> Iterator[Finding]:
    """Self-transitions of states that read their clock, which goes on."""
    if arrangement.profile.self_transition_restarts_clock:
        return
    places: dict[tuple[Span, str, str], list[str]] = {}
    for machine in arrangement.machines:
        for number, state in enumerate(machine.states):
            read = (tuple(t.guard for t in state.transitions), state.internal, state.on_exit)
            clock = next(iter(of_kind(read, After)), None)
            own = [t.span for t in state.transitions if t.target == number]
            if clock is not None:
                for span in own:
                    places.setdefault((span, state.name, clock.span.text), []).append(machine.name)
    for (span, name, text), names in places.items():
        message = f"the transition {name} -> {name} neither restarts the clock that `{text}` reads, nor runs `on_entry`"
        hint = (
            "go through another state, or write `self_transition_restarts_clock: true` into the profile for the clock"
        )
        yield Finding(
            "L026", "note", message, span, tuple(names), "text", (), f"{hint}; `lint: {{L026: why}}` accepts it"
        )


def _starving(arrangement: Arrangement, reach: Reach, shower: Shower) -> Iterator[Finding]:
    for found in stuck(arrangement, reach):
        machine = arrangement.machine(found.machine)
        inside = found.state < len(machine.states)
        state = machine.states[found.state].name if inside else "__suspend"
        span = machine.states[found.state].span if inside else machine.span
        witness = shower.of_start(reach.run_to_configuration(found.node), found.machine, state)
        code = "L013" if found.suspended else "L012"
        message = f"machine `{found.machine}` can get stuck in state `{state}`: then no run leaves that state again"
        wanted = "add a transition that leaves the state"
        if found.suspended:
            message = f"machine `{found.machine}` can stay suspended forever: then no run resumes it"
            wanted = "let another machine resume or restart it"
        hint = f"{wanted} for all values of the inputs; `lint: {{{code}: why}}` accepts it"
        yield Finding(code, "warning", message, span, (found.machine,), "run", (), hint, witness)
    for over in passed_over(arrangement, reach):
        process = arrangement.processes[over.process]
        witness = shower.of_start_anywhere(reach.run_to_configuration(over.node))
        message = (
            f"process `{process.name}` may never take a turn again: `fairness: none` lets the others take all turns"
        )
        hint = "leave `fairness: none` out, or accept it with `lint: {L014: why}`"
        yield Finding("L014", "warning", message, process.span, process.schedule, "run", (), hint, witness)


# ---------------------------------------------------------------- what the files accept


def _suppressed(
    arrangement: Arrangement, findings: Sequence[Finding], *, certain: bool, with_properties: bool
) -> Iterator[Finding]:
    """The findings with the reasons for which they are accepted, and where all is known the suppressions of none."""
    used: set[Suppression] = set()
    for finding in findings:
        covering = [s for s in arrangement.suppressions if s.covers(finding.code, finding.span)]
        used |= set(covering)
        # The narrowest says most.
        best = min(covering, key=lambda s: (s.whole, s.end - s.start), default=None)
        yield finding if best is None else replace(finding, suppressed=best.reason)
    for suppression in arrangement.suppressions:
        # With properties given, a suppression for those who give none has nothing to suppress.
        if certain and suppression not in used and not (suppression.code in ASKED and with_properties):
            message = f"there is no finding {suppression.code} here to suppress"
            yield Finding("L020", "warning", message, suppression.span, (), "text", (), "remove it")


def _ordered(arrangement: Arrangement, findings: Iterable[Finding]) -> list[Finding]:
    """By file, the arrangement's first, then by place."""
    everything = list(findings)
    files = [arrangement.span.source.name]
    files += [m.states[0].span.source.name for m in arrangement.texts]
    return sorted(everything, key=lambda f: (files.index(f.span.source.name), f.span.start, f.code))
