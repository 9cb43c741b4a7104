"""Images verified on simavr: what is equal, what differs, what it costs."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.extensions.c.avr.bench import bench
from llfsm_verify.extensions.c.target import C99, image_for
from llfsm_verify.extensions.c.verifying.vectors import all_steps, drawn
from llfsm_verify.targets.images import image_of
from llfsm_verify.targets.target import Wanted
from tests.extensions.c.avr.boards import needs_avr
from tests.extensions.c.compiled import needs_gcc
from tests.extensions.c.verifying.test_verify import LINES, MUTANTS, NATIVE, OVEN, SMALL, said, texts

HERE = Path(__file__).parent
AVR = bench(Wanted("avr"))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    path = tmp_path_factory.mktemp("small") / "small.yaml"
    path.write_text(SMALL)
    return image_for(image_of(load_arrangement(path)))


@needs_avr
@pytest.mark.slow
def test_an_avr_does_the_same_and_catches_mutants(small):
    header, source = texts(small)
    vectors = all_steps(small.program, "ringlet")
    assert vectors is not None
    ran = AVR.run(small, (header, source), vectors)
    assert (ran.difference, ran.steps) == (None, sum(len(s.inputs) for s in vectors.sequences))
    assert 100 < ran.costs[0] < 3000
    assert 10 < ran.costs[1] < 120
    begins = r"(small_step\(.*\)\n\{)"
    took = {}
    for cycles in (1000, 3000, 200_000):
        late = re.sub(begins, rf"\1 __builtin_avr_delay_cycles({cycles}UL);", source)
        took[cycles] = AVR.run(small, (header, late), vectors).costs[0]
    assert took[3000] - took[1000] == 2000
    assert 0 <= took[200_000] - took[1000] - 199_000 <= 300, "with the interrupts that count beyond 16 bits"
    deep = re.sub(begins, r"\1 volatile uint8_t pad[40]; pad[0] = pad[39] = 1; (void)pad[0];", source)
    assert 40 <= AVR.run(small, (header, deep), vectors).costs[1] - ran.costs[1] <= 60
    for old, new in MUTANTS[:3]:
        assert AVR.run(small, (header, re.sub(old, new, source)), vectors).difference is not None


@needs_avr
@needs_gcc
@pytest.mark.long
def test_the_microwave_is_small_beside_one_that_was_written_by_hand(capsys):
    """Both have the same main; that the one by hand does the same is what vectors tell."""
    arrangement = image_of(load_arrangement(OVEN))
    image, made = image_for(arrangement), C99.make(arrangement, Wanted("avr", optimize="size"))
    vectors = drawn(image.program, "cycle", sequences=20, steps=500)
    hand = tuple((HERE / f"by_hand.{ending}").read_text() for ending in "hc")
    assert NATIVE.run(image, hand, vectors, "outputs").difference is None
    for old, new in (
        ("+ 60", "+ 61"),
        ("> 1)", "> 2)"),
        ("<= 120", "<= 20"),
        ("door_open ? 2 : 1", "1"),
        ("!= 1)", "!= 0)"),
    ):
        assert old in hand[1]
        wrong = hand[1].replace(old, new)
        assert NATIVE.run(image, (hand[0], wrong), vectors, "outputs").difference is not None, old
    ours = AVR.sizes(made.files)
    main = made.files["microwave_main.c"]
    theirs = AVR.sizes({"microwave.h": hand[0], "microwave.c": hand[1], "microwave_main.c": main})
    with capsys.disabled():
        sys.stdout.write(
            f"\nmicrowave: {ours[0]} bytes of flash and {ours[1]} of RAM; by hand {theirs[0]} and {theirs[1]}\n"
        )
    assert theirs[0] < ours[0] < 1.5 * theirs[0]
    assert theirs[1] < ours[1] < 32


@needs_avr
@pytest.mark.long
def test_every_step_of_the_microwave_is_equal_on_an_avr():
    code, out, err = said(OVEN, "--target", "c", "--for", "avr", "--verify")
    assert (code, err) == (0, "")
    assert "Verified on simavr (atmega328p): 50916 ringlets and 20092 cycles, 0 differences." in out
    assert int(re.search(r"Flash: (\d+)", out)[1]) < 2048  # type: ignore[index]
    ram, stack = map(int, re.search(r"RAM: (\d+) .* (\d+) of stack", out).groups())  # type: ignore[union-attr]
    assert ram + stack < 64
    assert int(re.search(r"Worst cycle: (\d+)", out)[1]) < 1000  # type: ignore[index]


@needs_avr
@pytest.mark.slow
def test_the_command_tells_costs_on_an_avr(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(SMALL)
    (tmp_path / "pins.yaml").write_text("pins: {go: PB0}\n")
    code, out, err = said(str(path), "--target", "c", "--for", "avr", "--verify")
    assert (code, err) == (0, "")
    assert re.search(r"^Verified on simavr \(atmega328p\): \d+ ringlets and \d+ cycles, 0 differences\.$", out, LINES)
    assert re.search(r"^Flash: \d+ of 32768 bytes\. RAM: \d+ of 2048 bytes, and \d+ of stack in a call\.$", out, LINES)
    assert re.search(r"^Worst cycle: \d+ CPU cycles, [\d.]+ ms of 1000 ms\.$", out, LINES)
