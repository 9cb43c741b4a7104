"""Compiling an image with its harness, running it, and what came of it."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import resources
from itertools import zip_longest
from pathlib import Path
from shutil import which
from tempfile import TemporaryDirectory

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.codes import FAILED, MISSING
from llfsm_verify.extensions.c.image import STATUSES, Image
from llfsm_verify.extensions.c.verifying.harness import Harness, Part, value_of
from llfsm_verify.extensions.c.verifying.processes import MOST, Ended, ended
from llfsm_verify.plug import Difference, Made, Vectors, value_text
from llfsm_verify.plug import TargetWanted as Wanted

SECONDS = 120
"""How long a compiler, or an image with its vectors, may take."""
NATIVE = ("-std=c99", "-O2")
NUMBERS = {"ok": 1, "differs": 5, "layout": 0}
"""How many numbers an answer has."""
_TOLD = re.compile(r"\b(ok|differs|cost|layout)((?: [0-9a-f]{8}(?:[0-9a-f]{8})?)*)\.?$", re.MULTILINE)
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")


@dataclass(frozen=True, slots=True)
class Ran:
    """What images with their vectors told. `costs`: the largest of a call, of what the board tells."""

    steps: int
    difference: Difference | None
    costs: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Bench:
    """How images are compiled and run: the words of both commands. `board`: C with what `harness.c` asks of a machine;
    `budget`: bytes of vectors in a program; `packages`: what Debian calls what brings a program."""

    name: str
    compiler: tuple[str, ...]
    emulator: tuple[str, ...]
    board: str
    budget: int = 1 << 40
    packages: Mapping[str, str] = field(default_factory=dict)

    def costs(self, image: Image, made: Made, found: Mapping[str, tuple[Ran, bool]]) -> Iterator[str]:  # noqa: ARG002
        """Lines on what the image takes. `found`: by unit, and whether these are all steps."""
        return iter(())

    def run(self, image: Image, texts: tuple[str, str], vectors: Vectors, group: str = "") -> Ran:
        """What an image, with these texts of its header and its source, makes of vectors (see `Harness`).

        DiagnosticError: E508, E509.
        """
        for program in (self.compiler[0], *self.emulator[:1]):
            self._found(program)
        try:
            harness = Harness(image, vectors, self.budget, group, self.board)
        except ValueError as error:
            raise _failed(str(error)) from None
        steps, costs = 0, list[int]()
        with TemporaryDirectory() as name:
            folder = Path(name)
            _write(folder, image, texts)
            self._compile(folder, [f"{image.prefix}.c"], "image.o", "-c")
            for part in harness.parts:
                told = self._told(folder, harness, part)
                difference = _difference(harness, part, told["differs"]) if "differs" in told else None
                if difference is not None or "ok" not in told:
                    return Ran(steps, difference or Difference(0, 0, "layout", "", ""))
                steps += told["ok"][0]
                costs = [max(pair) for pair in zip_longest(costs, told.get("cost", ()), fillvalue=0)]
        return Ran(steps, None, tuple(costs))

    def told_of(self, files: Mapping[str, str], program: str) -> str:
        """What a program tells of what is compiled of these files, those that are not C left out."""
        with TemporaryDirectory() as name:
            folder = Path(name)
            texts = {file: text for file, text in files.items() if file.endswith((".c", ".h"))}
            for file, text in texts.items():
                (folder / file).write_text(text, encoding="utf-8")
            self._compile(folder, [file for file in texts if file.endswith(".c")], "program.elf")
            return _done([self._found(program), str(folder / "program.elf")], program).out

    def _told(self, folder: Path, harness: Harness, part: Part) -> dict[str, list[int]]:
        (folder / "harness.c").write_text(part.source, encoding="utf-8")
        self._compile(folder, ["harness.c", "image.o"], "harness.elf")
        emulator = [self._found(self.emulator[0]), *self.emulator[1:]] if self.emulator else []
        said = _done([*emulator, str(folder / "harness.elf")], "the image with its vectors")
        text = _COLOUR.sub("", f"{said.out}\n{said.errors}").replace("\r", "").strip()
        lines = [(m[1], [int(word, 16) for word in m[2].split()]) for m in _TOLD.finditer(text)]
        found = dict(lines)
        if not _is_answer(harness, part, lines, said.code):
            told = f"its answer cannot be: {text[-200:]!a}" if text else "it gave no answer"
            hint = "try what runs the image by hand" if emulator else ""
            raise _failed(f"the image with its vectors did not run as it should: {told}, exit code {said.code}", hint)
        return found

    def _compile(self, folder: Path, files: Sequence[str], output: str, *options: str) -> None:
        """Where the user is, whose words may name files there."""
        words = [*options, *(str(folder / file) for file in files), "-o", str(folder / output)]
        done = _done([self._found(self.compiler[0]), *self.compiler[1:], *words], self.compiler[0])
        if done.code:
            errors = done.errors.replace(f"{folder}/", "").splitlines()
            lines = [line for line in errors if "error" in line or "overflowed" in line]
            what = "the image does not fit" if any("overflowed" in x for x in lines) else f"{self.compiler[0]} fails"
            raise _failed(f"{what}: {(lines or errors or [''])[0][:300]}")

    def _found(self, program: str) -> str:
        """What runs, from anywhere."""
        found = which(program)
        if found is None:
            package = self.packages.get(program.rsplit("/", 1)[-1], program)
            message = f"`{program[:60]}` is not installed, and the image cannot be verified without it"
            raise DiagnosticError(Diagnostic(MISSING, message, hint=f"install {package}, or name another command"))
        return str(Path(found).absolute())


def on_computer(wanted: Wanted) -> Bench:
    """The one of programs for this computer, or for what an emulator runs here."""
    compiler, emulator = tuple(shlex.split(wanted.compiler)), tuple(shlex.split(wanted.emulator))
    name = " ".join(compiler) + (f" under {emulator[0]}" if emulator else "")
    board = resources.files(__package__).joinpath("computer.c").read_text(encoding="utf-8")
    return Bench(name, (*compiler, *NATIVE), emulator, board, packages={"cc": "gcc", "gcc": "gcc", "clang": "clang"})


def _write(folder: Path, image: Image, texts: tuple[str, str]) -> None:
    for ending, text in zip("hc", texts, strict=True):
        (folder / f"{image.prefix}.{ending}").write_text(text, encoding="utf-8")


def _done(command: Sequence[str], what: str) -> Ended:
    try:
        return ended(command, SECONDS)
    except TimeoutError:
        raise _failed(f"{what} takes more than {SECONDS} seconds") from None
    except OverflowError:
        raise _failed(f"{what} writes more than {MOST >> 20} MiB") from None
    except OSError as error:
        raise _failed(f"{what} cannot be run: {error.strerror}") from None


def _failed(message: str, hint: str = "") -> DiagnosticError:
    return DiagnosticError(Diagnostic(FAILED, message, hint=hint or None))


def _is_answer(harness: Harness, part: Part, lines: Sequence[tuple[str, list[int]]], code: int) -> bool:
    """Whether this is the one answer that a program with these vectors may give."""
    answers = [(word, numbers) for word, numbers in lines if word in NUMBERS]
    if len(answers) != 1 or len(answers[0][1]) != NUMBERS[answers[0][0]]:
        return False
    word, numbers = answers[0]
    if word == "ok":
        return code == 0 and numbers[0] == sum(part.steps)
    if word == "differs":
        run, step, number, *values = numbers
        known = number < len(harness.names) or number == harness.last
        return run < len(part.runs) and step <= part.steps[run] and known and values[0] != values[1]
    return True


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
