"""`llfsm verify`: read the files, check, report."""

from __future__ import annotations

import time
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.verdict import Options, Result
from llfsm_verify.cli import BAD_INPUT
from llfsm_verify.cli.certificates import write_certificate
from llfsm_verify.cli.commands.verify import proofs
from llfsm_verify.cli.commands.verify.watching import Checked, verdicts_of, watch
from llfsm_verify.cli.disagreement import both_saved
from llfsm_verify.cli.engine_options import given_options, refuse_misplaced
from llfsm_verify.cli.io.files import announce, is_same_file, ready, traces_ready, write_whole
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.progress import ProgressLine
from llfsm_verify.cli.io.verdicts import EarlyVerdicts
from llfsm_verify.cli.kinds import by_kind
from llfsm_verify.cli.opening import chosen, limits_of, open_arrangement, read_properties, told
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.report.entry import ReportEntry
from llfsm_verify.report.formats import REPORTS, Style
from llfsm_verify.report.plain import PIPE_WIDTH, plain_text
from llfsm_verify.stages import record, stage
from llfsm_verify.verification.engines import ENGINES

REPORT = ("E490", "the report")
"""What is wrong where it cannot be written, and what it is called."""


def run(options: Namespace) -> int:
    """Returns the exit code of the result; raises DiagnosticError for wrong files."""
    proofs.refuse_misuse(options)
    refuse_misplaced(options)
    if options.save_as and options.save_traces is None:
        raise UsageError("--save-as says how --save-traces DIR saves traces besides")
    if options.watch:
        return watch(options, _verified)
    if not options.timings:
        return _verified(options).code
    with _times_told():
        return _verified(options).code


def _verified(options: Namespace) -> Checked:
    """Check once, and write the reports, also of files that are wrong."""
    if options.watch:
        options.started = time.perf_counter()
    reports = _formats_of(options.report)
    spare = {file: name for file, name in reports.items() if not Path(file).exists()}
    try:
        return _checked(options, reports, spare)
    except DiagnosticError as error:
        for file, name in spare.items():
            entry = REPORTS.result[name]
            failed = entry.failed() if isinstance(entry, ReportEntry) else None
            with suppress(DiagnosticError):
                if failed is not None:
                    write_whole(f"{failed(by_kind(error.diagnostics, options), BAD_INPUT)}\n", file, *REPORT)
        raise


def _formats_of(files: Sequence[str]) -> dict[str, str]:
    """The format of each file. UsageError: none ends so. ModuleNotFoundError: a package is not installed."""
    found = {}
    for file in files:
        name = REPORTS.result.named_by(file)
        if name is None:
            raise UsageError(f"no report ends like `{file}`: name it {', '.join(REPORTS.result.suffixes)}")
        REPORTS.result.load(name)
        found[file] = name
    return found


def _checked(options: Namespace, reports: dict[str, str], spare: dict[str, str]) -> Checked:
    """Check. `spare`: the reports that replace no input, as far as is known."""
    _spare_inputs(options)
    with stage("reading the arrangement"):
        arrangement = open_arrangement(options.arrangement)
    if options.compression == "on" and arrangement.observe == "cycle":
        tell("--compression on changes nothing here: with `observe: cycle` there are no chains of whole cycles")
    with stage("reading the properties"):
        properties = told(chosen(read_properties(options), options.only), arrangement)
    unknown = set(options.accept_vacuity) - {p.name for p in properties.goals}
    if unknown:
        raise UsageError(f"--accept-vacuity names no property: {', '.join(sorted(unknown))}")
    ready(arrangement, properties, options.certificate, ("E451", "E450"), "the certificate", whole=True)
    codes = ("E454", "E452")
    ready(arrangement, properties, options.save_invariants, codes, "the file of invariants", whole=True)
    for file in reports:
        ready(arrangement, properties, file, (REPORT[0], REPORT[0]), REPORT[1])
    spare |= reports
    traces_ready(arrangement, properties, options.save_traces, options.save_as)
    if options.check_invariants is not None:
        return Checked(proofs.check_invariants(options, arrangement, properties, limits_of(options)))
    result = _check(arrangement, properties, options)
    if options.check_certificate is not None:
        return Checked(proofs.check_certificate(options, result, arrangement, properties, _left(options)))
    # Traces are saved before anything is printed: a reader who closes the pipe must not lose them.
    saved = _save(result, arrangement, properties, options)
    with stage("printing"):
        gone = _report(result, arrangement, options, reports)
    spare.clear()
    for path in saved:
        announce(path)
    if options.certificate is not None:
        write_certificate(options, result, arrangement, properties, _left(options))
    if options.save_invariants is not None:
        proofs.save_invariants(options, result)
    return Checked(result.exit_code, gone, verdicts_of(result))


