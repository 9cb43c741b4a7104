"""`llfsm verify`: read the files, check, report."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Checkpointing, Limits, Options, Result
from llfsm_verify.cli.output import Output, usage
from llfsm_verify.cli.progress import ProgressLine
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.logic.properties import PLAIN, Feature, PropertySet, parse_properties
from llfsm_verify.logic.reading import read_source


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError for wrong files."""
    from llfsm_verify.checking.kinds import CHECKED

    if [options.arrangement, *options.properties].count("-") > 1:
        return usage("standard input can be read only once")
    if options.resume and options.checkpoint is None:
        return usage("--resume goes on from the file that --checkpoint FILE names")
    arrangement = load_arrangement(options.arrangement)
    for warning in arrangement.warnings:
        print(warning.render(), file=sys.stderr)
    properties = _properties(options, CHECKED)
    result = _check(arrangement, properties, options)
    # Traces are saved before anything is printed: a reader who closes the pipe must not lose them.
    saved = _save(result, arrangement, properties, options.save_traces)
    _report(result, options)
    for path in saved:
        _announce(path)
    return result.exit_code


def _properties(options: Namespace, features: frozenset[Feature] = PLAIN) -> PropertySet:
    sources = [read_source(path) for path in options.properties]
    if options.property:
        # One source, so that bare formulas get different names (L1, L2, …).
        sources.append(Source("<command line>", "\n".join(options.property)))
    return parse_properties(sources, options.syntax, features)


def _check(arrangement: Arrangement, properties: PropertySet, options: Namespace) -> Result:
    from llfsm_verify.checking.verify import verify
    from llfsm_verify.kripke.compiled import kernels

    if sys.stderr.isatty():
        kernels().announce = _tell
    limits = Limits(options.max_states, options.memory, options.timeout)
    checkpoint = None
    if options.checkpoint is not None:
        checkpoint = Checkpointing(Path(options.checkpoint), options.checkpoint_every, options.resume)
    with ProgressLine() as line:
        wanted = Options(
            limits,
            options.keep_all_bits,
            cone=options.cone,
            chains=options.chains,
            progress=line.update if line.shown else None,
            checkpoint=checkpoint,
            tell=_tell,
        )
        result = verify(arrangement, properties, wanted, options.engine)
    if kernels().note is not None:
        _tell(str(kernels().note))
    return result


def _tell(text: str) -> None:
    print(text, file=sys.stderr)


def _save(result: Result, arrangement: Arrangement, properties: PropertySet, directory: str | None) -> list[Path]:
    if directory is None:
        return []
    from llfsm_verify.report.saving import save_traces

    return save_traces(result, arrangement, properties, Path(directory))


def _announce(path: Path) -> None:
    """Say where a trace is; one that is too long to be read again is said to be so."""
    from llfsm_verify.report.tracefile import read_trace_file

    print(f"trace saved: {path}", file=sys.stderr)
    try:
        read_trace_file(path)
    except DiagnosticError as error:
        first = error.diagnostics[0]
        print(Diagnostic("W401", f"it cannot be replayed: {first.message}", file=str(path)).render(), file=sys.stderr)


def _report(result: Result, options: Namespace) -> None:
    output = Output(options.color)
    if options.format == "json":
        from llfsm_verify.report.json import result_json

        output.plain(result_json(result) + "\n")
    elif options.format == "junit":
        from llfsm_verify.report.junit import result_junit

        output.plain(result_junit(result) + "\n")
    else:
        from llfsm_verify.report.text import result_text

        output.rich(result_text(result, quiet=options.quiet, fold=not options.full_traces))
