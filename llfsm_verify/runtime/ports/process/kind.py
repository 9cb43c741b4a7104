"""The kind `process`, and what kinds of extensions that are programs have in common with it."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from pathlib import Path

from llfsm_verify.runtime.ports import UNKNOWN
from llfsm_verify.runtime.ports.port import Kind, Started
from llfsm_verify.runtime.ports.process.port import ProcessSettings
from llfsm_verify.yaml.fields import Report
from llfsm_verify.yaml.nodes import Node, mark
from llfsm_verify.yaml.nodes import Sequence as SequenceNode
from llfsm_verify.yaml.tables import TRUTHS, Either, Field, Several, Single, Table, Words

CHILD_FIELDS = (
    Field("patience", "how long the program may take to say hello; the default is `10s`", Single(("string",))),
    Field("restart", "whether it is started again when it has failed; the default is `true`", Words(TRUTHS)),
)
"""What every kind has whose ports are programs."""


def patience_of(report: Report, found: Mapping[str, Node], what: str) -> tuple[float, bool] | None:
    """`CHILD_FIELDS` of a port; None: one is wrong, which was reported."""
    before = len(report.diagnostics)
    restart = report.choice(found.get("restart"), f"`restart` of {what}", TRUTHS, "true") == "true"
    milliseconds = report.time(found.get("patience"), "`patience`", UNKNOWN)
    if len(report.diagnostics) > before:
        return None
    return 10.0 if milliseconds is None else float(milliseconds / 1000), restart


def words_of(report: Report, node: Node, what: str) -> tuple[str, ...] | None:
    """The words of a command line: a list, or a text that is split as a shell splits it; None: it was reported."""
    hint = "write `run: [python3, program.py]`"
    if isinstance(node, SequenceNode):
        scalars = [report.scalar(item, "a word of `run`") for item in node.items]
        words = [scalar.text for scalar in scalars if scalar is not None]
        if len(words) < len(scalars):
            return None
    else:
        scalar = report.scalar(node, "`run`")
        if scalar is None:
            return None
        try:
            words = shlex.split(scalar.text)
        except ValueError:
            report.error(UNKNOWN, f"{what} cannot run `{scalar.text[:60]}`: a quote has no end", mark(scalar), hint)
            return None
    if not words or not words[0] or any("\0" in word for word in words):
        report.error(UNKNOWN, f"{what} names no program", mark(node), hint)
        return None
    return tuple(words)


class Process(Kind):
    """`run:`, a program of the user's."""

    table = Table(
        "a program, which speaks lines of JSON",
        (
            Field(
                "run",
                "the program and its arguments: a list of words, or a text that is split as a shell splits it; no "
                "shell runs",
                Either((Single(("string",)), Several(Single(("string", "number")), different=False))),
                required=True,
            ),
            *CHILD_FIELDS,
            Field(
                "clock",
                "`external`: the program begins the cycles of the run; without it, time does",
                Words(("external",)),
            ),
        ),
    )
    keys, required = table.keys, table.required
    requests = Table("a request", ())

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        words = words_of(report, found["run"], what)
        timing = patience_of(report, found, what)
        if words is None or timing is None:
            return None
        before = len(report.diagnostics)
        paces = report.choice(found.get("clock"), f"`clock` of {what}", ("external",), "") == "external"
        if len(report.diagnostics) > before:
            return None
        return ProcessSettings(words, str(Path(folder).resolve()), {}, *timing, paces=paces).started


KIND = Process()
