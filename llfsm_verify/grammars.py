"""Parsers by tables: lark computes those of a grammar (LALR(1)) once per installation, and here they are kept and run.

Running them here takes a fifth of the time that lark's own loop takes, and a run that finds them need not import lark.
The loop is the usual one (Aho, Sethi, Ullman, Compilers, 1986, section 4.7).
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, TypedDict, cast

from llfsm_verify.kept import fingerprint, keep, kept, place

if TYPE_CHECKING:
    from lark.grammar import Rule

GRAMMAR = "grammar.lark"
END = "$END"
"""The token after the last one."""
ONE_PART, COLLECTED = "", "*"
"""Instead of the name of a rule: its one part stands for it; its parts become parts of the rule that uses it."""


class _Piece(NamedTuple):
    type: str
    text: str
    start: int
    end: int


class Token(_Piece):
    """A word or sign of a text, and which of its characters it has (`end` not included)."""

    __slots__ = ()
    depth: ClassVar = 0
    """As of a syntax tree."""


class Unfit(Exception):
    """No text of the grammar begins like this one: after what comes before `token`, one of `expected` has to follow."""

    def __init__(self, token: Token, expected: frozenset[str]) -> None:
        super().__init__(token)
        self.token = token
        self.expected = expected


class Unknown(Exception):
    """No token begins at this character."""

    def __init__(self, at: int) -> None:
        super().__init__(at)
        self.at = at


class _Tables(TypedDict):
    rows: list[dict[str, int]]
    """By state: what each token and each rule leads to, a state or the complement of the rule to reduce by."""
    rules: list[tuple[str, int, str, bool]]
    """What it makes, of how many parts, the method of the builder, and whether one of the parts is `COLLECTED`."""
    starts: dict[str, int]
    ends: dict[str, int]
    pattern: str
    """Of any token; its groups are the kinds."""
    ignored: list[str]
    words: dict[str, dict[str, str]]
    """By kind: the texts of which it is not this one but another."""


class Parser:
    """The parser of one grammar. Each rule becomes what the builder's method of its name makes of the list of its
    parts, or that list where there is no such method."""

    def __init__(self, tables: _Tables, builder: object) -> None:
        self._rows, self._starts, self._ends = tables["rows"], tables["starts"], tables["ends"]
        self._rules = [(*rule, _maker(builder, rule[2])) for rule in tables["rules"]]
        self._through: dict[tuple[int, int, str], int] = {}
        """What is known of `_after_one_parts`: without it most of the time would go to levels of precedence."""
        self._match = re.compile(tables["pattern"])
        self._ignored, self._words = frozenset(tables["ignored"]), tables["words"]

    def tokens(self, text: str) -> Iterator[Token]:
        """What a text consists of, and `END`. Raises Unknown."""
        at, words, ignored = 0, self._words, self._ignored
        match = self._match.scanner(text).match  # type: ignore[attr-defined]
        make = tuple.__new__  # as a named tuple does it, without a call of its own
        while (found := match()) is not None:
            begin, at = found.span()
            kind = found.lastgroup
            if kind not in ignored:
                word = found[0]
                yield make(Token, (words[kind].get(word, kind) if kind in words else kind, word, begin, at))
        if at < len(text):
            raise Unknown(at)
        yield Token(END, "", at, at)

    def parse(self, tokens: Iterable[Token], start: str) -> Any:
        """What the rule `start` becomes, for tokens of which `END` is the last. Raises Unfit, and what the builder and
        `tokens` raise."""
        rows, rules, through, end = self._rows, self._rules, self._through, self._ends[start]
        states = [self._starts[start]]
        values: list[Any] = []
        row = rows[states[0]]
        for token in tokens:
            kind = token[0]
            while (action := row.get(kind)) is None or action < 0:
                if action is None:
                    raise Unfit(token, frozenset(word for word in row if word.isupper()))
                origin, size, name, spread, make = rules[~action]
                if name == ONE_PART:
                    step = states[-2], states[-1], kind
                    state = through.get(step)
                    if state is None:
                        state = through[step] = self._after_one_parts(*step)
                    states[-1] = state
                else:
                    parts: list[Any] = []
                    if size:
                        parts = values[-size:]
                        del values[-size:], states[-size:]
                    if spread:
                        parts = _spread(parts)
                    values.append(make(parts))
                    state = rows[states[-1]][origin]
                    if state == end and kind == END:
                        return values[-1]
                    states.append(state)
                row = rows[state]
            states.append(action)
            values.append(token)
            row = rows[action]
        raise ValueError("the last token is missing")

    def _after_one_parts(self, below: int, state: int, kind: str) -> int:
        """The state before a token of this kind once all rules are applied that only rename the last part."""
        while (action := self._rows[state].get(kind)) is not None and action < 0:
            origin, _, name, *_ = self._rules[~action]
            if name != ONE_PART:
                break
            state = self._rows[below][origin]
        return state


def _maker(builder: object, name: str) -> Callable[[list[Any]], Any]:
    made: Callable[[list[Any]], Any] | None = getattr(builder, name, None)
    return _collected if name == COLLECTED else list if made is None else made


class _Collected(list[Any]):
    """Parts that become parts of the rule that uses them."""

    __slots__ = ()


def _spread(parts: list[Any]) -> _Collected:
    """The parts, with those of collected ones in their place; the first one grows where it stands."""
    first, *rest = parts
    spread = first if isinstance(first, _Collected) else _Collected((first,))
    for part in rest:
        if isinstance(part, _Collected):
            spread += part
        else:
            spread.append(part)
    return spread


def _collected(parts: list[Any]) -> _Collected:
    return parts if isinstance(parts, _Collected) else _Collected(parts)


def parser_of(package: str, builder: object, starts: Sequence[str]) -> Parser:
    """The parser of the grammar of a package, for texts of the rules `starts`."""
    grammar = resources.files(package).joinpath(GRAMMAR).read_text("utf-8")
    path = _path(package, grammar, starts)
    content = kept(path)
    if content is None:
        content = json.dumps(_computed(grammar, starts)).encode()
        keep(path, content)  # where that fails, they are computed in each run
    return Parser(json.loads(content), builder)


def _path(package: str, grammar: str, starts: Sequence[str]) -> Path | None:
    """The file for the tables, named after everything that decides them: lark's first file says its version."""
    lark = find_spec("lark")
    if lark is None or lark.origin is None:
        return None
    ours = resources.files("llfsm_verify").joinpath("grammars.py").read_bytes()
    return place(f"grammar-{fingerprint(package, grammar, *starts, ours, Path(lark.origin).read_bytes())}.tables")


