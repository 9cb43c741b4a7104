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
from collections.abc import Collection, Iterator
from graphlib import CycleError, TopologicalSorter
from itertools import islice, pairwise
from pathlib import PurePath
from typing import Literal as OneOf
from typing import NamedTuple, NoReturn, TypeVar

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Source, Span, meant_at
from llfsm_verify.knowledge import codes
from llfsm_verify.knowledge.theory import Literal, Output, Rule, Theory, asked, dependence
from llfsm_verify.language.scope import did_you_mean, near_names

MAX_RULES, MAX_WORDS = 10_000, 200_000
MAX_DIAGNOSTICS, MAX_CYCLES = 50, 10
_TOKEN = re.compile(
    r'\s+|%[^\n]*|(?P<name>[A-Za-z_]\w*)|(?P<text>"[^"\n]*")|(?P<sign>->|=>|~>|:-|>=|[{}(),:.~>])'
    r"|(?P<foreign>[^\s\w%\"{}(),:.~>]+|.)",
    re.ASCII,
)
_ARROWS: dict[str, OneOf["strict", "defeasible", "defeater"]]
_ARROWS = {"->": "strict", "=>": "defeasible", "~>": "defeater"}
_DECLARED = ("name", "input", "output")
_BOUND = "all is true or false here: declare an input, and write `inputs: {far: distance > 5}` in the arrangement"
_FORM = "a rule is `C1: {a, ~b} => c.`, with `:` after its label and `,` between literals"
_HABITS = {
    r"[<>!=]=?\s*\d|\w\s*>\s*\w+\s*=>": _BOUND,
    r":-|<[-=]+>?|[⇐←]": "a rule ends with what it concludes: `BODY => HEAD.` for `HEAD :- BODY.`",
    r"\w+-\w|\w*[^\W\x00-\x7F]|(?<!\w)\d": "names have letters from a to z, digits and `_`, and begin with no digit",
    r"\binput\b\s*(?![\s{])": "write `input {a, b}.`",
    r"\boutput\b\s*(?![\s{])": 'write `output {b cook, "cook"}.`',
    r"\bname\b\s*(?![\s{])": "write `name {Cook}.`",
    r"={2,}>?|=(?!>)|-{2,}>|[=~-]>>|[⇒→]": "the arrows are `->` (strict), `=>` (by default) and `~>` (a defeater)",
    r"[!¬]|\\\+|-\s*\w|\bnot\b\s*": "write `~a` for `not a`",
    r"&|∧|\band\b": "write `,` for `and`: `a, ~b => c.`",
    r"\||∨|\bor\b": "write a rule for each: `a => c. b => c.`",
    r"#|/": "comments begin with `%`",
    r";": "statements end with `.`",
    r"\w\s*(<|>=)\s*\w": "write the stronger rule first: `C1 > C0.`",
    r"\w\s*>\s*\w+\s*>": "write a priority for each pair: `C2 > C1. C1 > C0.`",
    r'"[^"\n]*$': 'write `"` at its end as well',
    r"\w\(": "literals have no arguments: write a name for each, such as `door_1`",
    r"\(": "write `{a, b}` for `(a, b)`",
    r"\{[^{}.]*?(?=[=~-]>)": "write `}` before the arrow",
}  # fmt: skip
"""What to write for a pattern around the place where something does not fit."""
_LONG = re.compile(r"([^\s`]{60})[^\s`]+")
_Key = TypeVar("_Key", int, str)


class _Token(NamedTuple):
    kind: str
    text: str
    span: Span


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
    superior = frozenset(reader.superior)
    return Theory(name, reader.inputs, tuple(reader.rules), superior, tuple(reader.outputs), source)


