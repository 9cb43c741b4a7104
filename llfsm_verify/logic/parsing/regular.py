"""From the words of a regular property to its expression: letters in sequence, `|`, `*`, `+`, `?`, `{2,5}`."""

from __future__ import annotations

from dataclasses import dataclass, field

from llfsm_verify.diagnostics import DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import repeat
from llfsm_verify.logic.formula import FALSE, TRUE, Formula, apply, atom, depth, is_boolean
from llfsm_verify.logic.parsing.formulas import MAX_DEPTH, Parsed, parse_words, refuse_initially
from llfsm_verify.logic.parsing.tokens import PREFIX, TEMPORAL_PAIRS
from llfsm_verify.logic.parsing.words import Words, check_words

MAX_REPETITIONS = 10_000

_POSTFIX = {"*": (0, None), "+": (1, None), "?": (0, 1)}


@dataclass(slots=True)
class _Group:
    """What stands inside one pair of parentheses so far: finished alternatives, and the current sequence."""

    opening: int
    alternatives: list[Formula] = field(default_factory=list)
    sequence: list[Formula] = field(default_factory=list)

    def joined(self) -> Formula:
        """The current sequence."""
        return self.sequence[0] if len(self.sequence) == 1 else apply("seq", *self.sequence)

    def close(self) -> Formula:
        """All of it."""
        options = [*self.alternatives, self.joined()]
        return options[0] if len(options) == 1 else apply("alt", *options)


def parse_regular(words: Words) -> Parsed:
    """The expression that `words`, of which there is at least one, stand for; DiagnosticError when there is a mistake.

    Its letters are state formulas, each as the user wrote it. Iterative: brackets may be nested as deep as allowed.
    """
    check_words(words)
    refuse_initially(words, "in a rule", "a rule about the beginning is `forbid initially NAME: …`")
    tokens = words.tokens
    atoms: dict[str, Fragment] = {}
    groups = [_Group(-1)]
    i = 0
    while i < len(tokens):
        token, group = tokens[i], groups[-1]
        if token.type == "LPAR":
            groups.append(_Group(i))
        elif token.type == "RPAR":
            if not group.sequence:
                raise _missing(words, i)
            groups.pop()
            groups[-1].sequence.append(group.close())
        elif token.type == "OR":
            if not group.sequence:
                raise _missing(words, i)
            group.alternatives.append(group.joined())
            group.sequence = []
        elif token.text in _POSTFIX or token.type == "LBRACE":
            if not group.sequence:
                raise _missing(words, i)
            low, high, i = _repetition(words, i)
            group.sequence[-1] = _as_written(group.sequence[-1], low, high)
        else:
            letter, i = _letter(words, i, atoms)
            group.sequence.append(letter)
        i += 1
    if not groups[0].sequence:
        raise _missing(words, len(tokens))
    expression = groups[0].close()
    if depth(expression) > MAX_DEPTH:
        raise words.error(codes.TOO_DEEP, f"more than {MAX_DEPTH:,} operators inside each other", 0, len(tokens) - 1)
    return Parsed(expression, atoms)


def _as_written(f: Formula, low: int, high: int | None) -> Formula:
    """`f` repeated; ``f{0}`` stays a node, because its letters tell configurations apart like all others."""
    return apply("repeat", f, bound="0:0") if high == 0 and f is not TRUE else repeat(f, low, high)


def _missing(words: Words, i: int) -> DiagnosticError:
    if i == len(words.tokens):
        last = words.tokens[-1].text
        return words.error(
            codes.UNFINISHED, f"a letter is missing after `{last}`, where the expression ends", i - 1, i - 1
        )
    return words.error(codes.OPERAND_MISSING, f"a letter is missing before `{words.tokens[i].text}`", i, i)


def _repetition(words: Words, i: int) -> tuple[int, int | None, int]:
    """Least and largest number of repetitions, and the number of the last word."""
    text = words.tokens[i].text
    if text in _POSTFIX:
        return *_POSTFIX[text], i
    last = next(k for k in range(i, len(words.tokens)) if words.tokens[k].type == "RBRACE")  # brackets match
    inside = [t.text for t in words.tokens[i + 1 : last]]
    numbers = [t for t in inside if t.isascii() and t.isdigit() and len(t) < 10]
    low = int(numbers[0]) if numbers else 0
    if len(inside) == 1 and numbers:
        high: int | None = low
    elif len(inside) == 2 and len(numbers) == 1 and inside[1] == ",":
        high = None
    elif len(inside) == 3 and len(numbers) == 2 and inside[1] == ",":
        high = int(numbers[1])
    else:
        hint = "write `{3}`, `{2,5}` or `{2,}`"
        raise words.error(
            codes.REPETITION, f"`{words.text(i, last)}` is not a valid number of repetitions", i, last, hint
        )
    if high is not None and high < low:
        hint = f"write `{{{high},{low}}}`"
        raise words.error(codes.REPETITION, f"`{words.text(i, last)}` ends before it starts", i, last, hint)
    if max(low, high or 0) > MAX_REPETITIONS:
        raise words.error(codes.REPETITION, f"more than {MAX_REPETITIONS:,} repetitions", i, last)
    return low, high, last


