"""The colours of editors: our TextMate grammars say of each character what our lexers and PyYAML say of it."""

from __future__ import annotations

import json
import re
import string
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from random import Random

import pytest
import yaml

from llfsm_verify.arrangement.keys import VOCABULARY
from llfsm_verify.grammars import Unknown
from llfsm_verify.language import atoms, scope
from llfsm_verify.language.parser import _parser
from llfsm_verify.logic.lines import has_header
from llfsm_verify.logic.parsing.definitions import is_definition
from llfsm_verify.logic.parsing.tokens import _PATTERNS, KEYWORDS, TEMPORAL_PAIRS, tokenise
from tests import outside
from tests.extensions.editor import textmate
from tests.extensions.editor.textmate import LANGUAGE, LTL, SYNTAXES, YAML
from tests.quick import examples

pytestmark = [outside.needs("node", "textmate"), pytest.mark.slow]

SIGNS = string.punctuation + "".join(sorted({c for c in "".join(_PATTERNS.values()) if not c.isascii()}))
TEMPORAL = {"G", "F", "X", "Y", "Z", "O", "H", "INITIALLY", *TEMPORAL_PAIRS}
KINDS = {
    "keyword.operator.logical": {"IFF", "IMPLIES", "NOT", "AND", "OR", "XOR"},
    "keyword.operator.temporal": TEMPORAL,
    "keyword.operator.comparison": {"COMPARE"},
    "keyword.operator.assignment": {"ASSIGN"},
    "keyword.operator.arithmetic": {"MINUS", "ARITHMETIC"},
    "keyword.operator.quantifier": {"QUESTION"},
    "keyword.operator.state": {"AT"},
    "constant.language.boolean": {"TRUE", "FALSE"},
    "constant.numeric": {"NUMBER"},
    "string.quoted": {"STRING"},
    "punctuation": {"LPAR", "RPAR", "LSQB", "RSQB", "LBRACE", "RBRACE", "COMMA", "COLON", "DOT"},
    "variable": {"NAME"},
    "invalid.illegal": {"OPEN_QUOTE", "OTHER"},
}
"""The scope of each token of a formula; a name may have others also."""
SCOPES = {token: scope for scope, tokens in KINDS.items() for token in tokens}
OF_NAMES = ("variable.", "support.function", "keyword.other.pattern", "entity.name")
IN_HEADER = ("keyword.control.kind", "entity.name.function.property", "keyword.control.family", "variable.parameter")


def fits(kind: str, text: str, found: str) -> bool:
    """Whether what a lexer calls `kind` may have the scopes."""
    if text == ";":
        return found.startswith("punctuation.separator.sequence")
    last = found.rsplit(" ", maxsplit=1)[-1]
    return last.startswith(OF_NAMES) if kind == "NAME" else SCOPES[kind] in found and "comment" not in found


def wrong(text: str, found: textmate.Scopes) -> Iterator[tuple[str, str, str]]:
    """The tokens of a property file that have other scopes than the lexer's, outside the heads of lines."""
    named = [False] * len(text)
    for token in tokenise(text):
        if token.type == "NEWLINE":
            continue
        named[token.start : token.end] = [True] * (token.end - token.start)
        begins = text.rfind("\n", 0, token.start) + 1
        begins += len(text[begins:]) - len(text[begins:].lstrip(" \t"))
        here = [scope.split(" ")[0] for scope in found[token.start : token.end]]
        if any(scope.startswith(IN_HEADER) for scope in here):
            if not has_header(text, begins) and not is_definition(text, begins):
                yield token.type, token.text, found[token.start]
            continue
        signs = [i for i in range(token.start, token.end) if not text[i].isspace()]
        if not all(fits(token.type, token.text, found[i]) for i in signs):
            yield token.type, token.text, found[token.start]
    for i, scopes in enumerate(found):
        if named[i] == ("comment" in scopes) and not text[i].isspace():
            yield "comment", text[i:].split("\n", maxsplit=1)[0], scopes


