"""`--for avr`: a program around an image, with inputs and outputs at pins."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from importlib import resources
from pathlib import Path

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.avr.bench import FLAGS, bench
from llfsm_verify.extensions.c.avr.chips import PRESCALERS, Chip, Tick, chip_of, tick_of
from llfsm_verify.extensions.c.avr.codes import WRONG_PINS, WRONG_TICK
from llfsm_verify.extensions.c.avr.pins import Wanted as Wired
from llfsm_verify.extensions.c.avr.pins import Wire, read_pins, suggested
from llfsm_verify.extensions.c.blocks import comment, titled
from llfsm_verify.extensions.c.image import MARK, Image
from llfsm_verify.extensions.c.names import Field
from llfsm_verify.extensions.c.numbers import stored_as, written
from llfsm_verify.extensions.c.worlds import World
from llfsm_verify.plug import OPERATOR, Choice, Int, Made, element_names
from llfsm_verify.plug import TargetWanted as Wanted


def avr(image: Image, wanted: Wanted, /) -> Made:
    """See `World`. DiagnosticError: what `read_pins` finds, no table of pins (E506), and E507."""
    chip = chip_of(wanted.mcu)
    assert image.program.period is not None
    timer = tick_of(chip, image.program.period, wanted.clock_hz)
    inputs = {c.name: c for c in image.program.choices if not c.name.startswith(OPERATOR)}
    outputs = outputs_of(image)
    things = {name: Wired(c.type, True) for name, c in inputs.items()}
    things |= {name: Wired(field.var.type, False) for name, (field, _) in outputs.items()}
    path = wanted.pins or str(Path(image.meaning.source).parent / "pins.yaml")
    if wanted.pins is None and not Path(path).is_file():
        message = f"nothing says which pins inputs and outputs have: there is no {path}"
        hint = f"write one, or name it with --pins, such as `pins: {{{suggested(chip, things)}}}`"
        raise DiagnosticError(Diagnostic(WRONG_PINS, message, hint=hint))
    wires = read_pins(path, chip, things)
    p = image.prefix
    main = _Main(image, chip, wires, wanted.clock_hz).text(inputs, outputs, timer)
    notes = [f"Pins: {path}.", told(chip, wanted.clock_hz, timer)]
    bare = [name for name, thing in things.items() if not thing.input and name not in wires]
    notes += [f"No pin shows {', '.join(bare)}."] if bare else []
    files = {
        f"{p}_main.c": main,
        "Makefile": makefile(image, chip, wanted.clock_hz),
        "README.md": readme(image, chip, wires, wanted.clock_hz),
    }
    return Made(files, (*notes, "Compile it there: make"))


AVR = World(avr, bench)


def told(chip: Chip, clock_hz: int, timer: Tick) -> str:
    """What the timer does."""
    text = f"Timer 1 of the {chip.name} at {clock_hz} Hz: prescaler {timer.prescaler}, {timer.counts} counts, "
    text += f"{timer.interrupts} interrupt{'s' * (timer.interrupts > 1)} a cycle"
    return text + (f", {float(timer.error * 1_000_000):+.1f} millionths longer." if timer.error else ".")


def outputs_of(image: Image) -> dict[str, tuple[Field, str]]:
    """The elements of outputs: their variable and their place in the state."""
    found = {}
    for field in image.names.fields.values():
        for at, name in enumerate(element_names(field.var) if field.group == "outputs" else ()):
            found[name] = (field, f"state->{field.path}" + ("" if field.var.length is None else f"[{at}]"))
    return found


class _Main:
    """Writes NAME_main.c."""

    def __init__(self, image: Image, chip: Chip, wires: Mapping[str, Wire], clock_hz: int) -> None:
        self._image, self._chip, self._wires = image, chip, wires
        self._clock_hz = clock_hz

    def text(self, inputs: Mapping[str, Choice], outputs: Mapping[str, tuple[Field, str]], timer: Tick) -> str:
        text = resources.files(__package__).joinpath("main.c").read_text(encoding="utf-8")
        monitored = self._image.monitors is not None
        for mark, there in (("monitors", monitored), ("plain", not monitored)):
            text = re.sub(rf"^@{mark} (.*\n)", r"\1" if there else "", text, flags=re.MULTILINE)
        parts = {
            "TICK": self._tick(timer.interrupts),
            "READ": [*self._read(inputs)] or ["(void)inputs;"],
            "WRITE": [*self._write(outputs)] or ["(void)state;"],
            "LAST": [*self._last(outputs)] or ["(void)state;"],
            "SERIAL": [*self._serial(inputs, outputs)],
            "PINS": [*self._pins(inputs, outputs)],
        }
        for name, lines in parts.items():
            text = text.replace(f"@{name}@\n", "".join(f"    {line}\n" for line in lines))
        text = text.replace("@COUNTS@", str(timer.counts)).replace("@PRESCALER@", PRESCALERS[timer.prescaler])
        text = text.replace("@DIVIDED@", str(timer.prescaler)).replace("NAME", self._image.prefix)
        return f"{comment(titled(self._image.program.name, MARK))}\n{text}"

    def _tick(self, interrupts: int) -> list[str]:
        count = ["if (due < UINT8_MAX) {", "    due++;", "}"]
        if interrupts == 1:
            return count
        inside = ["count = 0;", *count]
        kind = "uint8_t" if interrupts < 1 << 8 else "uint16_t"
        return [f"static {kind} count;", f"if (++count == {interrupts}U) {{", *(f"    {x}" for x in inside), "}"]

    def _read(self, inputs: Mapping[str, Choice]) -> Iterator[str]:
        ports = {pin[1] for name in inputs for pin in self._wires[name].pins}
        for port in sorted(ports):  # all pins of a port at once
            yield f"const uint8_t pin{port.lower()} = PIN{port};"
        for name, choice in inputs.items():
            wire, place = self._wires[name], f"inputs->{self._image.names.inputs[name]}"
            kind = stored_as(choice.type)
            if wire.baud:
                yield from ("uint8_t status;", "while (((status = UCSR0A) & _BV(RXC0)) != 0) {")
                yield "    const uint8_t byte = UDR0;"
                broken = "one that came broken, or after a lost one, changes nothing"
                yield f"    if ((status & (_BV(FE0) | _BV(DOR0) | _BV(UPE0))) == 0) {{ {comment(broken)}"
                yield from (f"        {line}" for line in _held(place, choice.type, "byte", 255))
                yield from ("    }", "}")
            elif choice.type.boolean:
                yield f"{place} = {_bit(wire.pins[0], wire.low)};"
            else:
                made = self._image.names.inputs[name]
                yield "{"
                yield f"    {kind} value = 0;"
                for number, pin in enumerate(wire.pins):
                    yield f"    if ({_bit(pin, wire.low)}) {{"
                    yield f"        value = ({kind})(value | ({kind})1 << {number});"
                    yield "    }"
                yield from (f"    {x}" for x in _held(place, choice.type, "value", (1 << len(wire.pins)) - 1))
                yield f"}} {comment(made)}"

    def _write(self, outputs: Mapping[str, tuple[Field, str]]) -> Iterator[str]:
        shown = {name: what for name, what in outputs.items() if name in self._wires}
        ports: dict[str, list[str]] = {}
        for wire in (self._wires[name] for name in shown):
            for pin in wire.pins:
                ports.setdefault(pin[1], []).append(pin[2])
        if ports:
            yield "const uint8_t interrupts = SREG;"
        for port in sorted(ports):
            yield f"uint8_t port{port.lower()} = 0;"
        for name, (field, place) in shown.items():
            wire = self._wires[name]
            if wire.baud:
                value = f"(uint8_t){place}"
                yield "static uint8_t sent;"
                yield "static bool begun;"
                yield f"if ((!begun || sent != {value}) && (UCSR0A & _BV(UDRE0)) != 0) {{"
                yield from (f"    {x}" for x in (f"sent = {value};", "begun = true;", "UDR0 = sent;"))
                yield "}"
                continue
            boolean = isinstance(field.var.type, Int) and field.var.type.boolean
            for number, pin in enumerate(wire.pins):
                condition = place if boolean else f"({place} & {written(1 << number, field.type)}) != 0"
                condition = (f"!{place}" if boolean else condition.replace("!=", "==")) if wire.low else condition
                made = f"port{pin[1].lower()}"
                yield from (f"if ({condition}) {{", f"    {made} = (uint8_t)({made} | _BV({pin[2]}));", "}")
        if ports:
            yield "cli(); /* no code of several pins is in between, and no handler of an interrupt */"
            for port, bits in sorted(ports.items()):
                mask = " | ".join(f"_BV({bit})" for bit in bits)
                yield f"PORT{port} = (uint8_t)((PORT{port} & ~({mask})) | port{port.lower()});"
            yield "SREG = interrupts;"

    def _last(self, outputs: Mapping[str, object]) -> Iterator[str]:
        """What sends the safe value of an output at the serial port, once that has room."""
        for wire in (self._wires[name] for name in outputs if name in self._wires):
            if wire.baud:
                tries = -(-10 * self._clock_hz // wire.baud)
                yield f"uint32_t tries = {tries}U; {comment('each takes several steps of the CPU, a byte fewer')}"
                yield "while ((UCSR0A & _BV(UDRE0)) == 0 && tries > 0) {"
                yield from ("    tries--;", "}", "write_outputs(state);")

    def _pins(self, inputs: Mapping[str, Choice], outputs: Mapping[str, object]) -> Iterator[str]:
        wires = self._wires
        pulled = [pin for name in inputs if wires[name].pull_up for pin in wires[name].pins]
        shown = [pin for name in outputs if name in wires for pin in wires[name].pins]
        for register, pins in (("PORT", pulled), ("DDR", shown)):
            for port in sorted({pin[1] for pin in pins}):
                bits = " | ".join(f"_BV({pin[2]})" for pin in pins if pin[1] == port)
                yield f"{register}{port} = (uint8_t)({register}{port} | {bits});"

    def _serial(self, inputs: Mapping[str, Choice], outputs: Mapping[str, object]) -> Iterator[str]:
        wires = self._wires
        bauds = {name: wires[name].baud for name in (*inputs, *outputs) if name in wires and wires[name].baud}
        if bauds:
            baud = next(iter(bauds.values()))
            divided = round(self._clock_hz / (8 * baud))
            if not 1 <= divided <= 4096 or abs(self._clock_hz / (8 * divided * baud) - 1) > 0.025:
                message = f"the serial port cannot make {baud} baud of {self._clock_hz} Hz"
                raise DiagnosticError(Diagnostic(WRONG_TICK, message, hint="write a lower `uart:`"))
            enabled = [("RXEN0" if name in inputs else "TXEN0") for name in bauds]
            yield f"UBRR0 = {divided - 1}U; {comment(f'{baud} baud')}"
            yield "UCSR0A = _BV(U2X0);"
            yield f"UCSR0B = (uint8_t)({' | '.join(f'_BV({bit})' for bit in enabled)});"


def _bit(pin: str, low: bool) -> str:
    return f"(pin{pin[1].lower()} & _BV({pin[2]})) {'==' if low else '!='} 0"


def _held(place: str, kind: Int, value: str, most: int) -> Sequence[str]:
    """Lines that take a value where the input has it; it keeps the last one otherwise."""
    tests = [f"{value} >= {kind.low}U"] * (kind.low > 0) + [f"{value} <= {kind.high}U"] * (kind.high < most)
    line = f"{place} = ({stored_as(kind)}){value};"
    line = line.replace(f"({stored_as(kind)}){value}", f"{value} != 0") if kind.boolean else line
    return [f"if ({' && '.join(tests)}) {{", f"    {line}", "}"] if tests else [line]


def makefile(image: Image, chip: Chip, clock_hz: int) -> str:
    """The Makefile."""
    prefix = image.prefix
    monitors = "" if image.monitors is None else f" {prefix}_monitors"
    sources = f"{prefix}.c {prefix}_main.c{monitors}{'.c' * bool(monitors)}"
    headers = f"{prefix}.h{monitors}{'.h' * bool(monitors)}"
    return f"""# {prefix}. {MARK}
