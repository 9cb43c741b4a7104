"""`llfsm run`: an arrangement runs, in real time or as fast as possible."""

from __future__ import annotations

import errno
import os
import random
import resource
import signal
import sys
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, nullcontext
from dataclasses import replace
from fractions import Fraction

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.granting import policy_digest
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.cli.arguments import DRAWN, assignments
from llfsm_verify.cli.io.output import Output, tell
from llfsm_verify.cli.io.standard_error import unhurried_errors
from llfsm_verify.cli.opening import open_draft, property_sources, told
from llfsm_verify.cli.parser import UsageError, wrong_usage
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, without_controls
from llfsm_verify.jsonvalue import Json
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.report.running import port_lines, report_lines
from llfsm_verify.runtime.launch import (
    PANELS,
    Launch,
    Launched,
    declared_ports,
    following,
    launched,
    opened_early,
    serve,
    serving,
    with_ports,
)
from llfsm_verify.runtime.live import CROWDED, UNSERVED
from llfsm_verify.runtime.live.loop import Prescribed
from llfsm_verify.runtime.live.pace import Pace
from llfsm_verify.runtime.live.plan import script_of
from llfsm_verify.runtime.live.run import RunReport
from llfsm_verify.runtime.live.signals import stopping
from llfsm_verify.runtime.ports.line_port import STANDARD_INPUT, STANDARD_OUTPUT
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.runtime.ports.ports import Ports
from llfsm_verify.runtime.stepping.drawing import DrawingError
from llfsm_verify.runtime.swapping.settings import RunSettings
from llfsm_verify.runtime.whiteboard.audit import ENDED, AuditLog, seal_of
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.server import NameTaken

VIOLATED, UNKNOWN = 1, 4
MOST_SAID = 300
"""Characters of a refusal."""


def run(options: Namespace) -> int:
    """0 when it was stopped or has ended by itself, 1 after a fault, an overrun under ``--on-overrun stop``, a port
    that stopped it, or a recording or an audit log that ended before it, 4 when a value left 64 bits. UsageError;
    DiagnosticError: wrong files, an arrangement that cannot run, or an audit log that cannot be written (E500).
    """
    do_more_tasks()
    _refuse_misuse(options)
    draft, given = open_draft(options.arrangement)
    with (
        ExitStack() as left,
        unhurried_errors(),
        _enough_descriptors(),
        nullcontext(_ready(options, draft, given, left)) as (ready, scripted),
        _audited(options.audit, draft.digest, ready.plan.arrangement) as audit,
        _launched(ready, audit, swaps=not scripted) as done,
        serving(ready, done, _say_of_port) as ports,
        stopping(done.run.stop) as suspended,
        closing(PANELS.load(next(iter(PANELS)))(done.shared, ready)) if options.panel else nullcontext() as pictures,
    ):
        done.start(*([] if ports is None else [following(ports)]), *([] if pictures is None else [pictures.follow]))
        serve(done.run, [*(one for one in (ports, pictures) if one is not None), *done.attendants])
        report = done.run.report
        _note_end(done, report, ports, audit)
    failure = ports.failure if ports is not None and report.ending == "stopped" else None
    said = list(report_lines(report, ready.plan.cycle, done.run.recordings, failure))
    if audit is not None:
        lost = f"; it ended before the run: {audit.failure}" if audit.failure is not None else ""
        said.append(f"audit log: {options.audit}, last line {audit.last}{lost}")
    said += port_lines(ports.counts if ports is not None else {})
    try:
        _say(said[:1] if options.quiet else said, to_errors=writes_to_output(ready.ports))
    finally:
        if suspended():  # not before all is safe and said; when it goes on, there is nothing left to do
            os.kill(os.getpid(), signal.SIGSTOP)
    return _exit_code(report, failed=failure is not None or (audit is not None and audit.failure is not None))