def test_each_word_and_sign_of_formulas_has_its_scope() -> None:
    signs = [a + b + c for a in SIGNS for b in ("", *SIGNS) for c in ("", *SIGNS) if b or not c]
    alone = [t[0] for sign in signs if len(t := tokenise(sign)) == 1 and t[0].text == sign]
    alone += [t for word in (*KEYWORDS, "initially p") for t in tokenise(word)[:1]]
    assert {"<->", "=>", "[]", "⊕", "xor", "S", "initially"} <= {t.text for t in alone}
    texts = [f"p {t.text} p" for t in alone]
    for token, text, found in zip(alone, texts, textmate.tokenise([(LTL, text) for text in texts]), strict=True):
        if token.type != "OPEN_QUOTE":
            assert all(fits(token.type, token.text, s) for s in found[2 : 2 + len(token.text)]), (text, found)


def test_each_terminal_of_the_grammar_is_in_the_table() -> None:
    declared = re.findall(r"^%declare (.*)$", Path("llfsm_verify/logic/grammar.lark").read_text(), re.MULTILINE)
    assert {name for line in declared for name in line.split()} <= SCOPES.keys()


def test_each_word_and_sign_of_guards_and_actions_has_its_scope() -> None:
    lines = [line.split(" // ")[0] for line in Path("llfsm_verify/language/grammar.lark").read_text().split("\n")]
    words = {w for line in lines if not line.startswith("//") for w in re.findall(r'"((?:[^"\\]|\\.)+)"', line)}
    words -= {"[A-Za-z_][A-Za-z0-9_]*"}
    assert {"||", "or", "<<=", "if", "for", "..", "++", "@", ";", "?"} <= words
    kinds = {"or and not": "keyword.operator.logical", "if else for in": "keyword.control", "true false": "constant"}
    by_word = {word: scope for text, scope in kinds.items() for word in text.split()}
    order = sorted(words)
    for word, found in zip(order, textmate.tokenise([(LANGUAGE, f"a {word} b") for word in order]), strict=True):
        expected = by_word.get(word, "punctuation" if word in "()[]{},;." else "keyword.operator")
        assert {s.startswith(expected) for s in found[2 : 2 + len(word)]} == {True}, (word, found)


def test_each_function_is_known() -> None:
    functions = {*atoms.PROPERTY_FUNCTIONS}
    texts = [(LTL, f"{name}(p)") for name in functions]
    texts += [(LTL, f"m.{name}(p)") for name in atoms.MACHINE_FUNCTIONS]
    texts += [(LTL, f"m.{name}") for name in atoms.OBSERVATIONS]
    in_guards = {"after", "after_ms", scope.CHOOSE, *scope.COMMANDS, *(functions & set(scope.FUNCTIONS))}
    texts += [(LANGUAGE, f"{name}(p)") for name in in_guards]
    for (_, text), found in zip(texts, textmate.tokenise(texts), strict=True):
        at = 2 if text.startswith("m.") else 0
        assert found[at].startswith("support.function"), text


def property_files() -> list[Path]:
    return sorted(path for folder in ("models", "properties", "examples") for path in Path(folder).rglob("*.ltl"))


def test_property_files_have_the_scopes_of_the_lexer() -> None:
    texts = [path.read_text() for path in property_files()]
    assert len(texts) > 25
    for path, text, found in zip(property_files(), texts, textmate.tokenise([(LTL, t) for t in texts]), strict=True):
        assert not [scope for scope in found if "invalid" in scope], path
        if "automaton" not in text:
            assert list(wrong(text, found)) == [], path


HEADS = """\
# syntax: llfsm
assume fair: G F sampled(car)
forbid initially hurry:   ew@RED ew@AMBER
define moving: drive != HALT
automaton never bad: "some folder/bad.hoa" # why
automaton good:           good.hoa
for l in {ns, ew}: served: G F l@GREEN
for a in {ns, ew}, i in 0..2:
  counted: G (a@GREEN -> phase != i)
answered: ew@GREEN responds to car within 16s
calm: bounded existence of car after before until within
"""


