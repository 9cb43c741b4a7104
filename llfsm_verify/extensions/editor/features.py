"""What the server is asked, by the names of the protocol."""

from __future__ import annotations

import os

from lsprotocol import types

from llfsm_verify.extensions.editor import answers
from llfsm_verify.extensions.editor.findings import Findings
from llfsm_verify.extensions.editor.fixes import fixes_of
from llfsm_verify.extensions.editor.looking import Look, declaration, describe, name_at, offers
from llfsm_verify.extensions.editor.names import Place
from llfsm_verify.extensions.editor.positions import moved
from llfsm_verify.extensions.editor.server import CHECK, SHOW, Server, file_of


def register(server: Server) -> None:
    """Let the server answer."""
    for add in (_texts, _names, _lenses, _fixes):
        add(server)


def _texts(server: Server) -> None:
    @server.feature(types.INITIALIZED)
    def _(ls: Server, _params: types.InitializedParams) -> None:
        ls.child.folder = ls.workspace.root_path or ""

    @server.feature(types.INITIALIZE)
    def _(ls: Server, params: types.InitializeParams) -> None:
        options = params.initialization_options
        given = options if isinstance(options, dict) else {}
        for name in ("delay", "longest", "check"):
            seconds = given.get(f"{name}Seconds")
            if isinstance(seconds, int | float) and 0 <= seconds <= 86_400:
                setattr(ls.seconds, name, float(seconds))

    @server.feature(types.TEXT_DOCUMENT_DID_OPEN)
    def _(ls: Server, params: types.DidOpenTextDocumentParams) -> None:
        given = params.text_document
        ls.take(given.uri, given.text, given.version, again=True)

    @server.feature(types.TEXT_DOCUMENT_DID_CHANGE)
    def _(ls: Server, params: types.DidChangeTextDocumentParams) -> None:
        uri = params.text_document.uri
        ls.take(uri, ls.workspace.get_text_document(uri).source, params.text_document.version)

    @server.feature(types.TEXT_DOCUMENT_DID_SAVE)
    def _(ls: Server, _params: types.DidSaveTextDocumentParams) -> None:
        _read_again(ls)

    @server.feature(types.WORKSPACE_DID_CHANGE_WATCHED_FILES)
    def _(ls: Server, _params: types.DidChangeWatchedFilesParams) -> None:
        _read_again(ls)

    @server.feature(types.TEXT_DOCUMENT_DID_CLOSE)
    def _(ls: Server, params: types.DidCloseTextDocumentParams) -> None:
        ls.close(params.text_document.uri)

    @server.feature(types.SHUTDOWN)
    async def _(ls: Server, _params: None) -> None:
        await ls.child.close()


def _read_again(server: Server) -> None:
    """Files have changed, so that others may belong to them."""
    server.state.owners.clear()
    for file in server.state.opened:
        server.refresh(file)


