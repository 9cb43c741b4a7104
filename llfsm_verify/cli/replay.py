"""`llfsm replay`: run saved traces again and say whether what they show still happens."""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.binding import bind
from llfsm_verify.checking.confirm import Script
from llfsm_verify.checking.kinds import CHECKED
from llfsm_verify.checking.replay import Replay, replay
from llfsm_verify.cli.output import Output
from llfsm_verify.cli.values import ValueProblem, choice_value
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.kripke.explore import Move
from llfsm_verify.logic.properties import PropertySet, parse_properties
from llfsm_verify.report.tracefile import TraceFile, profile_words, read_trace_file
from llfsm_verify.semantics.lowering import lower

MISFIT = 3


def run(options: Namespace) -> int:
    """The worst code over all traces: 3 when one no longer fits or is no trace file, then 1, then 0."""
    worst = 0
    output = Output(options.color)
    for path in options.traces:
        worst = max(worst, _replay(path, options.arrangement, output, quiet=options.quiet))
    return worst


def _replay(path: str, arrangement_path: str | None, output: Output, *, quiet: bool) -> int:
    file = read_trace_file(path)
    arrangement = load_arrangement(arrangement_path or _arrangement_path(file))
    properties = _properties(file)
    done = replay(arrangement, properties, _script(file, arrangement, properties), file.fault)
    code = _code(done, file)
    if not quiet:
        _show(done, file, arrangement, output)
    output.plain(f"{path}: {_sentence(done, file)}\n")
    return code


def _arrangement_path(file: TraceFile) -> str:
    if file.from_stdin:
        hint = "name it with --arrangement FILE"
        message = "the arrangement of this trace was read from standard input"
        raise DiagnosticError(Diagnostic("E410", message, hint=hint, file=file.path))
    return file.arrangement_path


def _properties(file: TraceFile) -> PropertySet:
    """The property and its assumptions as they are written in the trace file."""
    lines = {name: f"assume {name}: {text}" for name, text in file.assumptions}
    if file.goal is not None:
        kind = "" if file.goal.kind == "ltl" else f"{file.goal.kind} "
        text = file.goal.text
        if file.goal.names_a_file:
            text = f'"{Path(file.path).parent.absolute() / text}"'
        lines[file.goal.name] = f"{kind}{file.goal.name}: {text}"
    where, syntaxes = f"the property in {file.path}", dict(file.syntaxes)
    # One source each: their syntaxes may differ.
    sources = [
        Source(where, f"# syntax: {syntaxes[name]}\n{line}" if name in syntaxes else line)
        for name, line in lines.items()
    ]
    return parse_properties(sources, features=CHECKED)


def _script(file: TraceFile, arrangement: Arrangement, properties: PropertySet) -> Script:
    """The choices as numbers; DiagnosticError (E411) for a process, or a value, that the arrangement does not have."""
    program = lower(arrangement, bind(arrangement, properties).atoms)
    processes = {process.name: i for i, process in enumerate(program.processes)}
    choices = {choice.name: choice for choice in program.choices}
    moves: list[Move] = []
    for number, step in enumerate(file.steps, 1):
        if step.process is not None and step.process not in processes:
            message = f"step {number}: there is no process `{step.process}` any more"
            raise DiagnosticError(Diagnostic("E411", message, step.span))
        values: dict[str, int] = {}
        for name, text in step.choices:
            # A choice that is gone is no misfit by itself: the arrangement may have stopped reading that input.
            if name not in choices:
                continue
            try:
                values[name] = choice_value(choices[name], text)
            except ValueProblem as problem:
                raise DiagnosticError(Diagnostic("E411", f"step {number}: {name}: {problem}", step.span)) from None
        moves.append(Move(None if step.process is None else processes[step.process], values))
    return Script(file.free, tuple(moves), file.loop)


def _code(done: Replay, file: TraceFile) -> int:
    if done.outcome == "misfit":
        return MISFIT
    return 0 if (done.outcome == "fails") == (file.expect == "violated") else 1


def _sentence(done: Replay, file: TraceFile) -> str:
    if done.outcome == "misfit":
        return f"does not fit any more: {done.reason}"
    happens = "still happens" if done.outcome == "fails" else "does not happen any more"
    expected = "" if file.expect == "violated" else " (expected: holds)"
    return f"the failure {happens}: {done.reason}{expected}"


def _show(done: Replay, file: TraceFile, arrangement: Arrangement, output: Output) -> None:
    from llfsm_verify.report.steptable import StepTable
    from llfsm_verify.report.tracetable import because_text

    if file.goal is not None:
        output.plain(f"{file.goal.name}: {file.goal.text}\n")
    if arrangement.digest != file.digest:
        output.plain("note: the arrangement has changed since the trace was saved\n")
    if file.profile != profile_words(arrangement.profile):
        output.plain("note: the arrangement has another profile than when the trace was saved\n")
    if done.trace is not None:
        output.rich([StepTable(done.trace)])
        because = because_text(done.trace)
        if because is not None:
            output.plain(f"{because[0].upper()}{because[1:]}.\n")