def _letter(words: Words, i: int, atoms: dict[str, Fragment]) -> tuple[Formula, int]:
    """The letter that starts with word number `i`, and the number of its last word."""
    tokens = words.tokens
    token = tokens[i]
    if token.type in ("TRUE", "FALSE"):
        return (TRUE if token.type == "TRUE" else FALSE), i
    if token.type == "LSQB":
        last, level = i, 0
        for last in range(i, len(tokens)):
            level += (tokens[last].type == "LSQB") - (tokens[last].type == "RSQB")
            if level == 0:
                break
        if last == i + 1:
            raise words.error(codes.EMPTY, "there is no formula between the brackets", i, last)
        parsed = parse_words(Words(words.fragment, tokens[i + 1 : last]))
        if not is_boolean(parsed.formula):
            message = "a letter speaks of one configuration, and this formula has a temporal operator"
            raise words.error(codes.REGULAR_LETTER, message, i, last, "write it as a property of its own: `NAME: …`")
        for key, place in parsed.atoms.items():
            atoms.setdefault(key, place)
        return parsed.formula, last
    if token.type in ("NAME", "STRING"):
        last = i
        while (
            token.type == "NAME"
            and last + 2 < len(tokens)
            and tokens[last + 1].type in ("DOT", "AT")
            and tokens[last + 2].type == "NAME"
        ):
            _refuse_apart(words, i, last + 1)
            last += 2
        if [t.type for t in tokens[i + 1 : i + 3]] == ["AT", "LBRACE"]:
            last = next(k for k in range(i, len(tokens)) if tokens[k].type == "RBRACE")  # brackets match
        place = words.atom(i, last)
        atoms.setdefault(place.text, place)
        return atom(place.text), last
    raise _no_letter(words, i)


def _refuse_apart(words: Words, i: int, sign: int) -> None:
    """DiagnosticError: blanks around a `.`, which then looks like a sign for sequences."""
    before, dot, name = words.tokens[sign - 1 : sign + 2]
    if dot.type != "DOT" or (before.end == dot.start and dot.end == name.start):
        return
    joined = "".join(token.text for token in words.tokens[i : sign + 2])
    a = words.excerpt(i, sign - 1)
    message = "`.` does not join letters to a sequence: write them next to each other"
    hint = f"write `{a} {name.text}`, or `{joined}` for the variable `{name.text}` of `{a}`"
    raise words.error(codes.REGULAR_LETTER, message, sign, sign, hint)


def _no_letter(words: Words, i: int) -> DiagnosticError:
    token = words.tokens[i]
    hint = "a letter is `m@STATE`, the name of a Boolean, `true`, or a formula in brackets: `[x > 3 && !car]`"
    if token.type == "NOT":
        hint = "write `[!…]`: put a formula into brackets"
    elif token.type in ("COMMA", "AND", "DOT"):
        hint = "write letters next to each other: `a b`; put a formula into brackets: `[a && b]`"
    elif token.type in PREFIX | TEMPORAL_PAIRS and token.text.isalpha():
        rest = words.tokens[i + 1 :]
        bare = len(rest) > 2 and rest[0].type == "LPAR" and rest[-1].type == "RPAR"
        inner = words.excerpt(i + 1 + bare, len(words.tokens) - 1 - bare) if rest and i == 0 else "…"
        hint = f'letters have no temporal operators: write `[{inner}]`, or `"{token.text}"` for a variable'
    elif token.type in ("COMPARE", "IMPLIES", "IFF", "XOR", "MINUS", "ARITHMETIC", "ASSIGN") and i in (1, 3):
        hint = f"put a formula into brackets: `[{words.excerpt(0, len(words.tokens) - 1)}]`"
    return words.error(
        codes.REGULAR_LETTER, f"`{token.text}` is not a valid letter of a regular expression", i, i, hint
    )
