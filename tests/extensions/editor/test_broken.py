"""Files broken at every line: the same diagnostics as on the command line, and every question has an answer."""

from __future__ import annotations

import asyncio
import os
import random
import shutil
from collections.abc import Iterable
from pathlib import Path

import pytest
from lsprotocol import types

from tests.extensions.editor.broken import broken, said_on_disk
from tests.extensions.editor.editors import Editor, edit

TEXTS = int(os.environ.get("LLFSM_BROKEN", "120"))
"""How many of the broken texts of all models the long test types; there are 17,000."""
MODELS = Path(__file__).resolve().parents[3] / "models"


def copied(tmp_path: Path, folder: str) -> Path:
    shutil.copytree(MODELS / folder, tmp_path / folder)
    return tmp_path / folder


async def compare(editor: Editor, root: Path, name: str, texts: Iterable[str], draw: random.Random) -> int:
    """Type each text, compare what is said with what is said of the saved file, and ask at random places."""
    path, count = root / name, 0
    whole = path.read_bytes()
    editor.open(name)
    await editor.diagnostics(name)
    for text in texts:
        editor.type(name, text)
        await editor.diagnostics(name)
        path.write_bytes(text.encode())
        expected = said_on_disk(path)
        path.write_bytes(whole)
        assert said(editor, expected, path) == expected, text
        await ask(editor, name, text, draw)
        count += 1
    editor.type(name, whole.decode())
    await editor.diagnostics(name)
    document = editor.document(name)
    editor.client.text_document_did_close(types.DidCloseTextDocumentParams(document))
    assert editor.shown == []
    return count


def said(editor: Editor, expected: set[tuple[str, str, str]], path: Path) -> set[tuple[str, str, str]]:
    """All that the editor shows, but for what the server itself has to say and files that the saved ones name anew."""
    found = set()
    for uri, params in editor.said.items():
        for one in params.diagnostics:
            if str(one.code) not in ("E560", "E561") and not (expected == set() and uri == path.as_uri()):
                found.add((f"{uri}:{one.range.start.line}:{one.range.start.character}", str(one.code), one.message))
    return found


async def ask(editor: Editor, name: str, text: str, draw: random.Random) -> None:
    """Ask all that an editor may ask at a random place."""
    lines = text.split("\n")
    line = draw.randrange(len(lines))
    place = types.Position(line, draw.randint(0, len(lines[line]) + 2))
    document, client = editor.document(name), editor.client
    await asyncio.gather(
        client.text_document_hover_async(types.HoverParams(document, place)),
        client.text_document_completion_async(types.CompletionParams(document, place)),
        client.text_document_definition_async(types.DefinitionParams(document, place)),
        client.text_document_references_async(types.ReferenceParams(types.ReferenceContext(True), document, place)),
        client.text_document_document_symbol_async(types.DocumentSymbolParams(document)),
        client.text_document_code_lens_async(types.CodeLensParams(document)),
    )


@pytest.mark.slow
def test_a_file_that_is_broken_at_some_lines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = copied(tmp_path, "recipes")
    monkeypatch.chdir(root)
    draw = random.Random(1)

    async def story(editor: Editor) -> None:
        for name in ("beam.ltl", "beam.yaml"):
            texts = list(broken((root / name).read_text()))
            await compare(editor, root, name, draw.sample(texts, 8), draw)

    edit(root, story)


@pytest.mark.long
def test_files_that_are_broken_at_any_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = tmp_path / "models"
    shutil.copytree(MODELS, root)
    monkeypatch.chdir(root)
    draw = random.Random(44)
    files = sorted(str(p.relative_to(root)) for p in root.rglob("*") if p.suffix in (".yaml", ".ltl"))
    every = [(name, text) for name in files for text in broken((root / name).read_text())]
    chosen = sorted(draw.sample(every, min(TEXTS, len(every))))

    async def story(editor: Editor) -> None:
        for name in sorted({name for name, _ in chosen}):
            await compare(editor, root, name, [text for of, text in chosen if of == name], draw)

    edit(root, story)
