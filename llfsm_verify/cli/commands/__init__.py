"""The commands of `llfsm`: the table by which they are found, and the parsers made of it.

A command is a module with two functions: `arguments` adds what may be written on the command line to the command's
parser, and `run` takes what was written and returns the exit code. A command of more than 120 lines is a folder with
the two functions in its `arguments.py` and `run.py`, and beside them what only this command needs. What several
commands share is above, in `cli/`.

A command is imported when it is on the command line. What takes long to import is imported by `run`, and at the top of
`run.py` in a folder: `--help` does not need it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, cast

from llfsm_verify.cli.parser import GROUPS, CommandEntry, Parser, Version
from llfsm_verify.registry import Registry

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class Commands(Registry[Callable[[Parser], None]]):
    """Ours, and those of extensions and other packages."""

    def entry(self, name: str) -> CommandEntry:
        """A command. Unregistered."""
        return cast(CommandEntry, super().entry(name))

    def entry_at(self, point: EntryPoint) -> CommandEntry:
        """See `Registry`."""
        entry = super().entry_at(point)
        if not isinstance(entry, CommandEntry):
            raise TypeError(f"{point.value} is not a CommandEntry")
        if entry.group not in GROUPS:
            raise ValueError(f"the group of a command is one of {', '.join(GROUPS)}, and not `{entry.group}`")
        return entry


def _module(group: str, name: str, about: str) -> CommandEntry:
    place = f"{__name__}.{name.replace('-', '_')}"
    return CommandEntry(name, f"{place}:arguments", about, group=group, runs=f"{place}:run")


def _folder(group: str, name: str, about: str) -> CommandEntry:
    place = f"{__name__}.{name}"
    return CommandEntry(name, f"{place}.arguments:arguments", about, group=group, runs=f"{place}.run:run")


COMMANDS = Commands(
    "command",
    [
        _folder("check", "verify", "check properties"),
        _folder("check", "check", "check the arrangements that changed files belong to"),
        _module("check", "lint", "find mistakes that no property asks about, by proof"),
        _folder("check", "coverage", "say what runs cover, and what none can; find test vectors"),
        _module("check", "query", "find a run that reaches something, or prove that none does"),
        _module("check", "check-recording", "decide properties on a recording"),
        _folder("check", "property", "ask about formulas over free atoms"),
        _folder("check", "knowledge", "ask what theories conclude and why, and whether conditions are the same"),
        _folder("run", "simulate", "run an arrangement and show each step"),
        _folder("run", "run", "run an arrangement in real time, or as fast as possible"),
        _folder("run", "whiteboard", "read and post on the whiteboards of running arrangements"),
        _module("run", "send", "give a command to a running arrangement"),
        _module("run", "replay", "run saved traces and recordings again"),
        _folder("run", "trace", "write a recording or a saved trace as CSV, VCD, SVG, MCAP or ITF"),
        _folder("build", "monitor", "say what can be decided at run time, and write monitors"),
        _folder("build", "build", "write an arrangement as a program for another machine, as C"),
        _folder("exchange", "kripke", "write the Kripke structure, or a model for another checker"),
        _module("look", "access", "list what machines and users may do, and what they do"),
        _module("look", "audit", "tell whether an audit log was changed"),
        _module("look", "explain", "say what a diagnostic means, with an example"),
        _module("look", "schema", "print a JSON Schema"),
        _module("look", "completion", "print what makes a shell complete commands"),
    ],
    "llfsm_verify.commands",
)


def llfsm_parser(words: Sequence[str] | None = None) -> Parser:
    """The parser of `llfsm`; the result has the name of the command in `command`.

    `words`: those on the command line, if no others will be parsed; only commands among them get their arguments.
    Commands of other packages are looked for where the one that is asked for is not ours.
    """
    parser = Parser("llfsm")
    parser.about(
        "Verify, run and draw arrangements of logic-labelled finite-state machines.",
        "llfsm init crossing\nllfsm verify crossing/arrangement.yaml crossing/properties.ltl",
        "Documentation: README.md and docs/ of the project; `llfsm COMMAND --help` lists the options of a command, its "
        "exit codes and an example.",
    )
    parser.add_argument("--version", action=Version)
    asked = next((word for word in words or () if not word.startswith("-")), None)
    if asked is not None and asked not in COMMANDS:
        parser.unusable = COMMANDS.find_others()
    entries = sorted(map(COMMANDS.entry, COMMANDS), key=lambda entry: list(GROUPS).index(entry.group))
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    commands.headings = {e.name: GROUPS[e.group] for e in entries}  # type: ignore[attr-defined]  # for `Paragraphs`
    for entry in entries:
        command = commands.add_parser(entry.name, help=entry.about)
        if words is None or entry.name in words:
            COMMANDS.load(entry.name)(command)
    return parser


def verify_parser() -> Parser:
    """The parser of `llfsm-verify`."""
    parser = Parser("llfsm-verify")
    parser.add_argument("--version", action=Version)
    COMMANDS.load("verify")(parser)
    parser.set_defaults(command="verify")
    return parser
