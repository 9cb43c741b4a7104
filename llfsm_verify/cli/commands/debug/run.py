"""`llfsm debug`: walk a run forwards and backwards, and see why."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from itertools import chain

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.cli.arguments import DRAWN, assignments
from llfsm_verify.cli.commands.debug.opened import opened
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import UsageError, wrong_usage
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.runtime.debugging.paths import DebugError
from llfsm_verify.runtime.debugging.session import FRONT_ENDS, Driven, Session
from llfsm_verify.runtime.stepping.drawing import DrawingError

UNEXPECTED, IMPOSSIBLE = 1, 2
PROMPT = "(debug) "


def run(options: Namespace) -> int:
    """1 where what `expect` asked for is not so, 2 where a command cannot be done. DiagnosticError: wrong files."""
    do_more_tasks()
    _refuse_misuse(options)
    options.draw = assignments("--draw", options.draw, DRAWN)
    given: list[str] = list(options.commands)
    if options.script is not None and options.script != "-":
        given += read_source(options.script)[0].text.splitlines()
    reads = options.script == "-" or (not given and options.script is None and options.what != "-")
    asks = reads and options.script is None and sys.stdin.isatty() and sys.stdout.isatty()
    with ExitStack() as left:
        with wrong_usage(DrawingError, "--"):
            driven = opened(options, left)
        if not asks:
            return _scripted(driven, chain(given, _standard_input() if reads else ()), Output())
        if not options.plain and isinstance(driven, Session) and FRONT_ENDS:
            return FRONT_ENDS.load(next(iter(FRONT_ENDS)))(driven)
        return _asked(driven, Output())


def _refuse_misuse(options: Namespace) -> None:
    """UsageError: options that do not go together."""
    if options.what == "-" and options.script == "-":
        raise UsageError("the arrangement and the commands cannot both come from standard input")
    if options.seed is None and (options.hold is not None or options.draw):
        raise UsageError("--hold and --draw say how --seed draws inputs")


def _standard_input() -> Iterator[str]:
    for line in sys.stdin:
        yield line.rstrip("\n")


def _scripted(driven: Driven, lines: Iterable[str], output: Output) -> int:
    """Each command with its answer; the first one that cannot be done ends the session."""
    code = 0
    for line in lines:
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        output.plain(f"{PROMPT}{line.strip()}\n")
        try:
            answer = driven.do(line)
        except DebugError as error:
            output.plain(f"{error}\n")
            return IMPOSSIBLE
        _tell(answer.parts, output)
        if answer.expected is False:
            code = UNEXPECTED
        if answer.quits or output.closed:
            break
    return code


def _asked(driven: Driven, output: Output) -> int:
    """Commands as the user types them. A mistake does not end the session, and Ctrl-C only what is under way."""
    import readline  # noqa: F401 - `input` then has a history and can be edited

    code = 0
    output.plain("`help` lists the commands; an empty line repeats the last one\n")
    _tell(driven.do("where").parts, output)
    last = ""
    while True:
        try:
            line = input(PROMPT).strip() or last
        except EOFError:
            output.plain("\n")
            return code
        except KeyboardInterrupt:
            output.plain("\n")
            continue
        last = line
        try:
            answer = driven.do(line)
        except DebugError as error:
            output.plain(f"{error}\n")
            continue
        except KeyboardInterrupt:
            output.plain("interrupted\n")
            _tell(driven.do("where").parts, output)
            continue
        _tell(answer.parts, output)
        if answer.expected is False:
            code = UNEXPECTED
        if answer.quits or output.closed:
            return code


def _tell(parts: Iterable[object], output: Output) -> None:
    from llfsm_verify.report.debugging import lines_of

    output.rich(lines_of(parts, output.width))  # type: ignore[arg-type]