def test_heads_of_lines_and_patterns() -> None:
    (found,) = textmate.tokenise([(LTL, HEADS)])

    def at(words: str, part: str = "") -> str:
        place = HEADS.index(words) + words.index(part or words)
        (only,) = {scope for scope in found[place : place + len(part or words)] if scope}
        return only.removesuffix(".llfsm-ltl")

    for words in ("assume", "forbid initially", "define", "automaton never", "automaton good"):
        assert at(words, words.removesuffix(" good")) == "keyword.control.kind"
    for name in ("fair", "hurry", "moving", "bad:", "good:", "served", "counted", "answered", "calm"):
        assert at(name, name.strip(":")) == "entity.name.function.property"
    assert at("syntax").endswith("keyword.other.directive")
    assert at('"some folder/bad.hoa"') == "string.quoted.double"
    assert at("good.hoa") == "string.unquoted.path" and at("# why") == "comment.line.number-sign"
    assert at("for l", "for") == at("l in", "in") == at("i in", "in") == "keyword.control.family"
    assert at("{ns", "ns") == "variable.parameter"
    for words in ("responds", "to car", "within 16s", "bounded", "existence", "of car", "after before"):
        assert at(words, words.split()[0]) == "keyword.other.pattern", words
    assert "keyword.other.unit" in at("16s", "s")


PIECES = (
    *KEYWORDS, *"pqm", "initially", "entered", "fired", "cycle", "m@S", "m@{A, G}", "m.fired(S, 0)", "m.T", "before",
    "responds to", "absence of", "within", "3", "0x1F", "2.5s", "16ms", '"G F"', '"', "\n", "\n", "# a G\n", "\t",
    *(sign for sign in SIGNS if sign not in "$'`\\"), "<->", "-->", "[]", "<>", "==", "!=", ":=", "/\\", "&&", "é",
)  # fmt: skip


def test_random_texts_have_the_scopes_of_the_lexer() -> None:
    random = Random(44)
    texts = []
    for _ in range(examples(2_000)):
        pieces = random.choices(PIECES, k=random.randint(1, 12))
        texts.append("".join(piece + random.choice((" ", " ", "", "  ")) for piece in pieces))
    assert any("initially" in text for text in texts)
    for text, found in zip(texts, textmate.tokenise([(LTL, text) for text in texts]), strict=True):
        assert list(wrong(text, found)) == [], text


WORDS = (
    *"xyz", "m@A", "m@{A, B}", '"G"', "if", "else", "for", "in", "and", "or", "not", "true", "self", "after(3)", "0x1F",
    "0b10", "2.5", "12", "a.b", "t[1]", "int8", "..", "//", "// x = 1;\n", "/* a\n and */", "\n", "?", ":", "++", "--",
    "<<=", ">>", "&&", "||", "!", "!=", "==", "<=", "~", "^", "+=", "-", "* ", "/ ", "%", "(", ")", "{", "}", ",", ";",
    "=", "/=",
)  # fmt: skip


def test_random_guards_and_actions_have_the_scopes_of_the_lexer() -> None:
    random = Random(45)
    texts = []
    for _ in range(examples(2_000)):
        pieces = random.choices(WORDS, k=random.randint(1, 12))
        texts.append("".join(piece + random.choice((" ", " ", "", "  ")) for piece in pieces))
    read = 0
    for text, found in zip(texts, textmate.tokenise([(LANGUAGE, text) for text in texts]), strict=True):
        with suppress(Unknown):
            check_language(text, found)
            read += 1
    assert read > len(texts) // 2


# ---------------------------------------------------------------- guards and actions in YAML


ANCHOR = re.compile(r"(?:&\S+\s+)?")


def scalars(node: yaml.Node) -> Iterator[yaml.ScalarNode]:
    """The guards and actions of a file."""
    if isinstance(node, yaml.SequenceNode):
        for part in node.value:
            yield from scalars(part)
    elif isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value in (*VOCABULARY.guards, *VOCABULARY.actions) and isinstance(value, yaml.ScalarNode):
                yield value
            else:
                yield from scalars(value)


