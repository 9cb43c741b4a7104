"""Mutants of a source text: one small change each, as a replacement of some of its bytes, so that line numbers stay."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

COMPARISONS = {
    ast.Lt: ("<=", ">="), ast.LtE: ("<", ">"), ast.Gt: (">=", "<="), ast.GtE: (">", "<"),
    ast.Eq: ("!=",), ast.NotEq: ("==",), ast.Is: ("is not",), ast.IsNot: ("is",),
    ast.In: ("not in",), ast.NotIn: ("in",),
}  # fmt: skip
ARITHMETIC = {
    ast.Add: "-", ast.Sub: "+", ast.Mult: "//", ast.FloorDiv: "*", ast.Div: "*", ast.Mod: "*", ast.Pow: "*",
    ast.LShift: ">>", ast.RShift: "<<", ast.BitAnd: "|", ast.BitOr: "&", ast.BitXor: "&",
}  # fmt: skip
SYMBOL = {
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=", ast.Is: "is",
    ast.IsNot: r"is\s+not", ast.In: "in", ast.NotIn: r"not\s+in", ast.Add: r"\+", ast.Sub: "-", ast.Mult: r"\*",
    ast.FloorDiv: "//", ast.Div: "/", ast.Mod: "%", ast.Pow: r"\*\*", ast.LShift: "<<", ast.RShift: ">>",
    ast.BitAnd: "&", ast.BitOr: r"\|", ast.BitXor: r"\^",
}  # fmt: skip
EXCHANGED = {"sorted": "list", "min": "max", "max": "min", "any": "all", "all": "any"}
DELETED = (ast.Expr, ast.AugAssign, ast.Raise, ast.Break, ast.Continue, ast.Delete)
SKIPPED_CALLS = {"TypeVar", "cast", "ParamSpec", "NewType"}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file."""

    file: str
    """Relative to the project's folder."""
    function: str
    """The qualified name of the function or class that it is in; empty at the top of the module."""
    operator: str
    start: int
    end: int
    """The bytes that are replaced."""
    new: str
    line: int
    lines: tuple[int, int]
    """First and last line of the statement, or of the head of the compound statement: what coverage is asked for."""
    imported: bool
    """Whether the statement runs when the module is imported, and not later."""
    before: str
    """The changed lines, without their indentation; with `after`, `file` and `function` the mutant's lasting name."""
    after: str

    @property
    def key(self) -> tuple[str, str, str, str]:
        """Names the mutant as long as its lines stay what they are, wherever they move."""
        return (self.file, self.function, self.before, self.after)

    def apply(self, source: bytes) -> bytes:
        """The mutated source."""
        return source[: self.start] + self.new.encode() + source[self.end :]


def mutants(file: str, source: bytes) -> list[Mutant]:
    """All mutants of a file, each text once; some are not Python (`compiles` tells, which takes time)."""
    return list({(m.start, m.end, m.new): m for m in _Search(file, source).search()}.values())


def compiles(source: bytes) -> bool:
    """Whether Python takes the text."""
    try:
        compile(source, "mutant", "exec", dont_inherit=True)
    except (SyntaxError, ValueError):
        return False
    return True


