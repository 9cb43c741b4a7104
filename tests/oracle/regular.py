"""Regular properties by finite automata of automata-lib over concrete valuations: the reference for their tests."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Mapping, Sequence
from itertools import product
from typing import Any

from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import Formula, atoms, repetition
from llfsm_verify.logic.lasso import evaluate
from llfsm_verify.logic.regular import RegularKind, exclusions
from tests.outside import load

Letter = frozenset[str]
Valuation = frozenset[Formula]


class Void(Exception):
    """No word matches, or the empty one does under `forbid`: the property is an error."""


class RegularReference:
    """The words over valuations that violate a property, as a deterministic automaton made by automata-lib."""

    def __init__(self, kind: RegularKind, expression: Formula) -> None:
        self.alphabet = letters(expression)
        keys = atoms(*self.alphabet) if self.alphabet else ()
        worlds = [frozenset(k for k, v in zip(keys, row, strict=True) if v) for row in _rows(len(keys))]
        possible = [w for w in worlds if evaluate(exclusions(keys), (), (w,))]
        valuations = dict.fromkeys(self.valuation(w) for w in possible)
        self.symbols = {v: chr(ord("a") + i) for i, v in enumerate(valuations)}
        inputs = set(self.symbols.values())
        words = _intersection(_automaton(expression, self.symbols), _no_equal_neighbours(inputs))
        if words.isempty() or (kind != "enforce" and words.accepts_input("")):
            raise Void
        if kind == "enforce":
            good = _prefixes(words)
            self.bad = good.complement()
        else:
            nfa = load("automata-lib", "automata.fa.nfa").NFA
            anything = nfa(states={0}, input_symbols=inputs, transitions={0: {c: {0} for c in inputs}},
                           initial_state=0, final_states={0})  # fmt: skip
            matches = nfa.from_dfa(words)
            matches = matches.concatenate(anything)
            if kind == "forbid":
                matches = anything.concatenate(matches)
            self.bad = _determinised(matches)

    def valuation(self, letter: Letter) -> Valuation:
        """The letters of the expression that hold."""
        return frozenset(f for f in self.alphabet if evaluate(f, (), (letter,)))

    def is_bad(self, word: Sequence[Letter]) -> bool:
        """Whether what `word` shows violates the property."""
        text = ""
        for letter in word:
            symbol = self.symbols[self.valuation(letter)]
            text += "" if text.endswith(symbol) else symbol
        return bool(self.bad.accepts_input(text))

    def shortest(
        self, roots: Iterable[tuple[Hashable, Letter]], edges: Mapping[Any, Iterable[tuple[Any, Letter]]]
    ) -> int | None:
        """The fewest steps after which a run of a graph shows a word that violates the property; None: none does."""

        def after(state: Any, last: str, letter: Letter) -> tuple[Any, str]:
            symbol = self.symbols[self.valuation(letter)]
            return (state if symbol == last else self.bad.transitions[state][symbol]), symbol

        layer = {(node, *after(self.bad.initial_state, "", letter)) for node, letter in roots}
        seen = set(layer)
        steps = 0
        while layer:
            if any(state in self.bad.final_states for _, state, _ in layer):
                return steps
            layer = {(t, *after(state, last, x)) for node, state, last in layer for t, x in edges[node]} - seen
            seen |= layer
            steps += 1
        return None


def _rows(n: int) -> Iterable[tuple[bool, ...]]:
    return product((False, True), repeat=n)


def _determinised(nfa: Any) -> Any:
    return load("automata-lib", "automata.fa.dfa").DFA.from_nfa(nfa, minify=True).to_complete()


def _automaton(f: Formula, symbols: Mapping[Valuation, str]) -> Any:
    """The words over valuations that match, by the operations on automata that the library has."""
    nfa = load("automata-lib", "automata.fa.nfa").NFA
    inputs = set(symbols.values())

    def one(allowed: set[str]) -> Any:
        return nfa(states={0, 1}, input_symbols=inputs, transitions={0: {c: {1} for c in allowed}, 1: {}},
                   initial_state=0, final_states={1})  # fmt: skip

    def made(node: Formula) -> Any:
        if node.op in ("seq", "alt"):
            parts = [made(a) for a in node.args]
            result = parts[0]
            for part in parts[1:]:
                result = result.concatenate(part) if node.op == "seq" else result.union(part)
            return result
        if node.op == "repeat":
            low, high = repetition(node)
            body = made(node.args[0])
            result = nothing()
            for _ in range(low):
                result = result.concatenate(body)
            if high is None:
                return result.concatenate(body.kleene_star())
            for _ in range(high - low):
                result = result.concatenate(body.union(nothing()))
            return result
        if node.op == "empty":
            return nothing()
        return one({symbol for valuation, symbol in symbols.items() if node in valuation})

    def nothing() -> Any:
        return nfa(states={0}, input_symbols=inputs, transitions={0: {}}, initial_state=0, final_states={0})

    return _determinised(made(f))


def _no_equal_neighbours(inputs: set[str]) -> Any:
    dfa = load("automata-lib", "automata.fa.dfa").DFA
    rows = {c: {d: d for d in inputs if d != c} for c in inputs}
    return dfa(states={"", *inputs}, input_symbols=inputs, transitions={"": {c: c for c in inputs}, **rows},
               initial_state="", final_states={"", *inputs}, allow_partial=True)  # fmt: skip


def _intersection(left: Any, right: Any) -> Any:
    return left.intersection(right.to_complete()).to_complete()


def _prefixes(words: Any) -> Any:
    """The words that begin one of `words`: every state from which one is accepted accepts."""
    dfa = load("automata-lib", "automata.fa.dfa").DFA
    alive = set(words.final_states)
    while True:
        more = {q for q, row in words.transitions.items() if any(t in alive for t in row.values())} - alive
        if not more:
            break
        alive |= more
    return dfa(states=words.states, input_symbols=words.input_symbols, transitions=words.transitions,
               initial_state=words.initial_state, final_states=alive)  # fmt: skip
