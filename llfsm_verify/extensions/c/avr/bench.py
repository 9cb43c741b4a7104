"""Images verified on simavr: what they take of a microcontroller, and how long a call takes there."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib import resources

from llfsm_verify.extensions.c.avr.chips import Chip, chip_of
from llfsm_verify.extensions.c.image import Image
from llfsm_verify.extensions.c.verifying.run import Bench, Ran
from llfsm_verify.plug import Made, TargetWanted

FLAGS = (
    "-std=c99", "-Os", "-ffunction-sections", "-Wl,--gc-sections", "-mrelax", "-mcall-prologues", "-fshort-enums",
    "-Wall", "-Wextra", "-Wconversion",
)  # fmt: skip
"""How it is compiled."""
OF_HARNESS, MOST_IN_ARRAY = 6000, 30_000
"""Bytes of flash for the image and its harness, and for vectors."""
PACKAGES = {"avr-gcc": "gcc-avr and avr-libc", "avr-size": "binutils-avr"}


@dataclass(frozen=True, slots=True, kw_only=True)
class AvrBench(Bench):
    """avr-gcc and simavr. An image tells its largest call in CPU cycles, and the bytes of its deepest stack."""

    chip: Chip
    clock_hz: int

    def costs(self, image: Image, made: Made, found: Mapping[str, tuple[Ran, bool]]) -> Iterator[str]:
        """See `Bench`."""
        flash, ram = self.sizes(made.files)
        told = {unit: (*ran.costs, 0, 0)[:2] for unit, (ran, _) in found.items()}  # without a step it tells nothing
        deepest = max(stack for _, stack in told.values())
        yield (
            f"Flash: {flash} of {self.chip.flash} bytes. RAM: {ram} of {self.chip.ram} bytes, and {deepest} of stack "
            f"in a call."
        )
        for unit, (_, every) in found.items():
            cycles, _ = told[unit]
            took = cycles * 1000 / self.clock_hz
            text = f"{'Worst' if every else 'Largest measured'} {unit}: {cycles} CPU cycles, {took:.3g} ms"
            yield text + (f" of {float(image.program.period or 0):g} ms." if unit == "cycle" else ".")

    def sizes(self, files: Mapping[str, str]) -> tuple[int, int]:
        """Bytes of flash and of RAM that a whole program takes, without its stack."""
        told = self.told_of(files, "avr-size").splitlines()[-1].split()
        code, data, zeros = (int(word) for word in told[:3])
        return code + data, data + zeros


def bench(wanted: TargetWanted) -> AvrBench:
    """See `World`. DiagnosticError (E507): nothing is known of the microcontroller."""
    chip, clock = chip_of(wanted.mcu), wanted.clock_hz
    return AvrBench(
        name=f"simavr ({chip.name})",
        compiler=("avr-gcc", *FLAGS, f"-mmcu={chip.name}", f"-DF_CPU={clock}UL"),
        emulator=("simavr", "-m", chip.name, "-f", str(clock)),
        board=resources.files(__package__).joinpath("bench.c").read_text(encoding="utf-8"),
        budget=max(1, min(chip.flash - OF_HARNESS, MOST_IN_ARRAY)),
        packages=PACKAGES,
        chip=chip,
        clock_hz=clock,
    )
