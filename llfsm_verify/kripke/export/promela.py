"""Whole arrangements as Promela models for SPIN, with one stored state per configuration."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from textwrap import indent

from llfsm_verify.automata.automaton import AutomatonTooLarge
from llfsm_verify.automata.translate import translate
from llfsm_verify.backends.layout import Value
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.kripke.export.claims import never_claim
from llfsm_verify.kripke.export.flat import (
    FAULT,
    Flat,
    Identifiers,
    Specification,
    comment,
    expressions,
    flatten,
    fold,
    nodes,
    parts,
    statements,
    stopping,
    values_note,
)
from llfsm_verify.kripke.export.formulas import (
    NO,
    PROMELA,
    STARTED,
    STOPPED,
    YES,
    fair,
    has_next,
    weakened,
)
from llfsm_verify.logic.formula import Formula, apply, conjunction, negation, size
from llfsm_verify.semantics.program import (
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
)

ROUND = "$round"
"""The output that holds when all fairness goals have come about once more."""
READABLE = 20
"""Subformulas up to which SPIN's own translation is quick."""
LISTED = 16
"""A choice of at most so many values is a list of them; a wider one counts up."""
STATE_VECTOR = 1000
"""Bytes of SPIN's state vector from which on its compiler must be told (it assumes 1024)."""

_INFIX = {
    "add": "+", "sub": "-", "mul": "*", "div": "/", "mod": "%", "eq": "==", "ne": "!=", "lt": "<", "le": "<=",
    "gt": ">", "ge": ">=", "and": "&&", "or": "||", "xor": "!=",
}  # fmt: skip
_BYTES = {"bool": 1, "byte": 1, "short": 2, "int": 4}


def promela(specification: Specification) -> str:
    """The model as text. Raises DiagnosticError (E420, E421) where its numbers do not fit Promela's."""
    return _Model(flatten(specification)).text()


def _storage(low: int, high: int, boolean: bool = False) -> str:
    """The smallest type that holds 0 (what cleared variables have) and low … high."""
    if boolean:
        return "bool"
    if low >= 0 and high <= 255:
        return "byte"
    return "short" if low >= -(1 << 15) and high < 1 << 15 else "int"


def _type_of(t: Type) -> str:
    assert isinstance(t, Int)
    return _storage(t.low, t.high, t.boolean)


@dataclass(slots=True)
class _Scratch:
    """A variable that only lives inside a step: the widest of its types, and by step the places that use it."""

    low: int
    high: int
    boolean: bool
    places: dict[int, set[int]] = field(default_factory=dict)

    @property
    def kept(self) -> bool:
        """It carries a value from one transition of the model to the next, so SPIN must store it."""
        return any(len(p) > 1 for p in self.places.values())


