"""Sets of vectors: growth in place, and hash values that agree."""

from __future__ import annotations

from array import array

import pytest

from llfsm_verify.kripke.compiled import kernels
from llfsm_verify.kripke.kernels import blocks as b
from llfsm_verify.kripke.memory import KEPT, Region, VectorSet

MASK = (1 << 64) - 1


def unshifted(h: int) -> int:
    return h ^ h >> 33


def vector_of(h: int) -> int:
    """The vector of one word whose hash value is `h`: the finaliser of MurmurHash3 has an inverse."""
    for factor in (-4265267296055464877, -49064778989728563):
        h = unshifted(h) * pow(factor & MASK, -1, 1 << 64) & MASK
    return unshifted(h) ^ 0x51ED270B2F6A1C35


def numbers(of: VectorSet) -> list[int]:
    """What the table holds, in the order of its slots."""
    table = array("Q", of._table.read(0, of.slots * 8))
    return sorted((slot & 0xFFFFFFFF) - 1 for slot in table if slot)


def is_found(of: VectorSet, vector: int, h: int) -> int | None:
    """The number of a vector, looked for as the kernels do."""
    table = array("Q", of._table.read(0, of.slots * 8))
    line, place = divmod(h >> of._block[b.SET_SHIFT], 8)
    for passed in range(of.slots):
        slot = table[(8 * (line + passed // 8) + (place + passed) % 8) % of.slots]
        number = (slot & 0xFFFFFFFF) - 1
        if slot == 0:
            return None
        if slot >> 32 == h >> 32 and int.from_bytes(of.keys.read(8 * number, 8), "little") == vector:
            return number
    return None


@pytest.mark.slow
@pytest.mark.parametrize(
    "hashes",
    [
        pytest.param([(i * 0x9E3779B97F4A7C15) & MASK for i in range(20_000)], id="spread out"),
        pytest.param([(40 << 50) + i for i in range(9_000)], id="one slot near the beginning"),
        pytest.param([(1 << 64) - 1 - i for i in range(9_000)], id="around the end"),
    ],
)
def test_growing_loses_nothing(hashes):
    vectors = [vector_of(h) for h in hashes]
    assert len(set(vectors)) == len(vectors)
    made = VectorSet(kernels(), 1, Region(1))
    try:
        for start in range(0, len(vectors), 500):
            made.add_all(array("Q", vectors[start : start + 500]).tobytes())
        while made.slots < 8 * KEPT:
            made.grow()
        assert numbers(made) == list(range(len(vectors)))
        for number in range(0, len(vectors), 137):
            assert is_found(made, vectors[number], hashes[number]) == number
    finally:
        made.close()
