"""Images built in many ways, for several kinds of machine, and what a walk of each prints.

A walk takes ringlets and cycles with inputs by chance. The chance is a generator that `walk.c` and `Walk` both have, so
nothing is read, and a machine needs no more than a place to put characters.
"""

from __future__ import annotations

import re
import subprocess
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.image import ENDED, OK, STATUSES, Image
from llfsm_verify.extensions.c.image import OVERFLOW as LEFT_64
from llfsm_verify.extensions.c.numbers import stored_as, unsigned64
from llfsm_verify.program.program import Choice, Program
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.values import Value
from tests.extensions.c.compiled import STRICT, places, shrunk
from tests.outside import program

HERE = Path(__file__).parent
WORD = (1 << 64) - 1
SEED = 0x9E3779B97F4A7C15


class Chance:
    """The generator of `walk.c`."""

    def __init__(self, seed: int) -> None:
        self._state = seed

    def word(self) -> int:
        x = self._state
        x ^= x >> 12
        x ^= x << 25 & WORD
        x ^= x >> 27
        self._state = x
        return x * 2685821657736338717 & WORD

    def pick(self, low: int, size: int) -> int:
        """See `pick` in `walk.c`."""
        kind, any_ = self.word() >> 62, self.word()
        near = (any_ >> 8) % 5 - 2
        if kind < 2:
            return low + kind * (size - 1)
        past = near - low & WORD
        return low + (past if kind == 2 and past < size else any_ % size)


def _asked(choice: Choice) -> bool:
    return choice.name.startswith(OPERATOR)


@dataclass(frozen=True, slots=True)
class Walk:
    """Steps of an image from its beginning, and from there again after each fault or end. `whole`: the program that the
    executor runs, where that of the image is a part of it."""

    image: Image
    steps: int
    whole: Program | None = None

    def function(self) -> str:
        """C that walks and prints a line for each step: its status, and all variables as words."""
        image, p = self.image, self.image.prefix
        shown = [f"put(' ');\n        put_word((uint64_t)s.{path});" for _, path, _ in places(image)]
        inputs = []
        for choice in image.program.choices:
            kind, at = stored_as(choice.type), f"in.{image.names.inputs[choice.name]}"
            low, size = unsigned64(choice.type.low), unsigned64(choice.type.high - choice.type.low + 1)
            taken = f"({kind})pick(&seed, {low}, {size})"
            least = f"({kind}){low}"
            inputs.append(f"{at} = {f'chance(&seed) >> 61 > 2 ? {least} : ' * _asked(choice)}{taken};")
        status = f"put_word((uint64_t)(int64_t){p}_"
        return f"""#include "{p}.h"
#include "walk.h"

void walk_{p}(void);
void walk_{p}(void)
{{
    static {p}_state s;
    static {p}_inputs in;
    uint64_t seed = {unsigned64(SEED)};
    int32_t left;
    {p}_init(&s);
    {p}_first(&in);
    for (left = {self.steps}; left > 0; left--) {{
        {p}_status status;
        bool whole = chance(&seed) >> 61 == 0;
        {(chr(10) + "        ").join(inputs)}
        status = whole ? {p}_cycle(&s, &in) : {p}_step(&s, &in);
        put_word((uint64_t)(int64_t)status);
        {(chr(10) + "        ").join(shown)}
        if (status != {p}_OK) {{
            put(' ');
            {status}step(&s, &in));
            put(' ');
            {status}cycle(&s, &in));
            {p}_init(&s);
        }}
        put('\\n');
    }}
    put_word({p}_layout());
    put('\\n');
}}
"""

    def lines(self, tally: Counter[str] | None = None) -> Iterator[str]:
        """The lines by the executor."""
        told = Counter[str]() if tally is None else tally
        image, chance = self.image, Chance(SEED)
        program = image.program
        native = NativeProgram(self.whole or program, events=True, effort="quick")
        layout = native.layout
        record = layout.first()
        for _ in range(self.steps):
            whole = chance.word() >> 61 == 0
            held = {}
            for c in program.choices:
                least = _asked(c) and chance.word() >> 61 > 2
                held[c.name] = c.type.low if least else chance.pick(c.type.low, c.type.high - c.type.low + 1)
            safe: Mapping[str, Value] = {}
            if not native.enabled(record):
                status = STATUSES[ENDED][0]
            else:
                if whole:
                    ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=held)
                    status, record = ran.status, ran.record
                    told.update(["cycle"])
                else:
                    result = native.step(record, 0, held)
                    status, record = result.status, result.record
                    told.update(kind for kind, *_ in result.events)
                safe = image.meaning.safe if status else {}
                status = STATUSES[LEFT_64][0] if status == OVERFLOW else status
            values = {**layout.decode_record(record), **safe}
            words = [status, *_flat(values[v.name] for v in program.vars)]
            if status != STATUSES[OK][0]:
                words += [status] * 2
                record = layout.first()
            told[
                "end" if status == STATUSES[ENDED][0] else "int" if status < 0 else "a fault" if status else "done"
            ] += 1
            yield " ".join(f"{word & WORD:x}" for word in words)
        yield f"{image.layout():x}"


