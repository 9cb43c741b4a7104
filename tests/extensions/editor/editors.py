"""An editor for tests: the client of pytest-lsp, with `llfsm lsp` as its server over standard input and output."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Callable, Coroutine
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

from lsprotocol import types
from pytest_lsp import LanguageClient, make_test_lsp_client

SERVE = "import sys; from llfsm_verify.cli import main; sys.exit(main())"
PATIENCE = 60
"""Seconds that an answer may take on a busy computer."""
CAPABLE = types.ClientCapabilities(
    window=types.WindowClientCapabilities(work_done_progress=True),
    text_document=types.TextDocumentClientCapabilities(
        hover=types.HoverClientCapabilities(content_format=[types.MarkupKind.Markdown]),
        code_action=types.CodeActionClientCapabilities(is_preferred_support=True),
        document_symbol=types.DocumentSymbolClientCapabilities(hierarchical_document_symbol_support=True),
        publish_diagnostics=types.PublishDiagnosticsClientCapabilities(related_information=True, version_support=True),
    ),
)


class Editor:
    """Open files, and what the server says of them."""

    def __init__(self, client: LanguageClient, root: Path) -> None:
        self.client = client
        self.root = root
        self.versions: dict[str, int] = {}
        self.texts: dict[str, str] = {}
        self.said: dict[str, types.PublishDiagnosticsParams] = {}
        self.shown: list[str] = []
        self.news = asyncio.Condition()

    def uri(self, name: str) -> str:
        return (self.root / name).as_uri()

    def document(self, name: str) -> types.TextDocumentIdentifier:
        return types.TextDocumentIdentifier(self.uri(name))

    def open(self, name: str, text: str | None = None) -> None:
        """Open a file, with another text than that on disk where one is given."""
        uri = self.uri(name)
        self.texts[uri] = (self.root / name).read_bytes().decode() if text is None else text
        self.versions[uri] = 1
        item = types.TextDocumentItem(uri, "llfsm", 1, self.texts[uri])
        self.client.text_document_did_open(types.DidOpenTextDocumentParams(item))

    def type(self, name: str, text: str) -> None:
        """Replace the text of an open file."""
        uri = self.uri(name)
        self.texts[uri] = text
        self.versions[uri] += 1
        change = types.TextDocumentContentChangeWholeDocument(text)
        document = types.VersionedTextDocumentIdentifier(self.versions[uri], uri)
        self.client.text_document_did_change(types.DidChangeTextDocumentParams(document, [change]))

    async def diagnostics(self, name: str) -> list[types.Diagnostic]:
        """What is said of the newest text of an open file."""
        uri = self.uri(name)

        def ready() -> bool:
            return uri in self.said and self.said[uri].version == self.versions[uri]

        async with self.news:
            await asyncio.wait_for(self.news.wait_for(ready), PATIENCE)
        return list(self.said[uri].diagnostics)

    def at(self, name: str, mark: str, *, after: bool = False, number: int = 0) -> types.Position:
        """Where a text begins, or ends, in an open file; positions are in UTF-16."""
        text, start = self.texts[self.uri(name)], -1
        for _ in range(number + 1):
            start = text.index(mark, start + 1)
        start += len(mark) * after
        line = text[text.rfind("\n", 0, start) + 1 : start]
        return types.Position(text.count("\n", 0, start), len(line.encode("utf-16-le")) // 2)

    async def words(self, name: str, mark: str, **how: Any) -> list[str]:
        """What the server offers after a text."""
        place = self.at(name, mark, after=True, **how)
        found = await self.client.text_document_completion_async(types.CompletionParams(self.document(name), place))
        assert isinstance(found, list | tuple)
        return [item.label for item in sorted(found, key=lambda item: item.sort_text or item.label)]

    async def hover(self, name: str, mark: str, **how: Any) -> str | None:
        place = self.at(name, mark, **how)
        found = await self.client.text_document_hover_async(types.HoverParams(self.document(name), place))
        if found is None:
            return None
        assert isinstance(found.contents, types.MarkupContent)
        return found.contents.value

    async def definition(self, name: str, mark: str, **how: Any) -> str | None:
        """The file and the line of a definition, from 1."""
        place = self.at(name, mark, **how)
        found = await self.client.text_document_definition_async(types.DefinitionParams(self.document(name), place))
        if not isinstance(found, types.Location):
            return None
        return f"{found.uri.rsplit('/', 1)[1]}:{found.range.start.line + 1}"

    async def lenses(self, name: str) -> list[types.Command]:
        found = await self.client.text_document_code_lens_async(types.CodeLensParams(self.document(name)))
        return [lens.command for lens in found or () if lens.command is not None]

    async def command(self, name: str, file: str, goal: str) -> Any:
        return await self.client.workspace_execute_command_async(
            types.ExecuteCommandParams(name, [self.uri(file), goal])
        )

    async def fixes(self, name: str, diagnostic: types.Diagnostic) -> list[types.CodeAction]:
        context = types.CodeActionContext([diagnostic])
        params = types.CodeActionParams(self.document(name), diagnostic.range, context)
        found = await self.client.text_document_code_action_async(params)
        return [action for action in found or () if isinstance(action, types.CodeAction)]

    def apply(self, action: types.CodeAction) -> dict[str, str]:
        """The texts of files after an action."""
        assert action.edit is not None
        assert action.edit.changes is not None
        return {uri: applied(self.texts[uri], list(edits)) for uri, edits in action.edit.changes.items()}


def applied(text: str, edits: list[types.TextEdit]) -> str:
    """A text with an edit in it; positions are in UTF-16."""
    (edit,) = edits
    lines = text.split("\n")

    def offset(at: types.Position) -> int:
        units = lines[at.line].encode("utf-16-le")[: 2 * at.character]
        return sum(len(line) + 1 for line in lines[: at.line]) + len(units.decode("utf-16-le"))

    return text[: offset(edit.range.start)] + edit.new_text + text[offset(edit.range.end) :]


@asynccontextmanager
async def editing(root: Path, *, encodings: tuple[str, ...] = (), options: object = None) -> AsyncIterator[Editor]:
    """An editor in a folder. `options`: what the server is told first; nothing delays it unless that says so."""
    client = make_test_lsp_client()
    editor = Editor(client, root)

    async def take(params: types.PublishDiagnosticsParams) -> None:
        async with editor.news:
            editor.said[params.uri] = params
            editor.news.notify_all()

    client.protocol.fm.features.pop(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)
    client.feature(types.TEXT_DOCUMENT_PUBLISH_DIAGNOSTICS)(take)
    client.protocol.fm.features.pop(types.WINDOW_SHOW_MESSAGE)
    client.feature(types.WINDOW_SHOW_MESSAGE)(lambda params: editor.shown.append(params.message))
    await client.start_io(sys.executable, "-c", SERVE, "lsp")
    try:
        capabilities = CAPABLE
        if encodings:
            general = types.GeneralClientCapabilities(position_encodings=encodings)
            capabilities = types.ClientCapabilities(general=general, text_document=CAPABLE.text_document)
        told = {"delaySeconds": 0.0} if options is None else options
        params = types.InitializeParams(capabilities, root_uri=root.as_uri(), initialization_options=told)
        await asyncio.wait_for(client.initialize_session(params), PATIENCE)
        yield editor
        await asyncio.wait_for(client.shutdown_session(), PATIENCE)
    finally:
        if client._server is not None and client._server.returncode is None:
            client._server.kill()  # the story has failed, and nobody has ended it
        await client.stop()


def edit(root: Path, story: Callable[[Editor], Coroutine[Any, Any, None]], **how: Any) -> None:
    """Play a story in an editor that is opened in a folder."""

    async def play() -> None:
        async with editing(root, **how) as editor:
            await story(editor)

    asyncio.run(play())
