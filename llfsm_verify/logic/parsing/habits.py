"""What people write in property files who know other tools, and what to write here."""

from __future__ import annotations

from dataclasses import replace

from llfsm_verify.diagnostics import Diagnostic, meant_at
from llfsm_verify.logic import codes

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
