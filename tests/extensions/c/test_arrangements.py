"""Arrangements in C, ringlet by ringlet, as the executor runs them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.image import STATUSES
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.extensions.c.compiled import Built, needs_gcc
from tests.extensions.c.drawn import KINDS, TOLD, adapted, tally_of
from tests.quick import each, many, spread

pytestmark = needs_gcc
ENDED = STATUSES["ENDED"][0] - 10
STEPS = 60


def walk(arrangement: Arrangement, random: Random, tally: Counter[str], *flags: str, steps: int = STEPS) -> None:
    """Random ringlets, and cycles with inputs that are held, in C and by the executor."""
    image = image_for(arrangement)
    program = image.program
    built, native = Built(image, *flags), NativeProgram(program, events=True, effort="quick")
    record = native.layout.first()
    assert built.start() == native.layout.decode_record(record)
    for _ in range(steps):
        held = {c.name: random.choice((c.type.low, c.type.high, random.randint(c.type.low, c.type.high))) for c in
                program.choices if random.random() < (0.3 if c.name.startswith("operator") else 1)}  # fmt: skip
        if not native.enabled(record):
            tally["end"] += 1
            assert built.step(held) == ENDED
            assert built.step(held, "cycle") == ENDED
            return
        if random.random() < 0.2:
            ran = native.run(record, 1 << 20, stop_on_cycle=True, choices=held)
            status, after = max(ran.status, 0) if ran.status != -1 else -1, ran.record
            mine = built.step(held, "cycle")
        else:
            result = native.step(record, 0, held)
            status, after = result.status, result.record
            tally.update(kind for kind, *_ in result.events)
            mine = built.step(held)
        assert mine == status, held
        want, got = native.layout.decode_record(after) | (image.meaning.safe if status else {}), built.state()
        assert {n: v for n, v in got.items() if v != want[n]} == {}, held
        if status:
            tally["a fault" if status > 0 else "int"] += 1
            assert built.step(held) == status, "it is told from then on"
            assert built.state() == got
            built.start()
            after = native.layout.first()
        record = after
    tally["done"] += 1


@pytest.mark.long
def test_random_arrangements_do_in_c_what_the_executor_does():
    tally = Counter[str]()

    def one(document: Document, seed: int) -> None:
        try:
            arrangement = image_of(build_arrangement(adapted(document, unloads=seed % 2 == 0)))
        except DiagnosticError:
            tally["refused by image_of"] += 1
            return
        program = image_for(arrangement).program
        tally.update(+tally_of(program, str(document)))
        walk(arrangement, Random(seed), tally)

    checks = list(HealthCheck)
    amount = settings(max_examples=many(800), deadline=None, database=None, suppress_health_check=checks)
    spread(one, amount, arrangements(), st.integers(0, 1 << 16), size=10, until=each(tally, KINDS))


EVERYTHING = Path(__file__).with_name("everything.yaml")


@pytest.mark.slow
@pytest.mark.parametrize("flags", [("-O0", "-fsanitize=undefined", "-fno-sanitize-recover=all"), ("-Os",)])
def test_pools_commands_refusals_faults_and_each_type(flags):
    arrangement = image_of(load_arrangement(str(EVERYTHING)))
    tally = tally_of(image_for(arrangement).program, EVERYTHING.read_text())
    walk(arrangement, Random(1), tally, *flags, steps=1500)
    wanted = (*TOLD, "load", "faulted", "bits", "operators", "decimal", "array", "record", "wide", "a fault", "done")
    assert each(tally, wanted)(), tally


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["uint8", "int8", "uint16", "int16", "uint32", "int32", "uint64", "int64"])
def test_bits_are_those_of_c(kind):
    """Step programs have them as sums, of which each is written as one `&`."""
    texts = {
        "both": "a & b",
        "some": "a | b",
        "one": "a ^ b",
        "other": "~a",
        "low": "a & 6",
        "up": "a << 3",
        "down": "b >> 2",
    }
    names = ("a", "b")
    document = {
        "name": "bits", "cycle_ms": "1",
        "whiteboard": {n: {"type": kind, "role": "input"} for n in names} | {n: {"type": kind} for n in texts},
        "machines": {"m": {"inline": {"machine": "M", "states": [
            {"name": "S", "internal": " ".join(f"{n} = {t};" for n, t in texts.items()), "stays": "true"},
        ]}}},
        "schedule": ["m"],
    }  # fmt: skip
    arrangement = image_of(build_arrangement(document))
    source = image_for(arrangement).source()
    body = source[source.index("in_m_S(") :]
    assert body.count(" & ") >= 3
    assert max(map(len, body.splitlines())) < 200
    walk(arrangement, Random(2), Counter(), "-O1", "-fsanitize=undefined", "-fno-sanitize-recover=all", steps=200)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["microwave", "lift", "traffic_lights", "xray", "level_crossing", "press"])
def test_case_studies_do_in_c_what_the_executor_does(name):
    arrangement = image_of(load_arrangement(f"models/{name}/arrangement.yaml"))
    walk(arrangement, Random(3), Counter(), "-O2", "-fsanitize=undefined", "-fno-sanitize-recover=all", steps=2000)
