"""`llfsm verify`: read the files, check, report."""

from __future__ import annotations

import sys
import time
from argparse import Namespace
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.cli.certificates import certificate_mistake, check_certificate, write_certificate
from llfsm_verify.cli.checked import Checked, verdicts_of
from llfsm_verify.cli.disagreement import both_saved
from llfsm_verify.cli.engine_options import engine_mistake, given_options
from llfsm_verify.cli.invariants import check_invariants, invariants_mistake, save_invariants
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.io.outputs import ready, traces_ready
from llfsm_verify.cli.io.progress import ProgressLine
from llfsm_verify.cli.io.saved import announce
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from llfsm_verify.cli.io.whole_file import is_same_file
from llfsm_verify.cli.opening import open_arrangement, refuse_two_inputs
from llfsm_verify.cli.properties import chosen, read_properties, told
from llfsm_verify.cli.usage import UsageError, usage
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.stages import stage
from llfsm_verify.verification.engines import ENGINES


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError for wrong files."""
    refuse_two_inputs([options.arrangement, *options.properties])
    mistake = certificate_mistake(options) or invariants_mistake(options)
    mistake = mistake or engine_mistake(options) or _saving_mistake(options)
    if mistake is not None:
        return usage(mistake)
    if options.watch:
        from llfsm_verify.cli.watching import watch

        return watch(options, _verified)
    if not options.timings:
        return _verified(options).code
    from llfsm_verify.cli.timings import told

    with told():
        return _verified(options).code


def _verified(options: Namespace) -> Checked:
    """Check once."""
    from llfsm_verify.checking.goals.kinds import CHECKED

    if options.watch:
        options.started = time.perf_counter()
    _spare_inputs(options)
    with stage("reading the arrangement"):
        arrangement = open_arrangement(options.arrangement)
    if options.compression == "on" and arrangement.observe == "cycle":
        _tell("--compression on changes nothing here: with `observe: cycle` there are no chains of whole cycles")
    try:
        with stage("reading the properties"):
            properties = told(chosen(read_properties(options, CHECKED), options.only), arrangement)
    except UsageError as wrong:  # with --watch it is said, and the files are watched on
        return Checked(usage(str(wrong)))
    unknown = set(options.accept_vacuity) - {p.name for p in properties.goals}
    if unknown:
        return Checked(usage(f"--accept-vacuity names no property: {', '.join(sorted(unknown))}"))
    ready(arrangement, properties, options.certificate, ("E451", "E450"), "the certificate", whole=True)
    codes = ("E454", "E452")
    ready(arrangement, properties, options.save_invariants, codes, "the file of invariants", whole=True)
    traces_ready(arrangement, properties, options.save_traces, options.save_as)
    if options.check_invariants is not None:
        limits = Limits(None, options.memory, options.timeout)
        return Checked(check_invariants(options, arrangement, properties, limits))
    result = _check(arrangement, properties, options)
    if options.check_certificate is not None:
        return Checked(check_certificate(options, result, arrangement, properties, _left(result, options)))
    # Traces are saved before anything is printed: a reader who closes the pipe must not lose them.
    saved = _save(result, arrangement, properties, options)
    with stage("printing"):
        gone = _report(result, arrangement, options)
    for path in saved:
        announce(path)
    if options.certificate is not None:
        write_certificate(options, result, arrangement, properties, _left(result, options))
    if options.save_invariants is not None:
        save_invariants(options, result)
    return Checked(result.exit_code, gone, verdicts_of(result))


def _saving_mistake(options: Namespace) -> str | None:
    """What is wrong with the options about traces."""
    alone = options.save_as and options.save_traces is None
    return "--save-as says how --save-traces DIR saves traces besides" if alone else None


def _spare_inputs(options: Namespace) -> None:
    """Raises DiagnosticError when the checkpoint would replace a file that is to be read, if only an empty one."""
    for name in (options.arrangement, *options.properties) if options.checkpoint is not None else ():
        if is_same_file(name, options.checkpoint):
            message = f"{name} is an input of this check, and a checkpoint would replace it"
            raise DiagnosticError(Diagnostic("E415", message, hint="name another file", file=options.checkpoint))


def _check(arrangement: Arrangement, properties: PropertySet, options: Namespace) -> Result:
    from llfsm_verify.verification.verify import verify

    limits = Limits(options.max_states, options.memory, options.timeout)
    given = given_options(options)
    proves = options.certificate is not None or options.check_certificate is not None
    if options.resume and proves:
        # Not even saved: what is there may be hours ahead of a search from the beginning.
        option = "--certificate" if options.certificate is not None else "--check-certificate"
        _tell(f"{option} explores again: {options.checkpoint} is not used, and stays as it is")
        del given["checkpoint"]
    early = EarlyVerdicts(p.name for p in properties.goals)
    with ProgressLine() as line, early:
        wanted = Options(
            limits,
            options.keep_all_bits,
            progress=line.update if line.shown else None,
            vacuity="all" if options.vacuity or options.strict else "antecedents",
            strict=options.strict,
            accepted=frozenset(options.accept_vacuity),
            allow_contradiction=options.allow_contradiction,
            witnesses=options.witness,
            traces=options.all,
            decided=None if options.quiet else early.add,
            tell=_tell,
            quiet=options.quiet,
            own=ENGINES.own(given),
        )
        with both_saved(arrangement, properties, options.save_traces), stage("checking"):
            return verify(arrangement, properties, wanted, options.engine)


def _left(result: Result, options: Namespace) -> Limits:
    """What the check has left of its limits for the certificate."""
    left = None if options.timeout is None else max(options.timeout - result.seconds, 0.0)
    return Limits(None, options.memory, left)


def _tell(text: str) -> None:
    print(text, file=sys.stderr)


def _save(result: Result, arrangement: Arrangement, properties: PropertySet, options: Namespace) -> list[Path]:
    if options.save_traces is None:
        return []
    from llfsm_verify.report.saving import save_traces

    folder = Path(options.save_traces)
    saved = save_traces(result, arrangement, properties, folder)
    if options.save_as:
        from llfsm_verify.report.timeline.saving import save_timelines

        save_timelines(result, arrangement, folder, options.save_as)
    return saved


def _report(result: Result, arrangement: Arrangement, options: Namespace) -> bool:
    """Print the result; whether the reader has gone."""
    output = Output(options.color, options.width)
    style = Style(quiet=options.quiet, fold=not options.all_steps, whole=time.perf_counter() - options.started)
    output.write(REPORTS.result.load(options.format)(result, arrangement, style))
    return output.closed