class _Search:
    def __init__(self, file: str, source: bytes) -> None:
        self.file, self.source = file, source
        self.starts = [0]
        for line in source.splitlines(keepends=True):
            self.starts.append(self.starts[-1] + len(line))

    def search(self) -> Iterator[Mutant]:
        yield from self._body(ast.parse(self.source).body, "", imported=True)

    def _body(self, body: list[ast.stmt], function: str, *, imported: bool) -> Iterator[Mutant]:
        for i, statement in enumerate(body):
            if i == 0 and isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
                continue  # a docstring
            yield from self._statement(statement, function, imported=imported)

    def _statement(self, node: ast.stmt, function: str, *, imported: bool) -> Iterator[Mutant]:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from self._body(node.body, f"{function}.{node.name}".lstrip("."), imported=False)
            return
        if isinstance(node, ast.ClassDef):
            yield from self._body(node.body, f"{function}.{node.name}".lstrip("."), imported=imported)
            return
        if isinstance(node, ast.Import | ast.ImportFrom | ast.Assert | ast.Global | ast.Nonlocal | ast.Pass):
            return  # an assertion names what cannot be otherwise
        if isinstance(node, ast.If) and re.search(r"TYPE_CHECKING|__name__", ast.unparse(node.test)):
            return
        bodies = [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt | ast.excepthandler)]
        bodies += getattr(node, "cases", [])
        last = node.end_lineno if not bodies else max(node.lineno, _first_line(bodies[0]) - 1)
        place = (function, (node.lineno, last or node.lineno), imported)
        yield from self._own(node, place)
        for name in ("body", "orelse", "finalbody"):
            for child in getattr(node, name, []):
                yield from self._statement(child, function, imported=imported)
        for handler in [*getattr(node, "handlers", []), *getattr(node, "cases", [])]:
            if isinstance(handler, ast.match_case) and handler.guard is not None:
                yield from self._expression(handler.guard, place)
            for child in handler.body:
                yield from self._statement(child, function, imported=imported)

    def _own(self, node: ast.stmt, place: _Place) -> Iterator[Mutant]:
        """Mutants of a statement without the statements in it."""
        if isinstance(node, DELETED) and not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            yield from self._replaced_statement("statement deletion", node, "pass", place)
        if isinstance(node, ast.Assign) and not any(
            isinstance(target, ast.Name | ast.Tuple) for target in node.targets
        ):
            yield from self._replaced_statement("statement deletion", node, "pass", place)
        if isinstance(node, ast.Return) and node.value is not None and not _is_plain(node.value):
            yield from self._replaced_statement("return value", node, "return None", place)
        if isinstance(node, ast.If | ast.While):
            yield from self._negated(node.test, place)
        if isinstance(node, ast.AugAssign) and (symbol := ARITHMETIC.get(type(node.op))):
            yield from self._symbol(
                "arithmetic", node.op, f"{symbol}=", self._at_end(node.target), self._at(node.value), place
            )
        if isinstance(node, ast.Assign) and any(ast.unparse(t) in {"__slots__", "__all__"} for t in node.targets):
            return
        for field, value in ast.iter_fields(node):
            if field == "annotation":
                continue
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.withitem):
                    yield from self._expression(child.context_expr, place)
                elif isinstance(child, ast.expr):
                    yield from self._expression(child, place)

    def _expression(self, node: ast.AST, place: _Place) -> Iterator[Mutant]:
        yield from self._operators(node, place)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in SKIPPED_CALLS:
            return
        if isinstance(node, ast.Subscript) and ast.unparse(node.value) == "Literal":
            return  # a type
        if isinstance(node, ast.JoinedStr):  # before Python 3.12 the positions in it are not the file's
            return
        for child in ast.iter_child_nodes(node):
            yield from self._expression(child, place)

    def _operators(self, node: ast.AST, place: _Place) -> Iterator[Mutant]:
        if isinstance(node, ast.Compare):
            for (left, right), op in zip(pairwise([node.left, *node.comparators]), node.ops, strict=True):
                for new in COMPARISONS[type(op)]:
                    yield from self._symbol("comparison", op, new, self._at_end(left), self._at(right), place)
        elif isinstance(node, ast.BoolOp):
            old, new = ("and", "or") if isinstance(node.op, ast.And) else ("or", "and")
            if len(node.values) == 2:
                start, end = self._at_end(node.values[0]), self._at(node.values[1])
                yield from self._matched("and/or", old, new, start, end, place)
        elif isinstance(node, ast.UnaryOp):
            operator = "not" if isinstance(node.op, ast.Not) else "unary"
            yield self._mutant(operator, self._at(node), self._at(node.operand), "", place)
        elif isinstance(node, ast.IfExp):
            yield from self._negated(node.test, place)
        elif isinstance(node, ast.comprehension):
            for condition in node.ifs:
                yield from self._negated(condition, place)
        elif isinstance(node, ast.BinOp) and (symbol := ARITHMETIC.get(type(node.op))):
            start, end = self._at_end(node.left), self._at(node.right)
            if not any(
                isinstance(side, ast.Constant | ast.JoinedStr) and _is_text(side) for side in (node.left, node.right)
            ):
                yield from self._symbol("arithmetic", node.op, symbol, start, end, place)
        elif isinstance(node, ast.Constant):
            yield from self._constant(node, place)
        elif isinstance(node, ast.Call):
            yield from self._call(node, place)

    def _constant(self, node: ast.Constant, place: _Place) -> Iterator[Mutant]:
        start, end = self._at(node), self._at_end(node)
        if isinstance(node.value, bool):
            yield self._mutant("constant", start, end, str(not node.value), place)
        elif isinstance(node.value, int):
            if _is_limit(node.value):
                return
            for value in (node.value + 1, node.value - 1):
                new = str(value) if value >= 0 else f"({value})"
                yield self._mutant("±1", start, end, new, place)
        elif isinstance(node.value, str) and node.lineno == node.end_lineno:
            text = self.source[start:end].decode()
            quote = text[-1]
            if not text.endswith(quote * 3) and len(text) > 1:
                yield self._mutant("constant", end - 1, end, f"~{quote}", place)

    def _call(self, node: ast.Call, place: _Place) -> Iterator[Mutant]:
        name = node.func.id if isinstance(node.func, ast.Name) else None
        if name in EXCHANGED and not (name == "sorted" and node.keywords):
            start, end = self._at(node.func), self._at_end(node.func)
            yield self._mutant("sorted/min/any", start, end, EXCHANGED[name], place)
        arguments: list[ast.expr | ast.keyword] = [*node.args, *node.keywords]
        if len(arguments) == 1 and isinstance(arguments[0], ast.GeneratorExp):
            return
        for i, argument in enumerate(arguments):
            if i + 1 < len(arguments):
                start, end = self._at(argument), self._at(arguments[i + 1])
                if isinstance(arguments[i + 1], ast.keyword) or not isinstance(argument, ast.keyword):
                    kept = "\n" * self.source[start:end].count(b"\n")
                    yield self._mutant("dropped argument", start, end, kept, place)
            else:
                start = self._at_end(arguments[i - 1]) if i else self._at_end(node.func)
                cut = self._at_end(argument)
                kept = ("" if i else "(") + "\n" * self.source[start:cut].count(b"\n")
                yield self._mutant("dropped argument", start, cut, kept, place)

    def _negated(self, node: ast.expr, place: _Place) -> Iterator[Mutant]:
        if isinstance(node, ast.Constant | ast.UnaryOp):
            return  # `while True`; `not` is removed instead
        start, end = self._at(node), self._at_end(node)
        yield self._mutant("not", start, end, f"(not ({self.source[start:end].decode()}))", place)

    def _replaced_statement(self, operator: str, node: ast.stmt, new: str, place: _Place) -> Iterator[Mutant]:
        start, end = self._at(node), self._at_end(node)
        yield self._mutant(operator, start, end, new + "\n" * self.source[start:end].count(b"\n"), place)

    def _symbol(self, operator: str, op: ast.AST, new: str, start: int, end: int, place: _Place) -> Iterator[Mutant]:
        equals = "=" if new.endswith("=") and operator == "arithmetic" else ""
        yield from self._matched(operator, SYMBOL[type(op)] + equals, new, start, end, place)

    def _matched(self, operator: str, old: str, new: str, start: int, end: int, place: _Place) -> Iterator[Mutant]:
        gap = self.source[start:end].decode()
        found = re.search(rf"(?<![\w<>=!*/]){old}(?![\w<>=*/])", re.sub(r"#.*", lambda m: "#" * len(m[0]), gap))
        if found is not None:
            at = [start + len(gap[: found.start()].encode()), start + len(gap[: found.end()].encode())]
            yield self._mutant(operator, at[0], at[1], new, place)

    def _mutant(self, operator: str, start: int, end: int, new: str, place: _Place) -> Mutant:
        function, lines, imported = place
        first, last = self.source.rfind(b"\n", 0, start) + 1, self.source.find(b"\n", max(start, end - 1))
        last = len(self.source) if last < 0 else last
        before = self.source[first:last].decode()
        after = (self.source[first:start] + new.encode() + self.source[end:last]).decode()
        line = self.source.count(b"\n", 0, start) + 1
        before, after = (_tidy(text) for text in (before, after))
        return Mutant(self.file, function, operator, start, end, new, line, lines, imported, before, after)

    def _at(self, node: ast.AST) -> int:
        return self.starts[node.lineno - 1] + node.col_offset

    def _at_end(self, node: ast.AST) -> int:
        return self.starts[node.end_lineno - 1] + node.end_col_offset


_Place = tuple[str, tuple[int, int], bool]


def _tidy(text: str) -> str:
    return "\n".join(line.strip() for line in text.splitlines() if line.strip())


def _first_line(node: ast.AST) -> int:
    line: int = node.pattern.lineno if isinstance(node, ast.match_case) else node.lineno
    decorators = getattr(node, "decorator_list", [])
    return min([line, *(decorator.lineno for decorator in decorators)])


def _is_plain(node: ast.expr) -> bool:
    """Nothing, or a truth value, which the operator `constant` changes."""
    return isinstance(node, ast.Constant) and (node.value is None or isinstance(node.value, bool))


def _is_limit(value: int) -> bool:
    """A round number that somebody chose, such as the most states to store: one more or less is as right."""
    return value >= 100 and value % 10 == 0 and bool(value & (value - 1))


def _is_text(node: ast.Constant | ast.JoinedStr) -> bool:
    return isinstance(node, ast.JoinedStr) or isinstance(node.value, str)
