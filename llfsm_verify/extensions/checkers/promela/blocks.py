"""Blocks of a step program as statements of Promela, in as few transitions as their choices allow; and what stands
above a model: what it is, and the commands that check it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from textwrap import indent

from llfsm_verify.extensions.checkers.flat import Flat, Identifiers, comment
from llfsm_verify.plug import (
    Block,
    Choice,
    Const,
    Expr,
    Get,
    If,
    Int,
    Ite,
    Let,
    Local,
    Op,
    Sample,
    Set,
    Stmt,
    Switch,
    Type,
    Var,
    distinct_nodes,
    expressions,
    fold,
    parts,
    statements,
)

CHOICE = "?"
"""The name of a local that stands for a choice begins so."""
LISTED = 16
"""A choice of at most so many values is a list of them; a wider one counts up."""
_INFIX = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "%", "eq": "==", "ne": "!=", "lt": "<", "le": "<=",
    "gt": ">", "ge": ">=", "and": "&&", "or": "||", "xor": "!=",
}  # fmt: skip


def storage(low: int, high: int, boolean: bool = False) -> str:
    """The smallest type that holds 0 (what cleared variables have) and low … high."""
    if boolean:
        return "bool"
    if low >= 0 and high <= 255:
        return "byte"
    return "short" if low >= -(1 << 15) and high < 1 << 15 else "int"


def type_of(t: Type) -> str:
    assert isinstance(t, Int)
    return storage(t.low, t.high, t.boolean)


@dataclass(slots=True)
class Scratch:
    """A variable that only lives inside a step: the widest of its types, and by step the places that use it."""

    low: int
    high: int
    boolean: bool
    places: dict[int, set[int]] = field(default_factory=dict)

    @property
    def kept(self) -> bool:
        """It carries a value from one transition of the model to the next, so SPIN must store it."""
        return any(len(p) > 1 for p in self.places.values())


class Blocks:
    """Writes blocks one after the other and keeps what they used: `scratch`, `picked`, `repeated`.

    `names` are the identifiers of the variables, `then` the statements that follow each assignment to one. The writer
    of the model counts `step` up for each step that begins.
    """

    def __init__(
        self, ids: Identifiers, names: Mapping[str, str], variables: Sequence[Var], choices: Sequence[Choice],
        blocks: Iterable[Block], then: Mapping[str, Sequence[str]],
    ) -> None:  # fmt: skip
        self._ids = ids
        self.names = names
        self.then = then
        self.shifts = {v.name: shift for v in variables if (shift := _shift(v))}
        """What is added to the elements of an array when they are stored."""
        self._choices = {c.name: c for c in choices}
        self._aliases = _aliases(blocks)
        self.picked: dict[str, str] = {}
        """The variables of the choices that are made, by the choice's name."""
        self.repeated: set[str] = set()
        """Choices that remember whether they have been made in this step."""
        self.locals: dict[str, str] = {}
        self.scratch: dict[str, Scratch] = {}
        self.step = self._place = 0

    # ------------------------------------------------------------ expressions

    def expression(self, root: Expr) -> str:
        return fold(root, self._node)

    def _node(self, e: Expr, args: list[str]) -> str:
        match e:
            case Const(value, _):
                return str(value) if value >= 0 else f"({value})" if value > -(1 << 31) else "(-2147483647 - 1)"
            case Get(name, index, _):
                if index is None:
                    return self.names[name]
                shift = self.shifts.get(name, 0)
                return f"({self.names[name]}[{args[0]}] - {shift})" if shift else f"{self.names[name]}[{args[0]}]"
            case Local(name, _):
                return self._local(name)
            case Ite():
                return f"({args[0]} -> {args[1]} : {args[2]})"
            case Op(name, _, kind):
                return self._operation(name, args, kind)
        raise AssertionError(e)

    def _operation(self, name: str, a: list[str], kind: Type) -> str:
        if name in _INFIX:
            return f"({a[0]} {_INFIX[name]} {a[1]})"
        match name:
            case "neg":
                return f"(0 - {a[0]})"
            case "not":
                return f"(!{a[0]})"
            case "abs":
                return f"({a[0]} < 0 -> 0 - {a[0]} : {a[0]})"
            case "min" | "max":
                return f"({a[0]} {'<' if name == 'min' else '>'} {a[1]} -> {a[0]} : {a[1]})"
        assert name == "wrap"
        assert isinstance(kind, Int)
        mask = kind.high - kind.low
        # Two's complement: the low bits of a C int, then the sign moved into place.
        low = f"({a[0]} & {mask})"
        return low if kind.low == 0 else f"(({low} ^ {-kind.low}) - {-kind.low})"

    def _local(self, name: str) -> str:
        choice = self._aliases.get(name) or (name.removeprefix(CHOICE) if name.startswith(CHOICE) else None)
        if choice is not None:
            return self._choice(choice)
        if name not in self.locals:
            self.locals[name] = self._ids.new("l_", name)
        return self.locals[name]

    def _use(self, local: Local) -> None:
        """This place of the model reads or writes the local."""
        if local.name in self._aliases or local.name.startswith(CHOICE):
            return
        kind = local.type
        assert isinstance(kind, Int)
        found = self.scratch.setdefault(local.name, Scratch(kind.low, kind.high, kind.boolean))
        found.low, found.high = min(found.low, kind.low), max(found.high, kind.high)
        found.boolean = found.boolean and kind.boolean
        found.places.setdefault(self.step, set()).add(self._place)

    def _uses(self, e: Expr) -> None:
        for node in distinct_nodes(e):
            if isinstance(node, Local):
                self._use(node)

    def _choice(self, name: str) -> str:
        if name not in self.picked:
            self.picked[name] = self._ids.new("in_", name)
        return self.picked[name]

    # ------------------------------------------------------------ statements in one indivisible step

    def _plain(self, block: Block) -> str:
        """Statements without a choice, for the inside of a d_step."""
        return ";\n".join(self.statement(s) for s in block) or "skip"

    def statement(self, s: Stmt) -> str:
        for e in expressions(s):
            self._uses(e)
        match s:
            case Set(name, index, value):
                where = "" if index is None else f"[{self.expression(index)}]"
                shift = f" + {self.shifts[name]}" if name in self.shifts else ""
                text = f"{self.names[name]}{where} = {self.expression(value)}{shift}"
                return ";\n".join([text, *self.then.get(name, ())])
            case Let(local, value):
                self._use(local)
                return f"{self._local(local.name)} = {self.expression(value)}"
            case If(condition, then, otherwise):
                return conditional([(self.expression(condition), self._plain(then))], self._plain(otherwise))
            case Switch(value, cases, default):
                chosen = self.expression(value)
                arms = [(f"({chosen} == {k})", self._plain(block)) for k, block in cases]
                return conditional(arms, self._plain(default))
        raise AssertionError(s)

    # ------------------------------------------------------------ statements with choices among them

    def transitions(
        self, block: Block, may: set[str], must: set[str], start: str = "", end: str = "", alone: bool = False
    ) -> list[str]:
        """Statements of which some choose, between `start` and `end`, as few transitions; `alone` keeps `start` one by
        itself.

        `may` and `must` tell which choices some and all paths to here have made, and are brought up to date.
        """
        pieces: list[str] = []
        texts = [start] if start else []
        plain: list[Stmt] = []

        def flush() -> None:
            if plain:
                self._place += 1
                texts.append(self._plain(tuple(plain)))
            if texts:
                pieces.append(indivisible(texts))
            plain.clear()
            texts.clear()

        if alone:
            flush()
        for s in block:
            if not any(isinstance(inner, Sample) for inner in statements((s,))):
                plain.append(s)
                continue
            if isinstance(s, Sample):
                if s.choice not in must:
                    flush()
                    pieces.append(self._sample(self._choices[s.choice], may, must))
                if s.local.name not in self._aliases:
                    plain.append(Let(s.local, Local(CHOICE + s.choice, s.local.type)))
                continue
            flush()
            self._place += 1
            pieces.append(self._branches(s, may, must))
        if end:
            if plain:
                self._place += 1
                texts.append(self._plain(tuple(plain)))
                plain.clear()
            texts.append(end)
        flush()
        return pieces

    def _branches(self, s: Stmt, may: set[str], must: set[str]) -> str:
        for e in expressions(s):
            self._uses(e)
        if isinstance(s, If):
            guards = [self.expression(s.condition)]
        else:
            assert isinstance(s, Switch)
            chosen = self.expression(s.value)
            guards = [f"({chosen} == {k})" for k, _ in s.cases]
        texts: list[str] = []
        before, ways = (set(may), set(must)), []
        for inner in parts(s):
            way = set(before[0]), set(before[1])
            texts.append(";\n".join(self.transitions(inner, *way)) or "skip")
            ways.append(way)
        may |= set().union(*(w[0] for w in ways))
        must |= set.intersection(*(w[1] for w in ways))
        return conditional(list(zip(guards, texts[:-1], strict=True)), texts[-1])

    def _sample(self, choice: Choice, may: set[str], must: set[str]) -> str:
        """Make a choice, unless this step has made it already."""
        variable = self._choice(choice.name)
        pick = pick_any(variable, choice.type.low, choice.type.high)
        if choice.name in may:
            self.repeated.add(choice.name)
        if choice.name in self.repeated:
            pick = f"{pick};\nmade_{variable} = true"
        if choice.name in may:
            pick = conditional([(f"made_{variable}", "skip")], pick)
        may.add(choice.name)
        must.add(choice.name)
        return pick


