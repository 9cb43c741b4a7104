from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from llfsm_verify.report.columns import Column, _forced, lay_out, wrap

NAMES = ("step", "machine", "fired", "changes")
EMPTY = (
    Column("step", key=True),
    Column("machine", "items", key=True),
    Column("fired", "words"),
    Column("changes", "items", detail=True),
)
ROWS = [
    (" 1", "belt", "→ MOVING when parcel && !full", "x: 0 → 1, y: 0 → 1"),
    (" 2", "belt, lift", "", ""),
]
MEASURED = [column.holding([row[i] for row in ROWS]) for i, column in enumerate(EMPTY)]


def printed(width: int) -> list[str]:
    layout = lay_out(MEASURED, width)
    return [layout.header(), *(line for row in ROWS for line in layout.lines(row))]


def test_side_by_side_where_there_is_room():
    assert printed(100) == [
        "step  machine     fired                          changes",
        " 1    belt        → MOVING when parcel && !full  x: 0 → 1, y: 0 → 1",
        " 2    belt, lift",
    ]


def test_lists_wrap_first():
    assert printed(60) == [
        "step  machine    fired                          changes",
        " 1    belt       → MOVING when parcel && !full  x: 0 → 1,",
        "                                                y: 0 → 1",
        " 2    belt,",
        "      lift",
    ]


def test_then_details_go_below():
    assert printed(47) == [
        "step  machine     fired",
        " 1    belt        → MOVING when parcel && !full",
        "      changes: x: 0 → 1, y: 0 → 1",
        " 2    belt, lift",
    ]


def test_details_share_a_line_where_they_fit():
    rows = [("1", "a: 1", "b: 2"), ("2", "a: 1, a: 2, a: 33", "b: 2"), ("3", "", "b: 2"), ("4", "a: 1", "")]
    titles = (Column("step", key=True), Column("ins", "items", detail=True), Column("outs", "items", detail=True))
    columns = [c.holding([row[i] for row in rows]) for i, c in enumerate(titles)]
    layout = replace(lay_out(columns, 29), widths=((0, 4),), below=(1, 2))
    wrapped = ["ins: a: 1, a: 2,", "a: 33", "outs: b: 2"]
    assert [line.strip() for row in rows for line in layout.lines(row)] == [
        *["1", "ins: a: 1  outs: b: 2"], *["2", *wrapped], *["3", "outs: b: 2"], *["4", "ins: a: 1"],
    ]  # fmt: skip


def test_then_everything_but_the_keys():
    assert printed(30) == [
        "step  machine",
        " 1    belt",
        "      fired: → MOVING when",
        "        parcel && !full",
        "      changes: x: 0 → 1,",
        "        y: 0 → 1",
        " 2    belt, lift",
    ]


TEXTS = st.text("ab_,: ", max_size=30).map(lambda t: " ".join(t.split()))


@pytest.mark.slow
@given(st.lists(st.tuples(TEXTS, TEXTS, TEXTS, TEXTS), min_size=1, max_size=4), st.integers(30, 120))
def test_nothing_is_lost_and_nothing_is_too_wide(rows, width):
    short = [(f" {i}", *row[1:]) for i, row in enumerate(rows)]
    columns = [column.holding([row[i] for row in short]) for i, column in enumerate(EMPTY)]
    layout = lay_out(columns, width)
    for row in short:
        lines = list(layout.lines(row))
        assert max(map(len, lines)) <= max(width, 30)
        kept = sorted("".join(lines).replace(" ", ""))
        titles = "".join(f"{columns[i].title}:" for i in layout.below if row[i])
        assert kept == sorted("".join([titles, *row]).replace(" ", ""))


@pytest.mark.parametrize("width", [8, 20, 33])
def test_a_single_word_is_folded_only_where_no_line_holds_it(width):
    lines = wrap("abcdefghijklmnop, b = 1, c = 2", "items", width)
    assert max(map(len, lines)) <= width and (lines[0].startswith("abcdefghijklmnop,") or width == 8)


@pytest.mark.parametrize(
    ("width", "widths"),
    [(100, [4, 30, 20]), (58, [4, 30, 20]), (57, [4, 30, 19]), (46, [4, 30, 8]), (45, [4, 30, 8]), (1, [4, 30, 8])],
)
def test_the_last_column_gives_way_down_to_eight_cells(width, widths):
    columns = [Column("a" * 4).holding(["x"]), Column("b").holding(["y" * 30]), Column("c").holding(["z" * 20])]
    assert _forced(columns, width) == widths


def test_a_layout_is_as_wide_as_it_needs_to_be():
    assert max(map(len, printed(100))) == 67
    assert [max(map(len, printed(width))) <= width for width in (66, 60, 50, 40, 30)] == [True] * 5
    assert printed(66) != printed(67) == printed(100)
