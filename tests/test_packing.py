"""What is packed comes back equal, its shared parts shared, with the objects of this run that it refers to."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from fractions import Fraction

import pytest

from llfsm_verify.packing import PackingError, pack, unpack


@dataclass(frozen=True, slots=True)
class Leaf:
    number: int


@dataclass(frozen=True, slots=True)
class Tree:
    left: object
    right: object = None
    table: dict[str, int] = field(default_factory=dict)
    name: str | None = field(default=None, init=False, compare=False)


@dataclass(frozen=True, slots=True)
class Sorted:
    parts: tuple[int, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "parts", tuple(sorted(self.parts)))


class Place:
    """An object that is equal to none but itself."""


VALUES = (
    None, 7, "text", Leaf(1), Tree(Leaf(1), Tree(True, None, {"a": 1})), (Leaf(2), [Fraction(1, 3)], frozenset({1, 2})),
    Sorted((3, 1, 2)),
)  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=str)
def test_a_value_comes_back(value: object) -> None:
    assert unpack(pack(value)) == value


def test_shared_parts_stay_shared() -> None:
    leaf = Leaf(1)
    tree = unpack(pack(Tree(leaf, (leaf, Leaf(1)))))
    assert tree.left is tree.right[0]
    assert tree.left is not tree.right[1]


def test_known_objects_are_those_of_the_reader() -> None:
    there, here, other = [Place(), Place()], [Place(), Place()], Place()
    tree = unpack(pack(Tree(there[1], (there[0], there[1], other)), there), here)
    assert (tree.left, tree.right[:2]) == (here[1], (here[0], here[1]))
    assert isinstance(tree.right[2], Place)
    assert tree.right[2] not in (*there, *here, other)
    assert unpack(pack(there[1], there), here) is here[1]


def test_what_the_constructor_does_not_take_has_its_default() -> None:
    tree = Tree(1)
    object.__setattr__(tree, "name", "kept")
    assert unpack(pack(tree)).name is None
    assert replace(tree).name is None


def test_different_values_have_different_bytes() -> None:
    values = [*VALUES, Leaf(2), Tree(Leaf(1)), Tree(None, Leaf(1)), 7.0, "7", True, 1, (1,), [1]]
    assert len({pack(value) for value in values}) == len(values)


def test_bytes_need_not_depend_on_what_is_shared() -> None:
    leaf, texts = Leaf(1), ["ab" * n for n in (20, 20)]
    assert texts[0] is not texts[1]
    values = [(leaf, leaf, texts[0], texts[0]), (leaf, Leaf(1), texts[0], texts[1])]
    assert len({pack(value) for value in values}) == 2
    (one,) = {pack(value, shared=False) for value in values}
    assert unpack(one) == values[0]


def test_what_cannot_be_packed_is_refused() -> None:
    tree = Tree(0)
    for _ in range(10_000):
        tree = Tree(tree)
    for value in (tree, lambda: 0, Tree(part for part in ())):
        with pytest.raises(PackingError):
            pack(value)
