"""How the syntaxes of other tools write formulas."""

from __future__ import annotations

import re
from typing import Final

from llfsm_verify.extensions.syntaxes.nusmv import NUSMV
from llfsm_verify.extensions.syntaxes.spin import SPIN
from llfsm_verify.extensions.syntaxes.spot import NAME, RESERVED
from llfsm_verify.plug import Formula, Spelling, apply, conjunction, disjunction, negation, step_bound
from llfsm_verify.plug import FormulaOp as Op


def _strong_release(a: Formula, b: Formula) -> Formula:
    return apply("U", b, conjunction((a, b)))


def _weak_until(a: Formula, b: Formula) -> Formula:
    return apply("R", b, disjunction((a, b)))


def _different(a: Formula, b: Formula) -> Formula:
    return negation(apply("iff", a, b))


def _spot_atom(key: str) -> str:
    plain = NAME.match(key) and key not in RESERVED and key.lower() not in ("true", "false", "first_match")
    return key if plain else f'"{key}"'


_SPIN_WORDS: Final = frozenset({*SPIN.prefix, *SPIN.infix, *SPIN.true, *SPIN.false, "ltl"})


def _spin_atom(key: str) -> str:
    plain = re.match(r"[a-z_][A-Za-z0-9_]*\Z", key) and key not in _SPIN_WORDS
    return key if plain else f"{{{key}}}" if not re.search(r"[{}\n]", key) else f'"{key}"'


_NUSMV_WORDS: Final = frozenset({*NUSMV.prefix, *NUSMV.infix, *NUSMV.true, *NUSMV.false, "LTLSPEC", "NAME"})


def _nusmv_atom(key: str) -> str:
    plain = re.match(r"[A-Za-z_][A-Za-z0-9_]*\Z", key) and key not in _NUSMV_WORDS
    return key if plain else f'"{key}"'


def _spot_steps(f: Formula) -> str:
    return f"{f.op[0]}[{f.key}]"


def _nusmv_steps(f: Formula) -> str:
    first, last = step_bound(f)
    return "X " * first if f.op == "X[]" else f"{f.op[0]} [{first},{last}] "


_PREFIX: Final[dict[Op, str]] = {"not": "!", "X": "X ", "F": "F ", "G": "G "}
_PAST: Final[dict[Op, str]] = {"Y": "Y ", "Z": "Z ", "O": "O ", "H": "H "}
_INFIX: Final[dict[Op, str]] = {"implies": "->", "iff": "<->", "U": "U"}


SPELLINGS: Final = {
    "spot": Spelling(
        "Spot",
        _PREFIX,
        {**_INFIX, "and": "&", "or": "|", "xor": "xor", "W": "W", "R": "R", "M": "M"},
        "1", "0", _spot_atom, {}, _spot_steps, expressions=True,
    ),
    "spin": Spelling(
        "SPIN",
        {"not": "!", "X": "X ", "F": "<> ", "G": "[] "},
        {**_INFIX, "and": "&&", "or": "||", "R": "V"},
        "true", "false", _spin_atom, {"W": _weak_until, "M": _strong_release, "xor": _different},
    ),
    "nusmv": Spelling(
        "NuSMV",
        {**_PREFIX, **_PAST},
        {**_INFIX, "and": "&", "or": "|", "xor": "xor", "R": "V", "S": "S", "T": "T"},
        "TRUE", "FALSE", _nusmv_atom, {"W": _weak_until, "M": _strong_release}, _nusmv_steps,
    ),
}  # fmt: skip
