"""From the parser's reductions to syntax trees, bottom up: each method gets the children of one grammar rule."""

from __future__ import annotations

from typing import cast

from llfsm_verify.grammars import Token
from llfsm_verify.language import syntax
from llfsm_verify.language.limits import MAX_NESTING
from llfsm_verify.language.syntax import Expression, Node, Path, Simple, Statement

Child = Token | Node


class TooDeep(Exception):
    """The tree below `offset` is higher than the limit."""

    def __init__(self, offset: int) -> None:
        super().__init__(offset)
        self.offset = offset


def _place(children: list[Child], extra: int = 1) -> tuple[int, int, int]:
    """Start, end and depth of a node made of `children`."""
    depth = extra
    for child in children:
        if child.depth + extra > depth:  # noqa: PLR1730 - `max` takes longer
            depth = child.depth + extra
    if depth > MAX_NESTING:
        raise TooDeep(children[0].start)
    return children[0].start, children[-1].end, depth


def _nodes(children: list[Child]) -> list[Node]:
    return [c for c in children if not isinstance(c, Token)]


_SIGNS = {"or": "||", "and": "&&"}
"""What stands for operators that are words."""


def _text(child: Child) -> str:
    return cast(Token, child).text


def _height(count: int) -> int:
    """Levels that a chain of `count` operands adds: it becomes a balanced tree."""
    return max(1, (count - 1).bit_length())


