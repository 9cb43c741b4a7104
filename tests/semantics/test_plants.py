"""Models of the surroundings, and machines that choose: docs/semantics.md, The model of the surroundings."""

from __future__ import annotations

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement import build_arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Int
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

Document = dict[str, object]
IDLE: Document = {"name": "IDLE", "stays": True}


def machine(*states: Document, **more: object) -> Document:
    return {"inline": {"machine": "M", "states": list(states), **more}}


def arrangement(environment: Document | None, machines: dict[str, Document], **more: object) -> Document:
    whiteboard = {
        "n": {"type": "0..3", "role": "input"},
        "free": {"type": "bool", "role": "input"},
        "out": {"type": "0..3"},
    }
    document: Document = {"whiteboard": whiteboard, "machines": machines, "schedule": list(machines), **more}
    return document if environment is None else {**document, "environment": environment}


def verdicts(document: Document, text: str, engine: str = "explicit") -> dict[str, str]:
    lines = parse_properties([Source("p", text)])
    result = verify(build_arrangement(document), lines, Options(), engine)
    return {p.name: p.verdict.value for p in result.properties}


def hold(document: Document, *formulas: str) -> None:
    text = "\n".join(f"p{i}: {f}" for i, f in enumerate(formulas))
    assert verdicts(document, text) == {f"p{i}": "holds" for i in range(len(formulas))}


def fail(document: Document, *formulas: str) -> None:
    text = "\n".join(f"p{i}: {f}" for i, f in enumerate(formulas))
    assert verdicts(document, text) == {f"p{i}": "violated" for i in range(len(formulas))}


COUNTS = machine({"name": "COUNT", "internal": "n = n == 3 ? 0 : n + 1;"})


def test_its_ringlet_is_at_the_beginning_of_every_cycle() -> None:
    document = arrangement(COUNTS, {"a": machine(IDLE), "b": machine(IDLE)})
    hold(
        document,
        "n == 0",
        "X n == 1",
        "X X n == 1",
        "X X X n == 2",
        "G (changed(n) <-> a.ran)",
        "G env.entered || X env.entered",
    )


def test_the_first_machine_that_is_live_begins_the_cycle() -> None:
    document = arrangement(COUNTS, {"a": machine({"name": "DONE"}), "b": machine(IDLE)})
    hold(document, "X (a.ran && n == 1)", "X X (b.ran && n == 1)", "X X X (b.ran && n == 2)", "G F n == 0")


def test_the_machines_of_a_cycle_read_what_it_wrote_before_them() -> None:
    document = arrangement(COUNTS, {"a": machine({**IDLE, "internal": "out = n;"})})
    hold(document, "G out == n", "G (n == 1 -> out == 1)")


def test_it_reads_what_machines_wrote() -> None:
    plant = machine({"name": "FOLLOW", "internal": "n = out;"})
    document = arrangement(plant, {"a": machine({**IDLE, "internal": "out = out == 3 ? 0 : out + 1;"})})
    hold(document, "X (n == 0 && out == 1)", "X X (n == 1 && out == 2)", "X X X (n == 2 && out == 3)")


def test_what_it_does_not_write_keeps_its_value_and_other_inputs_are_free() -> None:
    plant = machine({"name": "ONCE", "on_entry": "n = 2;"})
    document = arrangement(plant, {"a": machine({**IDLE, "internal": "out = free ? 1 : 0;"})})
    hold(document, "X G n == 2", "X G env@ONCE")
    fail(document, "G (a.ran -> free)", "G (a.ran -> !free)")


def test_it_does_not_count_for_the_end_and_stops_with_it() -> None:
    document = arrangement(COUNTS, {"a": machine({"name": "DONE"})})
    hold(document, "X G n == 1", "X G a.finished")


def test_its_clock_counts_cycles() -> None:
    states: tuple[Document, ...] = (
        {"name": "LOW", "on_entry": "n = 0;", "transitions": [{"when": "after_ms(10)", "to": "HIGH"}]},
        {"name": "HIGH", "on_entry": "n = 3;"},
    )
    document = arrangement(machine(*states), {"a": machine(IDLE)}, cycle_ms=10)
    hold(document, "X env@LOW", "X X env@LOW", "X X X (env@HIGH && n == 0)", "X X X X (env@HIGH && n == 3)")
    untimed = arrangement(machine(*states), {"a": machine(IDLE)}, timing="untimed")
    hold(untimed, "F env@HIGH")
    fail(untimed, "X X X env@HIGH", "X X env@LOW && X X X env@LOW")


@pytest.mark.parametrize(
    ("choice", "values"),
    [
        ("choose(0..3)", {0, 1, 2, 3}),
        ("choose(1..2)", {0, 1, 2}),
        ("choose(3, 1)", {0, 1, 3}),
        ("choose(2)", {0, 2}),
        ("choose(1 + 1, 3, 3)", {0, 2, 3}),
    ],
)
def test_what_may_be_chosen(choice: str, values: set[int]) -> None:
    document = arrangement(machine({"name": "ANY", "internal": f"n = {choice};"}), {"a": machine(IDLE)})
    for value in range(4):
        (fail if value in values else hold)(document, f"G n != {value}")


