"""The language server: what editors ask, answered from what a child process has found."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory
from uuid import uuid4

from lsprotocol import types
from pygls.lsp.server import LanguageServer
from pygls.uris import from_fs_path, to_fs_path

from llfsm_verify.extensions.editor import answers
from llfsm_verify.extensions.editor.checking import Checked, Wanted
from llfsm_verify.extensions.editor.child import Child, Failed, Gone, Job
from llfsm_verify.extensions.editor.codes import TOO_LONG
from llfsm_verify.extensions.editor.findings import Asked, Findings, Said
from llfsm_verify.extensions.editor.fixes import Fix, mends
from llfsm_verify.extensions.editor.looking import Look, look
from llfsm_verify.extensions.editor.positions import Lines
from llfsm_verify.extensions.editor.state import Opened, State, Verdict

CHECK, SHOW = "llfsm.check", "llfsm.show"


@dataclass(slots=True)
class Seconds:
    """How long something takes; editors may say other numbers: `initializationOptions: {checkSeconds: 10}`."""

    delay: float = 0.2
    """Without a change, before a text is read."""
    longest: float = 10.0
    """That reading may take."""
    check: float = 60.0
    """That the check of a property may take."""


class Server(LanguageServer):
    """A server for one editor."""

    def __init__(self) -> None:
        super().__init__("llfsm-verify", version("llfsm-verify"), types.TextDocumentSyncKind.Full)
        self.state = State()
        self.numbers: dict[str, int] = {}
        """By file, how often it was asked to be read."""
        self.turn = asyncio.Lock()
        self.child = Child("")
        self.pages = TemporaryDirectory(prefix="llfsm-")
        self.seconds = Seconds()
        self.tasks: set[asyncio.Task[None]] = set()
        self.late: dict[str, Said] = {}
        """By file, that reading it took too long."""

    # ---------------------------------------------------------------- texts

    @property
    def encoding(self) -> str:
        """What positions count in."""
        return str(
            getattr(self.server_capabilities.position_encoding, "value", self.server_capabilities.position_encoding)
        )

    @property
    def asked_of(self) -> types.TextDocumentClientCapabilities:
        """What the editor can do with documents."""
        return self.client_capabilities.text_document or types.TextDocumentClientCapabilities()

    def lines(self, file: str, findings: Findings | None = None) -> Lines:
        """The text of a file, for its positions."""
        opened = self.state.opened.get(file)
        return Lines(self.state.text(file, findings) if opened is None else opened.text, self.encoding)

    def uri(self, file: str) -> str:
        """What the editor calls a file."""
        opened = self.state.opened.get(file)
        return opened.uri if opened is not None else str(from_fs_path(file))

    def take(self, uri: str, text: str, number: int, *, again: bool = False) -> None:
        """A text is new; `again`: so may be what it belongs to."""
        file = file_of(uri)
        if file is None:
            return
        if again:
            self.state.opened.pop(file, None)
            self.state.owners.pop(file, None)
        self.state.opened[file] = Opened(uri, text, number)
        self.refresh(file)

    def refresh(self, file: str) -> None:
        """Read a file anew, when it has not been changed for a moment."""
        self.numbers[file] = self.numbers.get(file, 0) + 1
        task = asyncio.get_running_loop().create_task(self._read(file, self.numbers[file]))
        self.tasks.add(task)
        task.add_done_callback(self.tasks.discard)

    def close(self, uri: str) -> None:
        """A file is not open any more."""
        file = file_of(uri)
        if file is not None and self.state.opened.pop(file, None) is not None:
            self.numbers[file] = self.numbers.get(file, 0) + 1
            self.late.pop(file, None)
            self.publish(sorted({file, *self.state.forget_closed()}))

    async def _read(self, file: str, number: int) -> None:
        await asyncio.sleep(self.seconds.delay)
        async with self.turn:
            if self.numbers[file] != number or file not in self.state.opened:
                return
            others = tuple(name for name in reversed(self.state.opened) if name != file)
            asked = Asked(file, others, self.state.owners.get(file))
            texts = self._texts()
            self.late.pop(file, None)
            try:
                answer = await self.child.ask(Job(asked, texts), self.seconds.longest)
            except Gone as gone:
                answer = Failed(str(gone))
        if isinstance(answer, Failed):
            hint = "what is said of this file may be old; `llfsm check` reads it without a limit of time"
            self.late[file] = Said(file, 0, 1, TOO_LONG, answer.text, hint=hint, severity="information")
            self.publish({file})
        elif isinstance(answer, tuple) and self.numbers[file] == number:
            self._put(file, answer)

    async def mends(self, file: str, fix: Fix, said: Said) -> bool:
        """Try an edit that a diagnostic's hint tells."""
        text = self.state.text(file)
        before = tuple(self.state.reads(file))
        asked = Asked(file, tuple(self.state.opened), tuple((f.root, f.properties) for f in before if f.root != file))
        texts = {**self._texts(), file: fix.applied(text).encode("utf-8", "surrogatepass")}
        async with self.turn:
            with suppress(Gone):
                answer = await self.child.ask(Job(asked, texts), self.seconds.longest)
                return isinstance(answer, tuple) and mends(fix, said, before, answer)
        return False

    def _texts(self) -> dict[str, bytes]:
        """What the editor has not saved, or may not have."""
        return {name: opened.text.encode("utf-8", "surrogatepass") for name, opened in self.state.opened.items()}

    def _put(self, file: str, found: tuple[Findings, ...]) -> None:
        roots = {findings.root for findings in found}
        files = {file}
        for root, old in list(self.state.found.items()):
            if file in old.sorts and root not in roots and root == file:  # it belongs to an arrangement now
                files |= set(self.state.found.pop(root).sorts)
        for findings in found:
            files |= self.state.put(findings)
        if not (len(found) == 1 and found[0].root == file and found[0].sorts.get(file) != "arrangement"):
            self.state.owners[file] = tuple((f.root, f.properties) for f in found)
        self.publish(sorted(files, key=lambda each: (each == file, each)))  # the one that was changed comes last
        for other in files & self.state.opened.keys() - {file}:
            known = {root for root, _ in self.state.owners.get(other, ())}
            if not roots <= known and other in self.state.found:
                self.state.owners.pop(other, None)
                self.refresh(other)
        self.refresh_lenses()

    def publish(self, files: Iterable[str]) -> None:
        """Tell the editor all that is said of some files, in this order."""
        for file in files:
            findings = next(self.state.reads(file), None)
            lines, opened = self.lines(file, findings), self.state.opened.get(file)
            said = self.state.said(file) + ([self.late[file]] if file in self.late else [])
            self.text_document_publish_diagnostics(
                types.PublishDiagnosticsParams(
                    self.uri(file),
                    [answers.diagnostic(one, lines, self.place) for one in said],
                    None if opened is None else opened.version,
                )
            )

    def place(self, file: str, line: int, column: int) -> types.Location:
        """A place that a note tells."""
        lines = self.lines(file, next(self.state.reads(file), None))
        return types.Location(self.uri(file), lines.at(line, column))

    # ---------------------------------------------------------------- places

    def look(self, uri: str, position: types.Position) -> tuple[Look, Findings, Lines] | None:
        """What is known of a place."""
        file = file_of(uri)
        findings = None if file is None else self.state.known(file)
        if file is None or findings is None or file not in self.state.opened:
            return None
        lines = self.lines(file)
        return look(findings, file, lines.text, lines.offset(position)), findings, lines

    # ---------------------------------------------------------------- checks

    def refresh_lenses(self) -> None:
        """Let the editor ask for lenses again, where it can."""
        workspace = self.client_capabilities.workspace
        if workspace is not None and workspace.code_lens is not None and workspace.code_lens.refresh_support:
            self.workspace_code_lens_refresh(None, lambda _: None)

    async def check(self, uri: str, name: str) -> dict[str, object]:
        """Check a property, and say what came of it."""
        file = file_of(uri)
        known = () if file is None else (self.state.known(file), *self.state.reads(file))
        findings = next((f for f in known if f is not None and file in f.sorts and f.root != file), None)
        if file is None or findings is None:
            return {"verdict": "unknown", "text": "no arrangement is known for this property file"}
        running = self.state.verdicts.get((file, name))
        if running is not None and running.checked is None:
            return {"verdict": "unknown", "text": "it is being checked"}
        verdict = Verdict({each: self.state.text(each, findings) for each in findings.texts})
        self.state.verdicts[file, name] = verdict
        self.refresh_lenses()
        wanted = Wanted(findings.root, findings.properties, name, self.seconds.check)
        try:
            verdict.checked = await self._checked(wanted)
            verdict.page = self._page(verdict.checked)
        except BaseException:
            del self.state.verdicts[file, name]
            raise
        finally:
            self.refresh_lenses()
        return {"verdict": verdict.checked.verdict, "text": verdict.checked.text, **_shown(verdict)}

    async def _checked(self, wanted: Wanted) -> Checked:
        texts = self._texts()
        child, token, progress = Child(self.child.folder), str(uuid4()), self.work_done_progress
        window = self.client_capabilities.window
        shown = window is not None and bool(window.work_done_progress)

        def tell(text: str) -> None:
            if shown:
                progress.report(token, types.WorkDoneProgressReport(message=text))

        try:
            if shown:
                await progress.create_async(token)
                progress.begin(token, types.WorkDoneProgressBegin(f"Checking {wanted.name}", cancellable=True))
            asked = child.ask(Job(wanted, texts), wanted.seconds + self.seconds.longest, tell)
            work, loop = asyncio.ensure_future(asked), asyncio.get_running_loop()
            if shown:
                progress.tokens[token].add_done_callback(lambda _: loop.call_soon_threadsafe(work.cancel))
            answer = await work
            return answer if isinstance(answer, Checked) else Checked("unknown", getattr(answer, "text", "no answer"))
        except Gone as gone:
            return Checked("unknown", str(gone))
        except asyncio.CancelledError:
            if shown and progress.tokens[token].cancelled():
                return Checked("unknown", "it was cancelled")
            raise
        finally:
            await child.close()
            if shown:
                progress.end(token, types.WorkDoneProgressEnd())
                progress.tokens.pop(token, None)

    def _page(self, checked: Checked) -> Path | None:
        if checked.page is None:
            return None
        path = Path(self.pages.name) / f"{uuid4()}.html"
        path.write_text(checked.page, encoding="utf-8")
        return path

    def show(self, uri: str, name: str) -> dict[str, object]:
        """The page of a violation that was found."""
        verdict = self.state.verdicts.get((file_of(uri) or "", name))
        if verdict is None or verdict.checked is None:
            return {"path": None, "message": f"`{name}` was not checked"}
        found = _shown(verdict)
        if found["path"] is None:
            self.window_show_message(types.ShowMessageParams(types.MessageType.Info, str(found["message"])))
        return {"name": name, "verdict": verdict.checked.verdict, "stale": self.state.is_stale(verdict), **found}


def _shown(verdict: Verdict) -> dict[str, object]:
    path = None if verdict.page is None else str(verdict.page)
    return {"path": path, "message": "" if path or verdict.checked is None else verdict.checked.without}


def file_of(uri: str) -> str | None:
    """The real path of a file that an editor names; None: it is none."""
    try:
        path = to_fs_path(uri) if uri.startswith("file:") else None
        return None if not path else str(Path(path).resolve())
    except (ValueError, OSError, RuntimeError):  # it has a null character, or links lead in a circle
        return None
