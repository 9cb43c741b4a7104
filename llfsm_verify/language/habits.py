"""What people write who know other languages, and what guards, actions and properties have for it."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable

_LOCAL = "a local variable is declared with its type: `int x = 3;`"
_MOVE = "only a transition changes the state: `{when: …, to: STATE}`; `self@STATE` asks for it"
_WAIT = "an action takes no time; a transition waits: `{when: after(3), to: STATE}`"
_CASES = "write `if (x == A) … else if (x == B) …`, or a transition for each case"
_LOOP = "write `for (i in 0..3) …`; a state whose transition leads back to it repeats its actions"
_EARLY = "an action always runs to its end: write `if (…) { … }` around the rest"
_EMPTY = "leave it out: an action may be empty"
_SHOWN = "an action only calculates; traces and recordings show every variable"
_EDGE = "a guard sees the present only: keep the last value in a variable, and compare the two"
_CHANCE = "read an input, which may have any value, or let the `environment` choose: `x = choose(0..3);`"
_SIZE = "the size never changes: write the number"
_CLOCK = "`after(3)` asks whether the state has been active for more than 3 seconds"
_OWN = "there are no functions of your own: write the statements out"
_THROWN = "nothing is thrown or caught: ask before what may fail, as in `if (y != 0) x = 6 / y;`"
_TEXT = "there are no texts: declare an enumeration under `types`"

WORDS = {
    word: hint
    for words, hint in {
        "let var auto const static unsigned signed long short": _LOCAL,
        "goto jump transition next_state change_state state": _MOVE,
        "wait sleep delay timeout every timer": _WAIT,
        "switch match case select": _CASES,
        "while do loop repeat foreach until": _LOOP,
        "return break continue exit": _EARLY,
        "pass skip nop noop": _EMPTY,
        "print printf println log echo": _SHOWN,
        "rose fell changed rising falling prev previous old last": _EDGE,
        "random rand randint": _CHANCE,
        "len size length": _SIZE,
        "time now elapsed clock after after_ms": _CLOCK,
        "import include def function func fn class": _OWN,
        "try catch except finally throw raise": _THROWN,
        "string str char text": _TEXT,
        "sum count any all": "go through the elements in an action: `for (i in 0..3) …`",
        "then": "leave out `then`: `if (…) x = 1;`",
        "set": "write `x = …;`",
        "unless": "write `if (!(…)) …`",
        "toggle": "write `x = !x;`",
        "stop pause disable": "write `suspend(m);`",
        "start run enable": "write `resume(m);` or `restart(m);`",
        "TRUE True": "write `true`",
        "FALSE False": "write `false`",
        "otherwise always default": "write `true`: transitions are tried in their order",
        "null NULL None nil": "every variable has a value: write one of its type",
        "self this": "write the name of the variable alone",
        "int": "write `floor(…)`, `ceil(…)` or `round(…)`",
        "bool": "write `… != 0`",
        "assert": "write it as a property: `NAME: G (…)`",
        "IF If": "write `if`",
        "ELSE Else": "write `else`",
        "FOR For": "write `for`",
    }.items()
    for word in words.split()
}
"""Names that stand for nothing here."""
WAITING = dict.fromkeys(("after", "after_ms"), _WAIT)
"""Functions that begin no statement."""

PROPERTY_WORDS = {
    word: hint
    for words, hint in {
        "prev previous old last": "write `Y (x == 3)` for the step before, or `changed(x)`",
        "rising posedge": "write `rose(p)`",
        "falling negedge": "write `fell(p)`",
        "len size length": _SIZE,
        "sum count any all": "write the elements out: `x[0] + x[1]`, or count in a variable",
        "random rand": "every property is about all runs, and about all values of inputs",
        "deadlock": "a machine without a next state is `m.finished`",
        "time now elapsed clock": "a bound in time follows an operator: `F[<=3s] p`",
        "TRUE True": "write `true`",
        "FALSE False": "write `false`",
        "state": "write `m@STATE`",
        "initially init initial": "write `initially p` where `p` is to be true in the beginning",
        "then next followed by": "in a rule write letters next to each other: `a b`",
    }.items()
    for word in words.split()
}
"""The same in properties."""


def word_meant(name: str, known: Iterable[str], words: dict[str, str] = WORDS) -> str | None:
    """What to write for a name that stands for nothing, unless it is nearly one of those `known`."""
    return None if difflib.get_close_matches(name, list(known)[:2000], 1, 0.75) else words.get(name)


def member_meant(machine: str, member: str, states: tuple[str, ...], functions: Iterable[str]) -> str | None:
    """What to write for `machine.member`."""
    if member in states:
        return f"write `{machine}@{member}`"
    called = next((f for f in functions if f in (member, f"is_{member}")), None)
    return None if called is None else f"write `{called}({machine})`"


_TIME = r"(\d[\d.]*)\s*(?:ms|msecs?|milliseconds?|s|secs?|seconds?|min|minutes?|h|hours?)\b"
_NO_UNIT = {rf"[=<>+*/%?:-]\s*{_TIME}": r"a number has no unit: write `\1`; `after(3)` counts seconds"}
_BEHIND = r"(?<=[\w)\]])(?<!\band)(?<!\bor)(?<!\bnot)"
_LASTING = r"\b(?:for|since|during|within|until|every)\s+"
_UNITS = {
    r"(\d[\d.]*)\s*(?:ms|msecs?|milliseconds?)\b": r"`after_ms` counts milliseconds: `after_ms(\1)`",
    r"(\d[\d.]*)\s*(?:s|secs?|seconds?)\b": r"`after` counts seconds: `after(\1)`",
    r"\d[\d.]*\s*(?:min|minutes?|h|hours?)\b": "`after` counts seconds: `after(60)`",
}
_CALLS = {
    r"\b(after|after_ms|abs|floor|ceil|round|is_running|is_suspended|suspend|resume|restart|load|unload)"
    r"\s+(\w[\w.]*)": r"write `\1(\2)`",
}
_INFIX = {
    r"\bis\s+not\b": "write `!=`",
    r"\b(?:is|equals?|eq)\b": "write `==`",
    r"\bmod\b": "write `%`",
    r"\bdiv\b": "write `/`",
    r"\bxor\b": "write `!=`",
    r"\bimplies\b|->": "write `!a || b` for `a -> b`",
    r"\band\s+then\b\s*\w*": "write `&&`: a guard sees one moment",
}
_STATE = {r"@\s*\Z|(?<!\w)@\w*": "write `m@STATE`"}

IN_GUARDS = {
    r"\A\s*if\b": "a guard is the condition alone: leave out `if`",
    r"\A\s*else\b": "write `true`: transitions are tried in their order",
    r"\A\s*[\[{]": "a guard is the condition alone: leave out the brackets",
    r";\s*\Z": "a guard is one condition: leave out `;`",
    rf"{_LASTING}\d[\w.]*|\bin\s+{_TIME}":
        "a state measures time: enter one when it begins, and leave it by `{when: after(3), to: STATE}`",
    rf"{_BEHIND}\s+after\s*\(?\s*(\d[\d.]*)\s*m(?:s|illi)\w*": r"write `&& after_ms(\1)`",
    rf"{_BEHIND}\s+(after(?:_ms)?)\s*\(?\s*(\d[\d.]*)(?![\d.]|\s*[mh])(?:\s*s\w*)?": r"write `&& \1(\2)`",
    r"\bin\s*[\[{(]|\bin\s+\d": "ask for each value: `x == A || x == B`",
    **_NO_UNIT, **_UNITS, **_CALLS, **_INFIX, **_STATE,
    r"\A[^()]*,": "write `&&` or `||`",
}  # fmt: skip
IN_ACTIONS = {
    r"=[ \t]*(?:[\w.]+[ \t]+)?if\b[^;{}\n]*\belse\b[^;{}\n]*": "write `c ? a : b`",
    r"\b(?:elif|elsif|elseif)\b[^;{}]*[;{]?": "write `else if (…)`",
    r"\bif\s+(?!\()([\w@.!=<>&|+ -]{1,40}?)\s*(?:[:{)]|\bthen\b)": r"conditions stand in brackets: `if (\1) …`",
    r"\bif\s+(?!\()\w*": "conditions stand in brackets: `if (…) …`",
    r"\bif\s*\([^;{}]*\)\s*(?:&&|\|\||and\b|or\b)": "put the whole condition into brackets: `if ((…) && (…)) …`",
    r"\bif\s*\((?:[^;{}():]|\([^;{}()]*\))*?[^=!<>]=(?!=)": "write `==` to compare",
    r"\)\s*then\b\s*\{?": "leave out `then`",
    rf"{_LASTING}{_TIME}|(?:\A|[;{{}}]|{_BEHIND})\s*\bafter(?:_ms)?\s+\d[\w.]*": _WAIT,
    r"\bfor\s+(\w+)\s+in\s+(\w+\s*\.\.\s*\w+)": r"write `for (\1 in \2) …`",
    r"\bfor\s+(?!\()\w*|\bfor\s*\(\s*\w+\s+(?:in\b(?!\s*[\w.+-]+?\s*\.\.)|\w+\s*:)[^;{}]*": "write `for (i in 0..3) …`",
    r"\bafter(?:_ms)?\s*\([^;{}()]*\)\s*\w*": "write `if (after(3)) …`",
    r"(?:\belse|\))\s*:": "leave out `:`; several statements stand in `{ … }`",
    r"\bthis\s*->": "write the name of the variable alone",
    r"=\s*[\[{]": "write the elements one by one: `x[0] = 1;`",
    r"(?<![=!<>])=(?!=)[^=;{}]*(?:&&|\band\b|,)\s*[\w.\[\]]+\s*=": "write `;` between two assignments",
    **_NO_UNIT, **_UNITS, **_CALLS, **_INFIX,
    r"\bfor\s*\([^{}()]*\)?": "write `for (i in 0..3) …` or `for (int i = 0; i < 4; i++) …`",
}  # fmt: skip


def statement_word(text: str, at: int) -> str | None:
    """What to say of the first word of the statement in which the character `at` is."""
    start = max(text.rfind(sign, 0, at) for sign in ";{}") + 1
    first = re.match(r"\s*(\w+)", text[start : at + 60])
    return None if first is None else WAITING.get(first[1], WORDS.get(first[1]))
