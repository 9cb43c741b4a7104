"""The terms of a file of ports: what may be a fact or a query, and data as Prolog reads it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from llfsm_verify.plug import Json

VALUE = "Value"
"""The variable that stands for the value of a slot or an input."""
OPEN = "a bracket is open"
HOLE = "\0"
"""Stands for that variable in the text of a term, and cannot be elsewhere in it."""
LONGEST = 400
"""Characters of a term."""
_TOKEN = re.compile(r"\s*(?:(?P<name>[a-z][A-Za-z0-9_]*|'(?:[^'\\\x00-\x1f.]|'')+')|(?P<variable>[A-Z_][A-Za-z0-9_]*)|"
                    r"(?P<number>-?[0-9]{1,18})|(?P<mark>[(),]))", re.ASCII)  # fmt: skip
_PLAIN = re.compile(r"[a-z][A-Za-z0-9_]*\Z", re.ASCII)


class NoTerm(Exception):
    """The message says why a text is not a term."""


@dataclass(frozen=True, slots=True)
class Term:
    """A name, or a name and its arguments."""

    text: str
    """As Prolog reads it, with HOLE for `Value`."""
    arity: int
    variables: frozenset[str]

    @property
    def bare(self) -> bool:
        """Whether it has no arguments."""
        return not self.arity

    def asks_value(self) -> Term:
        """The same with `Value` as its argument; it is bare."""
        return Term(f"{self.text}({HOLE})", 1, frozenset((VALUE,)))


def term(text: str) -> Term:
    """What a user has written. NoTerm."""
    tokens: list[tuple[str, str]] = []
    at, end = 0, len(text.rstrip())
    while at < end:
        found = _TOKEN.match(text, at)
        if found is None or len(text) > LONGEST:
            what = f"a term cannot go on with `{text[at:].strip()[:20]}`" if found is None else "it is too long"
            raise NoTerm(what)
        tokens.append((str(found.lastgroup), str(found[str(found.lastgroup)])))
        at = found.end()
    tokens.append(("end", ""))
    variables: set[str] = set()
    made, rest = _parsed(tokens, 0, variables)
    if tokens[0][0] != "name":
        raise NoTerm("it does not begin with a name")
    if tokens[rest][0] != "end":
        raise NoTerm(f"a term cannot go on with `{tokens[rest][1]}`")
    depth = arity = 0
    for _, mark in (token for token in tokens if token[0] == "mark"):
        depth += (mark == "(") - (mark == ")")
        arity += depth == 1 and mark != ")"
    return Term(made, arity, frozenset(variables))


def _parsed(tokens: list[tuple[str, str]], at: int, variables: set[str]) -> tuple[str, int]:
    kind, word = tokens[at]
    if kind in ("mark", "end"):
        raise NoTerm(f"a term cannot go on with `{word}`" if word else "it has no end")
    if kind == "variable" and word != "_":
        variables.add(word)
    if kind != "name" or tokens[at + 1] != ("mark", "("):
        return HOLE if (kind, word) == ("variable", VALUE) else word, at + 1
    arguments = []
    at += 1
    while tokens[at] != ("mark", ")"):
        if tokens[at] not in (("mark", "("), ("mark", ",")):
            raise NoTerm(f"a term cannot go on with `{tokens[at][1]}`" if tokens[at][1] else OPEN)
        argument, at = _parsed(tokens, at + 1, variables)
        arguments.append(argument)
    return f"{word}({', '.join(arguments)})", at + 1


def quoted(text: str) -> str:
    """An atom, whatever is in it."""
    if _PLAIN.match(text):
        return text
    return "'" + "".join(c if c.isprintable() and c not in "'\\" else f"\\x{ord(c):x}\\" for c in text) + "'"


def datum(value: Json, digits: int) -> str:
    """A value of a slot as Prolog reads it; `digits`: the decimals of its type, if it is a number."""
    if isinstance(value, bool):
        return "true" if value else "false"
    text = str(value)
    if isinstance(value, str) and not (digits and re.fullmatch(r"-?[0-9]+\.[0-9]+", text, re.ASCII)):
        return quoted(text)
    return f"{text}.0" if digits and "." not in text else text
