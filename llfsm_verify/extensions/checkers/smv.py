"""Whole arrangements as SMV models for NuSMV and nuXmv, with one state per configuration."""

from __future__ import annotations

from dataclasses import dataclass

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.checkers.flat import Flat, Identifiers, comment, fits, flatten, values_note
from llfsm_verify.extensions.checkers.formulas import NO, SMV, STOPPED, YES, fair, under
from llfsm_verify.plug import (
    BOOL,
    FALSE,
    FAULT,
    TRUE,
    Const,
    Expr,
    Formula,
    Get,
    If,
    Int,
    Ite,
    Key,
    LimitReached,
    Local,
    Op,
    OpName,
    Specification,
    SymbolicDefinitions,
    Type,
    Values,
    Var,
    all_of,
    const,
    fold,
    get,
    interval,
    ite,
    op,
    scalars,
    typed,
)


@dataclass(slots=True)
class Definitions(SymbolicDefinitions):
    """Blocks as expressions, in operations on which all checkers agree: their integers have 32 bits, and their division
    is not C's."""

    def operation(self, name: OpName, args: list[Expr], kind: Type) -> Expr:
        """Operations that checkers understand in different ways, or not at all, in terms of the plain ones."""
        match name, args:
            case "min" | "max", [a, b]:
                return ite(self.name(op("lt" if name == "min" else "gt", a, b)), a, b)
            case "abs", [a]:
                return self._absolute(a)
            case "div" | "mod", [a, b]:
                return self._divided(name, a, b)
            case "wrap", [a]:
                assert isinstance(kind, Int)
                size = const(kind.high - kind.low + 1)
                part = self.name(self._divided("mod", a, size))
                rest = self.name(ite(self.name(op("lt", part, const(0))), self.name(op("add", part, size)), part))
                high = self.name(op("gt", rest, const(kind.high)))
                return typed(ite(high, self.name(op("sub", rest, size)), rest), kind)
        return op(name, *args)

    def _absolute(self, a: Expr) -> Expr:
        bounds = interval(a)
        if bounds is not None and bounds[0] >= 0:
            return a
        positive = ite(self.name(op("lt", a, const(0))), self.name(op("neg", a)), a)
        return typed(positive, Int(0, max(abs(bounds[0]), abs(bounds[1]))) if bounds else a.type)

    def _divided(self, name: str, a: Expr, b: Expr) -> Expr:
        """Division as in C, by divisions of numbers that are not negative, on which all agree."""
        above, below = interval(a), interval(b)
        assert above is not None
        assert below is not None
        if below[0] <= 0 <= below[1]:  # a fault before this; some checkers divide all the same
            b = self.name(ite(self.name(op("eq", b, const(0))), const(1), b))
        size_a, size_b = self.name(self._absolute(a)), self.name(self._absolute(b))
        high = max(abs(above[0]), abs(above[1]))
        if isinstance(size_a, Const) and isinstance(size_b, Const):
            plain: Expr = const(size_a.value // size_b.value if name == "div" else size_a.value % size_b.value)
        else:
            plain = self.name(Op("div" if name == "div" else "mod", (size_a, size_b), Int(0, high)))
        negative = op("lt", a, const(0))
        if name == "div":
            negative = op("ne", self.name(negative), self.name(op("lt", b, const(0))))
        return ite(self.name(negative), self.name(op("neg", plain)), plain)

    def name(self, e: Expr) -> Expr:
        """The same. Raises DiagnosticError (E421) for what 32 bits do not hold."""
        if not fits(e.type):
            message = "a calculation can leave 32 bits, and the integers of this format have no more"
            hint = "declare smaller ranges, so that no intermediate value leaves them"
            raise DiagnosticError(Diagnostic("E421", message, hint=hint))
        return SymbolicDefinitions.name(self, e)


_INFIX = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "mod", "lt": "<", "le": "<=", "gt": ">", "ge": ">=",
    "and": "&", "or": "|", "xor": "xor",
}  # fmt: skip
_WORDS = (
    "fault_free", "zero", "main", "process", "MODULE", "DEFINE", "MDEFINE", "CONSTANTS", "VAR", "IVAR", "FROZENVAR",
    "INIT", "TRANS", "INVAR", "SPEC", "CTLSPEC", "LTLSPEC", "PSLSPEC", "COMPUTE", "NAME", "INVARSPEC", "FAIRNESS",
    "JUSTICE", "COMPASSION", "ISA", "ASSIGN", "CONSTRAINT", "SIMPWFF", "CTLWFF", "LTLWFF", "PSLWFF", "COMPWFF", "IN",
    "MIN", "MAX", "MIRROR", "PRED", "PREDICATES", "array", "of", "boolean", "integer", "real", "word", "word1", "bool",
    "signed", "unsigned", "extend", "resize", "sizeof", "uwconst", "swconst", "EX", "AX", "EF", "AF", "EG", "AG", "E",
    "F", "O", "G", "H", "X", "Y", "Z", "A", "U", "S", "V", "T", "BU", "EBF", "ABF", "EBG", "ABG", "case", "esac",
    "mod", "next", "init", "union", "in", "xor", "xnor", "self", "TRUE", "FALSE", "count", "abs", "max", "min",
    "toint", "clock", "at", "next_state",
)  # fmt: skip
_ZERO = "(zero - zero)"
"""What is written where the model has no number of its own."""