class _Model:
    """Writes one model. Steps are written first; what they used is declared above them afterwards."""

    def __init__(self, flat: Flat) -> None:
        self._flat = flat
        self._program = flat.program
        self._spec = flat.specification
        self._checked = self._spec.observed
        self._cycles = self._program.observe == "cycle"
        self._faulty = flat.faulty
        self._ids = Identifiers(*_WORDS)
        self._latched = flat.latched()
        goals = [c.goal for c in self._program.fairness if c.premise is None] if self._checked else []
        self._rounds = tuple(goals) if len(goals) > 1 else ()
        """Fairness goals that the model waits for in turn: SPIN translates many of them together in minutes."""
        if self._rounds:
            self._latched = {n: i for n, i in self._latched.items() if n not in self._rounds} | {ROUND: None}
        self._outputs = [v for v in flat.vars if v.output and v.name not in self._latched]
        self._configuration = [v for v in flat.vars if not v.output]
        self._names = {v.name: self._ids.new("v_", v.name) for v in flat.vars if v.name not in self._latched}
        self._names[FAULT] = "fault"
        for name, number in self._latched.items():
            self._names[name] = f"p{number}" if number is not None else self._ids.new("fair_", name)
        self._shifts = {v.name: shift for v in flat.vars if (shift := _shift(v))}
        """What is added to the elements of an array when they are stored."""
        self._names[ROUND] = "fair"
        self._by_key = {a.name: a.output for a in self._program.atoms} | {
            n: n for n, i in self._latched.items() if i is None
        }
        self._negated: dict[str, str] = {}
        """Outputs of the letter that the formulas need negated too: a fault makes both true (`formulas.weakened`)."""
        self._choices = {c.name: c for c in self._program.choices}
        self._picked: dict[str, str] = {}
        self._repeated: set[str] = set()
        """Choices that remember whether they have been made in this step."""
        self._locals: dict[str, str] = {}
        self._scratch: dict[str, _Scratch] = {}
        self._aliases = _aliases([*flat.steps, flat.stutter])
        self._step = self._place = 0
        self._free = [v for v in self._configuration if v.free]
        self._whole = [self._complete(f) for _, f in self._spec.goals]
        self._ticks = not all(map(_readable, self._whole))
        self._starts = self._checked and bool(self._free)

    # ------------------------------------------------------------ expressions

    def _expr(self, root: Expr) -> str:
        return fold(root, self._node)

    def _node(self, e: Expr, args: list[str]) -> str:
        match e:
            case Const(value, _):
                return str(value) if value >= 0 else f"({value})" if value > -(1 << 31) else "(-2147483647 - 1)"
            case Get(name, index, _):
                if index is None:
                    return self._names[name]
                shift = self._shifts.get(name, 0)
                return f"({self._names[name]}[{args[0]}] - {shift})" if shift else f"{self._names[name]}[{args[0]}]"
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
        if name in self._aliases:
            return self._choice(self._aliases[name])
        if name not in self._locals:
            self._locals[name] = self._ids.new("l_", name)
        return self._locals[name]

    def _use(self, local: Local) -> None:
        """This place of the model reads or writes the local."""
        if local.name in self._aliases:
            return
        kind = local.type
        assert isinstance(kind, Int)
        found = self._scratch.setdefault(local.name, _Scratch(kind.low, kind.high, kind.boolean))
        found.low, found.high = min(found.low, kind.low), max(found.high, kind.high)
        found.boolean = found.boolean and kind.boolean
        found.places.setdefault(self._step, set()).add(self._place)

    def _uses(self, e: Expr) -> None:
        for node in nodes(e):
            if isinstance(node, Local):
                self._use(node)

    def _choice(self, name: str) -> str:
        if name not in self._picked:
            self._picked[name] = self._ids.new("in_", name)
        return self._picked[name]

    # ------------------------------------------------------------ statements in one indivisible step

    def _plain(self, block: Block) -> str:
        """Statements without a choice, for the inside of a d_step."""
        return ";\n".join(self._plain_statement(s) for s in block) or "skip"

    def _plain_statement(self, s: Stmt) -> str:
        for e in expressions(s):
            self._uses(e)
        match s:
            case Set(name, index, value):
                where = "" if index is None else f"[{self._expr(index)}]"
                shift = f" + {self._shifts[name]}" if name in self._shifts else ""
                text = f"{self._names[name]}{where} = {self._expr(value)}{shift}"
                if name in self._negated:
                    text += f";\n{self._negated[name]} = !{self._names[name]}"
                return f"{text};\n{self._next_round()}" if self._rounds and name == self._rounds[-1] else text
            case Let(local, value):
                self._use(local)
                return f"{self._local(local.name)} = {self._expr(value)}"
            case If(condition, then, otherwise):
                return _if([(self._expr(condition), self._plain(then))], self._plain(otherwise))
            case Switch(value, cases, default):
                chosen = self._expr(value)
                arms = [(f"({chosen} == {k})", self._plain(block)) for k, block in cases]
                return _if(arms, self._plain(default))
        raise AssertionError(s)

    def _next_round(self) -> str:
        """The next fairness goal is waited for; behind the last one a round is complete (degeneralization)."""
        goals = [self._names[goal] for goal in self._rounds]
        waits = [_if([(f"(waiting == {i} && {goal})", f"waiting = {i + 1}")], "skip") for i, goal in enumerate(goals)]
        complete = _if([(f"(waiting == {len(goals)})", "waiting = 0;\nfair = true")], "fair = false")
        return ";\n".join([*waits, complete])

    # ------------------------------------------------------------ statements with choices among them

    def _block(self, block: Block, may: set[str], must: set[str], start: str = "", end: str = "") -> list[str]:
        """Statements of which some choose, between `start` and `end`, as few transitions.

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
                pieces.append(_d_step(texts))
            plain.clear()
            texts.clear()

        if self._ticks and "tick" in start:
            flush()  # some state must show that a step is under way
        for s in block:
            if not any(isinstance(inner, Sample) for inner in statements((s,))):
                plain.append(s)
                continue
            if isinstance(s, Sample):
                if s.choice not in must:
                    flush()
                    pieces.append(self._sample(self._choices[s.choice], may, must))
                if s.local.name not in self._aliases:
                    self._names[s.choice] = self._choice(s.choice)
                    plain.append(Let(s.local, Get(s.choice, None, s.local.type)))
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
            guards = [self._expr(s.condition)]
        else:
            assert isinstance(s, Switch)
            chosen = self._expr(s.value)
            guards = [f"({chosen} == {k})" for k, _ in s.cases]
        texts: list[str] = []
        before, ways = (set(may), set(must)), []
        for inner in parts(s):
            way = set(before[0]), set(before[1])
            texts.append(";\n".join(self._block(inner, *way)) or "skip")
            ways.append(way)
        may |= set().union(*(w[0] for w in ways))
        must |= set.intersection(*(w[1] for w in ways))
        return _if(list(zip(guards, texts[:-1], strict=True)), texts[-1])

    def _sample(self, choice: Choice, may: set[str], must: set[str]) -> str:
        """Make a choice, unless this step has made it already."""
        variable = self._choice(choice.name)
        pick = _pick(variable, choice.type.low, choice.type.high)
        if choice.name in may:
            self._repeated.add(choice.name)
        if choice.name in self._repeated:
            pick = f"{pick};\nmade_{variable} = true"
        if choice.name in may:
            pick = _if([(f"made_{variable}", "skip")], pick)
        may.add(choice.name)
        must.add(choice.name)
        return pick

    # ------------------------------------------------------------ the loop

    def text(self) -> str:
        """The whole model."""
        formulas = self._formulas()  # finds out which atoms are needed negated
        self._loop()  # finds out which choices can be repeated
        self._scratch.clear()
        loop = self._loop()
        finish = self._finish()
        return "\n".join(
            [
                *self._header(),
                "",
                *self._declarations(),
                "",
                *finish,
                "",
                "active proctype arrangement() {",
                "  do",
                *(indent(option, "  ") for option in loop),
                "  od",
                "}",
                *formulas,
                "",
            ]
        )

    def _loop(self) -> list[str]:
        options = []
        if self._free:
            options.append(self._roots())
        for process, _ in enumerate(self._program.processes):
            options += self._process(process)
        ended = [p.ended for p in self._program.processes]
        if None not in ended:
            guard = self._guard([f"{self._names[e]}" for e in ended if e is not None])
            self._step += 1
            options.append(
                self._option(
                    "every process has ended", self._block(self._flat.stutter, set(), set(), guard, "finish()")
                )
            )
        if self._checked and self._faulty:
            body = (
                ["d_step {\n  (fault != 0) ->\n  tick = false\n}", "tick = true"] if self._ticks else ["(fault != 0)"]
            )
            options.append(self._option("a fault has ended the run", body))
        return options

    def _guard(self, conditions: list[str]) -> str:
        if self._checked and self._faulty:
            conditions = [*conditions, "fault == 0"]
        if self._starts:
            conditions = [*conditions, "started"]
        guard = f"({' && '.join(conditions) or 'true'})"
        return f"{guard} ->\ntick = false" if self._ticks else guard

    def _option(self, title: str, pieces: list[str]) -> str:
        text = ";\n".join(pieces)
        if not self._checked and len(pieces) > 1:
            text = f"atomic {{\n{indent(text, '  ')}\n}}"
        return f":: /* {comment(title)} */\n{indent(text, '   ')}"

    def _process(self, number: int) -> list[str]:
        process = self._program.processes[number]
        live = [] if process.ended is None else [f"!{self._names[process.ended]}"]
        turn = self._names[process.turn]
        arms = []
        for place, slot in enumerate(process.slots):
            name = self._program.machines[self._program.slots[slot].machine].name
            step = stopping(self._flat.steps[slot])
            self._step += 1
            if self._cycles:
                fine = ["fault == 0"] if self._faulty else []
                guard = " && ".join([f"{turn} == {place}", f"!{self._names[self._program.cycle]}", *fine])
                text = ";\n".join(self._block(step, set(), set(), f"({guard})", "clear()"))
                arms.append(f":: /* {comment(name)} */\n{indent(text, '   ')}")
            else:
                guard = self._guard([*live, f"{turn} == {place}"])
                arms.append(self._option(name, self._block(step, set(), set(), guard, "finish()")))
        if not self._cycles:
            return arms
        over = f"{self._names[self._program.cycle]}" + (" || fault != 0" if self._faulty else "")
        inner = "\n".join(["do", *arms, f":: ({over}) -> break", "od"])
        return [self._option("one cycle", [_d_step([self._guard(live)]), inner, _d_step(["finish()"])])]

    def _roots(self) -> str:
        """The other initial configurations: SPIN has only one initial state."""
        picks = []
        for v in self._free:
            assert isinstance(v.type, Int)
            shift = self._shifts.get(v.name, 0)
            picks += [_pick(place, v.type.low + shift, v.type.high + shift) for place, _ in self._scalars(v)]
        if self._checked:
            first = tuple(Set(a.output, None, self._first(a.expression)) for a in self._program.atoms)
            letter = [self._plain_statement(s) for s in first]
            begin = [*letter, "started = true", *(["tick = true"] if self._ticks else [])]
            return self._option("any initial configuration", ["(!started)", *picks, _d_step(begin)])
        here = " && ".join(f"{place} == {value}" for v in self._configuration for place, value in self._scalars(v))
        return self._option("from the initial configuration to the other ones", [f"({here})", *picks, "skip"])

    def _first(self, e: Expr) -> Expr:
        """An atom's expression with the inputs of c0."""
        inputs = {f"input:{i.name}": i.init for i in self._program.inputs}

        def visit(node: Expr, args: list[Expr]) -> Expr:
            match node:
                case Local(name, kind):
                    return Const(inputs[name], kind)
                case Get(name, index, kind):
                    return node if index is None else Get(name, args[0], kind)
                case Op(name, _, kind):
                    return Op(name, tuple(args), kind)
                case Ite(_, _, _, kind):
                    return Ite(args[0], args[1], args[2], kind)
            return node

        return fold(e, visit)

    # ------------------------------------------------------------ the end of a step

    def _scalars(self, v: Var) -> list[tuple[str, str]]:
        """The places of a variable with what they start with."""
        name = self._names[v.name]
        if isinstance(v.init, tuple):
            return [(f"{name}[{i}]", str(x + self._shifts.get(v.name, 0))) for i, x in enumerate(v.init)]
        return [(name, str(v.init))]

    def _finish(self) -> list[str]:
        """What happens at the end of a step: scratch is cleared, so that equal configurations are equal states."""
        clear = [f"{self._locals[n]} = 0" for n, s in self._scratch.items() if s.kept]
        clear += [f"{name} = 0" for name in self._picked.values()]
        clear += [f"made_{self._picked[n]} = false" for n in sorted(self._repeated)]
        reset = [f"{place} = {value}" for v in self._outputs for place, value in self._scalars(v)]
        if self._faulty:
            start = [f"{place} = {value}" for v in self._configuration for place, value in self._scalars(v)]
            if self._checked:
                literals = [*(self._names[name] for name in self._latched), *self._negated.values()]
                start += [f"{name} = true" for name in literals] + (["waiting = 0"] if self._rounds else [])
            else:
                reset.append("assert(fault == 0)")
                start.append("fault = 0")
            reset.append(_if([("(fault != 0)", ";\n".join(start))], "skip"))
        if self._ticks:
            reset.append("tick = true")
        if not self._cycles:
            return _inline("finish", [*clear, *reset])
        return [*_inline("clear", clear), "", *_inline("finish", reset)]

    # ------------------------------------------------------------ declarations

    def _declarations(self) -> list[str]:
        lines = ["/* The configuration. */"]
        for v in self._configuration:
            note = values_note(v)
            lines.append(f"{self._declare(v)}; /* {comment(v.name)}{': ' + comment(note) if note else ''} */")
        if self._outputs:
            lines.append("/* What a step did; reset at its end. */")
            lines += [f"{self._declare(v)}; /* {comment(v.name)} */" for v in self._outputs]
        scratch = [
            f"{'' if s.kept else 'hidden '}{self._scratch_type(s)} {self._locals[n]};" for n, s in self._scratch.items()
        ]
        for name, variable in self._picked.items():
            kind = self._choices[name].type
            scratch.append(f"{_storage(kind.low, kind.high, kind.boolean)} {variable}; /* {comment(name)} */")
        scratch += [f"bool made_{self._picked[n]};" for n in sorted(self._repeated)]
        if scratch:
            lines += ["/* Choices and intermediate values; cleared at the end of a step. */", *scratch]
        if self._faulty:
            lines.append("/* The fault that ended the run:")
            lines += [
                f"   {i + 1}: {f.code} {comment(f'{f.span}: ' if f.span else '')}{comment(f.message)}"
                for i, f in enumerate(self._program.faults)
            ]
            lines[-1] += " */"
            lines.append(f"{_storage(0, len(self._program.faults))} fault;")
        if self._checked:
            lines.append("/* The letter: it changes when a step is complete. */")
            first = self._first_letter()
            for name, number in self._latched.items():
                text = comment(name if number is None else self._program.atoms[number].name)
                value = first.get(name, False)
                lines.append(f"bool {self._names[name]} = {str(value).lower()}; /* {text} */")
                if name in self._negated:
                    lines.append(f"bool {self._negated[name]} = {str(not value).lower()}; /* not {text} */")
        if self._rounds:
            lines.append("byte waiting; /* the fairness condition that has to come about next */")
        if self._ticks:
            lines.append(f"bool tick = {str(not self._starts).lower()}; /* no step is under way */")
        if self._starts:
            lines.append("bool started; /* the initial configuration has been chosen */")
        return lines

    def _declare(self, v: Var) -> str:
        kind, name = _type_of(v.type), self._names[v.name]
        if not isinstance(v.init, tuple):
            return f"{kind} {name} = {v.init}"
        if len(set(v.init)) == 1:
            return f"{kind} {name}[{len(v.init)}] = {v.init[0]}"
        shift = self._shifts.get(v.name, 0)
        if shift:
            assert isinstance(v.type, Int)
            kind = _storage(0, v.type.high + shift)
        return f"{kind} {name}[{len(v.init)}] = {{ {', '.join(str(x + shift) for x in v.init)} }}"

    def _scratch_type(self, s: _Scratch) -> str:
        return _storage(s.low, s.high, s.boolean and s.kept)  # SPIN hides no bits

    def _first_letter(self) -> dict[str, bool]:
        """The atoms in the first initial configuration."""
        values: dict[str, Value] = {v.name: v.init for v in self._program.vars}
        inputs = {f"input:{i.name}": i.init for i in self._program.inputs}
        return {a.output: bool(evaluate(a.expression, values, inputs)) for a in self._program.atoms}

    # ------------------------------------------------------------ formulas

    def _formulas(self) -> list[str]:
        if not self._checked:
            return []
        lines = []
        if self._faulty:
            lines += ["", f"ltl {self._ids.new('', 'fault_free')} {{ [] (fault == 0) }}"]
        for (name, formula), whole in zip(self._spec.goals, self._whole, strict=True):
            lines += ["", f"/* {comment(str(formula))} */", self._formula(self._ids.new("", name), whole)]
        return lines

    def _formula(self, name: str, whole: Formula) -> str:
        """A formula as an `ltl` block where SPIN can read it, else as the never claim of its negation."""
        if _readable(whole):
            if self._starts:
                whole = apply("U", negation(STARTED), conjunction((STARTED, whole)))
            return f"ltl {name} {{ {PROMELA.text(whole, self._proposition)} }}"
        try:
            return never_claim(name, translate(whole, negate=True), self._proposition)
        except AutomatonTooLarge as error:
            hint = "split it into smaller properties"
            raise DiagnosticError(Diagnostic("E424", f"`{name}`: {error}", hint=hint)) from None

    def _complete(self, formula: Formula) -> Formula:
        """A goal under the assumptions and fairness, on runs that a fault may cut off."""
        conditions = [(c.premise, c.goal) for c in self._program.fairness if c.goal not in self._rounds]
        demands = [fair(*c) for c in ([(None, ROUND)] if self._rounds else []) + conditions]
        premises = [f for _, f in self._spec.assumptions]
        if premises and self._faulty:
            premises.append(apply("G", negation(STOPPED)))
        elif self._faulty:
            formula, demands = weakened(formula), [weakened(f) for f in demands]
        premises += demands
        return apply("implies", conjunction(premises), formula) if premises else formula

    def _proposition(self, key: str) -> str:
        if key == STOPPED.key:
            return "(fault != 0)"
        if key == STARTED.key:
            return "started"
        if key.startswith(NO):
            output = self._by_key[key.removeprefix(NO)]
            return self._negated.setdefault(output, f"not_{self._names[output]}")
        return self._names[self._by_key[key.removeprefix(YES)]]

    # ------------------------------------------------------------ what to do with it

    def _header(self) -> list[str]:
        vector = sum(
            _BYTES[_type_of(v.type)] * (len(v.init) if isinstance(v.init, tuple) else 1) for v in self._flat.vars
        )
        vector += 8 * (len(self._picked) + len(self._latched)) + 4 * sum(s.kept for s in self._scratch.values())
        large = f" -DVECTORSZ={1 << (2 * vector).bit_length()}" if vector > STATE_VECTOR else ""
        lines = [f"/* The arrangement {comment(self._program.name)}, written by llfsm kripke."]
        if not self._checked:
            unit = "cycle" if self._cycles else "ringlet"
            lines += [
                f"   SPIN stores one state per configuration; a {unit} is one atomic sequence:",
                "     spin -o2 -a FILE",
                f"     gcc -O2 -DSAFETY -DNOREDUCE{large} -o pan pan.c",
                "     ./pan -m1000000" + ("    stops at the first fault: an assertion" if self._faulty else ""),
            ]
            if self._faulty:
                lines.append("     ./pan -m1000000 -A -E    counts; a fault leads to the initial configuration")
        else:
            lines += [
                "   A letter is held until the next step is complete, so that formulas without X stand as they are.",
                "   The others, and long ones, are never claims of ours, which read a letter where `tick` holds.",
                "     spin -o2 -a FILE",
                f"     gcc -O2 -DNOREDUCE{large} -o pan pan.c",
                "     ./pan -m1000000 -a -N NAME    for each ltl block and never claim",
            ]
            names = ", ".join(comment(name) for name, _ in self._spec.assumptions)
            if names:
                lines.append(f"   Assumed: {names}.")
        lines[-1] += " */"
        return lines


