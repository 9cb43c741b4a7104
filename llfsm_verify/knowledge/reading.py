"""The reader of theories (`.d` files), which says everything that is wrong with one.

    % MicrowaveCook.d
    name {MicrowaveCook}.
    input {timeLeft}.
    input {doorOpen}.
    C0: {} => ~cook.                        % by default do not cook
    C1: timeLeft => cook. C1 > C0.          % stronger than C0
    C2: doorOpen => ~cook. C2 > C1.
    output {b cook, "cook"}.

Arrows are `->` (strict), `=>` (defeasible) and `~>` (defeater); a body of several literals is `{a, ~b}` or `a, ~b`;
labels are optional. Messages are such as:

    5:16: error[E570]: a `.` is missing at the end of `C0: {} => ~cook`
    6:5: error[E571]: `timeleft` is not an input, and no rule can conclude it
      hint: did you mean `timeLeft`?
    7:28: error[E573]: `C2` is stronger than itself: C2 > C1 > C2
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import PurePath
from typing import Literal as OneOf
from typing import NamedTuple, TypeVar

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span, counted
from llfsm_verify.knowledge import codes
from llfsm_verify.knowledge.theory import Literal, Output, Rule, Theory, dependence
from llfsm_verify.language.scope import did_you_mean, near_names

MAX_RULES = 10_000
MAX_DIAGNOSTICS, MAX_CYCLES = 50, 10
_TOKEN = re.compile(
    r'\s+|%[^\n]*|(?P<name>[A-Za-z_]\w*)|(?P<text>"[^"\n]*")|(?P<sign>->|=>|~>|[{}(),:.~>])'
    r"|(?P<foreign>[^\s\w%\"{}(),:.~>]+|.)",
    re.ASCII,
)
_ARROWS: dict[str, OneOf["strict", "defeasible", "defeater"]] = {
    "->": "strict",
    "=>": "defeasible",
    "~>": "defeater",
}
_DECLARED = ("name", "input", "output")
_HABITS = {
    ":": "write `{} => HEAD.` for what holds by default, and `BODY => HEAD.` instead of `HEAD :- BODY.`",
    "!": "write `~a` for the negation of `a`",
    "-": "write `~a` for the negation of `a`",
    "not": "write `~a` for the negation of `a`",
    "&": "write `,` between literals: `a, ~b => c.`",
    "and": "write `,` between literals: `a, ~b => c.`",
    "|": "write a rule for each: `a => c. b => c.`",
    "or": "write a rule for each: `a => c. b => c.`",
    "#": "comments begin with `%`",
    "/": "comments begin with `%`",
    ";": "statements end with `.`",
    "<": "write the stronger rule first: `C1 > C0.`",
    "=": "the arrows are `->` (strict), `=>` (by default) and `~>` (a defeater)",
    '"': 'write `"` at its end as well',
}
"""By what is written how it is written here."""
_AFTER = {
    ",": "a rule has one conclusion: write a rule for each",
    ">": "write a priority for each pair: `C2 > C1. C1 > C0.`",
}
_Key = TypeVar("_Key", int, str)


class _Token(NamedTuple):
    kind: str
    text: str
    start: int
    end: int


class _Broken(Exception):
    """A statement cannot be read; it is said already."""


def read_theory(source: Source) -> Theory:
    """The theory of a `.d` file. Raises DiagnosticError with all that is wrong, in the order of the file."""
    reader = _Reader(source)
    reader.read()
    reader.check()
    if reader.found:
        found = sorted(reader.found, key=lambda d: d.span.start if d.span else 0)
        raise DiagnosticError(found[:MAX_DIAGNOSTICS])
    name = reader.name or PurePath(source.name).stem
    return Theory(
        name, reader.inputs, tuple(reader.rules), frozenset(reader.superior), tuple(reader.outputs), source
    )  # fmt: skip


class _Reader:
    def __init__(self, source: Source) -> None:
        self.source = source
        self.found: list[Diagnostic] = []
        self.name: str | None = None
        self.inputs: dict[str, Span] = {}
        self.rules: list[Rule] = []
        self.outputs: list[Output] = []
        self.superior: dict[tuple[int, int], Span] = {}
        self._places: list[tuple[Span, list[Span]]] = []
        """Of each rule that of the head and those of the body."""
        self._labels: dict[str, int] = {}
        self._priorities: list[tuple[_Token, _Token]] = []
        self._of_broken: set[str] = set()
        """Names in statements that cannot be read: what they say is not known."""
        self._tokens = [
            _Token(str(m.lastgroup), m[0], m.start(), m.end()) for m in _TOKEN.finditer(source.text) if m.lastgroup
        ]
        self._tokens.append(_Token("end", "", len(source.text), len(source.text)))
        self._at = 0

    # ------------------------------------------------------------ statements

    def read(self) -> None:
        """The statements, one after another; after one that cannot be read, from the next one on."""
        while self._next.kind != "end" and len(self.found) < MAX_DIAGNOSTICS:
            start = self._at
            try:
                self._statement()
            except _Broken:
                while self._next.kind != "end" and not (self._at > start and self._begins()):
                    self._at += 1
                    if self._tokens[self._at - 1].text == ".":
                        break
                self._of_broken.update(t.text for t in self._tokens[start : self._at] if t.kind == "name")

    def _statement(self) -> None:
        start, after = self._next, self._tokens[min(self._at + 1, len(self._tokens) - 1)]
        finish: Callable[[], None]
        if start.kind == "name" and after.text == "{":
            finish = self._declaration()
        elif start.kind == "name" and after.text == ">":
            strong = self._take("a label", "name")
            self._at += 1
            weak = self._take("the label of the weaker rule", "name")
            finish = lambda: self._priorities.append((strong, weak))  # noqa: E731
        else:
            finish = self._rule(start)
        if self._next.text != ".":
            end = self._tokens[self._at - 1].end
            said = self.source.text[start.start : end]
            what = f"`{said}`" if len(said) <= 60 and "\n" not in said else "the statement"
            here = Span(self.source, max(start.start, end - 1), end)
            if self._begins() or self._next.kind == "end":
                self._say(codes.SYNTAX, f"a `.` is missing at the end of {what}", here, f"write `{said[-60:]}.`")
                finish()
                return
            self._unfit(f"`.` after {what}", _AFTER.get(self._next.text))
        self._at += 1
        finish()

    def _declaration(self) -> Callable[[], None]:
        word = self._take("a statement", "name")
        if word.text not in _DECLARED:
            hint = near_names(word.text, list(_DECLARED)) or "the declarations are `name`, `input` and `output`"
            self._say(codes.SYNTAX, f"`{word.text[:60]}` is not a declaration", self._span(word), hint)
            raise _Broken
        self._at += 1
        if word.text == "name":
            name = self._take("the name of the theory", "name")
            self._take("`}`", "}")
            return lambda: self._named(name)
        if word.text == "input":
            inputs = [self._take("the name of an input", "name")]
            while self._next.text == ",":
                self._at += 1
                inputs.append(self._take("the name of an input", "name"))
            self._take("`}` or `,`", "}")
            return lambda: self._add_inputs(inputs)
        letter = self._take('the type `b`, as in `output {b cook, "cook"}.`', "name")
        if self._next.text == "~":
            self._say(codes.SYNTAX, "an output is an atom, without `~`", self._span(self._next), "negate it outside")
            raise _Broken
        bare = letter.text != "b" and self._next.text in ("}", ",")
        atom = letter if bare else self._take("the name of an output", "name")
        text = atom.text
        if self._next.text == ",":
            self._at += 1
            text = self._take("the name outside, in quotes", "text").text[1:-1]
        self._take("`}` or `,`", "}")
        return lambda: self._add_output(letter, atom, text)

    def _rule(self, start: _Token) -> Callable[[], None]:
        label = ""
        if start.kind == "name" and self._tokens[self._at + 1].text == ":":
            label, self._at = start.text, self._at + 2
        braces = self._next.text == "{"
        self._at += braces
        body: list[tuple[Literal, Span]] = []
        if not (braces and self._next.text == "}"):
            body.append(self._literal("a literal, or `{}` for an empty body"))
            while self._next.text == ",":
                self._at += 1
                body.append(self._literal("a literal"))
        if braces:
            self._take("`}` or `,`", "}")
        arrow = self._next
        if arrow.text not in _ARROWS:
            fact = arrow.text == "." and len(body) == 1
            hint = f"write `{{}} -> {body[0][0]}.` for what always holds" if fact else None
            self._unfit("`,` or an arrow (`->`, `=>`, `~>`)" if body else "an arrow (`->`, `=>`, `~>`)", hint)
        self._at += 1
        head, place = self._literal("the literal that the rule concludes")
        span = Span(self.source, start.start, place.end)
        rule = Rule(label, tuple(literal for literal, _ in body), _ARROWS[arrow.text], head, span)
        return lambda: self._add_rule(rule, start, (place, [span for _, span in body]))

    def _literal(self, what: str) -> tuple[Literal, Span]:
        negated = self._next
        positive = negated.text != "~"
        self._at += not positive
        atom = self._take(what, "name")
        return Literal(atom.text, positive), Span(self.source, (atom if positive else negated).start, atom.end)

    # ------------------------------------------------------------ tokens

    @property
    def _next(self) -> _Token:
        return self._tokens[self._at]

    def _span(self, token: _Token) -> Span:
        return Span(self.source, token.start, token.end)

    def _begins(self) -> bool:
        """Whether a statement seems to begin here: `L:`, `L >`, `input {`, or anything on a new line after one."""
        token, after = self._tokens[self._at], self._tokens[min(self._at + 1, len(self._tokens) - 1)]
        if token.kind == "name" and (after.text in (":", ">") or (token.text in _DECLARED and after.text == "{")):
            return True
        before = self._tokens[self._at - 1]
        fresh = "\n" in self.source.text[before.end : token.start]
        return fresh and before.kind in ("name", "sign") and before.text not in (",", "{", *_ARROWS) and (
            token.kind == "name" or token.text in ("{", "~")
        )  # fmt: skip

    def _take(self, what: str, kind: str) -> _Token:
        """The next token, a sign or of that kind."""
        token = self._next
        if kind not in (token.kind, token.text):
            self._unfit(what)
        self._at += 1
        return token

    def _unfit(self, expected: str, hint: str | None = None) -> None:
        token = self._next
        written = "the file ends" if token.kind == "end" else f"there is `{token.text[:60]}`"
        if hint is None:
            before = self._tokens[max(0, self._at - 1)].text
            words = (token.text, token.text[:1], before)
            hint = next((_HABITS[w] for w in words if w in _HABITS), "a rule is `C1: a, ~b => c.`")
        place = self._span(token) if token.kind != "end" else Span(self.source, max(0, token.start - 1), token.end)
        self._say(codes.SYNTAX, f"{expected} is expected, and {written}", place, hint)
        raise _Broken

    def _say(self, code: str, message: str, span: Span, hint: str | None = None, *notes: str) -> None:
        self.found.append(Diagnostic(code, message, span, notes, hint))

    # ------------------------------------------------------------ what statements say

    def _twice(self, what: str, span: Span, first: Span, hint: str) -> None:
        self._say(codes.TWICE, f"{what} twice, first in {first.nearby}", span, hint)

    def _named(self, token: _Token) -> None:
        if self.name is not None:
            self._say(codes.TWICE, f"the theory has a name already, `{self.name}`", self._span(token), "keep one")
        self.name = self.name or token.text

    def _add_inputs(self, tokens: list[_Token]) -> None:
        for token in tokens:
            if token.text in self.inputs:
                self._twice(f"`{token.text}` is an input", self._span(token), self.inputs[token.text], "remove one")
            self.inputs.setdefault(token.text, self._span(token))

    def _add_output(self, letter: _Token, atom: _Token, text: str) -> None:
        form = f'write `output {{b {atom.text}, "{text or atom.text}"}}.`'
        if letter is atom:
            self._say(codes.OUTPUT, "the type of the output is missing", self._span(letter), form)
        elif letter.text != "b":
            message = f"`{letter.text[:60]}` is not a type of outputs: the only one is `b`, for true or false"
            self._say(codes.OUTPUT, message, self._span(letter), form)
        if not text.strip():
            self._say(codes.OUTPUT, "the name outside is empty", self._span(atom), form)
        for other in self.outputs:
            if atom.text == other.atom or text == other.text:
                same = atom.text if atom.text == other.atom else text
                self._twice(f"`{same}` is an output", self._span(atom), other.span, "remove one, or name it otherwise")
                break
        self.outputs.append(Output(atom.text, text, self._span(atom)))

    def _add_rule(self, rule: Rule, start: _Token, places: tuple[Span, list[Span]]) -> None:
        if rule.label:
            first = self._labels.setdefault(rule.label, len(self.rules))
            if first < len(self.rules):
                hint = "give one of them another label"
                self._twice(f"`{rule.label}` labels a rule", self._span(start), self.rules[first].span, hint)
        self.rules.append(rule)
        self._places.append(places)
        if len(self.rules) == MAX_RULES + 1:
            hint = "split it into several theories: an output of one can be an input of another"
            self._say(codes.TOO_LARGE, f"there are more than {counted(MAX_RULES, 'rule')}", rule.span, hint)
            self._at = len(self._tokens) - 1

    # ------------------------------------------------------------ what they say together

    def check(self) -> None:
        """Say what is wrong with the statements together, but what may come from those that cannot be read."""
        if any(d.code == codes.TOO_LARGE for d in self.found):
            return
        concluded = dict.fromkeys(rule.head for rule in self.rules if rule.proves)
        known = dict.fromkeys((*map(Literal, self.inputs), *concluded))
        for rule, (head, body) in zip(self.rules, self._places, strict=True):
            if rule.head.atom in self.inputs:
                message = f"`{rule.head.atom}` is an input, whose value is given: no rule can conclude it"
                first = self.inputs[rule.head.atom]
                hint = f"conclude an atom of another name, or remove the input in {first.nearby}"
                self._say(codes.INPUT_CONCLUDED, message, head, hint)
            for literal, span in zip(rule.body, body, strict=True):
                if literal.atom not in self.inputs and literal not in concluded:
                    self._unknown(literal, span, known)
        for output in self.outputs:
            if output.atom in self.inputs:
                message = f"`{output.atom}` is an input, so it cannot be an output"
                self._say(codes.OUTPUT, message, output.span, "ask for an atom that rules conclude")
            elif Literal(output.atom) not in concluded:
                self._unknown(Literal(output.atom), output.span, concluded)
        if not self.outputs and "output" not in self._of_broken:
            end = len(self.source.text.rstrip())
            atom = next((r.head.atom for r in self.rules if r.proves), "cook")
            hint = f'write `output {{b {atom}, "{atom}"}}.`'
            self._say(codes.OUTPUT, "the theory has no output", Span(self.source, max(0, end - 1), end), hint)
        self._check_priorities()
        for cycle in _cycles({atom: dict(needs) for atom, needs in dependence(self.rules).items()}):
            chain = [*cycle[::-1]]
            rule, span = self._where(chain[0], chain[1])
            message = f"`{chain[0]}` depends on itself: {_shown(chain, ' ← ')}"
            self._say(codes.CYCLE, message, span, f"remove `{chain[1]}` from the body, or conclude another atom")

    def _where(self, head: str, needed: str) -> tuple[Rule, Span]:
        """The first place where a rule for `head` or its negation has `needed` in its body."""
        return next(
            (rule, span)
            for rule, (_, body) in zip(self.rules, self._places, strict=True)
            if rule.head.atom == head
            for literal, span in zip(rule.body, body, strict=True)
            if literal.atom == needed
        )

    def _unknown(self, literal: Literal, span: Span, known: dict[Literal, None]) -> None:
        if literal.atom in self._of_broken or len(self.found) >= MAX_DIAGNOSTICS:
            return
        if literal.complement in known:
            message = f"no rule can conclude `{literal}`, only rules for `{literal.complement}` are there"
            hint = f"add a rule for it, such as `{{}} => {literal}.` for what holds by default"
        else:
            message = f"`{literal.atom[:60]}` is not an input, and no rule can conclude it"
            atoms = dict.fromkeys(l.atom for l in known)
            hint = did_you_mean(literal.atom, atoms) or f"write `input {{{literal.atom[:60]}}}.`, or a rule for it"
        self._say(codes.UNKNOWN, message, span, hint)

    def _check_priorities(self) -> None:
        for strong, weak in self._priorities:
            numbers = [self._labels.get(token.text) for token in (strong, weak)]
            for token, number in zip((strong, weak), numbers, strict=True):
                if number is None and token.text not in self._of_broken and len(self.found) < MAX_DIAGNOSTICS:
                    hint = did_you_mean(token.text, self._labels) or f"write `{token.text[:60]}: BODY => HEAD.`"
                    message = f"there is no rule with the label `{token.text[:60]}`"
                    self._say(codes.UNKNOWN_LABEL, message, self._span(token), hint)
            first, second = numbers
            if first is None or second is None:
                continue
            one, other = self.rules[first].head, self.rules[second].head
            span = Span(self.source, strong.start, weak.end)
            if first != second and one != other.complement:
                message = f"`{strong.text}` and `{weak.text}` conclude `{one}` and `{other}`, which are not opposite"
                hint = "remove the priority: it would change nothing"
                self._say(codes.UNOPPOSED, message, span, hint)
                continue
            self.superior.setdefault((first, second), span)
        weaker: dict[int, dict[int, None]] = {}
        for stronger, weaker_one in self.superior:
            weaker.setdefault(stronger, {})[weaker_one] = None
        for cycle in _cycles(weaker):
            pairs = zip(cycle[1:], cycle, strict=False)
            last = max(pairs, key=lambda pair: self.superior[pair].start)
            span, at = self.superior[last], cycle.index(last[1]) + 1
            chain = [self.rules[number].label for number in (*cycle[at:0:-1], *cycle[: at - 1 : -1])]
            message = f"`{chain[0]}` is stronger than itself: {_shown(chain, ' > ')}"
            self._say(codes.PRIORITY_CYCLE, message, span, "remove one of these priorities")


def _cycles(after: dict[_Key, dict[_Key, None]]) -> Iterator[list[_Key]]:
    """Cycles of a graph, each node before those that have it in their entry, the first one also last: after each, an
    edge of it is removed."""
    for _ in range(MAX_CYCLES):
        try:
            TopologicalSorter(after).prepare()
        except CycleError as error:
            cycle: list[_Key] = error.args[1]
            yield cycle
            del after[cycle[-1]][cycle[-2]]
        else:
            return


def _shown(chain: list[str], sign: str) -> str:
    return sign.join(chain if len(chain) <= 9 else [*chain[:6], "…", *chain[-2:]])