def _shift(v: Var) -> int:
    """SPIN 6.5 reads no negative numbers in the list of an array's first values: such arrays are stored from 0."""
    listed = isinstance(v.init, tuple) and len(set(v.init)) > 1
    return -v.type.low if listed and isinstance(v.type, Int) and v.type.low < 0 else 0


def _aliases(blocks: Iterable[Block]) -> dict[str, str]:
    """Locals that are nothing but the value of one choice."""
    found: dict[str, set[str]] = {}
    for block in blocks:
        for s in statements(block):
            if isinstance(s, Sample):
                found.setdefault(s.local.name, set()).add(s.choice)
            elif isinstance(s, Let):
                found.setdefault(s.local.name, set()).add("")
    return {name: next(iter(of)) for name, of in found.items() if len(of) == 1 and of != {""}}


# ---------------------------------------------------------------- text


def conditional(arms: Sequence[tuple[str, str]], otherwise: str) -> str:
    lines = ["if"]
    for guard, body in [*arms, ("else", otherwise)]:
        body = body or "skip"
        lines.append(f":: {guard} -> {body}" if "\n" not in body else f":: {guard} ->\n{indent(body, '   ')}")
    return "\n".join([*lines, "fi"])


def indivisible(texts: Sequence[str]) -> str:
    """Indivisible statements: a guard alone is a statement of its own."""
    body = ";\n".join(texts)
    if len(texts) == 1 and "\n" not in body:
        return body
    return f"d_step {{\n{indent(body, '  ')}\n}}"


