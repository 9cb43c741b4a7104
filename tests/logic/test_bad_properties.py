"""Wrong property files get their diagnostic, at its place, within seconds, and never a traceback."""

import re
import sys
import time
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic import codes
from llfsm_verify.logic.properties import MAX_MISTAKES, PLAIN, parse_properties
from llfsm_verify.logic.reading import MAX_BYTES, read_source

FOLDER = Path(__file__).resolve().parents[1] / "bad_properties"
FILES = sorted(FOLDER.glob("*.ltl"))

ELSEWHERE = {
    codes.UNREADABLE, codes.DIRECTORY, codes.NOT_TEXT, codes.FILE_TOO_LARGE, codes.TOO_MANY_WORDS, codes.TOO_DEEP,
    # test_regular_parsing.py and test_automaton_properties.py
    codes.INITIAL_ONLY, codes.NEVER_EQUAL,  # test_initial.py, tests/checking/test_doubts.py
    codes.REGULAR_LETTER, codes.REPETITION, codes.REGULAR_EMPTY, codes.REGULAR_NOTHING, codes.AUTOMATON_FILE,
    codes.AUTOMATON_COMPLEMENT, codes.HOA_NUMBER,
    # test_hoa.py
    codes.HOA, codes.HOA_ACCEPTANCE, codes.HOA_UNSUPPORTED,
    # tests/cli/commands/test_query.py
    codes.TEMPORAL,
    # test_syntaxes.py and test_property.py
    codes.UNSAYABLE, codes.WORD, codes.LIMIT, codes.MIXTURE,
    # tests/checking/test_timed.py
    codes.TIMELESS, codes.TOO_LONG, codes.NO_CYCLE, codes.BETWEEN_CYCLES,
}  # fmt: skip
"""Codes that need what no small file has, or what this reader is not asked for; other tests cover them."""


def expectations(path):
    """The ``CODE LINE:COLUMN`` of the first line, which also says why the file exists."""
    first = path.read_text(encoding="utf-8").splitlines()[0]
    match = re.fullmatch(r"# expect ((?:E3\d\d \d+:\d+ ?)+): \S.*", first)
    assert match, path
    return [(c, int(n), int(k)) for c, n, k in re.findall(r"(E\d+) (\d+):(\d+)", match[1])]


def mistakes(text):
    with pytest.raises(DiagnosticError) as raised:
        parse_properties([Source("test.ltl", text)], features=PLAIN)
    return raised.value.diagnostics


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_wrong_file(path):
    with pytest.raises(DiagnosticError) as raised:
        parse_properties([read_source(path)], features=PLAIN)
    found = [(d.code, d.span.line, d.span.column) for d in raised.value.diagnostics]
    assert found == expectations(path)
    for d in raised.value.diagnostics:
        shown = d.render()
        assert f"{path}:{d.span.line}:{d.span.column}: error[{d.code}]" in shown
        assert "^" in shown.splitlines()[2]


def test_every_code_is_covered():
    assert len(FILES) >= 45
    covered = {code for path in FILES for code, _, _ in expectations(path)}
    constants = {value for name, value in vars(codes).items() if name.isupper() and isinstance(value, str)}
    assert covered | ELSEWHERE == set(codes.MEANINGS) == constants


# ---------------------------------------------------------------- what to write instead


@pytest.mark.parametrize(
    ("text", "hint"),
    [
        ("p U q U r", "write `(p U q) U r` or `p U (q U r)`"),
        ("G (a U (b W c)) U d U (e)", "write `(G (a U (b W c)) U d) U (e)` or `G (a U (b W c)) U (d U (e))`"),
        ("a -> b && (c -> d) -> e", "write `(a -> b && (c -> d)) -> e` or `a -> (b && (c -> d) -> e)`"),
        ("GFX p", "write `G F X p`"),
        ("G == 3", 'write `"G"` for a variable of that name'),
        ("(G p) == q", "write `(G p) <-> q`"),
        ("p != !q", "write `p xor !q`"),
        ("x = 3", "write `x == 3`"),
        ("0 <= x < 3", "write `0 <= x && x < 3`"),
        ("1", "write `true`"),
        ("x ≥ 3", "write `>=`"),
        ("p until q", "write `U`"),
        ("G (p W[<=500ms] q)", "write `p U[<=500ms] q || G[<=500ms] p`"),
        ("p W[1s:2s] q", "write `p U[1s:2s] q || G[<=2s] p`"),
        ("p W[>=1s] q", "write `p U[>=1s] q || G p`"),
        ("p M[<=2s] q", "write `q U[<=2s] (p && q)`"),
        ("p M[1s:2s] q", "write `(p R[1s:2s] q) && F[<=2s] p`"),
        ("p M[>=1s] q", "write `(p R[>=1s] q) && F p`"),
        ("F[2s:1s] p", "`F[1s:2s]`"),
        ("F[1s:2] p", "`F[1s:2s]`"),
        ("p R[2:3] q", "`p R[1s:2s] q`"),
        ("Y[<=1s] q", "write `O[<=1s]`"),
        ("assume no: enforce x*", "`enforce NAME: …`"),
    ],
)
def test_hints(text, hint):
    (found,) = mistakes(text)
    assert found.hint is not None and hint in found.hint


