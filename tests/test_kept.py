"""What is kept for later runs: found again, refused when damaged or renamed, and done without where nothing is kept."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from lark import Lark

from llfsm_verify import kept
from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source
from llfsm_verify.language import parser as language
from llfsm_verify.logic.parsing import formulas


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(kept.FOLDER, str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_a_file_is_found_again(cache: Path) -> None:
    assert kept.kept(cache / "a") is None
    assert kept.keep(cache / "a", b"content") is None
    assert kept.kept(cache / "a") == b"content"


def test_a_damaged_or_renamed_file_counts_as_missing(cache: Path) -> None:
    kept.keep(cache / "a", b"content")
    whole = (cache / "a").read_bytes()
    for i in range(len(whole)):
        (cache / "a").write_bytes(whole[:i] + bytes([whole[i] ^ 1 << random.randrange(8)]) + whole[i + 1 :])
        assert kept.kept(cache / "a") is None
        (cache / "a").write_bytes(whole[:i])
        assert kept.kept(cache / "a") is None
    (cache / "b").write_bytes(whole)
    assert kept.kept(cache / "b") is None


def test_what_cannot_be_kept_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot be written" in str(kept.keep(tmp_path / "file" / "a", b""))
    assert "no home directory" in str(kept.keep(None, b""))
    assert kept.kept(None) is None


def test_names_differ_where_any_part_does() -> None:
    texts = [("a", "b"), ("ab",), ("a", "b", ""), ("b", "a"), ("a\0b",)]
    assert len({kept.fingerprint(*parts) for parts in texts}) == len(texts)


GUARDS = ("a && b[2] == 3", "f(x, -1) >= 0x10", "m.entered || !(a ? b : c)", "a == ", "while", "1..2", "a $ b")
ACTIONS = ("a = 1; if (b) { c = 2; } else c = 3;", "for (i in 0..3) { a[i] = i; }", "a = 1", "", "a += 2; b++;")
FORMULAS = ("G (a -> F[<=3] b)", "a[1] U !m@{A, B}", "rose(a && b)", "a -> b -> c", "G", "a U b U c", "1 + (a)")


def read(fragment: Fragment, how: str) -> object:
    """The tree or the diagnostics."""
    parse = {"guard": language.parse_guard, "actions": language.parse_actions, "formula": formulas.parse_formula}[how]
    try:
        return parse(fragment)
    except DiagnosticError as error:
        return error.diagnostics


def forget() -> None:
    language._parser.cache_clear()
    language._tree.cache_clear()
    formulas._parser.cache_clear()


@pytest.mark.slow
def test_parsers_from_kept_tables_read_the_same(cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kinds = ("guard", GUARDS), ("actions", ACTIONS), ("formula", FORMULAS)
    cases = [(Fragment.whole(Source("test", text)), how) for how, texts in kinds for text in texts]
    forget()
    made = [read(*case) for case in cases]
    forget()
    assert len(list(cache.glob("grammar-*.tables"))) == 2
    with monkeypatch.context() as patched:
        patched.setattr(Lark, "__init__", lambda *_, **__: pytest.fail("made again"))
        assert [read(*case) for case in cases] == made
    for file in cache.iterdir():
        file.write_bytes(file.read_bytes()[:-1])
    forget()
    assert [read(*case) for case in cases] == made
    forget()
