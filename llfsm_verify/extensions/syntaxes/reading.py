"""A reader of formulas by operator precedence, the same for every syntax, with stacks of its own: depth is no danger.

Source: Dijkstra's shunting yard (Algol 60 translation, 1961), with a second table inside the braces of an expression.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.syntaxes.ranges import WrongRange, repetitions, step_operators
from llfsm_verify.extensions.syntaxes.table import Infix, SyntaxTable
from llfsm_verify.plug import FALSE_FORMULA as FALSE
from llfsm_verify.plug import (
    MAX_DEPTH,
    MAX_TOKENS,
    Formula,
    Fragment,
    Parsed,
    apply,
    atom,
    atom_place,
    depth,
    first_match,
    negation,
    repeat,
    sequence,
)
from llfsm_verify.plug import TRUE_FORMULA as TRUE
from llfsm_verify.plug import WRONG_BOUND as BOUND
from llfsm_verify.plug import WRONG_EMPTY as EMPTY
from llfsm_verify.plug import WRONG_FOREIGN as FOREIGN
from llfsm_verify.plug import WRONG_MIXTURE as MIXTURE
from llfsm_verify.plug import WRONG_OPEN_BRACKET as OPEN_BRACKET
from llfsm_verify.plug import WRONG_REPETITION as REPETITION
from llfsm_verify.plug import WRONG_STRAY_BRACKET as STRAY_BRACKET
from llfsm_verify.plug import WRONG_TOO_DEEP as TOO_DEEP
from llfsm_verify.plug import WRONG_TOO_MANY_WORDS as TOO_MANY_WORDS
from llfsm_verify.plug import FormulaOp as Op

_TIGHT, _LOOSE = 100, 0
_NARY = frozenset({"and", "or", "seq", "fuse", "alt", "inter", "nlm"})
_BOOLEAN_ONLY = frozenset({"xor", "implies", "iff"})
_LENGTH_MATCHING = frozenset({"&&", "/\\", "∧"})


class _Token(NamedTuple):
    kind: str
    text: str
    start: int
    end: int


@dataclass(slots=True)
class _Operand:
    """A formula or expression in the making: `parts` joined by `op`, or the only one of them."""

    parts: list[Formula]
    op: Op | None
    start: int
    end: int
    boolean: bool
    braced: bool = False

    def formula(self) -> Formula:
        if self.op is not None:
            self.parts = [apply(self.op, *self.parts)]
            self.op = None
        return self.parts[0]


@dataclass(frozen=True, slots=True)
class _Operator:
    """What waits for its right operand. `expression`: the match after which it must hold."""

    sort: Literal["prefix", "infix", "bind"]
    op: Op
    level: int
    token: _Token
    bound: str = ""
    expression: Formula | None = None


@dataclass(frozen=True, slots=True)
class _Frame:
    """An open bracket: the operators and operands inside start at these places of their stacks."""

    token: _Token
    operators: int
    inside: bool
    """Inside the braces of an expression."""
    first_match: bool = False


def read_formula(table: SyntaxTable, fragment: Fragment) -> Parsed:
    """The formula written in `fragment` in the syntax of `table`; DiagnosticError when it is no formula."""
    start, end, _ = unwrap(table, fragment.text)
    return _Reader(table, fragment).read(start, end)


def unwrap(table: SyntaxTable, text: str) -> tuple[int, int, str | None]:
    """Where the formula of `text` starts and ends, without `ltl name { … }` and the like, and its name there."""
    end = len(text.rstrip())
    opened = table.wrapper.match(text) if table.wrapper is not None else None
    if opened is None:
        return 0, len(text), None
    if text[:end].endswith(";"):
        end = len(text[: end - 1].rstrip())
    if opened.group().endswith("{"):
        if not text[:end].endswith("}"):
            return 0, len(text), None
        end -= 1
    return opened.end(), max(end, opened.end()), opened["name"]


class _Reader:
    def __init__(self, table: SyntaxTable, fragment: Fragment) -> None:
        self._table = table
        self._fragment = fragment
        self._atoms: dict[str, Fragment] = {}
        self._operands: list[_Operand] = []
        self._operators: list[_Operator] = []
        self._frames: list[_Frame] = []

    # ------------------------------------------------------------ mistakes

    def _error(self, message: str, token: _Token, hint: str | None = None, code: str = FOREIGN) -> DiagnosticError:
        return self._wrong(message, token.start, token.end, hint, code)

    def _wrong(
        self, message: str, start: int, end: int, hint: str | None = None, code: str = FOREIGN
    ) -> DiagnosticError:
        return DiagnosticError(Diagnostic(code, message, self._fragment.span(start, end), hint=hint))

    # ------------------------------------------------------------ tokens

    def _tokens(self, start: int, end: int) -> list[_Token]:
        text, pattern = self._fragment.text, self._table.tokens
        found: list[_Token] = []
        at = start
        while at < end:
            match = pattern.match(text, at, end)
            if match is None or match.end() == at:
                character = text[at]
                shown = f"`{character}`" if character.isprintable() else f"U+{ord(character):04X}"
                message = f"{shown} is not allowed here in {self._table.title}'s formulas"
                hint = 'a name with other characters is quoted: `"…"`'
                raise self._wrong(message, at, at + 1, hint)
            if match.lastgroup != "SKIP":
                found.append(_Token(match.lastgroup or "", match.group(), at, match.end()))
                if len(found) > MAX_TOKENS:
                    message = f"more than {MAX_TOKENS:,} words and signs"
                    raise self._error(message, found[-1], code=TOO_MANY_WORDS)
            at = match.end()
        return found

    # ------------------------------------------------------------ the loop

    def read(self, start: int, end: int) -> Parsed:
        tokens = self._tokens(start, end)
        if not tokens:
            raise self._wrong("there is no formula", start, end, code=EMPTY)
        operand_next = True
        for i, token in enumerate(tokens):
            if operand_next:
                operand_next = self._operand(token, tokens[i + 1] if i + 1 < len(tokens) else None)
            else:
                operand_next = self._after(token)
        if operand_next:
            raise self._error(f"something is missing after `{tokens[-1].text}`, where the formula ends", tokens[-1])
        if self._frames:
            opening = self._frames[-1].token
            raise self._error(f"this `{opening.text}` is not closed", opening, code=OPEN_BRACKET)
        self._reduce(0, _LOOSE - 1)
        formula = self._as_formula(self._operands.pop())
        if depth(formula) > MAX_DEPTH:
            message = f"more than {MAX_DEPTH:,} operators inside each other"
            raise self._wrong(message, start, end, code=TOO_DEEP)
        return Parsed(formula, self._atoms)

    @property
    def _inside(self) -> bool:
        return bool(self._frames) and self._frames[-1].inside

    def _push(self, formula: Formula, token: _Token, boolean: bool, braced: bool = False) -> None:
        self._operands.append(_Operand([formula], None, token.start, token.end, boolean, braced))

    def _operand(self, token: _Token, following: _Token | None) -> bool:
        """Take `token` where an operand is expected; whether one still is."""
        kind, text = token.kind, token.text
        table = self._table
        if kind == "ATOM" and text.isdigit():
            kind = "NAME"
        constant = text.lower() if table.name == "spot" else text
        if kind == "NAME" and constant in table.true | table.false:
            self._push(TRUE if constant in table.true else FALSE, token, True)
            return False
        if kind in ("SIGN", "NAME") and text in table.prefix:
            op = table.prefix[text]
            if self._inside and op != "not":
                raise self._temporal_inside(token)
            self._operators.append(_Operator("prefix", op, _TIGHT, token))
            return True
        if kind == "STEPS":
            self._steps(token)
            return True
        if kind == "RANGE" and self._inside and text[1] in "*+":
            low, high = self._range(token)
            self._push(repeat(TRUE, low, high), token, False)
            return False
        if kind == "SIGN" and text == "*" and self._inside:
            raise self._error(
                "`*` repeats what is before it, but nothing is there", token, "write `[*]` for any letters"
            )
        if kind == "OPEN":
            self._open(token, False)
            return True
        if kind == "NAME" and text == "first_match" and self._inside and following and following.text == "(":
            self._open(token, True)
            return True
        if kind in ("NAME", "ATOM", "QUOTED") and text not in table.infix and not text.isdigit():
            place = atom_place(self._fragment, token.start, token.end, kind == "QUOTED", table.equals)
            self._atoms.setdefault(place.text, place)
            self._push(atom(place.text), token, True)
            return False
        raise self._error(f"something is missing before `{text}`", token)

    def _open(self, token: _Token, is_first_match: bool) -> None:
        inside = self._inside or token.text == "{"
        if is_first_match:
            self._frames.append(_Frame(token, len(self._operators), True, True))
            return
        if self._frames and self._frames[-1].first_match and self._frames[-1].token.text == "first_match":
            # The parenthesis of `first_match(`: the frame is there already.
            frame = self._frames.pop()
            self._frames.append(_Frame(token, frame.operators, True, True))
            return
        self._frames.append(_Frame(token, len(self._operators), inside))

    def _after(self, token: _Token) -> bool:
        """Take `token` after an operand; whether one is expected now."""
        kind, text = token.kind, token.text
        top = self._operands[-1]
        if kind == "CLOSE":
            self._close(token)
            return False
        if kind == "VALUE":
            if top.op is not None or top.parts[0].op != "atom":
                raise self._error("only an atom has a value", token)
            if text[-1] == "0":
                top.parts[0] = negation(top.parts[0])
            top.end = token.end
            return False
        if kind == "RANGE" or (kind == "SIGN" and text == "*" and self._inside):
            self._repeat(token)
            return False
        if top.braced:
            if kind == "BINDER":
                self._bind(token, _LOOSE)
                return True
            if text == "!":
                self._operands[-1] = _Operand(
                    [apply("<>->", top.formula(), TRUE)], None, top.start, token.end, boolean=False
                )
                return False
            if text == "(":
                self._bind(_Token("BINDER", "[]->", token.start, token.start), _TIGHT)
                self._open(token, False)
                return True
        infix = self._table.infix.get(text) if kind in ("SIGN", "NAME") else None
        if infix is None:
            before = self._fragment.text[top.start : top.end][-20:]
            hint = "write a regular expression in braces before it" if kind == "BINDER" else None
            raise self._error(f"there is no operator between `{before}` and `{text}`", token, hint)
        self._infix(token, infix)
        return True

    def _infix(self, token: _Token, infix: Infix) -> None:
        if infix.op in ("seq", "fuse") and not self._inside:
            message = f"`{token.text}` joins regular expressions, which are written in braces"
            raise self._error(message, token, "write `{a ; b}`")
        if self._inside and infix.op in ("U", "W", "R", "M", "S", "T"):
            raise self._temporal_inside(token)
        base = self._frames[-1].operators if self._frames else 0
        if infix.op in self._table.unsettled:
            self._refuse_mixture(token, infix, base)
        self._reduce(base, infix.level - (0 if infix.right else 1))
        self._operators.append(_Operator("infix", infix.op, infix.level, token))

    def _refuse_mixture(self, token: _Token, infix: Infix, base: int) -> None:
        """An operator that waits, and another before it that could as well take `token`'s left operand."""
        unsettled = self._table.unsettled
        loosest = min(i.level for i in self._table.infix.values() if i.op in unsettled)
        for place in range(len(self._operators) - 1, base - 1, -1):
            waiting = self._operators[place]
            if waiting.level < loosest:
                return
            if waiting.op not in unsettled or waiting.op == infix.op:
                continue
            self._reduce(place + 1, _LOOSE - 1)
            left, middle = self._operands[-2:]
            text = self._fragment.text
            a, b = (_shortened(text[side.start : side.end]) for side in (left, middle))
            one, two = waiting.token.text, token.text
            raise self._error(
                f"{self._table.title}'s manual and its parser group `{one}` and `{two}` differently",
                token, f"write `({a} {one} {b}) {two} …` or `{a} {one} ({b} {two} …)`", MIXTURE,
            )  # fmt: skip

    def _temporal_inside(self, token: _Token) -> DiagnosticError:
        return self._error(f"`{token.text}` is a temporal operator, and a regular expression has none", token)

    # ------------------------------------------------------------ brackets, repetitions, bounds

    def _close(self, token: _Token) -> None:
        wanted = "{" if token.text == "}" else "("
        if not self._frames:
            raise self._error(f"this `{token.text}` closes nothing", token, code=STRAY_BRACKET)
        frame = self._frames[-1]
        if frame.token.text != wanted:
            message = f"this `{token.text}` does not match the `{frame.token.text}` before it"
            raise self._error(message, token, code=STRAY_BRACKET)
        self._reduce(frame.operators, _LOOSE - 1)
        self._frames.pop()
        top = self._operands[-1]
        outside = not self._inside
        if frame.inside:
            formula = top.formula()
            if frame.first_match:
                formula = formula if top.boolean else first_match(formula)
            braced = outside and wanted == "{"
            self._operands[-1] = _Operand([formula], None, frame.token.start, token.end, top.boolean, braced)
        else:
            formula = self._as_formula(top)
            self._operands[-1] = _Operand([formula], None, frame.token.start, token.end, top.boolean and not top.braced)

    def _repeat(self, token: _Token) -> None:
        if not self._inside:
            message = f"`{token.text}` repeats a regular expression, which is written in braces"
            raise self._error(message, token, "write `{a[*]}`")
        self._reduce(self._frames[-1].operators, _TIGHT - 1)
        top = self._operands[-1]
        body = top.formula()
        kind = token.text[1:2]
        low, high = self._range(token)
        if token.text == "*" or kind in "*+":
            result = repeat(body, low, high)
        else:
            if not top.boolean:
                raise self._error(f"`{token.text}` counts letters in which a state formula holds", token)
            gap = repeat(negation(body), 0, None)
            if kind == "=" and low == 0 and high is None:
                result = repeat(TRUE, 0, None)
            else:
                result = repeat(sequence((gap, body)), low, high)
                result = sequence((result, gap)) if kind == "=" else result
        self._operands[-1] = _Operand([result], None, top.start, token.end, boolean=result is body and top.boolean)

    def _range(self, token: _Token) -> tuple[int, int | None]:
        try:
            return repetitions(token.text)
        except WrongRange as wrong:
            raise self._error(str(wrong), token, code=REPETITION) from None

    def _steps(self, token: _Token) -> None:
        if self._inside:
            raise self._temporal_inside(token)
        try:
            found = step_operators(token.text)
        except WrongRange as wrong:
            raise self._error(str(wrong), token, code=BOUND) from None
        self._operators += [_Operator("prefix", op, _TIGHT, token, bound=bound) for op, bound in found]

    def _bind(self, token: _Token, level: int) -> None:
        expression = self._operands.pop().formula()
        if token.text.endswith("=>"):
            expression = sequence((expression, TRUE))
        op: Op = "<>->" if token.text.startswith("<>") else "[]->"
        self._operators.append(_Operator("bind", op, level, token, expression=expression))

    # ------------------------------------------------------------ operators meet their operands

    def _reduce(self, base: int, level: int) -> None:
        """Apply the operators above `base` that bind more tightly than `level`."""
        while len(self._operators) > base and self._operators[-1].level > level:
            self._apply(self._operators.pop())

    def _as_formula(self, operand: _Operand) -> Formula:
        """Braces alone are the weak closure of their expression."""
        formula = operand.formula()
        return apply("closure", formula) if operand.braced else formula

    def _apply(self, operator: _Operator) -> None:
        right = self._operands.pop()
        if operator.sort == "bind":
            assert operator.expression is not None
            formula = apply(operator.op, operator.expression, self._as_formula(right))
            self._operands.append(_Operand([formula], None, operator.token.start, right.end, boolean=False))
            return
        if operator.sort == "prefix":
            if self._inside and not right.boolean:
                raise self._error(f"`{operator.token.text}` in braces negates only state formulas", operator.token)
            argument = self._as_formula(right)
            negated = operator.op == "not"
            formula = negation(argument) if negated else apply(operator.op, argument, bound=operator.bound)
            boolean = operator.op == "not" and right.boolean and not right.braced
            self._operands.append(_Operand([formula], None, operator.token.start, right.end, boolean))
            return
        left = self._operands.pop()
        boolean = left.boolean and right.boolean and not left.braced and not right.braced
        op = self._joint(operator, boolean) if self._inside else operator.op
        if op in _NARY:
            first = (
                left if left.op == op else _Operand([self._as_formula(left)], op, left.start, left.end, left.boolean)
            )
            first.parts.append(self._as_formula(right))
            first.op, first.end, first.boolean = op, right.end, boolean and op in ("and", "or")
            self._operands.append(first)
            return
        formula = apply(op, self._as_formula(left), self._as_formula(right))
        self._operands.append(
            _Operand([formula], None, left.start, right.end, boolean and operator.op in _BOOLEAN_ONLY)
        )

    def _joint(self, operator: _Operator, boolean: bool) -> Op:
        """The operator inside braces, where `|` and `&` mean something else between expressions."""
        if operator.op == "or":
            return "or" if boolean else "alt"
        if operator.op == "and":
            return "and" if boolean else "inter" if operator.token.text in _LENGTH_MATCHING else "nlm"
        if operator.op in _BOOLEAN_ONLY and not boolean:
            message = f"`{operator.token.text}` joins state formulas, not regular expressions"
            raise self._error(message, operator.token)
        return operator.op


def _shortened(text: str) -> str:
    return text if len(text) <= 30 else f"{text[:29]}…"
