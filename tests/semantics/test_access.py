"""Clearances by hand: a Trojan machine, whose attacks are refused when they are loaded or when they run."""

from __future__ import annotations

import pytest

from llfsm_verify.arrangement import load_arrangement_text
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.report.tracetable import rows
from llfsm_verify.report.wording import sentences
from llfsm_verify.verification.verify import verify

TEXT = """
whiteboard:
  motor: {type: 0..3, role: output}
  alarm: {type: bool}
  lamp: {type: bool}
  row: {type: {array: bool, size: 2}}
  zero: {type: 0..1, role: input}
machines:
  trojan:
    inline:
      machine: Trojan
      parameters: {slot: {whiteboard: 0..3}, victim: machine}
      states:
        - {name: S, internal: "ATTACK", stays: true}
    parameters: {slot: motor, victim: monitor}
  monitor:
    inline:
      machine: Monitor
      states:
        - {name: CALM, transitions: [{when: motor > 1, to: ALARM}]}
        - {name: ALARM, on_entry: alarm = true; motor = 0; unload(other);, stays: true}
  other:
    inline: {machine: Other, states: [{name: S, internal: lamp = !lamp;, stays: true}]}
schedule: [trojan, monitor, other]
access:
  levels: [public, control, safety]
  machines: {monitor: safety, trojan: control}
  write: {motor: safety, alarm: safety, row: control, lamp: public}
  command: {other: safety}
  on_violation: REACTION
"""

ATTACKS = {
    "a write": ("motor = 3;", "write `motor`"),
    "a write through a parameter": ("slot = 3;", "write `motor`"),
    "a write in a branch that is never taken": ("if (false) motor += 1;", "write `motor`"),
    "resetting the alarm": ("alarm = false;", "write `alarm`"),
    "suspending the monitor": ("suspend(monitor);", "suspend `monitor`"),
    "suspending the monitor through a parameter": ("suspend(victim);", "suspend `monitor`"),
    "suspending everybody": ("suspend_all();", "suspend `monitor`"),
    "restarting the monitor": ("restart(monitor);", "restart `monitor`"),
    "unloading the monitor": ("unload(monitor);", "unload `monitor`"),
    "loading what is guarded": ("load_suspended(other);", "load `other`"),
}


def arrangement(attack: str, reaction: str) -> Arrangement:
    return load_arrangement_text(TEXT.replace("ATTACK", attack).replace("REACTION", reaction), "a.yaml")


def verdicts(subject: Arrangement, *formulas: str, engine: str = "explicit") -> list[str]:
    result = verify(subject, parse_properties([Source("p", "\n".join(formulas))]), Options(), engine)
    return [p.verdict.value for p in result.properties]


@pytest.mark.parametrize(("attack", "what"), ATTACKS.values(), ids=ATTACKS)
def test_an_attack_is_an_error_at_its_place(attack: str, what: str) -> None:
    with pytest.raises(DiagnosticError) as raised:
        arrangement(attack, "reject")
    for found in raised.value.diagnostics:
        assert found.code == "E157" and found.span is not None
        assert (found.span.line, found.span.column) == (14, 32 + attack.index(found.span.text))
        assert found.message.startswith("machine `trojan` (control) may not ")
    assert f"machine `trojan` (control) may not {what}: that needs `safety`" in {
        d.message for d in raised.value.diagnostics
    }


@pytest.mark.parametrize(("attack", "what"), ATTACKS.values(), ids=ATTACKS)
def test_an_attack_is_refused_when_it_runs(attack: str, what: str) -> None:
    found = verdicts(
        arrangement(attack, "refuse"),
        "G (motor == 0 && !alarm)", "G (monitor.loaded && !monitor.suspended && !refused(monitor))",
        "G (monitor@CALM && other.loaded && !other.suspended)", "G (refused(trojan) -> trojan.ran)",
    )  # fmt: skip
    assert found == ["holds"] * 4
    refused = "violated" if "false)" not in attack else "holds"
    assert verdicts(arrangement(attack, "refuse"), "G !refused(trojan)") == [refused]


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["explicit", "induction", "pdr"])
def test_nobody_below_safety_writes_the_motor(engine: str) -> None:
    attacks = " ".join(attack for attack, _ in ATTACKS.values())
    subject = arrangement(attacks, "refuse")
    assert verdicts(subject, "G (changed(motor) -> monitor.ran)", engine=engine) == ["holds"]


