"""What to say when the words of a formula do not fit together, also to those who write what another tool knows."""

from __future__ import annotations

import re
from dataclasses import replace
from difflib import get_close_matches

from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, meant_at
from llfsm_verify.logic import codes
from llfsm_verify.logic.lines import kind_meant
from llfsm_verify.logic.parsing.bounds import meant
from llfsm_verify.logic.parsing.tokens import BINARY, ENDS_OPERAND, PREFIX, TEMPORAL_PAIRS
from llfsm_verify.logic.parsing.words import Words
from llfsm_verify.logic.patterns import SIMPLE

_LETTERS = frozenset("GFXUWRMYZOHST")
_BOUND = re.compile(r"\s*[<>]=?\s*[0-9.]+(?:\s*(?:ms|s|min|seconds?|minutes?))?\b")
_JOINED = re.compile(r"[GFXYZOH]{2,}\Z")
NO_BITS = "a property has no bit operations: calculate them in a variable, and compare that"
"""What is said where `&`, `<<` and the like stand between numbers."""


def misfit(words: Words, i: int) -> DiagnosticError:
    """The grammar accepts the words before number `i`, but not this one (`i` the number of words: not the end)."""
    tokens = words.tokens
    if i == len(tokens):
        last = tokens[-1].text
        if last in _LETTERS and (i == 1 or tokens[i - 2].type not in ENDS_OPERAND):
            return _operator_as_name(words, i - 1)
        message = f"something is missing after `{last}`, where the formula ends"
        half = f"write `{tokens[-2].text}.0`" if last == "." and i > 1 and tokens[-2].type == "NUMBER" else None
        return words.error(codes.UNFINISHED, message, i - 1, i - 1, half)
    before = tokens[i - 1] if i else None
    token = tokens[i]
    if token.type in ("QUESTION", "COLON", "LBRACE", "RBRACE"):
        return _misplaced(words, i)
    if before is not None and before.type in ENDS_OPERAND:
        return _operator_missing(words, i)
    if token.type in BINARY | {"RPAR", "RSQB", "COMMA", "DOT", "AT"} and before is not None and before.text in _LETTERS:
        if i == 1 or tokens[i - 2].type not in ENDS_OPERAND:
            return _operator_as_name(words, i - 1)
    if token.text in TEMPORAL_PAIRS:
        return _operator_as_name(words, i)
    if token.type in PREFIX and before is not None and before.type in ("MINUS", "ARITHMETIC"):
        return words.error(
            codes.FORMULA_AS_VALUE,
            f"`{token.text}` makes a formula, which cannot be an operand of `{before.text}`",
            i,
            i,
        )
    if before is not None and before.type in ("DOT", "AT"):
        what = "the name of a state" if before.type == "AT" else "a name"
        half = f"write `{tokens[i - 2].text}.0`" if i > 1 and tokens[i - 2].type == "NUMBER" else None
        return words.error(codes.OPERAND_MISSING, f"`{before.text}` needs {what} after it", i, i, half)
    hint = None
    if token.type == "DOT" and i + 1 < len(tokens) and tokens[i + 1].type == "NUMBER":
        hint = f"write `0.{tokens[i + 1].text}`"
    elif token.text in ("<", ">") and before is not None and before.text == token.text:
        hint = NO_BITS
    elif token.text[0] in "<>" and i and (bound := _bound_meant(words, i - 1)):
        hint = bound
    return words.error(codes.OPERAND_MISSING, f"something is missing before `{token.text}`", i, i, hint)


def refuse_operator(words: Words, i: int) -> None:
    """DiagnosticError when the name number `i`, which looks like a function, is `GF`, or an operator of others."""
    name = words.tokens[i].text
    if _JOINED.match(name) or name in _CTL or name.lower() in _PREFIXES | {"never"}:
        raise _operator_missing(words, i + 1)


def _joined(words: Words, i: int) -> DiagnosticError:
    word = words.tokens[i].text
    message = f"`{word}` is one word, so it is read as a name, not as an operator"
    rest = words.rest(i + 1)
    whole = "" if rest == "…" or rest.count("(") < rest.count(")") else f" {rest}"
    return words.error(codes.JOINED_OPERATORS, message, i, i, f"write `{' '.join(word)}{whole}`")


