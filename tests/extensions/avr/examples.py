"""Commands that make the program say what is wrong with an image for a microcontroller."""

from __future__ import annotations

from tests.outputs.provoking import BUILD, LAMP, Provoked

AVR = BUILD.replace("none", "avr")
PROVOKED = {
    "E506": Provoked((f"{AVR} --pins pins.yaml",), LAMP | {"pins.yaml": "pins: {go: PB9}\n"}),
    "E507": Provoked((f"{AVR} --clock-hz 4000",), LAMP),
}
