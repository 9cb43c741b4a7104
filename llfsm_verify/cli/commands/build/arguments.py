"""The arguments of `llfsm build`."""

from __future__ import annotations

from llfsm_verify.cli import arguments as shared
from llfsm_verify.cli.arguments import milliseconds
from llfsm_verify.cli.parser import Parser
from llfsm_verify.targets.target import TARGETS, WORLDS, Wanted

PLAIN = Wanted("none")


def arguments(parser: Parser) -> None:
    """Add the arguments of `llfsm build`."""
    parser.about(
        "Write an arrangement as a program for a machine without Python: what `llfsm run` does, in the target's "
        "language.",
        "llfsm build arrangement.yaml --target c --for none --output oven",
        "exit codes: 0 written, 1 the built image differs, 2 wrong usage, 3 input files wrong or unreadable, what has "
        "no meaning there, files that cannot be written, or a compiler that is missing",
    )
    add = parser.add_argument
    worlds = "; ".join(f"{e.name}: {e.about}" for e in WORLDS.values())
    shared.arrangement(parser)
    add("--target", choices=TARGETS, required=True, help="; ".join(f"{e.name}: {e.about}" for e in TARGETS.values()))
    add("--for", dest="world", metavar="WORLD", required=True, help=worlds)
    add("--cycle-ms", metavar="MS", type=milliseconds, help="how long a cycle of an untimed arrangement takes")
    add("--optimize", choices=("speed", "size"), help="size: without what nobody sees (default: speed, of avr size)")
    add("--pins", metavar="FILE", help="avr: a table of the pins (default: pins.yaml beside the arrangement)")
    add("--mcu", metavar="NAME", default=PLAIN.mcu, help="avr: the microcontroller (default: %(default)s)")
    add("--clock-hz", metavar="HZ", type=int, default=PLAIN.clock_hz, help="avr: its clock (default: %(default)s)")
    shared.repeatable(
        parser, "--monitor", metavar="FILE", dest="properties", text="monitor the properties of this file on board"
    )
    shared.property_lines(parser, "one line of a property file, to monitor")
    shared.only(parser)
    add("--verify", action="store_true", help="compile it, run test vectors on it, and compare with a run here")
    add("--vectors", metavar="FILE", help="verify: those of a file (default: all steps, where these are few, or drawn)")
    add("--cc", metavar="COMMAND", default=PLAIN.compiler, help="verify: the compiler (default: %(default)s)")
    add("--emulator", metavar="COMMAND", default="", help="verify: what runs it, such as qemu-arm")
    add("-o", "--output", metavar="FOLDER", help="write the files there, and replace no others")
