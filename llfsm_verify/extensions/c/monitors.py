"""Monitors beside an image: NAME_monitors.h and NAME_monitors.c, and what a step of them costs at most.

An *operation* of a step is what its C says: a read or a store of a field, a look-up in a table, an arithmetic, logical
or relational operator, or a choice by `?`. Those of all lines are counted, and of the functions that these call.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from textwrap import wrap

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.c.blocks import BlockText, comment, titled
from llfsm_verify.extensions.c.codes import LEAVES_64
from llfsm_verify.extensions.c.names import Names, alone, identifier
from llfsm_verify.extensions.c.texts import runtime
from llfsm_verify.plug import (
    Expr,
    Get,
    MonitorVerdict,
    OnBoard,
    Watched,
    constant_of,
    counted,
    distinct_nodes,
    entry_bytes,
)
from llfsm_verify.plug import shown_atom as shown

VERDICTS = {MonitorVerdict.NOT_YET: "UNDECIDED", MonitorVerdict.TRUE: "HOLDS", MonitorVerdict.FALSE: "VIOLATED"}
OWN = (
    *VERDICTS.values(),
    "verdict",
    "violated",
    "property",
    "properties",
    "PROPERTIES",
    "FLASH",
    "READ8",
    "READ16",
    "APART",
)
COUNTER_BYTES = 4
_DECIDED = (MonitorVerdict.TRUE, MonitorVerdict.FALSE)
_OPERATOR = re.compile(r"->|\[|<<|>>|[<>=!]=|&&|\|\||\+\+|[-+*/%<>!&|^~?]")
_LOOP_TURNS = 129
"""Of the only loop that a step can call, which divides 128 bits; its condition is met once more than its body."""


@dataclass(frozen=True, slots=True)
class _Walk:
    """A monitor in C: its property, its name, the field that holds its state, and the names of its tables."""

    of: OnBoard
    name: str
    field: str
    tables: tuple[str, ...]

    @property
    def path(self) -> str:
        return f"monitors->at.{self.field}"

    def after(self, letter: Collection[str]) -> int:
        """The state after the first letter."""
        table, begin = self.of.table, self.of.table.numbers[0]
        return table.step(begin, self.of.monitor.letter(letter)) if begin < table.settled else begin

    @property
    def state_bytes(self) -> int:
        return entry_bytes(len(self.of.table.numbers))

    @property
    def sizes(self) -> tuple[int, ...]:
        """Bytes of an entry of each table."""
        return tuple(entry_bytes(max(stage) + 1) for stage in self.of.table.stages)

    @property
    def table_bytes(self) -> int:
        return sum(len(stage) * size for stage, size in zip(self.of.table.stages, self.sizes, strict=True))


class Monitors:
    """The C of the monitors of an image with these names.

    DiagnosticError: what an atom calculates may leave 64 bits (E517), or two properties have one name (E504).
    """

    def __init__(self, names: Names, watched: Watched) -> None:
        self._names, self._watched = names, watched
        self._prefix = names.prefix
        for name in OWN:
            names.take(f"{names.prefix}_{name}", "a name of every image with monitors", watched.monitors[0].line.span)
        self.walks = [self._walk(number, found) for number, found in enumerate(watched.monitors)]
        problems = list(self._overflows())
        if problems:
            raise DiagnosticError(problems)

    def _walk(self, number: int, found: OnBoard) -> _Walk:
        name = identifier(found.line.name)
        self._names.take(f"{self._prefix}_property_{name}", f"property `{found.line.name}`", found.line.span)
        tables = tuple(f"table_{number}_{stage}" for stage in range(len(found.table.stages)))
        return _Walk(found, name, alone(name), tables)

    def _overflows(self) -> Iterator[Diagnostic]:
        """What an atom calculates is not to end a step."""
        for key, expression in self._watched.atoms.items():
            lines, _ = self._values({key: expression})
            if any(f"return {self._prefix}_OVERFLOW" in line for line in lines):
                places = (w.of.line.atoms[key] for w in self.walks if key in w.of.line.atoms)
                place = next((fragment.span(0, len(fragment.text)) for fragment in places), None)
                message = f"`{key}` may leave 64 bits, which a monitor on board cannot say"
                hint = "declare the ranges of what it reads, such as `0..1000`"
                yield Diagnostic(LEAVES_64, message, place, hint=hint)

    def _values(self, atoms: Mapping[str, Expr]) -> tuple[list[str], dict[str, str]]:
        """Lines that compute atoms, and what each of them is in C."""
        lines, texts = BlockText(self._names).values({shown(key): atom for key, atom in atoms.items()})
        return lines, dict(zip(atoms, texts, strict=True))

    @property
    def _by_size(self) -> list[_Walk]:
        return sorted(self.walks, key=lambda walk: -walk.state_bytes)

    # ------------------------------------------------------------ the files

    def files(self, mark: str) -> dict[str, str]:
        """NAME_monitors.h and NAME_monitors.c, with the mark in their first lines."""
        p, program = self._prefix, self._names.program
        text = resources.files(__package__).joinpath("monitors.c").read_text(encoding="utf-8")
        names = (
            f"    {p}_property_{w.name}{',' * (w is not self.walks[-1])} {comment(_said(w.of))}" for w in self.walks
        )
        fields = (f"        uint{8 * w.state_bytes}_t {w.field};" for w in self._by_size)
        parts = {
            "GUARD": p.upper(), "NAME": p, "@cost": comment(self.cost), "@names": "\n".join(names),
            "@count": str(len(self.walks)), "@unit": program.observe, "@states": "\n".join(fields),
            "@runtime": runtime("\n".join((*self._step, *self._first))), "@tables": "".join(self._tables()),
            "@decide": self._decide, "@first": _indented(self._first), "@step": _indented(self._step),
            "@verdicts": _indented(self._verdicts()), "@cycle": self._names.fields[program.cycle].path,
        }  # fmt: skip
        made = re.sub("|".join(parts), lambda found: parts[found[0]], text)
        header, source = made.split("/* @source */\n")
        first = comment(titled(program.name, mark)) + "\n"
        return {f"{p}_monitors.h": first + header, f"{p}_monitors.c": first + source}

    def _tables(self) -> Iterator[str]:
        for walk in self.walks:
            if walk.tables:
                yield comment(_said(walk.of)) + "\n"
            for name, stage, size in zip(walk.tables, walk.of.table.stages, walk.sizes, strict=True):
                rows = "\n".join(f"    {', '.join(map(str, row))}," for row in _rows(stage))
                yield f"static const uint{8 * size}_t {name}[] {self._prefix}_FLASH = {{\n{rows.rstrip(',')}\n}};\n"

    # ------------------------------------------------------------ bodies

    @property
    def _decide(self) -> str:
        """What notes the step of a verdict, if there can be one."""
        if not any("decide(" in line for line in self._step):
            return ""
        p = self._prefix
        head = f"static {p}_APART void decide({p}_monitors *monitors, {p}_property property)"
        return f"\n{head}\n{{\n    monitors->decided[property] = monitors->step;\n}}\n"

    @cached_property
    def _first(self) -> list[str]:
        """The body of NAME_monitors_init."""
        first = self._watched.first
        free = any(isinstance(node, Get) for atom in first.values() for node in distinct_nodes(atom))
        lines = ["size_t i;", "monitors->step = 0;", f"for (i = 0; i < {len(self.walks)}; i++) {{"]
        lines += ["    monitors->decided[i] = 0;", "}"]
        if not free:
            letter = {key for key, atom in first.items() if constant_of(atom)}
            return [*lines, "(void)state;", *(f"{w.path} = {w.after(letter)};" for w in self.walks)]
        computed, names = self._values(first)
        lines += [f"{w.path} = {w.of.table.numbers[0]};" for w in self.walks]
        return [*lines, *computed, *(line for w in self.walks if w.tables for line in self._walked(w, names))]

    @cached_property
    def _step(self) -> list[str]:
        """The body of NAME_monitors_step."""
        lines = []
        if self._names.program.observe == "cycle":
            path = self._names.fields[self._names.program.cycle].path
            lines += [f"if (!state->{path}) {{", "    return false; /* a letter is the end of a cycle */", "}"]
        computed, names = self._values(self._watched.atoms)
        lines += ["bool news = false;", *computed]
        lines += ["if (monitors->step < UINT32_MAX) {", "    monitors->step++;", "}"]
        for number, walk in enumerate(self.walks):
            if walk.of.table.settled and walk.tables:
                lines.append(f"if ({walk.path} < {walk.of.table.settled}) {{ {comment(walk.of.line.name)}")
                lines += [f"    {line}" for line in self._walked(walk, names, number)]
                lines.append("}")
        unread = [] if any("state->" in line for line in lines) else ["(void)state;"]
        return [*unread, *lines, "return news;"]

    def _walked(self, walk: _Walk, names: Mapping[str, str], number: int | None = None) -> Iterator[str]:
        """Lines that read a letter. `number`: of the property, to note its verdict there."""
        table, at, node = walk.of.table, 0, walk.path
        for stage, (name, width, size) in enumerate(zip(walk.tables, table.widths, walk.sizes, strict=True)):
            bits = [f"({_bit(names[key], place)})" for place, key in enumerate(walk.of.atoms[at : at + width])]
            index = " | ".join([f"({_bit(node, width)})", *reversed(bits)])
            index = f"(uint8_t)({index})" if len(walk.of.table.stages[stage]) <= 1 << 8 else index
            target = walk.path if stage == len(table.stages) - 1 else f"node_{walk.name}_{stage}"
            declared = "" if target == walk.path else f"const uint{8 * size}_t "
            kind = f"uint{8 * (walk.state_bytes if target == walk.path else size)}_t"
            text = f"{declared}{target} = ({kind}){self._prefix}_READ{8 * size}(&{name}[{index}]);"
            for line in wrap(text, 108, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False):
                yield line.replace("~", " ")
            node, at = target, at + width
        if number is not None:
            verdicts = [q for v in _DECIDED if (q := walk.of.state_of(v)) is not None]
            yield f"if ({' || '.join(f'{walk.path} == {q}' for q in sorted(verdicts))}) {{"
            yield f"    decide(monitors, {self._prefix}_property_{walk.name});"
            yield "    news = true;"
            yield "}"

    def _verdicts(self) -> Iterator[str]:
        """The cases of NAME_monitors_verdict."""
        p = self._prefix
        for walk in self.walks:
            text = f"{p}_UNDECIDED"
            for verdict, name in ((MonitorVerdict.TRUE, "HOLDS"), (MonitorVerdict.FALSE, "VIOLATED")):
                state = walk.of.state_of(verdict)
                if state is not None:
                    text = f"{walk.path} == {state} ? {p}_{name} : {text}"
            yield f"case {p}_property_{walk.name}:"
            yield f"    return {text};"

    # ------------------------------------------------------------ the promise

    @cached_property
    def operations(self) -> int:
        """The largest number of operations in a step."""
        return operations(self._step, self._decide)

    @property
    def table_bytes(self) -> int:
        return sum(walk.table_bytes for walk in self.walks)

    @property
    def memory(self) -> int:
        """Bytes of NAME_monitors, as where a number of 4 bytes lies at a multiple of 4."""
        states = sum(walk.state_bytes for walk in self.walks)
        wide = any(walk.state_bytes > 1 for walk in self.walks)
        states += states % 2 if wide else 0
        return COUNTER_BYTES * (1 + len(self.walks)) + -(-states // COUNTER_BYTES) * COUNTER_BYTES

    @property
    def cost(self) -> str:
        """What all of them need."""
        return (
            f"{counted(len(self.walks), 'monitor')}: {self.table_bytes} bytes of tables, {self.memory} bytes of RAM, "
            f"at most {self.operations} operations a step"
        )

    @property
    def promise(self) -> Iterator[str]:
        """A table of all monitors, and what they need together."""
        rows: list[tuple[str, ...]] = [("property", "states", "atoms", "tables", "RAM")]
        for walk in self.walks:
            numbers = (len(walk.of.table.numbers), len(walk.of.atoms))
            sizes = (f"{walk.table_bytes} B", f"{COUNTER_BYTES + walk.state_bytes} B")
            rows.append((walk.of.line.name, *map(str, numbers), *sizes))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for first, *others in rows:
            cells = [first.ljust(widths[0]), *(c.rjust(w) for c, w in zip(others, widths[1:], strict=True))]
            yield "  ".join(cells)
        yield self.cost


_FUNCTION = re.compile(r"^static [^\n(]*?(\w+)\([^\n]*\)\n\{\n(.*?)^\}", re.MULTILINE | re.DOTALL)


def operations(lines: Sequence[str], functions: str = "") -> int:
    """Those of all lines, and of the functions that they call; `functions`: some of these."""
    text = "\n".join(lines)
    weights: dict[str, int] = {}
    for found in _FUNCTION.finditer(runtime(text) + functions):  # what a function calls comes before it
        weights[found[1]] = _counted(found[2], weights) * (_LOOP_TURNS if "for (" in found[2] else 1)
    return _counted(text, weights)


def _counted(text: str, weights: Mapping[str, int]) -> int:
    plain = re.sub(r"/\*.*?\*/", "", text).replace("(&", "(")
    return len(_OPERATOR.findall(plain)) + sum(weights.get(name, 0) for name in re.findall(r"\b(\w+)\(", plain))


def _bit(text: str, place: int) -> str:
    """A value that is moved by so many bits, without the spaces at which a line may end."""
    return f"(unsigned){text}~<<~{place}" if place else f"(unsigned){text}"


def _said(found: OnBoard) -> str:
    """A property as it is written."""
    return f"{found.line.name}: {found.line.text}"


def _indented(lines: Iterable[str]) -> str:
    return "\n".join(f"    {line}" for line in lines)


def _rows(numbers: Sequence[int]) -> Iterator[Sequence[int]]:
    return (numbers[i : i + 16] for i in range(0, len(numbers), 16))
