"""`llfsm run`: an arrangement runs, in real time or as fast as it goes."""

from __future__ import annotations

import os
import random
import signal
import sys
import threading
from argparse import Namespace
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from fractions import Fraction
from importlib.metadata import version
from pathlib import Path
from types import FrameType

from llfsm_verify.arrangement.formats import Given, read_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.resolve.arrangement import resolve
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.checking.values import choice_value
from llfsm_verify.cli.argument_types import assignments
from llfsm_verify.cli.io.output import usage
from llfsm_verify.cli.ports import declared_ports, opened, unusable, writes_to_output
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.jsonvalue import Json
from llfsm_verify.program.program import Program
from llfsm_verify.report.running import port_lines, report_lines
from llfsm_verify.runtime.live.codes import UNSERVED
from llfsm_verify.runtime.live.loop import LiveCode, Loop, Prescribed
from llfsm_verify.runtime.live.preparing import (
    drawn_choices,
    free_values,
    runnable,
    safe_values,
    script_of,
    starting_values,
)  # fmt: skip
from llfsm_verify.runtime.live.serving import serve
from llfsm_verify.runtime.live.supervised import Supervised
from llfsm_verify.runtime.random_run import input_problem
from llfsm_verify.runtime.recording.file import Recorder
from llfsm_verify.runtime.whiteboard.owner import Owner, Taken
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.places import NoPlace
from llfsm_verify.runtime.whiteboard.shared import Shared
from llfsm_verify.semantics.lowering import lower

VIOLATED, UNKNOWN = 1, 4
MOST_PERIOD = 10**14
"""Nanoseconds of the longest cycle: the clock of the machine has 63 bits."""
MOST_ROUNDS = 1 << 62
NANOSECONDS = 1_000_000
"""Of a millisecond."""


