"""Acceptance conditions of the Hanoi Omega-Automata format, as far as they are generalised Büchi."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from llfsm_verify.automata.hoa.tokens import Token, wrong
from llfsm_verify.diagnostics import Source

MAX_SETS = 1_000


@dataclass(frozen=True, slots=True)
class Acceptance:
    """A condition over `sets` sets, at the characters `start` to `end` of the file.

    `inf` are the sets to be visited infinitely often, each with whether its complement is meant; None: the condition
    says something else. `never`: it is `f`.
    """

    sets: int
    inf: tuple[tuple[int, bool], ...] | None
    never: bool
    text: str
    start: int
    end: int

    def marks(self, sets: int) -> int:
        """The acceptance of a transition in the file's sets `sets` (a mask): bit k is element k of `inf`."""
        return sum(1 << k for k, (i, complement) in enumerate(self.inf or ()) if bool(sets >> i & 1) != complement)


def read_acceptance(source: Source, words: Sequence[Token], at: int) -> tuple[Acceptance, int]:
    """The condition of `Acceptance:`, whose first word is number `at`, and the number of the word after it."""
    start = at

    def word(kind: str, text: str | None, what: str) -> Token:
        nonlocal at
        if at >= len(words) or words[at].kind != kind or (text is not None and words[at].text != text):
            here = words[min(at, len(words) - 1)]
            raise wrong(source, f"{what} is expected here", here.start, here.end)
        at += 1
        return words[at - 1]

    def is_sign(*texts: str) -> bool:
        return at < len(words) and words[at].kind == "SIGN" and words[at].text in texts

    count = word("INT", None, "the number of acceptance sets")
    sets = int(count.text)
    if sets > MAX_SETS:
        raise wrong(source, f"more than {MAX_SETS:,} acceptance sets", count.start, count.end)
    inf: dict[tuple[int, bool], None] = {}
    simple, never, depth = True, False, 0
    while True:
        while is_sign("("):
            at, depth = at + 1, depth + 1
        primitive = word("IDENT", None, "`Inf(…)`, `Fin(…)`, `t` or `f`")
        if primitive.text in ("Inf", "Fin"):
            word("SIGN", "(", "`(`")
            complement = is_sign("!")
            at += complement
            number = word("INT", None, "the number of an acceptance set")
            if int(number.text) >= sets:
                are = "is 1 acceptance set" if sets == 1 else f"are {sets} acceptance sets"
                raise wrong(source, f"there {are}, counted from 0", number.start, number.end)
            word("SIGN", ")", "`)`")
            inf[int(number.text), complement] = None
            simple = simple and primitive.text == "Inf"
        elif primitive.text == "f":
            never = True
        elif primitive.text != "t":
            raise wrong(source, "`Inf(…)`, `Fin(…)`, `t` or `f` is expected here", primitive.start, primitive.end)
        while depth and is_sign(")"):
            at, depth = at + 1, depth - 1
        if is_sign("&", "|"):
            simple = simple and words[at].text == "&"
            at += 1
            continue
        if depth:
            word("SIGN", ")", "`)`")
        break
    first, last = words[start].start, words[at - 1].end
    text = source.text[words[start + 1].start : last]
    if never and not simple:
        never = False
    return Acceptance(sets, tuple(inf) if simple else None, never, text, first, last), at
