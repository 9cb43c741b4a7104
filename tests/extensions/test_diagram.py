"""Timing diagrams: nothing overlaps, ticks are round, what matters is marked, and a value has its colour."""

from __future__ import annotations

import io
import random
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from itertools import combinations, pairwise
from typing import Any
from xml.etree import ElementTree as ET

import pytest

from llfsm_verify.extensions.timelines.diagram import LETTER, write_svg
from llfsm_verify.extensions.view.colours import colour_of
from llfsm_verify.program.program import BOOL, Int
from llfsm_verify.runtime.recording.timeline import Row, Signal, Timeline
from llfsm_verify.values import Shown

SVG = "{http://www.w3.org/2000/svg}"
LONG = "a_very_long_name_that_has_no_end_" * 5


def picture(timeline: Timeline) -> ET.Element:
    file = io.BytesIO()
    write_svg(timeline, file)
    return ET.fromstring(file.getvalue())


def timeline(steps: Iterable[tuple[Shown, ...]], *, cycle_ms: Any = 1000, **more: Any) -> Timeline:
    signals = (
        Signal("light", "state", Int(0, 2), ("RED", "GREEN", "AMBER")),
        Signal("car", "input", BOOL, ()),
        Signal("wait", "machine", Int(-(1 << 62), 1 << 62), ()),
        Signal(LONG, "state", Int(0, 1), (LONG, "<script>")),
    )
    rows = (Row(step, (step + 1) // 2, values) for step, values in enumerate(steps))
    return Timeline("two lights", signals, rows, None if cycle_ms is None else Fraction(cycle_ms), begins=1, **more)


def at_random(steps: int, seed: int) -> list[tuple[Shown, ...]]:
    chance = random.Random(seed)
    labels = ("RED", "GREEN", "AMBER")
    return [
        (chance.choice(labels), chance.random() < 0.5, chance.randrange(1 << 62), chance.choice((LONG, "<script>")))
        for _ in range(steps)
    ]


def texts(root: ET.Element) -> list[tuple[str, float, float, float, str]]:
    """Each with its left, right and baseline, and its class."""
    found = []
    for element in root.iter(f"{SVG}text"):
        words, x = element.text or "", float(element.get("x", ""))
        wide = LETTER * len(words)
        left = x - {"start": 0, "middle": wide / 2, "end": wide}[element.get("text-anchor", "")]
        found.append((words, left, left + wide, float(element.get("y", "")), element.get("class", "")))
    return found


@pytest.mark.parametrize("steps", [1, 2, 7, 60, 400])
@pytest.mark.parametrize("cycle_ms", [None, 1000, Fraction(1, 3)])
def test_nothing_overlaps_or_leaves_the_picture(steps: int, cycle_ms: Any) -> None:
    for seed in range(6):
        end = random.Random(seed).randrange(steps)
        root = picture(timeline(at_random(steps, seed), cycle_ms=cycle_ms, loop=end // 2, failed=end, shows=LONG))
        for one, two in combinations(texts(root), 2):
            beside = one[2] <= two[1] + 0.2 or two[2] <= one[1] + 0.2
            assert beside or abs(one[3] - two[3]) >= 11, (one, two)
        for words, left, right, y, _ in texts(root):
            assert left >= 0 and right <= float(root.get("width", "")) + 1 and y <= float(root.get("height", "")), words


def test_ticks_of_uneven_cycles_do_not_overlap() -> None:
    labels = 0
    for seed in range(40):
        chance = random.Random(seed)
        given = timeline(at_random(80, seed), cycle_ms=Fraction(1234567, 100000))
        cycle, rows = 1, []
        for row in given.rows:
            cycle += chance.random() < (0.9 if row.step % 20 < 6 else 0.1)
            rows.append(row._replace(cycle=cycle))
        ticks = [t for t in texts(picture(replace(given, rows=rows))) if t[0].endswith((" ms", " s"))]
        assert all(one[2] < two[1] for one, two in pairwise(ticks)), ticks
        labels += len(ticks)
    assert labels > 80


def test_ticks_are_round() -> None:
    for cycle_ms, wanted in ((1000, ["0 s", "5 s", "10 s", "15 s"]), (250, ["0 s", "1 s", "2 s", "3 s"])):
        drawn = texts(picture(timeline(at_random(60, 1), cycle_ms=cycle_ms)))
        assert [words for words, *_, kind in drawn if kind == "quiet" and words.endswith(" s")][:4] == wanted
    drawn = texts(picture(timeline(at_random(60, 1), cycle_ms=None)))
    assert [words for words, *_ in drawn if words.startswith("cycle")][:3] == ["cycle 0", "cycle 5", "cycle 10"]


def test_what_matters_is_marked_and_named() -> None:
    drawn = {words: kind for words, *_, kind in texts(picture(timeline(at_random(9, 1), failed=5, shows="safe")))}
    assert drawn["✗ violates safe"] == "bad" and drawn["two lights: safe"] == "title"
    drawn = {words: kind for words, *_, kind in texts(picture(timeline(at_random(9, 1), loop=3)))}
    assert drawn["↻ repeats forever"] == "loop" and not any(words.startswith("✗") for words in drawn)


def test_a_red_is_red() -> None:
    root = picture(timeline([("RED", False, 0, LONG), ("GREEN", True, 1, "<script>"), ("AMBER", True, 2, LONG)]))
    told = {box.findtext(f"{SVG}title", ""): box.get("fill") for box in root.iter(f"{SVG}rect")}
    for name in ("RED", "GREEN", "AMBER"):
        assert told[f"light = {name}"] == colour_of(name)[0]


def test_signals_of_a_group_stand_together() -> None:
    """Also where the states of two machines have signals of others between them."""
    named = [(y, words) for words, _, right, y, _ in texts(picture(timeline(at_random(40, 1)))) if right < 365]
    names = [words for y, words in sorted(named) if y > 60]
    assert [name if len(name) < 20 else "LONG" for name in names] == [
        "states", "light", "LONG", "inputs", "car", "wait", "wait",
    ]  # fmt: skip


def test_exact_values_of_a_curve_are_told() -> None:
    steps = [("RED", False, (1 << 60) + step, LONG) for step in range(40)]
    root = picture(timeline(steps))
    told = [title.text for title in root.iter(f"{SVG}title") if (title.text or "").startswith("wait = ")]
    assert told == [f"wait = {(1 << 60) + step}" for step in range(40)]


def test_many_numbers_are_a_curve_and_few_are_boxes() -> None:
    lines = [len(list(picture(timeline(at_random(n, 1))).iter(f"{SVG}polyline"))) for n in (5, 40)]
    assert lines == [1, 2]
