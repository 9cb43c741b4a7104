"""Outside guards as processes of the arrangement: the computed bound of their reaction is proved, and is exact."""

from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, reject, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.verdict import Options, Verdict
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.extensions.guards.outside import with_outside_guard
from llfsm_verify.extensions.guards.transform import Task
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.runtime.outside.reaction_time import Order, Pace, reaction_time
from llfsm_verify.testing.arrangements import arrangements
from llfsm_verify.verification.verify import verify
from tests.extensions.guards.helpers import draft_of, lines_of, text_of
from tests.quick import AtLeast, examples, many, spread

LAMP = """\
name: lamp
cycle_ms: 10
observe: cycle
whiteboard:
  go: {type: bool, role: input}
  lamp: {type: bool, role: output}
  broken: {type: bool} # another one
  mode: {type: 0..3}
machines:
  m:
    inline:
      machine: M
      states:
        - name: S
          internal: lamp = go; mode = 1;
          stays: true
  spare: {inline: {machine: Spare, states: [{name: A, on_entry: lamp = false;, stays: true}]}}
schedule:
  - m # first
pool: [spare]
operators: {suspend: [m], load: [spare], write: [mode]}
environment: {inline: {machine: Env, states: [{name: E, internal: "go = choose(bool);", stays: true}]}}
access: {levels: [low, high], machines: {m: high}, write: {lamp: low, mode: low}, users: {root: high}}
"""
UNFIT = {"E438", "E430"}
SUSPEND, WRITE, LOAD = Order("suspend", "m"), Order("write", "mode", "2"), Order("load", "spare")


def outside(given, orders, pace, *texts):
    draft = draft_of(given)
    lines = lines_of(*texts)
    task = Task(lines.goals, lines.assumptions, None, bind(resolve(draft), lines).clock)
    return with_outside_guard(draft, orders, pace, task, Path("guarded"))


def verdicts(made, limits=Limits()):  # noqa: B008 - it is frozen
    lines = parse_properties([Source("reaction", made.properties)])
    result = verify(made.arrangement, lines, Options(limits, faults=False), "explicit")
    return [found.verdict for found in result.properties]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pace", "orders"),
    [(Pace(1), [SUSPEND]), (Pace(2), [WRITE, SUSPEND, LOAD]), (Pace(3), [LOAD]), (Pace(2, 3), [SUSPEND, WRITE])],
)
def test_the_computed_bound_is_proved_and_one_cycle_less_is_violated(pace, orders):
    made = outside(LAMP, orders, pace, "dark: G !lamp")
    assert f"within_{reaction_time(pace, len(orders)).cycles}:" in made.properties
    assert verdicts(made) == [Verdict.HOLDS, Verdict.VIOLATED]


@pytest.mark.slow
def test_without_the_assumption_on_the_pace_no_bound_holds():
    made = outside(LAMP, [SUSPEND], Pace(2), "dark: G !lamp")
    lines = "".join(line for line in made.properties.splitlines(keepends=True) if "assume" not in line)
    result = verify(made.arrangement, parse_properties([Source("reaction", lines)]), Options())
    assert [found.verdict for found in result.properties] == [Verdict.VIOLATED, Verdict.VIOLATED]


def test_the_files():
    made = outside(LAMP, [LOAD, WRITE], Pace(2, 2), "dark: G !lamp", "low: G mode < 3")
    main, *others = made.files
    assert others == [
        "monitor.machine.yaml",
        "monitor_2.machine.yaml",
        "inbox.machine.yaml",
        "guard.machine.yaml",
        "reaction.ltl",
    ]
    text = made.files[main]
    kept = [line for line in text.split("\n") if line in LAMP.split("\n")]
    assert "  broken: {type: bool} # another one" in kept
    added = [line for line in text.split("\n") if line not in LAMP.split("\n")]
    machines = "monitor: guard, monitor_2: guard, inbox: guard, guard: guard"
    write = "mode: behaviour, broken_2: guard, asked: guard, taken: guard"
    access = f"access: {{levels: [behaviour, guard], machines: {{{machines}}}, write: {{{write}}}}}"
    assert added == [
        "  broken_2: {type: bool, init: false}",
        "  asked: {type: bool, init: false}",
        "  taken: {type: 0..2, init: 0}",
        "  monitor: {file: monitor.machine.yaml, parameters: {lamp: lamp, broken_2: broken_2}}",
        "  monitor_2: {file: monitor_2.machine.yaml, parameters: {mode: mode, broken_2: broken_2}}",
        "  inbox: {file: inbox.machine.yaml}",
        "  guard: {file: guard.machine.yaml}",
        "processes:",
        "  {watched: [inbox, m], guarding: [guard]} # first",
        "pool: {watched: [spare, monitor, monitor_2]}",
        access,
    ]


