"""The hook for pre-commit, the action and the workflow to copy: their form, and the commands in them."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from llfsm_verify.cli.commands import llfsm_parser

ACTION, WORKFLOW, HOOKS = Path("action.yml"), Path("examples/ci/github.yml"), Path(".pre-commit-hooks.yaml")


def steps_of(path: Path) -> list[dict]:
    document = yaml.safe_load(path.read_text())
    return document["runs"]["steps"] if path == ACTION else document["jobs"]["verify"]["steps"]


def test_the_hook_calls_a_command_that_there_is():
    (hook,) = yaml.safe_load(HOOKS.read_text())
    assert hook["language"] == "python" and hook["require_serial"]
    words = shlex.split(hook["entry"])
    assert words[0] == "llfsm"
    options = llfsm_parser().parse_args([*words[1:], "arrangement.yaml"])
    assert options.command == "check" and options.paths == ["arrangement.yaml"]
    for name in ("a.yaml", "m/light.machine.yml", "p.ltl", "x.hoa"):
        assert re.search(hook["files"], name)
    assert not re.search(hook["files"], "test_a.py")


@pytest.mark.parametrize("path", [ACTION, WORKFLOW], ids=str)
def test_nothing_that_others_write_gets_into_a_shell_as_text(path):
    for step in steps_of(path):
        assert ("uses" in step) != ("run" in step)
        assert "${{" not in step.get("run", "")
        assert path == WORKFLOW or "uses" in step or step["shell"] == "bash"


def test_the_inputs_of_the_action_are_used_and_no_others():
    document = yaml.safe_load(ACTION.read_text())
    assert document["runs"]["using"] == "composite" and document["name"] and document["description"]
    used = set(re.findall(r"inputs\.([\w-]+)", ACTION.read_text()))
    assert used == set(document["inputs"])
    assert all(value["description"] for value in document["inputs"].values())


@pytest.mark.slow
@pytest.mark.parametrize("path", [ACTION, WORKFLOW], ids=str)
@pytest.mark.parametrize(("broken", "code"), [(False, 0), (True, 1)])
def test_the_steps_run(path, broken, code, tmp_path, monkeypatch):
    """The steps that check and that give the verdict, as the runner calls them, on a new project."""
    tools = tmp_path / "tools"
    tools.mkdir()
    for name, words in (("llfsm-verify", "verify"), ("llfsm", "")):
        (tools / name).write_text(f'#!/bin/sh\nexec "{sys.executable}" -m llfsm_verify {words} "$@"\n')
        (tools / name).chmod(0o755)
    environment = {
        **os.environ,
        "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}",
        "PYTHONPATH": str(Path.cwd()),
        "GITHUB_OUTPUT": str(tmp_path / "output"),
        "ARRANGEMENT": "arrangement.yaml",
        "PROPERTIES": "\nproperties.ltl\n",  # as `properties: |` in a workflow gives them
        "ARGUMENTS": "--timeout 100",
        "SARIF": "llfsm-verify.sarif",
    }
    by_name = {step.get("name"): step for step in steps_of(path)}
    project = tmp_path / "project"

    def bash(script: str, **more: str) -> subprocess.CompletedProcess[str]:
        command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", script]
        return subprocess.run(command, cwd=project, env=environment | more, capture_output=True, text=True, check=False)

    subprocess.run([tools / "llfsm", "init", project], env=environment, check=True, capture_output=True)
    if broken:
        guard = project / "walkers.machine.yaml"
        guard.write_text(guard.read_text().replace("request && road@RED", "request"))
    done = bash(by_name["Check"]["run"])
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "output").read_text() == f"code={code}\n"
    assert '"version": "2.1.0"' in (project / "llfsm-verify.sarif").read_text()
    assert path == WORKFLOW or ("→ WALK when request" in done.stdout) == broken
    assert bash(by_name["Verdict"]["run"], CODE=str(code)).returncode == code
