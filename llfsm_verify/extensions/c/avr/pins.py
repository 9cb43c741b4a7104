"""Tables of pins: which pin of a microcontroller gives an input, or shows an output."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.avr.chips import Chip
from llfsm_verify.extensions.c.avr.codes import WRONG_PINS
from llfsm_verify.plug import (
    Int,
    MappingNode,
    Node,
    Report,
    Scalar,
    Sequence,
    Span,
    Type,
    compose,
    did_you_mean,
    mark,
    read_source,
)

BAUDS = ("1200", "2400", "4800", "9600", "19200", "38400", "57600", "115200")


@dataclass(frozen=True, slots=True)
class Wire:
    """What gives an input or shows an output: pins, the lowest bit first, or the serial port at `baud`."""

    pins: tuple[str, ...] = ()
    low: bool = False
    """Whether a low pin is a 1."""
    pull_up: bool = False
    baud: int = 0

    def __str__(self) -> str:
        if self.baud:
            return f"the serial port, {self.baud} baud"
        return ", ".join(self.pins) + ", low is 1" * self.low + ", with its pull-up" * self.pull_up


@dataclass(frozen=True, slots=True)
class Wanted:
    """Something that can be wired: an input, or an element of an output."""

    type: Type
    input: bool


def read_pins(path: str, chip: Chip, wanted: Mapping[str, Wanted]) -> dict[str, Wire]:
    """The wires in a file, by name. All inputs have one.

    DiagnosticError: what any YAML file can have (E001 to E018, E030 to E036), and what does not fit (E506).
    """
    source, _ = read_source(path)
    reader = _Reader(chip, wanted)
    found = reader.file(compose(source, reader.report.diagnostics))
    if reader.report.diagnostics:
        raise DiagnosticError(sorted(reader.report.diagnostics, key=lambda d: d.span.start if d.span else 0)[:50])
    return found


def suggested(chip: Chip, wanted: Mapping[str, Wanted]) -> str:
    """A table, for who has none: the first of two wide values goes over the serial port, what has no room is left."""
    free, serial, rows = [pin for pin in chip.pins if pin not in chip.serial], {True, False}, []
    for name, what in wanted.items():
        bits = _bits(what.type)
        if 3 < bits <= 8 and what.input in serial:
            serial.remove(what.input)
            place = "{uart: 9600}"
        elif bits > len(free):
            continue
        else:
            pins, free = free[:bits], free[bits:]
            place = pins[0] if bits == 1 else f"[{', '.join(pins)}]"
        rows.append(f"{json.dumps(name) if '[' in name else name}: {place}")
    return ", ".join(rows)


def _bits(kind: Type) -> int:
    """How many pins show all values of a type."""
    return max(1, kind.high.bit_length()) if isinstance(kind, Int) and kind.low >= 0 else 64


class _Reader:
    def __init__(self, chip: Chip, wanted: Mapping[str, Wanted]) -> None:
        self.report = Report()
        self._chip = chip
        self._wanted = wanted
        self._taken: dict[str, str] = {}
        self._baud = ""

    def file(self, root: Node) -> dict[str, Wire]:
        report, wires = self.report, dict[str, Wire]()
        if not report.can_read(root, "the table of pins"):
            return wires
        fields = report.fields(root, "a table of pins", ("format", "pins"), ("pins",))
        mapping = None if fields is None else report.mapping(fields["pins"], "`pins`")
        if mapping is None:
            return wires
        report.distinct(key for key, _ in mapping.items)
        for key, node in mapping.items:
            what = self._wanted.get(key.text)
            if what is None:
                hint = did_you_mean(key.text, self._wanted) or f"there are: {', '.join(self._wanted)}"
                self._wrong(f"there is no input or output `{key.text[:60]}`", mark(key), hint)
                continue
            wires[key.text] = self._wire(key.text, what, node)
        for name, what in self._wanted.items():
            if what.input and name not in wires:
                free = next((p for p in self._chip.pins if p not in self._taken), "PB0")
                self._wrong(f"the input `{name}` has no pin", mark(mapping), f"write `{name}: {free}`")
        return wires

    def _wrong(self, message: str, span: Span, hint: str) -> None:
        self.report.diagnostics.append(Diagnostic(WRONG_PINS, message, span, hint=hint))

    def _wire(self, name: str, what: Wanted, node: Node) -> Wire:
        report, fields = self.report, dict[str, Node]()
        at = node
        if isinstance(node, MappingNode):
            known = ("pin", "uart", "active", "pull_up") if what.input else ("pin", "uart", "active")
            fields = report.fields(node, f"the wire of `{name}`", known) or {}
            if len({"pin", "uart"} & set(fields)) != 1:
                self._wrong(f"`{name}` needs a pin or the serial port", mark(node), "write `pin: PB0` or `uart: 9600`")
                return Wire()
            at = fields.get("pin") or fields["uart"]
        if "uart" in fields:
            for key in ("active", "pull_up"):
                if key in fields:
                    self._wrong(f"`{key}` is for pins", mark(fields[key]), "leave it out")
            return self._serial(name, what, at)
        low = report.choice(fields.get("active"), "`active`", ("high", "low"), "high") == "low"
        pull_up = report.choice(fields.get("pull_up"), "`pull_up`", ("true", "false"), "false") == "true"
        pins = tuple(self._pins(name, at))
        bits = _bits(what.type)
        if len(pins) != bits:
            values = f"{what.type.low}..{what.type.high}" if isinstance(what.type, Int) else "int"
            need = "no number of pins has negative values" if bits == 64 else f"it needs {bits}"
            hint = "give it as many pins as it has bits, the lowest first" if bits < 64 else "use a range from 0"
            self._wrong(
                f"`{name}` of {values} does not fit {len(pins)} pin{'s' * (len(pins) != 1)}: {need}", mark(at), hint
            )
        return Wire(pins, low, pull_up)

    def _pins(self, name: str, at: Node) -> Iterator[str]:
        for node in at.items if isinstance(at, Sequence) else (at,):
            scalar = self.report.scalar(node, f"a pin of `{name}`")
            if scalar is None:
                continue
            pin = scalar.text
            if pin not in self._chip.pins:
                ports = ", ".join(f"P{port}{bits[0]} to P{port}{bits[-1]}" for port, bits in self._chip.ports.items())
                self._wrong(f"the {self._chip.name} has no pin `{pin[:40]}`", mark(node), f"there are: {ports}")
            self._take(pin, name, scalar)
            yield pin

    def _take(self, pin: str, name: str, at: Scalar) -> None:
        if pin in self._taken:
            self._wrong(f"`{pin}` is the pin of `{self._taken[pin]}` already", mark(at), "name another pin")
        self._taken.setdefault(pin, name)

    def _serial(self, name: str, what: Wanted, at: Node) -> Wire:
        baud = self.report.choice(at, "`uart`", BAUDS, "9600")
        if self._baud and baud != self._baud:
            self._wrong(f"the serial port has {self._baud} baud already", mark(at), f"write `uart: {self._baud}`")
        self._baud = baud
        if not isinstance(what.type, Int) or what.type.low < 0 or what.type.high > 255:
            self._wrong(f"`{name}` does not fit in the byte of a serial port", mark(at), "use a range within 0..255")
        pin = self._chip.serial[0 if what.input else 1]
        if isinstance(at, Scalar):
            self._take(pin, name, at)
        return Wire(baud=int(baud))
