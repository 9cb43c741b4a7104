"""The untyped syntax tree of guards and actions, as the grammar gives it: one tree for all instances of a machine.

`start` and `end` count characters of the fragment the tree was parsed from; `depth` is the height of the tree below a
node, which the parser keeps within `limits.MAX_NESTING` so that recursion over a tree is always safe.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal as OneOf

from llfsm_verify.diagnostics import Fragment, Span


@dataclass(frozen=True, slots=True)
class Node:
    """A piece of source: the characters `start` to `end`, and how deep the tree below it is."""

    start: int
    end: int
    depth: int


@dataclass(frozen=True, slots=True)
class Name(Node):
    """An identifier; `quoted` when it stood in double quotes (properties only)."""

    text: str
    quoted: bool


@dataclass(frozen=True, slots=True)
class Integer(Node):
    """An integer as written: decimal, ``0x…`` or ``0b…``."""

    text: str


@dataclass(frozen=True, slots=True)
class Decimal(Node):
    """A number with a decimal point, as written."""

    text: str


@dataclass(frozen=True, slots=True)
class Truth(Node):
    """``true`` or ``false``."""

    value: bool


@dataclass(frozen=True, slots=True)
class Member(Node):
    """One step of a path: ``.name``."""

    name: Name


@dataclass(frozen=True, slots=True)
class Subscript(Node):
    """One step of a path: ``[index]``."""

    index: Expression


@dataclass(frozen=True, slots=True)
class Path(Node):
    """A name and the steps from there: ``a.b[i]``."""

    name: Name
    steps: tuple[Member | Subscript, ...]


@dataclass(frozen=True, slots=True)
class Interval(Node):
    """``low..high``, only an argument of a call."""

    low: Expression
    high: Expression


@dataclass(frozen=True, slots=True)
class Call(Node):
    """``function(argument, …)``."""

    function: Path
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class StateTest(Node):
    """``machine@state`` or ``machine@{state, state}``: in one of them."""

    machine: Name
    states: tuple[Name, ...]


@dataclass(frozen=True, slots=True)
class Prefix(Node):
    """An operator before its operand; ``not`` is written `!`."""

    operator: OneOf["!", "-", "+", "~"]
    operand: Expression


@dataclass(frozen=True, slots=True)
class Chain(Node):
    """Operands of one precedence level, left to right, with the operators between them (one fewer)."""

    operators: tuple[str, ...]
    operands: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Ternary(Node):
    """``condition ? then : otherwise``."""

    condition: Expression
    then: Expression
    otherwise: Expression


Expression = Integer | Decimal | Truth | Path | Call | Interval | StateTest | Prefix | Chain | Ternary


@dataclass(frozen=True, slots=True)
class TypeName(Node):
    """The type of a local variable: a name, or a range with its bounds as written."""

    name: str
    bounds: tuple[int, int] | None


@dataclass(frozen=True, slots=True)
class Declaration(Node):
    """``type name = value``; `value` is None where it is missing, which is a mistake."""

    type: TypeName
    name: Name
    value: Expression | None


@dataclass(frozen=True, slots=True)
class Store(Node):
    """``target = value`` (`operator` "") or ``target += value``; ``++`` and ``--`` come as ``+= 1`` and ``-= 1``."""

    target: Path
    operator: OneOf["", "+", "-", "*", "/", "%", "&", "|", "^", "<<", ">>"]
    value: Expression


@dataclass(frozen=True, slots=True)
class Choice(Node):
    """``if (condition) then else otherwise``."""

    condition: Expression
    then: Statement
    otherwise: Statement | None


@dataclass(frozen=True, slots=True)
class RangeLoop(Node):
    """``for (name in first..last) body``."""

    name: Name
    first: Expression
    last: Expression
    body: Statement


@dataclass(frozen=True, slots=True)
class CountingLoop(Node):
    """C's ``for (begin; condition; step) body``."""

    begin: Simple
    condition: Expression
    step: Simple
    body: Statement


@dataclass(frozen=True, slots=True)
class Block(Node):
    """``{ … }``."""

    statements: tuple[Statement, ...]


Simple = Declaration | Store | Call
Statement = Simple | Choice | RangeLoop | CountingLoop | Block


@dataclass(frozen=True, slots=True)
class ParsedExpression:
    """The tree of an expression, and the text that it counts in."""

    root: Expression
    fragment: Fragment

    def span(self) -> Span:
        return self.fragment.span(self.root.start, self.root.end)


@dataclass(frozen=True, slots=True)
class ParsedActions:
    """The trees of statements, and the text that they count in."""

    statements: tuple[Statement, ...]
    fragment: Fragment
