"""What is missing is skipped with its reason, or fails where it is required; `make oracles` says what it lacks."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests import outside
from tools import oracles

INNER = """
    import hypothesis
    from hypothesis import strategies
    from tests.outside import demand, load, needs, program

    @needs("gcc", "spin")
    def test_marked():
        assert False

    def test_asks_inside():
        load("pyformlang")

    def test_runs_a_program():
        program("nusmv")

    @needs("shared")
    def test_has_data():
        assert False

    @hypothesis.given(strategies.booleans())
    def test_asks_in_an_example(b):
        demand("cvc5")

    def test_needs_nothing():
        pass
"""

ROSPY = "python3-rospy python3-rosmaster python3-std-msgs python3-actionlib python3-geometry-msgs python3-rosbag"
"""What Debian has of ROS 1."""


@pytest.fixture
def inner(pytester, monkeypatch, tmp_path):
    """Run the tests above where nothing is installed, with that value of the variable."""
    monkeypatch.setattr(oracles, "find", lambda _: None)
    monkeypatch.setitem(outside.FOLDERS, "shared", (tmp_path / "none", "here"))
    pytester.makeini("[pytest]\nmarkers = needs(names): what it needs")
    pytester.makeconftest("from tests.conftest import pytest_runtest_setup")
    pytester.makepyfile(INNER)

    def run(required: str | None):
        if required is None:
            monkeypatch.delenv(outside.VARIABLE, raising=False)
        else:
            monkeypatch.setenv(outside.VARIABLE, required)
        return pytester.runpytest_inprocess("-rs", "-p", "no:cacheprovider", "-p", "no:asyncio")

    return run


def test_what_is_missing_is_skipped_with_its_reason(inner):
    done = inner(None)
    done.assert_outcomes(passed=1, skipped=5)
    done.stdout.fnmatch_lines(["*gcc is not installed*", "*shared: no *none*here*"], consecutive=False)


def test_what_is_required_fails(inner):
    done = inner("1")
    done.assert_outcomes(passed=1, failed=3, errors=1, skipped=1)  # data are not the project's
    done.stdout.fnmatch_lines(["*gcc is not installed*, and LLFSM_REQUIRE_ORACLES requires it"])


@pytest.mark.slow
def test_only_what_is_named_is_required(inner):
    inner("nusmv, cvc5").assert_outcomes(passed=1, failed=2, skipped=3)
    inner("shared,make").assert_outcomes(passed=1, errors=1, skipped=4)
    inner("0").assert_outcomes(passed=1, skipped=5)


def test_an_unknown_name_is_an_error():
    with pytest.raises(ValueError, match="there is no oracle 'spinn'; there are spin, gcc"):
        outside.required("gcc,spinn")
    with pytest.raises(ValueError, match="'nuSMV'"):
        outside.needs("nuSMV")


def test_what_is_there_is_used(monkeypatch):
    monkeypatch.setenv(outside.VARIABLE, "1")
    outside.demand("networkx")
    assert outside.load("networkx").Graph and outside.missing("networkx") is None


def test_other_tests_find_tools_there_only():
    """Each other way to look for one would skip its test whatever is required."""
    allowed = {"outside.py", Path(__file__).name}
    texts = {p: p.read_text() for p in Path("tests").rglob("*.py") if p.name not in allowed}
    assert len(texts) > 150
    other = re.compile(r"importorskip|shutil\.which|import which|is_installed\(\), reason")
    assert not [str(p) for p, text in texts.items() if other.search(text)]


# ---------------------------------------------------------------- getting them


@pytest.fixture
def bare(monkeypatch, tmp_path):
    """A folder that is all of the path, and an empty one to build in."""
    programs, built = tmp_path / "bin", tmp_path / "built"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs))
    monkeypatch.setattr(oracles, "SERVERS", str(programs))
    monkeypatch.setattr(oracles, "SYSTEM", str(programs))
    monkeypatch.setenv("LLFSM_ORACLES", str(built))
    return programs, built


def program(folder: Path, name: str, body: str = "exit 1") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.write_text(f"#!/bin/sh\n{body}\n")
    path.chmod(0o755)
    return path


def test_what_was_built_is_found(bare):
    programs, built = bare
    assert oracles.find("nusmv") is None
    here = program(built / "nusmv-2.5.4", "NuSMV")
    assert oracles.find("nusmv") == str(here)
    assert oracles.find("nusmv") == str(here) and oracles.find("spin") is None
    own = program(programs, "NuSMV")
    assert oracles.find("nusmv") == str(own)


def test_a_compiler_without_its_library_is_missing(bare, monkeypatch):
    here = program(bare[0], "avr-gcc")
    monkeypatch.setitem(oracles.FILES, "avr-gcc", "nowhere/*/io.h")
    assert oracles.find("avr-gcc") is None
    monkeypatch.setitem(oracles.FILES, "avr-gcc", str(here.parent / "avr-*")[1:])
    assert oracles.find("avr-gcc") == str(here)


def test_the_folder_is_outside_the_project(monkeypatch, tmp_path):
    monkeypatch.delenv("LLFSM_ORACLES", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert oracles.folder() == tmp_path / "llfsm-verify-oracles"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert oracles.folder() == tmp_path / ".cache" / "llfsm-verify-oracles"


def test_without_anything_it_says_what_is_missing(bare, capsys):
    oracles.main([])
    said = capsys.readouterr().out
    assert (
        "spin           missing: there is no apt-get here; install with" in said
        and "apt-get install spin gcc make g++ flex bison patch\n" in said
        and f"apt-get install mosquitto {ROSPY} fastddsgen libfastrtps-dev\n" in said
    )
    assert "nusmv          missing: building it takes gcc, g++, make, flex, bison, patch" in said
    named = said.rpartition("LLFSM_REQUIRE_ORACLES=")[2].strip()
    oracles.main(["--names"])
    assert capsys.readouterr().out.strip() == named
    assert {"networkx", "cvc5"} <= outside.required(named) and not {"spin", "nusmv"} & outside.required(named)


def test_only_root_installs(bare, monkeypatch):
    program(bare[0], "apt-get", "exit 0")
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    assert oracles.provide("core")["spin"].startswith("only root can install")


def test_a_package_that_cannot_be_installed_is_said(bare, monkeypatch):
    calls = bare[1].parent / "calls"
    program(bare[0], "apt-get", f'echo "$1" >> {calls}; echo "E: Unable to locate package $4"; exit 100')
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    assert oracles.provide("core")["spin"].endswith("failed: E: Unable to locate package spin")
    assert calls.read_text().split()[:3] == ["install", "update", "install"]


def test_a_group_is_got_by_one_call_of_apt_get(bare, monkeypatch, capsys):
    calls = bare[1].parent / "calls"
    program(
        bare[0],
        "apt-get",
        f'shift 3; echo "$@" >> {calls}; printf "#!/bin/sh\\n" > {bare[0]}/mosquitto; chmod +x {bare[0]}/*',
    )
    monkeypatch.setenv("PATH", f"{bare[0]}:/usr/bin:/bin")
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    monkeypatch.setitem(oracles.GROUPS, "robots", ("mosquitto", "rospy"))  # the others may be in /usr/bin
    oracles.main(["--group", "robots"])
    assert calls.read_text().splitlines() == [f"mosquitto {ROSPY}"]
    said = capsys.readouterr().out
    assert f"robots:\n  mosquitto      {bare[0] / 'mosquitto'}\n  rospy          missing: not found\n" in said
    assert said.endswith("with LLFSM_REQUIRE_ORACLES=mosquitto\n") and "spin" not in said


def test_a_group_without_oracles_says_so_and_an_unknown_one_lists_all(capsys, monkeypatch):
    monkeypatch.setitem(oracles.GROUPS, "knowledge", ())
    oracles.main(["--group", "knowledge"])
    assert capsys.readouterr().out == "knowledge: no oracle is in this group yet\n\n"
    with pytest.raises(SystemExit, match="2"):
        oracles.main(["--group", "robot"])
    said = capsys.readouterr().err
    assert "invalid choice: 'robot'" in said and all(group in said for group in oracles.GROUPS)


def test_prolog_is_a_program_of_debian_and_a_module_of_another_group_is_not_of_the_core(bare):
    assert oracles.find("swipl") is None and "apt-get install swi-prolog-nox" in oracles.provide("knowledge")["swipl"]
    here = program(bare[0], "swipl")
    assert oracles.find("swipl") == str(here)
    assert not {"swipl", "tiny-datalog"} & set(oracles.GROUPS["core"])


def test_every_oracle_is_in_one_group():
    assert sorted(oracles.NAMES) == sorted({*oracles.PROGRAMS, *oracles.OF_SYSTEM, *oracles.MODULES, *oracles.FROM_NPM})
    assert list(oracles.GROUPS) == ["core", "targets", "robots", "view", "knowledge"]


def test_npm_installs_into_a_folder_of_ours_and_its_last_word_is_the_reason(bare):
    programs, built = bare
    assert "there is no npm here" in oracles.provide("view")["eslint"]
    program(programs, "node")
    program(programs, "npm", "echo 'npm error 404 Not Found' >&2; exit 1")
    assert oracles.provide("view")["eslint"].endswith("failed: npm error 404 Not Found")
    program(
        programs,
        "npm",
        'PATH=/bin:/usr/bin; mkdir -p "$6/node_modules/eslint/bin" && : > "$6/node_modules/eslint/bin/eslint.js"',
    )
    assert "eslint" not in oracles.provide("view")
    assert oracles.find("eslint") == str(built / "eslint/node_modules/eslint/bin/eslint.js")


@pytest.mark.slow
def test_a_build_that_fails_is_said_and_leaves_its_log_only(bare, monkeypatch):
    for name in ("gcc", "g++", "make", "flex", "bison", "patch", "spin"):
        program(bare[0], name)
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    reason = oracles.provide("core")["nusmv"]
    assert "-m pip" in reason and reason.endswith(f"failed: {bare[1] / 'nusmv.log'} has what it printed")
    assert "No matching distribution" in (bare[1] / "nusmv.log").read_text()
    assert sorted(p.name for p in bare[1].iterdir()) == ["lock", "nusmv.log"] and oracles.find("nusmv") is None


def test_the_command_ends_well(tmp_path):
    command = [sys.executable, "-m", "tools.oracles", "--names"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "networkx" in done.stdout.split(",")