def _computed(grammar: str, starts: Sequence[str]) -> _Tables:
    """The tables that lark computes. All tokens are kept as parts."""
    from lark import Lark
    from lark.lexer import BasicLexer, UnlessCallback
    from lark.parsers.lalr_analysis import Shift

    options: dict[str, Any] = {"parser": "lalr", "lexer": "basic", "keep_all_tokens": True, "maybe_placeholders": False}
    made = Lark(grammar, start=list(starts), **options)
    front: Any = made.parser
    table, lexer = front.parser._parse_table, cast(BasicLexer, front.lexer)
    numbers = {rule: number for number, rule in enumerate(made.rules)}
    rows = [
        {
            str(symbol): target if action is Shift else ~numbers[target]
            for symbol, (action, target) in table.states[state].items()
        }
        for state in range(len(table.states))
    ]
    return {
        "rows": rows,
        "rules": [_rule(rule) for rule in made.rules],
        "starts": table.start_states,
        "ends": table.end_states,
        "pattern": "|".join(f"(?P<{t.name}>{t.pattern.to_regexp()})" for t in lexer.scanner.terminals),
        "ignored": sorted(lexer.ignore_types),
        "words": {
            kind: {word.pattern.value: word.name for word in cast(UnlessCallback, unless).scanner.terminals}
            for kind, unless in lexer.callback.items()
        },
    }


def _rule(rule: Rule) -> tuple[str, int, str, bool]:
    origin, size = str(rule.origin.name), len(rule.expansion)
    if origin.startswith("_"):
        name = COLLECTED
    elif rule.options.expand1 and size == 1 and rule.alias is None:
        name = ONE_PART
    else:
        name = str(rule.alias or origin)
    return origin, size, name, any(not part.is_term and part.name.startswith("_") for part in rule.expansion)
