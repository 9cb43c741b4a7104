from __future__ import annotations

import dataclasses
import subprocess
import sys

import pytest

from llfsm_verify.testing import session
from tests.cli.running import llfsm

NEVER = "def test_never(check):\n    check.holds('G !m@OPEN')\n"
SOMETIMES = "def test_sometimes(check):\n    check.violated('G !m@OPEN')\n"


def stdout(result) -> str:
    return result.stdout.str()


@pytest.mark.slow
def test_every_pytest_run_imports_the_plugin_and_nothing_heavy_with_it():
    heavy = ("lark", "yaml", "rich", "llvmlite", "numpy", "numba", "hypothesis", "networkx")
    module = "llfsm_verify.extensions.pytest_plugin.plugin"
    code = f"import pytest, sys, {module}; print([m for m in {heavy!r} if m in sys.modules])"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False).stdout == "[]\n"


@pytest.mark.slow
def test_strict_runs_with_errors_for_warnings(project):
    project.makepyfile(
        NEVER.replace("holds", "violated")
        + "import pytest\n@pytest.mark.llfsm_arrangement('arrangement.yaml')\ndef test_steps(simulation):\n"
        "    simulation.ringlet({'button': True})\n    assert simulation.state('m') == 'OPEN'\n"
    )
    options = ("--strict-markers", "--strict-config", "--import-mode=importlib", "-W", "error")
    project.runpytest_inprocess(*options).assert_outcomes(passed=2)
    assert "2 tests collected" in stdout(project.runpytest_inprocess("--collect-only", *options))
    project.runpytest_inprocess("-k", "steps", *options).assert_outcomes(passed=1, deselected=1)
    assert "llfsm_arrangement(path)" in stdout(project.runpytest_inprocess("--markers"))


def test_a_failure_shows_what_the_command_line_shows(project):
    project.makepyfile(NEVER)
    text = stdout(project.runpytest_inprocess())
    shown = llfsm("verify", "arrangement.yaml", "-p", "test_never: G !m@OPEN").stdout
    table = shown[shown.index("Initially") : shown.index("\n\n", shown.index("Initially"))]
    assert table in text and "→ OPEN when button" in table
    assert "asked at test_a_failure_shows_what_the_command_line_shows.py:2" in text
    assert "llfsm_verify/" not in text and "Traceback" not in text and str(project.path) not in text.split("=\n", 3)[3]


def test_contradictory_assumptions_may_be_allowed(project):
    project.path.joinpath("props.ltl").write_text("assume none: F false\nopen: G m@OPEN\n")
    project.makepyfile(
        "def test_it(check):\n    check.holds('G m@OPEN', assume='F false', allow_contradiction=True)\n"
        "    check.file('props.ltl', allow_contradiction=True)\n"
    )
    project.runpytest_inprocess().assert_outcomes(passed=1)


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ("violated('G (m@OPEN || m@SHUT)')", "holds, and was expected to be violated: G (m@OPEN || m@SHUT)"),
        (
            "holds('G (m@OPEN || m@SHUT)', max_states=1, engine='explicit')",
            "is unknown: G (m@OPEN || m@SHUT) (because the limit of 1",
        ),
        ("holds('named: G !m@OPEN')", "named is violated: G !m@OPEN"),
        ("holds('G !m@OPEN', 'G m@SHUT')", "test_it-2 is violated: G m@SHUT"),
        ("holds('G !m@OPN')", "did you mean `OPEN`?"),
        ("holds('G true', engine='fast')", "there is no engine `fast`; there are: auto, explicit"),
        ("holds('G (m@OPEN && m@SHUT -> F button)', strict=True)", "fails --strict: `m@OPEN && m@SHUT` is never true"),
        ("holds('G (m@OPEN || m@SHUT)', strict=True, max_states=1, engine='explicit')", "is unknown"),
        ("holds('G m@OPEN', assume='F false')", "is unknown: G m@OPEN (because no run satisfies the assumptions"),
        ("file('props.ltl', violated=['never'], accept_vacuity=['x'])", "has no property `x`"),
        ("holds()", "a check needs a property"),
        ("file('gone.ltl')", "there is no such file"),
        ("file('props.ltl', violated=[*'fedcba'])", "has no property `a`, `b`, `c`, `d`, `e`, `f`"),
        ("on('gone.yaml').holds('G true')", "there is no such file"),
    ],
)
def test_a_check_fails_and_says_why(project, call, says):
    project.path.joinpath("props.ltl").write_text("never: G !m@OPEN\n")
    project.makepyfile(f"def test_it(check):\n    check.{call}\n")
    result = project.runpytest_inprocess()
    result.assert_outcomes(failed=1)
    assert says in stdout(result) and "llfsm_verify/" not in stdout(result)


