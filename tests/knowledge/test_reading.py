"""Theories as they are read, and what is said about wrong ones."""

from __future__ import annotations

from random import Random

import pytest

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source
from llfsm_verify.knowledge.codes import CODES
from llfsm_verify.knowledge.reading import MAX_DIAGNOSTICS, read_theory
from llfsm_verify.knowledge.theory import Literal, Theory
from tests.knowledge.theories import random_theory
from tests.knowledge.wrong import WRONG, Wrong
from tests.quick import examples

LARGE = 10_000


def read(text: str) -> Theory:
    return read_theory(Source("folder/some.d", text))


def mistakes(text: str) -> list[Diagnostic]:
    with pytest.raises(DiagnosticError) as caught:
        read(text)
    return list(caught.value.diagnostics)


def places(text: str) -> list[tuple[str, int]]:
    return [(d.code, d.span.line) for d in mistakes(text) if d.span is not None]


@pytest.mark.parametrize(
    "case",
    [pytest.param(c, id=c.reason, marks=[pytest.mark.slow] if len(c.text) > LARGE else []) for c in WRONG],
)
def test_a_wrong_theory_gets_its_diagnostic_at_its_place(case: Wrong) -> None:
    assert case.text.count("§") == 1
    source = Source("wrong.d", case.text.replace("§", ""))
    with pytest.raises(DiagnosticError) as caught:
        read_theory(source)
    expected = (case.code, *source.position(case.text.index("§")))
    found = caught.value.diagnostics
    assert [(d.code, d.span and d.span.line, d.span and d.span.column) for d in found] == [expected]
    assert found[0].message.startswith(case.message)
    assert found[0].hint and found[0].hint.startswith(case.hint)
    assert max(map(len, found[0].render().split("\n"))) < 400


def test_what_a_theory_says() -> None:
    theory = read("""\
% a comment with a dot. and {braces}
input{a,b}. input { c }.
L1:a,~b->p.L2: {p} => ~q. % another one
c ~> q.
L3: {} => q. L2 > L3. L2>L3.
output{b q,"name outside"}.
output { b p }.
""")
    assert (theory.name, list(theory.inputs)) == ("some", ["a", "b", "c"])
    assert [(r.label, [*map(str, r.body)], r.kind, str(r.head)) for r in theory.rules] == [
        ("L1", ["a", "~b"], "strict", "p"),
        ("L2", ["p"], "defeasible", "~q"),
        ("", ["c"], "defeater", "q"),
        ("L3", [], "defeasible", "q"),
    ]
    assert theory.superior == {(1, 3)}
    assert [(o.atom, o.text) for o in theory.outputs] == [("q", "name outside"), ("p", "p")]
    assert theory.output("q") == theory.output("name outside") == theory.outputs[0]
    assert theory.output() is None and theory.output("r") is None
    assert [r.span.text for r in theory.rules] == ["L1:a,~b->p", "L2: {p} => ~q", "c ~> q", "L3: {} => q"]
    assert theory.inputs["c"].line == 2 and theory.source.name == "folder/some.d"
    assert theory.atoms("q") == ["p", "q"] and theory.atoms("a") == []
    assert str(Literal("a").complement.complement) == "a"


def test_all_mistakes_of_a_file_are_said_in_its_order() -> None:
    assert places("""\
input {a, b}. input {a}.
R: a => q
S: b => ~q.
T: !b => q.
R > S. S > R. R > X.
c => q.
U: ~d => ~a.
q => d.
output {i q, "q"}.
output {b e, "e"}.
""") == [
        ("E576", 1),
        ("E570", 2),
        ("E570", 4),
        ("E573", 5),
        ("E574", 5),
        ("E571", 6),
        ("E571", 7),
        ("E577", 7),
        ("E578", 9),
        ("E571", 10),
    ]


def test_nothing_is_said_that_only_follows_from_a_broken_statement() -> None:
    follows = "input {a}.\nR: a =>> q.\nS: q => r. R > S.\nT: q, zz => ~r. {} => r.\noutput {b r}.\n"
    assert places(follows) == [("E570", 2), ("E571", 4)]
    assert places("input {a}.\na => q.\noutput {b, q}.\n") == [("E570", 3)]


