"""The harness of an image: vectors in arrays, and C that compares what the image makes of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import resources

from llfsm_verify.extensions.c.blocks import comment
from llfsm_verify.extensions.c.image import MARK, Image
from llfsm_verify.extensions.c.names import Field
from llfsm_verify.extensions.c.numbers import bits_of, stored_as
from llfsm_verify.plug import Int, Vectors, element_names

HIDDEN = ("control", "output")
"""Kinds of variables that no user has named: an image may be without some, and with those of monitors."""


@dataclass(frozen=True, slots=True)
class Part:
    """A source, and what it runs: the numbers of sequences, and of the steps of them that come before; and how many
    steps of each it runs."""

    source: str
    runs: tuple[tuple[int, int], ...]
    steps: tuple[int, ...]


class Harness:
    """The vectors of an image in sources with about `budget` bytes of them each. `group`: of the state, where only that
    is compared; `board`: C of the machine. ValueError: they are not its own."""

    def __init__(self, image: Image, vectors: Vectors, budget: int = 1 << 40, group: str = "", board: str = "") -> None:
        self._image, self._vectors, self._board = image, vectors, board
        fields = [f for f in image.names.fields.values() if group in ("", f.group)]
        stored = {n: (f, i) for f in fields for i, n in enumerate(element_names(f.var))}
        positions = {name: i for i, name in enumerate(vectors.fields)}
        missing = [f for name, (f, _) in stored.items() if name not in positions and f.var.origin.kind not in HIDDEN]
        if missing or vectors.inputs != tuple(c.name for c in image.program.choices):
            raise ValueError("the vectors have not the inputs and variables of the image")
        self.names = [name for name in vectors.fields if name in stored]
        """The fields that are compared: those that the image stores."""
        self._columns = [positions[name] for name in self.names]
        self.fields = [stored[name] for name in self.names]
        kinds = [f.type for f, _ in self.fields] + [stored_as(c.type) for c in image.program.choices]
        self.bytes = max((_size(kind) for kind in kinds), default=1)
        self._number = 1 if max(len(self.names), len(vectors.inputs)) < 255 else 2
        self.last = (1 << 8 * self._number) - 1
        """The number of no field: the status differs."""
        self.parts = tuple(self._parts(budget))

    # ------------------------------------------------------------ vectors

    def _parts(self, budget: int) -> Iterator[Part]:
        made, runs, steps = bytearray(), list[tuple[int, int]](), list[int]()
        for number, sequence in enumerate(self._vectors.sequences):
            begun = False
            for step, row in enumerate(sequence.inputs):
                if begun and len(made) > budget:
                    yield self._part(made + self._last(), runs, steps)
                    made, runs, steps, begun = bytearray(), [], [], False
                last = sequence.records[step - 1] if step else sequence.start
                before = self._record(last) if last else self._initial()
                if not begun:
                    runs.append((number, step))
                    steps.append(0)
                    made += self._count(1) + b"".join(map(self._value, before)) if last else self._count(0)
                    begun, given = True, dict[int, int]()
                steps[-1] += 1
                made += self._pairs([(i, v) for i, v in enumerate(row) if given.get(i) != v])
                given = dict(enumerate(row))
                if step < len(sequence.records):
                    after = self._record(sequence.records[step])
                    made += self._pairs([(i, v) for i, (v, w) in enumerate(zip(after, before, strict=True)) if v != w])
                else:
                    made += self._last() + (sequence.fault & 0xFFFF).to_bytes(2, "little")
            if begun:
                made += self._last()
            if len(made) > budget:
                yield self._part(made, runs, steps)
                made, runs, steps = bytearray(), [], []
        if runs:
            yield self._part(made, runs, steps)

    def _part(self, made: bytes | bytearray, runs: Sequence[tuple[int, int]], steps: Sequence[int]) -> Part:
        return Part(self._text(bytes(made), len(runs)), tuple(runs), tuple(steps))

    def _record(self, record: Sequence[int]) -> list[int]:
        return [record[column] for column in self._columns]

    def _initial(self) -> list[int]:
        found = []
        for field, index in self.fields:
            first = 1 if field.var.name == self._image.program.cycle else field.var.init
            found.append(first[index] if isinstance(first, tuple) else first)
        return found

    def _count(self, number: int) -> bytes:
        return number.to_bytes(self._number, "little")

    def _value(self, value: int) -> bytes:
        return (value & (1 << 8 * self.bytes) - 1).to_bytes(self.bytes, "little")

    def _pairs(self, pairs: Sequence[tuple[int, int]]) -> bytes:
        return self._count(len(pairs)) + b"".join(self._count(n) + self._value(v) for n, v in pairs)

    def _last(self) -> bytes:
        return b"\xff" * self._number

    # ------------------------------------------------------------ C

    def _text(self, vectors: bytes, sequences: int) -> str:
        p, bits = self._image.prefix, 8 * self.bytes
        call = "step" if self._vectors.unit == "ringlet" else "cycle"
        types = [
            f"typedef uint{8 * self._number}_t number;", f"typedef uint{bits}_t value;",
            f"typedef uint{max(bits, 32)}_t longest;", f"#define FIELDS {len(self.names)}u",
            f"#define SEQUENCES {sequences}u", f"#define CALL {p}_{call}",
            f"#define RINGLETS {int(call == 'step')}",
        ]  # fmt: skip
        parts = {
            "BOARD": self._board,
            "TYPES": "\n".join(types),
            "NUMBER_BYTES": str(self._number),
            "VALUE_BYTES": str(self.bytes),
            "VECTORS": _rows(vectors),
            "INITIAL": _rows(self._pairs(list(enumerate(self._initial())))[self._number :] or b"0"),
            "ACCESS": "\n".join([*self._getter(), *self._setter("state"), *self._setter("inputs")]),
        }
        text = resources.files(__package__).joinpath("harness.c").read_text(encoding="utf-8")
        for name, made in parts.items():
            text = text.replace(f"@{name}@", made)
        return f"{comment(f'{self._image.program.name}. {MARK}')}\n{text.replace('NAME', p)}"

    def _getter(self) -> Iterator[str]:
        yield f"static value field_of(const {self._image.prefix}_state *of, number which)\n{{\n    switch (which) {{"
        for number, (field, index) in enumerate(self.fields):
            yield f"    case {number}:\n        return (value)of->{_path(field, index)};"
        yield "    default:\n        (void)of;\n        return 0;\n    }\n}\n"

    def _setter(self, what: str) -> Iterator[str]:
        places = [(_path(field, index), field.type) for field, index in self.fields]
        if what == "inputs":
            places = [(self._image.names.inputs[c.name], stored_as(c.type)) for c in self._image.program.choices]
        name = {"state": "set_field", "inputs": "give"}[what]
        yield f"static void {name}({self._image.prefix}_{what} *to, number which, value given)\n{{"
        yield "    switch (which) {"
        for number, (path, kind) in enumerate(places):
            value = "given != 0" if kind == "bool" else f"({kind})given"
            yield f"    case {number}:\n        to->{path} = {value};\n        break;"
        yield "    default:\n        (void)to;\n        (void)given;\n        break;\n    }\n}\n"


def _path(field: Field, index: int) -> str:
    return field.path if field.var.length is None else f"{field.path}[{index}]"


def _size(kind: str) -> int:
    return 1 if kind == "bool" else bits_of(kind) // 8


def _rows(data: bytes) -> str:
    return ",\n".join("    " + ", ".join(map(str, data[i : i + 24])) for i in range(0, len(data), 24))


def value_of(field: Field, found: int, size: int) -> int:
    """A value that a harness told, of so many bytes."""
    signed = not isinstance(field.var.type, Int) or field.var.type.low < 0
    return found - (1 << 8 * size) if signed and found >> 8 * size - 1 else found
