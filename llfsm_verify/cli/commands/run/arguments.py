"""The arguments of `llfsm run`."""

from __future__ import annotations

from argparse import ArgumentTypeError
from fractions import Fraction

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.parser import Parser
from llfsm_verify.runtime.swapping import DEFAULT

ON_TROUBLE = ("report", "stop")


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm run`."""
    parser.about(
        "Run an arrangement in the machine code that was verified: a cycle each `cycle_ms`, until Ctrl-C or SIGTERM.",
        "llfsm run arrangement.yaml --simulate --seed 1 --for 60s --record run.rec",
        "exit codes: 0 stopped or ended by itself, 1 it ended by a fault, an overrun with --on-overrun stop, a port or "
        "a process that was killed; a monitored property was violated; or the recording or the audit log ended before "
        "the run, 2 wrong usage, 3 files wrong or unreadable, 4 a value left 64 bits",
    )
    shared.arrangement(parser)
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
    shared.held_inputs(parser)
    shared.drawn_inputs(parser)
    text = "YAML: how inputs and outputs reach the world, such as ROS (see `llfsm schema ports`). Topics of ROS 2 were "
    add("--ports", metavar="FILE", help=f"{text}tried against Cyclone DDS and Fast DDS, not against rclcpp")


def _pace(parser: Parser) -> None:
    add = parser.add_argument
    add(
        "--for",
        metavar="TIME",
        dest="span",
        type=shared.milliseconds,
        help="end after this much logical time: 90s, 500ms, 5min",
    )
    add("--rate", metavar="R", type=rate, help="R times as fast as real time; 0: without waiting (default: 1)")
    add("--cycle-ms", metavar="MS", type=shared.milliseconds, help="how long a cycle of an untimed arrangement takes")
    add(
        "--jitter",
        metavar="TIME",
        type=shared.milliseconds,
        help="by how much the gap between two cycles may be shorter (default: half a cycle)",
    )
    shared.choice(parser, "--on-overrun", ON_TROUBLE, "what to do when a cycle begins a whole cycle late")
    add("--priority", metavar="1-99", type=priority, help="request real-time scheduling (SCHED_FIFO)")
    text = "run each process of the arrangement in a process of its own, or all in one"
    shared.choice(parser, "--processes", ("separate", "together"), text)


def _monitoring(parser: Parser) -> None:
    """What is decided and said."""
    add = parser.add_argument
    add("-q", "--quiet", action="store_true", help="print only how the run ended")
    shared.repeatable(
        parser, "--monitor", metavar="FILE", dest="properties", text="decide the properties of this file while it runs"
    )
    shared.property_lines(parser)
    shared.choice(parser, "--on-violation", ON_TROUBLE, "what to do when a monitored property is violated")
    add("--record", metavar="FILE", help="write a recording, for `llfsm replay`")
    add("--panel", action="store_true", help="show states, slots and lateness while it runs, in a terminal")


def _others(parser: Parser) -> None:
    """What other processes see, and may change."""
    add = parser.add_argument
    add("--whiteboard", metavar="NAME", help="let others read its frames and post its inputs under this name")
    add(
        "--load-timeout",
        metavar="SECONDS",
        type=shared.seconds,
        default=DEFAULT.timeout,
        help="a machine whose check takes longer is not loaded (default: %(default)g)",
    )
    add(
        "--load-memory",
        metavar="SIZE",
        type=shared.size,
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
