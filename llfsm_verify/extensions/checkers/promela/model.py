"""Whole arrangements as Promela models for SPIN, with one stored state per configuration.

Without properties a step is one atomic sequence, and a fault leads to the initial configuration, which adds no state.
With properties no sequence is atomic, since SPIN misses a claim that accepts in the middle of one. Instead the letter
changes in the last transition of a step: SPIN then sees our word with letters repeated, which no formula without X
tells apart. A fault leads to a dead state in which every atom and its negation hold, the weak view of truncated paths
(C. Eisner et al., Reasoning with temporal logic on truncated paths, CAV 2003).
"""

from __future__ import annotations

from textwrap import indent

from llfsm_verify import Diagnostic, DiagnosticError
from llfsm_verify.extensions.checkers.flat import Flat, Identifiers, comment, flatten, stopping, values_note
from llfsm_verify.extensions.checkers.formulas import (
    NO,
    PROMELA,
    STARTED,
    STOPPED,
    YES,
    fair,
    never_claim,
    readable,
    under,
)
from llfsm_verify.extensions.checkers.promela.blocks import (
    Blocks,
    conditional,
    header,
    indivisible,
    pick_any,
    storage,
    type_of,
)
from llfsm_verify.plug import (
    FAULT,
    AutomatonTooLarge,
    Block,
    Const,
    Expr,
    Formula,
    Get,
    Int,
    Ite,
    Local,
    Op,
    Set,
    Specification,
    Value,
    Var,
    apply,
    conjunction,
    evaluate,
    fold,
    negation,
    translate,
)

ROUND = "$round"
"""The output that holds when all fairness goals have come about once more."""