class Builder:
    """Callbacks named after the rules of ``grammar.lark``; brackets and separators are among the children."""

    # expressions

    def name(self, children: list[Child]) -> Node:
        token = cast(Token, children[0])
        quoted = token.type == "QUOTED"
        return syntax.Name(token.start, token.end, 1, text=token.text[1:-1] if quoted else token.text, quoted=quoted)

    def integer(self, children: list[Child]) -> Node:
        return syntax.Integer(*_place(children), text=_text(children[0]))

    def decimal(self, children: list[Child]) -> Node:
        return syntax.Decimal(*_place(children), text=_text(children[0]))

    def true(self, children: list[Child]) -> Node:
        return syntax.Truth(*_place(children), value=True)

    def false(self, children: list[Child]) -> Node:
        return syntax.Truth(*_place(children), value=False)

    def member(self, children: list[Child]) -> Node:
        return syntax.Member(*_place(children, 0), name=cast(syntax.Name, children[1]))

    def subscript(self, children: list[Child]) -> Node:
        return syntax.Subscript(*_place(children), index=cast(Expression, children[1]))

    def path(self, children: list[Child]) -> Node:
        steps = cast("list[syntax.Member | syntax.Subscript]", children[1:])
        return syntax.Path(*_place(children, 0), name=cast(syntax.Name, children[0]), steps=tuple(steps))

    def call(self, children: list[Child]) -> Node:
        function, *arguments = _nodes(children)
        return syntax.Call(
            *_place(children), function=cast(Path, function), arguments=tuple(cast("list[Expression]", arguments))
        )

    def interval(self, children: list[Child]) -> Node:
        low, high = cast("list[Expression]", _nodes(children))
        return syntax.Interval(*_place(children), low=low, high=high)

    def at_state(self, children: list[Child]) -> Node:
        machine, *states = cast("list[syntax.Name]", _nodes(children))
        return syntax.StateTest(*_place(children), machine=machine, states=tuple(states))

    def prefix(self, children: list[Child]) -> Node:
        operator = "!" if _text(children[0]) == "not" else _text(children[0])
        operand = cast(Expression, children[1])
        return syntax.Prefix(*_place(children), operator=operator, operand=operand)  # type: ignore[arg-type]

    def chain(self, children: list[Child]) -> Node:
        operands = cast("list[Expression]", children[::2])
        operators = tuple(_SIGNS.get(_text(c), _text(c)) for c in children[1::2])
        return syntax.Chain(*_place(children, _height(len(operands))), operators=operators, operands=tuple(operands))

    def conditional(self, children: list[Child]) -> Node:
        condition, then, otherwise = cast("list[Expression]", _nodes(children))
        return syntax.Ternary(*_place(children), condition=condition, then=then, otherwise=otherwise)

    def parenthesised(self, children: list[Child]) -> Node:
        from dataclasses import replace

        return replace(cast(Node, children[1]), start=children[0].start, end=children[2].end)

    # statements

    def bound_plain(self, children: list[Child]) -> Node:
        return syntax.Integer(*_place(children), text=_text(children[0]))

    def bound_negative(self, children: list[Child]) -> Node:
        return syntax.Integer(*_place(children), text=f"-{_text(children[1])}")

    def declare_named(self, children: list[Child]) -> Node:
        kind = syntax.TypeName(*_place(children[:1]), name=_text(children[0]), bounds=None)
        name, value = cast(syntax.Name, children[1]), cast(Expression, children[3])
        return syntax.Declaration(*_place(children), type=kind, name=name, value=value)

    def declare_without_value(self, children: list[Child]) -> Node:
        kind = syntax.TypeName(*_place(children[:1]), name=_text(children[0]), bounds=None)
        return syntax.Declaration(*_place(children), type=kind, name=cast(syntax.Name, children[1]), value=None)

    def declare_range(self, children: list[Child]) -> Node:
        low, high = cast(syntax.Integer, children[0]), cast(syntax.Integer, children[2])
        kind = syntax.TypeName(
            *_place(children[:3]), name=f"{low.text}..{high.text}", bounds=(int(low.text, 0), int(high.text, 0))
        )
        name, value = cast(syntax.Name, children[3]), cast(Expression, children[5]) if children[4:] else None
        return syntax.Declaration(*_place(children), type=kind, name=name, value=value)

    def store(self, children: list[Child]) -> Node:
        target, value = cast(Path, children[0]), cast(Expression, children[2])
        operator = _text(children[1])[:-1]
        return syntax.Store(*_place(children), target=target, operator=operator, value=value)  # type: ignore[arg-type]

    def assign(self, children: list[Child]) -> Node:
        target, value = cast(Path, children[0]), cast(Expression, children[2])
        return syntax.Store(*_place(children), target=target, operator="", value=value)

    def step_after(self, children: list[Child]) -> Node:
        return self._step(children, cast(Token, children[1]), cast(Path, children[0]))

    def step_before(self, children: list[Child]) -> Node:
        return self._step(children, cast(Token, children[0]), cast(Path, children[1]))

    def _step(self, children: list[Child], token: Token, target: Path) -> Node:
        one = syntax.Integer(token.start, token.end, 1, text="1")
        operator = "+" if token.text == "++" else "-"
        return syntax.Store(*_place(children), target=target, operator=operator, value=one)  # type: ignore[arg-type]

    def terminated(self, children: list[Child]) -> Node:
        return cast(Node, children[0])

    def empty(self, children: list[Child]) -> Node:
        return syntax.Block(*_place(children), statements=())

    def block(self, children: list[Child]) -> Node:
        return syntax.Block(*_place(children), statements=tuple(cast("list[Statement]", _nodes(children))))

    def if_only(self, children: list[Child]) -> Node:
        condition, then = _nodes(children)
        return syntax.Choice(
            *_place(children), condition=cast(Expression, condition), then=cast(Statement, then), otherwise=None
        )

    def if_else(self, children: list[Child]) -> Node:
        condition, then, otherwise = _nodes(children)
        return syntax.Choice(
            *_place(children),
            condition=cast(Expression, condition),
            then=cast(Statement, then),
            otherwise=cast(Statement, otherwise),
        )

    def for_range(self, children: list[Child]) -> Node:
        token = cast(Token, children[2])
        name = syntax.Name(*_place([token]), text=token.text, quoted=False)
        first, last, body = _nodes(children)
        return syntax.RangeLoop(
            *_place(children),
            name=name,
            first=cast(Expression, first),
            last=cast(Expression, last),
            body=cast(Statement, body),
        )

    def for_counting(self, children: list[Child]) -> Node:
        begin, condition, step, body = _nodes(children)
        return syntax.CountingLoop(
            *_place(children),
            begin=cast(Simple, begin),
            condition=cast(Expression, condition),
            step=cast(Simple, step),
            body=cast(Statement, body),
        )