MCU = {chip.name}
F_CPU = {clock_hz}
CC = avr-gcc
CFLAGS = {" ".join(FLAGS)}
EXTRA =
PROGRAMMER = arduino

all: {prefix}.hex
\tavr-size {prefix}.elf

{prefix}.elf: {sources} {headers}
\t$(CC) $(CFLAGS) $(EXTRA) -mmcu=$(MCU) -DF_CPU=$(F_CPU)UL {sources} -o $@

{prefix}.hex: {prefix}.elf
\tavr-objcopy -O ihex -R .eeprom $< $@

flash: {prefix}.hex
\tavrdude -c $(PROGRAMMER) -p $(MCU) -U flash:w:$<

clean:
\trm -f {prefix}.elf {prefix}.hex

.PHONY: all flash clean
"""


def readme(image: Image, chip: Chip, wires: Mapping[str, Wire], clock_hz: int) -> str:
    """How to compile and to use it."""
    watched = "" if image.monitors is None else " It is the same where a property is violated."
    rows = "\n".join(f"| `{name}` | {wire} |" for name, wire in wires.items())
    return f"""# {titled(image.program.name, MARK)}

    make
    make flash PROGRAMMER=usbasp
    simavr -m {chip.name} -f {clock_hz} {image.prefix}.elf

Timer 1 begins a cycle each {float(image.program.period or 0):g} ms: pins are read once, all ringlets of the cycle run,
and outputs are written. Pins that show no value of an input leave it unchanged. Where a whole period has passed before
a cycle begins, the cycles that should have begun meanwhile are left out; with `make EXTRA=-DSTOP_WHEN_LATE=1` outputs
get their safe values, and nothing runs any more. It is the same after a fault.{watched}
When all machines have finished, outputs stay.

| input or output | pin |
|---|---|
{rows}
"""
