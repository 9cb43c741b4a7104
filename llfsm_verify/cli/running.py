"""The options of the commands that run arrangements."""

from __future__ import annotations

from argparse import ArgumentTypeError
from fractions import Fraction

from llfsm_verify.cli.argument_types import milliseconds, positive, seconds, size
from llfsm_verify.cli.common_arguments import (
    ARRANGEMENT,
    arrangement,
    drawn_inputs,
    held_inputs,
    other_arrangement,
    output,
    property_files,
    property_lines,
    repeatable,
)
from llfsm_verify.cli.parser import Parser
from llfsm_verify.registry import Choices
from llfsm_verify.report.formats import REPORTS
from llfsm_verify.report.timeline.formats import TIMELINES
from llfsm_verify.runtime.debugging import MOST_STEPS
from llfsm_verify.runtime.deciding.logs.formats import LOGS
from llfsm_verify.runtime.swapping import DEFAULT

KINDS = ("suspend", "resume", "restart", "load", "load_suspended", "unload", "write", "replace", "policy")
"""Of commands."""


def run_arguments(parser: Parser) -> None:
    """Of `llfsm run`."""
    parser.about(
        "Run an arrangement in the machine code that was verified: a cycle each `cycle_ms`, until Ctrl-C or SIGTERM.",
        "llfsm run arrangement.yaml --simulate --seed 1 --for 60s --record run.rec",
        "exit codes: 0 stopped or ended by itself, 1 a fault, an overrun with --on-overrun stop, a port that "
        "stopped it, 2 wrong usage, 3 files wrong or unreadable, 4 a value left 64 bits",
    )
    arrangement(parser)
    _world(parser)
    _pace(parser)
    _monitoring(parser)
    _others(parser)


def _world(parser: Parser) -> None:
    """Where inputs come from."""
    add = parser.add_argument
    add(
        "--simulate",
        action="store_true",
        help="run the model of the surroundings, and draw the inputs that it does not write",
    )
    add("--seed", metavar="N", type=int, help="makes a simulation repeatable (default: a new one, which is printed)")
    add("--inputs", metavar="TRACE", help="simulate with the inputs of a saved trace, step by step")
    held_inputs(parser)
    drawn_inputs(parser)
    add("--ports", metavar="FILE", help="YAML: how inputs and outputs reach the world (see `llfsm schema ports`)")


def _pace(parser: Parser) -> None:
    add = parser.add_argument
    add(
        "--for",
        metavar="TIME",
        dest="span",
        type=milliseconds,
        help="end after this much logical time: 90s, 500ms, 5min",
    )
    add("--rate", metavar="R", type=rate, help="R times as fast as real time; 0: without waiting (default: 1)")
    add("--cycle-ms", metavar="MS", type=milliseconds, help="how long a cycle of an untimed arrangement takes")
    add(
        "--jitter",
        metavar="TIME",
        type=milliseconds,
        help="how much closer two cycles may begin (default: half a cycle)",
    )
    add(
        "--on-overrun",
        choices=("report", "stop"),
        default="report",
        help="what to do when a cycle begins a whole cycle late (default: %(default)s)",
    )
    add("--priority", metavar="1-99", type=priority, help="ask the system for its first-in-first-out schedule")
    add(
        "--processes",
        choices=("separate", "together"),
        default="separate",
        help="each process of the arrangement is one of the system, or one runs them all (default: %(default)s)",
    )


def _monitoring(parser: Parser) -> None:
    """What is decided and said."""
    add = parser.add_argument
    add("-q", "--quiet", action="store_true", help="print only how the run ended")
    repeatable(
        parser,
        "--monitor",
        metavar="FILE",
        dest="properties",
        text="decide the properties of this file while it runs",
    )
    property_lines(parser)
    add(
        "--on-violation",
        choices=("report", "stop"),
        default="report",
        help="what to do when a monitored property is violated (default: %(default)s)",
    )
    add("--record", metavar="FILE", help="write a recording, for `llfsm replay`")
    add("--panel", action="store_true", help="show states, slots and lateness while it runs, in a terminal")


def _others(parser: Parser) -> None:
    """What other processes see, and may change."""
    add = parser.add_argument
    add("--whiteboard", metavar="NAME", help="let others read its frames and post its inputs under this name")
    add(
        "--load-timeout",
        metavar="SECONDS",
        type=seconds,
        default=DEFAULT.timeout,
        help="a machine whose check takes longer is not loaded (default: %(default)g)",
    )
    add(
        "--load-memory",
        metavar="SIZE",
        type=size,
        default=DEFAULT.memory,
        help="the same for memory, such as 500M or 2G (default: 1G)",
    )
    add("--audit", metavar="LOG", help="append to this log what others ask over the whiteboard (see `llfsm audit`)")


