"""A state machine test: what fails it, what it says, what it saves, and what it leaves untested."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import invariant, rule, run_state_machine_as_test

from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.testing import ArrangementStateMachine, RunFailed, Stretch, UntestedWarning
from tests.cli.running import llfsm

LIGHTS = Path("models/traffic_lights").absolute()
BOTH = "both: G !(ns@GREEN && ew@GREEN)"
PHASES = [phase for phase in Phase if phase is not Phase.explain]


def failing(machine, examples=100):
    """The failure that Hypothesis reports."""
    chosen = settings(
        max_examples=examples, phases=PHASES, deadline=None, database=None, suppress_health_check=list(HealthCheck)
    )
    with pytest.raises(RunFailed) as failed:
        run_state_machine_as_test(machine, settings=chosen)
    return failed.value


def passing(machine, examples=10):
    run_state_machine_as_test(machine, settings=settings(max_examples=examples, deadline=None, database=None))


class Faulty(ArrangementStateMachine):
    arrangement = LIGHTS / "faulty.yaml"
    properties = BOTH


@pytest.fixture(scope="module")
def failed(tmp_path_factory):
    """The failure of the faulty lights, and the folder for its trace."""
    folder = tmp_path_factory.mktemp("traces")

    class Lights(Faulty):
        traces = folder / "traces"

    return failing(Lights), folder / "traces"


@pytest.mark.slow
def test_a_violated_property_fails_with_steps_and_a_trace(failed):
    error, folder = failed
    text = str(error)
    assert (error.run.steps, error.run.changes) == (65, 1)
    assert text.startswith("both is violated: G !(ns@GREEN && ew@GREEN)\nInitially:\n  ns_turn = true ")
    assert re.search(r"\n 31 +11 +10 s +timer +CAR_WAITING +→ EW_TURN when after\(8\)", text)
    assert "Violated after step 65, however the run goes on." in text
    saved = folder / "both.trace.yaml"
    assert any(str(saved) in note for note in error.__notes__)
    # It is a test that fails until the lights are mended.
    still = llfsm("replay", str(saved), "--quiet")
    assert (still.returncode, still.stdout.count("the failure still happens")) == (1, 1)
    mended = llfsm("replay", str(saved), "--quiet", "--arrangement", str(LIGHTS / "arrangement.yaml"))
    assert (mended.returncode, mended.stdout.count("does not happen any more")) == (0, 1)


@pytest.mark.slow
def test_the_program_that_is_printed_fails_by_itself(failed):
    program = str(failed[0]).partition("The same run again:\n\n")[2]
    with pytest.raises(RunFailed) as again:
        exec(program, {})
    assert (again.value.run.steps, again.value.failure.names) == (65, ("both",))


@pytest.mark.slow
def test_the_sound_lights_pass():
    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"
        properties = BOTH
        strict = True

    passing(Lights)


@pytest.mark.slow
def test_statistics_say_how_long_runs_are(monkeypatch):
    said: list[str] = []
    monkeypatch.setattr("llfsm_verify.testing.stateful.event", said.append)

    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"
        ringlets = 0

        def after_ringlet(self):
            self.ringlets += 1

        def teardown(self):
            super().teardown()
            low, _, high = said[-1].removeprefix("run of ").removesuffix(" ringlets").replace(",", "").partition(" to ")
            assert int(low) <= self.ringlets <= int(high or low)

    passing(Lights)
    assert said


@pytest.mark.slow
def test_what_no_finite_run_violates_is_said_once():
    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"
        properties = f"{BOTH}\nserved: G F ew@GREEN\npart: G !(ns@GREEN && ew@GREEN) && G F ns@GREEN\n"

    words = (
        r"Lights: traffic_lights: not tested \(no finite run violates it\): served; tested in part "
        r"\(not every run that violates it has a finite part that does\): part\. `llfsm verify` decides them\."
    )
    with pytest.warns(UntestedWarning, match=words) as said:
        passing(Lights)
    assert len(said) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        passing(Lights)


def test_a_strict_test_has_nothing_untested():
    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"
        properties = f"{BOTH}\nserved: G F ew@GREEN\n"
        strict = True

    with pytest.raises(DiagnosticError, match=r"properties:2:9: error\[E470\]: `served` is not tested") as found:
        passing(Lights)
    assert len(found.value.diagnostics) == 1


@pytest.mark.slow
def test_own_rules_and_invariants():
    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"
        kept = ("car",)

        @rule(cycles=st.integers(1, 20))
        def a_car_comes(self, cycles):
            self.step(Stretch({"car": True}, cycles=cycles))

        @invariant()
        def never_east_west(self):
            assert self.state("ew") != "GREEN", self.simulation.values["ew_light"]

    with pytest.raises(AssertionError) as failed:
        run_state_machine_as_test(Lights, settings=settings(max_examples=50, phases=PHASES, database=None))
    (note,) = (note for note in failed.value.__notes__ if "run = subject.start()" in note)
    assert "→ GREEN when turn" in note and "run.cycles(" in note


@pytest.mark.slow
def test_something_to_be_asked_after_every_ringlet():
    seen = []

    class Lights(ArrangementStateMachine):
        arrangement = LIGHTS / "arrangement.yaml"

        def after_ringlet(self):
            seen.append(self.simulation.steps)

    passing(Lights, 10)
    assert seen[:3] == [1, 2, 3] and max(seen) > 20


def test_a_class_without_an_arrangement():
    class Lights(ArrangementStateMachine):
        pass

    with pytest.raises(TypeError, match="Lights names no arrangement"):
        Lights()


@pytest.mark.slow
def test_hypothesis_is_asked_for_by_its_name():
    code = (
        "import sys; sys.modules['hypothesis'] = None\n"
        "from llfsm_verify.testing import load\n"
        "from llfsm_verify.testing import ArrangementStateMachine"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "ArrangementStateMachine needs Hypothesis, which is not installed: pip install" in done.stderr


def test_importing_the_package_imports_nothing_heavy():
    code = "import sys, llfsm_verify.testing; print(sorted({'hypothesis', 'llvmlite', 'rich'} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stdout == "[]\n"


def test_what_hypothesis_prints_can_be_pasted_too():
    class Lights(Faulty):
        traces = None

    state = Lights()
    state.begin(free={})
    with pytest.raises(RunFailed, match="both is violated"):
        state.step(stretch=Stretch({"car": True}, ringlets=65))
    state.teardown()


@pytest.mark.slow
def test_polishing_leaves_alone_what_own_rules_made(monkeypatch):
    """A shorter run might be one that the rules never make."""

    class Lights(Faulty):
        kept = ("car",)
        traces = None

        @rule()
        def cars_come_and_go(self):
            self.step(Stretch({"car": not self.run.inputs["car"]}, cycles=5))

    monkeypatch.setattr("llfsm_verify.testing.stateful.polish", lambda run: pytest.fail("polished"))
    cars = [stretch.changes["car"] for stretch in failing(Lights).run.stretches if stretch.unit == "cycles"]
    assert cars == [number % 2 == 0 for number in range(len(cars))] and cars