def _operator_missing(words: Words, i: int) -> DiagnosticError:
    before, token = words.tokens[i - 1], words.tokens[i]
    compared = i > 1 and words.tokens[i - 2].type in ("COMPARE", "ASSIGN", "MINUS", "ARITHMETIC")
    if before.type == "NAME" and _JOINED.match(before.text) and not compared:
        return _joined(words, i - 1)
    hint = None
    if token.text == "<>":
        hint = "`<>` is the temporal operator F; write `!=` for `not equal`"
    elif token.text == "!":
        hint = "write `!=` for `not equal`" if words.tokens[i + 1 : i + 2] else None
    elif token.type in PREFIX | {"NAME", "LPAR"} and before.type == "NAME" and before.text.lower() in _SPELLINGS:
        hint = f"write `{_SPELLINGS[before.text.lower()]}`"
    elif token.type == "NAME" and token.text.lower() in _SPELLINGS:
        hint = f"write `{_SPELLINGS[token.text.lower()]}`"
    elif before.text in _CTL:
        hint = _instead_of_ctl(before.text)
    elif before.text in ("A", "E") and token.text in ("G", "F", "X"):
        hint = _instead_of_ctl(f"{before.text} {token.text}")
    elif i == 1 and before.text.lower() in ("define", "def", "let", "macro") and token.type == "NAME":
        hint = f"write `define {token.text}: {words.rest(2 + [t.type for t in words.tokens[2:3]].count('ASSIGN'))}`"
    elif i == 1 and before.type == "NAME" and (kind := kind_meant(before.text)) is not None:
        hint = f"a property of the kind `{kind}` is a line of its own: `{kind} NAME: …`"
    elif token.type == "COMMA" and [t.type for t in words.tokens[i - 1 : i + 2]] == ["NUMBER", "COMMA", "NUMBER"]:
        hint = f"write `{before.text}.{words.tokens[i + 1].text}`"
    hint = hint or _pattern_meant(words, i) or "write an operator there, such as `&&` or `->`"
    name, text = words.text(0, min(i - 1, 8)), words.fragment.text[: words.tokens[0].start]
    begins = token.type in PREFIX - {"NOT"} and not text.rpartition("\n")[2].strip()
    if hint.startswith("write an operator") and begins and re.fullmatch(r"[A-Za-z_][A-Za-z0-9_-]*", name):
        hint = f"write `{name}: {words.rest(i)}` where `{name}` is its name, or else {hint.removeprefix('write ')}"
    message = f"there is no operator between `{before.text}` and `{token.text}`"
    return words.error(codes.OPERATOR_MISSING, message, i, i, hint)


_CTL = ("AG", "AF", "AX", "EG", "EF", "EX")


def _instead_of_ctl(operator: str) -> str:
    if operator[0] == "A":
        return f"`{operator}` is an operator of CTL; every property here is about all runs, so write `{operator[-1]}`"
    return f"`{operator}` is an operator of CTL; `llfsm query ARRANGEMENT p` tells whether a run reaches p"


_SPELLINGS = {
    "and": "and", "or": "or", "not": "not", "xor": "xor", "implies": "->", "iff": "<->", "until": "U", "weak": "W",
    "release": "R", "v": "R", "always": "G", "globally": "G", "eventually": "F", "finally": "F", "next": "X",
    "since": "S", "triggered": "T", "once": "O", "historically": "H", "previously": "Y", "yesterday": "Y",
    "initial": "initially", "initially": "initially", "init": "initially",
}  # fmt: skip
_PREFIXES = frozenset(word for word, operator in _SPELLINGS.items() if operator in {*"GFXOHY", "initially"})


_AS_FORMULA = {
    "absence": "`G !p` for `absence of p`", "existence": "`F p` for `existence of p`",
    "universality": "`G p` for `universality of p`",
    "bounded": "`!p W (p W (!p W (p W G !p)))` for `bounded existence of p`",
    "responds": "`G (p -> F s)` for `s responds to p`", "precedes": "`!p W s` for `s precedes p`",
}  # fmt: skip
_PLURALS = {"respond": "responds", "precede": "precedes"}


def _pattern_meant(words: Words, i: int) -> str | None:
    """What to write where the words of a pattern stand without an operator between number `i` and the one before."""
    tokens = words.tokens
    before, word = tokens[i - 1].text, tokens[i].text
    after = tokens[i + 1].text if i + 1 < len(tokens) else ""
    joined = before == "bounded" and word == "existence"
    if before in SIMPLE or joined:
        if (after if joined else word) == "of":
            return f"a pattern is a whole property; in a formula write {_AS_FORMULA[before]}"
        first = i + 1 if joined else i
        name = f"{before} {word}" if joined else before
        return f"write `{name} of {words.excerpt(first, len(tokens) - 1) if first < len(tokens) else 'p'}`"
    if word == "of" and (near := get_close_matches(before, SIMPLE, 1)):
        return f"did you mean `{near[0]} of`?"
    verb = _PLURALS.get(word, word)
    if verb == "responds" and after != "to":
        return "write `s responds to p`"
    if verb in _AS_FORMULA:
        return f"a pattern is a whole property; in a formula write {_AS_FORMULA[verb]}"
    if word in ("before", "after", "between"):
        return f"a scope belongs to a pattern: `absence of p {word} {'q and r' if word == 'between' else 'q'}`"
    return "only `s responds to p` takes `within`" if word == "within" else None