def _note_end(done: Launched, report: RunReport, ports: Ports | None, audit: AuditLog | None) -> None:
    """Tell the end of a run to its ports and in its audit log."""
    if ports is not None:
        ports.finish(report.ending)
    if done.server is not None:
        done.server.note_left_out()
    if audit is not None:
        seals: dict[str, Json] = {str(path): seal_of(path) for path in done.run.recordings}
        audit.note(ENDED, {"ending": report.ending, "frames": report.frames, "recordings": seals})


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    draws = options.hold is not None or options.draw
    if options.inputs is not None and options.ports is not None:
        raise UsageError("--inputs repeats the inputs of a trace, and --ports gives others; leave out one of them")
    if options.audit is not None and options.whiteboard is None:
        raise UsageError("--audit logs what others ask over the whiteboard: name one with --whiteboard")
    if options.seed is not None and not options.simulate:
        raise UsageError("--seed is for --simulate")
    if options.panel and not PANELS:
        raise UsageError("--panel needs an extension that shows one")
    if draws and (not options.simulate or options.inputs is not None):
        raise UsageError("--hold and --draw are for --simulate without --inputs: they say how inputs are drawn")


def _ready(options: Namespace, draft: Draft, given: Arrangement, left: ExitStack) -> tuple[Launch, list[Prescribed]]:
    """The run as the options want it, and what a trace prescribes. Those of the ports that give values
    before the run are open until `left` ends. UsageError.
    """
    settings = _settings(options, draft, given)
    with wrong_usage(ValueError, "--set "):
        plan = settings.plan(given)
    with wrong_usage(ValueError):
        plan.period(settings.rate)
    for name, reason in plan.unmonitored.items():
        tell(f"note: `{name}` is not monitored: {reason}")
    if settings.seed is not None and options.seed is None:
        tell(f"seed {settings.seed}")
    rounds, free, script = plan.rounds(options.span), dict[str, int](), list[Prescribed]()
    if options.inputs is not None:
        free, script, steps = _inputs(options.inputs, given, plan.program)
        rounds = rounds if options.span is not None else steps
    code = plan.code()
    specs = () if options.ports is None else declared_ports(options.ports, given, code)
    settings = with_ports(settings, specs)
    problem = unusable(specs, settings.held, options.arrangement) or _timed(specs, options)
    if options.panel and (writes_to_output(specs) or not sys.stdout.isatty()):
        problem = "--panel needs a terminal as standard output"
    if problem is not None:
        raise UsageError(problem)
    if any(spec.paces for spec in specs):
        settings, rounds = replace(settings, rate=Fraction(0), pace=Pace(rounds)), 0
    early = left.enter_context(opened_early(specs, plan, code, _say_of_port))
    free |= early.free
    with wrong_usage(ValueError), wrong_usage(DrawingError, "--"):
        loop = settings.first(plan, code, rounds=rounds, free=free, script=script)
    return Launch(draft, settings, plan, loop, specs, early), script


def _settings(options: Namespace, draft: Draft, given: Arrangement) -> RunSettings:
    """UsageError: an option has a wrong value."""
    texts = property_sources(options)
    properties = told(parse_properties(texts, options.syntax, CHECKED), given)
    if options.record is not None and any(line.file is not None for line in properties):
        raise UsageError(
            "--record keeps the texts of properties, and automata are in files of their own: leave one out"
        )
    seed = options.seed
    if options.simulate and options.inputs is None and seed is None:
        seed = random.SystemRandom().randrange(1 << 32)
    return RunSettings(
        simulated=options.simulate or options.inputs is not None, cycle_ms=options.cycle_ms,
        held=assignments("--set", options.set), properties=properties, property_texts=texts, syntax=options.syntax,
        rate=options.rate if options.rate is not None else Fraction(1),
        seed=None if options.inputs is not None else seed, hold=options.hold,
        draw=assignments("--draw", options.draw, DRAWN), jitter=options.jitter,
        strict=options.on_overrun == "stop", stops_on_violation=options.on_violation == "stop", record=options.record,
        sources=draft.sources, digest=draft.digest, whiteboard=options.whiteboard, priority=options.priority,
        processes=options.processes, limits=Limits(timeout=options.load_timeout, memory=options.load_memory),
    )  # fmt: skip


def _say_of_port(what: str) -> None:
    print(what, file=sys.stderr, flush=True)