def pick_any(variable: str, low: int, high: int) -> str:
    """Give a variable any value from `low` to `high`."""
    if low == high:
        return f"{variable} = {low}"
    if high - low < LISTED:
        return "\n".join(["if", *(f":: {variable} = {value}" for value in range(low, high + 1)), "fi"])
    return f"{variable} = {low};\ndo\n:: ({variable} < {high}) -> {variable}++\n:: break\nod"


STATE_VECTOR = 1000
"""Bytes of SPIN's state vector from which on its compiler must be told (it assumes 1024)."""

_BYTES = {"bool": 1, "byte": 1, "short": 2, "int": 4}


def header(flat: Flat, blocks: Blocks, letter: int) -> list[str]:
    """The lines of the comment; `letter` is the number of variables that hold the letter.

    gcc is told -w: what SPIN writes gives dozens of warnings that say nothing about the model.
    """
    program, checked = flat.program, flat.specification.observed
    options = f"-DNOREDUCE{_vector(flat, blocks, letter)} -o pan pan.c"
    lines = [f"/* The arrangement {comment(program.name)}, written by llfsm kripke."]
    if not checked:
        unit = "cycle" if program.observe == "cycle" else "ringlet"
        lines += [
            f"   SPIN stores one state per configuration; a {unit} is one atomic sequence:",
            "     spin -o2 -a FILE",
            f"     gcc -w -O2 -DSAFETY {options}",
            "     ./pan -m1000000" + ("    stops at the first fault: an assertion" if flat.faulty else ""),
        ]
        if flat.faulty:
            lines.append("     ./pan -m1000000 -A -E    counts; a fault leads to the initial configuration")
    else:
        lines += [
            "   A letter is held until the next step is complete, so that formulas without X keep their meaning.",
            "   The others, and long ones, are never claims of ours, which read a letter where `tick` holds.",
            "     spin -o2 -a FILE",
            f"     gcc -w -O2 {options}",
            "     ./pan -m1000000 -a -N NAME    for each ltl block and never claim",
        ]
        names = ", ".join(comment(name) for name, _ in flat.specification.assumptions)
        if names:
            lines.append(f"   Assumed: {names}.")
    lines[-1] += " */"
    return lines


def _vector(flat: Flat, blocks: Blocks, letter: int) -> str:
    """The option that makes room for a large state vector."""
    size = sum(_BYTES[type_of(v.type)] * (len(v.init) if isinstance(v.init, tuple) else 1) for v in flat.vars)
    size += 8 * (len(blocks.picked) + letter) + 4 * sum(s.kept for s in blocks.scratch.values())
    return f" -DVECTORSZ={1 << (2 * size).bit_length()}" if size > STATE_VECTOR else ""