@pytest.mark.slow
def test_checks_that_pass(project):
    project.path.joinpath("props.ltl").write_text("never: G !m@OPEN\nfine: G (m@OPEN || m@SHUT)\n")
    project.path.joinpath("empty.ltl").write_text("empty: G (m@OPEN && m@SHUT -> F button)\n")
    project.makepyfile("""
        def test_assumptions(check):
            check.holds("F m@OPEN", assume="F button")
            check.holds("F m@OPEN", assume=["pressed: F button", "assume again: G F button"])
            assert not check.violated("F m@OPEN")[0].loop is None

        def test_a_file(check):
            assert len(check.file("props.ltl", violated=["never"]).properties) == 2
            check.on("arrangement.yaml").file("empty.ltl", strict=True, accept_vacuity=["empty"])
            check.holds("G !m.finished", strict=True)

        def test_another_arrangement(check, load_arrangement):
            check.on("arrangement.yaml").violated("G m@SHUT")
            check.on(load_arrangement("arrangement.yaml")).holds("enforce e: (m@SHUT m@OPEN)*")
    """)
    project.runpytest_inprocess().assert_outcomes(passed=3)


@pytest.mark.slow
def test_a_fault_fails_unless_it_is_allowed(project):
    state = "{name: S, internal: n++;, transitions: [{when: button, to: S}]}"
    machine = f"machine: M\nvariables: {{n: {{type: 0..3, init: 0}}}}\nstates: [{state}]\n"
    project.path.joinpath("door.machine.yaml").write_text(machine)
    project.makepyfile("""
        def test_it(check):
            check.holds("G m@S")

        def test_allowed(check):
            check.holds("G m@S", faults=False)

        def test_step(simulation):
            for _ in range(9):
                simulation.ringlet()
    """)
    result = project.runpytest_inprocess()
    result.assert_outcomes(passed=1, failed=2)
    text = stdout(result)
    assert "faults: violated: 1 place where a run ends in a fault" in text and "FAULT" in text
    assert "SimulationFault" in text and "simulation.py" not in text


def test_a_mistake_in_the_model_is_shown_where_it_stands(project):
    project.path.joinpath("door.machine.yaml").write_text("machine: M\nstates: [{name: S, on_entry: n = 1;}]\n")
    project.makepyfile(NEVER + "def test_step(simulation):\n    pass\n")
    result = project.runpytest_inprocess()
    result.assert_outcomes(failed=1, errors=1)
    assert stdout(result).count("door.machine.yaml:2:30: error[E1") == 2 and "llfsm_verify/" not in stdout(result)