def small(image: Image, steps: int) -> Walk:
    """A walk of the same, optimized for size."""
    return Walk(shrunk(image), steps, image.program)


def _flat(values: Iterator[Value]) -> Iterator[int]:
    for value in values:
        yield from value if isinstance(value, tuple) else (value,)


# ---------------------------------------------------------------- ways

CHECKED = ("-g0", "-fsanitize=undefined,address", "-fno-sanitize-recover=all")
ALONE = ("-ffreestanding", "-nostdlib", "-Wl,--no-entry", "-Wl,--export=walk_all", "-Wl,--allow-undefined")
NODE = """
const said = [];
const module = new WebAssembly.Module(require("fs").readFileSync("walk"));
const image = new WebAssembly.Instance(module, {env: {put: (c) => { said.push(c); }}});
image.exports.walk_all();
require("fs").writeSync(1, Buffer.from(said));
"""


@dataclass(frozen=True, slots=True)
class Way:
    """A compiler with its flags, and what runs its programs. All are names of `tools/oracles.py`."""

    compiler: str
    flags: tuple[str, ...]
    runner: tuple[str, ...] = ()
    others: tuple[str, ...] = ()
    """What else it takes."""

    @property
    def needs(self) -> tuple[str, ...]:
        return (self.compiler, *self.runner[:1], *self.others)

    def build(self, folder: Path) -> None:
        """Compile all there is in the folder, and every warning is an error."""
        sources = sorted(path.name for path in folder.glob("*.c"))
        command = [program(self.compiler), *STRICT, *self.flags, *sources, "-o", "walk"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:4000]

    def run(self, folder: Path) -> list[str]:
        """What the program prints."""
        command = [program(self.runner[0]), *self.runner[1:], "walk"] if self.runner else ["./walk"]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=1200)
        assert done.returncode == 0, done.stderr[-4000:]
        said = done.stdout
        if self.runner[:1] == ("simavr",):  # a line for each 256 characters, in green, with `.` for what is not printed
            said = "".join(re.findall(r"\x1b\[32m(.*)\n", done.stderr)).replace(".", "\n")
        return said.splitlines()


WAYS: Mapping[str, Way] = {
    **{
        f"{compiler} {level}": Way(compiler, (level, *CHECKED), others=others)
        for compiler, others in (("gcc", ()), ("clang", ("clang-rt",)))
        for level in ("-O0", "-O2")
    },
    **{
        f"{name} {level}": Way(f"{name}-gcc", (level, "-static"), (f"qemu-{name}",))
        for name in ("arm", "aarch64", "riscv64")
        for level in ("-O2",)
    },
    "wasm": Way("clang", ("--target=wasm32", "-O2", *ALONE), ("node", "-e", NODE), ("wasm-ld",)),
    "avr": Way("avr-gcc", ("-mmcu=atmega2560", "-Os"), ("simavr", "-m", "atmega2560", "-f", "16000000")),
}
"""By name. The AVR's `int` has 16 bits, the ARM's words 32."""


def write(walks: Sequence[Walk], folder: Path) -> None:
    """The images with their walks, and one program around them."""
    for name in ("walk.h", "walk.c"):
        (folder / name).write_text((HERE / name).read_text())
    for walk in walks:
        p = walk.image.prefix
        source = walk.image.source()
        (folder / f"{p}.c").write_text(source)
        (folder / f"{p}.h").write_text(walk.image.header())
        (folder / f"walk_{p}.c").write_text(walk.function())
    called = [walk.image.prefix for walk in walks]
    lines = ['#include "walk.h"', *(f"void walk_{p}(void);" for p in called), "void walk_all(void)", "{"]
    (folder / "all.c").write_text("\n".join([*lines, *(f"    walk_{p}();" for p in called), "}", ""]))


def first_difference(walks: Sequence[Walk], wanted: Sequence[str], got: Sequence[str]) -> str:
    """Where two sequences of lines part, in words; "": nowhere."""
    number = next((i for i, (a, b) in enumerate(zip(wanted, got, strict=False)) if a != b), min(len(wanted), len(got)))
    if number == len(wanted) == len(got):
        return ""
    before = number
    for walk in walks:
        if before <= walk.steps:
            names = ["status", *(path for _, path, _ in places(walk.image))]
            sides = [lines[number].split() if number < len(lines) else [] for lines in (wanted, got)]
            differ = [(n, a, b) for n, a, b in zip(names, *sides, strict=False) if a != b]
            return f"{walk.image.program.name}, step {before + 1}: {differ or sides}"
        before -= walk.steps + 1
    return f"line {number + 1}"
