"""Images in many ways, by two compilers, for machines of 8 to 64 bits: they do what the executor does, to the bit.

`make soak` walks 100,000 steps in each way.
"""

from __future__ import annotations

import subprocess
from collections import Counter
from dataclasses import replace
from fractions import Fraction
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st

from llfsm_verify.arrangement import build_arrangement, load_arrangement
from llfsm_verify.diagnostics import DiagnosticError
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.targets.images import image_of
from llfsm_verify.testing.arrangements import Document, arrangements
from tests.extensions.c.compiled import STRICT
from tests.extensions.c.drawn import KINDS, adapted, tally_of
from tests.extensions.c.ways import WAYS, Walk, first_difference, small, write
from tests.outside import demand, needs, program
from tests.quick import FRESH, each, spread

EVERYTHING = "tests/extensions/c/everything.yaml"
PROVABLE = "tests/extensions/c/provable.yaml"
STEPS = 100_000 if FRESH else 2_000
ON_AVR = STEPS // 10
"""An emulator of a slow machine takes fewer."""
EACH = 250
MOST = 8
LONGEST = 40_000
"""Characters of an image."""


def check(walks: list[Walk], wanted: list[str], way: str, folder: Path) -> None:
    """The way prints what the executor does."""
    demand(*WAYS[way].needs)
    folder.mkdir(parents=True, exist_ok=True)
    write(walks, folder)
    WAYS[way].build(folder)
    assert first_difference(walks, wanted, WAYS[way].run(folder)) == ""


@cache
def everything(steps: int) -> tuple[list[Walk], list[str]]:
    images = [image_for(image_of(load_arrangement(path))) for path in (EVERYTHING, PROVABLE)]
    again = replace(load_arrangement(EVERYTHING), name="small")
    walks = [Walk(images[0], steps), *(small(image, steps // 4) for image in (images[1], image_for(image_of(again))))]
    return walks, [line for walk in walks for line in walk.lines()]


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
def test_all_there_is_in_each_way(way, tmp_path):
    check(*everything(ON_AVR if way == "avr" else STEPS), way, tmp_path)


def draw(number: int) -> tuple[list[Walk], Counter[str]]:
    """Random arrangements, of which each has or does something that but few of those before it do. Each second one is
    optimized for size."""
    walks: list[Walk] = []
    told = Counter[str]()

    def one(document: Document, seed: int) -> None:
        document = adapted(document, unloads=seed % 2 == 0) | {"name": f"walk{number}_{len(walks)}"}
        try:
            image = image_for(image_of(build_arrangement(document)))
        except DiagnosticError:
            return
        if len(image.source()) > LONGEST:
            return
        tally = Counter(+tally_of(image.program, str(document)))
        list(Walk(image, EACH // 4).lines(tally))
        new = any(kind in KINDS and not told[kind] for kind in tally)
        if new or (len(walks) < MOST and any(told[kind] < 2 for kind in tally)):
            told.update(tally.keys())
            walks.append(small(image, EACH) if len(walks) % 2 else Walk(image, EACH))

    checks = list(HealthCheck)
    amount = settings(max_examples=200, deadline=None, database=None, suppress_health_check=checks)
    spread(one, amount, arrangements(), st.integers(0, 1 << 16), size=10, until=each(told, KINDS))
    return walks, told


@needs(*sorted({name for way in WAYS.values() for name in way.needs}))
@pytest.mark.long
def test_random_arrangements_in_each_way(tmp_path):
    done = number = 0
    while done < STEPS:
        walks, _ = draw(number)
        wanted = [line for walk in walks for line in walk.lines()]
        done, number = done + len(wanted), number + 1
        for way in WAYS:
            check(walks, wanted, way, tmp_path / way.replace(" ", "") / str(number))


@pytest.fixture(scope="module")
def models(tmp_path_factory):
    """A folder with the C of all models that an image can be made of, each under a name of its own."""
    folder = tmp_path_factory.mktemp("models")
    for number, path in enumerate(sorted(Path("models").rglob("*.yaml"))):
        try:
            arrangement = load_arrangement(str(path))
            cycle_ms = Fraction(10) if arrangement.cycle_ms is None else None
            image = image_for(image_of(replace(arrangement, name=f"{path.stem}_{number}"), cycle_ms))
        except DiagnosticError:
            continue
        source = image.source()
        (folder / f"{image.prefix}.c").write_text(source)
        (folder / f"{image.prefix}.h").write_text(image.header())
    return folder


@needs("clang", "cppcheck", "g++")
@pytest.mark.long
def test_no_model_has_a_warning(models):
    sources, headers = (sorted(path.name for path in models.glob(f"*.{end}")) for end in "ch")
    assert len(sources) == len(headers) > 60
    (models / "all.cpp").write_text("".join(f'#include "{name}"\n' for name in headers))
    told = "--enable=warning,portability,performance"
    for command in (
        [program("gcc"), *STRICT, "-O2", "-c", *sources],
        [program("clang"), *STRICT, "-O2", "-c", *sources],
        [program("cppcheck"), "--quiet", "--std=c99", told, "--error-exitcode=1", *sources],
        [program("g++"), *STRICT[1:], "-std=c++11", "-fsyntax-only", "all.cpp"],
    ):
        done = subprocess.run(command, cwd=models, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr[:4000]