def _shift(v: Var) -> int:
    """SPIN 6.5 reads no negative numbers in the list of an array's first values: such arrays are stored from 0."""
    listed = isinstance(v.init, tuple) and len(set(v.init)) > 1
    return -v.type.low if listed and isinstance(v.type, Int) and v.type.low < 0 else 0


def _readable(f: Formula) -> bool:
    """SPIN can make an automaton of `f`: many builds know no X, and long formulas take it minutes or more."""
    return not has_next(f) and size(f) <= READABLE


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


def _if(arms: Sequence[tuple[str, str]], otherwise: str) -> str:
    lines = ["if"]
    for guard, body in [*arms, ("else", otherwise)]:
        body = body or "skip"
        lines.append(f":: {guard} -> {body}" if "\n" not in body else f":: {guard} ->\n{indent(body, '   ')}")
    return "\n".join([*lines, "fi"])


def _d_step(texts: Sequence[str]) -> str:
    """Indivisible statements: a guard alone is a statement of its own."""
    body = ";\n".join(texts)
    if len(texts) == 1 and "\n" not in body:
        return body
    return f"d_step {{\n{indent(body, '  ')}\n}}"


def _inline(name: str, body: list[str]) -> list[str]:
    return [f"inline {name}() {{", indent(";\n".join(body or ["skip"]), "  "), "}"]


def _pick(variable: str, low: int, high: int) -> str:
    """Give a variable any value from `low` to `high`."""
    if low == high:
        return f"{variable} = {low}"
    if high - low < LISTED:
        return "\n".join(["if", *(f":: {variable} = {value}" for value in range(low, high + 1)), "fi"])
    return f"{variable} = {low};\ndo\n:: ({variable} < {high}) -> {variable}++\n:: break\nod"


_WORDS = (
    "active", "assert", "atomic", "bit", "bool", "break", "byte", "chan", "d_step", "do", "else", "empty", "enabled",
    "eval", "false", "fi", "full", "goto", "hidden", "if", "init", "inline", "int", "len", "local", "ltl", "mtype",
    "nempty", "never", "nfull", "notrace", "np_", "od", "of", "pc_value", "pid", "printf", "priority", "proctype",
    "provided", "run", "select", "short", "show", "skip", "timeout", "trace", "true", "typedef", "unless", "unsigned",
    "xr", "xs", "fault", "tick", "started", "fair", "waiting", "finish", "clear", "arrangement", "U", "V", "W", "X",
)  # fmt: skip
"""Words that mean something in Promela, and names of the model's own."""