def rate(text: str) -> Fraction:
    """A number from 0."""
    try:
        value = Fraction(text) if len(text) <= 20 and "/" not in text and "e" not in text.lower() else Fraction(-1)
    except ValueError:
        value = Fraction(-1)
    if not (value == 0 or Fraction(1, 10**6) <= value <= 10**6):
        raise ArgumentTypeError(f"{text[:40]!r} is neither 0 nor a number from 0.000001 to 1000000")
    return value


def priority(text: str) -> int:
    """A priority of SCHED_FIFO."""
    if not (text.isascii() and text.isdigit() and 1 <= int(text[:4]) <= 99):
        raise ArgumentTypeError(f"{text[:40]!r} is not a whole number from 1 to 99")
    return int(text)


def recording_arguments(parser: Parser) -> None:
    """Of `llfsm check-recording`."""
    parser.about(
        "Decide properties on a recording of `llfsm run`, or on a log that others wrote: violated or satisfied by what "
        "happened, whatever comes after, or undecided at its end.",
        "llfsm check-recording run.rec properties.ltl",
        "exit codes: 0 no property is violated, 1 one is, 2 wrong usage, 3 files wrong or unreadable, 4 undecided",
    )
    add = parser.add_argument
    add("recording", metavar="RECORDING", help="a file that `llfsm run --record` wrote; with --mapping, a log")
    property_files(parser)
    property_lines(parser)
    other_arrangement(parser, "the recording has")
    add(
        "--allow-undecided",
        action="store_true",
        help="exit code 0 where nothing is violated, also if something is undecided; a damaged recording is still 4",
    )
    add("--mapping", metavar="FILE", help="read a log; FILE says which column gives which slot; needs --arrangement")
    formats = "; ".join(f"{name}: {entry.about}" for name, entry in LOGS.items())
    add("--from", dest="format", choices=LOGS, help=f"the log's format (default: by its name): {formats}")


def trace_arguments(parser: Parser) -> None:
    """Of `llfsm trace`."""
    parser.about(
        "Write a recording or a saved trace over time: for other tools, or as a picture; or a recording as a saved "
        "trace, which tests perform again.",
        "llfsm trace run.rec --to vcd -o run.vcd",
        "exit codes: 0 written, 2 wrong usage, 3 files wrong or unreadable, or the recording is damaged",
    )
    add = parser.add_argument
    add("file", metavar="FILE", help="a recording of `llfsm run`, or a saved trace")
    formats = "; ".join(f"{name}: {entry.about}" for name, entry in TIMELINES.items())
    formats += "; trace: a recording, from its beginning, as a saved trace (NAME.trace.yaml)"
    add(
        "--to",
        choices=Choices(TIMELINES, ("trace",)),
        help=f"the format (default: by the ending of the output's name): {formats}",
    )
    about = "for --to trace: the property that the trace is about, or an assumption (default: the fault at its end)"
    property_lines(parser, about)
    parser.set_defaults(properties=[])
    output(parser)
    add(
        "--steps",
        metavar="A:B",
        type=steps,
        default=(0, None),
        help="only steps A to B; each may be left out",
    )
    other_arrangement(parser, "the file names or has")


def steps(text: str) -> tuple[int, int | None]:
    """From and to, both included."""
    first, colon, last = text.partition(":")
    if not colon or any(part and not (part.isascii() and part.isdigit() and len(part) < 19) for part in (first, last)):
        raise ArgumentTypeError(f"{text[:40]!r} is not a range of steps such as 10:50")
    if last and int(last) < int(first or 0):
        raise ArgumentTypeError(f"{text[:40]!r} ends before it begins")
    return int(first or 0), int(last) if last else None


def debug_arguments(parser: Parser) -> None:
    """Of `llfsm debug`."""
    parser.about(
        "Walk a run forwards and backwards, by ringlets, cycles and break points, and see why transitions fired. "
        "On a saved trace or a recording it walks through what happened; on a running arrangement it only looks.",
        "llfsm debug arrangement.yaml --command 'until north@GREEN' --command why",
        "exit codes: 0 done, 1 an `expect` was not met, 2 wrong usage, or a command that cannot be done, 3 "
        "files wrong or unreadable",
    )
    add = parser.add_argument
    add(
        "what",
        metavar="ARRANGEMENT|TRACE|RECORDING|NAME",
        help="the file, or the name of a whiteboard of an arrangement that runs",
    )
    repeatable(parser, "--command", metavar="COMMAND", dest="commands", text="do this")
    add("--script", metavar="FILE", help="do the commands of this file, one per line; - reads standard input")
    add("--plain", action="store_true", help="on a terminal: a prompt in place of panes")
    add(
        "--seed",
        metavar="N",
        type=int,
        help="draw inputs that are not set, and turns, at random (default: inputs stay)",
    )
    drawn_inputs(parser)
    other_arrangement(parser, "the file names or has")
    add(
        "--history",
        metavar="N",
        type=positive,
        default=MOST_STEPS,
        help=f"how many steps are kept to go back to (default: {MOST_STEPS:,})",
    )


