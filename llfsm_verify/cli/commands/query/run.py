"""`llfsm query`: a run that reaches something, or the proof that none does."""

from __future__ import annotations

import time
from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options
from llfsm_verify.cli.disagreement import both_saved
from llfsm_verify.cli.engine_options import given_options, refuse_misplaced
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.progress import ProgressLine
from llfsm_verify.cli.opening import COMMAND_LINE, limits_of, open_arrangement
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.verification.engines import ENGINES
from llfsm_verify.verification.query import NAME, QueryResult, ask, parse_query


def run(options: Namespace) -> int:
    """Returns the exit code of the answer; raises DiagnosticError for wrong files or a wrong formula."""
    from llfsm_verify.report.saving import refuse_others

    refuse_misplaced(options)
    if options.save in ("", "-"):
        raise UsageError("--save needs the name of a file")
    arrangement = open_arrangement(options.arrangement)
    query = parse_query(options.formula, COMMAND_LINE, options.syntax)
    if options.save is not None:
        ready(arrangement, query.properties, options.save, ("E405", "E405"), "the run")
        refuse_others([Path(options.save)])
    with ProgressLine() as line, both_saved(arrangement, query.properties, None):
        progress, own = line.update if line.shown else None, ENGINES.own(given_options(options))
        wanted = Options(limits_of(options), progress=progress, own=own)
        answer = ask(arrangement, query, wanted, options.engine)
    if options.save is not None:
        _save(answer, arrangement, options.save)
    output = Output(options.color, options.width)
    output.write(
        REPORTS.query.load(options.format)(
            answer, arrangement, Style(fold=not options.all_steps, whole=time.perf_counter() - options.started)
        )
    )
    return answer.exit_code


def _save(answer: QueryResult, arrangement: Arrangement, name: str) -> None:
    """The run, for `llfsm replay`. Raises DiagnosticError (E405)."""
    from llfsm_verify.verification.tracefile import SavedProperty, document_of

    trace = answer.result.properties[0].trace
    if trace is None:
        tell("no run was found, so none is saved")
        return
    goal = answer.query.properties.goals[0]
    saved = SavedProperty(NAME, "ltl", goal.text)
    text = document_of(trace, arrangement, saved, answer.query.properties, Path(name).parent, "violated")
    write_whole(text, name, "E405", "the run")
    tell(f"trace saved: {name}")
