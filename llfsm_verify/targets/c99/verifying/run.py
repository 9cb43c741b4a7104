"""Compiling an image with its harness, running it, and what came of it."""

from __future__ import annotations

import re
import shlex
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from llfsm_verify.analysis.coverage.vectors import Vectors
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.targets.c99.avr.chips import Chip
from llfsm_verify.targets.c99.avr.world import FLAGS
from llfsm_verify.targets.c99.image import STATUSES, Image
from llfsm_verify.targets.c99.verifying import FAILED, MISSING
from llfsm_verify.targets.c99.verifying.harness import Harness, Part, value_of
from llfsm_verify.targets.target import Difference
from llfsm_verify.values import value_text

SECONDS = 120
"""How long a compiler, or an image with its vectors, may take."""
OF_HARNESS, MOST_IN_ARRAY = 6000, 30_000
"""Bytes of flash for the image and its harness, and for vectors."""
NATIVE = ("-std=c99", "-O2")
PACKAGES = {
    "avr-gcc": "gcc-avr and avr-libc", "avr-size": "binutils-avr", "simavr": "simavr", "cc": "gcc", "gcc": "gcc",
    "clang": "clang",
}  # fmt: skip
"""What Debian calls what brings a program."""
_TOLD = re.compile(r"\b(ok|differs|cost|layout)((?: [0-9a-f]+)*)")
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True, slots=True)
class Ran:
    """What images with their vectors told. `cycles` and `stack`: the largest of a call, on AVR."""

    steps: int
    difference: Difference | None
    cycles: int = 0
    stack: int = 0


@dataclass(frozen=True, slots=True)
class Bench:
    """How images are compiled and run: the words of both commands; `chip`: of AVR."""

    compiler: tuple[str, ...]
    emulator: tuple[str, ...] = ()
    chip: Chip | None = None

    @property
    def name(self) -> str:
        """What it is called."""
        if self.chip is not None:
            return f"{self.emulator[0]} ({self.chip.name})"
        return " ".join(self.compiler[: -len(NATIVE)]) + (f" under {self.emulator[0]}" if self.emulator else "")

    def run(self, image: Image, texts: tuple[str, str], vectors: Vectors, group: str = "") -> Ran:
        """What an image, with these texts of its header and its source, makes of vectors (see `Harness`).

        DiagnosticError: E508, E509.
        """
        for program in (self.compiler[0], *self.emulator[:1]):
            _there(program)
        try:
            harness = Harness(image, vectors, self._budget(), group)
        except ValueError as error:
            raise _failed(str(error)) from None
        steps, cycles, stack = 0, 0, 0
        with TemporaryDirectory() as name:
            folder = Path(name)
            _write(folder, image, texts)
            self._compile(folder, ["-c", f"{image.prefix}.c", "-o", "image.o"])
            for part in harness.parts:
                told = self._told(folder, part)
                difference = _difference(harness, part, told["differs"]) if "differs" in told else None
                if difference is not None or "ok" not in told:
                    return Ran(steps, difference or Difference(0, 0, "layout", "", ""))
                steps += told["ok"][0]
                cycles, stack = max(cycles, told.get("cost", [0, 0])[0]), max(stack, told.get("cost", [0, 0])[1])
        return Ran(steps, None, cycles, stack)

    def _budget(self) -> int:
        return 1 << 40 if self.chip is None else max(1, min(self.chip.flash - OF_HARNESS, MOST_IN_ARRAY))

    def sizes(self, files: Sequence[tuple[str, str]]) -> tuple[int, int]:
        """Bytes of flash and of RAM that a whole program takes, without its stack."""
        with TemporaryDirectory() as name:
            folder = Path(name)
            for file, text in files:
                (folder / file).write_text(text, encoding="utf-8")
            self._compile(folder, [*(file for file, _ in files if file.endswith(".c")), "-o", "program.elf"])
            _there("avr-size")
            told = _done(["avr-size", "program.elf"], folder).stdout.splitlines()[-1].split()
        code, data, zeros = (int(word) for word in told[:3])
        return code + data, data + zeros

    def _told(self, folder: Path, part: Part) -> dict[str, list[int]]:
        (folder / "harness.c").write_text(part.source, encoding="utf-8")
        self._compile(folder, ["harness.c", "image.o", "-o", "harness.elf"])
        said = _done([*self.emulator, "./harness.elf"], folder, "the image with its vectors")
        text = _COLOUR.sub("", said.stdout + said.stderr)
        found = {m[1]: [int(word, 16) for word in m[2].split()] for m in _TOLD.finditer(text)}
        if not found.keys() & {"ok", "differs", "layout"}:
            raise _failed(f"the image gave no answer (exit code {said.returncode}): {text.strip()[-200:]}")
        return found

    def _compile(self, folder: Path, words: Sequence[str]) -> None:
        done = _done([*self.compiler, *words], folder, self.compiler[0])
        if done.returncode:
            lines = [line for line in done.stderr.splitlines() if "error" in line or "overflowed" in line]
            what = "the image does not fit" if any("overflowed" in x for x in lines) else f"{self.compiler[0]} fails"
            raise _failed(f"{what}: {(lines or done.stderr.splitlines() or [''])[0][:300]}")