def test_what_is_refused_is_evaluated_and_the_action_goes_on() -> None:
    subject = arrangement("motor = 3 / zero; row[zero] = true; lamp = true;", "refuse")
    result = verify(
        subject, parse_properties([Source("p", "lit: X (row[0] || row[1]) && X lamp")]), Options(), "explicit"
    )
    assert [p.verdict.value for p in result.properties] == ["holds"]
    (fault,) = result.faults.findings
    assert fault.site.code == "F002"
    index = arrangement("alarm = false; motor = 2 + 2 * zero;", "refuse")
    assert (
        verify(index, parse_properties([Source("p", "x: G true")]), Options(), "explicit").faults.verdict.value
        == "holds"
    )


def test_a_trojan_that_faults_on_purpose() -> None:
    text = TEXT.replace("ATTACK", "motor = 1 / zero;").replace("REACTION", "refuse")
    text = text.replace("    parameters: {slot: motor", "    on_fault: unload\n    parameters: {slot: motor")
    subject = load_arrangement_text(text, "a.yaml")
    assert (
        verdicts(subject, "G (motor == 0)", "G F monitor.ran", "G (faulted(trojan) -> X G !trojan.ran)")
        == ["holds"] * 3
    )


def test_oneself_may_be_suspended_but_not_unloaded_above_ones_clearance() -> None:
    text = "suspend(self); resume(self); restart(self);"
    assert arrangement(text, "reject").access is not None
    guarded = TEXT.replace("command: {", "command: {trojan: safety, ").replace("REACTION", "reject")
    with pytest.raises(DiagnosticError, match="may not unload `trojan`"):
        load_arrangement_text(guarded.replace("ATTACK", "unload(self);"), "a.yaml")
    load_arrangement_text(guarded.replace("ATTACK", text), "a.yaml")


def test_what_a_machine_above_the_lowest_level_writes_has_a_class() -> None:
    with pytest.raises(DiagnosticError) as raised:
        load_arrangement_text(
            TEXT.replace("alarm: safety, ", "").replace("ATTACK", "lamp = true;").replace("REACTION", "refuse"),
            "a.yaml",
        )
    (found,) = raised.value.diagnostics
    assert (found.code, found.span.line) == ("E158", 4)
    assert found.message == "machine `monitor` (safety) writes `alarm`, to which `access` gives no class"


def test_an_operator_needs_a_user_who_may() -> None:
    text = TEXT.replace("ATTACK", "lamp = true;").replace("REACTION", "reject")
    operated = text + "operators: {write: [motor], suspend: [trojan]}\n"
    with pytest.raises(DiagnosticError) as raised:
        load_arrangement_text(operated, "a.yaml")
    assert [d.message for d in raised.value.diagnostics] == [
        "nobody may write `motor`: it needs `safety`", "nobody may suspend `trojan`: it needs `control`",
    ]  # fmt: skip
    subject = load_arrangement_text(
        operated.replace("  on_violation", "  users: {alice: safety}\n  on_violation"), "a.yaml"
    )
    assert subject.access is not None and dict(subject.access.users) == {"alice": 2}


def test_a_trace_tells_what_was_refused_and_where() -> None:
    subject = arrangement("suspend(monitor); motor = 3;", "refuse")
    result = verify(subject, parse_properties([Source("p", "never: G !refused(trojan)")]), Options(), "explicit")
    (trace,) = [p.trace for p in result.properties if p.trace is not None]
    (step,) = [s for s in trace.steps if s.events]
    assert [(e.kind, e.site.code, e.site.span.line, e.site.span.column) for e in step.events if e.site.span] == [
        ("refused", "E157", 14, 32), ("refused", "E157", 14, 50),
    ]  # fmt: skip
    first = "in step 1 something is refused: machine `trojan` (control) may not suspend `monitor`: that needs `safety`"
    assert sentences(trace)[0] == f"{first} (a.yaml:14:32)"
    assert [r.changes for r in rows(trace)][1] == "refused"


def test_a_question_that_is_never_true_is_noted() -> None:
    lines = parse_properties([Source("p", "G !refused(monitor)\nG !faulted(trojan)")])
    assert verify(arrangement("motor = 3;", "refuse"), lines, Options(), "explicit").notes == (
        "`faulted(trojan)` is never true: `trojan` has no `on_fault: unload`",
        "`refused(monitor)` is never true: `monitor` does nothing that it may not",
    )
