"""Properties decided on a log of others: a row is the letter of one cycle."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.backends.native.layout import Value
from llfsm_verify.backends.reference import evaluate
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.goals.kinds import goals_of
from llfsm_verify.checking.problem import Problem, bind
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.checking.values import ValueProblem
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.kripke.values import element_names
from llfsm_verify.logic.bounds import TICK
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.program.program import INT64_MAX, INT64_MIN, Atom, Choice, Const, Expr, Get, Int, Local, Program
from llfsm_verify.program.trees import nodes
from llfsm_verify.runtime.live.monitors import monitors_of
from llfsm_verify.runtime.logs.codes import NOT_GIVEN, UNKNOWN, UNREADABLE
from llfsm_verify.runtime.logs.formats import LOGS, NoColumn, Row, Unreadable, Wanted
from llfsm_verify.runtime.logs.mapping import LogMapping, read_mapping
from llfsm_verify.runtime.recording.check import Decided, Watch

INPUT = "input:"
_KEPT = 1 << 16
"""Letters of rows that are remembered, as many rows are equal."""


@dataclass(frozen=True, slots=True)
class DecidedOnLog:
    """What a log says of a property. `decided.step` is the number of the row, from 1."""

    decided: Decided
    time: str | None
    """The time of that row, where the log has times."""


def check_log(
    arrangement: Arrangement, properties: PropertySet, path: str, mapping_path: str, form: str
) -> list[DecidedOnLog]:
    """Each property, on a log: its first row is the first letter, and each row is that of one cycle.

    A verdict by some rows holds whatever came after. Of a log that has ended, as the mapping says, the last row repeats
    forever. ModuleNotFoundError: the package for the format is not installed. DiagnosticError: what is wrong with the
    properties, the mapping or the log (E496 to E498).
    """
    problem = bind(arrangement, properties)
    program = problem.program(keep_all_bits=True)
    mapping = read_mapping(mapping_path, log_slots(program))
    letters = _Letters(problem, program, mapping)
    read = LOGS.load(form)

    def rows() -> Iterator[Row]:
        wanted = {column.name for column in mapping.columns.values()} | ({mapping.time} if mapping.time else set())
        try:
            yield from read(path, Wanted(sorted(wanted), mapping.topic))
        except NoColumn as error:
            raise DiagnosticError(_no_column(error, mapping, path)) from None
        except Unreadable as error:
            raise DiagnosticError(Diagnostic(UNREADABLE, f"the log cannot be read: {error}", file=path)) from None
        except OSError as error:
            why = error.strerror or "input/output error"
            raise DiagnosticError(Diagnostic(UNREADABLE, f"the log cannot be read: {why}", file=path)) from None

    monitors, reasons = monitors_of(problem)
    watches = [Watch(g, monitors.get(g.line.name), reasons.get(g.line.name, "")) for g in goals_of(problem)]
    times: dict[int, str] = {}
    count = 0
    for count, row in enumerate(rows(), 1):
        letter = letters.read(row, path)
        for watch in watches:
            watch.read(letter, count, count)
            if watch.place == (count, count) and mapping.time is not None and mapping.time in row.cells:
                times[count] = row.cells[mapping.time]
    if not count:
        raise DiagnosticError(Diagnostic(UNREADABLE, "the log has no rows", file=path))
    if mapping.ended and any(watch.verdict == "undecided" for watch in watches):
        word = [letters.read(row, path) for row in rows()]  # once more: most logs do not need all their letters
        stem, loop = word[:-1], word[-1:]
        assumed = all(claim_of(p, problem.clock).true_on(stem, loop) for p in properties.assumptions)
        for watch in watches:
            watch.settle(stem, loop, assumed=assumed)
    found = []
    for watch in watches:
        decided = watch.decided(open_end="the log ends there, and the mapping does not say `ended: true`")
        found.append(DecidedOnLog(decided, None if decided.step is None else times.get(decided.step)))
    return found


def log_slots(program: Program) -> dict[str, Choice]:
    """What columns can give: inputs, variables and their elements, and the states of machines."""
    found: dict[str, Choice] = {}
    for name, (_, _, choice) in _scalars(program).items():
        found[name] = choice
    for choice in program.choices:
        if choice.input:
            found.setdefault(choice.input, choice)
    return found


def _scalars(program: Program) -> dict[str, tuple[str, int | None, Choice]]:
    """The variable, the element and the values of each slot that is stored."""
    found: dict[str, tuple[str, int | None, Choice]] = {}
    states = {slot.state: program.machines[slot.machine] for slot in program.slots}
    for var in program.vars:
        names, labels = element_names(var), var.origin.labels
        if var.name in states:
            names, labels = (states[var.name].name,), states[var.name].states
        elif var.output or var.origin.kind in ("control", "output"):
            continue
        kind = var.type if isinstance(var.type, Int) else Int(INT64_MIN, INT64_MAX)
        for number, name in enumerate(names):
            at = None if var.length is None else number
            found[name] = (var.name, at, Choice(name, kind, "input", name, labels))
    return found


class _Letters:
    """The letters of rows."""

    def __init__(self, problem: Problem, program: Program, mapping: LogMapping) -> None:
        """DiagnosticError (E498): an atom needs what no column gives."""
        scalars = _scalars(program)
        slots = {(variable, at): name for name, (variable, at, _) in scalars.items()}
        self._atoms = [atom for atom in program.atoms if atom.name != TICK]
        self._always = frozenset({TICK} & {atom.name for atom in program.atoms})
        lengths = {var.name: var.length for var in program.vars}
        places = {
            key: place for line in (*problem.properties, *problem.assumptions) for key, place in line.atoms.items()
        }
        mistakes = []
        used: dict[str, None] = {}
        for atom in self._atoms:
            needed = dict.fromkeys(_needed(atom, slots, lengths))
            used |= needed
            missing = [name for name in needed if name not in mapping.columns]
            if missing:
                mistakes.append(
                    _not_given(atom, missing, places.get(atom.name), scalars.keys() | log_slots(program).keys())
                )
        if mistakes:
            raise DiagnosticError(mistakes)
        self._columns = [(name, column, column.reader()) for name, column in mapping.columns.items()]
        self._scalars, self._lengths = scalars, lengths
        self._known: dict[tuple[int, ...], Letter] = {}

    def read(self, row: Row, path: str) -> Letter:
        """DiagnosticError (E497): a cell is empty, or its value is none of its slot's."""
        numbers = tuple(_number(name, column.name, reader, row, path) for name, column, reader in self._columns)
        letter = self._known.get(numbers)
        if letter is None:
            if len(self._known) == _KEPT:
                self._known.clear()
            letter = self._known[numbers] = self._letter(numbers)
        return letter

    def _letter(self, numbers: tuple[int, ...]) -> Letter:
        variables: dict[str, Value] = {}
        arrays: dict[str, list[int]] = {}
        inputs: dict[str, int] = {}
        for (name, _, _), number in zip(self._columns, numbers, strict=True):
            if name not in self._scalars:
                inputs[INPUT + name] = number
                continue
            variable, at, _ = self._scalars[name]
            if at is None:
                variables[variable] = number
            else:
                arrays.setdefault(variable, [0] * (self._lengths[variable] or 0))[at] = number
        for variable, values in arrays.items():
            variables[variable] = tuple(values)
        return self._always | {atom.name for atom in self._atoms if evaluate(atom.expression, variables, inputs)}


