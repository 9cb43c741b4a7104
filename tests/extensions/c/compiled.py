"""Images built by a compiler of this machine, as executors of one step at a time."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from llfsm_verify.backends.native.code import OVERFLOW
from llfsm_verify.extensions.c.image import OVERFLOW as LEFT_64
from llfsm_verify.extensions.c.image import STATUSES, Image
from llfsm_verify.extensions.c.numbers import stored_as
from llfsm_verify.extensions.c.small import smaller
from llfsm_verify.program.program import Program
from llfsm_verify.values import Value
from tests.outside import needs

STRICT = ("-std=c99", "-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Werror")

needs_gcc, needs_clang, needs_avr = (needs(name) for name in ("gcc", "clang", "avr-gcc"))


def places(image: Image) -> Iterator[tuple[str, str, str]]:
    """Variable, path and type of each scalar in the state."""
    for field in image.names.fields.values():
        if field.var.length is None:
            yield field.var.name, field.path, field.type
        else:
            for i in range(field.var.length):
                yield field.var.name, f"{field.path}[{i}]", field.type


def driver(image: Image) -> str:
    """C that reads and writes whole states and inputs as words of 64 bits."""
    p = image.prefix
    found = list(places(image))
    inputs = [(image.names.inputs[c.name], stored_as(c.type)) for c in image.program.choices]
    lines = [f'#include "{p}.h"', f"size_t state_size(void);\nsize_t state_size(void) {{ return sizeof({p}_state); }}"]
    lines += [f"size_t inputs_size(void);\nsize_t inputs_size(void) {{ return sizeof({p}_inputs); }}"]
    for name, kind, const, body in (
        ("read_state", "state", "const ", [f"words[{i}] = (uint64_t)s->{at};" for i, (_, at, _) in enumerate(found)]),
        ("write_state", "state", "", [f"s->{at} = ({of})words[{i}];" for i, (_, at, of) in enumerate(found)]),
        ("write_inputs", "inputs", "", [f"s->{at} = ({of})words[{i}];" for i, (at, of) in enumerate(inputs)]),
    ):
        body += ["s->status = 0;"] if name == "write_state" else ["(void)s;", "(void)words;"]
        head = f"void {name}({const}{p}_{kind} *s, uint64_t *words)"
        lines += [f"{head};\n{head}\n{{", *(f"    {line}" for line in body), "}"]
    return "\n".join(lines) + "\n"


class Built:
    """An image as a shared library. `flags` come after those that make every warning an error."""

    def __init__(self, image: Image, *flags: str, compiler: str = "gcc") -> None:
        self.image, self.program = image, image.program
        p = image.prefix
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            write(image, folder)
            (folder / "driver.c").write_text(driver(image))
            compile_strictly(compiler, folder / f"{p}.c", folder / "image.o", "-fPIC", *flags)
            command = [compiler, "-std=c99", "-O0", "-shared", "-fPIC", *flags, "driver.c", "image.o", "-o", "lib.so"]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            self._library = ctypes.CDLL(str(folder / "lib.so"))
        self._calls = {part: getattr(self._library, f"{p}_{part}") for part in ("step", "cycle")}
        for call in self._calls.values():
            call.restype = getattr(ctypes, f"c_{image.status_type.removesuffix('_t')}")
        self._state = ctypes.create_string_buffer(self._library["state_size"]())
        self._inputs = ctypes.create_string_buffer(self._library["inputs_size"]())
        self._places = list(places(image))

    def start(self) -> dict[str, Value]:
        """The state after `NAME_init`."""
        self._library[f"{self.image.prefix}_init"](self._state)
        return self.state()

    def make_safe(self) -> None:
        """`NAME_safe`."""
        self._library[f"{self.image.prefix}_safe"](self._state)

    def state(self) -> dict[str, Value]:
        """All variables, outputs too."""
        words = (ctypes.c_uint64 * len(self._places))()
        self._library["read_state"](self._state, words)
        found: dict[str, list[int]] = {}
        for (name, _, kind), word in zip(self._places, words, strict=True):
            signed = word - (1 << 64) if kind.startswith("int") and word >> 63 else word
            found.setdefault(name, []).append(signed)
        arrays = {v.name for v in self.program.vars if v.length is not None}
        return {name: tuple(given) if name in arrays else given[0] for name, given in found.items()}

    def put(self, values: Mapping[str, Value]) -> None:
        """All variables get these values."""
        flat: list[int] = []
        for var in self.program.vars:
            value = values[var.name]
            flat += value if isinstance(value, tuple) else (value,)
        self._library["write_state"](self._state, _words(flat))

    def hold(self, choices: Mapping[str, int]) -> None:
        """The inputs get these values, others their lowest."""
        self._library["write_inputs"](
            self._inputs, _words([choices.get(c.name, c.type.low) for c in self.program.choices])
        )

    def step(self, choices: Mapping[str, int], what: str = "step") -> int:
        """One step, or one `cycle`: its status, as the executor tells it; what only C tells is below -1."""
        self.hold(choices)
        status: int = self._calls[what](self._state, self._inputs)
        return OVERFLOW if status == STATUSES[LEFT_64][0] else status - 10 if status < 0 else status


def _words(values: Sequence[int]) -> ctypes.Array[ctypes.c_uint64]:
    return (ctypes.c_uint64 * max(1, len(values)))(*(value & (1 << 64) - 1 for value in values))


def write(image: Image, folder: Path) -> None:
    """Its header and its source."""
    source = image.source()
    (folder / f"{image.prefix}.c").write_text(source)
    (folder / f"{image.prefix}.h").write_text(image.header())


def compile_strictly(compiler: str, source: Path, result: Path, *flags: str) -> None:
    """Compile one file; every warning is an error."""
    command = [compiler, *STRICT, "-c", *flags, str(source), "-o", str(result)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{done.stderr[:4000]}\n{source.read_text()[-20000:]}"


def shrunk(image: Image) -> Image:
    """The same, optimized for size."""
    return Image(smaller(image.program, safe=image.meaning.safe), replace(image.meaning, small=True))


def single(program: Program) -> bool:
    """Whether an image can be made of it."""
    return len(program.processes) == 1
