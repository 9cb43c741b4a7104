"""Runs and traces as users handle them: steps counted, values by name, tables, files."""

from __future__ import annotations

import io
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from llfsm_verify.arrangement.files import STDIN
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.trace import Trace, TraceStep, letter_steps
from llfsm_verify.checking.verdict import PropertyResult
from llfsm_verify.diagnostics import counted
from llfsm_verify.jsonvalue import Json
from llfsm_verify.logic.properties import Property, PropertySet, asked_text
from llfsm_verify.program.program import FaultSite
from llfsm_verify.report.json import step_times, trace_object
from llfsm_verify.report.plain import PIPE_WIDTH, plain_text
from llfsm_verify.report.saving import refuse_others, write_traces
from llfsm_verify.values import Shown, read_back
from llfsm_verify.verification.query import saved_query
from llfsm_verify.verification.tracefile import SavedProperty, document_of, saved_text

if TYPE_CHECKING:
    import pandas as pd
    from rich.console import RenderableType

Value = Shown
"""A number is an int or a Decimal, a Boolean a bool, an enumerator or the name of a state a str."""

Ending = Literal["steps", "ended", "fault", "overflow", "loop"]


FRAME = '<pre style="line-height:normal;white-space:pre;overflow-x:auto">{code}</pre>'
NOTEBOOK_WIDTH = 160
"""Characters of a line in a notebook, which scrolls."""


class Readable:
    """What people read: as text, and as HTML in notebooks."""

    __slots__ = ()

    def _shown(self) -> Iterable[RenderableType]:
        raise NotImplementedError

    def __str__(self) -> str:
        return text_of(self._shown())

    def _repr_html_(self) -> str:
        return html_of(self._shown()) + "".join(self._pictures())

    def _pictures(self) -> Iterable[str]:
        """HTML below it."""
        return ()


def text_of(items: Iterable[RenderableType], width: int | None = None) -> str:
    """The items as plain text, without a newline at the end."""
    return plain_text(items, width or PIPE_WIDTH).rstrip("\n")


def html_of(items: Iterable[RenderableType]) -> str:
    """The items with their colours, as HTML that stands by itself."""
    from rich.console import Console
    from rich.text import Text

    console = Console(
        file=io.StringIO(), record=True, width=NOTEBOOK_WIDTH, force_terminal=True, color_system="truecolor",
        force_jupyter=False, highlight=False, markup=False, emoji=False,
    )  # fmt: skip
    for item in items:
        console.print(item, soft_wrap=isinstance(item, Text))
    return console.export_html(inline_styles=True, code_format=FRAME)


@dataclass(frozen=True, slots=True, repr=False)
class RunView(Readable):
    """A run: ``len(run)`` steps, numbered from 1; 0 stands for the initial configuration.

    `wrapped` is the value inside, which is private.
    """

    wrapped: Trace
    _arrangement: Arrangement

    def __len__(self) -> int:
        """The number of steps."""
        return len(self.wrapped.steps)

    def __bool__(self) -> bool:
        """True, also of a run without steps: it is there."""
        return True

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._arrangement.name}: {counted(len(self), 'step')}>"

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.text import run_text

        return run_text(self.wrapped)

    def _pictures(self) -> Iterator[str]:
        """Its timing diagram; as an image, which shares no styles and names with the page."""
        from llfsm_verify.report.timeline.formats import TIMELINES
        from llfsm_verify.runtime.recording.timeline import execution_of, timeline_of

        if "svg" in TIMELINES:
            file = io.BytesIO()
            timeline = timeline_of(self.wrapped, self._arrangement, execution_of(self._arrangement))
            TIMELINES.load("svg")(timeline, file)
            data, about = b64encode(file.getvalue()).decode(), escape(self._of())
            yield f'<figure style="overflow-x:auto"><figcaption>{about}</figcaption>'
            yield f'<img alt="timing diagram of {about}" style="max-width:none" src="data:image/svg+xml;base64,{data}">'
            yield "</figure>"

    @property
    def steps(self) -> tuple[TraceStep, ...]:
        """What each step did; step number n is ``steps[n - 1]``."""
        return self.wrapped.steps

    @property
    def fault(self) -> str | None:
        """What is said of the fault in which the last step ends; None: there is no fault."""
        return None if self.wrapped.fault is None else self.wrapped.fault.message

    def values(self, step: int) -> dict[str, Value]:
        """All variables after a step: those of the whiteboard and of machines (elements of arrays one by one, such as
        ``"a[0]"``), and under the name of each machine the name of its state.

        An integer is an `int`, a decimal a `Decimal`, a Boolean a `bool`, an enumerator a `str`. 0 is the initial
        configuration, -1 the end.
        IndexError: there is no such step.
        """
        number = self._number(step, len(self) + 1)
        texts = dict(self.wrapped.initial)
        for done in self.wrapped.steps[:number]:
            texts.update((change.variable, change.after) for change in done.changes)
        return self._typed(texts)

    def inputs(self, step: int) -> dict[str, Value]:
        """What the step sampled, by the name of the input. IndexError: there is no such step; 0 samples nothing."""
        number = self._number(step, len(self) + 1)
        if number == 0:
            return {}
        return self._typed({s.input or s.choice: s.text for s in self.wrapped.steps[number - 1].sampled})

    def world(self, step: int) -> dict[str, Value]:
        """The inputs that the property looks at after the step and that no machine sampled in it, by name: they were in
        the surroundings. IndexError: there is no such step."""
        number = self._number(step, len(self) + 1)
        if number == 0:
            return {}
        return self._typed({s.input or s.choice: s.text for s in self.wrapped.steps[number - 1].world})

    def atoms(self, step: int) -> dict[str, bool]:
        """The atoms of the property as they are after the step, in the last letter until then."""
        number = self._number(step, len(self) + 1)
        last = max(n for n in letter_steps(self.wrapped) if n <= number)
        return dict(self.wrapped.steps[last - 1].atoms if last else self.wrapped.initial_atoms)

    def table(self, *, fold: bool = True, width: int | None = None) -> str:
        """A row a step, as the command line shows it. `fold`: steps without an event are one row. `width`: characters
        in which the columns fit."""
        from llfsm_verify.report.steptable import StepTable

        return text_of([StepTable(self.wrapped, fold=fold)], width)

    def to_dict(self) -> dict[str, Json]:
        """The trace as in the JSON report (schema `result`)."""
        return trace_object(self.wrapped)

    def to_rows(self) -> list[dict[str, Value | float | None]]:
        """A row for the initial configuration and one for each step: ``$step``, ``$time_ms`` (the logical time at which
        its cycle begins; None: untimed), ``$machine`` (whose turn it was), ``$fired`` (the transition), and all
        variables, as `values` has them."""
        texts = dict(self.wrapped.initial)
        zero = None if self.wrapped.period is None else 0
        rows: list[dict[str, Value | float | None]] = [
            {"$step": 0, "$time_ms": zero, "$machine": None, "$fired": None, **self._typed(texts)}
        ]
        for number, (step, time) in enumerate(zip(self.wrapped.steps, step_times(self.wrapped), strict=True), 1):
            texts.update((change.variable, change.after) for change in step.changes)
            about = {"$step": number, "$time_ms": time, "$machine": step.machine, "$fired": step.fired}
            rows.append({**about, **self._typed(texts)})
        return rows

    def to_pandas(self) -> pd.DataFrame:
        """`to_rows` as a data frame with ``$step`` as its index. ModuleNotFoundError: pandas is not installed."""
        try:
            import pandas as pd
        except ModuleNotFoundError as error:
            if error.name != "pandas":
                raise
            message = "to_pandas needs pandas, which is not installed: pip install 'llfsm-verify[pandas]'"
            raise ModuleNotFoundError(message, name="pandas") from None
        return pd.DataFrame(self.to_rows()).set_index("$step")

    def _of(self) -> str:
        """What a drawing says that the run is."""
        return "a run"

    def _number(self, step: int, count: int) -> int:
        try:
            return range(count)[step]
        except IndexError:
            raise IndexError(f"there is no step {step}: the run has {counted(count - 1, 'step')}") from None

    def _typed(self, texts: dict[str, str]) -> dict[str, Value]:
        machines = {machine.name for machine in self._arrangement.texts}
        return {name: text if name in machines else read_back(text) for name, text in texts.items()}


