"""`StateMachine`: a transition file and states in Python, which run together.

    from llfsm_verify.extensions.crops import State, StateMachine

    class LocateFruits(State):
        outcomes = ("No fruit", "Found_fruit")

        def execute(self, data):
            data["fruit"] = camera.fruits()
            return "Found_fruit" if data["fruit"] else "No fruit"

    sm = StateMachine(["Exit"])
    sm.add_transition_file("transfile.yaml")
    sm.add("Locate_fruits", LocateFruits())
    …
    print(sm.execute("Locate_fruits"))

prints ``Exit``. Before anything is executed, what does not fit is said:

    transfile.yaml:5:7: error[E546]: the state `Locate_fruits` may give `No_fruit_detected`, for which it has no …
    transfile.yaml:2:18: error[E547]: `execute('Locate_fruit')` names no label of the transition file
    transfile.yaml:15:22: error[E545]: `Exti` is neither a label nor an outcome of the state machine
"""

from __future__ import annotations

import math
import re
import threading
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from llfsm_verify import Diagnostic, DiagnosticError, Model, Properties, RunReport, load
from llfsm_verify.extensions.crops.checks import problems, surprises
from llfsm_verify.extensions.crops.codes import SHAPE
from llfsm_verify.extensions.crops.data import Data
from llfsm_verify.extensions.crops.driver import LOG, Commands, Driver
from llfsm_verify.extensions.crops.format import CYCLE_MS
from llfsm_verify.extensions.crops.states import State
from llfsm_verify.extensions.crops.transitions import Transitions, read
from llfsm_verify.plug import ARRANGEMENTS, GivenArrangement, Reading, compose, opened

PATIENCE = 5.0
"""Seconds that a command may take, which is about a cycle."""


