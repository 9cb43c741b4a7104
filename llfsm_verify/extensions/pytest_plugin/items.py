"""A trace file as a test: run again on the executor, it must find what `expect:` says."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from llfsm_verify.extensions.pytest_plugin.texts import SUFFIX, UPDATE

if TYPE_CHECKING:
    from llfsm_verify.plug import Replayed

ANSWER = "llfsm"
"""The key of what a test tells at the end of the run."""


class TraceTests(pytest.File):
    """A trace file; it holds one test."""

    def collect(self) -> Iterable[TraceTest]:
        item: TraceTest = TraceTest.from_parent(self, name="replay")
        yield item


class TraceTest(pytest.Item):
    """The replay of a trace file."""

    def runtest(self) -> None:
        """Fails when the replay finds something else than `expect:`, or when the file no longer fits."""
        from llfsm_verify.extensions.pytest_plugin.session import session_of, without_traceback
        from llfsm_verify.plug import replay_file

        with without_traceback(self.config):
            done = replay_file(str(self.path), None, session_of(self.config).arrangement)
            if done.found is not None and self.config.getoption(UPDATE):
                self._update(done)
            elif done.found != done.file.expect:
                pytest.fail(self._text(done), pytrace=False)

    def _update(self, done: Replayed) -> None:
        """Write what was found into the file, where it says something else."""
        from llfsm_verify.plug import update_trace_file

        assert done.found is not None
        if update_trace_file(self.path, done.found, done.arrangement.digest):
            changed = f"expect: {done.file.expect} → {done.found}" if done.found != done.file.expect else "digest"
            self.user_properties.append((ANSWER, f"updated {self._shown}: {changed}"))

    def _text(self, done: Replayed) -> str:
        """The sentence of `llfsm replay`, what to do about it, and the table of the steps."""
        from llfsm_verify.extensions.pytest_plugin.session import width
        from llfsm_verify.plug import plain_text, trace_text

        lines = [f"{self._shown}: {done.sentence}", done.title]
        lines += [f"note: {note}" for note in done.notes]
        if done.replay.trace is not None:
            lines.append(plain_text(trace_text(done.replay.trace), width(self.config)).rstrip())
        if done.found is None:
            lines.append("hint: find the failure and save it again, or remove the file")
        elif done.found == "holds":
            hint = "`expect: holds` makes the file a regression test; pytest --llfsm-update writes it"
            lines.append(f"hint: if it is corrected, {hint}")
        return "\n".join(lines)

    @property
    def _shown(self) -> str:
        return os.path.relpath(self.path, self.config.invocation_params.dir)

    def reportinfo(self) -> tuple[Path, None, str]:
        """The heading of a failure."""
        return self.path, None, f"replay of {self.path.name.removesuffix(SUFFIX)}"
