"""Smaller programs: users' variables have the same values in the same steps, and what is left out is not missed."""

from __future__ import annotations

from collections import Counter
from random import Random

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c import small
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.program.program import Set
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.extensions.c.compiled import Built, needs_gcc, shrunk
from tests.extensions.c.drawn import adapted
from tests.quick import each, many, spread

OVEN = "models/microwave/arrangement.yaml"
EVERYTHING = "tests/extensions/c/everything.yaml"
PROVABLE = "tests/extensions/c/provable.yaml"


def walk(arrangement: Arrangement, random: Random, tally: Counter[str], steps: int = 60) -> None:
    """The same ringlets of the small image in C and of the whole program in the executor."""
    image = image_for(arrangement)
    made, native = shrunk(image), NativeProgram(image.program, effort="quick")
    built = Built(made, "-O0")
    record, got = native.layout.first(), built.start()
    users = {v.name for v in image.program.vars if v.origin.kind not in ("control", "output")}
    assert users <= got.keys()
    tally["left out"] += len(image.program.vars) > len(got)
    tally["unchecked"] += bool(small.unchecked(made.program))
    tally["checked"] += len(small.unchecked(made.program)) < len(image.program.faults)
    for _ in range(steps):
        held = {c.name: random.choice((c.type.low, c.type.high, random.randint(c.type.low, c.type.high)))
                for c in image.program.choices}  # fmt: skip
        if not native.enabled(record):
            assert built.step(held) < 0
            return
        result = native.step(record, 0, held)
        assert built.step(held) == result.status, held
        want = native.layout.decode_record(result.record) | (image.meaning.safe if result.status else {})
        got = built.state()
        assert {n: v for n, v in got.items() if v != want[n]} == {}, held
        if result.status:
            tally["fault"] += 1
            return
        record = result.record
    tally["done"] += 1


@needs_gcc
@pytest.mark.long
def test_random_arrangements_do_the_same_when_they_are_small():
    tally = Counter[str]()

    def one(document: Document, seed: int) -> None:
        try:
            arrangement = image_of(build_arrangement(adapted(document, unloads=seed % 2 == 0)))
        except DiagnosticError:
            return
        walk(arrangement, Random(seed), tally)

    amount = settings(max_examples=many(60), deadline=None, database=None, suppress_health_check=list(HealthCheck))
    kinds = ("left out", "unchecked", "checked", "fault", "done")
    spread(one, amount, arrangements(), st.integers(0, 1 << 30), size=10, until=each(tally, kinds))


@needs_gcc
@pytest.mark.long
def test_everything_does_the_same_when_it_is_small():
    tally = Counter[str]()
    for seed in range(4):
        walk(image_of(load_arrangement(EVERYTHING)), Random(seed), tally)
    assert tally["left out"] == 4


@needs_gcc
@pytest.mark.slow
def test_some_faults_are_proved_away_and_others_are_met():
    tally = Counter[str]()
    for seed in range(4):
        walk(image_of(load_arrangement(PROVABLE)), Random(seed), tally, 300)
    assert tally == {"left out": 4, "unchecked": 4, "checked": 4, "fault": 4}


@pytest.mark.slow
def test_the_microwave_has_no_copy_of_its_state_and_no_checks():
    image = image_for(image_of(load_arrangement(OVEN)))
    made = shrunk(image)
    source = made.source()
    assert "before = *state" in image.source()
    assert "before = *state" not in source
    assert len(small.unchecked(made.program)) == len(image.program.faults) == 6
    assert made.header().count("no step meets it: it is not checked") == 6
    assert not {"$ran", "$spent", "$fired", "main.$begins"} & {v.name for v in made.program.vars}
    assert "after_ringlet" not in source


@needs_gcc
@pytest.mark.slow
def test_steps_after_safe_values_meet_the_faults_that_only_these_bring():
    image = image_for(image_of(load_arrangement(PROVABLE)))
    for made in (image, shrunk(image)):
        built = Built(made, "-O0")
        built.start()
        assert [built.step({"go": 1}), built.step({"go": 1})] == [0, 0]
        built.make_safe()
        before = built.state()
        assert (before["pos"], before["far"]) == (3, 3)
        number = built.step({"go": 1})
        assert number > 0
        assert "index outside the array" in image.program.faults[number - 1].message
        assert built.state() == before
    assert 0 < len(small.unchecked(made.program)) < len(image.program.faults)
    assert "it is not checked" in made.header()


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("mistake", ["_never_met", "_unread", "without", "_known"])
def test_each_planted_mistake_is_seen(mistake, monkeypatch):
    """A fault that can be met is left out; a variable of users, or stores of one that is read; a value that another
    statement has changed."""
    original = small.without
    planted = {
        "_never_met": lambda program, _: frozenset(range(len(program.faults))),
        "_unread": lambda program, _: {v.name for v in program.vars if v.name in ("secret", "k")},
        "without": lambda block, left_out: original(
            block, lambda s: left_out(s) or (isinstance(s, Set) and "clock" in s.var)
        ),
        "_known": lambda _block, _known: (),
    }[mistake]
    monkeypatch.setattr(small, mistake, planted)

    def walks() -> None:
        for seed in range(12):
            walk(image_of(load_arrangement((EVERYTHING, PROVABLE)[seed % 2])), Random(seed), Counter(), 100)

    with pytest.raises(AssertionError):
        walks()
