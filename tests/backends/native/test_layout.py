"""How fields are packed, and what the layout refuses."""

from __future__ import annotations

from dataclasses import replace

import pytest

from llfsm_verify.backends.native.layout import Layout, TooManyInitial
from llfsm_verify.limits import Budget, LimitReached, Limits
from llfsm_verify.program.program import BOOL, INT64_MAX, INT64_MIN, UNBOUNDED, Int, Type
from llfsm_verify.values import Value
from tests.backends.tiny import tiny, variable


def test_fields_take_as_many_bits_as_their_type_and_fill_words() -> None:
    kinds: list[Type] = [
        Int(0, 15),
        Int(-3, 4),
        BOOL,
        Int(9, 9),
        Int(0, (1 << 40) - 1),
        Int(0, (1 << 31) - 1),
        UNBOUNDED,
    ]
    variables = [variable(f"v{i}", k, k.low if isinstance(k, Int) else 0) for i, k in enumerate(kinds)]
    layout = Layout.of(tiny((), variables))
    assert [layout.fields[f"v{i}"].bits for i in range(len(kinds))] == [4, 3, 1, 0, 40, 31, 64]
    assert layout.words == 3  # 64, 40 + 4 + 3 + 1, 31 of them: 143 bits in 3 words, the least there can be
    taken: set[tuple[int, int]] = set()
    for field in layout.fields.values():
        for element in range(field.elements):
            word, shift = field.place(element)
            bits = {(word, b) for b in range(shift, shift + field.bits)}
            assert shift + field.bits <= 64
            assert not bits & taken
            taken |= bits


def test_the_outputs_start_with_their_inits_and_a_completed_cycle() -> None:
    program = tiny((), [replace(variable("o", Int(0, 3), 2), output=True), variable("x", BOOL, 1)])
    layout = Layout.of(program)
    first = layout.first()
    assert layout.decode_outputs(first) == {"cycle": 1, "o": 2}
    assert layout.decode(first) == {"turn": 0, "state": 0, "x": 1}
    assert layout.words == layout.output_words == 1


def test_free_variables_have_every_value_and_the_last_runs_fastest() -> None:
    variables = [
        variable("a", Int(-1, 1), 0, free=True),
        variable("b", BOOL, (0, 0), free=True),
        variable("c", BOOL, 1),
    ]
    layout = Layout.of(tiny((), variables))
    decoded = [layout.decode(r) for r in layout.initial()]
    assert [(d["a"], d["b"], d["c"]) for d in decoded] == [
        (a, (x, y), 1) for a in (-1, 0, 1) for x in (0, 1) for y in (0, 1)
    ]
    with pytest.raises(TooManyInitial, match="12 initial configurations") as error:
        layout.initial(11)
    assert error.value.count == 12


def test_counting_the_initial_records_does_not_list_them() -> None:
    layout = Layout.of(tiny((), [variable("a", Int(INT64_MIN, INT64_MAX), (0, 0), free=True)]))
    assert layout.initial_count() == 1 << 128
    with pytest.raises(TooManyInitial):
        layout.initial()


def test_a_limit_ends_the_list_of_initial_records() -> None:
    layout = Layout.of(tiny((), [variable("a", Int(0, 2000), 0, free=True)]))
    with pytest.raises(LimitReached), Budget(Limits(timeout=0.0)):
        layout.initial()


@pytest.mark.parametrize("value", [INT64_MIN, -1, 0, INT64_MAX])
@pytest.mark.parametrize("kind", [UNBOUNDED, Int(INT64_MIN, INT64_MAX)])
def test_64_bit_values_round_trip(value: int, kind: Type) -> None:
    layout = Layout.of(tiny((), [variable("x", kind)]))
    data = layout.encode({"turn": 0, "state": 0, "x": value})
    assert layout.decode(data)["x"] == layout.get(data, "x") == value


def test_wrong_values_and_places_are_refused() -> None:
    layout = Layout.of(tiny((), [variable("x", Int(0, 5)), variable("a", BOOL, (0, 1))]))
    good: dict[str, Value] = {"turn": 0, "state": 0, "x": 1, "a": (0, 1)}
    wrongs: list[dict[str, Value]] = [{"x": 6}, {"x": -1}, {"x": (1,)}, {"a": 0}, {"a": (0, 1, 1)}, {"a": (0, 2)}]
    for wrong in wrongs:
        with pytest.raises(ValueError, match=next(iter(wrong))):
            layout.encode(good | wrong)
    with pytest.raises(KeyError):
        layout.encode({"x": 1})
    for name, index in (("x", 0), ("a", None), ("a", 2), ("a", -1)):
        with pytest.raises(IndexError):
            layout.reader(name, index)
    with pytest.raises(KeyError):
        layout.reader("y")


def test_programs_that_contradict_themselves_are_refused() -> None:
    with pytest.raises(ValueError, match="outside"):
        Layout.of(tiny((), [variable("x", Int(0, 5), 6)]))
    with pytest.raises(ValueError, match="one name"):
        Layout.of(tiny((), [variable("x", BOOL), variable("x", BOOL)]))
    with pytest.raises(ValueError, match="no output variable"):
        Layout.of(tiny((), cycle="x"))


def test_what_is_free_has_bounds():
    with pytest.raises(ValueError, match="x is free and unbounded"):
        Layout.of(tiny((), [variable("x", UNBOUNDED, free=True)])).initial()
