"""Whether a guard keeps its properties, whatever the guarded machines do."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from llfsm_verify import Verdict
from llfsm_verify.extensions.guards.chaos import Uncovered, with_chaos, with_model
from llfsm_verify.extensions.guards.switch import switch_machine
from llfsm_verify.extensions.guards.transform import Guarded
from llfsm_verify.plug import (
    SURROUNDINGS,
    Arrangement,
    Budget,
    FaultFinding,
    Options,
    PropertyResult,
    PropertyScope,
    PropertySet,
    Read,
    Result,
    Trace,
    check_atom,
    of_kind,
    resolve,
    verify,
)

UNKNOWN = 4
STOPPED = "the proof was stopped before chaos had given commands"


@dataclass(frozen=True, slots=True)
class Proof:
    """What came of it: the result under chaos in the place of `machines`, or None, and `reasons` say why.
    `reasons` also say why something is violated, in sentences without their full stops."""

    machines: tuple[str, ...]
    arrangement: Arrangement | None
    result: Result | None
    reasons: tuple[str, ...]

    @property
    def exit_code(self) -> int:
        return UNKNOWN if self.result is None else self.result.exit_code


def prove(guarded: Guarded, properties: PropertySet, options: Options, engine: str, budget: Budget) -> Proof:
    """Check the properties on the guarded arrangement, with chaos in the place of the guarded machines.

    What holds with chaos in more places holds with it in fewer, and is often easier to prove: so all machines below the
    guard are chaos at first. Faults are then those of the guard, of the surroundings and of the pool. What is not
    proved so is looked at with chaos for the guarded machines alone: first without commands, whose combinations are
    many. What is violated without them is violated, and only what they may change is asked again with them. All of that
    has the time that `budget` leaves.
    """
    names = guarded.names
    least = tuple(m.name for m in guarded.arrangement.machines if m.name in names.guarded)
    # A machine of the pool takes its turn after the monitor, where it matters what it samples.
    own = (*names.monitors, names.switch, *names.rights.substitutes)
    most = tuple(m.name for m in guarded.arrangement.machines if m.name in least or (m.loaded and m.name not in own))
    first = options if most == least else _telling(options, Verdict.HOLDS)
    proof = _prove(guarded, most, properties, first, engine, budget)
    if most == least or (proof.result is not None and (proof.result.interrupted or _kept(proof.result))):
        return proof
    if proof.result is None:
        return _prove(guarded, least, properties, options, engine, budget)
    found, faults = _those(proof.result, Verdict.HOLDS), proof.result.faults
    unsure = faults.verdict is not Verdict.HOLDS
    for commands in (False, True):
        left = replace(properties, properties=tuple(p for p in properties if p.name not in found))
        if not left.goals and not (commands and unsure):
            continue
        stays = tuple(Verdict) if commands else (Verdict.VIOLATED,)
        asked = replace(_telling(options, *stays), faults=commands and unsure)
        proof = _prove(guarded, least, left, asked, engine, budget, commands=commands)
        if proof.result is None:
            return proof
        found |= _those(proof.result, *stays)
        if asked.faults and proof.result.faults.verdict is not Verdict.UNKNOWN:
            faults = proof.result.faults
        if proof.result.interrupted:
            break
    assert proof.result is not None
    rest = {p.name: replace(p, verdict=Verdict.UNKNOWN, reason=STOPPED) for p in proof.result.properties}
    in_order = tuple((rest | found)[line.name] for line in properties.goals)
    return _with_reasons(
        replace(proof, machines=least, result=replace(proof.result, properties=in_order, faults=faults)), guarded
    )


def _telling(options: Options, *verdicts: Verdict) -> Options:
    """The same, but of what falls only these verdicts are told: the others may not stay."""
    tell = options.decided
    if tell is None:
        return options
    return replace(options, decided=lambda known: tell(known) if known.verdict in verdicts else None)


def _kept(result: Result) -> bool:
    verdicts = [*(found.verdict for found in result.properties), result.faults.verdict]
    return all(verdict is Verdict.HOLDS for verdict in verdicts)


def _those(result: Result, *verdicts: Verdict) -> dict[str, PropertyResult]:
    """The properties with one of these verdicts, by name."""
    return {found.name: found for found in result.properties if found.verdict in verdicts}


def _prove(
    guarded: Guarded,
    machines: tuple[str, ...],
    properties: PropertySet,
    options: Options,
    engine: str,
    budget: Budget,
    *,
    commands: bool = True,
) -> Proof:
    scope = PropertyScope.of(guarded.arrangement)
    atoms = [check_atom(fragment, scope) for fragment in properties.atoms.values()]
    read = {node.variable.name for atom in atoms for node in of_kind(atom, Read)}
    draft, before = guarded.draft, guarded.arrangement
    names, wanted = guarded.names, guarded.wanted
    if any(name in names.memory for name in machines):
        # The switch need not know what chaos does, so chaos need not show it.
        switch = switch_machine(names, wanted, taken_back=not guarded.made, chaos=machines)
        draft = with_model(draft, names.switch, switch)
        before = resolve(draft)
    try:
        draft = with_chaos(draft, before, machines, read, commands=commands)
    except Uncovered as why:
        return Proof(machines, None, None, (str(why),))
    arrangement = resolve(draft)
    options = replace(options, limits=options.limits.within(budget.left))
    result = verify(arrangement, properties, options, engine)
    return _with_reasons(Proof(machines, arrangement, result, ()), guarded)


def _with_reasons(proof: Proof, guarded: Guarded) -> Proof:
    return proof if proof.result is None else replace(proof, reasons=tuple(_reasons(guarded, proof.result)))


def _reasons(guarded: Guarded, result: Result) -> Iterator[str]:
    alarm = guarded.names.alarm
    outputs = " and ".join(f"`{name}`" for name in guarded.names.requests) or "what is read"
    what = "fallback" if guarded.names.requests else "reaction"
    late = "" if guarded.made else ", or the alarm came too late"
    for found in result.properties:
        if found.verdict is not Verdict.VIOLATED or found.trace is None:
            continue
        if found.trace.failed_at == 0:
            yield f"`{found.name}` is violated before the first turn: give {outputs} another `init`"
        elif alarm_at_the_end(found.trace, alarm):
            yield f"`{found.name}` is violated although `{alarm}` is set: the {what} does not keep it{late}"
        else:
            yield (
                f"`{found.name}` is violated while `{alarm}` is not set: the monitor did not see it coming, or it "
                f"depends on more than {outputs}"
            )
    yield from dict.fromkeys(_fault_reason(guarded, finding, what) for finding in result.faults.findings)


def _fault_reason(guarded: Guarded, finding: FaultFinding, what: str) -> str:
    """Whose action faults, and whether the guard has taken over by then."""
    site, names, last = finding.site, guarded.names, finding.trace.steps[-1].machine
    alarmed = alarm_at_the_end(finding.trace, names.alarm)
    when = f"while `{names.alarm}` is set" if alarmed else "when the guarded machines do anything"
    place = f"({site.code}{'' if site.span is None else f', {site.span}'}) {when}"
    if site.code == SURROUNDINGS["F001"]:
        return f"the model of the surroundings leaves the range of `{site.variable}` {place}: clamp it there"
    if site.code in SURROUNDINGS.values():
        return f"the model of the surroundings ends the run in a fault {place}: correct the model"
    mend = f"correct the {what}" if alarmed and last == names.switch else f"correct `{last}`, or guard it as well"
    return f"`{last}` ends the run in a fault {place}: {mend}"


def alarm_at_the_end(trace: Trace, alarm: str) -> bool:
    """Whether the alarm is set where the property has failed for good."""
    value = dict(trace.initial).get(alarm, "false")
    for step in trace.steps if trace.failed_at is None else trace.steps[: trace.failed_at]:
        for change in step.changes:
            if change.variable == alarm:
                value = change.after
    return value == "true"
