"""What a diagnostic looks like: its place, the line with the place marked, notes and hint."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import (
    EXCERPT_WIDTH,
    Diagnostic,
    DiagnosticError,
    Fragment,
    Source,
    Span,
    without_controls,
)
from tests.quick import examples

TEXT = "first\nthe second line\r\n\n  fourth"
GUTTER = "    1 | "


def test_a_diagnostic_with_all_its_parts() -> None:
    span = Span(Source("a.yaml", TEXT), 10, 16)
    found = Diagnostic("E001", "this is wrong", span, ("because of this", "and that"), "write something else")
    assert found.render() == (
        "a.yaml:2:5: error[E001]: this is wrong\n"
        "    2 | the second line\n"
        "      |     ^^^^^^\n"
        "  note: because of this\n"
        "  note: and that\n"
        "  hint: write something else"
    )
    assert str(DiagnosticError(found)) == found.render()
    assert DiagnosticError([found, found]).diagnostics == (found, found)
    assert str(DiagnosticError([found, found])) == f"{found.render()}\n{found.render()}"


def test_a_diagnostic_without_a_place() -> None:
    assert Diagnostic("W001", "strange").render() == "warning[W001]: strange"
    assert Diagnostic("W001", "strange", file="a.yaml").render() == "a.yaml: warning[W001]: strange"
    assert Diagnostic("L001", "strange").render("note") == "note[L001]: strange"
    assert Diagnostic("E001", "strange").is_error and not Diagnostic("W001", "strange").is_error


def test_no_control_character_reaches_a_terminal() -> None:
    text = "".join(map(chr, range(0xA0))) + "\u2028\u2029"
    shown = without_controls(text)
    for before, after in zip(text, shown, strict=True):
        assert after == ("\N{REPLACEMENT CHARACTER}" if not before.isprintable() and before != "\xa0" else before)
    assert (
        "\x1b" not in Diagnostic("E001", "a\x1b[31m", Span(Source("b\x1b", "c\x1b"), 0, 1), ("\x1b",), "\x1b").render()
    )


@pytest.mark.parametrize(
    ("offset", "line", "column"),
    [
        (-3, 1, 1),
        (0, 1, 1),
        (5, 1, 6),
        (6, 2, 1),
        (21, 2, 16),
        (22, 2, 17),
        (23, 3, 1),
        (24, 4, 1),
        (32, 4, 9),
        (99, 4, 9),
    ],
)
def test_lines_and_columns_count_from_1(offset: int, line: int, column: int) -> None:
    source = Source("a", TEXT)
    assert source.position(offset) == (line, column)
    span = Span(source, offset, offset)
    assert (span.line, span.column, span.end_position) == (line, column, (line, column))
    assert str(span) == f"a:{line}:{column}"


def test_lines_have_no_ends() -> None:
    source = Source("a", TEXT)
    assert [source.line(i) for i in range(1, 5)] == ["first", "the second line", "", "  fourth"]
    assert repr(source) == "Source('a', 32 characters)" and Source("a", "a~\n").line(1) == "a~"
    assert Source("a", "").line(1) == "" and Source("a", "\n").line(2) == ""


CHARACTERS = st.sampled_from("abcdefgh \t\x1b\xe9")


@settings(max_examples=examples(200), deadline=None)
@given(st.text(CHARACTERS, max_size=400), st.integers(0, 400), st.integers(0, 400))
@example("a" * EXCERPT_WIDTH, EXCERPT_WIDTH - 1, 1)
@example("a" * (EXCERPT_WIDTH + 1), 0, EXCERPT_WIDTH + 1)
@example("ab" * 200, 5, 3)
@example("ab" * 200, 399, 1)
@example("ab" * 200, 400, 0)
@example("ab" * 200, 200, 200)
def test_the_marks_are_below_what_is_marked(text: str, start: int, length: int) -> None:
    start = min(start, len(text))
    end = min(start + length, len(text))
    head, shown, marks = Diagnostic("E001", "x", Span(Source("a", f"{text}\nmore"), start, end)).render().split("\n")
    assert head == f"a:1:{start + 1}: error[E001]: x"
    assert shown.startswith(GUTTER) and marks.startswith("      | ")
    plain = "".join("\N{REPLACEMENT CHARACTER}" if not c.isprintable() else c for c in text.replace("\t", " "))
    window, begin = shown[len(GUTTER) :], marks.index("^") - len(GUTTER)
    if len(text) <= EXCERPT_WIDTH:
        assert window == plain and begin == start
        assert marks.count("^") == max(1, end - start)
        return
    cut_left, cut_right = window.startswith("…"), window.endswith("…")
    inner = window[cut_left : len(window) - cut_right]
    assert len(inner) == EXCERPT_WIDTH
    first = start - begin + cut_left  # of the line's characters, the first that is shown
    assert plain[first : first + EXCERPT_WIDTH] == inner
    assert cut_left == (first > 0) and cut_right == (first + EXCERPT_WIDTH < len(text))
    assert first <= start and (start < first + EXCERPT_WIDTH or start == len(text))
    assert first == max(0, min(start + 1 - EXCERPT_WIDTH // 2, len(text) - EXCERPT_WIDTH)), "the place is in the middle"
    assert marks[len(GUTTER) :].strip(" ") == "^" * max(1, min(end, first + EXCERPT_WIDTH) - start)


def test_a_mark_ends_with_its_line() -> None:
    shown = Diagnostic("E001", "x", Span(Source("a", "one\ntwo"), 1, 6)).render().split("\n")
    assert shown[1:] == ["    1 | one", "      |  ^^"]


def test_a_fragment_knows_where_its_characters_stand() -> None:
    source = Source("a", "x: 'it''s'")
    fragment = Fragment("it's", source, (4, 5, 6, 8, 9))
    for start, end, expected in (
        (0, 4, (4, 9)), (0, 3, (4, 7)), (3, 4, (8, 9)), (2, 2, (6, 6)),
        (0, 0, (4, 4)), (4, 4, (9, 9)), (-5, 99, (4, 9)),
        (3, 1, (8, 8)),
    ):  # fmt: skip
        span = fragment.span(start, end)
        assert (span.start, span.end) == expected
    assert fragment.span(0, 4).text == "it''s"
    whole = Fragment.whole(source)
    assert whole.offsets == range(len(source.text) + 1)
    assert (whole.text, whole.span(0, len(source.text)).text, whole.span(10, 10).start) == (
        source.text,
        source.text,
        10,
    )


@pytest.mark.parametrize(
    ("offset", "shown", "mark"),
    [
        (0, (0, 20), 0),
        (9, (0, 20), 9),
        (10, (1, 21), 10),
        (25, (16, 36), 10),
        (29, (20, 40), 10),
        (30, (20, 40), 11),
        (39, (20, 40), 20),
    ],
)
def test_of_a_long_line_what_is_around_the_mark_is_shown(
    monkeypatch: pytest.MonkeyPatch, offset: int, shown: tuple[int, int], mark: int
) -> None:
    monkeypatch.setattr("llfsm_verify.diagnostics.EXCERPT_WIDTH", 20)
    text = "".join(chr(ord("A") + i % 26) for i in range(40))
    _, line, marks = Diagnostic("E001", "m", Span(Source("s", text), offset, offset + 1)).render().split("\n")
    first, last = shown
    assert line == "    1 | " + "…" * (first > 0) + text[first:last] + "…" * (last < 40)
    assert marks == "      | " + " " * mark + "^"
    assert line[8 + mark] == text[offset]
