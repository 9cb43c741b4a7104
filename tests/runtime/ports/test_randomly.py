"""Other sides that say anything in any order, against a model of a few lines of what a run may make of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from random import Random

import pytest

from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.ports.port import AskingPort, Link
from llfsm_verify.values import Shown
from tests.runtime.ports.bench import bench, declared
from tests.runtime.ports.picker import picker

TEXT = """
ports:
  p:
    kind: process
    run: [none]
    inputs: [start, wants]
    events: {start: NONE}
    values: {Hold: PAUSE}
    on_failure: stale
    requests:
      locate: {kind: service, ask: locate, state: locate_state, answers: {fruits: a.n, distance: d}}
"""
EVENTS: dict[Json, str] = {"START": "START", "Hold": "PAUSE", "PAUSE": "PAUSE"}
"""What they mean; nothing else does."""
NUMBERS: list[Json] = [
    *range(10),
    *range(10),
    *range(10),
    "4",
    "7",
    10,
    -1,
    1 << 70,
    "1e999999999",
    True,
    None,
    [1],
    {"n": 1},
    "NaN",
]
FIT = {str(number): number for number in range(10)}


def meant(value: Json) -> int | None:
    return None if isinstance(value, bool) else FIT.get(str(value))


class Anybody(AskingPort):
    """What it has said is in `events` and `answers`: of the first answer to each number, whether it is one, and the
    numbers that come with it, also where the other side says that it has failed."""

    every_frame = False

    def __init__(self, link: Link, random: Random) -> None:
        self.link, self.random, self.asked = link, random, 0
        self.events: list[str] = []
        self.answers: dict[int, tuple[bool, dict[str, int | None]]] = {}

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        del ready, now
        for _ in range(self.random.choice([0, 0, 1, 3])):
            self.random.choice([self.event, self.answer, self.want, self.nonsense])()

    def event(self) -> None:
        said = self.random.choice(["START", "Hold", "PAUSE", "NONSENSE", 3])
        self.link.take({"start": said})
        self.events += [EVENTS[said]] if said in EVENTS else []

    def want(self) -> None:
        self.link.take({"wants": self.random.choice([0, 1, 1, 1])})

    def nonsense(self) -> None:
        self.link.report(self.asked + 5, "DONE", {}, end=True)
        self.link.report(1 + self.random.randrange(max(1, self.asked)), "ACTIVE", {}, end=False)
        self.link.take({"colour": 1})

    def answer(self) -> None:
        number = self.random.choice([self.asked, self.asked, max(1, self.asked - 1)])
        state = self.random.choice(["DONE", "DONE", "DONE", "FAILED", "SUCCEEDED", "odd", ""])
        fruits, distance = (self.random.choice(NUMBERS) for _ in range(2))
        values: dict[str, Json] = {"a": {"n": fruits}, "d": distance}
        if self.random.random() < 0.2:
            del values[self.random.choice(["a", "d"])]
        self.link.report(number, state, values, end=True)
        found = {name: meant(value) for name, value, key in (("fruits", fruits, "a"), ("distance", distance, "d"))
                 if key in values}  # fmt: skip
        fits = None not in found.values() and (len(found) == 2 if state == "DONE" else state == "FAILED")
        if 0 < number <= self.asked:
            self.answers.setdefault(number, (fits and state == "DONE", found if fits else {}))

    def ask(self, number: int, name: str, values: Mapping[str, Shown]) -> None:
        assert (number, name, values) == (self.asked + 1, "locate", {})
        self.asked = number

    def cancel(self, number: int) -> None:
        assert number == self.asked

    def safe(self, values: Mapping[str, Shown]) -> None: ...

    def end(self, ending: str) -> None: ...


@pytest.mark.parametrize("seed", range(8))
def test_only_what_fits_is_taken_all_of_it_once_and_in_order(seed: int, tmp_path: Path) -> None:
    sides: list[Anybody] = []

    def start(link: Link) -> Anybody:
        sides.append(Anybody(link, Random(seed)))
        return sides[0]

    (spec,) = declared(TEXT, tmp_path, picker())
    with bench(replace(spec, start=start), code=picker()) as made:
        (side,) = sides
        had: list[object] = []
        ends = {"DONE": 0, "FAILED": 0, "IDLE": 0}
        before, held = "IDLE", {"fruits": 0, "distance": 9}
        for _ in range(1000):
            made.turn()
            had.append(made.value("now"))
            state = str(made.value("locate_state"))
            if before == "WAITING" and state != "WAITING":
                ends[state] += 1
                if state != "IDLE":  # which it becomes where it is not wanted any more
                    done, numbers = side.answers[side.asked]
                    assert done == (state == "DONE")
                    held |= numbers  # type: ignore[arg-type]
            assert {name: made.value(name) for name in held} == held
            before = state
        side.serve = lambda ready, now: None  # type: ignore[method-assign]
        while len([one for one in had if one != "NONE"]) < len(side.events):
            made.turn()
            had.append(made.value("now"))
        assert [one for one in had if one != "NONE"] == side.events
        assert ends["DONE"] + ends["FAILED"] > 3 and len(made.said) <= 8