class StateMachine:
    """A state machine with final `outcomes`. One `execute` at a time; the other methods may be called meanwhile, from
    any thread, also from states.
    """

    def __init__(self, outcomes: Iterable[str]) -> None:
        """ValueError: there are none, or they are one text."""
        if isinstance(outcomes, str) or not (listed := tuple(outcomes)) or not all(isinstance(o, str) for o in listed):
            raise ValueError("`outcomes` is a list of texts, such as ['Exit']")
        self.outcomes = listed
        self.report: RunReport | None = None
        """How the last run went."""
        self._found: Transitions | None = None
        self._model: Model | None = None
        self._states: dict[str, State] = {}
        self._deadlines: dict[str, float] = {}
        self._executed = threading.Lock()
        """Held while it is."""
        self._commands: Commands | None = None
        """Those of the execution."""
        self._driver: Driver | None = None
        """None: nothing is executed, or the run has not begun yet."""

    def add_transition_file(self, path: str | Path) -> None:
        """Let this file say what follows which outcome. DiagnosticError: it cannot be read. ValueError: there is one
        already."""
        if self._found is not None:
            raise ValueError("the state machine has a transition file already")
        source, _ = opened(GivenArrangement(path))
        if not re.match(ARRANGEMENTS["crops"].begins, source.text):
            hint = "write `- state:`, and below it `state_label`, `descriptive_name` and `transitions`"
            raise DiagnosticError(Diagnostic(SHAPE, "this is not a transition file", hint=hint, file=source.name))
        model = load(path)
        reading = Reading(Path())
        found = read(reading, source, compose(source, reading.diagnostics, reading.vocabulary))
        assert found is not None, "the arrangement was made of it"
        self._model = model
        self._found = found

    def add(self, label: str, state: State, *, deadline: float | None = None) -> None:
        """Let a state be executed under a label of the transition file, with a deadline in seconds other than that of
        its class. ValueError: the label has a state already, or the deadline is not a positive number of seconds."""
        if label in self._states:
            raise ValueError(f"the label {label!r} has a state already")
        if not isinstance(label, str) or not isinstance(state, State):
            raise TypeError(f"`add` takes a label and a State, not {type(label).__name__} and {type(state).__name__}")
        limit = state.deadline if deadline is None else deadline
        if limit is None:
            limit = math.inf
        if isinstance(limit, bool) or not isinstance(limit, int | float) or not limit > 0:
            raise ValueError(f"`deadline` is a positive number of seconds, or None, and not {limit!r:.40}")
        self._states[label], self._deadlines[label] = state, limit

    @property
    def values(self) -> Mapping[str, str]:
        """What `outcome` is called in properties, recordings and ports, by outcomes."""
        return self._transitions.values

    @property
    def _transitions(self) -> Transitions:
        if self._found is None:
            raise ValueError("the state machine has no transition file: call `add_transition_file`")
        return self._found

    def check(self, initial: str | None = None) -> tuple[str, ...]:
        """What `execute` looks at first; sentences on what the file does not say. DiagnosticError: what is wrong."""
        found = self._transitions
        wrong = list(problems(found, self.outcomes, self._states, initial))
        if wrong:
            raise DiagnosticError(sorted(wrong, key=lambda d: (d.span is None, d.span.start if d.span else 0)))
        return tuple(surprises(found))

    def execute(
        self,
        initial: str | None = None,
        *,
        data: Mapping[str, object] | None = None,
        properties: Properties = (),
        record: str | Path | None = None,
        whiteboard: str | None = None,
        rate: float = 1,
    ) -> str:
        """Execute states, 100 times a second, until the machine has come to a final outcome: that.

        It begins in the state `initial` (None: as the file says), with `data`; where that is another state than the
        file says, the arrangement is that of the file with `- initial: STATE`. `properties`, `record`,
        `whiteboard` and `rate` are as for `Model.run`. A property that is violated is logged at once (by the logger
        `llfsm_verify.crops`, as all else that goes wrong), and verdicts are in `report`. DiagnosticError: see `check`,
        and `Model.run`. RuntimeError: it is executed already, or the run has ended otherwise.
        """
        if not self._executed.acquire(blocking=False):
            raise RuntimeError("the state machine is executed already")
        self._commands = commands = Commands()
        try:
            for surprise in self.check(initial):
                LOG.warning("%s", surprise)
            shared = data if isinstance(data, Data) else Data(data)
            with self._begun(initial) as model:
                run = model.run(properties, record=record, whiteboard=whiteboard, rate=rate)
            with run as live:
                for name, why in live.unmonitored.items():
                    LOG.warning("the property `%s` is not monitored: %s", name, why)
                try:
                    period = CYCLE_MS / 1000 / rate if rate else 0.0
                    self._driver = Driver(
                        live, self._transitions, self._states, self._deadlines, shared, period, commands
                    )
                    return self._driver.drive()
                finally:
                    self._driver = None
                    live.stop()
                    self.report = live.wait()
                    if self.report.unrecorded is not None:
                        LOG.error("the recording has ended before the run: %s", self.report.unrecorded)
        finally:
            self._commands = None
            commands.refuse()
            self._executed.release()

    @contextmanager
    def _begun(self, initial: str | None) -> Iterator[Model]:
        """The arrangement that begins there, in a file while a run begins: a recording keeps what stands in it."""
        found = self._transitions
        assert self._model is not None
        if initial is None or initial == found.begins:
            yield self._model
            return
        with TemporaryDirectory(prefix="llfsm-") as folder:
            path = Path(folder, Path(found.source.name).name)
            path.write_text(found.text_with(initial), encoding="utf-8")
            yield load(path)

    @property
    def current(self) -> tuple[str, str] | None:
        """The label and the descriptive name of the state that is executed; None: none is."""
        driver, found = self._driver, self._transitions
        label = None if driver is None else driver.label
        return (label, found[label].about) if label is not None and label in found.labels else None

    def pause(self) -> None:
        """Let nothing be executed until `resume`; the state under way is cancelled, and its answer does not count."""
        self._command("suspend")

    def resume(self) -> None:
        """Go on with the state of the pause, which is executed anew."""
        self._command("resume")

    def change_state(self, label: str) -> None:
        """Go to this state, or final outcome; the state under way is cancelled, and its answer does not count. It ends
        a pause. ValueError: there is no such label."""
        if label not in self._transitions.states:
            raise ValueError(f"there is no label {label!r}, only {', '.join(self._transitions.states)}")
        self._command("enter", label)

    def _command(self, kind: str, label: str | None = None) -> None:
        """RuntimeError: the machine is not executed, or has ended before. TimeoutError: it takes too long."""
        commands = self._commands
        if commands is None:
            raise RuntimeError("the state machine is not executed")
        command, begun = commands.ask(kind, label), commands.begun
        while not command.done.wait(PATIENCE):
            if begun:
                raise TimeoutError(f"the state machine has not taken the command `{kind}` within {PATIENCE:g} s")
            begun = commands.begun  # before, the model is compiled
        if command.failed is not None:
            raise command.failed
