"""A page for a safety case: what was checked, what is claimed of it, by what, and on which assumptions (Markdown)."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version

from llfsm_verify.plug import (
    Arrangement,
    PropertyResult,
    PropertySet,
    Result,
    Source,
    Verdict,
    asked_text,
    fault_text,
    summary_text,
    vacuity_texts,
    verdict_text,
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Checked:
    """What was checked, with what came of it."""

    result: Result
    arrangement: Arrangement
    properties: PropertySet
    sources: Sequence[Source]
    """The texts of the arrangement."""
    policy: str
    """The hash of its policy."""
    certificate: tuple[str, str] | None = None
    """The name of a certificate, and its hash."""


def assurance(checked: Checked) -> str:
    """The page."""
    parts = (_subject, _claims, _open, _assumptions, _evidence)
    return "\n".join(line for part in parts for line in (*part(checked), "")).rstrip() + "\n"


def _subject(checked: Checked) -> Iterator[str]:
    arrangement = checked.arrangement
    yield f"# Assurance: {arrangement.name}"
    yield ""
    yield f"Made by llfsm-verify {version('llfsm-verify')}. It is about these texts, and no others:"
    yield ""
    yield "| file | SHA-256 |"
    yield "|---|---|"
    for source in (*checked.sources, *dict.fromkeys(p.span.source for p in checked.properties)):
        yield f"| `{source.name}` | `{hashlib.sha256(source.text.encode('utf-8', 'surrogatepass')).hexdigest()}` |"
    yield ""
    yield f"The arrangement has the hash `{arrangement.digest}`,"
    yield f"and its policy `{checked.policy}`: recordings of its runs have the same hashes."


def _claims(checked: Checked) -> Iterator[str]:
    result = checked.result
    yield "## Claims"
    yield ""
    yield "| | property | verdict |"
    yield "|---|---|---|"
    for item in result.properties:
        yield f"| {item.name} | `{_cell(asked_text(item.kind, item.text))}` | {verdict_text(result, item)} |"
    yield f"| faults | {_cell(fault_text(result))} | {result.faults.verdict.value} |"
    yield ""
    yield f"{summary_text(result)}."
    notes = [f"- {item.name}: {text}." for item in result.properties for text in vacuity_texts(result, item)]
    if notes:
        yield ""
        yield from notes


def _open(checked: Checked) -> Iterator[str]:
    result = checked.result
    yield "## What is open"
    yield ""
    lines = [
        f"- {item.name} is {item.verdict.value}" + (f": {item.reason}" if item.reason else "") + "."
        for item in result.properties
        if item.verdict is not Verdict.HOLDS
    ]
    lines += [f"- {p.name} holds, but vacuously (see above)." for p in result.properties if _weak(result, p)]
    if result.faults.verdict is not Verdict.HOLDS:
        lines.append(f"- {fault_text(result)}.")
    yield from lines or ["Nothing: each property above holds."]


def _weak(result: Result, item: PropertyResult) -> bool:
    """A pass that fails under ``--strict``, or that was not looked at."""
    return result.is_empty(item) or result.is_unseen(item) or result.is_claimed(item.verdict)


def _assumptions(checked: Checked) -> Iterator[str]:
    arrangement = checked.arrangement
    yield "## Assumptions"
    yield ""
    yield "- The texts say what is meant."
    for line in checked.properties.assumptions:
        yield f"- {line.name}: `{asked_text('ltl', line.text)}`."
    for plant in arrangement.plants:
        yield f"- The surroundings behave as the model `{plant.kind}` says."
    free = [w.variable.name for w in arrangement.whiteboard if w.role == "input" and not w.driven]
    if free:
        yield f"- Nothing is assumed about these inputs: {', '.join(f'`{name}`' for name in free)}."
    models = [machine.name for machine in arrangement.machines if machine.model]
    if models:
        yield f"- These machines are models: {', '.join(f'`{name}`' for name in models)}."
    if arrangement.timing == "timed" and arrangement.cycle_ms is not None:
        cycle = f"{float(arrangement.cycle_ms):g} ms"
        yield f"- Time is logical: a cycle is {cycle}. How late cycles begin is measured in each run."
    else:
        yield "- Time is not measured: a clock may show any time that has come."
    yield "- The clock, the operating system, sensors, outputs and hardware are as docs/safety.md of llfsm-verify says."


def _evidence(checked: Checked) -> Iterator[str]:
    yield "## Evidence"
    yield ""
    yield "Each violation was performed again by the executor that runs the arrangement."
    if checked.certificate is None:
        yield "There is no certificate for what holds: `--certificate FILE` writes one."
    else:
        name, digest = checked.certificate
        yield f"`{name}` certifies what holds, for `llfsm-check-certificate`; its SHA-256 is `{digest}`."


def _cell(text: str) -> str:
    """A text inside a cell of a table."""
    return text.replace("|", "\\|")
