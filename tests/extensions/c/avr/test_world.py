"""Programs for AVR on a simulated board: pins give inputs and show outputs, as the executor has them."""

from __future__ import annotations

import re
from random import Random

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.extensions.c.avr.chips import CHIPS
from llfsm_verify.extensions.c.target import C99, image_for
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live.plan import starting_values
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted
from llfsm_verify.values import element_names
from tests.cli.running import llfsm
from tests.extensions.c.avr.boards import compiled_board, make, needs_avr, needs_board, played

OVEN = "models/microwave/arrangement.yaml"
PANEL = """
name: panel
cycle_ms: 2
types: {Colour: [RED, GREEN, BLUE]}
whiteboard:
  go: {type: bool, init: false, role: input}
  level: {type: 0..5, init: 0, role: input}
  key: {type: 3..200, init: 7, role: input}
  colour: {type: Colour, init: RED, role: input}
  lamps: {type: {array: bool, size: 2}, init: [false, false], role: output}
  shown: {type: Colour, init: BLUE, role: output, safe: GREEN}
  sum: {type: 0..205, init: 0, role: output, safe: 9}
  quiet: {type: bool, init: false, role: output}
machines:
  m:
    inline:
      machine: M
      states:
        - {name: A, internal: "lamps[0] = go; shown = colour; sum = key + level;", transitions: [{when: go, to: B}]}
        - {name: B, on_entry: "lamps[1] = not lamps[1];", transitions: [{when: not go, to: A}]}
schedule: [m]
"""
PINS = """
pins:
  go: {pin: PD4, active: low, pull_up: true}
  level: [PC0, PC1, PC2]
  key: {uart: 115200}
  colour: {pin: [PD5, PD6], active: low}
  lamps[0]: PB0
  lamps[1]: {pin: PB1, active: low}
  shown: [PB2, PC5]
  sum: {uart: 115200}
"""


def records(program: Program, cycles: list[dict[str, int]]) -> list[dict[str, int]]:
    """The values of variables after each cycle with these inputs held."""
    native, found = NativeProgram(program, effort="quick"), []
    record = native.layout.first()
    for held in cycles:
        ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=held)
        record = ran.record
        values = native.layout.decode_record(record)
        flat: dict[str, int] = {}
        for var in program.vars:
            value = values[var.name]
            flat |= zip(element_names(var), value if isinstance(value, tuple) else (value,), strict=True)
        found.append(flat)
    return found


@needs_board
@pytest.mark.slow
def test_the_microwave_does_at_its_pins_what_the_executor_does(tmp_path):
    arrangement = image_of(load_arrangement(OVEN))
    elf = make(tmp_path, C99.make(arrangement, Wanted("avr", clock_hz=1_000_000)).files)
    random, program = Random(1), image_for(arrangement).program
    cycles = [{"button": random.random() < 0.3, "door_open": random.random() < 0.2} for _ in range(40)]
    cycles += [{"button": False, "door_open": False}] * 190  # the food is ready
    lines = [f"D2={int(not c['button'])} D3={int(not c['door_open'])}" for c in cycles]
    found = played(compiled_board(tmp_path), elf, lines, 1_000_000)
    wanted = [v["motor"] | v["lamp"] << 1 | v["sound"] << 2 for v in records(program, cycles)]
    assert len(set(wanted)) > 3
    assert [int(f["B"].split("/")[0], 16) for f in found] == wanted
    assert {f["B"].split("/")[1] for f in found} == {"07"}
    assert {f["D"] for f in found} == {"0c/00"}


@needs_board
@pytest.mark.slow
def test_pins_have_bits_and_levels_and_a_serial_port_has_bytes(tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL)
    (tmp_path / "pins.yaml").write_text(PINS)
    arrangement = image_of(load_arrangement(tmp_path / "a.yaml"))
    made = C99.make(arrangement, Wanted("avr"))
    assert "No pin shows quiet." in made.notes
    elf, random, program = make(tmp_path, made.files), Random(2), image_for(arrangement).program
    cycles, lines, held = [], [], dict(starting_values(program))
    for index in range(200):
        go, level, colour, key = (random.randrange(n) for n in (2, 8, 4, 256))
        held |= {"go": go} | ({"level": level} if level < 6 else {}) | ({"colour": colour} if colour < 3 else {})
        held |= {"key": key} if 3 <= key <= 200 and index else {}  # it hears from its beginning
        cycles.append(dict(held))
        bits = f"C0={level & 1} C1={level >> 1 & 1} C2={level >> 2} D5={1 - (colour & 1)} D6={1 - (colour >> 1)}"
        lines.append(f"D4={1 - go} {bits} u={key:x}")
    found = played(compiled_board(tmp_path), elf, lines, 32_000)
    wanted, sent = records(program, cycles), 0
    for index, (shown, value) in enumerate(zip(found, wanted, strict=True)):
        port_b = value["lamps[0]"] | 1 - value["lamps[1]"] << 1 | (value["shown"] & 1) << 2
        assert int(shown["B"][:2], 16) == port_b, index
        assert int(shown["C"][:2], 16) >> 5 == value["shown"] >> 1
        assert shown["D"] == "10/00"
        if index == 0:  # the first byte is still on its way when the first cycle ends
            assert shown["u"] == "0"
            continue
        assert int(shown["u"]) == (value["sum"] if value["sum"] != sent else -1)
        sent = value["sum"]