def _operator_as_name(words: Words, i: int) -> DiagnosticError:
    token = words.tokens[i]
    message = f"`{token.text}` is an operator, and its operands are missing"
    hint = f'write `"{token.text}"` for a variable of that name'
    if i > 0 and (i + 1 == len(words.tokens) or words.tokens[i + 1].type == "RPAR") and token.type in PREFIX:
        hint = f'write a formula after it, or `"{token.text}"` for a variable of that name'
    hint += f", or {bound.removeprefix('write ')}" if (bound := _bound_meant(words, i)) else ""
    return words.error(codes.OPERATOR_AS_NAME, message, i, i, hint)


def _bound_meant(words: Words, i: int) -> str | None:
    """What to write for `F<3s`, where number `i` is the operator."""
    found = _BOUND.match(words.fragment.text, words.tokens[i].end)
    return None if found is None else meant(words.tokens[i].text, "".join(found[0].split()))


def _misplaced(words: Words, i: int) -> DiagnosticError:
    token = words.tokens[i]
    hint = None
    if token.type == "QUESTION":
        hint = 'put a conditional expression into quotes, `"c ? a : b"`, or write `(c -> a) && (!c -> b)`'
    elif token.type == "COLON":
        hint = "a property starts on a line of its own, and the line before it must be complete"
    return words.error(codes.MISPLACED_SIGN, f"`{token.text}` has no meaning in a formula", i, i, hint)


_NAMED = "a line is `NAME: formula`"
_FAMILY = "write a family: `for i in 0..2: NAME: x[i] < 3`"
_LEADS = "for `p leads to s` write `s responds to p`, which is `G (p -> F s)`"
_LINE = r"[^\n:]*?"
_PART = r"((?:[^\n()#;]|\([^\n()#]*\)){1,60}?)"
_IF = rf"\b(?:if|when|whenever)\s+{_PART}\s*(?:,|\bthen)\s+{_PART}\s*"
_VALUE = r"(?<![\w.])(?<![-+*/%])(?<![-+*/%] )([A-Za-z_][\w.\[\]]*)"
_OR = r"\s*(\|\|?|&&?|\bor\b|\band\b)\s*"
_EACH = "ask for each value: `x == 1 || x == 2`"

