"""What is proved with chaos holds for any machines: random ones take the places of those that are guarded."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest
from hypothesis import reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.formats.reading import Reading
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.guards.reactions import KINDS
from llfsm_verify.language.types import BoolType, EnumType, FixedType, RangeType, scalar_text
from llfsm_verify.limits import Limits
from llfsm_verify.verification.verify import verify
from tests.extensions.guards.helpers import draft_of, guarded, lines_of, proved
from tests.extensions.guards.test_random_guards import NOT_GUARDABLE, SLOW, condition, drawn
from tests.quick import each, many, spread

FAULT = "0..1 fails = 1; fails = fails / (fails - 1);"
LIMITS = Limits(3_000, max_steps=100_000)
TALLY = Counter()


class Writer:
    """Writes a machine with the states of `machine` that does what `access` allows it."""

    def __init__(self, arrangement, machine, random):
        self.arrangement, self.machine, self.random = arrangement, machine, random

    def may_write(self, name):
        access = self.arrangement.access
        return access is None or (
            access.may_write(self.machine.name, name)
            and (name in access.write or not access.clearance(self.machine.name))
        )

    def values(self, kind):
        if isinstance(kind, EnumType):
            return kind.values
        return (
            ["true", "false"] if isinstance(kind, BoolType) else [scalar_text(v, kind) for v in (kind.low, kind.high)]
        )

    def scalars(self, *roles):
        kinds = (BoolType, EnumType, FixedType, RangeType)
        return [
            w.variable for w in self.arrangement.whiteboard if w.role in roles and isinstance(w.variable.type, kinds)
        ]

    def guard(self):
        pick = self.random.choice
        other = pick(self.arrangement.machines)
        variable = pick(self.scalars("input", "output", "shared"))
        return pick(
            [
                f"{variable.name} == {pick(self.values(variable.type))}",
                f"{variable.name} != {pick(self.values(variable.type))}",
                f"is_running({other.name})",
                f"{other.name}@{pick(other.states).name}",
            ]
        )

    def statement(self):
        pick = self.random.choice
        writable = [v for v in self.scalars("output", "shared") if self.may_write(v.name)]
        if writable and self.random.random() < 0.6:
            variable = pick(writable)
            return f"if ({self.guard()}) {variable.name} = {pick(self.values(variable.type))};"
        target, access = pick(self.arrangement.machines), self.arrangement.access
        kinds = ("suspend", "resume", "restart", *(() if target.nested else ("load", "load_suspended", "unload")))
        able = [k for k in kinds if access is None or access.may_command(self.machine.name, k, target.name)]
        return f"if ({self.guard()}) {pick(able)}({target.name});" if able else ""

    def text(self):
        machine, random = self.machine, self.random
        lines = ["machine: Other", f"initial: {machine.states[machine.initial].name!r}"]
        lines += [] if machine.suspend is None else [f"suspend: {machine.states[machine.suspend].name!r}"]
        lines.append("states:")
        for state in machine.states:
            lines.append(f"  - name: {state.name!r}")
            for kind in ("on_entry", "internal", "on_exit", "on_suspend", "on_resume"):
                parts = [self.statement() for _ in range(random.randint(0, 2))] + [FAULT] * (random.random() < 0.1)
                lines += [f"    {kind}: {' '.join(parts)!r}"] if any(parts) else []
            lines += [f"    runs: [{', '.join(state.runs)}]"] if state.runs else []
            others = [other.name for other in machine.states if other is not state]
            if others and not state.finishes:
                lines.append(f"    transitions: [{{when: {self.guard()!r}, to: {random.choice(others)!r}}}]")
            elif not state.finishes:
                lines.append("    stays: true")
        return "\n".join(lines) + "\n"


def with_others(made, names, random):
    """The guarded arrangement with a random machine in each of these places."""
    reading, machines = Reading(Path()), []
    for instance in made.draft.arrangement.machines:
        if instance.name.text in names:
            text = Writer(made.arrangement, made.arrangement.machine(instance.name.text), random).text()
            machine = reading.machine_text(f"other {instance.name.text}", text)
            instance = replace(instance, machine=machine, arguments=())
        machines.append(instance)
    arrangement = replace(made.draft.arrangement, machines=tuple(machines))
    return resolve(replace(made.draft, arrangement=arrangement, sources=(*made.draft.sources, *reading.sources)))


def no_other_machine_breaks_it(data, seed):
    text, output = drawn(data)
    before, random = resolve(draft_of(text)), Random(seed)
    start = scalar_text(output.init, output.type)
    alike = [w.variable.name for w in before.whiteboard if w.variable.type == output.type]
    shape = data.draw(st.sampled_from(["G ({0} -> {1})", "G ({0} -> X {1})", "G (Y {0} -> {1})", "{1} W {0}"]))
    line = "p: " + shape.format(condition(data, before), f"({output.name} == {start})")
    machine = random.choice(before.machines).name
    try:
        made, lines = guarded(
            text,
            [line],
            {output.name: random.choice([start, *alike])},
            random.choice([(), (machine,)]),
            until=random.choice([None, "true"]),
            reactions=random.choice([[], [f"{random.choice(list(KINDS))} {machine}"]]),
        )
    except DiagnosticError as error:
        if {d.code for d in error.diagnostics} <= {*NOT_GUARDABLE, "E436"}:
            reject()
        raise
    proof = proved(made, lines, "explicit", LIMITS)
    if proof.result is None or proof.result.properties[0].verdict is not Verdict.HOLDS:
        return
    TALLY["with fewest" if set(proof.machines) == set(made.names.guarded) else "with most"] += 1
    for _ in range(3):
        found = verify(with_others(made, proof.machines, random), lines_of(line), Options(LIMITS), "explicit")
        assert found.properties[0].verdict is not Verdict.VIOLATED
        TALLY[f"others {found.properties[0].verdict.value}"] += 1


@pytest.mark.long
def test_what_is_proved_holds_for_random_machines_in_the_places_of_chaos():
    TALLY.clear()
    amount = settings(max_examples=many(20), suppress_health_check=SLOW)
    kinds = ["with fewest", "with most", "others holds"]
    spread(no_other_machine_breaks_it, amount, st.data(), st.integers(1, 10_000), until=each(TALLY, kinds))