@needs_board
@pytest.mark.slow
def test_after_a_fault_outputs_have_safe_values_and_stay(tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL.replace("key + level", "key + level + 10"))
    (tmp_path / "pins.yaml").write_text(PINS)
    elf = make(tmp_path, C99.make(image_of(load_arrangement(tmp_path / "a.yaml")), Wanted("avr")).files)
    lines = ["D4=1 D5=1 D6=0 C0=0 C1=0 C2=0 u=1e", "D4=1 u=c8", "D4=0 u=1e"]  # 200 + 10
    found = played(compiled_board(tmp_path), elf, lines, 32_000)
    assert [f["u"] for f in found[:2]] == ["0", "9"]
    assert int(found[1]["B"][:2], 16) >> 2 == 1
    assert found[2:] == [{**found[1], "u": "-1"}]


@needs_board
@pytest.mark.slow
def test_a_safe_value_waits_for_the_serial_port(tmp_path):
    """A byte takes four cycles, and the fault comes in the second."""
    (tmp_path / "a.yaml").write_text(PANEL.replace("key + level", "key + level + 195"))
    (tmp_path / "pins.yaml").write_text(PINS.replace("115200", "1200"))
    elf = make(tmp_path, C99.make(image_of(load_arrangement(tmp_path / "a.yaml")), Wanted("avr")).files)
    lines = ["D4=1 D5=1 D6=0 C0=0 C1=0 C2=0", "C0=1 C2=1", *["D4=1"] * 10]  # 7 + 5 + 195
    found = played(compiled_board(tmp_path), elf, lines, 32_000)
    assert [f["u"] for f in found if f["u"] != "-1"] == ["0", "9"]


@needs_board
@pytest.mark.slow
def test_a_byte_that_came_broken_changes_nothing(tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL)
    (tmp_path / "pins.yaml").write_text(PINS)
    elf = make(tmp_path, C99.make(image_of(load_arrangement(tmp_path / "a.yaml")), Wanted("avr")).files)
    lines = ["D4=1 D5=1 D6=0 C0=0 C1=0 C2=0", "u=1e", "u=8029", "u=8007", "u=32"]
    found = played(compiled_board(tmp_path), elf, lines, 32_000)
    assert [f["u"] for f in found] == ["0", "30", "-1", "-1", "50"]


COUNTER = """
name: counter
cycle_ms: 2
whiteboard: {n: {type: 0..7, init: 0, role: output}}
machines:
  m:
    inline: {machine: M, states: [{name: A, internal: n = (n + 1) % 8;, transitions: [{when: n == 9, to: A}]}]}
schedule: [m]
"""


@needs_board
@pytest.mark.slow
@pytest.mark.parametrize("level", ["high", "low"])
def test_pins_of_an_output_change_at_once(level, tmp_path):
    (tmp_path / "a.yaml").write_text(COUNTER)
    (tmp_path / "pins.yaml").write_text(f"pins:\n  n: {{pin: [PB1, PB2, PB3], active: {level}}}\n")
    elf = make(tmp_path, C99.make(image_of(load_arrangement(tmp_path / "a.yaml")), Wanted("avr")).files)
    found = played(compiled_board(tmp_path), elf, [""] * 20, 32_000, log=True)
    codes = [(n % 8 if level == "high" else 7 - n % 8) << 1 for n in range(2, 21)]
    assert [f["all"] for f in found[1:]] == [f"{code:02x}" for code in codes]


@needs_board
@pytest.mark.slow
@pytest.mark.parametrize("stops", [False, True])
def test_late_cycles_are_left_out_or_end_it(stops, tmp_path):
    """Here, a cycle of the microwave takes more than 1,000 steps of the CPU, and another begins after 500."""
    arrangement = image_of(load_arrangement(OVEN))
    files = dict(C99.make(arrangement, Wanted("avr", clock_hz=500)).files)
    source = files["microwave.c"]
    files["microwave.c"] = re.sub(r"(_step\(.*\)\n\{)", r"\1 __builtin_avr_delay_cycles(250);", source)
    assert files["microwave.c"] != source
    elf = make(tmp_path, files, "-Werror -DSTOP_WHEN_LATE=1" if stops else "-Werror")
    found = played(compiled_board(tmp_path), elf, ["D2=1 D3=0"] * 30, 500)  # the door is open
    assert [f["B"] for f in found[-3:]] == ["00/07" if stops else "02/07"] * 3


@needs_board
@pytest.mark.slow
def test_a_violated_property_ends_it_with_safe_values(tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL)
    (tmp_path / "pins.yaml").write_text(PINS)
    made = tmp_path / "made"
    rule = "low: G (sum < 100)"
    done = llfsm("build", str(tmp_path / "a.yaml"), "--target", "c", "--for", "avr", "-o", str(made), "-p", rule)
    assert done.returncode == 0, done.stderr
    elf = make(made, {})
    lines = ["D4=1 D5=1 D6=0 C0=0 C1=0 C2=0", "u=63", "u=64", "u=1e"]
    found = played(compiled_board(tmp_path), elf, lines, 32_000)
    assert [f["u"] for f in found] == ["0", "99", "9", "-1"]
    assert "violated" in (made / "README.md").read_text()


@needs_avr
@pytest.mark.slow
@pytest.mark.parametrize("mcu", CHIPS)
def test_programs_compile_for_every_microcontroller_without_a_warning(mcu, tmp_path):
    (tmp_path / "a.yaml").write_text(PANEL)
    (tmp_path / "pins.yaml").write_text(PINS)
    make(tmp_path, C99.make(image_of(load_arrangement(tmp_path / "a.yaml")), Wanted("avr", mcu=mcu)).files)
