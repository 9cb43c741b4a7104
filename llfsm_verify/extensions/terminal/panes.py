"""The panes of `llfsm debug` in a terminal: what a session answers, side by side, and the keys of debuggers."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Footer, Input, Static
from textual.worker import Worker, WorkerState

from llfsm_verify.plug import DebugAnswer, DebugError, DebugSession, lines_of

PANES = {"machines": "show", "inputs": "inputs", "state": "list", "guards": "why", "steps": "history 12"}
"""The commands whose answers stand in the panes."""
FOLLOWING = {"state": False, "guards": False, "steps": True}
"""Panes about the present step, and whether it is at their end."""
WIDTH = 100
"""Cells of a line in a pane; what is longer is wrapped by the pane."""
KEYS = {
    "f10": ("step", "step"), "s": ("step", ""), "f11": ("cycle", "cycle"), "n": ("cycle", ""),
    "f5": ("continue", "continue"), "c": ("continue", ""), "shift+f10": ("back", "back"), "b": ("back", ""),
    "shift+f5": ("reverse", "reverse"), "r": ("reverse", ""), "home": ("goto 0", "beginning"),
}  # fmt: skip
"""The command of each key, and what the line at the bottom calls it ("": nothing)."""


class Panes(App[int]):
    """Shows where a session stands, and does its commands in a thread, one after the other."""

    CSS = """
    #panes { height: 1fr; } .pane { border: round $primary; width: 1fr; height: 1fr; }
    #told { height: auto; max-height: 12; } #where { height: auto; text-style: bold; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        *(Binding(key, f"do('{line}')", about, show=bool(about)) for key, (line, about) in KEYS.items()),
        Binding("f9", "ask('break ')", "break"),
        Binding("colon", "ask('')", "command"),
        Binding("escape", "leave", "stop", priority=True),
        Binding("q", "end", "quit"),
    ]
    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = None

    def __init__(self, session: DebugSession) -> None:
        super().__init__()
        self._session = session
        self._code = 0
        self.is_busy = False
        """A command is under way."""
        self.is_shown = False
        """All panes show what the last command has led to."""
        self.failure: BaseException | None = None
        """What ended the panes and is no mistake of a user."""

    def compose(self) -> ComposeResult:
        """The panes above, what the last command told, and the line for commands."""
        with Horizontal(id="panes"):
            with Vertical():
                for name in ("machines", "inputs"):
                    yield VerticalScroll(Static(id=name), classes="pane", can_focus=False)
            with Vertical():
                for name in ("state", "guards", "steps"):
                    yield VerticalScroll(Static(id=name), classes="pane", can_focus=False)
        yield Static(id="where")
        yield Static(id="told")
        yield Input(placeholder="a command; `help` lists them", select_on_focus=False, id="line")
        yield Footer()

    def on_mount(self) -> None:
        """How things stand at first; keys go to the app."""
        for pane in self.query(".pane"):
            pane.border_title = next(iter(pane.children)).id or ""
        self.set_focus(None)
        self._look()

    def action_do(self, line: str) -> None:
        """Do a command, unless one is under way."""
        if self.is_busy:
            self._tell("a command is under way; Escape stops it")
            return
        if not line.strip() or line.lstrip().startswith("#"):
            return
        self.is_busy = True
        self.run_worker(lambda: self._done(line), thread=True, exit_on_error=False)

    def _done(self, line: str) -> DebugAnswer | str:
        """In the thread: the answer, or why there is none."""
        try:
            return self._session.do(line)
        except DebugError as error:
            return str(error)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """A command is done: show what it told, and where that leads."""
        if event.state is WorkerState.ERROR:
            self.failure = event.worker.error
            self.exit(self._code)
        if event.state is not WorkerState.SUCCESS:
            return
        self.is_busy = False
        result = event.worker.result
        if isinstance(result, DebugAnswer):
            if result.expected is False:
                self._code = 1
            if result.quits:
                self.exit(self._code)
                return
            self._tell(Text("\n").join(lines_of(result.parts, WIDTH)))
        else:
            self._tell(str(result))
        self._look()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """A command was typed."""
        event.input.value = ""
        self.set_focus(None)
        self.action_do(event.value)

    def action_ask(self, begin: str) -> None:
        """Let a command be typed that begins so."""
        self.call_after_refresh(self._let_type, begin)  # the key itself is not typed

    def _let_type(self, begin: str) -> None:
        line = self.query_one("#line", Input)
        line.value = begin
        line.focus(scroll_visible=False)
        line.cursor_position = len(begin)

    def action_leave(self) -> None:
        """Stop what is under way, and leave the line for commands."""
        self._session.stop()
        self.set_focus(None)

    def action_end(self) -> None:
        """End the session."""
        self._session.stop()
        self.exit(self._code)

    def _look(self) -> None:
        for name, line in PANES.items():
            result = self._done(line)
            shown = Text(result, "dim") if isinstance(result, str) else Text("\n").join(lines_of(result.parts, WIDTH))
            self.query_one(f"#{name}", Static).update(shown)
        self.is_shown = False
        self.call_after_refresh(self._follow)
        self.query_one("#where", Static).update(Text(self._session.where()))

    def _follow(self, still: int = 0) -> None:
        """Let panes about the present step show it: `steps` ends with it. Others stay where somebody scrolled them.

        A scroll bar that comes takes room, so lines are wrapped anew: it is shown when `still` is two refreshes.
        """
        moved = False
        for name, at_end in FOLLOWING.items():
            pane = self.query_one(f"#{name}").parent
            assert isinstance(pane, VerticalScroll), "each of them has its own"
            place = pane.max_scroll_y if at_end else 0
            if pane.scroll_y != place:
                pane.scroll_to(y=place, animate=False)
                moved = True
        still = 0 if moved else still + 1
        self.is_shown = still == 2
        if not self.is_shown:
            self.call_after_refresh(self._follow, still)

    def _tell(self, told: str | Text) -> None:
        self.query_one("#told", Static).update(Text(told) if isinstance(told, str) else told)


def run_panes(session: DebugSession) -> int:
    """Show the panes until somebody quits; the exit code."""
    panes = Panes(session)
    code = panes.run() or 0
    if panes.failure is not None:
        raise panes.failure
    return code
