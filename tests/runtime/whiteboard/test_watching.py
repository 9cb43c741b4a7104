"""What another process sees of a run is what the verifier has reached, and nothing that lies between two frames."""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import closing

import pytest

import llfsm_verify as lv
from llfsm_verify.arrangement.loader import load_arrangement
from llfsm_verify.runtime.live.generations import GENERATIONS, NEWEST, stride
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.live.plan import drawn_choices, starting_values
from llfsm_verify.runtime.live.run import Run
from llfsm_verify.runtime.live.slots import Slot, slots_of
from llfsm_verify.runtime.whiteboard.segment import Segment
from llfsm_verify.runtime.whiteboard.shared import Shared
from tests.quick import FRESH
from tests.runtime.live.runs import code_of

LIGHTS = "models/traffic_lights/arrangement.yaml"
NAMES = ("ns_turn", "ew_turn", "ns_light", "ew_light", "timer", "ns", "ew")
Combination = tuple[object, ...]


def reachable() -> set[Combination]:
    """What the exported structure has where a cycle has ended."""
    structure = lv.load(LIGHTS).explore()
    assert structure.complete
    found = set()
    for number in range(len(structure)):
        values = structure.values(number)
        if values["main.$turn"] == "timer":
            found.add(tuple(values.get(name, values.get(f"{name}.$state")) for name in NAMES))
    return found


def watched(descriptor: int, reads: int, how: str, words: list[int]) -> tuple[int, list[list[int]]]:
    """What the other process saw of these words."""
    place = f"/proc/{os.getpid()}/fd/{descriptor}"
    command = [sys.executable, "-m", "tests.runtime.whiteboard.watching", place, str(reads), how, *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    frames, seen = json.loads(done.stdout)
    return frames, seen


def of_the_lights(reads: int, how: str) -> tuple[int, set[Combination]]:
    code = code_of(load_arrangement(LIGHTS))
    slots: Mapping[str, Slot] = {slot.name: slot for slot in slots_of(code)}
    wanted = [slots[name] for name in NAMES]
    words = [slot.word for slot in wanted]
    drawn = drawn_choices(code.program, {})
    loop = Loop(code, seed=3, drawn=drawn, held=starting_values(code.program))
    with closing(Shared("watched", loop)) as shared:
        run = Run(loop)
        run.start()
        try:
            frames, seen = watched(shared.segment.descriptor, reads, how, words)
        finally:
            run.stop()
            run.wait()
    found = set()
    for values in seen:
        combination = []
        for slot, value in zip(wanted, values, strict=True):
            frame = [0] * code.frames.words
            frame[slot.word] = value
            combination.append(slot.value(frame))
        found.add(tuple(combination))
    return frames, found


def see_what_is_reachable(reads: int) -> tuple[int, int]:
    frames, seen = of_the_lights(reads, "frames")
    allowed = reachable()
    assert seen <= allowed
    assert frames == reads and len(seen) > len(allowed) // 2, "the run is random and long"
    return frames, len(seen)


@pytest.mark.long
def test_frames_show_what_is_reachable() -> None:
    see_what_is_reachable(10_000_000 if FRESH else 300_000)


@pytest.mark.long
def test_a_reader_of_one_slot_after_the_other_is_caught() -> None:
    """The same comparison, of a reader that does not read whole frames."""
    _, seen = of_the_lights(1_000, "words")
    assert seen - reachable()


@pytest.mark.slow
def test_a_writer_without_stamps_is_caught() -> None:
    """Frames of all ones and of all twos, written over each other where the newest frame is."""
    words = 64
    with closing(Segment("torn", words)) as segment:
        segment.publish([1] * words)
        generation = segment.address + 8 * (64 + (1 % GENERATIONS) * stride(words))
        frame = (ctypes.c_int64 * words).from_address(generation + 8)
        newest = ctypes.c_int64.from_address(segment.address + 8 * NEWEST)
        assert newest.value == 1 and list(frame) == [1] * words
        place = f"/proc/{os.getpid()}/fd/{segment.descriptor}"
        parts = [str(word) for word in range(1, words)]
        command = [sys.executable, "-m", "tests.runtime.whiteboard.watching", place, "2", "mixed", *parts]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as watcher:
            while watcher.poll() is None:
                for value in (2, 1):
                    for word in range(1, words):
                        frame[word] = value
            assert watcher.stdout is not None
            assert watcher.returncode == 0
            _, seen = json.loads(watcher.stdout.read())
    assert any(len(set(values)) > 1 for values in seen), "a frame of ones and twos"
    assert all(set(values) <= {1, 2} for values in seen)
