"""Answers to queries as text and as JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import islice
from typing import TYPE_CHECKING

from rich.text import Text

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.diagnostics import counted
from llfsm_verify.fileformat import FORMAT
from llfsm_verify.jsonvalue import Json
from llfsm_verify.report.formats import Style
from llfsm_verify.report.json import attempt_object, proof_object, trace_object
from llfsm_verify.report.text import STYLES, proofs_text, run_text
from llfsm_verify.report.wording import attempt_texts, summary_text
from llfsm_verify.verification.query import NAME, QueryResult

if TYPE_CHECKING:
    from rich.console import RenderableType


def query_text(answer: QueryResult, *, fold: bool = True, whole: float | None = None) -> Iterator[RenderableType]:
    """What `llfsm query --format text` prints."""
    trace = answer.trace
    line = Text.assemble((answer.word, STYLES[answer.verdict]), f"  {answer.query.text}")
    if trace is not None:
        count = len(trace.steps)
        line.append(f"  after {counted(count, 'step')}" if count else "  at the start")
    if answer.reason is not None:
        line.append(f"\n{' ' * len(answer.word)}  because {answer.reason}")
    yield line
    yield Text()
    if trace is not None:
        yield from run_text(trace, fold=fold)
        yield Text()
    if answer.proofs:
        yield from islice(proofs_text(NAME, answer.proofs), 1, None)
        yield Text()
    yield Text(summary_text(answer.result, whole))
    for sentence in attempt_texts(answer.attempts):
        yield Text(f"  {sentence}")


def query_object(answer: QueryResult) -> dict[str, Json]:
    """The answer as plain dictionaries and lists."""
    result = answer.result
    return {
        "format": FORMAT,
        "arrangement": result.arrangement,
        "path": result.path,
        "formula": answer.query.text,
        "answer": answer.word,
        "reason": answer.reason,
        "engine": answer.engine,
        "attempts": [attempt_object(attempt) for attempt in answer.attempts],
        "complete": answer.is_complete,
        "states": result.exploration.states,
        "seconds": round(result.seconds, 6),
        "trace": None if answer.trace is None else trace_object(answer.trace),
        "proofs": [proof_object(proof) for proof in answer.proofs],
        "exit_code": answer.exit_code,
    }


def report(answer: QueryResult, _: Arrangement, style: Style) -> Iterator[RenderableType]:
    """The report for people, as `report.formats` knows it."""
    return query_text(answer, fold=style.fold, whole=style.whole)


def report_json(answer: QueryResult, _: Arrangement, __: Style) -> str:
    """The report for programs, as `report.formats` knows it: one JSON object (schema `query`)."""
    return json.dumps(query_object(answer), indent=2, ensure_ascii=False)
