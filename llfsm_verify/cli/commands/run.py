"""`llfsm run`: an arrangement runs, in real time or as fast as possible."""

from __future__ import annotations

import errno
import os
import random
import resource
import signal
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from fractions import Fraction

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.goals.kinds import CHECKED
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.cli.argument_types import DRAWN, assignments
from llfsm_verify.cli.io.output import Output, usage
from llfsm_verify.cli.io.unhurried import unhurried_errors
from llfsm_verify.cli.panel import shown
from llfsm_verify.cli.ports import declared_ports, following, opened, unusable, writes_to_output
from llfsm_verify.cli.properties import property_sources, told
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, without_controls
from llfsm_verify.jsonvalue import Json
from llfsm_verify.limits import Limits
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.program.program import Program
from llfsm_verify.report.running import port_lines, report_lines
from llfsm_verify.runtime.audit import ENDED, AuditLog, seal_of
from llfsm_verify.runtime.drawing import DrawingError
from llfsm_verify.runtime.live.codes import CROWDED, UNSERVED
from llfsm_verify.runtime.live.loop import Prescribed
from llfsm_verify.runtime.live.preparing import script_of
from llfsm_verify.runtime.live.serving import serve
from llfsm_verify.runtime.live.signals import stopping
from llfsm_verify.runtime.loading.making import Making
from llfsm_verify.runtime.loading.succession import Succession
from llfsm_verify.runtime.whiteboard.owner import Owner, Taken
from llfsm_verify.runtime.whiteboard.permissions import Permissions, policy_digest
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.shared import Shared

VIOLATED, UNKNOWN = 1, 4
MOST_SAID = 300
"""Characters of a refusal."""


