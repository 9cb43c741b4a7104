"""Parsers by kept tables against lark's parsers of the same grammars: what is read, as what, and what is refused."""

from __future__ import annotations

from functools import cache
from importlib import resources
from random import Random

import pytest
from lark import Lark, Tree, UnexpectedCharacters, UnexpectedToken
from lark import Token as LarkToken

from llfsm_verify.grammars import END, GRAMMAR, Parser, Token, Unfit, Unknown, parser_of
from llfsm_verify.logic.parsing.tokens import tokenise

LANGUAGE = (
    "a && b[2] == 3 || not m@{A, B} and x", "f(x, -1) >= 0x10", "a ? b : c ? 1.5 : ~d & 1 | 2 ^ 3 << 4 >> 5",
    "a = 1; if (b) { c += 2; } else if (d) ; else c = 3;", "for (i in 0..3) a[i].b = i * 2 % 3 - -1; // done",
    "for (int i = 0; i < 3; ++i) { } 0..-3 y = 3; bool z; /* well */ suspend(m); x = choose(1, 2); x = choose(0..3);",
    "", "!true", '"x" != false',
)  # fmt: skip
FORMULAS = ("G (a -> F b) <-> c xor d && e || !f", "a.b[i + 1] == -3 U f(x, y) W m@{A, B}", "true", "(X X a) S T() * 2")
SIGNS = "+-*/%()[]{};,.:?<>=!&|^~@\"'$ \n09ax"


def mutated(random: Random, text: str) -> str:
    """The text with a few characters more, and a few fewer."""
    for _ in range(random.randrange(3)):
        at = random.randrange(len(text) + 1)
        text = text[:at] + random.choice(SIGNS) + text[at + random.randrange(3) :]
    return text


@cache
def larks(package: str, starts: tuple[str, ...]) -> Lark:
    grammar = resources.files(package).joinpath(GRAMMAR).read_text("utf-8")
    return Lark(
        grammar, parser="lalr", lexer="basic", start=list(starts), keep_all_tokens=True, maybe_placeholders=False
    )


@cache
def ours(package: str, starts: tuple[str, ...]) -> Parser:
    return parser_of(package, object(), starts)


def plain(part: object) -> object:
    """A tree as lists of the texts of its tokens."""
    if isinstance(part, Tree):
        return [plain(child) for child in part.children]
    if isinstance(part, list):
        return [plain(child) for child in part]
    return part.text if isinstance(part, Token) else str(part)


LANGUAGE_STARTS = ("guard", "actions")


@pytest.mark.slow
@pytest.mark.parametrize("start", LANGUAGE_STARTS)
def test_guards_and_actions(start: str) -> None:
    random, read = Random(1), 0
    lark, parser = larks("llfsm_verify.language", LANGUAGE_STARTS), ours("llfsm_verify.language", LANGUAGE_STARTS)
    for _ in range(300):
        text = mutated(random, random.choice(LANGUAGE))
        try:
            expected: object = plain(lark.parse(text, start=start))
            read += 1
        except UnexpectedCharacters as error:
            expected = error.pos_in_stream
        except UnexpectedToken as error:
            expected = error.token.type, error.expected
        try:
            found: object = plain(parser.parse(parser.tokens(text), start))
        except Unknown as unknown:
            found = unknown.at
        except Unfit as unfit:
            found = unfit.token.type, unfit.expected
        assert found == expected, text
    assert 20 < read < 280


@pytest.mark.slow
def test_formulas() -> None:
    random, read = Random(1), 0
    lark, parser = larks("llfsm_verify.logic", ("start",)), ours("llfsm_verify.logic", ("start",))
    for _ in range(300):
        words = [word for word in tokenise(mutated(random, random.choice(FORMULAS))) if word.type != "NEWLINE"]
        parse = lark.parse_interactive()
        try:
            for i, word in enumerate(words):
                parse.feed_token(LarkToken(word.type, word.text, i))
            expected: object = plain(parse.feed_token(LarkToken(END, "", len(words))))
            read += 1
        except UnexpectedToken as error:
            expected = error.token.start_pos, error.expected
        tokens = [Token(word.type, word.text, i, i) for i, word in enumerate(words)]
        try:
            found: object = plain(parser.parse([*tokens, Token(END, "", len(words), len(words))], "start"))
        except Unfit as unfit:
            found = unfit.token.start, unfit.expected
        assert found == expected, words
    assert 20 < read < 280


def test_the_last_token_has_to_be_there() -> None:
    parser = ours("llfsm_verify.language", LANGUAGE_STARTS)
    with pytest.raises(ValueError, match="last token"):
        parser.parse([Token("NAME", "a", 0, 1)], "guard")
