"""Programs for AVR, built here and run on a simulated board."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path

from tests.outside import needs

BOARD = Path(__file__).with_name("board.c")
needs_avr = needs("avr-gcc", "make")
needs_board = needs("avr-gcc", "gcc", "make", "simavr")


def make(folder: Path, files: Mapping[str, str], extra: str = "-Werror") -> Path:
    """The ELF file that the Makefile among these files makes."""
    for name, text in files.items():
        (folder / name).write_text(text)
    done = subprocess.run(["make", f"EXTRA={extra}"], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (found,) = folder.glob("*.elf")
    return found


def compiled_board(folder: Path) -> Path:
    """The program of `board.c`."""
    made = folder / "board"
    lenient = "-Wl,--unresolved-symbols=ignore-in-shared-libs"
    subprocess.run(["gcc", "-O1", "-Wall", "-Werror", BOARD, lenient, "-lsimavr", "-o", made], check=True)
    return made


def played(
    board: Path, elf: Path, lines: Iterable[str], cycles: int, mcu: str = "atmega328p", *, log: bool = False
) -> list[dict[str, str]]:
    """What ports show after each cycle of so many CPU cycles: PORT/DDR by letter, and the byte that was sent, `u`.
    `log`: also `all` values that port B had."""
    given = "".join(f"{line}\n" for line in lines)
    command = [board, elf, mcu, "16000000", str(cycles), *["log"] * log]
    done = subprocess.run(command, input=given, capture_output=True, text=True, check=True, timeout=100)
    return [dict(word.split("=") for word in line.split()) for line in done.stdout.splitlines()]