def _names(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_COMPLETION, types.CompletionOptions(trigger_characters=["@", ".", " ", "("]))
    def _(ls: Server, params: types.CompletionParams) -> list[types.CompletionItem]:
        found = ls.look(params.text_document.uri, params.position)
        if found is None:
            return []
        here, _, lines = found
        start = here.offset
        while start > 0 and (here.text[start - 1].isalnum() or here.text[start - 1] == "_"):
            start -= 1
        replaced = lines.range(start, here.offset)
        item = ls.asked_of.completion and ls.asked_of.completion.completion_item
        shown = (item and item.documentation_format) or None
        return [answers.completion(offer, replaced, shown) for offer in offers(here)]

    @server.feature(types.TEXT_DOCUMENT_HOVER)
    def _(ls: Server, params: types.HoverParams) -> types.Hover | None:
        found = ls.look(params.text_document.uri, params.position)
        said = None if found is None else describe(found[0])
        if found is None or said is None:
            return None
        text, start, end = said
        shown = (ls.asked_of.hover and ls.asked_of.hover.content_format) or None
        return types.Hover(answers.markup(text, shown), found[2].range(start, end))

    @server.feature(types.TEXT_DOCUMENT_DEFINITION)
    def _(ls: Server, params: types.DefinitionParams) -> types.Location | None:
        found = ls.look(params.text_document.uri, params.position)
        place = None if found is None else declaration(found[0])
        return None if found is None or place is None else _location(ls, found[1], place)

    @server.feature(types.TEXT_DOCUMENT_REFERENCES)
    def _(ls: Server, params: types.ReferenceParams) -> list[types.Location]:
        found = ls.look(params.text_document.uri, params.position)
        if found is None:
            return []
        places = _uses(found[0], found[1])
        return [_location(ls, found[1], p) for p in places[not params.context.include_declaration :]]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT)
    def _(ls: Server, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        found = ls.look(params.text_document.uri, params.position)
        if found is None:
            return []
        here = [place for place in _uses(found[0], found[1]) if place.file == found[0].file]
        return [types.DocumentHighlight(_location(ls, found[1], place).range) for place in here]

    @server.feature(types.TEXT_DOCUMENT_DOCUMENT_SYMBOL)
    def _(ls: Server, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        file = file_of(params.text_document.uri)
        findings = None if file is None else ls.state.known(file)
        return [] if file is None or findings is None else answers.outline(findings, file, ls.lines(file, findings))


def _uses(here: Look, findings: Findings) -> list[Place]:
    """Where the name under the cursor stands, its declaration first."""
    own = name_at(here)
    places = () if own is None else (place for place, name in findings.index.uses if name.place == own.place)
    return sorted(places, key=lambda place: own is not None and place != own.place)


def _location(server: Server, findings: Findings, place: Place) -> types.Location:
    """A place in the text as it is now."""
    lines = server.lines(place.file, findings)
    old = findings.texts.get(place.file, lines.text)
    start, end = (moved(at, old, lines.text) for at in (place.start, place.end))
    return types.Location(server.uri(place.file), lines.range(start, end))


def _lenses(server: Server) -> None:
    @server.feature(types.TEXT_DOCUMENT_CODE_LENS)
    def _(ls: Server, params: types.CodeLensParams) -> list[types.CodeLens]:
        uri, file = params.text_document.uri, file_of(params.text_document.uri)
        findings = None if file is None else ls.state.known(file)
        if file is None or findings is None or findings.root == file:
            return []
        found = []
        for goal in (goal for goal in findings.index.goals if goal.place.file == file):
            where = _location(ls, findings, goal.place).range
            verdict = ls.state.verdicts.get((file, goal.name))
            stale = verdict is not None and ls.state.is_stale(verdict)
            title = answers.lens_title(verdict, stale=stale)
            shows = title.endswith("show")
            found.append(
                types.CodeLens(where, types.Command(title, SHOW if shows else CHECK, arguments=[uri, goal.name]))
            )
            if shows:
                again = types.Command("check", CHECK, arguments=[uri, goal.name])
                found.append(types.CodeLens(where, again))
        return found

    @server.command(CHECK)
    async def _(ls: Server, uri: str, name: str) -> dict[str, object]:
        return await ls.check(uri, name)

    @server.command(SHOW)
    def _(ls: Server, uri: str, name: str) -> dict[str, object]:
        return ls.show(uri, name)


def _fixes(server: Server) -> None:
    kinds = types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix])

    @server.feature(types.TEXT_DOCUMENT_CODE_ACTION, kinds)
    async def _(ls: Server, params: types.CodeActionParams) -> list[types.CodeAction]:
        uri, file = params.text_document.uri, file_of(params.text_document.uri)
        if file is None or file not in ls.state.opened:
            return []
        lines, found = ls.lines(file), list[types.CodeAction]()
        start, end = (lines.offset(at) for at in (params.range.start, params.range.end))
        known = next(ls.state.reads(file), None)
        if known is None or known.texts.get(file) != lines.text:
            return []  # what is said is of another text
        for said in ls.state.said(file):
            if said.start <= end and start <= max(said.end, said.start + 1):
                shown = answers.diagnostic(said, lines, ls.place)
                fixes = [fix for fix in fixes_of(said, lines.text) if await ls.mends(file, fix, said)]
                found += [answers.quick_fix(uri, fix, lines, shown) for fix in fixes]
                if len(fixes) == 1:
                    found[-1].is_preferred = True
        return found


def run() -> int:
    """Serve the editor at standard input and output, until it ends that."""
    server = Server()
    register(server)
    try:
        incoming, outgoing = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
        os.dup2(2, 1)  # what is printed by mistake is no message
        server.start_io(incoming, outgoing)
    finally:
        server.pages.cleanup()
    return 0