def test_a_statement_of_several_lines_is_not_quoted() -> None:
    (first, second) = mistakes("input {a}.\nR: a\n  => q\nS: a\n=> ~q, a.\noutput {b q}.\n")
    assert (first.message, first.hint) == ("a `.` is missing at the end of the statement", "write `.` there")
    assert second.message == "`.` after the statement is expected, and there is `,`"
    (only,) = mistakes(f"input {{a}}.\nR: {'a, ' * 30} a => q\noutput {{b q}}.\n")
    assert only.message == first.message


def test_long_names_are_cut_in_messages() -> None:
    name, other, broken = "x" * 5000, "y" * 5000, "z" * 5000
    text = f"input {{a}}. {name}: a => q. {name}: {other} => a. {other} > {name}. {name} > {name}."
    found = mistakes(f"{text} a => {name}. {name} => {name}. output {{{name} {name}}}. {broken} {{a}}. a => q")
    found += mistakes(f"R: {{}} => q. {other} > R. output {{b q}}.")
    assert {d.code for d in found} == {"E570", "E571", "E572", "E573", "E574", "E576", "E577", "E578"}
    assert max(len(d.message) + len(d.hint or "") for d in found) < 500


def test_characters_that_cannot_be_shown_are_named() -> None:
    (first, second) = mistakes('input {a}.\na \x8f=> q.\na => q.\noutput {b q, "x\x85"}.\n')
    assert first.message.endswith("and there is U+008F")
    assert second.message.endswith("cannot be shown") and second.hint == 'write `output {b q, "q"}.`'


@pytest.mark.parametrize(
    ("text", "lines"),
    [
        ("input {a}\nR: a => q\n\noutput {b q}", [1, 2, 4]),  # dots are missing at the ends of lines
        ("input {a}.\nR: a =>\nS: a => q.\noutput {b q}.", [3]),  # `S` as the head of R, and then a colon
        ("input {a}.\nR: a, => q.\nS: => q. q: a -> q.\noutput {b q}.", [2, 3]),
        ("input {a}.\nR: (a) => q.\nS: a => q.\noutput {b q}.", [2]),
        ("input {a}.\nR > .\nS: a => q.\noutput {b q}.", [2]),
        ("input {a}.\nS: a => q. }\noutput {b q}.", [2]),
        ("input {a\nS: a => q.\noutput {b q}.", [2]),
        ("input {a}.\na => q\n{} => ~q\n~a => q.\noutput {b q}.", [2, 3]),
        ("inputs {a}.\nS: a => q.\noutput {b q}.", [1]),
        ("x", [1]),
    ],
)
def test_reading_goes_on_at_the_next_statement(text: str, lines: list[int]) -> None:
    found = mistakes(text)
    assert [d.span and d.span.line for d in found if d.code == "E570"] == lines, found
    assert {d.code for d in found} - {"E570"} <= {"E578"}


def test_several_cycles_are_said_but_not_all_of_many() -> None:
    several = "p => q. q => p. r => s. s => t. t => r. output {b q}."
    assert [(d.code, d.message) for d in mistakes(several)] == [
        ("E572", "`q` depends on itself: q ← p ← q"),
        ("E572", "`s` depends on itself: s ← r ← t ← s"),
    ]
    assert len(mistakes("".join(f"p{i} => p{i}. " for i in range(99)))) <= MAX_DIAGNOSTICS


def test_of_many_mistakes_the_first_are_said() -> None:
    assert len(mistakes("a b.\n" * 200)) == MAX_DIAGNOSTICS
    assert len(mistakes("".join(f"x{i} => y{i}.\n" for i in range(200)))) == MAX_DIAGNOSTICS


PIECES = (
    ".",
    ",",
    "{",
    "}",
    "~",
    "->",
    "=>",
    "~>",
    ">",
    ":",
    "input",
    "output",
    "name",
    '"',
    "b",
    "%",
    "\n",
    "p0",
    "é",
    "!",
)


@pytest.mark.slow
def test_changed_texts_are_read_or_get_diagnostics() -> None:
    read_well = 0
    for seed in range(examples(4000)):
        random = Random(seed)
        text = random_theory(random).text(random)
        for _ in range(random.randint(1, 4)):
            start = random.randrange(len(text))
            end = start + random.choice((0, 1, 1, 3))
            text = text[:start] + random.choice(("", random.choice(PIECES), f" {random.choice(PIECES)} ")) + text[end:]
        found: tuple[Diagnostic, ...] = ()
        try:
            read_well += bool(read(text).rules)
        except DiagnosticError as error:
            found = error.diagnostics
        assert all(d.code in CODES and d.hint and d.render() for d in found)
    assert read_well > 20
