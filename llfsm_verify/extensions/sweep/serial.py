"""Tasks performed one after the other, in this process."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

from llfsm_verify import DiagnosticError, Model
from llfsm_verify.extensions.sweep.task import Outcome, Task
from llfsm_verify.extensions.sweep.values import with_values
from llfsm_verify.plug import GivenArrangement, read_arrangement, resolve, trace_documents


class Serial:
    """One task after the other."""

    def run(self, tasks: Iterable[Task], ended: Callable[[Task, Outcome], None]) -> None:
        """See `Scheduler`."""
        for task in tasks:
            ended(task, perform(task))

    def close(self) -> None:
        """See `Scheduler`."""


def perform(task: Task) -> Outcome:
    """Check in this process."""
    started = time.perf_counter()
    with TemporaryDirectory(prefix="llfsm-") as name:
        folder = Path(name)
        for path, text in task.files:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
            (folder / path).write_text(text, encoding="utf-8")
        options = {"timeout": task.timeout, "memory": task.memory, **dict(task.options)}
        try:
            draft = with_values(read_arrangement(GivenArrangement(folder / task.arrangement)), task.values)
            arrangement = resolve(draft)
            found = Model(arrangement).check([folder / each for each in task.properties], **options)  # type: ignore[arg-type]
        except DiagnosticError as error:
            message = "\n".join(each.render() for each in error.diagnostics).replace(f"{folder}/", "")
            return Outcome("failed", None, message, time.perf_counter() - started)
        traces = tuple(
            (each, text.replace(f"{folder}/", ""))
            for each, _, text in trace_documents(found.wrapped, arrangement, found._properties, folder)
        )
        return Outcome("done", found.to_dict(), "", time.perf_counter() - started, 0, traces)
