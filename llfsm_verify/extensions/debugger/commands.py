"""The commands of debuggers, as one table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from llfsm_verify.plug import DebugError

Takes = Literal["nothing", "count", "number", "number?", "formula", "word", "word?", "words?", "name value"]
WORDS: Mapping[Takes, tuple[int, int]] = {
    "nothing": (0, 0), "count": (0, 1), "number": (1, 1), "number?": (0, 1), "formula": (1, 1), "word": (1, 1),
    "word?": (0, 1), "words?": (0, 1 << 30), "name value": (2, 2),
}  # fmt: skip
"""How many words come after the name, at least and at most. A formula counts as one, a count is 1 by default, and
between a name and a value there may be `=`."""


@dataclass(frozen=True, slots=True)
class Command:
    """A command: its names, what it takes, and what it does. `changes`: it is refused where one only looks."""

    name: str
    short: str
    takes: Takes
    about: str
    argument: str = ""
    """What help calls that which it takes."""
    changes: bool = False
    moves: bool = False
    """It goes somewhere."""

    @property
    def usage(self) -> str:
        """How it is written."""
        return f"{self.name} {self.argument}".rstrip()


COMMANDS = (
    Command("step", "s", "count", "N ringlets forwards (attached: frames with changes)", "[N]", moves=True),
    Command("cycle", "n", "count", "forwards until N more cycles are complete", "[N]", moves=True),
    Command("until", "u", "formula", "forwards until this is true, or decided if it has temporal operators", "FORMULA",
            moves=True),
    Command("continue", "c", "nothing", "forwards to the next break point, or to the end", moves=True),
    Command("back", "b", "count", "N ringlets backwards", "[N]", moves=True),
    Command("back-cycle", "bn", "count", "backwards to where a cycle began", "[N]", moves=True),
    Command("back-until", "bu", "formula", "backwards until a state formula is true", "FORMULA", moves=True),
    Command("reverse", "r", "nothing", "backwards to a break point, or to the beginning", moves=True),
    Command("goto", "g", "number", "to the configuration after N ringlets; 0: the beginning", "N", moves=True),
    Command("break", "bp", "formula", "stop where this becomes true, or is decided if it has temporal operators",
            "FORMULA"),
    Command("breaks", "bl", "nothing", "the break points"),
    Command("delete", "d", "number?", "delete a break point, or all", "[N]"),
    Command("set", "=", "name value", "give an input, or another choice of a turn, a value from here on", "NAME VALUE",
            changes=True),
    Command("free", "f", "word", "undo a `set`", "NAME", changes=True),
    Command("turn", "t", "word", "this process takes the next step", "PROCESS", changes=True),
    Command("fork", "fk", "nothing", "leave the trace or recording, and continue from here with inputs that you set",
            changes=True),
    Command("why", "w", "nothing", "the guards that the last step evaluated, with the values of their parts"),
    Command("show", "p", "words?", "states, clocks and variables; or those of these names", "[NAME …]"),
    Command("inputs", "i", "nothing", "the inputs, and the other choices of a turn"),
    Command("value", "v", "formula", "whether a formula is true here", "FORMULA"),
    Command("expect", "e", "formula", "like `value`; if it is not true, the exit code of the session is 1", "FORMULA"),
    Command("list", "l", "word?", "the state of a machine with its actions and guards (of the one that ran)",
            "[MACHINE]"),
    Command("history", "h", "count", "the last N steps", "[N]"),
    Command("where", "wh", "nothing", "the current position"),
    Command("help", "?", "word?", "the commands, or what one does", "[COMMAND]"),
    Command("quit", "q", "nothing", "end the session"),
)  # fmt: skip

BY_NAME: Mapping[str, Command] = {name: command for command in COMMANDS for name in (command.name, command.short)}
MOST_COUNT = 10**12


@dataclass(frozen=True, slots=True)
class ParsedCommand:
    """A command with what it was given: a number where it takes one, words or a formula."""

    command: Command
    number: int | None = None
    words: tuple[str, ...] = ()


def parse(line: str) -> ParsedCommand | None:
    """The command in a line; None: an empty line, or a comment after ``#``. DebugError: it is not a command."""
    line = line.strip()
    if not line or line.startswith("#"):
        return None
    name, _, rest = line.partition(" ")
    rest = rest.strip()
    command = BY_NAME.get(name)
    if command is None:
        raise DebugError(f"there is no command `{name[:40]}`; `help` lists them")
    takes = command.takes
    words = (rest,) if takes == "formula" and rest else tuple(rest.replace("=", " ", takes == "name value").split())
    least, most = WORDS[takes]
    if not least <= len(words) <= most:
        raise DebugError(f"this command is written `{command.usage}`: {command.about}")
    if takes not in ("count", "number", "number?"):
        return ParsedCommand(command, words=words)
    number = _number(words[0], least=0 if takes == "number" else 1) if words else None
    return ParsedCommand(command, 1 if takes == "count" and number is None else number)


def _number(text: str, least: int = 1) -> int:
    if not (text.isascii() and text.isdigit() and len(text) <= 13 and least <= int(text) <= MOST_COUNT):
        raise DebugError(f"`{text[:40]}` is not a whole number from {least}")
    return int(text)
