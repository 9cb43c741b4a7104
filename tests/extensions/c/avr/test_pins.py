"""What is said of tables of pins and of timers that do not fit, and where."""

from __future__ import annotations

from fractions import Fraction

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.avr.chips import CHIPS, COUNTS, tick_of
from llfsm_verify.extensions.c.target import C99
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted
from tests.extensions.c.avr.test_world import PANEL, PINS

WRONG = {
    "unknown pin": (("PB0", "PB9"), "7:13", "the atmega328p has no pin `PB9`"),
    "pin of the reset": (("PB0", "PC6"), "7:13", "the atmega328p has no pin `PC6`"),
    "pin used twice": (("PB0", "PD4"), "7:13", "`PD4` is the pin of `go` already"),
    "the same pin for two bits": (("PC1,", "PC0,"), "4:16", "`PC0` is the pin of `level` already"),
    "pin of the serial port": (("PB0", "PD1"), "10:15", "`PD1` is the pin of `lamps[0]` already"),
    "input without a pin": (("  level: [PC0, PC1, PC2]\n", ""), "3:3", "the input `level` has no pin"),
    "too few pins": (("[PC0, PC1, PC2]", "[PC0, PC1]"), "4:10", "`level` of 0..5 does not fit 2 pins: it needs 3"),
    "too many pins": (("lamps[0]: PB0", "lamps[0]: [PB0, PB3]"), "7:13", "`lamps[0]` of 0..1 does not fit 2 pins"),
    "unknown name": (("lamps[0]", "lamps[2]"), "7:3", "there is no input or output `lamps[2]`"),
    "pull-up of an output": (("active: low}\n  shown", "pull_up: true}\n  shown"), "8:24", "has no key `pull_up`"),
    "an unknown word": (("active: low, pull", "active: down, pull"), "3:26", "`active` cannot be `down`"),
    "no pin": (("{pin: [PD5, PD6], active: low}", "{active: low}"), "6:11", "`colour` needs a pin or the serial port"),
    "another speed": (("sum: {uart: 115200}", "sum: {uart: 9600}"), "10:15", "the serial port has 115200 baud"),
    "not a speed": (("key: {uart: 115200}", "key: {uart: 12}"), "5:15", "`uart` cannot be `12`"),
    "a level of the serial port": (
        ("key: {uart: 115200}", "key: {uart: 115200, active: low}"),
        "5:",
        "`active` is for",
    ),
    "no table": ((PINS, "[]"), "1:1", "must be a mapping"),
}


@pytest.fixture
def panel(tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL)
    return image_of(load_arrangement(tmp_path / "a.yaml"))


@pytest.mark.parametrize("name", WRONG)
def test_a_wrong_table_is_told_with_its_place(name, panel, tmp_path):
    (old, new), place, message = WRONG[name]
    assert old in PINS
    (tmp_path / "other.yaml").write_text(PINS.replace(old, new, 1))
    with pytest.raises(DiagnosticError) as told:
        C99.make(panel, Wanted("avr", pins=str(tmp_path / "other.yaml")))
    found = [d for d in told.value.diagnostics if message in d.message]
    assert found, str(told.value)
    assert f"other.yaml:{place}" in str(found[0].span)
    assert found[0].hint


def test_a_serial_port_that_the_clock_cannot_make_is_told(panel, tmp_path):
    (tmp_path / "pins.yaml").write_text(PINS)
    with pytest.raises(DiagnosticError, match="the serial port cannot make 115200 baud of 1000000 Hz"):
        C99.make(panel, Wanted("avr", clock_hz=1_000_000))


def test_who_has_no_table_is_told_one_that_fits(panel, tmp_path):
    with pytest.raises(DiagnosticError) as told:
        C99.make(panel, Wanted("avr"))
    (found,) = told.value.diagnostics
    assert found.code == "E506"
    assert found.hint is not None
    (tmp_path / "pins.yaml").write_text(found.hint.partition("such as `")[2].rstrip("`"))
    assert C99.make(panel, Wanted("avr")).files["panel_main.c"]


@pytest.mark.parametrize(
    ("period", "clock", "why"),
    [
        (Fraction(1, 100), 16_000_000, "too short"), (Fraction(10**12), 16_000_000, "too long"),
        (Fraction(1, 3), 2_000_000, "cannot be made exactly"),
    ],
)  # fmt: skip
def test_a_cycle_that_the_timer_cannot_make_is_told(period, clock, why):
    with pytest.raises(DiagnosticError, match=why) as told:
        tick_of(CHIPS["atmega328p"], period, clock)
    assert told.value.diagnostics[0].code == "E507"


@pytest.mark.parametrize("clock", [1_000_000, 8_000_000, 14_745_600, 16_000_000, 20_000_000])
def test_cycles_last_as_long_as_they_should(clock):
    for period in (Fraction(1), Fraction(5, 2), Fraction(10), Fraction(100), Fraction(1000), Fraction(60_000)):
        tick = tick_of(CHIPS["atmega328p"], period, clock)
        assert 2 <= tick.counts <= COUNTS
        taken = tick.prescaler * tick.counts * tick.interrupts
        assert taken == period * clock / 1000 * (1 + tick.error)
        assert abs(tick.error) < Fraction(1, 10_000)


def test_an_unknown_microcontroller_is_told(panel):
    with pytest.raises(DiagnosticError, match="nothing is known of the microcontroller `atmega329p`") as told:
        C99.make(panel, Wanted("avr", mcu="atmega329p"))
    assert told.value.diagnostics[0].hint == "did you mean `atmega328p` or `atmega1284p` or `atmega88p`?"
