"""What an editor gets from `llfsm lsp`: the story of a mistake, and of a property that is checked."""

from __future__ import annotations

import asyncio
import shutil
from pathlib import Path

import pytest
from lsprotocol import types

from llfsm_verify.report.formats import REPORTS
from tests.extensions.editor.editors import Editor, edit

pytestmark = pytest.mark.slow
MODELS = Path(__file__).resolve().parents[3] / "models"
PROPERTIES = """\
never: G !(ns@GREEN && ew@GREEN)
soon: G (car -> F ew@GREEN)
always_red: G ns@RED
"""


@pytest.fixture
def lights(tmp_path: Path) -> Path:
    shutil.copytree(MODELS / "traffic_lights", tmp_path / "lights")
    (tmp_path / "lights" / "arrangement.ltl").write_text(PROPERTIES)
    return tmp_path / "lights"


def test_names_of_a_machine_are_known_while_it_is_broken(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        file = "light.machine.yaml"
        editor.open(file)
        assert await editor.diagnostics(file) == []
        assert "Colour (RED, AMBER, GREEN)" in (await editor.hover(file, "light = RED") or "")
        assert await editor.definition(file, "turn &&") == "light.machine.yaml:5"
        assert await editor.definition(file, "RED, to: GREEN") == "light.machine.yaml:9"
        text = editor.texts[editor.uri(file)]
        editor.type(file, "# new\n" + text.replace("states:", "states: {[").replace("light = RED", "light = "))
        (said, *_) = await editor.diagnostics(file)
        assert str(said.code).startswith("E01")
        assert (await editor.words(file, "light = "))[:3] == ["AMBER", "GREEN", "RED"]
        assert {"RED", "GREEN", "AMBER"} == set(await editor.words(file, "other@"))
        assert {"RED", "GREEN", "AMBER"} == set(await editor.words(file, "to: "))
        assert await editor.definition(file, "turn &&") == "light.machine.yaml:6"
        assert "Runs when the state is entered" in (await editor.hover(file, "on_entry") or "")
        assert "strictly more than" in (await editor.hover(file, "after(3)") or "")

    edit(lights, story)


def test_keys_and_values_are_offered_where_they_belong(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        file = "arrangement.yaml"
        editor.open(file)
        assert await editor.diagnostics(file) == []
        assert {"role", "type", "init", "changes", "safe"} <= set(await editor.words(file, "init: RED, "))
        assert (await editor.words(file, "role: "))[:3] == ["input", "output", "shared"]
        assert "Colour" in await editor.words(file, "ns_light: {type: ")
        assert await editor.words(file, "ns_light: {type: Colour, init: ") == ["AMBER", "GREEN", "RED"]
        assert await editor.words(file, "schedule: [") == ["ew", "ns", "timer"]
        assert "light.machine.yaml" in await editor.words(file, "timer: {file: ")
        assert {"processes", "environment", "pool"} <= set(await editor.words(file, "cycle_ms: 1000\n"))
        assert await editor.definition(file, "light.machine.yaml") == "light.machine.yaml:1"
        assert await editor.definition(file, "timer, ns") == "arrangement.yaml:13"
        assert "period of a cycle" in (await editor.hover(file, "cycle_ms") or "")
        params = types.DocumentSymbolParams(editor.document(file))
        outline = await editor.client.text_document_document_symbol_async(params)
        names = {symbol.name for symbol in outline or () if isinstance(symbol, types.DocumentSymbol)}
        assert {"Colour", "car", "ns_turn", "timer", "ns", "ew"} <= names

    edit(lights, story)


def test_references_go_through_all_files(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open("arrangement.yaml")
        await editor.diagnostics("arrangement.yaml")
        place = editor.at("arrangement.yaml", "ns_turn: {")
        context = types.ReferenceContext(include_declaration=False)
        params = types.ReferenceParams(context, editor.document("arrangement.yaml"), place)
        found = await editor.client.text_document_references_async(params)
        told = sorted(f"{one.uri.rsplit('/', 1)[1]}:{one.range.start.line + 1}" for one in found or ())
        assert told == ["arrangement.yaml:14", "timer.machine.yaml:16", "timer.machine.yaml:8"]

    edit(lights, story)


def page_of(shown: dict[str, str]) -> str:
    return Path(shown["path"]).read_text(encoding="utf-8")


def test_a_property_is_checked_from_its_lens(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        file = "arrangement.ltl"
        editor.open(file)
        assert await editor.diagnostics(file) == []
        assert [lens.title for lens in await editor.lenses(file)] == ["check"] * 3
        assert (await editor.command("llfsm.check", file, "never"))["verdict"] == "holds"
        answer = await editor.command("llfsm.check", file, "always_red")
        assert answer["verdict"] == "violated"
        titles = [lens.title for lens in await editor.lenses(file)]
        assert titles == ["holds", "check", "violated · show", "check"]
        shown = await editor.command("llfsm.show", file, "always_red")
        if "html" in REPORTS.result:
            assert page_of(shown).lower().startswith("<!doctype html")
        else:
            assert "no extension that makes pages" in shown["message"]
            assert editor.shown == [shown["message"]]
        progress = list(editor.client.progress_reports.values())
        assert [type(each[0]).__name__ for each in progress] == ["WorkDoneProgressBegin"] * 2
        assert [type(each[-1]).__name__ for each in progress] == ["WorkDoneProgressEnd"] * 2
        editor.type(file, PROPERTIES.replace("G ns@RED", "G ns@AMBER"))
        await editor.diagnostics(file)
        titles = [lens.title for lens in await editor.lenses(file)]
        assert titles[0] == "was true, the text has changed · check"
        assert titles[-1] == "was violated, the text has changed · check"

    edit(lights, story)


def test_a_check_can_be_cancelled_and_has_a_limit(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        file = "arrangement.ltl"
        editor.open(file)
        await editor.diagnostics(file)
        answer = await editor.command("llfsm.check", file, "never")
        assert (answer["verdict"], "limit" in answer["text"]) == ("unknown", True)
        assert "unknown: " in (await editor.lenses(file))[0].title
        check = asyncio.ensure_future(editor.command("llfsm.check", file, "soon"))
        while len(editor.client.progress_reports) < 2:  # noqa: ASYNC110 - the client tells nobody
            await asyncio.sleep(0.01)
        token = list(editor.client.progress_reports)[-1]
        editor.client.window_work_done_progress_cancel(types.WorkDoneProgressCancelParams(token))
        assert (await check)["verdict"] == "unknown"

    edit(lights, story, options={"delaySeconds": 0, "checkSeconds": 0})


def test_a_property_file_without_an_arrangement_is_told_what_to_do(tmp_path: Path) -> None:
    (tmp_path / "x.ltl").write_text("a: G (p -> F q\n")

    async def story(editor: Editor) -> None:
        editor.open("x.ltl")
        mistake, note = await editor.diagnostics("x.ltl")
        assert (mistake.code, note.code, note.severity) == ("E309", "E560", types.DiagnosticSeverity.Information)
        assert "X.ltl beside X.yaml" in note.message
        assert await editor.lenses("x.ltl") == []
        assert (await editor.command("llfsm.check", "x.ltl", "a"))["verdict"] == "unknown"

    edit(tmp_path, story)


def test_the_arrangement_that_is_open_is_taken(lights: Path) -> None:
    (lights / "props").mkdir()
    (lights / "props" / "more.ltl").write_text("a: G !(ns@GREN)\n")

    async def story(editor: Editor) -> None:
        editor.open("arrangement.yaml")
        await editor.diagnostics("arrangement.yaml")
        editor.open("props/more.ltl")
        (said,) = await editor.diagnostics("props/more.ltl")
        assert said.code == "E112"
        (fix,) = await editor.fixes("props/more.ltl", said)
        assert (fix.title, fix.is_preferred) == ("Replace `GREN` by `GREEN`", True)
        (text,) = editor.apply(fix).values()
        editor.type("props/more.ltl", text)
        assert await editor.diagnostics("props/more.ltl") == []

    edit(lights, story)


def test_reading_that_takes_too_long_is_ended(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open("arrangement.yaml")
        (said,) = await editor.diagnostics("arrangement.yaml")
        assert (said.code, "longer than 0 s" in said.message) == ("E562", True)
        assert await editor.hover("arrangement.yaml", "cycle_ms") is None

    edit(lights, story, options={"delaySeconds": 0, "longestSeconds": 0})


def test_unsaved_machines_count_for_their_arrangement(lights: Path) -> None:
    async def story(editor: Editor) -> None:
        editor.open("arrangement.yaml")
        assert await editor.diagnostics("arrangement.yaml") == []
        editor.open("timer.machine.yaml")
        assert await editor.diagnostics("timer.machine.yaml") == []
        text = editor.texts[editor.uri("arrangement.yaml")]
        editor.type("arrangement.yaml", text.replace("  ew_turn: {type: bool, init: false}\n", ""))
        await editor.diagnostics("arrangement.yaml")
        told = editor.said[editor.uri("timer.machine.yaml")].diagnostics
        assert {one.code for one in told} == {"E110"}
        editor.type("arrangement.yaml", text)
        assert await editor.diagnostics("arrangement.yaml") == []
        assert list(editor.said[editor.uri("timer.machine.yaml")].diagnostics) == []

    edit(lights, story)


def test_what_names_no_file_is_not_read(lights: Path) -> None:
    """Null characters, links in a circle, and addresses that are none."""
    (lights / "circle.ltl").symlink_to("circle.ltl")
    names = "file:///a%00b.ltl", "file://[/x.ltl", "untitled:Untitled-1", "file:", (lights / "circle.ltl").as_uri()

    async def story(editor: Editor) -> None:
        for name in names:
            item = types.TextDocumentItem(name, "llfsm", 1, "a: G tru\n")
            editor.client.text_document_did_open(types.DidOpenTextDocumentParams(item))
            asked = types.HoverParams(types.TextDocumentIdentifier(name), types.Position(0, 4))
            assert await editor.client.text_document_hover_async(asked) is None
        editor.open("arrangement.ltl")
        assert await editor.diagnostics("arrangement.ltl") == []

    edit(lights, story)