def _say(lines: Sequence[str], *, to_errors: bool) -> None:
    if to_errors:
        tell(*lines)
    else:
        Output().write("\n".join(lines))


def _exit_code(report: RunReport, *, failed: bool) -> int:
    if failed or report.unrecorded is not None or any(verdict == "violated" for _, verdict, _ in report.monitored):
        return VIOLATED
    return {"ended": 0, "stopped": 0, "overflow": UNKNOWN}.get(report.ending, VIOLATED)


@contextmanager
def _enough_descriptors() -> Iterator[None]:
    """DiagnosticError (E502): there are not enough for the run."""
    try:
        yield
    except OSError as error:
        if error.errno not in (errno.EMFILE, errno.ENFILE):
            raise
        most, _ = resource.getrlimit(resource.RLIMIT_NOFILE)
        message = f"the run needs more files and sockets than the {most:,} that its process may have open"
        raise DiagnosticError([Diagnostic(CROWDED, message, hint="let it have more: `ulimit -n 1024`")]) from None


@contextmanager
def _audited(path: str | None, digest: str, arrangement: Arrangement) -> Iterator[AuditLog | None]:
    """The audit log of a run, which has begun."""
    if path is None:
        yield None
        return
    with closing(AuditLog(path)) as log:
        log.begin(
            {
                "arrangement": arrangement.name,
                "digest": digest,
                "policy": policy_digest(arrangement),
                "pid": os.getpid(),
            }
        )
        yield log


def _say_refused(what: str) -> None:
    """On standard error, which may have no reader; the server says few of many."""
    tell(f"refused: {without_controls(what)[:MOST_SAID]}")


@contextmanager
def _launched(ready: Launch, audit: AuditLog | None, *, swaps: bool) -> Iterator[Launched]:
    try:
        with launched(ready, audit=audit, refused=_say_refused, swaps=swaps) as done:
            yield done
    except (NameTaken, NoPlace) as problem:
        raise DiagnosticError([Diagnostic(UNSERVED, str(problem), hint="give another name to --whiteboard")]) from None


def _inputs(path: str, arrangement: Arrangement, program: Program) -> tuple[dict[str, int], list[Prescribed], int]:
    """What a trace says of inputs that never change and of choices, and how many turns it takes; its loop once."""
    from llfsm_verify.verification.replay import schedule_of
    from llfsm_verify.verification.tracefile import read_trace_file

    schedule = schedule_of(read_trace_file(path), arrangement)
    moves = schedule.ringlets
    script = script_of(program, [move.choices for move in moves])
    execution, turns = Execution(program), 0
    record, cycle = execution.start(schedule.free), execution.layout.reader(program.cycle)
    for move in moves:
        result = execution.step(record, move)
        if result.status:
            break
        record = result.record
        turns += cycle(record)
    over = not moves or bool(result.status) or not cycle(record)
    return dict(schedule.free), script, turns + over


# ---------------- the ports


def unusable(specs: Sequence[PortSpec], held: Mapping[str, str], arrangement: str) -> str | None:
    """What other options say that does not go with the ports; None: nothing."""
    for spec in specs:
        twice = next((name for name in sorted(spec.fed) if name in held), None)
        if twice is not None:
            return f"--set {twice}: port `{spec.name}` feeds it"
        if arrangement == "-" and STANDARD_INPUT in spec.holds:
            return "standard input cannot be both the arrangement and what a port reads"
    return None


def _timed(specs: Sequence[PortSpec], options: Namespace) -> str | None:
    """What an option says of real time where a port begins each cycle; None: nothing."""
    paces = next((spec.name for spec in specs if spec.paces), None)
    given = {"rate": options.rate, "jitter": options.jitter, "on-overrun stop": options.on_overrun == "stop" or None}
    option = next((name for name, value in given.items() if value is not None), None)
    if paces is None or option is None:
        return None
    return f"--{option} is about real time, and port `{paces}` begins each cycle (`clock: external`)"


def writes_to_output(specs: Sequence[PortSpec]) -> bool:
    """Whether standard output belongs to a port."""
    return any(STANDARD_OUTPUT in spec.holds for spec in specs)
