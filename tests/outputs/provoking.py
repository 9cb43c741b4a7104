"""Commands that make the program say a diagnostic, and small arrangements for them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Provoked:
    """The last of `commands` makes the program say the diagnostic, in a folder with these files."""

    commands: tuple[str, ...]
    files: Mapping[str, str] = field(default_factory=dict)


def states(text: str, board: str = "", top: str = "") -> dict[str, str]:
    """An arrangement of one machine with these states."""
    lines = "".join(f"        - {line}\n" for line in text.strip().split("\n"))
    board = f"whiteboard: {{{board}}}\n" if board else ""
    machine = f"machines:\n  m:\n    inline:\n      machine: M\n      states:\n{lines}"
    return {"a.yaml": f"cycle_ms: 100\n{top}{board}{machine}schedule: [m]\n"}


def does(action: str, board: str, top: str = "") -> dict[str, str]:
    """An arrangement that does this in each cycle."""
    return states(f'{{name: A, internal: "{action}", stays: true}}', board, top)


def model(action: str, board: str, variables: str = "") -> dict[str, str]:
    """An arrangement with a model of the surroundings that does this."""
    lines = ["environment:", "  inline:", "    machine: Road"]
    lines += [f"    variables: {{{variables}}}"] if variables else []
    lines += ["    states:", f'      - {{name: S, internal: "{action}", stays: true}}']
    return states("{name: A, stays: true}", board, "\n".join(lines) + "\n")


GO = "go: {type: bool, role: input}"
LAMP = states("{name: OFF, transitions: [{when: go, to: ON}]}\n{name: ON, transitions: [{when: not go, to: OFF}]}", GO)
BUILD = "llfsm build a.yaml --target c --for none -o made"
