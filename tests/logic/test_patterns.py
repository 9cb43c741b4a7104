"""Specification patterns: the published formulas, and what they mean on words."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from llfsm_verify.diagnostics import DiagnosticError, Source
from llfsm_verify.logic.formula import to_text
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.properties import Property, parse_properties
from tests.logic.wrong import PATTERNS_WRONG
from tests.quick import examples

PUBLISHED = {
    "absence of P": (
        "[](!P)",
        "<>R -> (!P U R)",
        "[](Q -> [](!P))",
        "[]((Q && !R && <>R) -> (!P U R))",
        "[](Q && !R -> (!P W R))",
    ),
    "existence of P": (
        "<>(P)",
        "!R W (P && !R)",
        "[](!Q) || <>(Q && <>P)",
        "[](Q && !R -> (!R W (P && !R)))",
        "[](Q && !R -> (!R U (P && !R)))",
    ),
    "bounded existence of P": (
        "(!P W (P W (!P W (P W []!P))))",
        "<>R -> ((!P && !R) U (R || ((P && !R) U (R || ((!P && !R) U (R || ((P && !R) U (R || (!P U R)))))))))",
        "<>Q -> (!Q U (Q && (!P W (P W (!P W (P W []!P))))))",
        (
            "[]((Q && <>R) -> ((!P && !R) U (R || ((P && !R) U (R || ((!P && !R) U (R || ((P && !R) U (R || "
            "(!P U R))))))))))"
        ),
        (
            "[](Q -> ((!P && !R) U (R || ((P && !R) U (R || ((!P && !R) U (R || ((P && !R) U (R || "
            "(!P W R) || []P)))))))))"
        ),
    ),
    "universality of P": (
        "[](P)",
        "<>R -> (P U R)",
        "[](Q -> [](P))",
        "[]((Q && !R && <>R) -> (P U R))",
        "[](Q && !R -> (P W R))",
    ),
    "S precedes P": (
        "!P W S",
        "<>R -> (!P U (S || R))",
        "[]!Q || <>(Q && (!P W S))",
        "[]((Q && !R && <>R) -> (!P U (S || R)))",
        "[](Q && !R -> (!P W (S || R)))",
    ),
    "S responds to P": (
        "[](P -> <>S)",
        "<>R -> (P -> (!R U (S && !R))) U R",
        "[](Q -> [](P -> <>S))",
        "[]((Q && !R && <>R) -> (P -> (!R U (S && !R))) U R)",
        "[](Q && !R -> ((P -> (!R U (S && !R))) W R))",
    ),
    "S, T precede P": (
        "<>P -> (!P U (S && !P && X(!P U T)))",
        "<>R -> (!P U (R || (S && !P && X(!P U T))))",
        "([]!Q) || (!Q U (Q && (<>P -> (!P U (S && !P && X(!P U T))))))",
        "[]((Q && <>R) -> (!P U (R || (S && !P && X(!P U T)))))",
        "[](Q -> (<>P -> (!P U (R || (S && !P && X(!P U T))))))",
    ),
    "P precedes S, T": (
        "(<>(S && X<>T)) -> ((!S) U P)",
        "<>R -> ((!(S && (!R) && X(!R U (T && !R)))) U (R || P))",
        "([]!Q) || ((!Q) U (Q && ((<>(S && X<>T)) -> ((!S) U P))))",
        "[]((Q && <>R) -> ((!(S && (!R) && X(!R U (T && !R)))) U (R || P)))",
        "[](Q -> (!(S && (!R) && X(!R U (T && !R))) U (R || P) || [](!(S && X<>T))))",
    ),
    "P responds to S, T": (
        "[](S && X<>T -> X(<>(T && <>P)))",
        "<>R -> (S && X(!R U T) -> X(!R U (T && <>P))) U R",
        "[](Q -> [](S && X<>T -> X(!T U (T && <>P))))",
        "[]((Q && <>R) -> (S && X(!R U T) -> X(!R U (T && <>P))) U R)",
        "[](Q -> (S && X(!R U T) -> X(!R U (T && <>P))) U (R || [](S && X(!R U T) -> X(!R U (T && <>P)))))",
    ),
    "S, T respond to P": (
        "[](P -> <>(S && X<>T))",
        "<>R -> (P -> (!R U (S && !R && X(!R U T)))) U R",
        "[](Q -> [](P -> <>(S && X<>T)))",
        "[]((Q && <>R) -> (P -> (!R U (S && !R && X(!R U T)))) U R)",
        "[](Q -> (P -> (!R U (S && !R && X(!R U T)))) U (R || [](P -> <>(S && X<>T))))",
    ),
}
"""As Dwyer, Avrunin and Corbett print them (matthewbdwyer.github.io/psp/patterns/ltl.html), for each scope; but
`S, T precede P` after Q has brackets, and `S, T respond to P` after Q (until R) an F, which are missing there."""
SCOPES = ("globally", "before R", "after Q", "between Q and R", "after Q until R")
NAMES = {"P": "p", "Q": "q", "R": "r", "S": "s", "T": "t"}


def small(text: str) -> str:
    """The letters of the patterns as names: `R`, `S` are operators here, and `W`, `U` stay."""
    words = text.replace("[]", " G ").replace("<>", " F ")
    return "".join(NAMES.get(c, c) for c in words)


def one(text: str) -> Property:
    (found,) = parse_properties([Source("p", f"x: {text}")])
    assert found.formula is not None
    return found


CASES = [(pattern, i) for pattern in PUBLISHED for i in range(len(SCOPES))]


def spoken(pattern: str, scope: int) -> Property:
    return one(re.sub(r"\b[PQRST]\b", lambda found: NAMES[found[0]], f"{pattern} {SCOPES[scope]}"))


@pytest.mark.parametrize(("pattern", "scope"), CASES)
def test_the_formulas_are_the_published_ones(pattern: str, scope: int) -> None:
    assert to_text(spoken(pattern, scope).formula) == to_text(one(small(PUBLISHED[pattern][scope])).formula)


LETTERS = st.frozensets(st.sampled_from("pqrst"), max_size=3)


@pytest.mark.slow
@settings(max_examples=examples(400), deadline=None)
@given(st.lists(LETTERS, max_size=5), st.lists(LETTERS, min_size=1, max_size=3), st.sampled_from(CASES))
def test_what_they_say_of_words(stem: list[frozenset[str]], loop: list[frozenset[str]], case: tuple[str, int]) -> None:
    """The scopes read off a word: parts of it, in each of which the pattern holds as it is said in English."""
    pattern, scope = case
    long = [*stem, *loop * (len(stem) + 2 * len(loop) + 4)]
    expected = said(pattern, scope, long)
    if expected is not None:
        formula = spoken(pattern, scope).formula
        assert formula is not None
        assert evaluate(formula, stem, loop) == expected


def said(pattern: str, scope: int, w: list[frozenset[str]]) -> bool | None:
    """Of patterns whose scopes have an exact reading in parts; None: of the others."""
    if ", " in pattern:
        return None if scope == 4 else _said_of_chains(pattern, scope, w)
    if pattern.startswith(("existence", "bounded")) or (pattern.startswith("S pre") and scope == 2):
        return None
    starts = [0] if scope < 2 else [i for i, a in enumerate(w) if "q" in a and (scope == 2 or "r" not in a)]
    results = []
    for start in starts:
        if start > len(w) // 2:
            continue  # the loop has shown everything before
        end = next((i for i in range(start, len(w)) if "r" in w[i]), None) if scope in (1, 3, 4) else None
        if end is None and scope in (1, 3):
            continue
        results.append(_holds(pattern, w[start:end], closed=end is not None))
    return all(results)


def _said_of_chains(pattern: str, scope: int, w: list[frozenset[str]]) -> bool:
    """What the chains say where it is more than their formulas: not of runs after Q until R."""
    starts = [0] if scope < 2 else [i for i, a in enumerate(w[: len(w) // 2]) if "q" in a]
    if scope == 2 and "precede" in pattern:
        starts = starts[:1]
    return all(_chain(pattern, scope, w[start:]) for start in starts)


def _chain(pattern: str, scope: int, w: list[frozenset[str]]) -> bool:
    """From the beginning of a scope on; `end` is where r ends it."""
    at = {key: [i for i, a in enumerate(w) if key in a] for key in "prst"}
    ends = at["r"] if scope in (1, 3) else [len(w)]
    if not ends:
        return True
    end = ends[0]
    shown = range(end if scope in (1, 3) else len(w) // 2)
    match pattern:
        case "S, T precede P":
            first = next((i for i in at["p"] if i < end), None)
            return first is None or any(i < j <= first for i in at["s"] for j in at["t"] if i < first)
        case "P precedes S, T":
            chained = [i for i in at["s"] if any(i < j < end for j in at["t"]) and i < end]
            if scope in (1, 3):
                return not chained or any(k <= chained[0] for k in at["p"])
            return not chained or any(k <= at["s"][0] for k in at["p"])
        case "P responds to S, T":
            # Where r ends the scope, t comes at last with it, and p may come later.
            asked = [i for i in at["s"] if i in shown and any(i < j <= end for j in at["t"])]
            if scope == 2:
                return all(any(k >= min(j for j in at["t"] if j > i) for k in at["p"]) for i in asked)
            return all(any(i < j <= min(k, end) for j in at["t"] for k in at["p"]) for i in asked)
    return all(any(i <= j < end and j < k <= end for j in at["s"] for k in at["t"]) for i in at["p"] if i in shown)


def _holds(pattern: str, part: list[frozenset[str]], *, closed: bool) -> bool:
    reach = len(part) if closed else len(part) // 2
    match pattern:
        case "absence of P":
            return all("p" not in a for a in part)
        case "universality of P":
            return all("p" in a for a in part)
        case "S precedes P":
            first = next((i for i, a in enumerate(part) if "p" in a), None)
            return first is None or any("s" in a for a in part[: first + 1])
    return all("p" not in a or any("s" in b for b in part[i:]) for i, a in enumerate(part[:reach]))


def test_bounds_in_time() -> None:
    assert to_text(one("s responds to p within 1.5s").formula) == "G (p -> F[<=1500ms] s)"
    late = one("s responds to p within 500ms after q until r")
    assert to_text(late.formula) == "G (q && !r -> (p -> !r U[<=500ms] (s && !r)) W r)"
    assert [(span.text, bound) for span, bound in late.bounds] == [("500ms", (0, 500))]
    assert late.text == to_text(late.formula)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    PATTERNS_WRONG,
)
def test_mistakes(text: str, code: str, message: str | None) -> None:
    with pytest.raises(DiagnosticError) as caught:
        one(text)
    (found,) = caught.value.diagnostics
    assert found.code == code
    assert message is None or found.message == message


@pytest.mark.parametrize(
    ("text", "code", "place", "hint"),
    [
        ("absence b", "E322", "b", "write `absence of b`"),
        ("existence p after r", "E322", "p", "write `existence of p after r`"),
        ("bounded existence p", "E322", "existence", "write `bounded existence of p`"),
        ("existance of p", "E322", "of", "did you mean `existence of`?"),
        (
            "!(absence of p)",
            "E322",
            "of",
            "a pattern is a whole property; in a formula write `G !p` for `absence of p`",
        ),
        ("F p && existence of q", "E322", "of", "write `F p` for `existence of p`"),
        ("G (q responds to p)", "E322", "responds", "write `G (p -> F s)` for `s responds to p`"),
        ("G (q precedes p)", "E322", "precedes", "write `!p W s` for `s precedes p`"),
        ("q responds p", "E322", "responds", "write `s responds to p`"),
        ("F p after q", "E322", "after", "a scope belongs to a pattern: `absence of p after q`"),
        ("absence of p within 5s", "E322", "within", "only `s responds to p` takes `within 5s`"),
        ("q responds to p after r within 5s", "E319", "within 5s", "write `q responds to p within 5s after r`"),
        (
            "q responds to p between r and s within",
            "E319",
            "within",
            "write `q responds to p within 5s between r and s`",
        ),
    ],
)
def test_near_misses(text: str, code: str, place: str, hint: str) -> None:
    with pytest.raises(DiagnosticError) as caught:
        one(text)
    (found,) = caught.value.diagnostics
    assert found.span is not None and found.hint is not None
    assert (found.code, found.span.text) == (code, place)
    assert found.hint.endswith(hint)


def test_the_words_of_patterns_are_names_elsewhere() -> None:
    for text in ("before && after", "G (precedes -> F responds)", "absence || of", "m@between && globally"):
        assert to_text(one(text).formula) == text
