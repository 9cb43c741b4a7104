"""From a typo to its quick fix, and from a lens to a violation in the panel: what the protocol says.

python -m tests.extensions.editor.story
"""

from __future__ import annotations

import asyncio
import shutil
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from tests.extensions.editor.editors import CAPABLE, Editor, editing

LIGHTS = Path(__file__).resolve().parents[3] / "models" / "traffic_lights"
PROPERTIES = "never: G !(ns@GREN && ew@GREEN)\nsoon: G (car -> F ew@GREEN)\n"


def say(*words: object) -> None:
    """Print."""
    sys.stdout.write(" ".join(map(str, words)) + "\n")


async def tell(editor: Editor) -> None:
    """Play it."""
    file = "faulty.ltl"
    say("> textDocument/didOpen", file, repr(PROPERTIES.split("\n", maxsplit=1)[0]))
    editor.open(file, PROPERTIES)
    (said,) = await editor.diagnostics(file)
    say("< textDocument/publishDiagnostics", said.range, said.code, repr(said.message))
    say("> textDocument/codeAction", said.range)
    (fix,) = await editor.fixes(file, said)
    ((text,),) = (editor.apply(fix).values(),)
    say("< codeAction", repr(fix.title), "->", repr(text.split("\n")[0]))
    say("> textDocument/didChange")
    editor.type(file, text)
    say("< textDocument/publishDiagnostics", await editor.diagnostics(file))
    say("> textDocument/codeLens")
    say("< codeLens", [lens.title for lens in await editor.lenses(file)])
    for name in ("never", "soon"):
        say("> workspace/executeCommand llfsm.check", name)
        answer = await editor.command("llfsm.check", file, name)
        say("<", {key: answer[key] for key in ("verdict", "text")})
    for token in editor.client.progress_reports.values():
        say(
            "< $/progress",
            *(getattr(each, "title", None) or getattr(each, "message", "") or each.kind for each in token),
        )
    say("> textDocument/codeLens")
    say("< codeLens", [lens.title for lens in await editor.lenses(file)])
    say("> workspace/executeCommand llfsm.show never")
    shown = await editor.command("llfsm.show", file, "never")
    size = await asyncio.to_thread(lambda: len(Path(shown["path"]).read_bytes())) if shown["path"] else 0
    say("<", shown, f"({size:,} bytes)")


async def play() -> None:
    """Play it in a copy of the model."""
    with TemporaryDirectory() as folder:
        root = Path(folder) / "lights"
        shutil.copytree(LIGHTS, root)
        assert CAPABLE.window is not None
        async with editing(root) as editor:
            await tell(editor)


if __name__ == "__main__":
    asyncio.run(play())