@dataclass(frozen=True, slots=True, repr=False)
class SimulatedRun(RunView):
    """What `Model.simulate` gives. The same `seed` gives the same run."""

    seed: int
    ending: Ending
    """Why it ends: the `steps` or cycles were done, the arrangement has ``ended``, or a ``fault``; an ``overflow`` is a
    value that left the 64 bits of the executor."""
    never_visited: Mapping[str, tuple[str, ...]]
    """By machine: the states in which it never was."""


@dataclass(frozen=True, slots=True, repr=False)
class TraceView(RunView):
    """A run that violates a property, ends in a fault, shows a property at work, or reaches what was asked for."""

    _properties: PropertySet
    _shows: PropertyResult | Property | FaultSite
    _of_query: bool = False

    def _shown(self) -> Iterator[RenderableType]:
        from llfsm_verify.report.text import run_text, trace_text

        return run_text(self.wrapped) if self._of_query else trace_text(self.wrapped)

    @property
    def because(self) -> str | None:
        """Why the property fails, in a clause; None for faults and runs that show no failure."""
        return self.wrapped.because

    @property
    def loop(self) -> int | None:
        """The number of the step with which the part begins that repeats forever; None: the run is finite."""
        return None if self.wrapped.loop is None else self.wrapped.loop + 1

    def _of(self) -> str:
        shows = self._shows
        if isinstance(shows, FaultSite):
            return f"a run of {shows.code}: {shows.message}"
        asked = saved_query(shows.name, shows.kind, shows.text) if self._of_query else None
        return f"a run of {shows.name}: {asked or asked_text(shows.kind, shows.text)}"

    def save(self, path: str | Path) -> Path:
        """Write the trace file that `replay` and ``llfsm replay`` read. An arrangement that does not come from a file
        has to be given to them again.

        DiagnosticError (E405): that is not possible, or another file would be replaced.
        """
        path = Path(path)
        folder = path.parent
        what: SavedProperty | FaultSite
        if isinstance(self._shows, FaultSite):
            what = self._shows
        elif isinstance(self._shows, Property):
            what = SavedProperty(self._shows.name, "ltl", saved_text(self._shows, folder))
        else:
            what = SavedProperty(self._shows.name, self._shows.kind, saved_text(self._shows, folder))
        trace = replace(self.wrapped, witness=self.wrapped.witness and not self._of_query)
        from_file = Path(self._arrangement.path).is_file()
        arrangement = self._arrangement if from_file else replace(self._arrangement, path=STDIN)
        text = document_of(trace, arrangement, what, self._properties, folder, "violated")
        refuse_others([path])
        write_traces([(path, text)], folder)
        return path
