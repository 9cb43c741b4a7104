"""From the words of one formula to the formula and its atoms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from threading import Lock
from typing import NamedTuple, cast

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment, Span
from llfsm_verify.grammars import END, Parser, Token, Unfit, parser_of
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import MAX_STEPS_IN_ALL, steps_in_all
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, Op, apply, atom, depth, negation, operators
from llfsm_verify.logic.formula import atoms as atoms_of
from llfsm_verify.logic.initial import without_initially
from llfsm_verify.logic.parsing.bounds import Bound, read_bound
from llfsm_verify.logic.parsing.mistakes import NO_BITS, misfit, refuse_operator
from llfsm_verify.logic.parsing.tokens import MAX_TOKENS, TEMPORAL_PAIRS, odd, tokenise
from llfsm_verify.logic.parsing.words import Words, check_words

STATE_OPERATORS = frozenset({"atom", "true", "false", "not", "and", "or"})
"""What atoms can hold of logic: the language of guards has it too."""
EDGES = frozenset({"rose", "fell", "changed"})
"""Functions of properties whose argument may be a condition."""
MAX_DEPTH = 1_000
"""Operators inside operators; runs of negations count as one or none."""


@dataclass(frozen=True, slots=True)
class Parsed:
    """A formula as it was written (nothing rewritten but double negations) and its atoms by key, in order.

    An atom's fragment has the key as its text: white space in one form, quotes and comments dropped. Its offsets lead
    to the first place in the file where the atom stands.
    """

    formula: Formula
    atoms: Mapping[str, Fragment]
    written: Formula | None = None
    """The formula with `initially`, where it has the word."""


def parse_formula(fragment: Fragment) -> Parsed:
    """The LTL formula written in `fragment` (docs: formats, Property file); DiagnosticError when there is a mistake."""
    tokens = tokenise(fragment.text)
    if len(tokens) > MAX_TOKENS:
        where = Words(fragment, tokens)
        raise where.error(codes.TOO_MANY_WORDS, f"more than {MAX_TOKENS:,} words and signs", MAX_TOKENS, MAX_TOKENS)
    tokens = [t for t in tokens if t.type != "NEWLINE"]
    if not tokens:
        raise DiagnosticError(Diagnostic(codes.EMPTY, "there is no formula", fragment.span(0, len(fragment.text))))
    return parse_words(Words(fragment, tokens))


def parse_words(words: Words) -> Parsed:
    """`parse_formula` for words already taken apart, of which there is at least one."""
    parsed = parse_by_grammar(words)
    refuse_many_steps(parsed, words.span(0, len(words.tokens) - 1))
    return parsed


def refuse_many_steps(parsed: Parsed, place: Span) -> None:
    """Raises DiagnosticError when the step bounds of a formula add up to more than can be written out."""
    steps = steps_in_all(parsed.formula)
    if steps > MAX_STEPS_IN_ALL:
        message = f"the bounds of this formula add up to {steps:,} steps, more than {MAX_STEPS_IN_ALL:,}"
        raise DiagnosticError(Diagnostic(codes.BOUND, message, place, hint="write several properties"))


def parse_by_grammar(words: Words) -> Parsed:
    """`parse_words`, with any number of steps in bounds."""
    check_words(words)
    with _lock:  # the parser's callbacks are bound to one builder
        parser, builder = _parser()
        builder.begin(words)
        try:
            formula = cast(Formula, parser.parse(_tokens(words, builder.bounds), "start"))
        except Unfit as unfit:
            raise misfit(words, unfit.token.start) from None
        finally:
            atoms = builder.end()
    if depth(formula) > MAX_DEPTH:
        last = len(words.tokens) - 1
        raise words.error(codes.TOO_DEEP, f"more than {MAX_DEPTH:,} operators inside each other", 0, last)
    used = set(atoms_of(formula))  # those inside `rose(…)` are part of a larger one
    kept = {key: place for key, place in atoms.items() if key in used}
    plain = without_initially(formula)
    return Parsed(plain, kept, None if plain is formula else formula)


def refuse_initially(words: Words, where: str, hint: str = "write it outside, as in `initially p && G q`") -> None:
    """DiagnosticError (E345): `words` have `initially`, which has no meaning `where`."""
    found = next((i for i, token in enumerate(words.tokens) if token.type == "INITIALLY"), None)
    if found is not None:
        message, use = f"`initially` has no meaning {where}", words.use(found)
        notes = () if use is None else (f"`{use.text}` stands for this at {use}",)
        raise DiagnosticError(Diagnostic(codes.INITIALLY, message, words.span(found, found), notes, hint))


def _tokens(words: Words, bounds: dict[int, Bound]) -> Iterator[Token]:
    """The words as tokens, each with its number for its place; bounds are read after their signs."""
    i = 0
    while i < len(words.tokens):
        token = words.tokens[i]
        yield Token(token.type, token.text, i, i)
        bound = read_bound(words, i)
        if bound is not None:
            bounds[i] = bound
            i = bound.last
        i += 1
    yield Token(END, "", i, i)


class _Node(NamedTuple):
    """A piece of a formula: its words `first` to `last`, those inside its outermost parentheses, and what it is.

    `formula` is None as long as it can still become part of an atom. `shape` is the rule that made it, "group" for
    anything in parentheses.
    """

    shape: str
    first: int
    last: int
    inner: tuple[int, int]
    formula: Formula | None


def _node(shape: str, first: int, last: int, formula: Formula | None = None) -> _Node:
    return _Node(shape, first, last, (first, last), formula)


class _Builder:
    """The parser's callbacks: one method per rule of grammar.lark, called when the rule is reduced."""

    def __init__(self) -> None:
        self._words: Words
        self._atoms: dict[str, Fragment] = {}
        self.bounds: dict[int, Bound] = {}
        self._initially = False
        """Some word is `initially`."""

    def begin(self, words: Words) -> None:
        self._words = words
        self._atoms = {}
        self.bounds = {}
        self._initially = any(token.type == "INITIALLY" for token in words.tokens)

    def end(self) -> dict[str, Fragment]:
        atoms, self._atoms = self._atoms, {}
        del self._words
        return dict(sorted(atoms.items(), key=lambda item: item[1].offsets[0]))

    def start(self, children: list[_Node]) -> Formula:
        return self._formula(children[0])

    def iff(self, children: list[_Node]) -> _Node:
        return self._binary("iff", children[0], children[2])

    def implies(self, children: list[_Node]) -> _Node:
        left, _, right = children
        self._refuse_chain(codes.IMPLICATION_CHAIN, left, right)
        return self._binary("implies", left, right)

    def disjunction(self, children: list[_Node]) -> _Node:
        return self._joined("or", children)

    def exclusive(self, children: list[_Node]) -> _Node:
        return self._binary("xor", children[0], children[2])

    def conjunction(self, children: list[_Node]) -> _Node:
        return self._joined("and", children)

    def pair(self, children: list[_Node | Token]) -> _Node:
        left, sign, right = cast(tuple[_Node, Token, _Node], children)
        self._refuse_chain(codes.TEMPORAL_CHAIN, left, right)
        self._refuse_initially(sign, left, right)
        bound = self.bounds.get(_place(sign))
        op = cast(Op, sign.type) if bound is None else bound.op
        return self._binary(op, left, right, "pair", "" if bound is None else bound.bound)

    def unary(self, children: list[_Node | Token]) -> _Node:
        sign, operand = cast(tuple[Token, _Node], children)
        formula = self._formula(operand)
        bound = self.bounds.get(_place(sign))
        if sign.type not in ("NOT", "INITIALLY"):
            self._refuse_initially(sign, operand)
        if bound is not None:
            formula = apply(bound.op, formula, bound=bound.bound)
        elif sign.type == "INITIALLY":
            formula = apply("initially", formula)
        elif sign.type != "NOT":
            formula = apply(cast(Op, sign.type), formula)
        elif odd(self._words.tokens[_place(sign)]):
            formula = negation(formula)
        return _node("unary", _place(sign), operand.last, formula)

    def comparison(self, children: list[_Node | Token]) -> _Node:
        left, sign, right = cast(tuple[_Node, Token, _Node], children)
        words, place, text = self._words, _place(sign), sign.text
        if sign.type == "ASSIGN":
            hint = f"write `{words.excerpt(left.first, left.last)} == {words.excerpt(right.first, right.last)}`"
            raise words.error(codes.ASSIGNMENT, f"`{text}` assigns; a comparison is written `==`", place, place, hint)
        if left.shape == "comparison":
            a, b = words.excerpt(left.first, left.last), words.excerpt(right.first, right.last)
            middle = words.text(place - 1, place - 1)
            hint = "write two, joined by `&&`"
            if words.tokens[place - 2].type == "COMPARE":  # a single word stands in the middle
                hint = f"write `{a} && {middle} {text} {b}`"
            raise words.error(codes.COMPARISON_CHAIN, "comparisons cannot be chained", place, place, hint)
        for side in (left, right):
            if side.formula is not None:
                other = {"==": "<->", "!=": "xor"}.get(text)
                hint = "compare numbers or names"
                if other is not None:
                    a, b = words.excerpt(left.first, left.last), words.excerpt(right.first, right.last)
                    hint = f"write `{a} {other} {b}`"
                message = f"`{text}` compares values, but this is a formula"
                raise words.error(codes.FORMULA_COMPARED, message, side.first, side.last, hint)
        return _node("comparison", left.first, right.last)

    def arithmetic(self, children: list[_Node | Token]) -> _Node:
        left, sign, right = cast(tuple[_Node, Token, _Node], children)
        return _node("arithmetic", self._value(left, sign).first, self._value(right, sign).last)

    def sign(self, children: list[_Node | Token]) -> _Node:
        sign, operand = cast(tuple[Token, _Node], children)
        return _node("arithmetic", _place(sign), self._value(operand, sign).last)

    def member(self, children: list[_Node | Token]) -> _Node:
        owner, sign, name = cast(tuple[_Node, Token, Token], children)
        return _node("term", self._value(owner, sign).first, _place(name))

    def states(self, children: list[_Node | Token]) -> _Node:
        machine, sign = cast(_Node, children[0]), cast(Token, children[1])
        return _node("term", self._value(machine, sign).first, _place(cast(Token, children[-1])))

    def index(self, children: list[_Node | Token]) -> _Node:
        array, opening, value, closing = cast(tuple[_Node, Token, _Node, Token], children)
        self._value(value, opening)
        return _node("term", self._value(array, opening).first, _place(closing))

    def call(self, children: list[_Node | Token]) -> _Node:
        name, opening = cast(_Node, children[0]), cast(Token, children[1])
        if name.first == name.last:
            refuse_operator(self._words, name.first)
        edge = name.first == name.last and self._words.tokens[name.first].text in EDGES
        for child in children:
            if isinstance(child, _Node) and not (edge and _is_condition(child)):
                self._value(child, opening)
        return _node("term", name.first, _place(cast(Token, children[-1])))

    def word(self, children: list[Token]) -> _Node:
        return _node("word", _place(children[0]), _place(children[0]))

    def group(self, children: list[_Node | Token]) -> _Node:
        opening, inner, closing = cast(tuple[Token, _Node, Token], children)
        return _Node("group", _place(opening), _place(closing), inner.inner, inner.formula)

    # ------------------------------------------------------------ what the rules share

    def _formula(self, node: _Node) -> Formula:
        """`node` as an operand of logic: what is no formula yet becomes an atom or a constant."""
        if node.formula is not None:
            return node.formula
        first, last = node.inner
        if first == last:
            token = self._words.tokens[first]
            if token.type in ("TRUE", "FALSE"):
                return TRUE if token.type == "TRUE" else FALSE
            if token.type == "NUMBER":
                meant = {"0": "false", "1": "true"}.get(token.text)
                hint = f"write `{meant}`" if meant else None
                if any(t.text in ("&", "|", "^") for t in self._words.tokens[max(0, first - 1) : first + 2]):
                    hint = NO_BITS
                message = f"`{token.text}` is a number, but a formula is expected"
                raise self._words.error(codes.NUMBER_AS_FORMULA, message, first, last, hint)
        place = self._words.atom(first, last)
        known = self._atoms.setdefault(place.text, place)
        if place.offsets[0] < known.offsets[0]:  # rules are reduced from the inside out, not from left to right
            self._atoms[place.text] = place
        return atom(place.text)

    def _value(self, node: _Node, sign: Token) -> _Node:
        if node.formula is not None:
            message = f"this is a formula, but `{sign.text}` works on values"
            raise self._words.error(codes.FORMULA_AS_VALUE, message, node.first, node.last)
        return node

    def _binary(self, op: Op, left: _Node, right: _Node, shape: str | None = None, bound: str = "") -> _Node:
        formula = apply(op, self._formula(left), self._formula(right), bound=bound)
        return _node(shape or op, left.first, right.last, formula)

    def _joined(self, op: Op, children: list[_Node]) -> _Node:
        formula = apply(op, *(self._formula(child) for child in children[::2]))
        return _node(op, children[0].first, children[-1].last, formula)

    def _refuse_initially(self, sign: Token, *operands: _Node) -> None:
        for node in operands if self._initially else ():
            part = replace(self._words, tokens=self._words.tokens[node.first : node.last + 1])
            refuse_initially(part, f"under `{sign.text}`")

    def _refuse_chain(self, code: str, left: _Node, right: _Node) -> None:
        if left.shape != ("pair" if code == codes.TEMPORAL_CHAIN else "implies"):
            return
        words, place = self._words, right.first - 1
        while words.tokens[place].type == "RSQB":  # a bound follows the sign
            place = next(k for k, bound in self.bounds.items() if bound.last == place)
        depth = 0
        middle = place - 1  # the sign that joins the left side's own operands, outside brackets
        while depth or not _joins(words, middle, code):
            kind = words.tokens[middle].type
            depth += (kind in ("RPAR", "RSQB")) - (kind in ("LPAR", "LSQB"))
            middle -= 1
        ends = [self.bounds[k].last if k in self.bounds else k for k in (middle, place)]
        a, b = words.excerpt(left.first, middle - 1), words.excerpt(ends[0] + 1, left.last)
        one, two = words.text(middle, ends[0]), words.text(place, ends[1])
        c = words.excerpt(right.first, right.last)
        message = f"`{one}` and `{two}` in a row need parentheses"
        hint = f"write `({a} {one} {b}) {two} {c}` or `{a} {one} ({b} {two} {c})`"
        raise words.error(code, message, place, place, hint)


def _is_condition(node: _Node) -> bool:
    return node.formula is not None and operators(node.formula) <= STATE_OPERATORS


def _joins(words: Words, i: int, code: str) -> bool:
    kind = words.tokens[i].type
    return kind in TEMPORAL_PAIRS if code == codes.TEMPORAL_CHAIN else kind == "IMPLIES"


def _place(token: Token) -> int:
    """The number of the token among the words."""
    return token.start


_lock = Lock()


@cache
def _parser() -> tuple[Parser, _Builder]:
    builder = _Builder()
    return parser_of("llfsm_verify.logic", builder, ("start",)), builder
