"""How a configuration and the step's outputs lie in a vector of 64-bit words.

Every scalar and every array element is a bit field that holds `value - low` in as few bits as its type needs; a field
never straddles two words. The configuration's words come first, then the outputs' words; both together are a *record*.
Bits that belong to no field are 0, so two records are equal exactly when their values are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from struct import pack
from types import MappingProxyType

from llfsm_verify.limits import tick
from llfsm_verify.program.program import INT64_MAX, INT64_MIN, Int, Program, Var
from llfsm_verify.values import Value

WORD_BITS = 64
WORD_BYTES = 8


_Place = tuple[int, int, int, int, int]
"""First byte, byte after the last, shift, mask and lowest value of a scalar or an element."""
_Read = tuple[str, bool, bool, tuple[_Place, ...]]
"""The name of a variable, whether it is an array, whether its numbers have a sign (`int`), and its elements."""
_Write = tuple[str, bool, int, int, tuple[tuple[int, int, int, int], ...]]
"""The name of a variable, whether it is an array, its lowest and highest value, and word, shift, mask and what is
subtracted of its elements."""


class TooManyInitial(Exception):
    """The free variables have `count` valuations together, more than the caller wanted to see."""

    def __init__(self, count: int, limit: int) -> None:
        self.count = count
        super().__init__(f"{count:,} initial configurations are more than {limit:,}")


@dataclass(frozen=True, slots=True)
class BitField:
    """Where a variable lies. Element i of an array is in word `word + i // per_word`, shifted by
    `shift + bits * (i % per_word)`; when an array takes more than one word its `shift` is 0."""

    name: str
    word: int
    """Index of the first word in the record."""
    shift: int
    bits: int
    low: int
    """What is subtracted before storing (0 for unbounded integers, which are stored as they are)."""
    high: int
    length: int | None
    per_word: int
    """Elements in each full word (1 for scalars)."""
    output: bool
    unbounded: bool = False
    """Of an `int`: its range is that of the word."""

    @property
    def elements(self) -> int:
        return 1 if self.length is None else self.length

    def place(self, index: int) -> tuple[int, int]:
        """Word and shift of element `index`."""
        return self.word + index // self.per_word, self.shift + self.bits * (index % self.per_word)


@dataclass(frozen=True, slots=True)
class Layout:
    """The fields of one program, by name. `words` are the configuration's, `output_words` the outputs'."""

    fields: Mapping[str, BitField]
    words: int
    output_words: int
    _vars: Mapping[str, Var]
    _cycle: str
    _reads: tuple[tuple[_Read, ...], tuple[_Read, ...]]
    """How to read all persistent variables, and all outputs, in declared order."""
    _writes: tuple[tuple[_Write, ...], tuple[_Write, ...]]
    """How to write them, in the order of the fields."""

    @staticmethod
    def of(program: Program) -> Layout:
        """The layout of a program: the same for equal programs.

        Raises ValueError for a program whose variables contradict themselves (two of one name, an `init` outside its
        type, no output named `program.cycle`).
        """
        variables = {v.name: v for v in program.vars}
        if len(variables) != len(program.vars):
            raise ValueError("two variables have one name")
        for v in program.vars:
            _check(v, v.init)
        if program.cycle not in variables or not variables[program.cycle].output:
            raise ValueError(f"the program has no output variable {program.cycle!r}")
        kept, shown = ([v for v in program.vars if v.output is output] for output in (False, True))
        persistent, words = _pack(kept, 0)
        outputs, output_words = _pack(shown, words)
        reads = _reads(kept, persistent), _reads(shown, outputs)
        writes = _writes(persistent, variables, 0), _writes(outputs, variables, words)
        return Layout({**persistent, **outputs}, words, output_words, variables, program.cycle, reads, writes)

    @property
    def configuration_bytes(self) -> int:
        return self.words * WORD_BYTES

    @property
    def record_bytes(self) -> int:
        return (self.words + self.output_words) * WORD_BYTES

    # ------------------------------------------------------------ whole records

    def encode(self, values: Mapping[str, Value]) -> bytes:
        """The configuration words, little endian. `values` names every persistent variable.

        Raises KeyError for one that is missing and ValueError for a value outside its type.
        """
        return self._encode(values, False)

    def encode_outputs(self, outputs: Mapping[str, Value]) -> bytes:
        """The output words; errors as for `encode`."""
        return self._encode(outputs, True)

    def decode(self, data: bytes | bytearray | memoryview) -> dict[str, Value]:
        """The persistent variables of a record (or of configuration words alone), in declared order."""
        return self._decode(data, False)

    def decode_outputs(self, data: bytes | bytearray | memoryview) -> dict[str, Value]:
        """The outputs of a record."""
        return self._decode(data, True)

    def decode_record(self, record: bytes | bytearray | memoryview) -> dict[str, Value]:
        """All variables of a record, its outputs too."""
        return self._decode(record, False) | self._decode(record, True)

    def encode_record(self, values: Mapping[str, Value]) -> bytes:
        """The record in which all variables, outputs too, have these values; other names are let be.

        Errors as for `encode`.
        """
        return self._encode(values, False) + self._encode(values, True)

    def relaid(self, record: bytes, other: Layout, first: bytes) -> bytes:
        """A record of this layout in `other`, that of another program of the same arrangement: variables that only the
        other one has are as in `first`, a record of it."""
        return other.encode_record(other.decode_record(first) | self.decode_record(record))

    def get(self, data: bytes | bytearray | memoryview, name: str, index: int | None = None) -> int:
        """The value of one scalar, or of element `index` of an array, in a record."""
        return self.reader(name, index)(data)

    def reader(self, name: str, index: int | None = None) -> Callable[[bytes | bytearray | memoryview], int]:
        """A fast function from records to one value: make it once, call it often.

        Raises KeyError for an unknown name, IndexError for an index that is missing, needless or outside.
        """
        field = self.fields[name]
        if (index is None) != (field.length is None) or (index is not None and not 0 <= index < field.elements):
            raise IndexError(f"{name} has no element {index}")
        start, end, shift, mask, low = _bits(field, index or 0)
        if field.bits == 0:
            return lambda _: low
        if field.unbounded:
            return lambda data: int.from_bytes(data[start:end], "little", signed=True)
        return lambda data: (int.from_bytes(data[start:end], "little") >> shift & mask) + low

    def _encode(self, values: Mapping[str, Value], output: bool) -> bytes:
        count = self.output_words if output else self.words
        words = [0] * count
        for name, array, low, high, places in self._writes[output]:
            value = values[name]
            if isinstance(value, tuple) is not array:
                _check(self._vars[name], value)
            elements = value if isinstance(value, tuple) else (value,)
            if len(elements) != len(places) or not all(low <= element <= high for element in elements):
                _check(self._vars[name], value)
            for element, (word, shift, mask, base) in zip(elements, places, strict=True):
                if mask:  # else it has no place, and there may be no word at all
                    words[word] |= (element - base & mask) << shift
        return pack(f"<{count}Q", *words)

    def _decode(self, data: bytes | bytearray | memoryview, output: bool) -> dict[str, Value]:
        values: dict[str, Value] = {}
        number = int.from_bytes
        for name, array, signed, places in self._reads[output]:
            if signed:
                found = [number(data[start:end], "little", signed=True) for start, end, *_ in places]
            else:
                found = [
                    (number(data[start:end], "little") >> shift & mask) + low for start, end, shift, mask, low in places
                ]
            values[name] = tuple(found) if array else found[0]
        return values

    # ------------------------------------------------------------ the beginning

    def initial_outputs(self) -> dict[str, Value]:
        """The outputs before the first step: their inits, with `cycle` 1, as if a cycle had just ended."""
        return {v.name: v.init for v in self._vars.values() if v.output} | {self._cycle: 1}

    def first(self, free: Mapping[str, Value] = MappingProxyType({})) -> bytes:
        """The initial record in which free variables have the values of `free`, else their `init`.

        Raises ValueError for a value outside its variable's type.
        """
        inits = {v.name: v.init for v in self._vars.values() if not v.output}
        return self.encode_record({**inits, **free, **self.initial_outputs()})

    def initial_count(self) -> int:
        """How many initial records there are."""
        count = 1
        for v in self._vars.values():
            if v.free and not v.output:
                values = _values(v)
                count *= (values.stop - values.start) ** (1 if v.length is None else v.length)
        return count

    def initial_records(self) -> Iterator[bytes]:
        """All initial records one by one: the free variables in declared order, the last one running fastest."""
        free = [v for v in self._vars.values() if v.free and not v.output]
        values = {v.name: v.init for v in self._vars.values() if not v.output}
        outputs = self.encode_outputs(self.initial_outputs())
        for valuation in product(*(_valuations(v) for v in free)):
            tick()
            yield self.encode(values | {v.name: x for v, x in zip(free, valuation, strict=True)}) + outputs

    def initial(self, limit: int = 1 << 20) -> list[bytes]:
        """All initial records. Raises TooManyInitial when there are more than `limit`."""
        count = self.initial_count()
        if count > limit:
            raise TooManyInitial(count, limit)
        return list(self.initial_records())


def _bits(field: BitField, index: int) -> _Place:
    """Where an element lies."""
    word, shift = field.place(index)
    start, end = word * WORD_BYTES + shift // 8, word * WORD_BYTES + (shift + field.bits + 7) // 8
    return start, end if field.bits else start, shift % 8, (1 << field.bits) - 1, field.low


def _reads(variables: list[Var], fields: Mapping[str, BitField]) -> tuple[_Read, ...]:
    """How to read whole variables."""
    found = (fields[v.name] for v in variables)
    return tuple(
        (f.name, f.length is not None, f.unbounded, tuple(_bits(f, i) for i in range(f.elements))) for f in found
    )


def _writes(fields: Mapping[str, BitField], variables: Mapping[str, Var], base: int) -> tuple[_Write, ...]:
    """How to write whole variables, into words from `base` on."""
    found: list[_Write] = []
    for field in fields.values():
        places = [field.place(i) for i in range(field.elements)]
        mask = (1 << field.bits) - 1
        where = tuple((word - base, shift, mask, field.low) for word, shift in places)
        found.append((field.name, field.length is not None, *_range(variables[field.name]), where))
    return tuple(found)


def _range(variable: Var) -> tuple[int, int]:
    kind = variable.type
    return (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)


def _values(variable: Var) -> range:
    if not isinstance(variable.type, Int):
        raise ValueError(f"{variable.name} is free and unbounded")
    return range(variable.type.low, variable.type.high + 1)


def _valuations(variable: Var) -> Iterator[Value]:
    values = _values(variable)
    return iter(values) if variable.length is None else product(values, repeat=variable.length)


def _check(variable: Var, value: Value) -> None:
    low, high = _range(variable)
    if isinstance(value, tuple) != (variable.length is not None):
        raise ValueError(f"{variable.name} is {'a scalar' if variable.length is None else 'an array'}")
    elements = value if isinstance(value, tuple) else (value,)
    if variable.length is not None and len(elements) != variable.length:
        raise ValueError(f"{variable.name} has {variable.length} elements, not {len(elements)}")
    for element in elements:
        if not low <= element <= high:
            raise ValueError(f"{variable.name}: {element} is outside {low}..{high}")


def _pack(variables: list[Var], base: int) -> tuple[dict[str, BitField], int]:
    """First-fit decreasing (D. S. Johnson, 1974): the fields by name, and the number of words they take.

    Arrays that need several words take fresh ones; what is left of their last word is open to later fields.
    """

    def bits(v: Var) -> int:
        return (v.type.high - v.type.low).bit_length() if isinstance(v.type, Int) else WORD_BITS

    def size(v: Var) -> int:
        return bits(v) * (1 if v.length is None else v.length)

    used: list[int] = []
    fields: dict[str, BitField] = {}
    for v in sorted(variables, key=lambda v: -size(v)):  # sorted is stable: equal sizes in declared order
        width, total = bits(v), size(v)
        low, high = (v.type.low, v.type.high) if isinstance(v.type, Int) else (INT64_MIN, INT64_MAX)
        per_word, word, shift = 1, 0, 0
        if total > WORD_BITS:
            per_word, word = WORD_BITS // width, len(used)
            full, rest = divmod(v.length or 1, per_word)
            used += [WORD_BITS] * full + ([rest * width] if rest else [])
        else:
            per_word = max(1, v.length or 1)
            if total > 0:
                word = next((i for i, u in enumerate(used) if u + total <= WORD_BITS), len(used))
                if word == len(used):
                    used.append(0)
                shift = used[word]
                used[word] += total
        offset = low if isinstance(v.type, Int) else 0
        place = (base + word, shift, width, offset, high, v.length, per_word, v.output)
        fields[v.name] = BitField(v.name, *place, unbounded=not isinstance(v.type, Int))
    return fields, len(used)
