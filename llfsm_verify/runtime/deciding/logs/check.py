"""Properties decided on a log of others: a row is the letter of one cycle."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.claims import claim_of
from llfsm_verify.checking.problem import bind
from llfsm_verify.checking.replay.confirm import Letter
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic.properties import PropertySet
from llfsm_verify.runtime.deciding.letters import SlotLetters
from llfsm_verify.runtime.deciding.logs import NOT_GIVEN, UNKNOWN, UNREADABLE
from llfsm_verify.runtime.deciding.logs.formats import LOGS, NoColumn, Row, Unreadable, Wanted
from llfsm_verify.runtime.deciding.logs.mapping import LogMapping, read_mapping
from llfsm_verify.runtime.deciding.recordings import Decided, Watch, watches_of
from llfsm_verify.values import ValueProblem

_KEPT = 1 << 16
"""Letters of rows that are remembered, as many rows are equal."""


def check_log(
    arrangement: Arrangement, properties: PropertySet, path: str, mapping_path: str, form: str
) -> list[Decided]:
    """Each property, on a log: its first row is the first letter, and each row, of which the number is `step`, is that
    of one cycle.

    A verdict by some rows holds whatever came after. Of a log that has ended, as the mapping says, the last row repeats
    forever. ModuleNotFoundError: the package for the format is not installed. DiagnosticError: what is wrong with the
    properties, the mapping or the log (E496 to E498).
    """
    problem = bind(arrangement, properties)
    program = problem.program(keep_all_bits=True)
    of_slots = SlotLetters(problem, program)
    mapping = read_mapping(mapping_path, of_slots.slots)
    letters = _Letters(of_slots, mapping)
    if mapping.ended and Path(path).exists() and not Path(path).is_file():
        message = "a log with `ended: true` in its mapping may be read twice, and this is not a regular file"
        raise DiagnosticError(Diagnostic(UNREADABLE, message, file=path, hint="write the log to a file first"))
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

    watches = watches_of(problem, Watch)
    times: dict[int, str] = {}
    count, whole, open_end = 0, True, "the log ends there, and the mapping does not say `ended: true`"
    for count, row in enumerate(rows(), 1):
        try:
            letter = letters.read(row, path)
        except OverflowError as overflow:
            whole, open_end = False, f"{overflow} in row {count:,}"
            break
        for watch in watches:
            watch.read(letter, count, count)
            if watch.place == (count, count) and mapping.time is not None and mapping.time in row.cells:
                times[count] = row.cells[mapping.time]
    if not count:
        raise DiagnosticError(Diagnostic(UNREADABLE, "the log has no rows", file=path))
    if whole and mapping.ended and any(watch.verdict == "undecided" for watch in watches):
        word = [letters.read(row, path) for row in rows()]  # once more: most logs do not need all their letters
        stem, loop = word[:-1], word[-1:]
        assumed = all(claim_of(p, problem.clock).true_on(stem, loop) for p in properties.assumptions)
        for watch in watches:
            watch.decide_on_lasso(stem, loop, assumed=assumed)
    found = [watch.decided(open_end=open_end) for watch in watches]
    return [replace(decided, time=times.get(decided.step or 0)) for decided in found]


class _Letters:
    """The letters of rows."""

    def __init__(self, letters: SlotLetters, mapping: LogMapping) -> None:
        """DiagnosticError (E498): an atom needs what no column gives."""
        mistakes = []
        for atom, needed in letters.needed.items():
            missing = [name for name in needed if name not in mapping.columns]
            if missing:
                mistakes.append(_not_given(atom, missing, letters))
        if mistakes:
            raise DiagnosticError(mistakes)
        self._letters = letters
        self._columns = [(name, column, column.reader()) for name, column in mapping.columns.items()]
        self._known: dict[tuple[int, ...], Letter] = {}

    def read(self, row: Row, path: str) -> Letter:
        """DiagnosticError (E497): a cell is empty, or its value is not a value of its slot."""
        numbers = tuple(_number(name, column.name, reader, row, path) for name, column, reader in self._columns)
        letter = self._known.get(numbers)
        if letter is None:
            if len(self._known) == _KEPT:
                self._known.clear()
            named = {name: number for (name, _, _), number in zip(self._columns, numbers, strict=True)}
            letter = self._known[numbers] = self._letters.letter(named, ticks=True)
        return letter


def _number(slot: str, column: str, reader: Callable[[str], int], row: Row, path: str) -> int:
    text = row.cells.get(column)
    try:
        if text is None:
            raise ValueProblem("the cell has no value")
        return reader(text)
    except ValueProblem as problem:
        message = f"{row.place}, column `{column}` (`{slot}`): {problem}"
        raise DiagnosticError(Diagnostic(UNREADABLE, message, file=path, hint=HINT)) from None


HINT = "say under `columns` in the mapping what its cells mean, or correct the log"


def _not_given(atom: str, missing: list[str], letters: SlotLetters) -> Diagnostic:
    span = letters.place(atom)
    if any(name not in letters.slots for name in missing):
        message = (
            f"`{atom}` asks what happened in a step, what came before it, or whether a machine is loaded, "
            "and a row does not tell it"
        )
        return Diagnostic(NOT_GIVEN, message, span, hint="ask for states, variables and inputs")
    names = ", ".join(f"`{name}`" for name in missing[:5])
    message = f"no column gives {names}" + (f", which `{atom}` needs" if missing != [atom] else "")
    return Diagnostic(NOT_GIVEN, message, span, hint=f"add `{missing[0]}: COLUMN` under `columns` of the mapping")


def _no_column(error: NoColumn, mapping: LogMapping, path: str) -> Diagnostic:
    what = "topic" if error.name == mapping.topic else "column"
    if not error.known:
        message = f"a log of this format has no topics: {path}"
        return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint="leave out `topic`")
    hint = f"there are: {', '.join(error.known[:12])}" + (", …" if len(error.known) > 12 else "")
    message = f"there is no {what} `{error.name[:60]}` in {path}"
    return Diagnostic(UNKNOWN, message, mapping.places.get(error.name), hint=hint)
