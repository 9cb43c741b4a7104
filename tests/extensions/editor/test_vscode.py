"""The extension of VS Code: its tests by node, and what its manifest promises."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest

from tests import outside

FOLDER = Path("editors/vscode")


@pytest.mark.slow
@outside.needs("node")
def test_node_runs_the_tests_of_the_extension() -> None:
    command = [outside.program("node"), "--test", "tests/extensions/editor/vscode.test.mjs"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout


def test_the_manifest_and_the_extension_fit() -> None:
    manifest = json.loads((FOLDER / "package.json").read_text())
    contributed = manifest["contributes"]
    assert {one["command"] for one in contributed["commands"]} == {"llfsm.check", "llfsm.show", "llfsm.view"}
    source = (FOLDER / "extension.js").read_text()
    used = set(re.findall(r'setting\("(\w+)"\)', source))
    assert {f"llfsm.{name}" for name in used} == contributed["configuration"]["properties"].keys()
    assert re.fullmatch(r"\d+\.\d+\.\d+", manifest["dependencies"]["vscode-languageclient"])
    files = [manifest["main"], *(one["path"] for one in contributed["grammars"])]
    files += [one["configuration"] for one in contributed["languages"]]
    assert [file for file in files if not (FOLDER / file).is_file()] == []
