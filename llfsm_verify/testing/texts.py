"""Random guards and actions that pass the type checker, drawn with the simplest ones first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Protocol, TypeVar

from hypothesis import strategies as st

T = TypeVar("T")


class Draw(Protocol):
    """What `@st.composite` gives."""

    def __call__(self, strategy: st.SearchStrategy[int]) -> int: ...


@cache
def _below(count: int) -> st.SearchStrategy[int]:
    return st.integers(0, count - 1)


class Pen:
    """Decisions drawn one by one; every decision shrinks towards its first possibility."""

    def __init__(self, draw: Draw) -> None:
        self._draw = draw

    def number(self, low: int, high: int) -> int:
        """A number from `low` to `high`, the low ones simplest."""
        return low if low == high else low + self._draw(_below(high - low + 1))

    def pick(self, options: Sequence[T]) -> T:
        return options[self.number(0, len(options) - 1)]

    def one_in(self, count: int) -> bool:
        """True about once in `count` times; False is simpler."""
        return self._draw(_below(count)) == count - 1

    def weighted(self, options: Sequence[tuple[int, T]]) -> T:
        """One of the options, each as often as its weight says."""
        at = self._draw(_below(sum(w for w, _ in options)))
        for weight, option in options:
            at -= weight
            if at < 0:
                return option
        raise AssertionError("weights")


@dataclass(frozen=True, slots=True)
class Place:
    """Something that can be read and perhaps written: a scalar, or an array of `size` (`low` and `high` are then those
    of its elements). `kind`: ``bool``, ``range``, ``fixed``, ``wide`` (64 bits), ``int``, ``decimal`` (`low` and `high`
    in tenths), or the name of an enumeration."""

    text: str
    kind: str
    low: int = 0
    high: int = 0
    size: int = 0
    writable: bool = True


@dataclass(frozen=True, slots=True)
class Whole:
    """A whole record or array; two of the same `type` can be compared and assigned."""

    text: str
    type: str
    writable: bool


@dataclass(frozen=True, slots=True)
class Names:
    """What the text of one state can name."""

    places: tuple[Place, ...]
    wholes: tuple[Whole, ...]
    constants: tuple[tuple[str, int], ...]
    """Constant parameters with their value."""
    machines: tuple[tuple[str, tuple[str, ...]], ...]
    """Names for machines, each with the states one may ask for."""
    enumerations: tuple[tuple[str, tuple[str, ...]], ...]
    bounds: tuple[str, ...]
    """Calls of `after` that the arrangement's timing allows; none: no time."""
    timed: bool
    chooses: bool = False
    """The text is of a model."""
    nested: tuple[str, ...] = ()
    """The machines that states run."""
    loads: bool = False
    """Machines are loaded and unloaded."""
    tables: bool = False
    """There are the tables `list`, of five integers, and `curve`, of three decimals."""


