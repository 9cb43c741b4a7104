"""Files given in each other's place: one diagnostic that says so, and how to call."""

from __future__ import annotations

import pytest

from tests.cli.running import LIGHTS, PROPERTIES, llfsm

MACHINE = "models/traffic_lights/light.machine.yaml"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((PROPERTIES,), "looks like a property file, and an arrangement is expected"),
        ((PROPERTIES, LIGHTS), "name the arrangement before it: `llfsm-verify ARRANGEMENT"),
        ((MACHINE,), "looks like a machine file, and an arrangement is expected"),
        ((LIGHTS, LIGHTS), "looks like an arrangement, and a property file is expected"),
        ((LIGHTS, PROPERTIES, MACHINE), "looks like a machine file, and a property file is expected"),
    ],
    ids=["properties", "swapped", "machine", "two arrangements", "machine behind"],
)
def test_one_diagnostic_that_says_what_it_is(arguments, says):
    done = llfsm("verify", *arguments)
    assert done.returncode == 3 and done.stderr.count("[E") == 1 and "error[E019]" in done.stderr
    assert says in done.stderr and "hint:" in done.stderr


THEORY = "% cook\ninput {a}.\nC0: {} => ~b.\nC1: a -> b.\noutput {b b}.\n"


@pytest.mark.parametrize(
    ("command", "expected"),
    [("verify THEORY", "an arrangement"), (f"verify {LIGHTS} THEORY", "a property file"), ("draw THEORY", "an arrang")],
)
def test_a_theory_is_named_by_an_arrangement(tmp_path, command, expected):
    theory = tmp_path / "cook.d"
    theory.write_text(THEORY)
    done = llfsm(*command.replace("THEORY", str(theory)).split())
    assert done.returncode == 3 and done.stderr.count("[E") == 1
    assert f"cook.d:1:1: error[E019]: this looks like a theory, and {expected}" in done.stderr
    assert f"(`knowledge: {{NAME: {{file: …}}}}`), or call `llfsm knowledge table {theory}`" in done.stderr


def test_a_theory_without_inputs_is_known_by_its_name(tmp_path):
    theory = tmp_path / "cook.d"
    theory.write_text("a -> b.\n")
    assert "this looks like a theory" in llfsm("verify", str(theory)).stderr


def test_yaml_from_standard_input_as_properties():
    done = llfsm("verify", LIGHTS, "-", stdin="machines:\n  m: {file: a.yaml}\nschedule: [m]\n")
    assert done.returncode == 3 and done.stderr.startswith("<stdin>:1:1: error[E019]") and done.stderr.count("[E") == 1


def test_a_trace_as_an_arrangement_says_how_to_replay(tmp_path):
    trace = tmp_path / "t.trace.yaml"
    trace.write_text("trace: 1\narrangement: a.yaml\nsteps: []\n")
    assert f"call `llfsm replay {trace}`" in llfsm("verify", str(trace)).stderr


def test_real_mistakes_in_a_property_file_stay():
    done = llfsm("verify", LIGHTS, "-", stdin="a: G (ns@GREEN\nb: F F(\n")
    assert done.returncode == 3 and "E019" not in done.stderr and done.stderr.count("error[E") == 2