HABITS = {
    rf"{_LINE}(?:\bleads?[ _]?to\b|~>)": _LEADS,
    r"\b(?:responds?\b(?!\s+to\b)|response\b)[^\n]*": "write `s responds to p`",
    r"\bnever\b\s*\(?": "write `G !(…)`, or `absence of …`",
    r"\bA\s*\[\]": "every property is about all runs: write `G`",
    r"\bA\s*<>": "every property is about all runs: write `F`",
    r"\bE\s*(?:\[\]|<>)": "`llfsm query ARRANGEMENT p` tells whether a run reaches p",
    r"\bP\s*(?:[<>]=?|=\s*\?)[^\n]*": "there are no probabilities: every property is about all runs",
    r"^[ \t]*(?:LTLSPEC|INVARSPEC|PSLSPEC|SPEC|CTLSPEC|PROPERTY|property|ltl|prop|spec|check)\b[^\n]*": _NAMED,
    r"^[ \t]*(?:invariant|INVARIANT|assert|inv)\b[^\n]*": "write `NAME: G (…)`",
    r"^[ \t]*([\w-]+)[ \t]*:?=[ \t]*(?=[GFX]\b|\[\]|<>)": r"write `\1: …`",
    r"\b([A-Za-z_]\w*)\s+(?:is\s+)?(?:at|in)\s+(?:state\s+)?([A-Za-z_]\w*)":
        r"write `\1@\2` for a state of a machine, `\1 == \2` for a value",
    r"(?:\bis\s+)?\bin\s*[\[{(]|\bin\s+\d": f"{_EACH}, or for both ends: `1 <= x && x <= 3`",
    r"\bis\s+not\b|\bnot\s+equals?\b|=?/=|≠|~=": "write `!=`",
    r"\b(?:is(?!\s+(?:always|never|true\s+that))|equals?)\b": "write `==`",
    r"[^\n:]*?\b(\w+)::(\w+)": r"write `\1.\2`",
    r":[ \t]*define\b[^\n]*": "a definition is a line of its own: `define NAME: …`",
    r"\bfor\s*\([^\n]*|\bfor\s+\w+\s*=[^\n]*": "write `for i in 0..3: NAME: …`, or `for m in {ns, ew}: NAME: …`",
    rf"{_LINE}\b(?:forall|foreach|for\s+all)\b[^\n]*": _FAMILY,
    r"\b(?:exists|some)\b\s*\w*": "write the cases out, joined by `||`",
    rf"{_IF}(?:\belse|;)\s+{_PART}[ \t]*(?=[)#]|$)": r"write `((\1) -> (\2)) && (!(\1) -> (\3))`",
    rf"(?:^|:)[ \t]*{_IF}(?=[#]|$)": r"write `G (\1 -> \2)`",
    rf"{_IF}(?=[)#]|$)": r"write `\1 -> \2`",
    r"\b(?:when|whenever)\b[^\n]*|(?:^|:)[ \t]*if\b[^\n]*": "write `G (p -> q)`",
    r"\bif\b[^\n]*": "write `p -> q`",
    r"\band\s+then\b\s*\w*": "write `p && X q` for the next step, `p && F q` for some time later",
    r"\bunless\b": "write `W`",
    rf"{_VALUE}\s*([=!]=)\s*\(\s*(\w+){_OR}(\w+)\s*\)": r"write `(\1 \2 \3 \4 \1 \2 \5)`",
    rf"[=!]=\s*\(\s*\w+{_OR}[^\n()]*\)": _EACH,
    rf"{_VALUE}\s*([=!]=|[<>]=?)\s*\w+(?:{_OR}\w+)*?{_OR}(\d[\w.]*)": r"write `\1 \2 \5`",
    r"(?<=\w)'(?!\w)": "write `X (…)` for the next step; `changed(x)` compares with the step before",
    r"--(?!\d)|^[ \t]*(?://|%|;|\(\*)[^\n]*|//|/\*": "a comment begins with `#`",
    r"(?:\b([GF])\s*)\(\s*([<>]=\s*\d\w*)\s*\)": r"write `\1[\2]`",
    r"[^\n]*?\bwithin\s+(\d[\d.]*)\s*(ms|s|min)(?:ec|ond|ute|s)*\b":
        r"write `F[<=\1\2] …`; only `s responds to p` takes `within \1\2`",
    r"[^\n]*?\bwithin\s+(\d+)(?:\s+steps?)?(?=\s*(?:\)|$))":
        r"write `F[0:\1] …` for steps; only `s responds to p` takes `within`, and a time",
    r"↑|\b(?:posedge|rising)\b\s*\w*": "write `rose(…)`",
    r"↓|\b(?:negedge|falling)\b\s*\w*": "write `fell(…)`",
    r"\b(\w+)\.(entered|sampled|read)\s+(\w+)": r"write `\1.\2(\3)`",
    r"\b(rose|fell|changed|sampled|is_running|is_suspended|done|abs|floor|ceil|round)\s+(\w+)": r"write `\1(\2)`",
    r"\b([A-Za-z_]\w*)\.(\d+)": r"write `\1[\2]`",
    r"\b\w+@\s*\(|\b\w+@\{[^}\n]*\}?|\b\w+@(?=\s|\Z)|\b\w+@\w+\s*,\s*\w+": "write `m@STATE`, or `m@{A, B}` for several",
    r"\bX\s*\{\s*(\d+)\s*\}": r"write `X[\1]`",
    r"\b([GF])\s*\{\s*(\d+)\s*\}": r"write `\1[0:\2]`",
    r"\b[GFX]\s*\{": "write `(…)`",
    r"(?<!\d),(?!\d)": "write `&&`, or a line for each property",
}  # fmt: skip
IN_EXPRESSIONS = {
    r"\[\s*(?:\*|->|=|\+)[^\]\n]*\]|\^\s*\d+": "write `a{3}`, `a{2,5}`, `a*` or `a+` for a letter `a`",
    r"\{\s*(\d+)\s*[;:-]\s*(\d+)\s*\}": r"write `{\1,\2}`",
    r";(?![^{\n]*\})|\bthen\b": "write letters next to each other: `a b`",
}
_OF_WORDS = frozenset(
    {
        codes.CHARACTER, codes.BAD_NAME, codes.OPERAND_MISSING, codes.OPERATOR_MISSING, codes.JOINED_OPERATORS,
        codes.OPERATOR_AS_NAME, codes.FORMULA_AS_VALUE, codes.MISPLACED_SIGN, codes.UNFINISHED, codes.ASSIGNMENT,
        codes.REGULAR_LETTER, codes.NUMBER_AS_FORMULA,
    }
)  # fmt: skip


def with_habit(mistake: Diagnostic, regular: bool) -> Diagnostic:
    """The mistake with a better hint where it comes from another tool's habit. `regular`: in an expression."""
    if mistake.code not in _OF_WORDS or mistake.span is None:
        return mistake
    found = meant_at(IN_EXPRESSIONS if regular else HABITS, mistake.span.source.text, mistake.span.start)
    return replace(mistake, hint=found) if found else mistake
