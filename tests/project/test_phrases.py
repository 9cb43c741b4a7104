"""Phrases that sound translated do not come back: in pages, and in what the commands say.

The list has phrases, not words: `behind` is a word of plain English, `behind the name` is not what an English writer
says. Each phrase has what to write instead. A place where a phrase is right is named in EXCEPTIONS, with the reason.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

PHRASES = {
    r", too\b": "also, before the verb",
    r"\bbehind (it|them|this|each|every|any|some|others|the (name|others)|its owner)\b": "after",
    r"\b(right|nothing|before or|added|a time is expected) behind\b": "after; directly after",
    r"\bbehind `": "after",
    r"(?<!there )\b(is|are|was) none\b(?! of the (machines|states))": "is not a valid …",
    r"(?<!there )(?<!There )\b(is|are|was|were) no (?!longer\b|more\b)": "is not a …",
    r"\bis none of \{": "is not one of",
    r"\bfor ever\b": "forever",
    r"\bone a line\b|…\}?` a line\b": "one per line",
    r"\bas fast as it goes\b": "as fast as possible",
    r"\ba page of its own\b(?= to be|;|:|\.)": "a link: see …",
    r"\ball else\b": "everything else; the rest",
    r"(`|key|name) is there twice\b": "appears twice",
    r"\bstands? (where|here twice|inside its)\b": "is; is used; appears",
    r"\bcomes and goes with\b": "is started and stopped by",
    r"\bwrite it flatter\b": "use fewer levels of nesting",
    r"\bvalues without end\b": "infinitely many values",
    r"\bor mend (it|the)\b": "or correct",
    r"\b(begins?|made|save it|explores?|files|all) anew\b": "again; from the beginning",
    r"\bbut for (the|this)\b": "except",
    r"\bTo that comes\b": "There is also",
    r"\bsay no more of it\b|\bsays no more of it\b": "say nothing more about it",
    r"\bneither a \w+ nor has it\b": "is not a … and has no …",
    r"\bemptily\b": "vacuously",
    r"\bshall\b": "should; must; is to",
    r"\b(that|which|what) there is not\b": "that does not exist",
    r"\bknows? nothing of\b|\bsays? (nothing|more) of\b": "about",
    r"\b(expected|needed), this is\b": "but this is",
    r"\bwants? the name\b": "needs the name",
    r"\bis taken away\b": "is removed",
    r"\bwhatever came after\b": "whatever comes after",
    r"\bwatched on\b": "watching goes on",
    r"\bis a slip of\b": "looks misspelt",
    r"\bcloser than a cycle\b": "by how much shorter",
    r"\buses? (it|them) up\b": "removes",
    r"\b(for|by) another reason than\b": "for the wrong reason",
    r"\bof one length after the other\b": "of growing length",
    r"\bstay what they look like\b": "are not turned into",
    r"\b(that|it|this) is meant here\b|\bthat are meant so\b": "is intended",
    r"\bis all we had\b": "we had only",
    r"\b[Ss]ays of (each|every)\b": "for each; lists which",
    r"\blead (it|them) out\b|\bleads (it|them) out\b": "leave; add a transition that leaves",
}
"""Phrases, as regular expressions, and what to write instead."""

EXCEPTIONS = {
    ("models/press/README.md", "behind it"): "the helper stands behind the press",
    ("models/xray/README.md", "behind it"): "the flattener is behind the target",
    ("models/microwave/README.md", "shall"): "the slides say it",
}
"""Where a phrase is right: page or module and the words found, with the reason."""

PAGES = sorted(
    path.as_posix()
    for path in (*Path().glob("*.md"), *Path("docs").rglob("*.md"), *Path("models").rglob("*.md"))
)  # fmt: skip
MODULES = sorted(path.as_posix() for path in Path("llfsm_verify").rglob("*.py"))

PATTERNS = {re.compile(phrase): instead for phrase, instead in PHRASES.items()}


def texts(module: str) -> Iterator[tuple[int, str]]:
    """The lines and texts of a module that a user may read: strings without docstrings, `{}` for what is filled in."""
    tree = ast.parse(Path(module).read_text(encoding="utf-8"))
    passed_over = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            passed_over |= {id(value) for value in node.values}
            yield node.lineno, "".join(v.value if isinstance(v, ast.Constant) else "{}" for v in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in passed_over:
            yield node.lineno, node.value


def found(text: str) -> Iterator[tuple[str, int, str]]:
    """The phrases in a text: the words, where they begin, and what to write instead."""
    for pattern, instead in PATTERNS.items():
        for match in pattern.finditer(text):
            yield match[0], match.start(), instead


@pytest.mark.parametrize("page", PAGES)
def test_a_page_has_none_of_the_phrases(page):
    text = Path(page).read_text(encoding="utf-8")
    wrong = [
        f"{page}:{text.count(chr(10), 0, start) + 1}: `{words}`: write {instead}"
        for words, start, instead in found(re.sub(r"\n(?!\n)", " ", text))
        if (page, words) not in EXCEPTIONS
    ]
    assert not wrong, "\n".join(wrong)


def test_what_commands_say_has_none_of_the_phrases():
    wrong = [
        f"{module}:{line}: `{words}`: write {instead}"
        for module in MODULES
        for line, text in texts(module)
        for words, _, instead in found(text)
        if (module, words) not in EXCEPTIONS
    ]
    assert not wrong, "\n".join(wrong)


def test_exceptions_are_still_there():
    for place, words in EXCEPTIONS:
        assert words in Path(place).read_text(encoding="utf-8"), (place, words)


@pytest.mark.parametrize(
    ("text", "count"),
    [
        ("`p` holds, too", 1), ("`a` is none of 1, 2", 1), ("write it behind `:`", 1), ("there is none", 0),
        ("a name that is no identifier", 1), ("there is no name", 0), ("it is no longer so", 0), ("not too many", 0),
    ],
)  # fmt: skip
def test_the_list_finds_what_it_should(text, count):
    assert len({start for _, start, _ in found(text)}) == count