def promela(specification: Specification) -> str:
    """The model as text. Raises DiagnosticError (E420, E421) where its numbers do not fit Promela's."""
    return _Model(flatten(specification)).text()


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
        self._names[ROUND] = "fair"
        self._by_key = {a.name: a.output for a in self._program.atoms} | {
            n: n for n, i in self._latched.items() if i is None
        }
        self._negated: dict[str, str] = {}
        """Outputs of the letter that the formulas need negated too: a fault makes both true (`formulas.weaken`)."""
        self._choices = {c.name: c for c in self._program.choices}
        self._following: dict[str, list[str]] = {}
        self._blocks = Blocks(
            self._ids, self._names, flat.vars, self._program.choices, [*flat.steps, flat.stutter], self._following
        )
        self._free = [v for v in self._configuration if v.free]
        self._whole = [self._complete(f) for _, f in self._spec.goals]
        self._ticks = not all(map(readable, self._whole))
        self._starts = self._checked and bool(self._free)

    def _follow(self) -> None:
        """What follows assignments to parts of the letter."""
        for output, name in self._negated.items():
            self._following.setdefault(output, []).append(f"{name} = !{self._names[output]}")
        if self._rounds:
            self._following.setdefault(self._rounds[-1], []).append(self._next_round())

    def _next_round(self) -> str:
        """The next fairness goal is waited for; after the last one a round is complete (degeneralization)."""
        goals = [self._names[goal] for goal in self._rounds]
        waits = [
            conditional([(f"(waiting == {i} && {goal})", f"waiting = {i + 1}")], "skip") for i, goal in enumerate(goals)
        ]
        complete = conditional([(f"(waiting == {len(goals)})", "waiting = 0;\nfair = true")], "fair = false")
        return ";\n".join([*waits, complete])

    # ------------------------------------------------------------ the loop

    def text(self) -> str:
        """The whole model."""
        formulas = self._formulas()  # finds out which atoms are needed negated
        self._follow()
        self._loop()  # finds out which choices can be repeated
        self._blocks.scratch.clear()
        loop = self._loop()
        finish = self._finish()
        return "\n".join(
            [
                *header(self._flat, self._blocks, len(self._latched)),
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
            self._blocks.step += 1
            options.append(self._option("every process has ended", self._ringlet(self._flat.stutter, guard)))
        if self._checked and self._faulty:
            body = (
                ["d_step {\n  (fault != 0) ->\n  tick = false\n}", "tick = true"] if self._ticks else ["(fault != 0)"]
            )
            options.append(self._option("a fault has ended the run", body))
        return options

    def _ringlet(self, step: Block, guard: str) -> list[str]:
        """The transitions of a step; where ticks are seen, some state must show that it is under way."""
        return self._blocks.transitions(step, set(), set(), guard, "finish()", alone=self._ticks)

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
            self._blocks.step += 1
            if self._cycles:
                fine = ["fault == 0"] if self._faulty else []
                guard = " && ".join([f"{turn} == {place}", f"!{self._names[self._program.cycle]}", *fine])
                text = ";\n".join(self._blocks.transitions(step, set(), set(), f"({guard})", "clear()"))
                arms.append(f":: /* {comment(name)} */\n{indent(text, '   ')}")
            else:
                guard = self._guard([*live, f"{turn} == {place}"])
                arms.append(self._option(name, self._ringlet(step, guard)))
        if not self._cycles:
            return arms
        over = f"{self._names[self._program.cycle]}" + (" || fault != 0" if self._faulty else "")
        inner = "\n".join(["do", *arms, f":: ({over}) -> break", "od"])
        return [self._option("one cycle", [indivisible([self._guard(live)]), inner, indivisible(["finish()"])])]

    def _roots(self) -> str:
        """The other initial configurations: SPIN has only one initial state."""
        picks = []
        for v in self._free:
            assert isinstance(v.type, Int)
            shift = self._blocks.shifts.get(v.name, 0)
            picks += [pick_any(place, v.type.low + shift, v.type.high + shift) for place, _ in self._scalars(v)]
        if self._checked:
            first = tuple(Set(a.output, None, self._first(a.expression)) for a in self._program.atoms)
            letter = [self._blocks.statement(s) for s in first]
            begin = [*letter, "started = true", *(["tick = true"] if self._ticks else [])]
            return self._option("any initial configuration", ["(!started)", *picks, indivisible(begin)])
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
            return [(f"{name}[{i}]", str(x + self._blocks.shifts.get(v.name, 0))) for i, x in enumerate(v.init)]
        return [(name, str(v.init))]

    def _finish(self) -> list[str]:
        """What happens at the end of a step: scratch is cleared, so that equal configurations are equal states."""
        clear = [f"{self._blocks.locals[n]} = 0" for n, s in self._blocks.scratch.items() if s.kept]
        clear += [f"{name} = 0" for name in self._blocks.picked.values()]
        clear += [f"made_{self._blocks.picked[n]} = false" for n in sorted(self._blocks.repeated)]
        reset = [f"{place} = {value}" for v in self._outputs for place, value in self._scalars(v)]
        if self._faulty:
            start = [f"{place} = {value}" for v in self._configuration for place, value in self._scalars(v)]
            if self._checked:
                literals = [*(self._names[name] for name in self._latched), *self._negated.values()]
                start += [f"{name} = true" for name in literals] + (["waiting = 0"] if self._rounds else [])
            else:
                reset.append("assert(fault == 0)")
                start.append("fault = 0")
            reset.append(conditional([("(fault != 0)", ";\n".join(start))], "skip"))
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
            f"{'' if s.kept else 'hidden '}{storage(s.low, s.high, s.boolean and s.kept)} {self._blocks.locals[n]};"
            for n, s in self._blocks.scratch.items()
        ]
        for name, variable in self._blocks.picked.items():
            kind = self._choices[name].type
            scratch.append(f"{storage(kind.low, kind.high, kind.boolean)} {variable}; /* {comment(name)} */")
        scratch += [f"bool made_{self._blocks.picked[n]};" for n in sorted(self._blocks.repeated)]
        if scratch:
            lines += ["/* Choices and intermediate values; cleared at the end of a step. */", *scratch]
        if self._faulty:
            lines.append("/* The fault that ended the run:")
            lines += [
                f"   {i + 1}: {f.code} {comment(f'{f.span}: ' if f.span else '')}{comment(f.message)}"
                for i, f in enumerate(self._program.faults)
            ]
            lines[-1] += " */"
            lines.append(f"{storage(0, len(self._program.faults))} fault;")
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
        kind, name = type_of(v.type), self._names[v.name]
        if not isinstance(v.init, tuple):
            return f"{kind} {name} = {v.init}"
        if len(set(v.init)) == 1:
            return f"{kind} {name}[{len(v.init)}] = {v.init[0]}"
        shift = self._blocks.shifts.get(v.name, 0)
        if shift:
            assert isinstance(v.type, Int)
            kind = storage(0, v.type.high + shift)
        return f"{kind} {name}[{len(v.init)}] = {{ {', '.join(str(x + shift) for x in v.init)} }}"

    def _first_letter(self) -> dict[str, bool]:
        """The atoms in the first initial configuration."""
        values: dict[str, Value] = {v.name: v.init for v in self._program.vars}
        inputs = {f"input:{i.name}": i.init for i in self._program.inputs}
        return {a.output: bool(evaluate(a.expression, values, inputs, shared=True)) for a in self._program.atoms}

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
        if readable(whole):
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
        return under(formula, [f for _, f in self._spec.assumptions], demands, faulty=self._faulty)

    def _proposition(self, key: str) -> str:
        if key == STOPPED.key:
            return "(fault != 0)"
        if key == STARTED.key:
            return "started"
        if key.startswith(NO):
            output = self._by_key[key.removeprefix(NO)]
            return self._negated.setdefault(output, f"not_{self._names[output]}")
        return self._names[self._by_key[key.removeprefix(YES)]]


def _inline(name: str, body: list[str]) -> list[str]:
    return [f"inline {name}() {{", indent(";\n".join(body or ["skip"]), "  "), "}"]


_WORDS = (
    "active", "assert", "atomic", "bit", "bool", "break", "byte", "chan", "d_step", "do", "else", "empty", "enabled",
    "eval", "false", "fi", "full", "goto", "hidden", "if", "init", "inline", "int", "len", "local", "ltl", "mtype",
    "nempty", "never", "nfull", "notrace", "np_", "od", "of", "pc_value", "pid", "printf", "priority", "proctype",
    "provided", "run", "select", "short", "show", "skip", "timeout", "trace", "true", "typedef", "unless", "unsigned",
    "xr", "xs", "fault", "tick", "started", "fair", "waiting", "finish", "clear", "arrangement", "U", "V", "W", "X",
)  # fmt: skip
"""Words that mean something in Promela, and names of the model's own."""