@dataclass(slots=True)
class Writer:
    """Draws texts. `names` grows by the locals of the open blocks."""

    pen: Pen
    names: Names
    _counter: int = field(default=0)

    def _of(self, kind: str) -> list[Place]:
        return [p for p in self.names.places if p.kind == kind]

    # ------------------------------------------------------------ expressions

    def integer(self, depth: int) -> tuple[str, bool]:
        """An integer expression, and whether it is constant."""
        pen = self.pen
        places = [p for p in self.names.places if p.kind in ("range", "fixed", "int")]
        kind = pen.weighted(((4, "literal"), (8, "read"), (5 if depth else 0, "deeper"))) if places else "literal"
        if kind == "read":
            return self._element(pen.pick(places), depth), False
        if kind == "literal":
            if self.names.constants and pen.one_in(3):
                return pen.pick(self.names.constants)[0], True
            return str(pen.weighted(((6, 0), (6, 1), (4, 2), (3, 3), (1, -1), (1, 100)))), True
        if self._of("fixed") and pen.one_in(5):
            return self._bits(depth - 1), False
        if self.names.tables and pen.one_in(5):
            index = self.index(5, depth)
            return f"list[{index}]", index.isdigit()
        if self._of("wide") and pen.one_in(5):
            divisor = pen.pick(("7", "1000000007", "0x7fffffffffffffff"))
            return f"({self.wide(depth - 1)} {pen.pick('%/')} {divisor})", False
        if self._of("decimal") and pen.one_in(4):
            return f"{pen.pick(('floor', 'ceil', 'round'))}({self.decimal(depth - 1)})", False
        shape = pen.pick(("a + b", "a - b", "a * b", "a % b", "a / b", "-a", "abs", "min", "max", "?:"))
        a, constant = self.integer(depth - 1)
        if shape == "-a":
            return f"(-{a})" if a[0] != "-" else a[1:], constant
        if shape == "abs":
            return f"abs({a})", constant
        if shape in ("a % b", "a / b"):
            b, same = self.divisor(depth - 1)
            return f"({a} {shape[2]} {b})", constant and same
        b, same = self.integer(depth - 1)
        if shape in ("min", "max"):
            return f"{shape}({a}, {b})", constant and same
        if shape == "?:":
            # With a constant condition one constant side is enough.
            return f"({self.condition(depth - 1)} ? {a} : {b})", constant or same
        return f"({a} {shape[2]} {b})", constant and same

    def _bits(self, depth: int) -> str:
        """A bit operation on numbers of one fixed width."""
        pen = self.pen
        first = pen.pick(self._of("fixed"))
        alike = [p for p in self._of("fixed") if p.low == first.low]
        a = self._element(first, depth)
        if depth > 0 and pen.one_in(2):
            a = f"(~{a} ^ {self._element(pen.pick(alike), depth)})"
        shape = pen.pick(("&", "|", "^", "~", "<<", ">>"))
        if shape == "~":
            return f"(~{a})"
        if shape in ("<<", ">>"):
            reads = [p for p in self.names.places if p.kind in ("range", "fixed") and not p.size]
            return f"({a} {shape} {pen.pick(reads).text if pen.one_in(3) else pen.number(0, 7)})"
        b = self._element(pen.pick(alike), depth) if pen.one_in(2) else pen.pick(("15", "0x55", "100", "1"))
        return f"({a} {shape} {b})"

    def wide(self, depth: int) -> str:
        """An expression that reads a number of 64 bits, and fits in 128."""
        pen, places = self.pen, self._of("wide")
        first = self._element(pen.pick(places), depth)
        if depth <= 0 or pen.one_in(3):
            second = self._element(pen.pick(places), depth)
            return pen.pick((first, f"({first} * {second})", f"({first} * {self.integer(0)[0]})"))
        shape = pen.pick(("+", "-", "*", "/", "%", "-a", "abs", "min", "?:", "&", "~", ">>"))
        if shape in ("-a", "abs", "~"):
            return {"-a": f"(-{first})", "abs": f"abs({first})", "~": f"(~{first})"}[shape]
        if shape == "&":
            return f"({first} {pen.pick('&|^')} {pen.pick(('255', '0x5555555555555555', first))})"
        if shape == ">>":
            return f"({first} {pen.pick(('<<', '>>'))} {pen.number(0, 63)})"
        if shape in "/%":
            return (
                f"({first} {shape} {pen.pick(('3', '-1', '4611686018427387904', f'({self.integer(0)[0]} * 2 + 1)'))})"
            )
        second = self._element(pen.pick(places), depth)
        if shape == "min":
            return f"{pen.pick(('min', 'max'))}({first}, {second})"
        if shape == "?:":
            return f"({self.condition(depth - 1)} ? {first} : {self.integer(depth - 1)[0]})"
        return f"({first} {shape} {second})"

    def decimal(self, depth: int) -> str:
        """A decimal expression that reads something."""
        pen, places = self.pen, self._of("decimal")
        if depth <= 0 or pen.one_in(3):
            return self._element(pen.pick(places), depth)
        if self.names.tables and pen.one_in(4):
            return f"curve[{self.index(3, depth)}]"
        a = self.decimal(depth - 1)
        shape = pen.pick(("+", "-", "*", "/", "-a", "abs", "min", "max", "?:", "sqrt"))
        if shape in ("abs", "sqrt"):
            return f"{shape}({a})" if shape == "abs" or pen.one_in(3) else f"sqrt(abs({a}))"
        if shape == "-a":
            return f"(-{a})" if a[0] != "-" else a[1:]
        if shape == "/":
            divisor = self.decimal(depth - 1) if pen.one_in(4) else pen.pick(("2", "0.3", "-1.25", "3"))
            return f"({a} / {divisor})"
        b = pen.pick(("0.5", "1", "0.25", "-1.1")) if pen.one_in(2) else self.decimal(depth - 1)
        if shape in ("min", "max"):
            return f"{shape}({a}, {b})"
        if shape == "?:":
            return f"({self.condition(depth - 1)} ? {a} : {b})"
        return f"({a} {shape} {b})"

    def divisor(self, depth: int) -> tuple[str, bool]:
        """Seldom one that can be zero."""
        if depth >= 0 and self.pen.one_in(4):
            text, constant = self.integer(depth)
            if not constant:
                return text, False
        return str(self.pen.pick((2, 3, -2, 1))), True

    def index(self, size: int, depth: int) -> str:
        """Seldom one that can be outside."""
        if depth > 0 and self.pen.one_in(2):
            text, constant = self.integer(depth - 1)
            if not constant:
                return text if self.pen.one_in(3) else f"abs({text}) % {size}"
        return str(self.pen.number(0, size - 1))

    def _element(self, place: Place, depth: int) -> str:
        return place.text if not place.size else f"{place.text}[{self.index(place.size, depth)}]"

    def condition(self, depth: int) -> str:
        pen = self.pen
        bools = self._of("bool")
        kind = pen.weighted(
            (
                (2, "true"), (4 if bools else 0, "read"), (4, "compare"), (2, "enumerator"),
                (3 if self.names.machines else 0, "machine"),
                (3 if self.names.bounds else 0, "after"), (1, "false"), (3 if depth else 0, "and"),
                (2 if depth else 0, "or"), (2 if depth else 0, "not"), (1 if depth else 0, "?:"), (1, "whole"),
            )
        )  # fmt: skip
        match kind:
            case "read":
                return self._element(pen.pick(bools), depth)
            case "compare":
                left, right = self.integer(depth)[0], self.integer(max(0, depth - 1))[0]
                if self._of("decimal") and pen.one_in(3):
                    left = self.decimal(depth)
                elif self._of("wide") and pen.one_in(2):
                    left = self.wide(depth)
                return f"({left} {pen.pick(('==', '!=', '<', '<=', '>', '>='))} {right})"
            case "enumerator":
                return self._of_enumeration(depth)
            case "machine":
                return self._of_machine()
            case "after":
                return self._after()
            case "and" | "or":
                left, right = self.condition(depth - 1), self.condition(depth - 1)
                return f"({left} {'&&' if kind == 'and' else '||'} {right})"
            case "not":
                return f"!({self.condition(depth - 1)})"
            case "?:":
                a, b, c = (self.condition(depth - 1) for _ in range(3))
                return f"({a} ? {b} : {c})"
            case "whole":
                wholes = self.names.wholes
                pairs = [(a, b) for a in wholes for b in wholes if a.type == b.type and a.text < b.text]
                if pairs:
                    a_whole, b_whole = pen.pick(pairs)
                    return f"({a_whole.text} {pen.pick(('==', '!='))} {b_whole.text})"
        return "false" if kind == "false" else "true"

    def _of_enumeration(self, depth: int) -> str:
        owned = [p for p in self.names.places if p.kind in dict(self.names.enumerations)]
        if not owned:
            return "true"
        place = self.pen.pick(owned)
        return f"({self._element(place, depth)} {self.pen.pick(('==', '!='))} {self._value_of(place, 0)})"

    def _value_of(self, place: Place, depth: int) -> str:
        others = self._of(place.kind)
        if others and self.pen.one_in(3):
            return self._element(self.pen.pick(others), depth)
        return self.pen.pick(dict(self.names.enumerations)[place.kind])

    def _of_machine(self) -> str:
        if self.names.nested and self.pen.one_in(2):
            return f"done({self.pen.pick(self.names.nested)})"
        name, states = self.pen.pick(self.names.machines)
        shape = self.pen.weighted(((3, "@"), (1, "is_suspended"), (1, "is_running")))
        return f"{name}@{self.pen.pick(states)}" if shape == "@" else f"{shape}({name})"

    def _after(self) -> str:
        clocked = [p for p in self.names.places if p.kind == "range" and 0 < p.high <= 4 and not p.size]
        if self.names.timed and clocked and self.pen.one_in(4):
            return f"after_ms({self.pen.pick((10, 3))} * {self.pen.pick(clocked).text})"
        return self.pen.pick(self.names.bounds)

    # ------------------------------------------------------------ statements

    def actions(self, most: int, depth: int = 2) -> str:
        """Up to `most` statements."""
        with self._block():
            return " ".join(self._statement(depth) for _ in range(self.pen.number(0, most)))

    @contextmanager
    def _block(self) -> Iterator[None]:
        outer = self.names
        yield
        self.names = outer

    def _statement(self, depth: int) -> str:
        kind = self.pen.weighted(
            (
                (8, "assign"), (4 if self.names.machines else 0, "command"), (2, "update"),
                (2 if depth else 0, "if"), (1 if depth else 0, "for"),
                (1, "local"), (1, "whole"),
            )
        )  # fmt: skip
        match kind:
            case "command":
                return self._command()
            case "if":
                text = f"if ({self.condition(1)}) {{ {self.actions(2, depth - 1)} }}"
                return text + (f" else {{ {self.actions(2, depth - 1)} }}" if self.pen.one_in(2) else "")
            case "for":
                return self._for(depth)
            case "local":
                return self._local(depth)
            case "whole":
                wholes = self.names.wholes
                pairs = [(a, b) for a in wholes for b in wholes if a.writable and a != b and a.type == b.type]
                if pairs:
                    target, source = self.pen.pick(pairs)
                    return f"{target.text} = {source.text};"
        writable = [p for p in self.names.places if p.writable]
        if kind == "update":
            writable = [p for p in writable if p.kind in ("range", "fixed", "wide", "int", "decimal")]
        if not writable:
            return ""
        place = self.pen.pick(writable)
        return self._update(place) if kind == "update" else self._assign(place, depth)

    def _assign(self, place: Place, depth: int) -> str:
        target = self._element(place, 1)
        if self.names.chooses and self.pen.one_in(2):
            return f"{target} = {self.choose(place)};"
        if place.kind == "bool":
            return f"{target} = {self.condition(depth)};"
        if place.kind == "decimal":
            return f"{target} = {self._fitting_decimal(place, depth)};"
        if place.kind == "wide" and self.pen.one_in(2):
            return f"{target} = {self.wide(depth)};"
        if place.kind not in ("range", "fixed", "wide", "int"):
            return f"{target} = {self._value_of(place, 1)};"
        return f"{target} = {self.fitting(place, depth)};"

    def choose(self, place: Place) -> str:
        """A choice between some values of the place's type."""
        if place.kind == "bool":
            return self.pen.pick(("choose(bool)", "choose(true, false)", "choose(true)"))
        if place.kind == "decimal":
            return self.pen.pick(("choose(0.0..0.2)", "choose(1, -0.5)", "choose(0.3, 0.1, 1.50)"))
        if place.kind not in ("range", "fixed", "wide", "int"):
            values = dict(self.names.enumerations)[place.kind]
            listed = f"choose({self.pen.pick(values)}, {self.pen.pick(values)})"
            return self.pen.pick((f"choose({place.kind})", listed))
        low, high = max(place.low, -2), min(place.high, 3) if place.kind != "int" else 3
        a, b = sorted(self.pen.number(low, high) for _ in range(2))
        return self.pen.pick((f"choose({a}..{b})", f"choose({b}, {a})", f"choose({low}, {high})"))

    def fitting(self, place: Place, depth: int) -> str:
        """An integer expression for a store that seldom leaves the place's range."""
        span = place.high - place.low + 1
        shape = self.pen.weighted(((3, "literal"), (4, "step"), (2, "wrapped"), (1, "any")))
        if place.kind == "range" and shape == "literal":
            return str(self.pen.number(place.low, place.high))
        text, constant = self.integer(depth)
        if place.kind == "int" and shape != "literal" and not constant and self.pen.one_in(2):
            return self.pen.pick((f"{text} * 3037000500", f"{text} * {text} + 2147483647"))
        if place.kind != "range":
            return text
        if constant:
            return str(self.pen.number(place.low, place.high))
        if shape == "any":
            return text
        return f"(abs({text}) + 1) % {span}" + (f" + {place.low}" if place.low >= 0 else f" - {-place.low}")

    def _fitting_decimal(self, place: Place, depth: int) -> str:
        """A decimal expression for a store that seldom leaves the place's range."""
        low, high = (f"{bound / 10:.1f}" for bound in (place.low, place.high))
        shape = self.pen.weighted(((3, "literal"), (4, "clamped"), (1, "any"), (1, "integer")))
        if shape == "literal":
            return f"{self.pen.number(place.low, place.high) / 10:.1f}"
        text = self.decimal(depth)
        if shape == "integer":
            return f"(abs({self.integer(depth)[0]}) % 2)"
        if shape == "any":
            # A number of a table may be no multiple of the place's step, which is an error where it stands alone.
            return f"({text} + 0.0)" if text.startswith("curve[") else text
        return f"min({high}, max({low}, {text}))"

    def _update(self, place: Place) -> str:
        target = self._element(place, 1)
        if place.kind == "decimal":
            value = self.decimal(1) if self.pen.one_in(2) else self.pen.pick(("0.1", "0.25", "2", "-0.5"))
            return f"{target} {self.pen.pick(('+', '-', '*'))}= {value};"
        if self.pen.one_in(2):
            return f"{target}{self.pen.pick(('++', '--'))};"
        if place.kind == "fixed" and self.pen.one_in(3):
            return f"{target} {self.pen.pick(('&', '|', '^'))}= {self.pen.pick(('12', '0x7', '42'))};"
        operator = self.pen.pick(("+", "-", "*", "/", "%"))
        value = self.divisor(0)[0] if operator in "/%" else self.integer(1)[0]
        return f"{target} {operator}= {value};"

    def _for(self, depth: int) -> str:
        self._counter += 1
        name, last = f"i{self._counter}", self.pen.number(0, 2)
        first = self.pen.number(0, 1)
        with self._block():
            self._add(Place(name, "range", first, max(first, last), 0, False))
            head = f"({name} in {first}..{last})"
            if self.pen.one_in(2):
                head = f"(int {name} = {first}; {name} <= {last}; {name}++)"
            return f"for {head} {{ {self.actions(2, depth - 1)} }}"

    def _local(self, depth: int) -> str:
        self._counter += 1
        name = f"t{self._counter}"
        place = self.pen.pick((Place(name, "range", 0, 3), Place(name, "bool"), Place(name, "fixed", -128, 127)))
        kind = {"range": "0..3", "bool": "bool", "fixed": "int8"}[place.kind]
        value = self.condition(depth) if place.kind == "bool" else self.fitting(place, depth)
        self._add(place)
        return f"{kind} {name} = {value};"

    def _add(self, place: Place) -> None:
        self.names = replace(self.names, places=(*self.names.places, place))

    def _command(self) -> str:
        loading = ((4, "load"), (4, "unload"), (2, "load_suspended")) if self.names.loads else ()
        kind = self.pen.weighted(((4, "suspend"), (4, "resume"), (3, "restart"), (1, "suspend_all"), *loading))
        if kind == "suspend_all":
            return "suspend_all();"
        names = [name for name, _ in self.names.machines]
        if "load" in kind:
            names = [name for name in names if name not in (*self.names.nested, "self", "peer")] or ["self"]
        return f"{kind}({self.pen.pick(names)});"