def run(options: Namespace) -> int:
    """0 when it was stopped or has ended by itself, 1 after a fault, an overrun under ``--on-overrun stop``, a port
    that stopped it, or a recording or an audit log that ended before it, 4 when a value left 64 bits. DiagnosticError:
    wrong files, an arrangement that cannot run, or an audit log that cannot be written (E500).
    """
    do_more_tasks()
    if options.inputs is not None and options.ports is not None:
        return usage("--inputs repeats the inputs of a trace, and --ports gives others; leave out one of them")
    if options.audit is not None and options.whiteboard is None:
        return usage("--audit logs what others ask over the whiteboard: name one with --whiteboard")
    draft = read_arrangement(Given(options.arrangement))
    given = resolve(draft)
    for warning in given.warnings:
        print(warning.render(), file=sys.stderr)
    try:
        held = assignments("--set", options.set)
        draw = assignments("--draw", options.draw, DRAWN)
    except ValueError as wrong:
        return usage(str(wrong))
    simulated = options.simulate or options.inputs is not None
    texts = property_sources(options)
    properties = told(parse_properties(texts, options.syntax, CHECKED), given)
    if options.record is not None and any(line.file is not None for line in properties):
        return usage("--record keeps the texts of properties, and automata are in files of their own: leave one out")
    seed = None
    if options.seed is not None and not options.simulate:
        return usage("--seed is for --simulate")
    if (options.hold is not None or options.draw) and (not options.simulate or options.inputs is not None):
        return usage("--hold and --draw are for --simulate without --inputs: they say how inputs are drawn")
    if options.simulate and options.inputs is None:
        seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
    making = Making(
        simulated=simulated, cycle_ms=options.cycle_ms, held=held, properties=properties, property_texts=texts,
        syntax=options.syntax, rate=options.rate if options.rate is not None else Fraction(1), seed=seed,
        hold=options.hold, draw=draw, jitter=options.jitter, strict=options.on_overrun == "stop",
        heeds=options.on_violation == "stop", record=options.record, sources=draft.sources, digest=draft.digest,
        limits=Limits(timeout=options.load_timeout, memory=options.load_memory),
    )  # fmt: skip
    try:
        how = making.plan(given)
    except ValueError as wrong:
        return usage(f"--set {wrong}")
    for name, reason in how.unmonitored.items():
        print(f"note: `{name}` is not monitored: {reason}", file=sys.stderr)
    if seed is not None and options.seed is None:
        print(f"seed {seed}", file=sys.stderr)
    try:
        how.period(making.rate)
    except ValueError as wrong:
        return usage(str(wrong))
    rounds, free, script = how.rounds(options.span), dict[str, int](), list[Prescribed]()
    if options.inputs is not None:
        free, script, steps = _inputs(options.inputs, given, how.program)
        rounds = rounds if options.span is not None else steps
    code = how.code()
    specs = declared_ports(options.ports, code)
    making = replace(making, fed=frozenset(name for spec in specs for name in spec.inputs))
    problem = unusable(specs, held, options.arrangement)
    if options.panel and (writes_to_output(specs) or not sys.stdout.isatty()):
        problem = "--panel needs a terminal as standard output"
    if problem is not None:
        return usage(problem)
    try:
        loop = making.first(how, code, rounds=rounds, free=free, script=script)
    except DrawingError as wrong:
        return usage(f"--{wrong}")
    arrangement = how.arrangement
    with (
        unhurried_errors(),
        _enough_descriptors(),
        closing(Shared(options.whiteboard or "run", loop, served=options.whiteboard is not None)) as shared,
        _audited(options.audit, draft.digest, arrangement) as audit,
        _served(options, shared, arrangement, making.fed, audit) as owner,
        Succession(
            draft, shared, making, arrangement, priority=options.priority, together=options.processes == "together"
        ) as done,
        opened(specs, shared, done.stop, options.record) as ports,
        stopping(done.stop) as suspended,
        shown(options.panel, shared, arrangement.name, how.cycle) as pictures,
    ):
        if owner is not None and not script:
            owner.takes(done)
        done.start(
            *([] if owner is None else [owner.follow]),
            *([] if ports is None else [following(ports)]),
            *([] if pictures is None else [pictures.follow]),
        )
        serve(done, [one for one in (owner, ports, pictures, done) if one is not None])
        report = done.report
        if ports is not None:
            ports.finish(report.ending)
        if owner is not None:
            owner.settle()
        if audit is not None:
            seals: dict[str, Json] = {str(path): seal_of(path) for path in done.recordings}
            audit.note(ENDED, {"ending": report.ending, "frames": report.frames, "recordings": seals})
    failure = ports.failure if ports is not None and report.ending == "stopped" else None
    said = list(report_lines(report, how.cycle, done.recordings, failure))
    if audit is not None:
        lost = f"; it ended before the run: {audit.failure}" if audit.failure is not None else ""
        said.append(f"audit log: {options.audit}, last line {audit.last}{lost}")
    said += port_lines(ports.counts if ports is not None else {})
    said = said[:1] if options.quiet else said
    try:
        if writes_to_output(specs):
            print(*said, sep="\n", file=sys.stderr)
        else:
            Output().write("\n".join(said))
    finally:
        if suspended():  # not before all is safe and said; when it goes on, there is nothing left to do
            os.kill(os.getpid(), signal.SIGSTOP)
    violated = any(verdict == "violated" for _, verdict, _ in report.monitored)
    unlogged = audit is not None and audit.failure is not None
    if violated or unlogged or report.unrecorded is not None or failure is not None:
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
    """On standard error, which somebody may not read; the owner says few of many."""
    print(f"refused: {without_controls(what)[:MOST_SAID]}", file=sys.stderr)


@contextmanager
def _served(
    options: Namespace, shared: Shared, arrangement: Arrangement, fed: frozenset[str], audit: AuditLog | None
) -> Iterator[Owner | None]:
    """Who answers those that read or post on the whiteboard that the options name."""
    if options.whiteboard is None:
        yield None
        return
    try:
        owner = Owner(
            options.whiteboard,
            shared,
            Permissions.of(arrangement),
            refused=_say_refused,
            fed=fed,
            audit=audit,
        )
    except (Taken, NoPlace) as problem:
        raise DiagnosticError([Diagnostic(UNSERVED, str(problem), hint="give another name to --whiteboard")]) from None
    with closing(owner):
        yield owner


def _inputs(path: str, arrangement: Arrangement, program: Program) -> tuple[dict[str, int], list[Prescribed], int]:
    """What a trace says of inputs that never change and of choices, and how many turns it takes; its loop once."""
    from llfsm_verify.report.replaying import schedule_of
    from llfsm_verify.report.tracefile import read_trace_file

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
