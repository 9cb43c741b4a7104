from __future__ import annotations

import pytest

from tests.cli.running import llfsm
from tests.extensions.pytest_plugin.preloaded import PRELOADED

assert PRELOADED


@pytest.fixture
def project(pytester, monkeypatch):
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_PLUGINS", "llfsm_verify.extensions.pytest_plugin.plugin")
    done = llfsm("init", "crossing")
    assert done.returncode == 0 and "written: crossing/arrangement.yaml" in done.stdout and not done.stderr
    monkeypatch.chdir(pytester.path / "crossing")
    return pytester


@pytest.mark.slow
def test_a_new_project_holds_and_breaking_a_guard_fails_it_until_it_is_mended(project):
    """The issue's second show, from beginning to end."""
    folder = project.path / "crossing"
    checked = llfsm("verify", "arrangement.yaml", "properties.ltl")
    assert checked.returncode == 0 and checked.stdout.count("\nholds") == 8
    options = ("-W", "error", "--strict-markers", "--strict-config")
    written = {path.name for path in folder.iterdir()}
    project.runpytest_inprocess(*options).assert_outcomes(passed=4)
    ignored = {line.strip("/") for line in (folder / ".gitignore").read_text().splitlines()}
    assert {path.name for path in folder.iterdir()} - written <= ignored and "traces" not in ignored
    guard = folder / "walkers.machine.yaml"
    text = guard.read_text()
    guard.write_text(text.replace("request && road@RED", "request"))
    result = project.runpytest_inprocess(*options)
    result.assert_outcomes(failed=3, passed=1)
    result.stdout.fnmatch_lines(["*walkers*STOP*→ WALK when request*", "trace saved: traces/*"])
    project.runpytest_inprocess(*options).assert_outcomes(failed=5, passed=1)
    guard.write_text(text)
    project.runpytest_inprocess(*options).assert_outcomes(passed=6)


def test_each_kind_of_line_stands_in_the_properties(project):
    lines = (project.path / "crossing/properties.ltl").read_text().splitlines()
    kinds = ("assume ", "enforce ", "forbid amber", "forbid initially ", "served: ", "# An automaton")
    assert all(any(line.startswith(kind) for line in lines) for kind in kinds)


def test_nothing_is_overwritten(project):
    folder = project.path / "crossing"
    (folder / "arrangement.yaml").unlink()
    before = sorted((path.name, path.read_bytes()) for path in folder.iterdir() if path.is_file())
    done = llfsm("init")
    assert done.returncode == 3 and "error[E460]: this would overwrite README.md, cars.machine.yaml" in done.stderr
    assert "arrangement.yaml" not in done.stderr
    assert sorted((path.name, path.read_bytes()) for path in folder.iterdir() if path.is_file()) == before


def test_an_own_gitignore_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".gitignore").write_text("mine\n")
    done = llfsm("init", ".", "--name", "lights")
    assert done.returncode == 0 and ".gitignore" not in done.stdout
    assert (tmp_path / ".gitignore").read_text() == "mine\n" and (tmp_path / "arrangement.yaml").exists()


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("3 lights",), "E461"),
        (("lights", "--name", "a/b"), "E461"),
        (("lights", "--name", ""), "E461"),
        (("file",), "E462"),
        (("file/lights",), "E462"),
    ],
)
def test_what_cannot_be_made_is_said(tmp_path, monkeypatch, arguments, code):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    done = llfsm("init", *arguments)
    assert done.returncode == 3 and f"error[{code}]" in done.stderr and done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_name_with_a_hyphen(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert llfsm("init", "there", "--name", "my-lights").returncode == 0
    assert (tmp_path / "there/test_my_lights.py").exists()
    assert "name: my-lights\n" in (tmp_path / "there/arrangement.yaml").read_text()


def test_an_empty_path_is_none(project):
    done = llfsm("init", "")
    assert done.returncode == 3 and "error[E462]: the path of a folder is expected" in done.stderr