def _spare_inputs(options: Namespace) -> None:
    """Raises DiagnosticError when the checkpoint would replace a file that is to be read, if only an empty one."""
    for name in (options.arrangement, *options.properties) if options.checkpoint is not None else ():
        if is_same_file(name, options.checkpoint):
            message = f"{name} is an input of this check, and a checkpoint would replace it"
            raise DiagnosticError(Diagnostic("E415", message, hint="name another file", file=options.checkpoint))


def _check(arrangement: Arrangement, properties: PropertySet, options: Namespace) -> Result:
    from llfsm_verify.verification.verify import verify

    given = given_options(options)
    proves = options.certificate is not None or options.check_certificate is not None
    if options.resume and proves:
        # Not even saved: what is there may be hours ahead of a search from the beginning.
        option = "--certificate" if options.certificate is not None else "--check-certificate"
        tell(f"{option} explores again: {options.checkpoint} is not used, and stays as it is")
        del given["checkpoint"]
    early = EarlyVerdicts(p.name for p in properties.goals)
    with ProgressLine() as line, early:
        wanted = Options(
            limits_of(options),
            options.keep_all_bits,
            progress=line.update if line.shown else None,
            vacuity="all" if options.vacuity or options.strict else "antecedents",
            strict=options.strict,
            accepted=frozenset(options.accept_vacuity),
            allow_contradiction=options.allow_contradiction,
            witnesses=options.witness,
            traces=options.all,
            decided=None if options.quiet else early.add,
            tell=tell,
            quiet=options.quiet,
            own=ENGINES.own(given),
        )
        with both_saved(arrangement, properties, options.save_traces), stage("checking"):
            return verify(arrangement, properties, wanted, options.engine)


def _left(options: Namespace) -> Limits:
    """What the check has left of its limits for the certificate."""
    return replace(limits_of(options), max_states=None)


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


def _report(result: Result, arrangement: Arrangement, options: Namespace, reports: Mapping[str, str]) -> bool:
    """Write the reports and print the result; whether the reader has gone."""
    style = Style(fold=not options.all_steps, whole=time.perf_counter() - options.started)
    for file, name in reports.items():
        made = REPORTS.result.load(name)(result, arrangement, style)
        text = f"{made}\n" if isinstance(made, str) else plain_text(made, options.width or PIPE_WIDTH)
        write_whole(text, file, *REPORT)
    output = Output(options.color, options.width)
    output.write(REPORTS.result.load(options.format)(result, arrangement, replace(style, quiet=options.quiet)))
    tell(*(f"{file} written" for file in reports))
    return output.closed


@contextmanager
def _times_told() -> Iterator[None]:
    """Say on standard error where the time of what is done within went, whatever its end."""
    start = time.process_time()
    recording = record()
    try:
        yield
    finally:
        recording.now()
        rows = {"starting: Python, imports and arguments": (start, None), **recording.spent}
        rows |= {"the whole process": (time.process_time(), None), **recording.parts}
        width = max(map(len, rows))
        lines = [f"{'where the time went'.ljust(width)}  {'CPU s':>8}  {'wall s':>8}"]
        for name, (cpu, wall) in rows.items():
            lines.append(f"{name.ljust(width)}  {cpu:8.3f}  {'' if wall is None else f'{wall:8.3f}'}".rstrip())
        tell("\n".join(lines))
