"""Automata from files in the Hanoi Omega-Automata format, version 1 (Babiak et al., CAV 2015)."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import NoReturn

from llfsm_verify.extensions.hoa.tokens import Acceptance, Token, read_acceptance, tokens, wrong
from llfsm_verify.plug import FALSE_FORMULA as FALSE
from llfsm_verify.plug import (
    HOA_ACCEPTANCE,
    HOA_NUMBER,
    HOA_UNSUPPORTED,
    Automaton,
    FileAutomaton,
    Formula,
    Guards,
    Source,
    Span,
    atom,
    conjunction,
    disjunction,
    negation,
)
from llfsm_verify.plug import TRUE_FORMULA as TRUE
from llfsm_verify.plug import WRONG_HOA as HOA
from llfsm_verify.plug import AutomatonEdge as Edge

MAX_STATES = 100_000
MAX_EDGES = 1_000_000
MAX_IMPLICIT = 16
"""Atoms beyond which labels cannot be left out: a state would have more than 65,536 transitions."""


_BEGIN = re.compile(r"^[ \t]*(?:/\*.*\*/[ \t]*)?HOA:", re.MULTILINE)


def read_hoa(source: Source) -> tuple[FileAutomaton, ...]:
    """All automata of `source`; those that are aborted are left out.

    Acceptance on states becomes acceptance on the transitions that leave them; several initial states become one.
    DiagnosticError: E360 wrong, E361 another acceptance than generalised Büchi, E362 alternation and the like.
    """
    words = list(tokens(source))
    found: list[FileAutomaton] = []
    at = 0
    while at < len(words):
        if _is_mark(words[at], "--ABORT--"):
            at += 1
            continue
        end = next((i for i in range(at, len(words)) if _is_mark(words[i], "--END--", "--ABORT--")), None)
        if end is None:
            # Perhaps something is wrong before; the end is missed only if not.
            _Reader(source, words[at:]).automaton()
            raise wrong(source, "`--END--` is missing", words[-1].start, words[-1].end)
        if _is_mark(words[end], "--END--"):
            found.append(_Reader(source, words[at : end + 1]).automaton())
        at = end + 1
    return tuple(found)


def _is_mark(word: Token, *texts: str) -> bool:
    """Not a string of that text."""
    return word.kind == "MARK" and word.text in texts


@dataclass(slots=True)
class _Row:
    """A state in the making: its transitions as (label or None, targets, sets)."""

    token: Token
    label: Formula | None
    sets: int
    edges: list[tuple[Formula | None, int, int, Token]]


class _Reader:
    """Reads one automaton."""

    def __init__(self, source: Source, words: list[Token]) -> None:
        self._source, self._words, self._at = source, words, 0
        self._name: str | None = None
        self._states: int | None = None
        self._starts: list[tuple[int, Token]] = []
        self._atoms: tuple[Token, ...] | None = None
        self._aliases: dict[str, Formula] = {}
        self._acceptance: Acceptance | None = None
        self._acceptance_name: str | None = None

    # ------------------------------------------------------------ words

    @property
    def _word(self) -> Token | None:
        return self._words[self._at] if self._at < len(self._words) else None

    def _take(self, kind: str, what: str) -> Token:
        word = self._word
        if word is None or word.kind != kind:
            self._fail(f"{what} is expected here")
        self._at += 1
        return word

    def _is(self, text: str) -> bool:
        return self._word is not None and self._word.text == text and self._word.kind in ("SIGN", "MARK", "HEADER")

    def _eat(self, text: str) -> None:
        if not self._is(text):
            self._fail(f"`{text}` is expected here")
        self._at += 1

    def _fail(self, message: str, at: Token | None = None, code: str = HOA, hint: str | None = None) -> NoReturn:
        word = at or self._word or self._words[-1]
        raise wrong(self._source, message, word.start, word.end, code, hint)

    def _number(self, what: str) -> int:
        return int(self._take("INT", what).text)

    # ------------------------------------------------------------ header

    def automaton(self) -> FileAutomaton:
        self._eat("HOA:")
        version = self._take("IDENT", "the version, `v1`,")
        if not (version.text == "v1" or version.text.startswith("v1.")):
            self._fail(f"this is version `{version.text}`, and only v1 can be read", version)
        while not self._is("--BODY--"):
            self._header()
        self._eat("--BODY--")
        rows = self._body()
        self._eat("--END--")
        return self._made(rows)

    def _header(self) -> None:
        header = self._take("HEADER", "a header such as `States:`, or `--BODY--`,")
        name = header.text[:-1]
        match name:
            case "States":
                self._states = self._number("the number of states")
                if self._states > MAX_STATES:
                    self._fail(f"more than {MAX_STATES:,} states", header)
            case "Start":
                word = self._take("INT", "the number of a state")
                if self._is("&"):
                    self._alternation(word)
                self._starts.append((int(word.text), word))
            case "AP":
                self._propositions(header)
            case "Alias":
                alias = self._take("ALIAS", "a name such as `@a`")
                if alias.text in self._aliases:
                    self._fail(f"there are two aliases `{alias.text}`", alias)
                self._aliases[alias.text] = self._label()
            case "Acceptance":
                if self._acceptance is not None:
                    self._fail("there are two headers `Acceptance:`", header)
                self._acceptance, self._at = read_acceptance(self._source, self._words, self._at)
            case "name":
                name = self._take("STRING", "a name in quotes").text
                # It is shown to people: no character of it may steer their terminal.
                self._name = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in name)
            case "acc-name":
                start = self._at
                self._skip_values()
                self._acceptance_name = " ".join(word.text for word in self._words[start : self._at])
            case "tool" | "properties" | "controllable-AP":
                self._skip_values()
            case _ if name == "HOA":
                self._fail("`--END--` is missing before the next automaton", header)
            case _ if name[0].isupper():
                message = f"the header `{header.text}` is not known, and its capital says that it must be"
                self._fail(message, header, HOA_UNSUPPORTED)
            case _:
                self._skip_values()

    def _skip_values(self) -> None:
        while self._word is not None and self._word.kind in ("IDENT", "INT", "STRING", "SIGN"):
            if self._word.kind == "SIGN" and self._word.text != "!":
                break
            self._at += 1

    def _propositions(self, header: Token) -> None:
        if self._atoms is not None:
            self._fail("there are two headers `AP:`", header)
        count = self._number("the number of atomic propositions")
        names: list[Token] = []
        while self._word is not None and self._word.kind == "STRING":
            names.append(self._take("STRING", "a name"))
            if any(names[-1].text == name.text for name in names[:-1]):
                self._fail(f'there are two propositions "{names[-1].text}"', names[-1])
            if not names[-1].text:
                self._fail("a proposition needs a name", names[-1])
            if not names[-1].text.isprintable():
                self._fail("the name of a proposition has a control character", names[-1])
        if len(names) != count:
            self._fail(
                f"`AP:` says {_counted(count, 'proposition')}, and {len(names)} {_are(len(names))} named", header
            )
        self._atoms = tuple(names)

    def _alternation(self, word: Token) -> NoReturn:
        message = "alternating automata (states joined by `&`) are not supported"
        self._fail(message, word, HOA_UNSUPPORTED, "remove the alternation with the tool that wrote the file")

    # ------------------------------------------------------------ labels

    def _label(self) -> Formula:
        """A label's expression: `!` binds more tightly than `&`, and that than `|`; read with a stack."""
        groups: list[tuple[list[Formula], list[Formula], bool]] = [([], [], False)]
        while True:
            negated = False
            while self._is("!"):
                negated = not negated
                self._at += 1
            if self._is("("):
                self._at += 1
                groups.append(([], [], negated))
                continue
            value = self._literal()
            groups[-1][1].append(negation(value) if negated else value)
            while True:
                options, factors, _ = groups[-1]
                if self._is(")") and len(groups) > 1:
                    self._at += 1
                    inner = disjunction([*options, conjunction(factors)])
                    outer_negated = groups.pop()[2]
                    groups[-1][1].append(negation(inner) if outer_negated else inner)
                    continue
                break
            if self._is("&"):
                self._at += 1
            elif self._is("|"):
                self._at += 1
                options.append(conjunction(factors))
                factors.clear()
            elif len(groups) > 1:
                self._fail("`)` is missing")
            else:
                return disjunction([*options, conjunction(factors)])

    def _literal(self) -> Formula:
        word = self._word
        if word is None:
            self._fail("a proposition is expected here")
        if word.kind == "IDENT" and word.text in ("t", "f"):
            self._at += 1
            return TRUE if word.text == "t" else FALSE
        if word.kind == "INT":
            atoms = self._atoms
            if atoms is None:
                self._fail("there is no header `AP:` before this", word)
            if int(word.text) >= len(atoms):
                count = len(atoms)
                self._fail(f"there {_are(count)} {_counted(count, 'proposition')}, counted from 0", word)
            self._at += 1
            return atom(atoms[int(word.text)].text)
        if word.kind != "ALIAS":
            self._fail("a proposition's number, an alias, `t` or `f` is expected here", word)
        if word.text not in self._aliases:
            self._fail(f"there is no alias `{word.text}` before this", word)
        self._at += 1
        return self._aliases[word.text]

    def _bracketed_label(self) -> Formula | None:
        if not self._is("["):
            return None
        self._at += 1
        label = self._label()
        self._eat("]")
        return label

    # ------------------------------------------------------------ body

    def _sets(self) -> int:
        mask = 0
        if self._is("{"):
            self._at += 1
            while not self._is("}"):
                word = self._take("INT", "the number of an acceptance set, or `}`,")
                if self._acceptance is not None and int(word.text) >= self._acceptance.sets:
                    sets = self._acceptance.sets
                    self._fail(f"there {_are(sets)} {_counted(sets, 'acceptance set')}, counted from 0", word)
                mask |= 1 << int(word.text)
            self._at += 1
        return mask

    def _body(self) -> dict[int, _Row]:
        if self._acceptance is None:
            self._fail("the header `Acceptance:` is missing")
        rows: dict[int, _Row] = {}
        while not self._is("--END--"):
            if not self._is("State:"):
                self._fail("`State:` or `--END--` is expected here")
            self._at += 1
            label = self._bracketed_label()
            word = self._take("INT", "the number of a state")
            number = int(word.text)
            if number in rows:
                self._fail(f"there are two states {number}", word)
            if number >= (MAX_STATES if self._states is None else self._states):
                self._fail(f"there are only {MAX_STATES if self._states is None else self._states:,} states", word)
            if self._word is not None and self._word.kind == "STRING":
                self._at += 1
            row = rows[number] = _Row(word, label, self._sets(), [])
            while self._is("[") or (self._word is not None and self._word.kind == "INT"):
                edge_label = self._bracketed_label()
                if edge_label is not None and label is not None:
                    self._fail("the state has a label, so its transitions have none", word)
                target = self._take("INT", "the number of a state")
                if self._is("&"):
                    self._alternation(target)
                row.edges.append((edge_label, int(target.text), self._sets(), target))
        return rows

    # ------------------------------------------------------------ the automaton

    def _made(self, rows: dict[int, _Row]) -> FileAutomaton:
        acceptance = self._acceptance
        assert acceptance is not None
        names = self._atoms or ()
        places = {word.text: Span(self._source, word.start + 1, word.end - 1) for word in names}
        keys = tuple(places)
        if acceptance.inf is None:
            what = f"`{self._acceptance_name}`" if self._acceptance_name else f"`{acceptance.text}`"
            message = f"the acceptance {what} is not generalised Büchi"
            hint = "convert it with the tool that wrote the file, such as `autfilt --generalized-buchi`"
            raise wrong(self._source, message, acceptance.start, acceptance.end, HOA_ACCEPTANCE, hint)
        for row in rows.values():
            for _, target, _, word in row.edges:
                if target not in rows:
                    self._fail(f"state {target} is not defined", word)
        for start, word in self._starts:
            if start not in rows:
                self._fail(f"state {start} is not defined", word)
        sets = len(acceptance.inf)
        if not self._starts or acceptance.never:
            return FileAutomaton(self._name, Automaton(keys, (), sets), places)
        guards = Guards(keys)
        edges = {number: self._edges(row, guards, acceptance) for number, row in rows.items()}
        starts = list(dict.fromkeys(start for start, _ in self._starts))
        order = [starts[0], *(n for n in sorted(rows) if n != starts[0])]
        shift = 0 if len(starts) == 1 else 1  # several initial states: one more does what any of them can do
        numbers = {number: i + shift for i, number in enumerate(order)}

        def renumbered(number: int) -> tuple[Edge, ...]:
            return tuple(Edge(e.positive, e.negative, numbers[e.target], e.acceptance) for e in edges[number])

        table = [renumbered(number) for number in order]
        if shift:
            table.insert(0, tuple(dict.fromkeys(edge for start in starts for edge in renumbered(start))))
        return FileAutomaton(self._name, Automaton(keys, tuple(table), sets), places)

    def _edges(self, row: _Row, guards: Guards, acceptance: Acceptance) -> list[Edge]:
        made: list[Edge] = []
        for cubes, (_, target, sets, _) in zip(self._cubes(row, guards), row.edges, strict=True):
            marks = acceptance.marks(sets | row.sets)
            made += (Edge(positive, negative, target, marks) for positive, negative in cubes)
            if len(made) > MAX_EDGES:
                self._fail(f"more than {MAX_EDGES:,} transitions", row.token)
        return made

    def _cubes(self, row: _Row, guards: Guards) -> Iterator[Iterable[tuple[int, int]]]:
        """The label of each transition as masks of the atoms that hold and that do not."""
        given = [label for label, _, _, _ in row.edges if label is not None]
        if row.label is not None:
            cubes = list(guards.cubes(guards.of(row.label)))
            yield from [cubes] * len(row.edges)
        elif len(given) == len(row.edges):
            yield from (guards.cubes(guards.of(label)) for label in given)
        elif given:
            self._fail("some transitions of this state have labels and some have none", row.token)
        else:
            count = len(guards.atoms)
            if count > MAX_IMPLICIT or len(row.edges) != 1 << count:
                message = f"a state without labels has a transition for each of the 2^{count} letters"
                self._fail(f"{message}, and this has {len(row.edges)}", row.token)
            yield from ([(letter, ~letter & (1 << count) - 1)] for letter in range(len(row.edges)))


def _counted(count: int, thing: str) -> str:
    return f"{count} {thing}" + "s" * (count != 1)


def _are(count: int) -> str:
    return "is" if count == 1 else "are"


def is_recognised(source: Source) -> bool:
    """Whether a text shows that it holds automata in this format, if with mistakes."""
    return _BEGIN.search(source.text) is not None


def read_one(source: Source) -> FileAutomaton:
    """The automaton of a file that holds just one; DiagnosticError (E363) when it holds none, or several."""
    found = read_hoa(source)
    if len(found) != 1:
        message = f"this file holds {len(found)} automata, and one is expected"
        raise wrong(source, message, 0, min(1, len(source.text)), HOA_NUMBER)
    return found[0]