def check_yaml(text: str, found: textmate.Scopes) -> int:
    """Exactly the guards and actions have scopes of our language, each that of its tokens; how many there are."""
    inside = [False] * len(text)
    texts = list(scalars(yaml.compose(text)))
    for node in texts:
        start, end = node.start_mark.index, node.end_mark.index
        if node.style in ("'", '"'):
            start, end = start + 1, end - 1
        start += len(ANCHOR.match(text, start)[0])
        if node.style in ("|", ">"):
            start = text.index("\n", start)
        inside[start:end] = [True] * (end - start)
        if node.style is None or node.style == "|":
            check_language(text[start:end], found[start:end])
    for i, scopes in enumerate(found):
        if not text[i].isspace():
            assert ("meta.embedded" in scopes) == inside[i], (text[i - 20 : i + 20], scopes)
    return len(texts)


versions = pytest.mark.parametrize("version", textmate.VERSIONS)


def check_language(text: str, found: textmate.Scopes) -> None:
    names = {"NAME": "variable support storage", "QUOTED": "variable", "INTEGER": "constant", "DECIMAL": "constant"}
    covered = [False] * len(text)
    for token in _parser().tokens(text):
        kinds = names.get(token.type, "keyword punctuation constant").split()
        for i in range(token.start, token.end):
            assert found[i].split(" ")[-1].split(".")[0] in kinds, (token, found[i])
            covered[i] = True
    for i, scopes in enumerate(found):
        assert covered[i] or text[i].isspace() or "comment" in scopes, text[i:]


WRITTEN = """\
states:
  - name: A
    on_entry: |  # why
      x = 1;  // one: two
      /* all
         of it */ y++;

      z = m@{A, B} ? 0x1F : 2;
    internal: a = 1; // more # a comment
    on_exit: >-
      b = not c;
    transitions:
      - when: a &&
          b # comment
        to: B
      - {when: "!a && m@{A, B} /* x */", to: C}
      - to: D
        when: 'c'   # comment
      - {to: E, when: x >= 2 or y , lint: {L001: when it is, so}}
      - when: |
          after(3)
        to: F
      - {when: "\\"a\\" == 3 // end", to: C}
      - {
          when: a &&
            b,
          to: G
        }
    variables: {when: {type: bool}}
  - name: B
    on_entry: &post
      light = RED;
    internal: *post
    on_suspend: &more |
      x = 2;
    on_exit: "x = 1; // a
      y = 2;"
    note: when there is, on_entry runs
about: on_exit is no key here
"""


def test_each_grammar_of_yaml_knows_all_keys() -> None:
    keys = [*VOCABULARY.guards, *VOCABULARY.actions]
    for file in SYNTAXES.glob("yaml-*"):
        for rule in re.findall(r'"begin": "(.*when.*)"', file.read_text()):
            assert [key for key in re.findall(r"[a-z_]+", rule) if key in keys][: len(keys)] == keys, file


@versions
def test_guards_and_actions_in_yaml(version: str) -> None:
    (found,) = textmate.tokenise([(YAML, WRITTEN)], version)
    assert check_yaml(WRITTEN, found) == 14
    assert not [scope for scope in found if "invalid" in scope]


@pytest.mark.long
@versions
def test_guards_and_actions_of_our_models(version: str) -> None:
    paths = sorted(path for folder in ("models", "examples") for path in Path(folder).rglob("*.yaml"))
    texts = [path.read_text() for path in paths]
    number = 0
    for path, text, found in zip(paths, texts, textmate.tokenise([(YAML, t) for t in texts], version), strict=True):
        try:
            number += check_yaml(text, found)
        except (AssertionError, Unknown) as error:
            raise AssertionError(f"{path}: {error}") from error
        assert not [scope for scope in found if "invalid" in scope], path
    assert number > 500


def test_the_manifest_names_each_grammar() -> None:
    contributed = json.loads((SYNTAXES.parent / "package.json").read_text())["contributes"]["grammars"]
    named = {g["path"].removeprefix("./syntaxes/"): g["scopeName"] for g in contributed}
    assert named == {file.name: json.loads(file.read_text())["scopeName"] for file in SYNTAXES.iterdir()}
