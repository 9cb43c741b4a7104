"""Values of C expressions: in which type a number is held, how it is written, and its conversions.

Where both operands and the result of an operation fit in one of `KINDS`, it is computed in that type, and every
conversion is a cast. Compilers promote to `int`, of 16 bits or more, only what already fits there.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from llfsm_verify.plug import INT64_MAX, INT64_MIN, Const, Expr, Int, Type

WIDE: Final = "wide"
RAW: Final = "raw"
"""The type of a sum before its cast: what the compiler makes of it."""
KINDS: Final = ("int16_t", "int32_t", "int64_t", WIDE)
BITS: Final = {"int16_t": 16, "int32_t": 32, "int64_t": 64}
PROMOTED: Final = ("uint8_t", "int8_t", "int16_t", RAW)
"""What is an `int` of the same value beside an operator, also where an `int` has 16 bits."""
_ARITHMETIC, _COMPARISONS = "+ - * / %", "== != < <= > >="
FIRST: Final = {
    "+": "* / %", "-": "* / %", "&&": f"{_ARITHMETIC} {_COMPARISONS} &&", "||": f"{_ARITHMETIC} {_COMPARISONS} ||",
    **dict.fromkeys(_COMPARISONS.split(), _ARITHMETIC),
}  # fmt: skip
"""By operator: those that bind closer on both sides, or are the same and one chain."""
LEFT: Final = {"+": ("+", "-"), "-": ("+", "-"), "*": ("*",)}
"""Those that come first on the left side."""


@dataclass(frozen=True, slots=True)
class Number:
    """An expression of C with its type, and the interval of its values. `value`: that of a literal, which has none."""

    text: str
    type: str
    low: int
    high: int
    simple: bool = True
    """It can be an operand as it stands."""
    value: int | None = None
    depth: int = 0
    sign: str = ""
    """The operator that was written last, where it is not simple."""

    def beside(self, sign: str, *, left: bool) -> str:
        """The text as a side of an operator: in parentheses, but where everybody knows which operator is first."""
        plain = self.simple or (self.sign in FIRST.get(sign, "").split()) or (left and self.sign in LEFT.get(sign, ()))
        return self.text if plain else f"({self.text})"

    @property
    def operand(self) -> str:
        """The text as an operand."""
        return self.text if self.simple else f"({self.text})"

    @property
    def signed(self) -> str:
        """Whether 128 bits of it have a sign, in C."""
        return "false" if self.high >= 1 << 127 else "true"


def holds(kind: str, low: int, high: int) -> bool:
    """Whether a type of `KINDS` has all values of an interval."""
    bits = BITS.get(kind)
    return bits is None or (-(1 << bits - 1) <= low and high < 1 << bits - 1)


def kind_of(low: int, high: int) -> str:
    """The narrowest type for computing."""
    return next(kind for kind in KINDS if holds(kind, low, high))


def stored_as(kind: Type) -> str:
    """The narrowest type for storing."""
    if not isinstance(kind, Int):
        return "int64_t"
    if kind.boolean:
        return "bool"
    if kind.low >= 0:
        return next(f"uint{bits}_t" for bits in (8, 16, 32, 64) if kind.high < 1 << bits)
    return next(f"int{b}_t" for b in (8, 16, 32, 64) if -(1 << b - 1) <= kind.low and kind.high < 1 << b - 1)


def bits_of(stored: str) -> int:
    """The bits of a type of `stored_as` that is not `bool`."""
    return int(stored.strip("uint_"))


def bounds(expression: Expr) -> tuple[int, int]:
    """The interval of an expression's values."""
    kind = expression.type
    if isinstance(expression, Const):
        return expression.value, expression.value
    return (kind.low, kind.high) if isinstance(kind, Int) else (INT64_MIN, INT64_MAX)


def literal(value: int) -> Number:
    return Number(str(value), "literal", value, value, value=value)


def written(value: int, kind: str) -> str:
    """A number in a type."""
    if kind == WIDE:
        return f"wide_of({unsigned64(value >> 64)}, {unsigned64(value)})"
    if kind == "bool":
        return "true" if value else "false"
    if kind == "uint64_t":
        return unsigned64(value)
    if kind == "int64_t":
        least = "(-INT64_C(9223372036854775807) - 1)"
        text = f"INT64_C({abs(value)})"
        return least if value == INT64_MIN else f"(-{text})" if value < 0 else text
    if kind in ("int32_t", "uint32_t"):
        text = f"{'U' * (kind == 'uint32_t')}INT32_C({abs(value)})"
        least = "(-INT32_C(2147483647) - 1)"
        return least if value == -(1 << 31) else f"(-{text})" if value < 0 else text
    if value == -(1 << 15):
        return "(-32767 - 1)"
    if value > 32767:
        return f"{value}U"
    return f"({value})" if value < 0 else str(value)


def unsigned64(value: int) -> str:
    """The lowest 64 bits of a number."""
    return f"UINT64_C({value & (1 << 64) - 1})"
