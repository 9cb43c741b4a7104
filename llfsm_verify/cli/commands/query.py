"""`llfsm query`: a run that reaches something, or the proof that none does."""

from __future__ import annotations

import time
from argparse import Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.engine_options import engine_options, given_options, refuse_misplaced
from llfsm_verify.cli.io.files import ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.opening import COMMAND_LINE, limits_of, open_arrangement
from llfsm_verify.cli.parser import Parser, UsageError
from llfsm_verify.engines.explicit.options import JOBS_OPTION
from llfsm_verify.engines.unrolled.options import UnrolledOptions
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.verification.engines import ENGINES

if TYPE_CHECKING:
    from llfsm_verify.arrangement.model import Arrangement
    from llfsm_verify.verification.query import QueryResult


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm query`."""
    parser.about(
        "Find a shortest run that reaches a configuration or step, or prove that no run does.",
        "llfsm query arrangement.yaml 'north@GREEN && count > 3' --save run.trace.yaml",
        "exit codes: 0 a run reaches it, 1 proved that none does, 2 wrong usage, 3 input wrong or unreadable, "
        "4 unknown, 5 a check of a result failed, 70 internal error, 130 interrupted",
    )
    add = parser.add_argument
    shared.arrangement(parser)
    add("formula", metavar="FORMULA", help="a state formula, such as 'ns@GREEN && count > 3'")
    shared.syntax(parser, "how FORMULA is written")
    shared.engine(parser)
    engine_options(parser, parser, (*UnrolledOptions.OPTIONS, JOBS_OPTION))
    shared.choice(parser, "--format", REPORTS.query, "how to report")
    add("--save", metavar="FILE", help="save the run there, for llfsm replay")
    shared.max_states(parser)
    shared.memory_and_timeout(parser)
    shared.all_steps(parser)
    shared.colour(parser)


def run(options: Namespace) -> int:
    """Returns the exit code of the answer; raises DiagnosticError for wrong files or a wrong formula."""
    from llfsm_verify.checking.verdict import Options
    from llfsm_verify.cli.disagreement import both_saved
    from llfsm_verify.cli.io.progress import ProgressLine
    from llfsm_verify.report.saving import refuse_others
    from llfsm_verify.verification.query import ask, parse_query

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
    from llfsm_verify.verification.query import NAME
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
