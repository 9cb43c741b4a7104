"""The monitor of a line of a property file, whatever its kind."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.automata.omega.complement import NotDeterministic, complement
from llfsm_verify.automata.omega.products import explore
from llfsm_verify.automata.properties import load_automata, over, regular_monitor
from llfsm_verify.diagnostics import Diagnostic, DiagnosticError
from llfsm_verify.logic import codes
from llfsm_verify.logic.bounds import TICK, Clock
from llfsm_verify.logic.formula import TIMED, Formula, atoms, conjunction, operators
from llfsm_verify.logic.properties import Property, PropertySet
from llfsm_verify.monitoring.monitor import always_ticking, monitor, monitor_of, timed_automaton
from llfsm_verify.monitoring.regular import regular_to_monitor
from llfsm_verify.monitoring.states import Monitor, MonitorVerdict

MAX_PAIRS = 20_000


@dataclass(frozen=True, slots=True)
class Timing:
    """What bounds in time mean (`clock` None: no formula has any), and whether time passes after every letter."""

    clock: Clock | None = None
    every_letter_ticks: bool = False


UNTIMED = Timing()


@dataclass(frozen=True, slots=True)
class Monitored:
    """A property with its monitor. `line.atoms` has the places of all atoms of the monitor but those of assumptions."""

    line: Property
    monitor: Monitor


def monitor_properties(line: Property, assumptions: Sequence[Property] = (), timing: Timing = UNTIMED) -> Monitored:
    """The monitor of `line` over its atoms and those of the assumptions (and TICK: see `monitor.monitor`).

    Under assumptions only those continuations count that satisfy them. DiagnosticError: the property is void (E342,
    E344), its file is wrong (E301 on, E360 on), or the complement of its automaton would need a determinisation (E364).
    AutomatonTooLarge: a limit was reached. Untranslatable: there are bounds in time and no clock.
    """
    given = conjunction(a.formula for a in assumptions if a.formula is not None) if assumptions else None
    if line.file is not None:
        return _of_automaton(line, given, timing)
    order = _order(line.atoms, given)
    if line.formula is not None:
        clock, ticks = timing.clock, timing.every_letter_ticks
        return Monitored(line, monitor(line.formula, order, given=given, clock=clock, every_letter_ticks=ticks))
    assert line.expression is not None
    assert line.kind in ("enforce", "forbid", "forbid initially")
    regular_monitor(line, order)  # says what is wrong with a property that is void
    found = regular_to_monitor(line.kind, line.expression, order)
    if given is None:
        return Monitored(line, found)
    good, bad = _sides(found)
    return Monitored(line, _under(good, bad, given, timing))


def _order(own: Iterable[str], given: Formula | None) -> tuple[str, ...]:
    """A property's atoms and those of its assumptions."""
    return tuple(dict.fromkeys((*own, *(atoms(given) if given is not None else ()))))


def _under(good: Automaton, bad: Automaton, given: Formula, timing: Timing) -> Monitor:
    keys = good.atoms
    if operators(given) & TIMED:
        keys = (*keys, TICK)
    assumed = timed_automaton(given, keys, timing.clock)
    if timing.every_letter_ticks:
        assumed = always_ticking(assumed)
    both = (_intersection(assumed, over(side, keys)) for side in (good, bad))
    return monitor_of(*both)


def _of_automaton(line: Property, given: Formula | None, timing: Timing) -> Monitored:
    """An `automaton` line: what its file accepts, and what that does not."""
    loaded, automata = load_automata(PropertySet((replace(line, kind="automaton never"),)))
    accepted = automata[line.name]
    try:
        rejected = complement(accepted)
    except NotDeterministic:
        message = "this automaton is not deterministic, so the runs that it does not accept cannot be told"
        other = "automaton" if line.kind == "automaton never" else "automaton never"
        hint = (
            f"a monitor needs both sides: write `{other} {line.name}:` with a deterministic automaton of the negation, "
            "or make this one deterministic; one of the two is possible for recurrence and persistence"
        )
        raise DiagnosticError(Diagnostic(codes.AUTOMATON_COMPLEMENT, message, line.span, hint=hint)) from None
    order = _order(accepted.atoms, given)
    good, bad = (over(a, order) for a in (accepted, rejected))
    if line.kind == "automaton never":
        good, bad = bad, good
    found = monitor_of(good, bad) if given is None else _under(good, bad, given, timing)
    return Monitored(replace(line, atoms=loaded.properties[0].atoms), found)


def _sides(found: Monitor) -> tuple[Automaton, Automaton]:
    """The words of a safety property, given by its monitor, and the others."""
    bad = [verdict is MonitorVerdict.FALSE for verdict in found.verdicts]
    good_rows = tuple(
        tuple(Edge(e.positive, e.negative, e.target, 0) for e in row if not bad[e.target] and not bad[q])
        for q, row in enumerate(found.edges)
    )
    bad_rows = tuple(
        tuple(Edge(e.positive, e.negative, e.target, int(bad[q])) for e in row) for q, row in enumerate(found.edges)
    )
    return Automaton(found.atoms, good_rows, 0), Automaton(found.atoms, bad_rows, 1)


def _intersection(left: Automaton, right: Automaton) -> Automaton:
    """The words of both. AutomatonTooLarge: more than `MAX_PAIRS` pairs of states."""
    sets = left.acceptance_sets + right.acceptance_sets
    if left.is_empty or right.is_empty:
        return Automaton(left.atoms, (), sets)

    def following(pair: tuple[int, int]) -> Iterator[tuple[int, int, tuple[int, int], int]]:
        for a in left.edges[pair[0]]:
            for b in right.edges[pair[1]]:
                positive, negative = a.positive | b.positive, a.negative | b.negative
                if not positive & negative:
                    acceptance = b.acceptance << left.acceptance_sets | a.acceptance
                    yield positive, negative, (a.target, b.target), acceptance

    return explore((0, 0), following, left.atoms, sets, MAX_PAIRS)


def shown(key: str) -> str:
    """An atom as users see it; no atom of theirs has such a name as the one that tells whether time passes."""
    return "$tick" if key == TICK else key