def send_arguments(parser: Parser) -> None:
    """Of `llfsm send`."""
    parser.about(
        "Give a command that `operators:` declares to an arrangement that runs on this machine; it is taken at the "
        "beginning of a cycle.",
        "llfsm send crossing suspend north",
        "exit codes: 0 taken, 2 wrong usage, 3 there is no such whiteboard, or the command is refused",
    )
    parser.add_argument("name", metavar="NAME", help="the whiteboard, as `llfsm run --whiteboard` names it")
    parser.add_argument("what", choices=KINDS, metavar="COMMAND", help=", ".join(KINDS))
    parser.add_argument(
        "target", metavar="MACHINE|SLOT|FILE", help="the machine or slot; for policy: the file of the new policy"
    )
    parser.add_argument(
        "value", metavar="VALUE|FILE", nargs="?", help="for write: the value; for replace: the file of the new machine"
    )
    parser.add_argument("--unchecked", action="store_true", help="for replace: load the machine without a check")


def hashed(text: str) -> str:
    """A hash as a run prints it."""
    if len(text) != 64 or set(text) - set("0123456789abcdefABCDEF"):
        raise ArgumentTypeError(f"{text[:40]!r} is not a hash: those have 64 hexadecimal digits")
    return text


def access_arguments(parser: Parser) -> None:
    """Of `llfsm access`."""
    parser.about(
        "List what each machine writes and commands, what else it may do, and what users may do: "
        "by the keys `access` and `operators`.",
        "llfsm access arrangement.yaml --draw access.svg",
        "exit codes: 0 listed, 2 wrong usage, 3 files wrong or unreadable, or the drawing cannot be written",
    )
    parser.add_argument("arrangement", metavar="ARRANGEMENT", help=ARRANGEMENT)
    parser.add_argument("--format", choices=REPORTS.access, default="text", help="(default: %(default)s)")
    parser.add_argument("--draw", metavar="FILE", help="draw it instead; the name ends in .svg, .png, .dot or .mmd")


def audit_arguments(parser: Parser) -> None:
    """Of `llfsm audit`."""
    parser.about(
        "Tell whether each line of an audit log of `llfsm run --audit` is as it was written.",
        "llfsm audit verify run.audit",
        "exit codes: 0 it is as it was written, 1 it was changed, 2 wrong usage, 3 it cannot be read",
    )
    parser.add_argument("asked", choices=("verify",), metavar="verify", help="compare the hashes of all lines")
    parser.add_argument("log", metavar="LOG", help="the file")
    parser.add_argument("--last", metavar="HASH", type=hashed, help="what the run printed for the last line")


def whiteboard_arguments(parser: Parser) -> None:
    """Of `llfsm whiteboard`."""
    codes = (
        "exit codes: 0 done, 2 wrong usage, 3 there is no such whiteboard or slot, or a value is refused; "
        "for properties: 1 one is violated, 4 one is undecided, or --every was not kept"
    )
    parser.about(
        "Read and post on the whiteboards of arrangements that run on this machine.", "llfsm whiteboard list", codes
    )
    asked = parser.add_subparsers(dest="asked", required=True, metavar="list|get|post|watch")
    examples = {
        "list": "llfsm whiteboard list",
        "get": "llfsm whiteboard get crossing ns_light",
        "post": "llfsm whiteboard post crossing car=true",
        "watch": "llfsm whiteboard watch crossing --monitor properties.ltl --arrangement arrangement.yaml",
    }
    texts = {
        "list": "list the whiteboards",
        "get": "print the newest values",
        "post": "give values to inputs",
        "watch": "print each change, or decide properties on the frames, until Ctrl-C",
    }
    made = {name: asked.add_parser(name, help=text) for name, text in texts.items()}
    for name, one in made.items():
        one.about(f"{texts[name][0].upper()}{texts[name][1:]}.", examples[name], codes)
    get, post, watch = made["get"], made["post"], made["watch"]
    for one in (get, post, watch):
        one.add_argument("name", metavar="NAME", help="the whiteboard, as `llfsm run --whiteboard` names it")
    for one in (get, watch):
        one.add_argument("slots", metavar="SLOT", nargs="*", help="only these; default: all")
    watch.add_argument("--monitor", metavar="FILE", action="append", default=[], help="decide these properties")
    property_lines(watch, "decide this one")
    watch.add_argument("--arrangement", metavar="FILE", help="the arrangement that runs there; properties need it")
    repeatable(
        watch,
        "--command",
        metavar="COMMAND",
        dest="commands",
        text="give this command, such as 'suspend MACHINE' or 'write SLOT VALUE', when one is violated",
    )
    repeatable(
        watch,
        "--post",
        metavar="INPUT=VALUE",
        dest="posts",
        text="give an input this value when one is violated",
    )
    watch.add_argument(
        "--every",
        metavar="N",
        type=positive,
        help="say how late commands can be if each frame is looked at within N cycles, and whether that was so",
    )
    post.add_argument("values", metavar="INPUT=VALUE", nargs="+", help="what the input is from now on")