@pytest.mark.parametrize(
    ("change", "orders", "text", "code", "why"),
    [
        (("", ""), [Order("enter", "m", "ON")], "dark: G !lamp", "E438", "`enter m ON` is for operators alone"),
        (("", ""), [Order("suspend", "spare")], "dark: G !lamp", "E438", "`suspend spare` would be refused"),
        (("", ""), [SUSPEND], "on: G F lamp", "E437", "no frame violates `on`"),
        (("low, high]", "low, high], on_violation: refuse"), [SUSPEND], "dark: G !lamp", "E438", "clearances"),
        (("schedule:\n  - m # first\npool: [spare]", "processes: {a: [m], b: [spare]}"), [SUSPEND], "dark: G !lamp",
         "E438", "several processes"),
        (("", ""), [SUSPEND], "own: G !m.ran", "E430", "cannot read `m`"),
    ],
)  # fmt: skip
def test_what_does_not_go_with_a_guard_outside(change, orders, text, code, why):
    given = LAMP.replace(*change) if change[0] else LAMP
    if "processes" in given:
        given = "".join(line for line in given.splitlines(keepends=True) if line[:4] not in ("envi", "obse"))
    with pytest.raises(DiagnosticError) as raised:
        outside(given, orders, Pace(), text)
    (found,) = raised.value.diagnostics
    assert found.code == code
    assert why in found.message


def test_whoever_suspends_all_does_not_suspend_the_guard():
    text = LAMP.replace("lamp = go; mode", "suspend_all(); lamp = go; mode").replace("access:", "# access:")
    made = outside(text, [SUSPEND], Pace(), "dark: G !lamp")
    assert made.arrangement.access.refuses


def agree(count):
    """In random arrangements no reaction is later, and where a frame breaks the rule one cycle less is too little."""
    tally = Counter()

    def check(data):
        document = data.draw(arrangements(max_machines=2, max_states=3))
        machines = list(document["machines"])
        if "schedule" not in document or "environment" in document:
            reject()
        name = data.draw(st.sampled_from(machines))
        document = {**document, "name": "random", "operators": {"suspend": [name]}}
        document.pop("access", None)
        arrangement = resolve(draft_of(text_of(document)))
        machine = arrangement.machine(name)
        state = data.draw(st.sampled_from([s.name for s in machine.states]))
        pace = Pace(data.draw(st.integers(1, 2)), data.draw(st.integers(1, 2)))
        try:
            made = outside(text_of(document), [Order("suspend", name)], pace, f"not_there: G !{name}@{state}")
        except DiagnosticError as error:
            tally[error.diagnostics[0].code] += 1
            if {d.code for d in error.diagnostics} <= UNFIT:
                return
            raise
        found = verdicts(made, Limits(max_states=3000))
        tally[found[0].value, found[1].value] += 1
        assert found[0] is not Verdict.VIOLATED

    amount = settings(max_examples=count, deadline=None, suppress_health_check=list(HealthCheck))
    spread(check, amount, st.data(), size=10, until=AtLeast(tally, {("holds", "violated"): 3}))


@pytest.mark.slow
def test_random_arrangements_keep_the_bound():
    agree(examples(8))


@pytest.mark.long
def test_many_random_arrangements_keep_the_bound():
    agree(many(300))
