"""Each character of a YAML scalar is found at its own place in the file, whatever the style."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import Source
from llfsm_verify.yaml.compose import compose
from llfsm_verify.yaml.nodes import Mapping, Scalar
from tests.quick import examples

TEXTS = st.text(alphabet="ab=;&'\"\\ \n\t{}#:-é\N{GRINNING FACE}", max_size=120)
STYLES = st.sampled_from([None, "'", '"', "|", ">"])


def scalar(source: Source, *, pure: bool) -> Scalar:
    root = compose(source, [], pure=pure)
    assert isinstance(root, Mapping)
    value = root.items[0][1]
    assert isinstance(value, Mapping)
    found = value.items[0][1]
    assert isinstance(found, Scalar)
    return found


@settings(max_examples=examples(150), deadline=None)
@given(TEXTS, STYLES, st.integers(20, 80), st.booleans())
def test_characters_stand_where_they_say(text: str, style: str | None, width: int, pure: bool) -> None:
    dumped = yaml.dump({"k": {"v": text}}, default_style=style, width=width, allow_unicode=True)
    source = Source("s", dumped)
    fragment = scalar(source, pure=pure).fragment
    assert fragment.text == text
    assert len(fragment.offsets) == len(text) + 1
    offsets = list(fragment.offsets)
    assert offsets == sorted(offsets)
    for character, offset in zip(text, offsets, strict=False):
        if not character.isspace():
            there = dumped[offset]
            assert there in (character, "\\")


@pytest.mark.parametrize("pure", [False, True])
@pytest.mark.parametrize(
    "written",
    [
        "a && X",
        "'a && X'",
        '"a && X"',
        '"a\\x20X"',
        '"a \\\n    X"',
        "'it''s X'",
        "a &&\n    X",
        "a\n\n    X",
        "|\n    a\n     X",
        "| # comment X\n    a\n    X",
        ">-\n    a\n    b\n\n    X",
        "&anchor a X",
        "&anchor 'a X'",
    ],
)
def test_the_last_character_is_found(written: str, pure: bool) -> None:
    source = Source("s", f"k:\n  v: {written}\n")
    fragment = scalar(source, pure=pure).fragment
    at = fragment.text.index("X")
    assert fragment.span(at, at + 1).start == source.text.rindex("X")


@pytest.mark.parametrize("pure", [False, True])
def test_ends_of_lines_of_two_characters_have_their_own_places(pure: bool) -> None:
    source = Source("s", "k:\r\n  v: |\r\n    a\r\n\r\n\r\n    b\r\n")
    fragment = scalar(source, pure=pure).fragment
    assert fragment.text == "a\n\n\nb\n"
    assert [source.text[at] for at in fragment.offsets[:-1]] == ["a", "\r", "\r", "\r", "b", "\r"]