def test_choices_have_names_and_the_values_of_their_types() -> None:
    types = {"Colour": ["RED", "GREEN", "BLUE"]}
    whiteboard = {"c": {"type": "Colour", "role": "input"}, "b": {"type": "bool", "role": "input"}}
    text = "c = choose(Colour); c = choose(BLUE, RED); b = choose(bool); int8 x = choose(int8);"
    document = {
        "types": types, "whiteboard": whiteboard, "machines": {"a": machine(IDLE)}, "schedule": ["a"],
        "environment": machine({"name": "S", "internal": text}),
    }  # fmt: skip
    choices = lower(build_arrangement(document)).choices
    assert [(c.name, c.type.low, c.type.high, c.labels) for c in choices] == [
        ("env.choose(c)", 0, 2, ("RED", "GREEN", "BLUE")),
        ("env.choose(c)#2", 0, 1, ("BLUE", "RED")),
        ("env.choose(b)", 0, 1, ()),
        ("env.choose(x)", -128, 127, ()),
    ]
    assert choices[2].type == Int(0, 1, True)
    assert {c.kind for c in choices} == {"choose"}


def test_a_scheduled_machine_may_be_a_model() -> None:
    chaos = {**machine({**IDLE, "internal": "out = choose(0..3);"}), "model": True}
    document = arrangement(None, {"chaos": chaos, "a": machine(IDLE)})
    fail(document, *(f"G out != {i}" for i in range(1, 4)), "G F out == 1")
    hold(document, "G (changed(out) -> chaos.ran)")
    assert build_arrangement(document).machine("chaos").model


def test_under_after_entry_an_entry_action_sees_the_sample_before() -> None:
    states = ({"name": "A", "on_entry": "out = n;", "transitions": [{"when": "true", "to": "B"}]},
              {"name": "B", "on_entry": "out = n;", "transitions": [{"when": "true", "to": "A"}]})  # fmt: skip
    document = arrangement(COUNTS, {"a": machine(*states)}, profile={"base": "llfsm", "snapshot": "after_entry"})
    hold(document, "X (n == 1 && out == 0)", "X X (n == 2 && out == 1)", "X X X (n == 3 && out == 2)")


def test_samples_of_what_it_writes() -> None:
    document = arrangement(COUNTS, {"a": machine({**IDLE, "internal": "out = n;"}), "b": machine(IDLE)})
    hold(document, "G sampled(n) == n", "G a.sampled(n) == n", "G (a.read(n) <-> a.ran)", "G !b.read(n)")


@pytest.mark.slow
def test_it_writes_elements_of_inputs_by_number() -> None:
    plant = machine(
        {"name": "S", "internal": "i = choose(0..2); row[i] = true; pairs[i % 2].x += 1;"},
        variables={"i": {"type": "0..2"}},
    )
    whiteboard = {
        "row": {"type": {"array": "bool", "size": 3}, "role": "input"},
        "pairs": {"type": {"array": {"record": {"x": "uint8"}}, "size": 2}, "role": "input"},
    }
    document = {"whiteboard": whiteboard, "machines": {"a": machine(IDLE)}, "schedule": ["a"], "environment": plant}
    hold(
        document, "G (env.i == 1 && env.entered -> row[1] && pairs[1].x > 0 || pairs[1].x == 0)",
        "X (env.i == 2 -> row[2] && !row[0] && !row[1] && pairs[0].x == 1)",
    )  # fmt: skip
    fail(document, "G !row[0]", "G !row[1]", "G !row[2]", "G pairs[1].x < 2")


def test_a_fault_of_its_own() -> None:
    plant = machine({"name": "UP", "internal": "n = n + 1;"})
    result = verify(
        build_arrangement(arrangement(plant, {"a": machine(IDLE)})), parse_properties([Source("p", "G n <= 3")]),
        Options(), "explicit",
    )  # fmt: skip
    (finding,) = result.faults.findings
    assert finding.site.code == "F011"
    assert finding.site.message == "value outside its range: n is declared 0..3 (in the model of the surroundings)"
    assert len(finding.trace.steps) == 4


def test_a_seed_decides_what_it_chooses() -> None:
    model = lv.build(
        "m",
        {"a": lv.MachineDefinition("M", {"IDLE": lv.StateDefinition(stays=True)})},
        whiteboard={"n": {"type": "0..3", "role": "input"}},
        environment=lv.MachineDefinition("P", {"ANY": lv.StateDefinition(internal="n = choose(0..3);")}),
    )

    def run(seed: int) -> list[object]:
        simulated = model.simulate(20, seed=seed, hold="2cycles")
        return [simulated.values(step)["n"] for step in range(1, 21)]

    assert run(1) == run(1)
    assert {*run(1)} == {0, 1, 2, 3}
    assert run(1) != run(2)


