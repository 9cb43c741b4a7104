"""A step program of one process as C99: a header and a source, with a function for each state."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from dataclasses import field as with_default

from llfsm_verify.extensions.c.blocks import BlockText, comment, has_code, titled
from llfsm_verify.extensions.c.monitors import Monitors
from llfsm_verify.extensions.c.names import EVENTS, Field, Names, identifier
from llfsm_verify.extensions.c.numbers import bits_of, stored_as, written
from llfsm_verify.extensions.c.small import stores_cycle, unchecked
from llfsm_verify.extensions.c.texts import runtime, wrapped
from llfsm_verify.plug import (
    OPERATOR,
    Arrangement,
    Block,
    EventKind,
    Int,
    Process,
    Program,
    Slot,
    Span,
    Type,
    Value,
    element_names,
    starting_values,
    value_text,
)

MARK = "Written by `llfsm build`; do not edit."
OK, ENDED, OVERFLOW, BAD_INPUT, CORRUPT = "OK", "ENDED", "OVERFLOW", "BAD_INPUT", "CORRUPT"
STATUSES = {
    OK: (0, "the ringlet, or the cycle, is complete"),
    ENDED: (-1, "all machines have finished"),
    OVERFLOW: (-2, "an `int` would have left 64 bits"),
    BAD_INPUT: (-3, "an input is outside its range; nothing has changed, and the next call may be better"),
    CORRUPT: (-4, "the state names no state of a machine"),
}


SMALL = 3
"""Stores that stand where they are done, and are no function."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a program does not say of its arrangement: its outputs, their safe values, names of enumerations by their
    values, where it came from, where its names are declared, what its state counts, and all of it."""

    outputs: Collection[str] = ()
    safe: Mapping[str, Value] = with_default(default_factory=dict)
    enumerations: Mapping[tuple[str, ...], str] = with_default(default_factory=dict)
    source: str = ""
    places: Mapping[str, Span] = with_default(default_factory=dict)
    counted: tuple[EventKind, ...] = ()
    arrangement: Arrangement | None = None
    small: bool = False
    """Whether its size counts for more than its speed."""


@dataclass(frozen=True, slots=True)
class _Function:
    """A function for a block: its text, and how it is called."""

    name: str
    text: str
    arguments: str
    fails: bool


class Image:
    """The C of one program. ValueError: it has several processes. DiagnosticError (E504): see `Names`."""

    def __init__(self, program: Program, meaning: Meaning | None = None) -> None:
        if len(program.processes) != 1:
            raise ValueError("an image has one process")
        self.program = program
        self.meaning = meaning or Meaning()
        given = self.meaning
        self.names = Names(program, given.outputs, given.enumerations, given.places, given.counted)
        self.prefix = self.names.prefix
        self.monitors: Monitors | None = None
        """Those that go with it."""
        self.recorded = program
        """Without what only monitors read."""
        self._functions: list[_Function] = []

    # ------------------------------------------------------------ the header

    def header(self) -> str:
        """NAME.h."""
        p, guard = self.prefix, f"{self.prefix.upper()}_H"
        free = any(v.free for v in self.program.vars)
        parts = [
            comment(titled(self.program.name, MARK)),
            *([comment(f"From {self.meaning.source}.")] if self.meaning.source else []),
            f"#ifndef {guard}\n#define {guard}\n\n#include <stdbool.h>\n#include <stddef.h>\n#include <stdint.h>\n",
            '#ifdef __cplusplus\nextern "C" {\n#endif\n',
            f"{comment('Of the structs below; ' + p + '_layout() tells that of the compiled source.')}",
            f"#define {p}_LAYOUT UINT32_C(0x{self.layout():08x})",
            *self._period(),
            "",
            *self._statuses(),
            *self._enumerations(),
            *self._inputs(),
            *self._state(),
            comment("The beginning. " + ("Inputs that never change may be stored after it, in their ranges." * free)),
            f"void {p}_init({p}_state *state);\n",
            comment("What inputs are before somebody gives them, and no commands."),
            f"void {p}_first({p}_inputs *inputs);\n",
            comment("One ringlet: that of the machine whose turn it is."),
            f"{p}_status {p}_step({p}_state *state, const {p}_inputs *inputs);\n",
            comment("The ringlets of a cycle, with the inputs held."),
            f"{p}_status {p}_cycle({p}_state *state, const {p}_inputs *inputs);\n",
            comment(
                "Outputs that have safe values get them, as after a fault. Where there was none, steps may follow."
            ),
            f"void {p}_safe({p}_state *state);\n",
            f"uint32_t {p}_layout(void);\n",
            "#ifdef __cplusplus\n}\n#endif\n\n#endif",
        ]
        return wrapped("\n".join(parts))

    def _period(self) -> Iterator[str]:
        if self.program.period is not None:
            period = self.program.period * 1_000_000
            yield comment("Nanoseconds of a cycle. Clocks count cycles and stop at their bounds: nothing wraps around.")
            yield f"#define {self.prefix}_PERIOD_NS {written(int(period), 'uint64_t')}"

    @property
    def status_type(self) -> str:
        """That of NAME_status."""
        count = len(self.program.faults)
        if self.meaning.small and count < 1 << 7:
            return "int8_t"
        return "int16_t" if count < 1 << 15 else "int32_t"

    def _statuses(self) -> Iterator[str]:
        yield f"typedef {self.status_type} {self.prefix}_status;"
        for name, (value, about) in STATUSES.items():
            yield f"#define {self.prefix}_{name} {written(value, 'int16_t')} {comment(about)}"
        if self.program.faults:
            yield comment("Faults:")
        left_out = unchecked(self.program) if self.meaning.small else frozenset()
        for number, site in enumerate(self.program.faults, 1):
            where = "" if site.span is None else f"{site.span}: "
            note = " (no step meets it: it is not checked)" * (number - 1 in left_out)
            yield comment(f"{number}: {where}{site.code} {site.message}{note}")
        yield ""

    def _enumerations(self) -> Iterator[str]:
        for name, labels in self.names.enumerations.items():
            yield "typedef enum {\n" + ",\n".join(f"    {label}" for label in labels) + f"\n}} {name};\n"

    def _inputs(self) -> Iterator[str]:
        yield "typedef struct {"
        for choice in self.program.choices:
            entered = choice.name.removeprefix(f"{OPERATOR}state(").rstrip(")")
            kind = self.names.enumeration(f"{entered}.$state", choice.labels)
            about = _about(choice.type, choice.labels, kind)
            about += f" {comment('of an operator: for one cycle')}" * choice.name.startswith(OPERATOR)
            yield f"    {stored_as(choice.type)} {self.names.inputs[choice.name]};{about}"
        if not self.program.choices:
            yield "    uint8_t none; /* there are no inputs */"
        yield f"}} {self.prefix}_inputs;\n"

    def _state(self) -> Iterator[str]:
        groups: dict[str, list[Field]] = {}
        for field in self.names.fields.values():
            groups.setdefault(field.group, []).append(field)
        if "outputs" in groups:
            yield f"typedef struct {{\n{self._members(groups['outputs'], 1)}\n}} {self.prefix}_outputs;\n"
        yield "typedef struct {"
        for group, fields in groups.items():
            if group == "outputs":
                yield f"    {self.prefix}_outputs outputs;"
            else:
                yield f"    struct {{\n{self._members(fields, 2)}\n    }} {group};"
        if self.names.counted:
            about = comment(f"how often each has happened: {', '.join(self.names.counted)}")
            yield f"    uint64_t {EVENTS}[{len(self.names.counted)}]; {about}"
        yield f"    {self.prefix}_status status;\n}} {self.prefix}_state;\n"

    def _members(self, fields: Sequence[Field], depth: int) -> str:
        lines = []
        for field in fields:
            var = field.var
            size = "" if var.length is None else f"[{var.length}]"
            kind = self.names.enumeration(var.name, var.origin.labels)
            about = _about(var.type, var.origin.labels, kind)
            if var.length is not None and var.origin.pattern:
                first, last = element_names(var)[0], element_names(var)[-1]
                about += " " + comment(f"{first} to {last}")
            lines.append(f"{'    ' * depth}{field.type} {field.name}{size};{about}")
        return "\n".join(lines)

    def layout(self) -> int:
        """A number that is another one where a struct is."""
        fields = [f"{f.path} {f.type} {f.var.length} {f.var.type}" for f in self.names.fields.values()]
        inputs = [f"{self.names.inputs[c.name]} {stored_as(c.type)} {c.type}" for c in self.program.choices]
        text = "\n".join([self.prefix, *fields, *self.names.counted, self.status_type, "", *inputs])
        return int.from_bytes(hashlib.sha256(text.encode()).digest()[:4], "big")

    # ------------------------------------------------------------ the source

    def source(self) -> str:
        """NAME.c."""
        p = self.prefix
        self._functions.clear()
        step = self._step()
        parts = [
            comment(titled(self.program.name, MARK)),
            f'#include "{p}.h"\n',
            runtime("".join(f.text for f in self._functions)),
            *(f.text for f in self._functions),
            self._init(),
            self._first(),
            self._safe(),
            f"uint32_t {p}_layout(void)\n{{\n    return {p}_LAYOUT;\n}}\n",
            step,
            self._cycle(),
        ]
        return wrapped("\n".join(part for part in parts if part).replace("\n\n\n", "\n\n"))

    def _function(self, name: str, lines: Sequence[str], about: str = "") -> _Function | None:
        """A function with this body, which may end with a status; None: it does nothing."""
        if not has_code(lines):
            return None
        name, text, p = self.names.private(name), "\n".join(lines), self.prefix
        fails = any(line.lstrip().startswith("return ") for line in lines)
        used = [n for n in ("state", "inputs") if f"{n}->" in text or f"({n}" in text or f", {n})" in text]
        parameters = {"state": f"{p}_state *state", "inputs": f"const {p}_inputs *inputs"}
        head = f"static {p + '_status' if fails else 'void'} {name}({', '.join(parameters[n] for n in used) or 'void'})"
        body = [f"    {line}" for line in lines] + ([f"    return {p}_{OK};"] if fails else [])
        told = [comment(about)] if about else []
        made = _Function(name, "\n".join([*told, head, "{", *body, "}", ""]), ", ".join(used), fails)
        self._functions.append(made)
        return made

    def _call(self, function: _Function | None) -> list[str]:
        """Lines that call it, where it is."""
        if function is None:
            return []
        call = f"{function.name}({function.arguments})"
        if not function.fails:
            return [f"{call};"]
        return [f"status = {call};", f"if (status != {self.prefix}_{OK}) {{", "    return status;", "}"]

    def _of(self, name: str, block: Block, about: str = "") -> list[str]:
        """Lines that call a function for a block, or those of one that is too small for a function."""
        lines = BlockText(self.names).text(block)
        if not about and len(lines) <= SMALL and all(re.match(r"state->.*;$", line) for line in lines):
            return lines
        return self._call(self._function(name, lines, about))

    def _slot(self, slot: Slot, end: Sequence[str], letter: Sequence[str]) -> list[str]:
        """Lines that call the ringlet of a machine, whose state is one."""
        machine, short = self.program.machines[slot.machine], identifier(self.program.machines[slot.machine].name)
        lines = self._of(f"begin_{short}", slot.prologue)
        field = self.names.fields[slot.state]
        cases = []
        for number, block in enumerate(slot.blocks):
            name = self.names.value_name(slot.state, number) or str(number)
            state = identifier(machine.states[number])
            cases.append((name, self._of(f"in_{short}_{state}", block, f"{machine.name} in {machine.states[number]}")))
        lines += _switch(f"state->{field.path}", cases)
        lines += [*self._of(f"end_{short}", slot.epilogue), *end, *self._of(f"forget_{short}", slot.canonical), *letter]
        return self._call(self._function(f"run_{short}", _declared(lines, self.prefix), f"A ringlet of {machine.name}"))

    def _step(self) -> str:
        """The function of a step, after those that it calls."""
        program, p = self.program, self.prefix
        (process,) = program.processes
        end = self._of("after_ringlet", process.epilogue, "What follows a ringlet")
        letter = self._of("observe", program.letter)
        turn = self.names.fields[process.turn]
        slots = [self._slot(program.slots[i], end, letter) for i in process.slots]
        lines = self._reset()
        lines += _switch(f"state->{turn.path}", [(str(number), called) for number, called in enumerate(slots)])
        ringlet = self._function("ringlet", _declared(lines, p))
        body = [f"if (state->status != {p}_{OK}) {{", "    return state->status;", "}"]
        if process.ended is not None:
            body += [f"if (state->{self.names.fields[process.ended].path}) {{", f"    return {p}_{ENDED};", "}"]
        body += self._input_checks()
        body += self._corruption(process)
        declared: list[str] = []
        if ringlet is None or not ringlet.fails:
            body += [*self._call(ringlet), f"return {p}_{OK};"]
        else:
            declared = [f"{p}_status status;", f"{p}_state before;"]
            body += ["before = *state;", f"status = {ringlet.name}({ringlet.arguments});"]
            body += [f"if (status != {p}_{OK}) {{", "    *state = before;", "    state->status = status;"]
            body += [f"    {p}_safe(state);", "}", "return status;"]
        unused = [] if any(re.search(r"\binputs(->|\))", line) for line in body) else ["(void)inputs;"]
        return self._public(
            f"{p}_status {p}_step({p}_state *state, const {p}_inputs *inputs)", declared + unused + body
        )

    def _corruption(self, process: Process) -> Iterator[str]:
        """A state that names no state of a machine, or no machine, is left as it is but for safe values."""
        counts = {process.turn: len(process.slots)}
        counts |= {slot.state: len(slot.blocks) for slot in (self.program.slots[i] for i in process.slots)}
        conditions: list[str] = []
        for field, count in ((self.names.fields[name], count) for name, count in counts.items()):
            assert field.var.length is None
            conditions += _outside(f"state->{field.path}", field.type, Int(0, count - 1))
        if conditions:
            yield "if (" + "\n        || ".join(conditions) + ") {"
            yield f"    state->status = {self.prefix}_{CORRUPT};"
            yield f"    {self.prefix}_safe(state);"
            yield f"    return {self.prefix}_{CORRUPT};"
            yield "}"

    def _reset(self) -> list[str]:
        """Outputs of a step get their first values, where it begins another letter."""
        program = self.program
        lines = []
        stored = {program.cycle} if self.meaning.small and stores_cycle(program) else set[str]()
        for field in (self.names.fields[v.name] for v in program.vars if v.output and v.name not in stored):
            lines += _filled(f"state->{field.path}", field, field.var.init)
        if program.observe == "ringlet" or not lines:
            return lines
        cycle = self.names.fields[program.cycle].path
        return [f"if (state->{cycle}) {{", *(f"    {line}" for line in lines), "}"]

    def _input_checks(self) -> Iterator[str]:
        """An input whose type has more values than it is refused outside its range, and so is what a caller stored."""
        given: list[tuple[str, str, Type]] = []
        given += [(f"inputs->{self.names.inputs[c.name]}", stored_as(c.type), c.type) for c in self.program.choices]
        free = [field for field in self.names.fields.values() if field.var.free]
        given += [(f"state->{f.path}", f.type, f.var.type) for f in free if f.var.length is None]
        conditions = [condition for name, kind, of in given for condition in _outside(name, kind, of)]
        yield from self._refused(conditions)
        for field in free:
            outside = list(_outside(f"state->{field.path}[i]", field.type, field.var.type))
            if field.var.length is not None and outside:
                yield f"for (size_t i = 0; i < {field.var.length}; i++) {{"
                yield from (f"    {line}" for line in self._refused(outside))
                yield "}"

    def _refused(self, conditions: Sequence[str]) -> Iterator[str]:
        """Lines that refuse inputs where one of these is true."""
        if conditions:
            yield "if (" + "\n        || ".join(conditions) + ") {"
            yield f"    return {self.prefix}_{BAD_INPUT};"
            yield "}"

    def _public(self, head: str, lines: Sequence[str]) -> str:
        return "\n".join([head, "{", *(f"    {line}" for line in lines), "}", ""])

    def _init(self) -> str:
        lines = []
        for field in self.names.fields.values():
            first = 1 if field.var.name == self.program.cycle else field.var.init
            lines += _filled(f"state->{field.path}", field, first, self.names)
        lines += [f"state->{EVENTS}[{i}] = 0;" for i in range(len(self.names.counted))]
        lines.append(f"state->status = {self.prefix}_{OK};")
        return self._public(f"void {self.prefix}_init({self.prefix}_state *state)", lines)

    def _first(self) -> str:
        values = starting_values(self.program)
        lines = [
            f"inputs->{self.names.inputs[c.name]} = {written(values.get(c.name, c.type.low), stored_as(c.type))};"
            for c in self.program.choices
        ]
        p = self.prefix
        return self._public(f"void {p}_first({p}_inputs *inputs)", lines or ["inputs->none = 0;"])

    def _safe(self) -> str:
        lines = []
        for name, value in self.meaning.safe.items():
            lines += _filled(f"state->{self.names.fields[name].path}", self.names.fields[name], value, self.names)
        return self._public(f"void {self.prefix}_safe({self.prefix}_state *state)", lines or ["(void)state;"])

    def _cycle(self) -> str:
        p, cycle = self.prefix, self.names.fields[self.program.cycle].path
        lines = [f"{p}_status status;", "do {", f"    status = {p}_step(state, inputs);"]
        lines += [f"}} while (status == {p}_{OK} && !state->{cycle});", "return status;"]
        return self._public(f"{p}_status {p}_cycle({p}_state *state, const {p}_inputs *inputs)", lines)


def _declared(lines: list[str], prefix: str) -> list[str]:
    """The lines after the declaration of the status, where they use one."""
    return [f"{prefix}_status status;", *lines] if any("status = " in line for line in lines) else lines


def _outside(name: str, kind: str, of: Type) -> Iterator[str]:
    """Conditions of C for a stored value that its type does not have."""
    if kind == "bool" or not isinstance(of, Int):
        return
    bits = bits_of(kind)
    least, most = (0, (1 << bits) - 1) if kind[0] == "u" else (-(1 << bits - 1), (1 << bits - 1) - 1)
    if of.low > least:
        yield f"{name} < {written(of.low, kind)}"
    if of.high < most:
        yield f"{name} > {written(of.high, kind)}"


def _switch(path: str, cases: Sequence[tuple[str, Sequence[str]]]) -> Iterator[str]:
    """Lines that choose by a value that is one of these: the last is for all others."""
    *others, (last, lines) = cases
    if not others:
        yield from lines
        return
    yield f"switch ({path}) {{"
    for name, found in others:
        yield from (f"case {name}:", *(f"    {line}" for line in found), "    break;")
    yield from (f"default: {comment(last)}", *(f"    {line}" for line in lines), "    break;", "}")


def _filled(path: str, field: Field, value: Value, names: Names | None = None) -> list[str]:
    """Lines that store a whole variable."""
    if isinstance(value, tuple):
        return [f"{path}[{i}] = {written(number, field.type)};" for i, number in enumerate(value)]
    name = None if names is None else names.value_name(field.var.name, value)
    return [f"{path} = {name or written(value, field.type)};"]


def _about(kind: Type, labels: tuple[str, ...], enumeration: str) -> str:
    """The comment on a member: what its numbers mean."""
    if enumeration:
        return f" {comment(enumeration)}"
    if not isinstance(kind, Int) or kind.boolean or labels:
        return ""
    said = f"{kind.low}..{kind.high}"
    if kind.digits:
        said += f", the values {value_text(kind, (), kind.low)}..{value_text(kind, (), kind.high)}"
    return f" {comment(said)}"