@pytest.mark.slow
def test_a_test_finds_its_arrangement(project):
    project.mkdir("tests").joinpath("test_below.py").write_text(SOMETIMES)
    project.runpytest_inprocess().assert_outcomes(passed=1)
    project.path.joinpath("arrangement.yaml").rename(project.path / "other.yaml")
    missing = stdout(project.runpytest_inprocess())
    assert (
        "there is no arrangement.yaml near this test" in missing and "@pytest.mark.llfsm_arrangement('PATH')" in missing
    )
    project.makeini("[pytest]\nllfsm_arrangement = other.yaml\n")
    project.runpytest_inprocess().assert_outcomes(passed=1)
    project.makeini("[pytest]\n")
    for name in ("a", "b"):
        project.mkdir(name).joinpath("arrangement.yaml").write_text("")
    assert "more than one arrangement.yaml is near" in stdout(project.runpytest_inprocess())
    marked = f"import pytest\n@pytest.mark.llfsm_arrangement('../other.yaml')\n{SOMETIMES}"
    project.path.joinpath("tests/test_below.py").write_text(marked)
    project.runpytest_inprocess().assert_outcomes(passed=1)
    project.path.joinpath("tests/test_below.py").write_text(marked.replace("'../other.yaml'", ""))
    assert "takes one path" in stdout(project.runpytest_inprocess())


def test_one_search_for_one_question_until_the_model_changes(project, monkeypatch):
    searches = []
    verify = session.verify
    monkeypatch.setattr(session, "verify", lambda *a: searches.append(1) or verify(*a))
    project.makepyfile("""
        import pathlib

        def test_first(check):
            check.violated("p: G !m@OPEN")
            check.violated("p: G !m@OPEN")

        def test_second(check):
            check.violated("p: G !m@OPEN")

        def test_mended(check):
            path = pathlib.Path("door.machine.yaml")
            path.write_text(path.read_text().replace("when: button", "when: button && not button"))
            check.holds("p: G !m@OPEN")
    """)
    project.runpytest_inprocess().assert_outcomes(passed=3)
    assert len(searches) == 2


def test_own_fixtures_come_first(project):
    project.makepyfile("""
        import pytest
        from llfsm_verify.arrangement import build_arrangement

        @pytest.fixture
        def arrangement():
            machine = {"machine": "M", "states": [{"name": "ONLY", "transitions": [{"when": "true", "to": "ONLY"}]}]}
            return build_arrangement({"machines": {"x": {"inline": machine}}, "schedule": ["x"]})

        def test_it(check, simulation):
            check.holds("G x@ONLY")
            assert simulation.state("x") == "ONLY"
            check.holds("G !x@ONLY")
    """)
    result = project.runpytest_inprocess("--llfsm-save", "traces")
    result.assert_outcomes(failed=1)
    assert "no trace saved: the arrangement does not come from a file" in stdout(result)


@pytest.mark.slow
def test_an_interrupted_search_interrupts_the_tests(project, monkeypatch):
    verify = session.verify
    monkeypatch.setattr(session, "verify", lambda *a: dataclasses.replace(verify(*a), interrupted=True))
    project.makepyfile(SOMETIMES + NEVER)
    assert project.runpytest_inprocess(no_reraise_ctrlc=True).ret == pytest.ExitCode.INTERRUPTED


@pytest.mark.slow
def test_models_of_the_front_door(project):
    """The fixture `arrangement`, and `check.on`, take what `lv.build` and `lv.load` give; nothing else."""
    project.makepyfile(
        """
        import llfsm_verify as lv
        import pytest

        @pytest.fixture
        def arrangement():
            step = lv.StateDefinition(internal="n = (n + 1) % 3;", transitions=[("n > 2", "A")])
            return lv.build("x", {"m": lv.MachineDefinition("M", {"A": step})}, whiteboard={"n": {"type": "0..2"}})

        def test_built(check, simulation):
            check.holds("G n < 3")
            simulation.ringlet()
            assert simulation.values["n"] == 1

        def test_loaded(check):
            check.on(lv.load("arrangement.yaml")).violated("G !m@OPEN")

        def test_something_else(check):
            with pytest.raises(TypeError, match="this is not an arrangement: 3"):
                check.on(3)
        """
    )
    project.runpytest_inprocess().assert_outcomes(passed=3)
    project.makepyfile(test_wrong=f"import pytest\n\n@pytest.fixture\ndef arrangement():\n    return 3\n\n\n{NEVER}")
    result = project.runpytest_inprocess("test_wrong.py")
    assert "the fixture `arrangement` returns something else than an arrangement" in stdout(result)
