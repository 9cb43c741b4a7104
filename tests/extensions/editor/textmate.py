"""What the tokeniser of VS Code makes of a text, by our grammars: the scopes of each character."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Sequence
from pathlib import Path

from tests import outside

SYNTAXES = Path("editors/vscode/syntaxes")
LTL, LANGUAGE, YAML = "source.llfsm-ltl", "source.llfsm", "source.yaml"
VERSIONS = {
    "until 1.92": "tm-grammars/grammars/yaml.json",
    "since 1.93": "@codingame/monaco-vscode-yaml-default-extension/resources/*.tmLanguage.json",
}
"""The grammars of YAML by the versions of VS Code that have them, below `node_modules`."""

Scopes = list[str]
"""Those of one character of a text, each as `scope scope …`; "" for the end of a line."""


def tokenise(jobs: Sequence[tuple[str, str]], version: str = "since 1.93") -> list[Scopes]:
    """For each grammar and text the scopes of the text's characters."""
    modules = Path(outside.program("textmate")).parents[3]
    files = [*SYNTAXES.iterdir(), *modules.glob(VERSIONS[version])]
    grammars = {json.loads(file.read_text())["scopeName"]: str(file.resolve()) for file in files}
    asked = {
        "modules": str(modules),
        "grammars": grammars,
        "injections": [scope for scope in grammars if scope.startswith("llfsm.")],
        "jobs": [[scope, text] for scope, text in jobs],
    }
    command = [outside.program("node"), "tests/extensions/editor/tokenise.mjs"]
    done = subprocess.run(command, input=json.dumps(asked), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [scopes(text, lines) for (_, text), lines in zip(jobs, json.loads(done.stdout), strict=True)]


def scopes(text: str, lines: list[list[tuple[int, int, list[str]]]]) -> Scopes:
    """A list by lines and tokens as one by characters."""
    found: Scopes = []
    for line, tokens in zip(text.split("\n"), lines, strict=True):
        of_line = [""] * (len(line) + 1)
        for start, end, names in tokens:
            for column in range(start, min(end, len(line))):
                of_line[column] = " ".join(names[1:])
        found += of_line
    return found[: len(text)]
