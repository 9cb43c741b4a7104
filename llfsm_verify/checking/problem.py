"""The problem that an engine gets: an arrangement and what is asked of it, typed, and lowered once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from types import MappingProxyType

from llfsm_verify.arrangement.model import Arrangement, WhiteboardVariable
from llfsm_verify.automata.automaton import Automaton
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.language.atoms import (
    MACHINE_FUNCTIONS,
    OBSERVATIONS,
    PROPERTY_FUNCTIONS,
    PropertyScope,
    check_atom,
)
from llfsm_verify.language.scope import RESERVED, STEP_WORDS
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import AtState, Observe, Query, Read, Sampled, Sampling
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import MAX_TICKS, TICK, Clock
from llfsm_verify.logic.formula import TIMED, operators
from llfsm_verify.logic.parsing.bounds import decimal
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.letters import Observed, TimePasses
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.stages import stage
from llfsm_verify.transforms.forgetting import Forgetting, forgetting


class Programs:
    """The step programs of one arrangement: each is lowered when it is first asked for, and then kept.

    Copies of a problem share them. A pickle has none: who reads it lowers anew. `forget` False, for comparisons: what
    engines get forgets nothing.
    """

    def __init__(self, *, forget: bool = True) -> None:
        self._forget = forget
        self._made: dict[tuple[tuple[Observed, ...], bool], Program] = {}
        self._forgetting: dict[tuple[Observed, ...], Forgetting] = {}

    def of(self, arrangement: Arrangement, atoms: tuple[Observed, ...], *, keep_all_bits: bool) -> Program:
        """The program with these atoms."""
        key = (atoms, keep_all_bits)
        if key not in self._made:
            with stage("lowering to step programs"):
                self._made[key] = lower(arrangement, atoms, keep_all_bits=keep_all_bits)
        return self._made[key]

    def forgetting(self, arrangement: Arrangement, atoms: tuple[Observed, ...]) -> Forgetting:
        """The program with these atoms, without dead values."""
        if atoms not in self._forgetting:
            program = self.of(arrangement, atoms, keep_all_bits=False)
            with stage("forgetting dead values"):
                found = self._forgetting[atoms] = forgetting(program) if self._forget else Forgetting(program)
            if self._forget and program.kept_as is not None:  # its machine code is kept as well
                object.__setattr__(found.program, "kept_as", f"{program.kept_as} forgetting")
        return self._forgetting[atoms]

    def __reduce__(self) -> tuple[type[Programs], tuple[()]]:
        return Programs, ()


@dataclass(frozen=True, slots=True)
class Problem:
    """An arrangement with the lines of a property set that are checked, its assumptions, and the atoms of both in a
    fixed order.

    `automata` holds, by name, what the files of `automaton` lines hold. `clock` is that of bounds in time, None where
    there are none; with it the atoms have TICK, which users do not see.
    """

    arrangement: Arrangement
    properties: tuple[Property, ...] = ()
    assumptions: tuple[Property, ...] = ()
    atoms: tuple[Observed, ...] = ()
    automata: Mapping[str, Automaton] = field(default_factory=lambda: MappingProxyType({}))
    clock: Clock | None = None
    programs: Programs = field(default_factory=Programs, compare=False, repr=False)
    shown: frozenset[str] = frozenset()
    """The atoms that only performed runs have (`checking.edges`)."""

    @property
    def searched(self) -> tuple[Observed, ...]:
        """The atoms that searches have."""
        return tuple(a for a in self.atoms if a.name not in self.shown)

    def program(self, *, keep_all_bits: bool = False, forget: bool = True) -> Program:
        """The step program of searches, with its atoms as outputs, lowered once. `forget` False: with dead values, as
        other checkers get it."""
        if forget and not keep_all_bits:
            return self.forgetting.program
        return self.programs.of(self.arrangement, self.searched, keep_all_bits=keep_all_bits)

    def performed(self) -> Program:
        """The step program on which runs are performed: with all bits kept, and with all atoms."""
        return self.programs.of(self.arrangement, self.atoms, keep_all_bits=True)

    @property
    def forgetting(self) -> Forgetting:
        """How runs of the program that engines search are those of the one with all bits."""
        return self.programs.forgetting(self.arrangement, self.searched)


def only_shown(lines: Collection[Property]) -> frozenset[str]:
    """The atoms of these lines that searches of them do not read."""
    read = {key for line in lines for key in line.searched}
    return frozenset(key for line in lines for key in line.atoms) - read


def bind(arrangement: Arrangement, properties: PropertySet, *, stamped: bool = False) -> Problem:
    """Read the files of automata and type every atom in the arrangement's scope. `stamped`: letters have stamps, by
    which bounds in time are meant, so the problem has no clock.

    Raises DiagnosticError with everything that is wrong in the files, or in the atoms, or in the bounds in time.
    """
    scope = PropertyScope.of(arrangement)
    problems = list(_hidden_by_definitions(scope, properties))
    automata: Mapping[str, Automaton] = MappingProxyType({})
    if any(line.file is not None for line in properties):
        from llfsm_verify.automata.properties import load_automata

        properties, automata = load_automata(properties)
    atoms: dict[str, Observed] = {}
    for line in properties.properties:
        for key, fragment in line.atoms.items():
            if key not in atoms:
                typed = _typed(fragment, scope, problems)
                if typed is not None:
                    atoms[key] = Observed(key, typed.expression)
    if problems:
        raise DiagnosticError(list(dict.fromkeys(problems)))  # the members of a family share theirs
    clock = None if stamped else clock_of(arrangement, properties)
    if clock is not None:
        atoms[TICK] = Observed(TICK, TimePasses())
    checked = tuple(p for p in properties.properties if p.kind != "assume")
    assumed = tuple(p for p in properties.properties if p.kind == "assume")
    return Problem(arrangement, checked, assumed, tuple(atoms[k] for k in sorted(atoms)), automata, clock)


def refuse_hiding(arrangement: Arrangement, properties: PropertySet) -> None:
    """DiagnosticError (E317): a definition or family gives a name of the arrangement, or a word, another meaning."""
    problems = list(_hidden_by_definitions(PropertyScope.of(arrangement), properties))
    if problems:
        raise DiagnosticError(problems)


def _hidden_by_definitions(scope: PropertyScope, properties: PropertySet) -> Iterator[Diagnostic]:
    """A definition, or a name of a family, that means something else already would hide it."""
    known = (
        ("a variable of the arrangement", scope.whiteboard),
        ("a machine of the arrangement", scope.machines),
        ("a value of an enumeration", scope.enumerators),
        ("a type of the arrangement", scope.types),
        (
            "a word of properties",
            (*RESERVED, *STEP_WORDS, *PROPERTY_FUNCTIONS, *OBSERVATIONS, *MACHINE_FUNCTIONS, "initially"),
        ),
    )
    for name, place in properties.definitions.items():
        what = next((what for what, names in known if name in names), None)
        if what is not None:
            message = f"`{name}` is {what}, and this gives it another meaning"
            yield Diagnostic(codes.DEFINITION, message, place, hint="choose another name")


def _typed(fragment: Fragment, scope: PropertyScope, problems: list[Diagnostic]) -> Observed | None:
    try:
        return Observed(fragment.text, check_atom(fragment, scope))
    except DiagnosticError as error:
        problems.extend(error.diagnostics)
        return None


# ---- The time that bounds in properties speak of: that of the arrangement's cycles


def clock_of(arrangement: Arrangement, properties: PropertySet) -> Clock | None:
    """The clock for the bounds in time in `properties`; None: no property has one.

    DiagnosticError, at each operator: the arrangement has no time of its own (E336), or a bound has more than 2^20
    cycles (E337), or none (E339).
    """
    timed = [p for p in properties if p.formula is not None and operators(p.formula) & TIMED]
    period = arrangement.cycle_ms
    problems: list[Diagnostic] = []
    for line in timed:
        for place, bound in line.bounds:
            if len(arrangement.processes) > 1 or period is None:
                problems.append(
                    Diagnostic(
                        codes.TIMELESS, _why(arrangement, place.text), place, hint=_hint(arrangement, place.text)
                    )
                )
                continue
            least, most = Clock(period).ticks(bound)
            longest = max(t for t in bound if t is not None)
            if longest // period > MAX_TICKS:
                cycles = f"{longest // period:,} cycles of {_ms(period)} ms"
                message = f"{decimal(longest)} ms are {cycles}, more than {MAX_TICKS:,}"
                hint = "use a longer cycle or a shorter time"
                problems.append(Diagnostic(codes.TOO_LONG, message, place, hint=hint))
            elif most is not None and most < least:
                between = f"from {decimal(bound[0])} to {decimal(longest)} ms"
                message = f"no cycle begins in the time {between}: there is one every {_ms(period)} ms"
                hint = f"write times between which a multiple of {_ms(period)} ms lies"
                problems.append(Diagnostic(codes.NO_CYCLE, message, place, hint=hint))
    if problems:
        raise DiagnosticError(problems)
    assert not timed or period is not None, "a formula with a bound in time has one in its text"
    return Clock(period) if timed and period is not None else None


def _why(arrangement: Arrangement, operator: str) -> str:
    if arrangement.timing == "untimed":
        return f"`{operator}` asks for time, and this arrangement is untimed"
    if len(arrangement.processes) > 1:
        return f"`{operator}` asks for one time, and each of the {len(arrangement.processes)} processes has its own"
    return f"`{operator}` needs to know how long a cycle takes"


def _hint(arrangement: Arrangement, operator: str) -> str:
    name = operator.partition("[")[0].strip() if "[" in operator else "F"  # else it is the time of a pattern
    steps = f"count steps (`p {name}[0:5] q`)" if name in ("U", "R", "S", "T") else f"count steps (`{name}[0:5] p`)"
    if arrangement.timing == "untimed":
        return f"{steps}, or write `cycle_ms: …` instead of `timing: untimed` into the arrangement"
    if len(arrangement.processes) > 1:
        return f"{steps}, or let a machine measure the time with `after` and ask for its state"
    return "write `cycle_ms: …` (the period of one cycle) into the arrangement"


def _ms(period: Fraction) -> str:
    return str(period.numerator) if period.denominator == 1 else f"{float(period):g}"


OWN = (AtState, Observe, Query, Sampled, Sampling)
"""What asks about machines: also what they have sampled."""


def world_atoms(problem: Problem) -> frozenset[str]:
    """The names of the atoms that read inputs only, and of the one that says that time passes.

    Not those that the model of the surroundings writes: what it does may follow from outputs.
    """
    return _atoms(problem, lambda variable: variable.role == "input" and not variable.driven)


def are_about_world(problem: Problem) -> bool:
    """Whether all assumptions are about the surroundings alone: then no arrangement escapes them."""
    about = world_atoms(problem)
    return all(about.issuperset(line.atoms) for line in problem.assumptions)


def fixed_atoms(problem: Problem) -> frozenset[str]:
    """The names of the atoms that read only inputs which never change."""
    passing = {a.name for a in problem.atoms if isinstance(a.expression, TimePasses)}
    return _atoms(problem, lambda v: v.role == "input" and v.changes == "never") - passing


def _atoms(problem: Problem, wanted: Callable[[WhiteboardVariable], bool]) -> frozenset[str]:
    names = {w.variable.name for w in problem.arrangement.whiteboard if wanted(w)}
    return frozenset(atom.name for atom in problem.atoms if _reads_only(atom, names))


def _reads_only(atom: Observed, names: set[str]) -> bool:
    return not any(
        isinstance(node, OWN) or (isinstance(node, Read) and node.variable.name not in names)
        for node in nodes(atom.expression)
    )
