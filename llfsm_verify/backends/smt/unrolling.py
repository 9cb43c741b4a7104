"""Runs as terms: the configurations of a run, step by step, and what must be true for it to be one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import z3

from llfsm_verify.backends.smt.arithmetic import OURS, Arithmetic, Term, choose, truth
from llfsm_verify.backends.smt.relation import Relation, Terms
from llfsm_verify.limits import tick
from llfsm_verify.program.program import BOOL, OpName
from llfsm_verify.program.symbolic import Key
from llfsm_verify.program.terms import const


@dataclass(frozen=True, slots=True)
class Way:
    """One way in which a step can be taken: by a process (None: the stutter) whose turn it is, where `when` is true."""

    process: int | None
    slot: int | None
    when: z3.BoolRef
    relation: Relation
    choices: Mapping[str, Term]
    """The choices of this step, by name; each step has its own."""


@dataclass(frozen=True, slots=True)
class Point:
    """A configuration of the run, with the outputs of the step that led to it.

    `ways` are those of the step from here, once there is one; exactly one of them is taken.
    """

    values: Mapping[Key, Term]
    observed: z3.BoolRef
    """A letter is shown here (always, unless `observe: cycle`)."""
    letter: Mapping[str, z3.BoolRef]
    """The atoms and the goals and premises of fairness, by name; they mean something where a letter is shown."""
    ways: list[Way] = field(default_factory=list)
    faults: list[tuple[z3.BoolRef, Term]] = field(default_factory=list)
    """By way: that it is taken, and the fault in which the step ends, as in `Relation.fault`."""
    sizes: Mapping[Key, int] = field(default_factory=dict)
    """The bits of numbers that products have made, and of those in the beginning."""

    def fault(self, arithmetic: Arithmetic, number: int | None = None) -> z3.BoolRef:
        """The step from here ends in this fault (None: in any)."""
        op: OpName = "ne" if number is None else "eq"
        code = const(0 if number is None else number + 1)
        literal = arithmetic.literal(code.value, code.type)
        return z3.Or([z3.And(when, arithmetic.compare(op, term, literal)) for when, term in self.faults])


class Unrolling:
    """A run of growing length. `constraints` hold for exactly the runs without a fault.

    The turn is no unknown where it is the same in all runs (one process, no machine that leaves), nor is anything else
    that is: such values are literals.
    """

    def __init__(self, terms: Terms, name: str = "", start: Mapping[Key, Term] | None = None) -> None:
        """`name` tells the constants of one unrolling from those of another.

        `start`: begin anywhere, not in the beginning: in a configuration with these values of scalars (or of outputs,
        where a step depends on them), any values for all others; its letter is not known.
        """
        self.terms = terms
        self._name = name
        program = terms.program
        self._slots: dict[int, Relation] = {}
        self._stutter: Relation | None = None
        self.constraints: list[z3.BoolRef] = []
        self.points: list[Point] = []
        self._fresh_outputs = {key: terms.literal(key, init) for key, _, init in terms.outputs}
        values: dict[Key, Term] = dict(self._fresh_outputs)
        if start is not None:
            self._begin_anywhere(values, start)
            return
        for key, var, init in terms.configuration:
            if var.free:
                values[key] = self._constant(key, 0)
                self.constraints.append(terms.arithmetic.within(values[key]))
            else:
                values[key] = terms.literal(key, init)
        inputs = {f"input:{i.name}": terms.arithmetic.literal(i.init, i.type) for i in program.inputs}
        given = [(terms.before[key].z3, term.z3) for key, term in values.items()]
        letter: dict[str, z3.BoolRef] = {}
        for atom in program.atoms:
            shown = truth(terms.arithmetic, terms.expression(atom.expression, inputs))
            letter[atom.name] = z3.simplify(z3.substitute(shown, *given))
        values[program.cycle, None] = terms.literal((program.cycle, None), 1)
        sizes = {key: init.bit_length() for key, var, init in terms.configuration if not var.free}
        self.points.append(Point(values, z3.BoolVal(True), letter, sizes=sizes))

    def _begin_anywhere(self, values: dict[Key, Term], start: Mapping[Key, Term]) -> None:
        values[self.terms.program.cycle, None] = self.terms.literal((self.terms.program.cycle, None), 1)
        values |= start
        for key, _, _ in self.terms.configuration:
            if key not in values:
                values[key] = self._constant(key, 0)
        inside = [z3.simplify(self.terms.arithmetic.within(term)) for term in values.values()]
        self.constraints += [c for c in inside if not z3.is_true(c)]
        self.points.append(Point(values, z3.BoolVal(False), {}))

    def __len__(self) -> int:
        """Steps so far."""
        return len(self.points) - 1

    def begin(self) -> Point:
        """Let a step be taken from the last point, which is returned; `constraints` then allow it to end in a fault."""
        here = self.points[-1]
        if not here.ways:
            here.ways.extend(self._ways(here))
            for way in here.ways:
                given = self._given(here, way)
                fault = way.relation.fault
                here.faults.append((way.when, Term(z3.simplify(z3.substitute(fault.z3, *given)), fault.type)))
                self.constraints += [self.terms.arithmetic.within(c) for c in way.choices.values()]
            if len(here.ways) != 1:
                self.constraints.append(z3.Or([w.when for w in here.ways]))
        return here

    def extend(self) -> Point:
        """One step more, without a fault. Returns the point after it. Raises NumberTooLarge."""
        here, number = self.begin(), len(self.points)
        self.constraints.append(z3.simplify(z3.Not(here.fault(self.terms.arithmetic))))
        posts = []
        sizes = dict(here.sizes)
        for way in here.ways:
            tick()
            for key, bits in way.relation.grown(here.sizes).items():
                sizes[key] = max(bits, sizes.get(key, 0))
            given = self._given(here, way)
            after = {k: Term(z3.simplify(z3.substitute(t.z3, *given)), t.type) for k, t in way.relation.after.items()}
            posts.append((way, after, self._before(here, way)))
        values: dict[Key, Term] = {}
        for key in here.values:
            values[key] = self._named(key, number, self._merged(key, posts))
        self.points.append(self._point(values, here, sizes))
        return self.points[-1]

    def _point(self, values: Mapping[Key, Term], before: Point, sizes: Mapping[Key, int]) -> Point:
        program, arithmetic = self.terms.program, self.terms.arithmetic
        observed = z3.BoolVal(True)
        if program.observe == "cycle":
            stutters = [w.when for w in before.ways if w.process is None]
            observed = z3.simplify(z3.Or(truth(arithmetic, values[program.cycle, None]), *stutters))
        names = {a.name: a.output for a in program.atoms}
        names |= {n: n for f in program.fairness for n in (f.premise, f.goal) if n is not None}
        letter = {name: truth(arithmetic, values[output, None]) for name, output in names.items()}
        return Point(values, observed, letter, sizes=sizes)

    def _merged(self, key: Key, posts: Sequence[tuple[Way, Mapping[Key, Term], Mapping[Key, Term]]]) -> Term:
        found: Term | None = None
        for way, after, before in reversed(posts):
            mine = after.get(key, before[key])
            if found is None:
                found = mine
            elif not mine.z3.eq(found.z3):
                found = choose(self.terms.arithmetic, Term(way.when, BOOL), mine, found, mine.type)
        assert found is not None
        return found

    def _named(self, key: Key, number: int, term: Term) -> Term:
        """A constant that is equal to a term, unless the term is small."""
        if z3.is_const(term.z3):  # a literal too
            return term
        constant = self._constant(key, number)
        self.constraints.append(constant.z3 == term.z3)
        return constant

    def _constant(self, key: Key, number: int) -> Term:
        before = self.terms.before[key]
        return self.terms.arithmetic.constant(f"{before.z3.decl().name()}@{self._name}{number}", before.type)

    # ------------------------------------------------------------ the ways of a step

    def _ways(self, here: Point) -> list[Way]:
        program, arithmetic, number = self.terms.program, self.terms.arithmetic, len(self.points) - 1
        ended = [
            z3.BoolVal(False) if p.ended is None else truth(arithmetic, here.values[p.ended, None])
            for p in program.processes
        ]
        ways: list[Way] = []
        for index, process in enumerate(program.processes):
            steps = z3.Not(ended[index])
            if len(program.processes) > 1:
                mine = z3.Bool(f"{OURS}process@{self._name}{number}={index}")
                others = [z3.Not(z3.Bool(f"{OURS}process@{self._name}{number}={j}")) for j in range(index)]
                steps = z3.And(steps, mine, *others)
            for position, slot in enumerate(process.slots):
                turn = here.values[process.turn, None]
                has = arithmetic.compare("eq", turn, arithmetic.literal(position, turn.type))
                when = z3.simplify(z3.And(steps, has))
                if not z3.is_false(when):
                    ways.append(self._way(index, slot, when, number))
        rest = z3.simplify(z3.And(ended))
        if not z3.is_false(rest):
            ways.append(self._way(None, None, rest, number))
        return ways

    def _way(self, process: int | None, slot: int | None, when: z3.BoolRef, number: int) -> Way:
        tick()
        relation = self._relation(slot)
        choices = {
            name: self.terms.arithmetic.constant(f"?{name}@{self._name}{number}:{process}", term.type)
            for name, term in relation.choices.items()
        }
        return Way(process, slot, when, relation, choices)

    def _relation(self, slot: int | None) -> Relation:
        if slot is None:
            self._stutter = self._stutter or self.terms.stutter()
            return self._stutter
        if slot not in self._slots:
            self._slots[slot] = self.terms.slot(slot)
        return self._slots[slot]

    def _before(self, here: Point, way: Way) -> dict[Key, Term]:
        """What a step begins with: outputs at their `init`, or in the middle of an observed cycle as they are."""
        program, arithmetic = self.terms.program, self.terms.arithmetic
        if way.process is None or program.observe == "ringlet":
            return {**here.values, **self._fresh_outputs}
        fresh = Term(truth(arithmetic, here.values[program.cycle, None]), BOOL)
        if z3.is_true(fresh.z3):
            return {**here.values, **self._fresh_outputs}
        if z3.is_false(fresh.z3):
            return dict(here.values)
        outputs = {
            key: choose(arithmetic, fresh, init, here.values[key], init.type)
            for key, init in self._fresh_outputs.items()
        }
        return {**here.values, **outputs}

    def _given(self, here: Point, way: Way) -> list[tuple[z3.ExprRef, z3.ExprRef]]:
        given = [(self.terms.before[key].z3, term.z3) for key, term in self._before(here, way).items()]
        return given + [(way.relation.choices[name].z3, term.z3) for name, term in way.choices.items()]