def smv(specification: Specification) -> str:
    """The model as text. Raises DiagnosticError (E420, E421) where its numbers do not fit SMV's, (E424) where a
    property takes too long a text."""
    return _Model(flatten(specification)).text()


class _Model:
    def __init__(self, flat: Flat) -> None:
        self._flat = flat
        self._program = flat.program
        self._spec = flat.specification
        self._cycles = self._program.observe == "cycle"
        self._faulty = flat.faulty
        self._latched = flat.latched()
        self._ids = Identifiers(*_WORDS)
        self._configuration = [v for v in flat.vars if not v.output]
        self._definitions = Definitions({v.name: v for v in flat.vars}, {c.name: c for c in self._program.choices})
        self._names: dict[Key, str] = {}
        for v in self._configuration:
            for key, _ in scalars(v):
                where = "" if key[1] is None else f"_{key[1]}"
                self._names[key] = self._ids.new("v_", v.name + where)
        for name, number in self._latched.items():
            self._names[name, None] = f"p{number}" if number is not None else self._ids.new("fair_", name)
        self._names[FAULT, None] = "fault"
        self._nil = self._difference()
        self._locals: dict[str, str] = {}
        self._by_key = {a.name: a.output for a in self._program.atoms} | {n: n for n in self._latched}
        self._weak: dict[tuple[str, bool], str] = {}
        """Literals that a fault makes true, by output and sign."""
        self._divides = False
        """Some divisor is not a literal."""

    # ------------------------------------------------------------ the step

    def _after(self) -> Values:
        """All variables and outputs after a step."""
        values = self._definitions.start()
        if self._cycles:
            self._cycle(values)
            return values
        arms: list[tuple[Expr, Values]] = []
        ended = self._ended()
        if ended != FALSE:
            stutter = Values(values)
            self._definitions.run(self._flat.stutter, stutter)
            arms.append((ended, stutter))
        acting = self._acting()
        for number, process in enumerate(self._program.processes):
            for place, slot in enumerate(process.slots):
                way = Values(values)
                self._definitions.run(self._flat.steps[slot], way)
                turn = op(
                    "eq", self._definitions.value(get(process.turn, self._type(process.turn)), values), const(place)
                )
                arms.append((self._definitions.name(op("and", op("eq", acting, const(number)), turn)), way))
        keys = dict.fromkeys(k for _, way in arms for k in way.changes if not k[0].startswith("%"))
        for key in keys:
            merged = arms[-1][1].get(key)
            for condition, way in reversed(arms[:-1]):
                mine = way.get(key)
                assert mine is not None
                assert merged is not None
                merged = mine if mine == merged else self._definitions.name(ite(condition, mine, merged))
            assert merged is not None
            values.changes[key] = merged
        return values

    def _cycle(self, values: Values) -> None:
        """A whole cycle: the ringlets one after the other, for a turn only passes to a later machine."""
        process = self._program.processes[0]
        definitions = self._definitions
        ended = self._ended()
        for place, slot in enumerate(process.slots):
            definitions.suffix = f"@{place}"
            turn = op("eq", get(process.turn, self._type(process.turn)), const(place))
            going = op("not", get(self._program.cycle, BOOL))
            fine = op("eq", get(FAULT, Int(0, len(self._program.faults))), const(0))
            when = all_of([op("not", ended), turn, going, fine])
            definitions.run((If(when, self._flat.steps[slot]),), values)
        definitions.suffix = ""
        if ended != FALSE:
            before = definitions.start()
            definitions.run((If(definitions.value(ended, before), self._flat.stutter),), values)

    def _type(self, name: str) -> Type:
        return self._definitions.variables[name].type

    def _ended(self) -> Expr:
        """Every process has ended, before the step."""
        flags = [p.ended for p in self._program.processes]
        if None in flags:
            return FALSE
        return self._definitions.value(
            all_of([get(e, BOOL) for e in flags if e is not None]), self._definitions.start()
        )

    def _acting(self) -> Expr:
        """The process that steps: the chosen one, or the first that has not ended where that has."""
        processes = self._program.processes
        if len(processes) == 1:
            return const(0)
        chosen = Local("?", Int(0, len(processes) - 1))
        start = self._definitions.start()
        live = [
            TRUE if p.ended is None else self._definitions.value(op("not", get(p.ended, BOOL)), start)
            for p in processes
        ]
        first: Expr = const(len(processes) - 1)
        for i in reversed(range(len(processes) - 1)):
            first = self._definitions.name(ite(live[i], const(i), first))
        acting = first
        for i, alive in enumerate(live):
            mine = self._definitions.name(all_of([op("eq", chosen, const(i)), alive]))
            acting = self._definitions.name(ite(mine, const(i), acting))
        return acting

    # ------------------------------------------------------------ expressions

    def _difference(self) -> str:
        """What is 0 without being a literal: the name of a number less itself.

        Before it evaluates a condition, NuSMV 2.5.4 moves operations into the branches of their arguments and computes
        those on literals. A division by a branch that is the literal 0 ends it, even where that branch is never
        taken. It does not compute a difference of variables, so none of a sum with one is a literal.
        """
        numbers = (self._names[key] for v in self._configuration for key, _ in scalars(v) if _number(v))
        name = "fault" if self._faulty else next(numbers, None)
        return _ZERO if name is None else f"({name} - {name})"

    def _declares_zero(self) -> bool:
        return self._divides and self._nil == _ZERO

    def _text(self, e: Expr, boolean: bool) -> str:
        """An expression as a Boolean, or as a number."""
        text, is_boolean = fold(e, self._node)
        if isinstance(e, Const) and boolean:
            return "TRUE" if e.value else "FALSE"
        return _as(text, is_boolean, boolean)

    def _node(self, e: Expr, args: list[tuple[str, bool]]) -> tuple[str, bool]:
        match e:
            case Const(value, kind):
                if isinstance(kind, Int) and kind.boolean:
                    return ("TRUE" if value else "FALSE"), True
                return (str(value) if value >= 0 else f"({value})"), False
            case Get(name, index, kind):
                assert index is None or isinstance(index, Const)
                key = name, None if index is None else index.value
                declared = self._type(name)
                return self._names[key], isinstance(declared, Int) and declared.boolean
            case Local(name, kind):
                return self._local(name), isinstance(kind, Int) and kind.boolean
            case Ite(_, _, _, kind):
                boolean = args[1][1] and args[2][1]
                condition = _as(*args[0], True)
                return f"({condition} ? {_as(*args[1], boolean)} : {_as(*args[2], boolean)})", boolean
            case Op(name, _, _):
                return self._operation(name, args)
        raise AssertionError(e)

    def _operation(self, name: str, args: list[tuple[str, bool]]) -> tuple[str, bool]:
        if name in ("and", "or", "xor"):
            a, b = (_as(*x, True) for x in args)
            return f"({a} {_INFIX[name]} {b})", True
        if name == "not":
            return f"(! {_as(*args[0], True)})", True
        if name in ("eq", "ne"):
            boolean = args[0][1] and args[1][1]
            a, b = (_as(*x, boolean) for x in args)
            sign = {"eq": "<->" if boolean else "=", "ne": "xor" if boolean else "!="}[name]
            return f"({a} {sign} {b})", True
        numbers = [_as(*x, False) for x in args]
        if name == "neg":
            return f"(0 - {numbers[0]})", False
        if name in ("div", "mod") and not numbers[1].isdecimal():
            self._divides = True
            numbers[1] = f"({numbers[1]} + {self._nil})"
        return f"({numbers[0]} {_INFIX[name]} {numbers[1]})", name in ("lt", "le", "gt", "ge")

    def _local(self, name: str) -> str:
        if name not in self._locals:
            if name == "?":
                self._locals[name] = "acts"
            elif name.startswith("?"):
                self._locals[name] = self._ids.new("in_", name)
            else:
                self._locals[name] = f"e{name.removeprefix('#')}"
        return self._locals[name]

    # ------------------------------------------------------------ the text

    def text(self) -> str:
        """The whole model."""
        after = self._after()
        formulas = self._formulas()
        assigned = self._assignments(after)
        defined = [
            f"  {self._local(n.name)} := {self._text(e, _boolean(n))};" for e, n in self._definitions.made.items()
        ]
        weak = [
            f"  {name} := (fault != 0) | {'' if sign else '! '}{self._names[output, None]};"
            for (output, sign), name in self._weak.items()
        ]
        return "\n".join(
            [
                *self._header(),
                "MODULE main",
                *self._declarations(),
                *(["DEFINE", *defined, *weak] if defined or weak else []),
                "ASSIGN",
                *assigned,
                *(["  init(zero) := 0;", "  next(zero) := 0;"] if self._declares_zero() else []),
                *formulas,
                "",
            ]
        )

    def _declarations(self) -> list[str]:
        lines = ["VAR"]
        for v in self._configuration:
            if not _constant(v):
                lines += [f"  {self._names[key]} : {_range(v.type)};{_note(v)}" for key, _ in scalars(v)]
        for name, number in self._latched.items():
            note = name if number is None else self._program.atoms[number].name
            lines.append(f"  {self._names[name, None]} : boolean; -- {comment(note)}")
        if self._faulty:
            lines.append(f"  fault : 0..{len(self._program.faults)}; -- the fault that ended the run:")
            for i, f in enumerate(self._program.faults):
                place = f"{f.span}: " if f.span else ""
                lines.append(f"  --   {i + 1} = {f.code} {comment(place + f.message)}")
        if self._declares_zero():
            lines.append("  zero : 0..1; -- always 0")
        lines.append("IVAR")
        for local, choice in self._definitions.sampled.items():
            lines.append(f"  {self._local(local)} : {_range(choice.type)}; -- {comment(choice.name)}")
        if len(self._program.processes) > 1:
            names = ", ".join(f"{i} = {p.name}" for i, p in enumerate(self._program.processes))
            lines.append(f"  acts : 0..{len(self._program.processes) - 1}; -- the process that takes the step: {names}")
        if lines[-1] == "IVAR":
            lines.pop()
        return lines

    def _assignments(self, after: Values) -> list[str]:
        lines = []
        fault = after.get((FAULT, None))
        assert fault is not None
        stops = "(fault != 0) | " + _as(self._text(op("ne", fault, const(0)), True), True, True) if self._faulty else ""
        for v in self._configuration:
            if _constant(v):
                continue
            assert isinstance(v.type, Int)
            for key, init in scalars(v):
                first = self._text(Const(init, v.type), v.type.boolean)
                now = after.get(key)
                assert now is not None
                text = self._text(now, v.type.boolean)
                if not v.free:
                    lines.append(f"  init({self._names[key]}) := {first};")
                step = f"({stops}) ? {first} : {text}" if stops else text
                lines.append(f"  next({self._names[key]}) := {step};")
        for name, number in self._latched.items():
            first = "FALSE" if number is None else self._first(self._program.atoms[number].expression)
            now = after.get((name, None))
            assert now is not None
            text = self._text(now, True)
            lines.append(f"  init({self._names[name, None]}) := {first};")
            lines.append(f"  next({self._names[name, None]}) := {f'({stops}) ? FALSE : {text}' if stops else text};")
        if self._faulty:
            lines.append("  init(fault) := 0;")
            lines.append(f"  next(fault) := (fault != 0) ? fault : {self._text(fault, False)};")
        return lines

    def _first(self, e: Expr) -> str:
        """An atom in c0, over the initial configuration, with inputs at their `init`."""
        start = self._definitions.start()
        inputs: dict[Key, Expr] = {("%input:" + i.name, None): Const(i.init, i.type) for i in self._program.inputs}
        return self._text(self._definitions.value(e, Values(start, inputs)), True)

    # ------------------------------------------------------------ formulas

    def _formulas(self) -> list[str]:
        if not self._spec.observed:
            return ["INVARSPEC NAME fault_free := fault = 0;"] if self._faulty else []
        lines = [
            f"JUSTICE {self._names[c.goal, None]}{' | (fault != 0)' if self._faulty else ''}; -- {comment(c.name)}"
            for c in self._program.fairness
            if c.premise is None
        ]
        if self._faulty:
            lines.append("INVARSPEC NAME fault_free := fault = 0;")
        for name, formula in self._spec.goals:
            try:
                text = SMV.text(self._complete(formula), self._proposition)
            except LimitReached as limit:
                hint = "split it into smaller properties"
                raise DiagnosticError(Diagnostic("E424", f"`{name}`: {limit}", hint=hint)) from None
            lines += [f"-- {comment(str(formula))}", f"LTLSPEC NAME {self._ids.new('', name)} := {text};"]
        return lines

    def _complete(self, formula: Formula) -> Formula:
        """A goal under the assumptions and the fairness that JUSTICE cannot say, on runs that a fault may cut off."""
        demands = [fair(c.premise, c.goal) for c in self._program.fairness if c.premise is not None]
        return under(formula, [f for _, f in self._spec.assumptions], demands, faulty=self._faulty)

    def _proposition(self, key: str) -> str:
        if key == STOPPED.key:
            return "(fault != 0)"
        for mark, sign in ((YES, True), (NO, False)):
            if key.startswith(mark):
                output = self._by_key[key.removeprefix(mark)]
                name = self._names[output, None]
                return self._weak.setdefault((output, sign), f"{'is' if sign else 'not'}_{name}")
        return self._names[self._by_key[key], None]

    def _header(self) -> list[str]:
        lines = [f"-- The arrangement {comment(self._program.name)}, written by llfsm kripke."]
        if self._spec.observed:
            lines.append("-- NuSMV FILE checks every LTLSPEC.")
            names = ", ".join(comment(name) for name, _ in self._spec.assumptions)
            lines += [f"-- Assumed: {names}."] if names else []
        else:
            lines.append("-- NuSMV -r FILE counts the reachable states: one per configuration.")
        if self._divides:
            lines.append(
                f"-- A divisor plus {self._nil} is that divisor, but NuSMV does not compute with its branches."
            )
        if self._faulty:
            lines.append(
                "-- A fault leads to a state that is not left, the initial one with `fault` set: when faults can"
            )
            lines.append(
                "-- happen (INVARSPEC fault_free is false), each value of `fault` is one reachable state more."
            )
        return lines


def _number(v: Var) -> bool:
    return isinstance(v.type, Int) and not v.type.boolean and not _constant(v)


def _constant(v: Var) -> bool:
    return isinstance(v.type, Int) and v.type.low == v.type.high


def _boolean(local: Local) -> bool:
    return isinstance(local.type, Int) and local.type.boolean


def _as(text: str, is_boolean: bool, boolean: bool) -> str:
    """A text of one kind as the other: false is 0, true is 1."""
    if is_boolean == boolean:
        return text
    return f"({text} ? 1 : 0)" if is_boolean else f"({text} = 1)"


def _range(t: Type) -> str:
    assert isinstance(t, Int)
    return "boolean" if t.boolean else f"{t.low}..{t.high}"


def _note(v: Var) -> str:
    note = values_note(v)
    return f" -- {comment(note)}" if note else ""
