"""`llfsm debug`: walk a run forwards and backwards, and see why."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterable, Iterator
from contextlib import ExitStack

from llfsm_verify.arrangement.files import read_source
from llfsm_verify.cli.arguments import DRAWN, assignments
from llfsm_verify.cli.commands.debug.opened import opened
from llfsm_verify.cli.io.output import Output
from llfsm_verify.cli.parser import UsageError
from llfsm_verify.collector import do_more_tasks
from llfsm_verify.runtime.debugging.paths import DebugError
from llfsm_verify.runtime.debugging.session import FRONT_ENDS, Driven, Session
from llfsm_verify.runtime.stepping.drawing import DrawingError

UNEXPECTED, IMPOSSIBLE = 1, 2
PROMPT = "(debug) "


def run(options: Namespace) -> int:
    """1 where what `expect` asked for is not so, 2 where a command cannot be done. DiagnosticError: wrong files."""
    do_more_tasks()
    if options.what == "-" and options.script == "-":
        raise UsageError("the arrangement and the commands cannot both come from standard input")
    if options.seed is None and (options.hold is not None or options.draw):
        raise UsageError("--hold and --draw say how --seed draws inputs")
    options.draw = assignments("--draw", options.draw, DRAWN)
    given: list[str] = list(options.commands)
    if options.script is not None and options.script != "-":
        source, _ = read_source(options.script)
        given += source.text.splitlines()
    reads = options.script == "-" or (not given and options.script is None and options.what != "-")
    asks = reads and options.script is None and sys.stdin.isatty() and sys.stdout.isatty()
    with ExitStack() as left:
        try:
            driven = opened(options, left)
        except DrawingError as wrong:
            raise UsageError(f"--{wrong}") from None
        output = Output()
        if asks and not options.plain and isinstance(driven, Session) and FRONT_ENDS:
            return FRONT_ENDS.load(next(iter(FRONT_ENDS)))(driven)
        if asks:
            return _asked(driven, output)
        lines: Iterable[str] = given
        if reads:
            lines = (line for part in (given, _standard_input()) for line in part)
        return _scripted(driven, lines, output)


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
    """Commands as somebody types them. A mistake does not end the session, and Ctrl-C only what is under way."""
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