@pytest.mark.parametrize(
    ("text", "column", "meant"),
    [
        ("Enforce x: a b", 1, "enforce"),
        ("ensure x: a b", 1, "enforce"),
        ("forbids x: a", 1, "forbid"),
        ("ASSUME x: G p", 1, "assume"),
        ("forbid Initially x: a", 8, "forbid initially"),
        ("forbid Initially: a", 8, "forbid initially"),
        ("automaton Never x: a.hoa", 11, "automaton never"),
    ],
)
def test_misspelt_kinds(text, column, meant):
    (found,) = mistakes(text)
    assert (found.code, found.span.column) == (codes.BAD_NAME, column)
    assert found.message.endswith(f"did you mean `{meant}`?")


@pytest.mark.parametrize("operator", "WMYZ")
def test_only_some_operators_take_bounds(operator):
    left = "p " if operator in "WM" else ""
    (found,) = mistakes(f"{left}{operator}[<=500ms] q")
    assert (found.code, found.span.column) == (codes.BOUND, len(left) + 1)
    assert found.message == f"only `F G U R O H S T` take a bound in time, and `{operator}` does not"


# ---------------------------------------------------------------- files


def failure(path):
    with pytest.raises(DiagnosticError) as raised:
        read_source(path)
    (found,) = raised.value.diagnostics
    assert found.file == str(path) and str(path).replace("\0", "\N{REPLACEMENT CHARACTER}") in found.render()
    return found.code


def test_unreadable_files(tmp_path):
    assert failure(tmp_path / "missing.ltl") == codes.UNREADABLE
    assert failure("a\0b") == codes.UNREADABLE
    assert failure(tmp_path) == codes.DIRECTORY
    (tmp_path / "program").write_bytes(b"\x7fELF\x02\x01\x01\xff\xfe")
    assert failure(tmp_path / "program") == codes.NOT_TEXT
    (tmp_path / "zero").write_bytes(b"G p\0")
    assert failure(tmp_path / "zero") == codes.NOT_TEXT
    (tmp_path / "utf16").write_text("G p\n", encoding="utf-16")
    assert failure(tmp_path / "utf16") == codes.NOT_TEXT
    (tmp_path / "large").write_bytes(b" " * (MAX_BYTES + 1))
    assert failure(tmp_path / "large") == codes.FILE_TOO_LARGE
    if Path("/dev/zero").exists():
        assert failure("/dev/zero") == codes.FILE_TOO_LARGE


def test_readable_files(tmp_path, monkeypatch):
    (tmp_path / "bom.ltl").write_bytes(b"\xef\xbb\xbfa: G p\r\nb: F q\r\n")
    read = parse_properties([read_source(tmp_path / "bom.ltl")])
    assert [(p.name, p.text, str(p.span)[-3:]) for p in read] == [("a", "G p", "1:4"), ("b", "F q", "2:4")]
    monkeypatch.setattr(sys, "stdin", TextIOWrapper(BytesIO(b"G p")))
    source = read_source("-")
    assert (source.name, source.text) == ("<stdin>", "G p")


# ---------------------------------------------------------------- enormous input

HUGE = {
    "opening brackets": ("(" * 99_000, codes.TOO_DEEP),
    "100,000 opening brackets": ("(" * 100_000, codes.TOO_MANY_WORDS),
    "a mebibyte of brackets": ("(" * (1 << 20), codes.TOO_MANY_WORDS),
    "closed brackets": ("(" * 40_000 + "p" + ")" * 40_000, codes.TOO_DEEP),
    "indices": ("a[" * 30_000 + "1" + "]" * 30_000 + " > 0", codes.TOO_DEEP),
    "temporal operators": ("X " * 90_000 + "p", codes.TOO_DEEP),
    "words of negation": ("not " * 200_000 + "p", codes.TOO_MANY_WORDS),
    "a mebibyte of formula": ("p0 && " * 174_000 + "p", codes.TOO_MANY_WORDS),
    "a mebibyte of garbage": ("\0" * (1 << 20), codes.TOO_MANY_WORDS),
    "a mebibyte of quote": ('"' + "p" * (1 << 20), codes.OPEN_QUOTE),
    "chain of exclusive or": (" xor ".join(["p"] * 20_000), codes.TOO_DEEP),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", HUGE)
def test_enormous_mistakes_are_diagnostics(case):
    text, code = HUGE[case]
    start = time.process_time()
    (found,) = mistakes(f"a: {text}")
    assert found.code == code
    assert len(found.render()) < 2_000
    assert time.process_time() - start < 20  # a hang is minutes; about a second is usual


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("!" * 200_000 + "p", 1),
        ("! " * 200_001 + "p", 1),
        (" && ".join(f"p{i}" for i in range(20_000)), 20_000),
        ("p" * (1 << 20), 1),
        ("# " + "x" * (1 << 20) + "\nG p", 1),
        (" + ".join(["x"] * 20_000) + " > 3", 1),
        ("(" * 190 + "G p" + ")" * 190, 1),
    ],
    ids=["negations", "spaced", "conjunction", "name", "comment", "sum", "brackets"],
)
def test_enormous_formulas_are_read(text, size):
    (found,) = parse_properties([Source("test.ltl", f"a:\n{text}")])
    assert len(found.atoms) == size


@pytest.mark.slow
def test_reading_ends_after_many_mistakes():
    assert len(mistakes("p q\n" * 30_000)) == MAX_MISTAKES
