"""The server says what the command line says, in the units of the editor, and nothing else."""

from __future__ import annotations

import asyncio
import re
import subprocess
import sys
from pathlib import Path

import pytest
from lsprotocol import types

from llfsm_verify.cli import main
from tests.bad_input.cases import CASES
from tests.extensions.editor.editors import PATIENCE, SERVE, Editor, edit

HEAD = re.compile(r"^(.*?):(\d+):(\d+): (?:error|warning)\[(\w+)\]: (.*)$", re.MULTILINE)
DOOR = """\
# \U0001f600 a door
types: {Door: [OPEN, SHUT]}
whiteboard:
  door: {type: Door} # \U0001f600\U0001f600
machines: {m: {inline: {machine: M, states: [{name: A, on_entry: /* \U0001f600 */ door = OPN;}]}}}
schedule: [m]
"""


@pytest.mark.slow
def test_wrong_files_have_the_diagnostics_of_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    texts = [case.text.replace("§", "") for case in CASES[::20] if "\r" not in case.text]
    texts = [text for text in texts if re.search("^machines:", text, re.MULTILINE)]  # else it is no arrangement here

    async def story(editor: Editor) -> None:
        editor.open("arrangement.yaml", "")
        for text in texts:
            editor.type("arrangement.yaml", text)
            shown = await editor.diagnostics("arrangement.yaml")
            await asyncio.to_thread((tmp_path / "arrangement.yaml").write_text, text)
            capsys.readouterr()
            assert main(["verify", "arrangement.yaml", "-q"]) == 3
            told = HEAD.findall(capsys.readouterr().err)
            found = [(str(one.range.start.line + 1), str(one.code), one.message.split("\n")[0]) for one in shown]
            assert found == [(line, code, message) for _, line, _, code, message in told]

    (tmp_path / "arrangement.yaml").write_text("machines:\n")
    edit(tmp_path, story)


@pytest.mark.slow
@pytest.mark.parametrize(("encoding", "size"), [("utf-8", 4), ("utf-16", 2), ("utf-32", 1)])
def test_columns_count_in_the_units_that_were_agreed(tmp_path: Path, encoding: str, size: int) -> None:
    (tmp_path / "arrangement.yaml").write_text(DOOR)

    async def story(editor: Editor) -> None:
        for change in (lambda text: text, lambda text: text.replace("\n", "\r\n"), lambda text: "\ufeff" + text):
            text = change(DOOR)
            if editor.versions:
                editor.type("arrangement.yaml", text)
            else:
                editor.open("arrangement.yaml", text)
            (said,) = await editor.diagnostics("arrangement.yaml")
            line = DOOR.split("\n")[4]
            at = line.index("OPN") - 1 + size
            assert (said.code, said.range) == ("E110", types.Range(types.Position(4, at), types.Position(4, at + 3)))

    edit(tmp_path, story, encodings=(encoding,))


@pytest.mark.slow
def test_the_server_ends_with_its_editor_and_prints_nothing_else() -> None:
    done = subprocess.run(
        [sys.executable, "-c", SERVE, "lsp"], input=b"", capture_output=True, timeout=PATIENCE, check=False
    )
    assert (done.returncode, done.stdout) == (0, b"")


@pytest.mark.slow
def test_without_pygls_the_extra_is_named() -> None:
    code = f"import sys; sys.modules['pygls'] = None; {SERVE}"
    done = subprocess.run([sys.executable, "-c", code, "lsp"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (3, "")
    assert "needs the package pygls" in done.stderr
    assert "'.[editor]'" in done.stderr