def _needed(
    atom: Atom, slots: Mapping[tuple[str, int | None], str], lengths: Mapping[str, int | None]
) -> Iterator[str]:
    """The slots that an atom reads; what is no slot has the name that the step program gives it."""
    for node in nodes(atom.expression):
        if isinstance(node, Local) and node.name.startswith(INPUT):
            yield node.name[len(INPUT) :]
        elif isinstance(node, Local):
            yield node.name
        elif isinstance(node, Get):
            for at in _positions(node.index, lengths.get(node.var)):
                yield slots.get((node.var, at), node.var)


def _positions(index: Expr | None, length: int | None) -> Collection[int | None]:
    """The element of an array; all of them where only the run tells which."""
    if index is None:
        return (None,)
    return (index.value,) if isinstance(index, Const) else tuple(range(length or 0))


def _number(slot: str, column: str, reader: Callable[[str], int], row: Row, path: str) -> int:
    text = row.cells.get(column)
    try:
        if text is None:
            raise ValueProblem("the cell has no value")
        return reader(text)
    except ValueProblem as problem:
        message = f"{row.place}, column `{column}` (`{slot}`): {problem}"
        raise DiagnosticError(Diagnostic(UNREADABLE, message, file=path, hint=HINT)) from None


HINT = "say under `columns` in the mapping what its cells mean, or mend the log"


def _not_given(atom: Atom, missing: list[str], place: Fragment | None, slots: Collection[str]) -> Diagnostic:
    span = None if place is None else place.span(0, len(place.text))
    hidden = [name for name in missing if name not in slots]
    if hidden:
        message = (
            f"`{atom.name}` asks what happened in a step, what came before it, or whether a machine is loaded, "
            "and a row does not tell it"
        )
        return Diagnostic(NOT_GIVEN, message, span, hint="ask for states, variables and inputs")
    names = ", ".join(f"`{name}`" for name in missing[:5])
    message = f"no column gives {names}" + (f", which `{atom.name}` needs" if missing != [atom.name] else "")
    return Diagnostic(NOT_GIVEN, message, span, hint=f"add `{missing[0]}: COLUMN` under `columns` of the mapping")


def _no_column(error: NoColumn, mapping: LogMapping, path: str) -> Diagnostic:
    what = "topic" if error.name == mapping.topic else "column"
    if not error.known:
        message = f"a log of this format has no topics: {path}"
        return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint="leave out `topic`")
    hint = f"there are: {', '.join(error.known[:12])}" + (", …" if len(error.known) > 12 else "")
    message = f"there is no {what} `{error.name[:60]}` in {path}"
    return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint=hint)
