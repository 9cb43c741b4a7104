"""What a caller of an image relies on: statuses, the layout, the header in C++, no work of a fault left behind."""

from __future__ import annotations

import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.extensions.c.image import STATUSES, Image
from llfsm_verify.extensions.c.target import image_for
from llfsm_verify.program.program import Int
from llfsm_verify.targets.images import image_of
from tests.extensions.c.compiled import Built, compile_strictly, needs_avr, needs_clang, needs_gcc, shrunk, write
from tests.outside import needs, program

EVERYTHING = "tests/extensions/c/everything.yaml"
BAD_INPUT, CORRUPT = (STATUSES[name][0] - 10 for name in ("BAD_INPUT", "CORRUPT"))


@pytest.fixture(scope="module")
def image() -> Image:
    return image_for(image_of(load_arrangement(EVERYTHING)))


@needs_gcc
@pytest.mark.slow
def test_an_input_outside_its_range_is_refused_and_changes_nothing(image):
    built = Built(image)
    before = built.start()
    for choice in image.program.choices:
        for value in (choice.type.low - 1, choice.type.high + 1):
            if choice.type.boolean or choice.name in ("far", "code"):
                continue  # their types have no other values
            assert built.step({choice.name: value}) == BAD_INPUT
            assert built.step({choice.name: value}, "cycle") == BAD_INPUT
            assert built.state() == before
    assert built.step({}) == 0


def in_both_sizes(path: str | Path) -> list[Image]:
    image = image_for(image_of(load_arrangement(path)))
    return [image, shrunk(image)]


ONE = """
name: one
cycle_ms: 10
whiteboard:
  go: {type: bool, role: input}
  which: {type: 0..4, role: input, changes: never}
  levels: {type: {array: -2..2, size: 2}, role: input, changes: never}
  lamp: {type: 0..5, role: output, safe: 5}
machines:
  m:
    inline:
      machine: M
      variables: {t: {type: {array: 0..5, size: 5}, init: [1, 2, 3, 4, 5]}}
      states:
        - {name: A, on_entry: "lamp = t[which];", transitions: [{when: "levels[1] == 2", to: B}]}
        - {name: B, on_exit: "lamp = 0;", transitions: [{when: go, to: A}]}
schedule: [m]
"""


@pytest.fixture
def one(tmp_path):
    (tmp_path / "one.yaml").write_text(ONE)
    return in_both_sizes(tmp_path / "one.yaml")


@needs_gcc
@pytest.mark.slow
def test_what_a_caller_stores_outside_its_range_is_refused_and_changes_nothing(one):
    for image in one:
        built = Built(image, "-O0")
        first = built.start()
        for values, told in (
            ({}, 0),
            ({"which": 4, "levels[0]": -2, "levels[1]": 2}, 0),
            ({"which": 5}, BAD_INPUT),
            ({"which": 40}, BAD_INPUT),
            ({"levels[0]": -3}, BAD_INPUT),
            ({"levels[1]": 3}, BAD_INPUT),
        ):
            for unit in ("step", "cycle"):
                built.put({**first, **values})
                assert built.step({"go": 0}, unit) == told, values
                assert (built.state() == {**first, **values}) == (told == BAD_INPUT)


def test_the_header_says_what_a_state_is_that_operators_let_a_machine_enter(tmp_path):
    (tmp_path / "one.yaml").write_text(ONE + "operators: {enter: [m]}\n")
    header = in_both_sizes(tmp_path / "one.yaml")[0].header()
    assert "uint8_t operator_state_m; /* one_m_states */ /* of an operator: for one cycle */" in header
    assert "one_m_A,\n    one_m_B\n} one_m_states;" in header


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("name", ["boss.$state", "main.$turn", "helper.$state"])
def test_a_state_that_is_none_ends_it_with_safe_values(name):
    for image in in_both_sizes(EVERYTHING):
        built = Built(image)
        start = {**built.start(), name: 77, "shown": 0}
        built.put(start)
        assert built.step({}) == CORRUPT
        assert built.state() == {**start, "speed": -500, "shown": 2}
        assert built.step({}) == CORRUPT


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("name", ["m.$state", "main.$turn"])
def test_a_corrupt_state_stays_as_it_is_where_nothing_is_copied(name, one):
    speed, size = one
    assert ["before = *state" in image.source() for image in one] == [False, False]
    for image in (speed, size):
        built = Built(image)
        start = {**built.start(), name: 2}
        if "$fired" in start:
            start["$fired"] = 1
        built.put(start)
        assert built.step({}, "cycle") == CORRUPT
        assert built.state() == {**start, "lamp": 5}
        assert built.step({}) == CORRUPT


@needs("g++")
@pytest.mark.slow
def test_the_header_is_one_of_c_plus_plus_and_the_source_is_called_from_there(image, tmp_path):
    write(image, tmp_path)
    main = "int main() { everything_state s; everything_inputs i; everything_init(&s); everything_first(&i);"
    call = " return everything_layout() == everything_LAYOUT ? everything_cycle(&s, &i) : 9; }"
    (tmp_path / "main.cpp").write_text(f'#include "everything.h"\n{main}{call}\n')
    flags = ("-Wall", "-Wextra", "-Wconversion", "-Werror", "-pedantic", "-std=c++11")
    compile_strictly("gcc", tmp_path / "everything.c", tmp_path / "image.o")
    subprocess.run(["g++", *flags, "main.cpp", "image.o", "-o", "program"], cwd=tmp_path, check=True)
    assert subprocess.run([tmp_path / "program"], check=False).returncode == 0


def test_another_range_is_another_layout(image):
    def changed(name: str, kind: Int) -> Image:
        variables = tuple(replace(v, type=kind) if v.name == name else v for v in image.program.vars)
        return Image(replace(image.program, vars=variables), image.meaning)

    assert image.layout() == image_for(image_of(load_arrangement(EVERYTHING))).layout()
    assert changed("secret", Int(0, 4)).layout() != image.layout()
    assert Image(image.program, replace(image.meaning, small=True)).layout() != image.layout()  # a narrower status


def test_nothing_is_allocated_global_recursive_or_floating(image):
    text = re.sub(r"/\*.*?\*/", "", image.source(), flags=re.DOTALL)
    assert not re.search(r"\b(malloc|float|double|goto|longjmp)\b", text)
    assert not re.search(r"^[a-z][\w ]* \w+( =.*)?;$", text, re.MULTILINE)
    called: dict[str, set[str]] = {}
    for found in re.finditer(r"^\w[\w *]* \*?(\w+)\([^;{}]*\)\n\{\n(.*?)^\}", text, re.MULTILINE | re.DOTALL):
        called[found[1]] = set(re.findall(r"\b(\w+)\(", found[2]))
    order = {name: number for number, name in enumerate(called)}
    assert len(called) > 20
    assert all(order.get(other, -1) < order[name] for name, others in called.items() for other in others)


@needs_clang
@pytest.mark.slow
def test_clang_has_no_warning(image, tmp_path):
    write(image, tmp_path)
    compile_strictly(program("clang"), tmp_path / "everything.c", tmp_path / "image.o", "-O2")


@needs_avr
@pytest.mark.slow
def test_a_compiler_whose_int_has_16_bits_has_no_warning(image, tmp_path):
    write(image, tmp_path)
    compile_strictly("avr-gcc", tmp_path / "everything.c", tmp_path / "image.o", "-mmcu=atmega328p", "-Os")