class _Reader:
    def __init__(self, source: Source) -> None:
        self.source = source
        self.found: list[Diagnostic] = []
        self.name = ""
        self.inputs: dict[str, Span] = {}
        self.rules: list[Rule] = []
        self.outputs: list[Output] = []
        self.superior: dict[tuple[int, int], Span] = {}
        self._places: list[tuple[Span, ...]] = []
        """Of each rule those of the head and of the literals in the body."""
        self._labels: dict[str, Span] = {}
        self._numbers: dict[str, int] = {}
        self._priorities: list[tuple[_Token, _Token]] = []
        self._of_broken: set[str] = set()
        """Names in statements that cannot be read: what is said of them is not known."""
        found = islice((m for m in _TOKEN.finditer(source.text) if m.lastgroup), MAX_WORDS + 1)
        self._tokens = [_Token(str(m.lastgroup), m[0], Span(source, *m.span())) for m in found]
        if len(self._tokens) > MAX_WORDS:
            self._too_large(f"{MAX_WORDS:,} words and signs", self._tokens[-1].span)
        length = len(source.text.rstrip())
        end = Span(source, max(0, length - 1), length)
        self._tokens += [_Token("end", "", end)] * 2
        self._at = 0

    # ------------------------------------------------------------ statements

    def read(self) -> None:
        """The statements, one after another; after one that cannot be read, from the next one on."""
        while self._next.kind != "end" and len(self.found) < MAX_DIAGNOSTICS:
            start = self._at
            try:
                self._statement()
            except _Broken:
                self._at = max(self._at, start + 1)
                while self._next.kind != "end" and self._tokens[self._at - 1].text != "." and not self._begins():
                    self._at += 1
                self._of_broken.update(t.text for t in self._tokens[start : self._at] if t.kind == "name")

    def _statement(self) -> None:
        start, after = self._tokens[self._at : self._at + 2]
        if start.kind == "name" and after.text == "{":
            self._declaration()
        elif start.kind == "name" and after.text == ">":
            self._at += 2
            self._priorities.append((start, self._take("the label of the weaker rule", "name")))
        else:
            self._rule(start)
        if self._next.text != ".":
            last = self._tokens[self._at - 1].span
            said = self.source.text[start.span.start : last.end]
            short = len(said) <= 60 and "\n" not in said
            what = f"`{said}`" if short else "the statement"
            if not self._begins() and self._next.kind != "end":
                one = "a rule concludes one literal: write one for each" if self._next.text == "," else None
                self._unfit(f"`.` after {what}", one)
            place = Span(self.source, last.end - 1, last.end)
            self._say(
                codes.SYNTAX,
                f"a `.` is missing at the end of {what}",
                place,
                f"write `{said}.`" if short else "write `.` there",
            )
        else:
            self._at += 1

    def _declaration(self) -> None:
        word = self._take("a statement", "name")
        if word.text not in _DECLARED:
            hint = near_names(word.text, list(_DECLARED)) or "the declarations are `name`, `input` and `output`"
            self._say(codes.SYNTAX, f"`{word.text}` is not a declaration", word.span, hint)
            raise _Broken
        self._at += 1
        if word.text == "output":
            self._output()
        elif word.text == "name":
            name = self._take("the name of the theory", "name")
            if self.name:
                self._say(codes.TWICE, f"the theory has a name already, `{self.name}`", name.span, "keep one of them")
            self.name = self.name or name.text
        else:
            more = True
            while more:
                name = self._take("the name of an input", "name")
                self._once(self.inputs, name, "is an input", "remove one")
                more = self._comma()
        self._take("`}` or `,`", "}")

    def _output(self) -> None:
        letter = self._take('the type `b`, as in `output {b cook, "cook"}.`', "name")
        if self._next.text == "~":
            self._say(codes.SYNTAX, "an output is an atom, without `~`", self._next.span, "negate it outside")
            raise _Broken
        untyped = letter.text != "b" and self._next.text in ("}", ",")
        atom = letter if untyped else self._take("the name of an output", "name")
        form = f'write `output {{b {atom.text}, "{atom.text}"}}.`'
        text = self._take("the name outside (in quotes)", "text", form).text[1:-1] if self._comma() else atom.text
        named = text if text.strip() and text.isprintable() else atom.text
        form = f'write `output {{b {atom.text}, "{named}"}}.`'
        if untyped:
            self._say(codes.OUTPUT, "the type of the output is missing", letter.span, form)
        elif letter.text != "b":
            message = f"`{letter.text}` is not a type of outputs: the only one is `b`, for true or false"
            self._say(codes.OUTPUT, message, letter.span, form)
        if named != text:
            self._say(codes.OUTPUT, "the name outside is empty, or cannot be shown", atom.span, form)
        other = next((o for o in self.outputs if atom.text == o.atom or text == o.text), None)
        if other is not None:
            twice = atom if atom.text == other.atom else atom._replace(text=named)
            self._once({twice.text: other.span}, twice, "is an output", "remove one, or name it otherwise")
        self.outputs.append(Output(atom.text, text, atom.span))

    def _rule(self, start: _Token) -> None:
        label = start if start.kind == "name" and self._tokens[self._at + 1].text == ":" else None
        self._at += 2 if label else 0
        braces = self._next.text == "{"
        self._at += braces
        body: list[tuple[Literal, Span]] = []
        while (body and self._comma()) or not (body or (braces and self._next.text == "}")):
            body.append(self._literal("a literal" if body else "a literal, or `{}` for an empty body"))
        if braces:
            self._take("`}` or `,`", "}")
        kind = _ARROWS.get(self._next.text)
        if kind is None:
            fact = (
                body
                and self._next.text == "."
                and f"write `{{}} => {body[0][0]}.` for what holds by default (`->`: always)"
            )
            self._unfit(f"{'`,` or ' * bool(body)}an arrow (`->`, `=>`, `~>`)", fact or None)
        self._at += 1
        head, place = self._literal("the literal that the rule concludes")
        span = Span(self.source, start.span.start, place.end)
        if label is not None:
            self._once(self._labels, label, "labels a rule", "give one of them another label")
            self._numbers.setdefault(label.text, len(self.rules))
        name = "" if label is None else label.text
        self.rules.append(Rule(name, tuple(literal for literal, _ in body), kind, head, span))
        self._places.append((place, *(span for _, span in body)))
        if len(self.rules) > MAX_RULES:
            self._too_large(f"{MAX_RULES:,} rules", span)

    def _literal(self, what: str) -> tuple[Literal, Span]:
        first = self._next
        self._at += first.text == "~"
        atom = self._take(what, "name")
        return Literal(atom.text, atom is first), Span(self.source, first.span.start, atom.span.end)

    # ------------------------------------------------------------ tokens

    @property
    def _next(self) -> _Token:
        return self._tokens[self._at]

    def _begins(self) -> bool:
        """Whether a statement seems to begin here: `L:`, `L >`, `input {`, or a line where the last one is whole."""
        before, token, after = self._tokens[self._at - 1 : self._at + 2]
        if token.kind == "name" and (after.text in (":", ">") or (token.text in _DECLARED and after.text == "{")):
            return True
        fresh = "\n" in self.source.text[before.span.end : token.span.start]
        return fresh and (before.kind == "name" or before.text == "}") and (token.kind == "name" or token.text in "{~")

    def _comma(self) -> bool:
        """Pass over a comma, if there is one."""
        there = self._next.text == ","
        self._at += there
        return there

    def _take(self, what: str, kind: str, hint: str | None = None) -> _Token:
        """The next token, a sign or of that kind."""
        token = self._next
        if kind not in (token.kind, token.text):
            self._unfit(what, hint)
        self._at += 1
        return token

    def _unfit(self, expected: str, hint: str | None = None) -> NoReturn:
        token = self._next
        hint = meant_at(_HABITS, self.source.text, token.span.start) or hint or _FORM
        shown = f"`{token.text}`" if token.text.isprintable() else f"U+{ord(token.text[0]):04X}"
        written = "the file ends" if token.kind == "end" else f"there is {shown}"
        self._say(codes.SYNTAX, f"{expected} is expected, and {written}", token.span, hint)
        raise _Broken

    def _say(self, code: str, message: str, span: Span, hint: str) -> None:
        message, hint = (_LONG.sub(r"\1…", text) for text in (message, hint))
        self.found.append(Diagnostic(code, message, span, hint=hint))

    def _too_large(self, most: str, span: Span) -> NoReturn:
        hint = "split it into several theories: an output of one can be an input of another"
        raise DiagnosticError(Diagnostic(codes.TOO_LARGE, f"there are more than {most}", span, hint=hint))

    def _once(self, known: dict[str, Span], token: _Token, what: str, hint: str) -> None:
        """Note where a name stands first; another time is a mistake."""
        first = known.setdefault(token.text, token.span)
        if first != token.span:
            self._say(codes.TWICE, f"`{token.text}` {what} twice, first in {first.nearby}", token.span, hint)

    # ------------------------------------------------------------ what statements say together

    def check(self) -> None:
        """Say what is wrong with the statements together, but what may come from those that cannot be read."""
        concluded = dict.fromkeys(rule.head for rule in self.rules if rule.proves)
        known = dict.fromkeys((*map(Literal, self.inputs), *concluded))
        for rule, (head, *body) in zip(self.rules, self._places, strict=True):
            if rule.head.atom in self.inputs:
                message = f"`{rule.head.atom}` is an input, whose value is given: no rule can conclude it"
                hint = f"conclude an atom of another name, or remove the input in {self.inputs[rule.head.atom].nearby}"
                self._say(codes.INPUT_CONCLUDED, message, head, hint)
            for literal, span in zip(rule.body, body, strict=True):
                if literal.atom not in self.inputs and literal not in concluded:
                    self._unknown(literal, span, known, f"`input {{{literal.atom}}}.`, or a rule for it")
        for output in self.outputs:
            if output.atom in self.inputs:
                message = f"`{output.atom}` is an input, so it cannot be an output"
                self._say(codes.OUTPUT, message, output.span, "ask for an atom that rules conclude")
            elif Literal(output.atom) not in concluded:
                self._unknown(Literal(output.atom), output.span, concluded, "a rule for it")
        if not self.outputs and "output" not in self._of_broken:
            atom = next((literal.atom for literal in concluded), "cook")
            hint = f'write `output {{b {atom}, "{atom}"}}.`'
            self._say(codes.OUTPUT, "the theory has no output", self._tokens[-1].span, hint)
        self._check_priorities()
        for cycle in _cycles(dependence(rule for rule in self.rules if rule.head.atom not in self.inputs)):
            atom, needed = cycle[-1], cycle[-2]
            span = next(
                places[1 + [literal.atom for literal in rule.body].index(needed)]
                for rule, places in zip(self.rules, self._places, strict=True)
                if rule.head.atom == atom and needed in (literal.atom for literal in rule.body)
            )
            message = f"`{atom}` depends on itself: {_shown(cycle[::-1], ' ← ')}"
            self._say(codes.CYCLE, message, span, f"remove `{needed}` from the body, or conclude another atom")

    def _unknown(self, literal: Literal, span: Span, known: Collection[Literal], instead: str) -> None:
        if literal.atom in self._of_broken or len(self.found) >= MAX_DIAGNOSTICS:
            return
        if literal.complement in known:
            message = f"no rule can conclude `{literal}`, only rules for `{literal.complement}` are there"
            hint = f"add a rule for it, such as `{{}} => {literal}.` for what holds by default"
        elif any(rule.head == literal for rule in self.rules):
            message = f"no rule can conclude `{literal}`, only defeaters are there"
            hint = "write `=>` instead of `~>` for what holds by default"
        else:
            message = f"`{literal.atom}` is not an input, and no rule can conclude it"
            near = near_names(literal.atom, [one.atom for one in known])
            hint = near or f"write {instead}"
            hint = "write `{}` for the body of what needs nothing" if literal.atom == "true" else hint
        self._say(codes.UNKNOWN, message, span, hint)

    def _check_priorities(self) -> None:
        wanted = asked(self.rules, self.outputs)
        relabelled = len(self._labels) < sum(1 for rule in self.rules if rule.label)
        for pair in self._priorities:
            numbers = [self._numbers.get(token.text) for token in pair]
            for token, number in zip(pair, numbers, strict=True):
                if (
                    number is None
                    and not relabelled
                    and token.text not in self._of_broken
                    and len(self.found) < MAX_DIAGNOSTICS
                ):
                    hint = did_you_mean(token.text, self._labels) or f"write `{token.text}: BODY => HEAD.`"
                    self._say(codes.UNKNOWN_LABEL, f"no rule has the label `{token.text}`", token.span, hint)
            first, second = numbers
            if first is None or second is None or not self._of_broken.isdisjoint(token.text for token in pair):
                continue
            one, other = self.rules[first].head, self.rules[second].head
            span = Span(self.source, pair[0].span.start, pair[1].span.end)
            if first == second or one == other.complement:
                self.superior.setdefault((first, second), span)
            else:
                message = f"these rules conclude `{one}` and `{other}`, which are not opposite"
                odd = next((atom for atom in (one.atom, other.atom) if atom not in wanted), "")
                near = odd and near_names(odd, [atom for atom in wanted if atom not in self.inputs])
                self._say(codes.UNOPPOSED, message, span, near or "remove the priority: it would change nothing")
        weaker: dict[int, dict[int, None]] = {}
        for strong, weak in self.superior:
            weaker.setdefault(strong, {})[weak] = None
        for cycle in _cycles(weaker):
            labels = [self.rules[number].label for number in reversed(cycle)]
            message = f"`{labels[0]}` is stronger than itself: {_shown(labels, ' > ')}"
            last = max((self.superior[pair] for pair in pairwise(reversed(cycle))), key=lambda span: span.start)
            self._say(codes.PRIORITY_CYCLE, message, last, "remove one of these priorities")


def _cycles(after: dict[_Key, dict[_Key, None]]) -> Iterator[list[_Key]]:
    """Some cycles of a graph, each node before those that have it in their entry, the first one also as the last. An
    edge of each is removed."""
    for _ in range(MAX_CYCLES):
        try:
            TopologicalSorter(after).prepare()
        except CycleError as error:
            cycle: list[_Key] = error.args[1]
            yield cycle
            del after[cycle[-1]][cycle[-2]]
        else:
            return


def _shown(nodes: list[str], sign: str) -> str:
    return sign.join(nodes if len(nodes) <= 9 else [*nodes[:6], "…", *nodes[-2:]])