def run(options: Namespace) -> int:
    """0 when it was stopped or has ended by itself, 1 after a fault, an overrun under ``--on-overrun stop``, a port
    that stopped it, or a recording that ended before it, 4 when a value left 64 bits. DiagnosticError: wrong files, or
    an arrangement that cannot run.
    """
    if options.inputs is not None and options.ports is not None:
        return usage("--inputs repeats the inputs of a trace, and --ports gives others; leave out one of them")
    draft = read_arrangement(Given(options.arrangement))
    given = resolve(draft)
    for warning in given.warnings:
        print(warning.render(), file=sys.stderr)
    simulated = options.simulate or options.inputs is not None
    arrangement = runnable(given, simulated=simulated, cycle_ms=options.cycle_ms)
    cycle = arrangement.cycle_ms
    assert cycle is not None, "a timed arrangement has it"
    program = lower(arrangement, keep_all_bits=True)
    try:
        held = assignments("--set", options.set)
    except ValueError as wrong:
        return usage(str(wrong))
    try:
        free = free_values(program, held)
    except ValueError as wrong:
        return usage(f"--set {wrong}")
    problem = input_problem(program, {name: text for name, text in held.items() if name not in free})
    if problem is not None:
        return usage(f"--set {problem}")
    if options.seed is not None and not options.simulate:
        return usage("--seed is for --simulate")
    seed = None
    if options.simulate and options.inputs is None:
        seed = options.seed if options.seed is not None else random.SystemRandom().randrange(1 << 32)
        if options.seed is None:
            print(f"seed {seed}", file=sys.stderr)
    values = {c.name: choice_value(c, held[c.source]) for c in program.choices if c.source in held}
    rate = options.rate if options.rate is not None else Fraction(1)
    period = max(1, int(cycle * NANOSECONDS / rate)) if rate else 0
    if period > MOST_PERIOD:
        return usage(f"a cycle would take {float(period / 10**9):g} s; the longest is {MOST_PERIOD // 10**9:,} s")
    rounds = -1 if options.span is None else min(MOST_ROUNDS, int(-(-options.span // cycle)))
    script: list[Prescribed] = []
    if options.inputs is not None:
        first, script, steps = _inputs(options.inputs, given, program)
        free |= first
        rounds = rounds if options.span is not None else steps
    jitter = None if options.jitter is None else int(options.jitter * NANOSECONDS)
    code = LiveCode(program, safe=safe_values(arrangement))
    specs = declared_ports(options.ports, code)
    fed = frozenset(name for spec in specs for name in spec.inputs)
    problem = unusable(specs, held, options.arrangement)
    if problem is not None:
        return usage(problem)
    loop = Loop(
        code, period=period, seed=seed, drawn=drawn_choices(program, values, fed), jitter=jitter,
        strict=options.on_overrun == "stop", free=free, held=starting_values(program) | values,
    )  # fmt: skip
    loop.prescribe(script)
    loop.limit(rounds)
    with (
        closing(Shared(options.whiteboard or "run", loop)) as shared,
        _served(options, shared, arrangement, fed) as owner,
    ):
        recorder = None
        if options.record is not None:
            recorder = Recorder(options.record, _header(options, draft.sources, arrangement, seed, free), loop)
        together = options.processes == "together"
        drop = owner.drop if owner is not None else lambda: None
        with (
            Supervised(loop, shared.segment, recorder, priority=options.priority, together=together, drop=drop) as done,
            opened(specs, shared, done.stop, options.record) as ports,
            _stopping(done),
        ):
            done.start()
            serve(done, [one for one in (owner, ports) if one is not None])
            report = done.report
            if ports is not None:
                ports.finish(report.ending)
    failure = ports.failure if ports is not None and report.ending == "stopped" else None
    out = sys.stderr if writes_to_output(specs) else sys.stdout
    for line in report_lines(report, cycle, options.record, failure):
        print(line, file=out)
    for line in port_lines(ports.counts if ports is not None else {}):
        print(line, file=out)
    if report.unrecorded is not None or failure is not None:
        return VIOLATED
    return {"ended": 0, "stopped": 0, "overflow": UNKNOWN}.get(report.ending, VIOLATED)


@contextmanager
def _served(
    options: Namespace, shared: Shared, arrangement: Arrangement, fed: frozenset[str]
) -> Iterator[Owner | None]:
    """Who answers those that read or post on the whiteboard that the options name."""
    if options.whiteboard is None:
        yield None
        return
    try:
        owner = Owner(
            options.whiteboard,
            shared,
            Permissions(arrangement.access),
            refused=lambda what: print(f"refused: {what}", file=sys.stderr),
            fed=fed,
        )
    except (Taken, NoPlace) as problem:
        raise DiagnosticError([Diagnostic(UNSERVED, str(problem), hint="give another name to --whiteboard")]) from None
    with closing(owner):
        yield owner


@contextmanager
def _stopping(running: Supervised) -> Iterator[None]:
    """Ctrl-C and SIGTERM let the cycle under way be the last one."""

    def stop(number: int, _: FrameType | None) -> None:
        running.stop(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {}
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:
            before[number] = signal.signal(number, stop)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


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


def _header(
    options: Namespace,
    sources: tuple[Source, ...],
    arrangement: Arrangement,
    seed: int | None,
    free: Mapping[str, int],
) -> dict[str, Json]:
    """What a reader of the recording needs: the texts, and how they were run."""
    folder = Path(arrangement.path).parent
    files: dict[str, Json] = {os.path.relpath(source.name, folder): source.text for source in sources}
    return {
        "name": arrangement.name,
        "arrangement": "-" if options.arrangement == "-" else Path(options.arrangement).name,
        "digest": arrangement.digest,
        "files": files,
        "simulated": options.simulate or options.inputs is not None,
        "cycle_ms": str(arrangement.cycle_ms),
        "seed": seed,
        "free": dict(free),
        "version": version("llfsm-verify"),
    }
