"""Specification patterns by name: `absence of p before q`, `s responds to p within 5s`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import NamedTuple, cast

from llfsm_verify.diagnostics import DiagnosticError, Fragment, Source, Span
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import TimeBound, time_bound
from llfsm_verify.logic.formula import TIMED, Formula, Op, apply, mapped
from llfsm_verify.logic.parsing.bounds import milliseconds, spelt
from llfsm_verify.logic.parsing.formulas import Parsed, parse_formula, parse_words, refuse_initially
from llfsm_verify.logic.parsing.tokens import CLOSING, ENDS_OPERAND, OPENING
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.patterns import PATTERNS, SCOPES, SIMPLE

_SCOPE_HINT = "the scopes are `globally`, `before R`, `after Q`, `between Q and R` and `after Q until R`"
_SCOPES = ("globally", "before", "after", "between")
_CHAIN_HINT = "write `s, t precede p`, `p precedes s, t`, `s, t respond to p` or `p responds to s, t`"


class Scope(NamedTuple):
    """Where a pattern is to hold, one of SCOPES, with the events that open (`q`) and close (`r`) a part of a run."""

    kind: str = "globally"
    events: Mapping[str, Formula] = {}


class Pattern(NamedTuple):
    """The formula that a pattern stands for; `bounds`: as in a Property, what is written after `within`."""

    parsed: Parsed
    bounds: tuple[tuple[Span, TimeBound], ...]


def read_pattern(words: Words) -> Pattern | None:
    """The pattern that `words` are; None: they are not one. DiagnosticError (E319 and others): it has a mistake.

    Its own words stand where no formula has one: after an operand, or before `of`.
    """
    reader = _Reader(words)
    made = reader.pattern()
    if made is None:
        return None
    atoms = dict(sorted(reader.atoms.items(), key=lambda item: item[1].offsets[0]))
    return Pattern(Parsed(made, atoms), reader.bounds)


class _Reader:
    def __init__(self, words: Words) -> None:
        self.words, self.tokens = words, words.tokens
        self.atoms: dict[str, Fragment] = {}
        self.bounds: tuple[tuple[Span, TimeBound], ...] = ()
        self._outside = self._depths()

    def _depths(self) -> list[bool]:
        """Which words stand outside all brackets."""
        found, depth = [], 0
        for token in self.tokens:
            depth -= token.type in CLOSING
            found.append(depth <= 0)
            depth += token.type in OPENING
        return found

    def _is(self, i: int, *texts: str) -> bool:
        return 0 <= i < len(self.tokens) and self._outside[i] and self.tokens[i].text in texts

    def _separates(self, i: int, *texts: str) -> bool:
        """Whether one of the words stands at `i` after an operand, where a formula has no such word."""
        return self._is(i, *texts) and i > 0 and self.tokens[i - 1].type in ENDS_OPERAND

    def pattern(self) -> Formula | None:
        """The formula, or None."""
        start = 1 if self._is(0, "bounded") else 0
        if self._is(start, "absence", "existence", "universality") and self._is(start + 1, "of"):
            name = " ".join(t.text for t in self.tokens[: start + 1])
            if name not in SIMPLE:
                message = f"there is no pattern `{name}`"
                raise self.words.error(codes.PATTERN, message, 0, start, f"the patterns are {', '.join(SIMPLE)}")
            scope, end = self._scope(start + 2)
            return _instance(name, scope, p=self._operand(start + 2, end, start + 1))
        for i in range(1, len(self.tokens)):
            if self._separates(i, "precedes", "precede"):
                return self._of_several(i, i, i + 1, "s precedes p", "s, t precede p", "p precedes s, t")
            if self._separates(i, "responds", "respond") and self._is(i + 1, "to"):
                if any(self._is(k, ",") for k in range(len(self.tokens))):
                    return self._of_several(
                        i, i + 1, i + 2, "s responds to p", "s, t respond to p", "p responds to s, t"
                    )
                return self._response(i)
        return None

    def _of_several(self, i: int, word: int, right: int, single: str, first: str, second: str) -> Formula:
        """The pattern with the words `i` to `word` between its events: `single`, or `first` with two events before
        them, or `second` with two after."""
        scope, end = self._scope(right)
        before = [k for k in range(i) if self._is(k, ",")]
        after = [k for k in range(right, end) if self._is(k, ",")]
        late = next((k for k in range(right, len(self.tokens)) if self._separates(k, "within")), None)
        if late is not None:
            message = "only `s responds to p` takes `within`"
            raise self.words.error(codes.PATTERN, message, late, late, "write a formula with `F[<=5s]`")
        if len(before) + len(after) > 1:
            message = "a chain has two events on one side, and one on the other"
            raise self.words.error(codes.PATTERN, message, (before + after)[1], (before + after)[1], _CHAIN_HINT)
        if before:
            s, t = self._operand(0, before[0], before[0]), self._operand(before[0] + 1, i, before[0])
            return _instance(first, scope, s=s, t=t, p=self._operand(right, end, word))
        p = self._operand(0, i, i)
        if after:
            s, t = self._operand(right, after[0], word), self._operand(after[0] + 1, end, after[0])
            return _instance(second, scope, s=s, t=t, p=p)
        return _instance(single, scope, s=p, p=self._operand(right, end, word))

    def _response(self, i: int) -> Formula:
        bound: str | None = None
        stop = len(self.tokens)
        at = next((k for k in range(i + 2, stop) if self._separates(k, "within")), None)
        rest: int | None = None
        if at is not None:
            early = next((k for k in range(i + 2, at) if self._separates(k, *_SCOPES)), None)
            if early is not None:
                message = f"write `within` before the scope; here it comes after `{self.tokens[early].text}`"
                before, after = self.words.excerpt(0, early - 1), self.words.excerpt(early, at - 1)
                time = self.tokens[at + 1].text if at + 1 < stop else "5s"
                hint = f"write `{before} within {time} {after}`"
                raise self.words.error(codes.PATTERN, message, at, min(at + 1, stop - 1), hint)
            last = at + 1
            found = milliseconds(self.tokens[last].text) if last < stop else None
            if found is None and last + 1 < stop:  # the unit may stand by itself, as in `F[<=20 ms]`
                last += 1
                found = milliseconds(self.tokens[last - 1].text + self.tokens[last].text)
            if found is None:
                times = [spelt("".join(t.text for t in self.tokens[at + 1 : at + i])) for i in (3, 2)]
                hint = f"write `within {next(t for t in [*times, times[1] + 's', '5s'] if milliseconds(t))}`"
                raise self.words.error(codes.PATTERN, "a time is expected after `within`", at, at, hint)
            self.bounds = ((self.words.span(at + 1, last), time_bound(found)),)
            bound, rest = found, last + 1
        scope, end = self._scope(i + 2 if rest is None else rest, rest is not None)
        end = end if at is None else min(end, at)
        s, p = self._operand(0, i, i), self._operand(i + 2, end, i + 1)
        return _instance("s responds to p", scope, bound, s=s, p=p)

    def _scope(self, start: int, whole: bool = False) -> tuple[Scope, int]:
        """The scope in the words from `start`, and where it begins. `whole`: there is nothing before it."""
        count = len(self.tokens)
        begin = next((k for k in range(start, count) if (whole and k == start) or self._separates(k, *_SCOPES)), count)
        if begin == count:
            return Scope(), count
        if self._is(begin, "globally"):
            if begin + 1 < count:
                message = "something comes after `globally`"
                raise self.words.error(codes.PATTERN, message, begin + 1, count - 1, _SCOPE_HINT)
            return Scope(), begin
        if self._is(begin, "before"):
            return Scope("before", {"r": self._operand(begin + 1, count, begin)}), begin
        if self._is(begin, "after"):
            until = next((k for k in range(begin + 1, count) if self._separates(k, "until")), None)
            first = self._operand(begin + 1, count if until is None else until, begin)
            if until is None:
                return Scope("after", {"q": first}), begin
            return Scope("after until", {"q": first, "r": self._operand(until + 1, count, until)}), begin
        if self._is(begin, "between"):
            joins = [k for k in range(begin + 1, count) if self._is(k, "and")]
            if len(joins) != 1:
                message = "`between Q and R` has one `and`"
                hint = "write `&&` for the operator, or put brackets around Q and R"
                raise self.words.error(codes.PATTERN, message, begin, begin, hint)
            q, r = self._operand(begin + 1, joins[0], begin), self._operand(joins[0] + 1, count, joins[0])
            return Scope("between", {"q": q, "r": r}), begin
        raise self._unexpected(begin)

    def _unexpected(self, i: int) -> DiagnosticError:
        message = f"a scope is expected, but this is `{self.tokens[i].text}`"
        return self.words.error(codes.PATTERN, message, i, i, _SCOPE_HINT)

    def _operand(self, start: int, end: int, word: int) -> Formula:
        """The formula that the words `start` to `end` (not included) are, for the pattern's word number `word`."""
        if start >= end:
            message = f"a formula is missing next to `{self.tokens[word].text}`"
            raise self.words.error(codes.PATTERN, message, word, word, "write `s responds to p`, `absence of p`")
        words = replace(self.words, tokens=self.tokens[start:end])
        refuse_initially(words, "in a pattern")
        parsed = parse_words(words)
        for key, place in parsed.atoms.items():
            known = self.atoms.setdefault(key, place)
            if place.offsets[0] < known.offsets[0]:
                self.atoms[key] = place
        return parsed.formula


def _instance(name: str, scope: Scope, within: str | None = None, **events: Formula) -> Formula:
    """The formula of a pattern with formulas in the place of its events, and the bound that is written after `within`
    in the place of its own."""
    known = {**events, **scope.events}

    def change(node: Formula, args: tuple[Formula, ...]) -> Formula | None:
        if node.op in TIMED:
            return apply(node.op, *args, bound=within) if within else apply(cast(Op, node.op[0]), *args)
        return known[node.key] if node.op == "atom" else None

    return mapped(_formula(PATTERNS[name][SCOPES.index(scope.kind)]), change)


@cache
def _formula(text: str) -> Formula:
    return parse_formula(Fragment.whole(Source("pattern", text))).formula
