"""What each operator does to a small source, and that what it makes is Python with the same lines."""

from __future__ import annotations

import pathlib
import textwrap

import pytest

from tests.mutation.__main__ import EQUIVALENT, ROOT, equivalent
from tests.mutation.operators import compiles, mutants


def made(source: str) -> dict[str, list[str]]:
    """The mutated texts by operator."""
    text = textwrap.dedent(source).encode()
    found: dict[str, list[str]] = {}
    for mutant in mutants("m.py", text):
        found.setdefault(mutant.operator, []).append(mutant.apply(text).decode())
    return found


@pytest.mark.parametrize(
    ("operator", "source", "expected"),
    [
        ("comparison", "a < b", ["a <= b", "a >= b"]),
        ("comparison", "a == b is not c", ["a != b is not c", "a == b is c"]),
        ("comparison", "a not in b", ["a in b"]),
        ("comparison", "(a)==(b)", ["(a)!=(b)"]),
        ("comparison", "a[1:2] <= '<='", ["a[1:2] < '<='", "a[1:2] > '<='"]),
        ("±1", "f(3, 0)", ["f(4, 0)", "f(2, 0)", "f(3, 1)", "f(3, (-1))"]),
        ("±1", "f(64, 10_000)", ["f(65, 10_000)", "f(63, 10_000)"]),  # the second is a limit
        ("constant", "f(True)", ["f(False)"]),
        ("constant", "f('a', \"é\")", ["f('a~', \"é\")", "f('a', \"é~\")"]),
        ("constant", "f('''a''', f'{b}', b'')", []),
        ("and/or", "x = a and b", ["x = a or b"]),
        ("and/or", "x = (a  # and\n    or b)", ["x = (a  # and\n    and b)"]),
        ("not", "x = not a", ["x = a"]),
        ("not", "if a: b", ["if (not (a)): b"]),
        ("not", "x = [a for a in b if a.c]", ["x = [a for a in b if (not (a.c))]"]),
        ("not", "x = a if b else c", ["x = a if (not (b)) else c"]),
        ("not", "while True: a", []),
        ("return value", "def f():\n    return a + (\n        b)", ["def f():\n    return None\n"]),
        ("return value", "def f():\n    return None", []),
        ("return value", "def f():\n    return False", []),
        ("constant", "def f():\n    return False", ["def f():\n    return True"]),
        ("constant", 'T = Literal["a"]', []),
        ("statement deletion", "a(\n  b)\nc", ["pass\n\nc", "a(\n  b)\npass"]),
        ("statement deletion", "a.b = 1", ["pass"]),
        ("statement deletion", "a = 1", []),
        ("statement deletion", "for a in b:\n    break", ["for a in b:\n    pass"]),
        ("statement deletion", "'a docstring'\nimport a\nassert b", []),
        ("dropped argument", "x = f(a, b)", ["x = f(b)", "x = f(a)"]),
        ("dropped argument", "x = f(a, b=c)", ["x = f(b=c)", "x = f(a)"]),
        ("dropped argument", "x = f(\n    a,\n)", ["x = f(\n,\n)"]),
        ("arithmetic", "x = a + b - c", ["x = a + b + c", "x = a - b - c"]),
        ("arithmetic", "a += 1", ["a -= 1"]),
        ("arithmetic", "x = a // b * c ** d", ["x = a // b // c ** d", "x = a * b * c ** d", "x = a // b * c * d"]),
        ("arithmetic", "x = 'a' + b", []),
        ("arithmetic", "x: int | None = a | b", ["x: int | None = a & b"]),
        ("unary", "x = -a", ["x = a"]),
        ("sorted/min/any", "x = sorted(a)", ["x = list(a)"]),
        ("sorted/min/any", "x = min(a, key=b)", ["x = max(a, key=b)"]),
        ("sorted/min/any", "x = any(a)", ["x = all(a)"]),
        ("sorted/min/any", "x = sorted(a, key=b)", []),
    ],
)
def test_what_an_operator_makes(operator, source, expected):
    assert made(source).get(operator, []) == expected


def test_annotations_and_decorators_stay():
    assert made("@a(1, b=True)\ndef f(x: Literal['a'] = 1) -> 'b':\n    x: Literal['a']") == {}


def test_a_mutant_knows_its_place():
    source = b"import a\nclass C:\n    x = 1\n    def f(self):\n        if (a <\n                b):\n            g()\n"
    found = {(m.operator, m.function): m for m in mutants("p/m.py", source)}
    inner = found["comparison", "C.f"]
    assert (inner.line, inner.lines, inner.imported) == (5, (5, 6), False)
    assert inner.key[0] == "p/m.py" and inner.before == "if (a <" and inner.after == "if (a >="
    assert found["statement deletion", "C.f"].lines == (7, 7)
    assert found["±1", "C"].imported


def test_the_name_of_a_mutant_does_not_depend_on_where_its_line_is():
    source = b"def f():\n    return a + b\n"
    assert {m.key for m in mutants("m.py", source)} == {m.key for m in mutants("m.py", b"\n# more\n" + source)}


@pytest.mark.slow
@pytest.mark.parametrize(
    "path", ["llfsm_verify/extensions/hoa/reading.py", "llfsm_verify/kripke/kernels/exploration.py"]
)
def test_real_mutants_are_python_with_the_same_lines(path):
    source = pathlib.Path(path).read_bytes()
    found = mutants(path, source)
    texts = [mutant.apply(source) for mutant in found]
    assert len(found) > 100 and source not in texts
    assert all(text.count(b"\n") == source.count(b"\n") for text in texts)
    tenth = texts[::10]
    assert sum(map(compiles, tenth)) > 0.95 * len(tenth)


@pytest.mark.slow
def test_what_is_said_to_be_equivalent_is_a_mutant_of_the_source() -> None:
    """An entry whose line has changed is looked at again, or goes."""
    reasons = equivalent(EQUIVALENT)
    there = {m.key for file in {key[0] for key in reasons} for m in mutants(file, (ROOT / file).read_bytes())}
    assert [key for key in reasons if key not in there] == []
    assert all(len(reason.split()) > 3 for reason in reasons.values())
