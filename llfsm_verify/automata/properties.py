"""Properties that are no formulas: automata from files, and the monitors of regular expressions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.boolean import Guards
from llfsm_verify.automata.files import AUTOMATA, HOA, FileAutomaton
from llfsm_verify.automata.finite.monitor import EmptyWordForbidden, NoWord, RegularMonitor
from llfsm_verify.automata.omega.complement import has_complement
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError, Fragment
from llfsm_verify.logic import codes
from llfsm_verify.logic.expressions import letters
from llfsm_verify.logic.formula import Formula, atoms, to_text
from llfsm_verify.logic.parsing.words import atom_place
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.logic.reading import read_source
from llfsm_verify.logic.regular import exclusions, state_groups


def load_automata(properties: PropertySet) -> tuple[PropertySet, Mapping[str, Automaton]]:
    """The properties with the atoms of their automata, and by the name of each `automaton` line what its file holds.

    Files are relative to the property file (or to the working directory, for properties from elsewhere). `automaton
    NAME: FILE`: every run must be accepted; `automaton never NAME: FILE`: none may. DiagnosticError: E301 to E304 and
    E360 to E363 (the file), E364 (the automaton of the allowed runs has no `complement`).
    """
    found: list[Property] = []
    automata: dict[str, Automaton] = {}
    mistakes: list[Diagnostic] = []
    for line in properties:
        if line.file is None:
            found.append(line)
            continue
        try:
            automaton, atoms = _automaton(line)
        except DiagnosticError as error:
            mistakes += error.diagnostics
            continue
        if line.kind == "automaton" and not has_complement(automaton):
            message = "this automaton is not deterministic, so the runs that it does not accept cannot be told"
            hint = (
                f"write `automaton never {line.name}:` with an automaton of the negation, which may be of any kind; or "
                "make this one deterministic, which not every automaton can be (`autfilt --deterministic`)"
            )
            mistakes.append(Diagnostic(codes.AUTOMATON_COMPLEMENT, message, line.span, hint=hint))
        automata[line.name] = automaton
        found.append(replace(line, atoms=atoms))
    if mistakes:
        raise DiagnosticError(mistakes)
    return PropertySet(tuple(found)), MappingProxyType(automata)


def _automaton(line: Property) -> tuple[Automaton, Mapping[str, Fragment]]:
    """The automaton of the file that `line` names, over atoms in their one spelling, with their places in it."""
    assert line.file is not None
    folder = Path(line.span.source.name).parent
    read = _read(folder / line.file, line)
    places: dict[str, Fragment] = {}
    for text, span in read.places.items():
        place = atom_place(Fragment.whole(span.source), span.start - 1, span.end + 1, True, {})
        if place.text in places:
            raise DiagnosticError(Diagnostic(codes.HOA, f'"{text}" is one proposition with another one', span))
        places[place.text] = place
    return Automaton(tuple(places), read.automaton.edges, read.automaton.acceptance_sets), places


def _read(path: Path, line: Property) -> FileAutomaton:
    """The automaton of the file. A mistake in it is shown with its line only where that file is one of automata."""
    try:
        source = read_source(path, regular=True)
    except DiagnosticError as error:
        found = error.diagnostics[0]
        message = "this is not UTF-8 text" if found.code == codes.NOT_TEXT else found.message
        raise DiagnosticError(replace(found, message=f"`{line.file}`: {message}", span=line.span)) from None
    hoa = AUTOMATA.load(HOA)
    try:
        return hoa.read_one(source)
    except DiagnosticError as error:
        if hoa.is_recognised(source):
            raise
        message = f"`{line.file}` is not a file of automata: no line of it begins with `HOA:`"
        hint = "name a file in the format HOA, version 1"
        raise DiagnosticError(Diagnostic(error.diagnostics[0].code, message, line.span, hint=hint)) from None


def over(automaton: Automaton, atom_order: Sequence[str]) -> Automaton:
    """The same automaton over other atoms, of which its own are some. ValueError: one is missing."""
    bits = [1 << list(atom_order).index(key) for key in automaton.atoms]

    def spread(mask: int) -> int:
        return sum(bit for i, bit in enumerate(bits) if mask >> i & 1)

    edges = tuple(
        tuple(Edge(spread(e.positive), spread(e.negative), e.target, e.acceptance) for e in row)
        for row in automaton.edges
    )
    return Automaton(tuple(atom_order), edges, automaton.acceptance_sets)


def regular_monitor(line: Property, atom_order: Sequence[str], possible: Formula | None = None) -> RegularMonitor:
    """The monitor of an `enforce` or `forbid` line; see `RegularMonitor`. DiagnosticError: it is void (E342, E344)."""
    assert line.expression is not None
    assert line.kind in ("enforce", "forbid", "forbid initially")
    try:
        return RegularMonitor(line.kind, line.expression, atom_order, possible)
    except NoWord:
        guards = Guards(atom_order)
        world = guards.of(exclusions(atom_order) if possible is None else possible)
        message = "no sequence of configurations matches this: two neighbours always differ in some letter"
        hint = "letters that hold in the same configurations cannot follow each other"
        for letter in letters(line.expression):
            if not guards.of(letter) & world:
                message = f"no sequence of configurations matches this: `{to_text(letter)}` holds in none"
                hint = "write a letter that some configuration satisfies"
                if state_groups(atoms(letter)):
                    hint = "a machine is in one state at a time"
        raise DiagnosticError(Diagnostic(codes.REGULAR_NOTHING, message, line.span, hint=hint)) from None
    except EmptyWordForbidden:
        message = f"the empty word matches this, and `{line.kind}` would forbid everything"
        raise DiagnosticError(Diagnostic(codes.REGULAR_EMPTY, message, line.span)) from None