def test_a_choice_of_very_many_values_is_made_at_once() -> None:
    text = "int32 x = choose(int32); n = x > 5 ? 1 : 0; int y = choose(-9000000000000000000..9000000000000000000);"
    document = arrangement(machine({"name": "S", "internal": text}), {"a": machine(IDLE)})
    program = lower(build_arrangement(document))
    assert [c.type.high for c in program.choices if c.kind == "choose"] == [2**31 - 1, 9 * 10**18]


def test_what_it_chooses_can_be_given_to_a_simulation() -> None:
    model = lv.build(
        "m",
        {"a": lv.MachineDefinition("M", {"IDLE": lv.StateDefinition(stays=True)})},
        whiteboard={"n": {"type": "0..3", "role": "input"}},
        environment=lv.MachineDefinition("P", {"ANY": lv.StateDefinition(internal="n = choose(0..3);")}),
    )
    run = model.simulate(5, seed=1, inputs={"env.choose(n)": 2})
    assert {run.values(step)["n"] for step in range(1, 6)} == {2}
    with pytest.raises(ValueError, match=r"`n` is written by the model of the surroundings; .*: env.choose\(n\)"):
        model.simulate(5, inputs={"n": 2})


def test_nothing_is_said_of_when_it_entered_a_state() -> None:
    states: tuple[Document, ...] = (
        {"name": "A", "transitions": [{"when": "true", "to": "B"}]},
        {"name": "B", "on_entry": "n = 2;"},
    )
    lines = parse_properties([Source("p", "G (env@B -> n != 2)")])
    found = verify(build_arrangement(arrangement(machine(*states), {"a": machine(IDLE)})), lines, Options(), "explicit")
    assert found.properties[0].notes == ()


def test_no_monitor_machine_reads_it() -> None:
    from llfsm_verify.monitoring.machine_reads import reads

    model = build_arrangement(arrangement(COUNTS, {"a": machine(IDLE)}))
    for text in ("G !env@COUNT", "G env.entered"):
        lines = parse_properties([Source("p", text)])
        with pytest.raises(DiagnosticError) as caught:
            reads(lines.atoms, model)
        assert "absent when the arrangement runs" in str(caught.value)


def several(*plants: Document, **more: object) -> Document:
    """Plants `p0`, `p1`, … and a machine that does nothing."""
    return arrangement({f"p{i}": plant for i, plant in enumerate(plants)}, {"a": machine(IDLE)}, **more)


def test_several_have_their_ringlets_in_the_order_written() -> None:
    follows = machine({"name": "FOLLOW", "internal": "free = n == 1;"})
    hold(several(COUNTS, follows), "G (free <-> n == 1)", "G p0@COUNT && G p1@FOLLOW", "X (n == 1 && free)")
    hold(several(follows, COUNTS), "X (n == 1 && !free)", "X X (n == 2 && free)")


def test_each_has_variables_and_a_clock_of_its_own() -> None:
    def timed(text: str) -> Document:
        states: tuple[Document, ...] = (
            {
                "name": "LOW",
                "variables": {"k": {"type": "0..1"}},
                "transitions": [{"when": "after_ms(10)", "to": "UP"}],
            },
            {"name": "UP", "on_entry": text},
        )
        return machine(*states, variables={"k2": {"type": "0..1", "init": 1}})

    document = several(timed("n = 3;"), timed("free = true;"), cycle_ms=10)
    hold(document, "X X X X (n == 3 && free)", "X X X (n == 0 && !free)", "G (p0.k2 == 1 && p1.LOW.k == 0)")


def test_python_names_several() -> None:
    plants = {
        name: lv.MachineDefinition("P", {"ANY": lv.StateDefinition(internal=f"{name} = choose(bool);")})
        for name in ("left", "right")
    }
    model = lv.build(
        "m",
        {"a": lv.MachineDefinition("M", {"IDLE": lv.StateDefinition(stays=True)})},
        whiteboard={name: {"type": "bool", "role": "input"} for name in plants},
        environment={f"p_{name}": plant for name, plant in plants.items()},
    )
    found = model.check({"a": "G (left -> right)", "b": "G (p_left@ANY && p_right@ANY)"})
    assert [found["a"].verdict, found["b"].verdict] == ["violated", "holds"]


def test_a_plant_that_two_properties_name_is_absent_at_run_time() -> None:
    from llfsm_verify.monitoring.machine_reads import surroundings_in

    found = surroundings_in(
        parse_properties([Source("p", "G (p1.entered || p0.entered)")]).atoms,
        build_arrangement(several(COUNTS, machine({"name": "ON", "internal": "free = true;"}))),
    )
    assert found is not None
    assert "`p1` is the model of the surroundings" in found.message


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["bmc", "induction", "pdr", "auto"])
def test_the_other_engines_know_it(engine: str) -> None:
    document = arrangement(machine({"name": "ANY", "internal": "n = choose(0, 3);"}), {"a": machine(IDLE)})
    found = verdicts(document, "two: G n != 2\nthree: G n != 3\nagain: G F n == 0", engine)
    proved = "unknown" if engine == "bmc" else "holds"
    assert found == {"two": proved, "three": "violated", "again": "violated"}