def bench(compiler: str = "cc", emulator: str = "", chip: Chip | None = None, clock_hz: int = 0) -> Bench:
    """The one that is asked for: `cc` of this computer, or avr-gcc and simavr."""
    if chip is not None:
        words = ("avr-gcc", *FLAGS, f"-mmcu={chip.name}", f"-DF_CPU={clock_hz}UL")
        return Bench(words, ("simavr", "-m", chip.name, "-f", str(clock_hz)), chip)
    return Bench((*shlex.split(compiler), *NATIVE), tuple(shlex.split(emulator)))


def _write(folder: Path, image: Image, texts: tuple[str, str]) -> None:
    for ending, text in zip("hc", texts, strict=True):
        (folder / f"{image.prefix}.{ending}").write_text(text, encoding="utf-8")


def _there(program: str) -> None:
    if which(program) is None:
        package = PACKAGES.get(program.rsplit("/", 1)[-1], program)
        message = f"`{program[:60]}` is not installed, and the image cannot be verified without it"
        raise DiagnosticError(Diagnostic(MISSING, message, hint=f"install {package}, as your system calls it"))


def _done(command: Sequence[str], folder: Path, what: str = "") -> subprocess.CompletedProcess[str]:
    try:
        return subprocess.run(  # noqa: S603 - the commands that the user named, without a shell
            command, cwd=folder, capture_output=True, text=True, errors="replace", check=False, timeout=SECONDS
        )
    except subprocess.TimeoutExpired:
        raise _failed(f"{what or command[0]} takes more than {SECONDS} seconds") from None
    except OSError as error:
        raise _failed(f"{what or command[0]} cannot be run: {error.strerror}") from None


def _failed(message: str) -> DiagnosticError:
    return DiagnosticError(Diagnostic(FAILED, message))


def _difference(harness: Harness, part: Part, told: Sequence[int]) -> Difference:
    """What an image told, in words."""
    run, step, number, expected, found = told
    sequence, before = part.runs[run]
    if number >= len(harness.names):
        names = {value & 0xFFFF: name for name, (value, _) in STATUSES.items()}
        texts = [names.get(n & 0xFFFF, f"fault {n & 0xFFFF}") for n in (expected, found)]
        return Difference(sequence + 1, before + step, "status", *texts)
    field, _ = harness.fields[number]
    kind, labels = field.var.type, field.var.origin.labels
    texts = [value_text(kind, labels, value_of(field, n, harness.bytes)) for n in (expected, found)]
    return Difference(sequence + 1, before + step, harness.names[number], *texts)
