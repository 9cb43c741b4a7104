"""Whether what the surroundings of a run did is a run of their models.

A recording of a run in the world has the inputs that came and what machines made of them, and no plants. The step
program of the arrangement with its plants is performed beside it: of each cycle every way in which plants may choose,
from every configuration in which they can be, and those ways remain that give the inputs of the recording (subset
construction; Rabin and Scott 1959). When none remains, the frame refutes the models.

    $ llfsm check-recording run.rec
    violated  the run keeps to `locate`, `arm` of `environment`
              in frame 17: `locate_state` is DONE, where the models allow IDLE or WAITING
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.checking.replay.execution import Execution
from llfsm_verify.diagnostics import Disagreement, counted
from llfsm_verify.language.trees import of_kind
from llfsm_verify.language.typed import Assign, Read
from llfsm_verify.program.program import Choice, Int, Program
from llfsm_verify.runtime.deciding.recordings import Decision
from llfsm_verify.runtime.live.frame import ENDING
from llfsm_verify.runtime.recording.file import Recording
from llfsm_verify.runtime.recording.origin import Load, arrangement_of, code_of, free_of
from llfsm_verify.runtime.recording.replay import performed, ringlets
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.values import value_text

MOST_WAYS = 200_000
"""Ways of one cycle that are looked at."""
MOST_SHOWN = 4
"""Values that a message lists."""


class TooManyWays(Exception):
    """The plants may do more in one cycle than is looked at."""


@dataclass(frozen=True, slots=True)
class Difference:
    """What the plants cannot have done."""

    inputs: tuple[str, ...]
    """Those that differ; several: each for itself may have its value, but not all of them together."""
    given: Mapping[str, str]
    allowed: tuple[Mapping[str, str], ...]
    """The values that the models may give to `inputs`, in words."""

    @property
    def sentence(self) -> str:
        """What came, and what the models allow."""
        if not self.allowed:
            return "every way of the models ends in a fault"
        if len(self.inputs) == 1:
            (name,) = self.inputs
            values = list(dict.fromkeys(way[name] for way in self.allowed))
            return f"`{name}` is {self.given[name]}, where the models allow {_some(values)}"
        ways = [_together(way) for way in self.allowed]
        return f"{_together(self.given)} do not go together; the models allow {_some(ways, '; ')}"


@dataclass(frozen=True, slots=True)
class Followed:
    """What a recording says of the models of its surroundings."""

    plants: tuple[str, ...]
    verdict: Decision
    frames: int
    """Those of whole cycles that are a run of the models."""
    said: str
    """At which frame they are refuted, or why nothing is known."""


class Plants:
    """The configurations in which the plants of an arrangement can be, cycle by cycle.

    `recorded`: the choices of the runs that are followed. `free`: values of inputs that never change.
    """

    def __init__(self, arrangement: Arrangement, recorded: Sequence[Choice], free: Mapping[str, int]) -> None:
        self.program = lower(arrangement, keep_all_bits=True)
        self._execution = Execution(self.program)
        names = {choice.name for choice in recorded}
        inputs = {choice.input: choice.name for choice in reversed(recorded) if choice.input}
        self._sources = {
            choice.name: choice.name if choice.name in names else inputs[choice.input]
            for choice in self.program.choices
            if choice.name in names or choice.input in inputs
        }
        self._chosen = {c.name: c.type for c in self.program.choices if c.name not in self._sources}
        written = _inputs_of_plants(arrangement, self.program)
        self._places = {name: kind for name, kind in written.items() if name in inputs}  # the others nobody reads
        self.inputs = {name: inputs[name] for name in self._places}
        """The inputs that the plants write, and the recorded choice that has the value of each."""
        once = _written_once(arrangement, self.program, self._chosen)
        self._only = {choice: name for choice, name in once.items() if name in inputs}
        self.records = {self._execution.start(tuple(free.items()))}
        self._known: dict[tuple[bytes, tuple[int, ...]], tuple[bytes, ...]] = {}
        self._left = 0

    def follow(self, moves: Sequence[Mapping[str, int]]) -> Difference | None:
        """A cycle of the run, given the recorded choices of each of its ringlets; None: the plants may have done it.

        Raises TooManyWays; where plants differ, the configurations stay as they are.
        """
        self._left = MOST_WAYS
        if len(self._known) > MOST_WAYS:
            self._known.clear()
        wanted = {name: moves[0][source] for name, source in self.inputs.items()}
        key = tuple(value for move in moves for value in move.values())
        after: set[bytes] = set()
        for record in self.records:
            if (record, key) not in self._known:
                self._known[record, key] = tuple(self._after(record, moves, wanted))
            after.update(self._known[record, key])
        if not after:
            return self._difference(moves, wanted)
        self.records = after
        return None

    def _after(self, record: bytes, moves: Sequence[Mapping[str, int]], wanted: Mapping[str, int]) -> Iterator[bytes]:
        for first in {record for record, given in self._ways(record, moves[0], wanted) if given == wanted}:
            reached = first
            for move in moves[1:]:
                then, _ = self._step(reached, self._given(move))
                if then is None:
                    raise Disagreement("a ringlet fails with the models of the surroundings, and did not without them")
                reached = then
            yield reached

    def _given(self, move: Mapping[str, int]) -> dict[str, int]:
        return {name: move[source] for name, source in self._sources.items() if source in move}

    def _step(self, record: bytes, choices: Mapping[str, int]) -> tuple[bytes | None, dict[str, int]]:
        """One ringlet: the record after it (None: a fault), and what it chose of what is not recorded."""
        self._left -= 1
        if self._left < 0:
            raise TooManyWays(f"the models may act in more than {MOST_WAYS:,} ways")
        native = self._execution.native
        result = native.step(record, 0, choices)
        names = ((self.program.choices[number].name, value) for number, value in result.samples)
        chosen = {name: value for name, value in names if name in self._chosen}
        return None if result.status else result.record, chosen

    def _ways(
        self, record: bytes, move: Mapping[str, int], wanted: Mapping[str, int]
    ) -> Iterator[tuple[bytes, dict[str, int]]]:
        """The records after the first ringlet of a cycle, and what the inputs of plants are then.

        What is chosen for an input that is written nowhere else has its wanted value.
        """
        given = self._given(move)
        given |= {name: value for name, scalar in self._only.items() if self._fits(name, value := wanted[scalar])}
        open_ones: list[dict[str, int]] = [{}]
        while open_ones:
            taken = open_ones.pop()
            after, chosen = self._step(record, {**given, **taken})
            before = dict(taken)
            for name, value in chosen.items():
                if name in given or name in taken:
                    continue
                kind = self._chosen[name]
                open_ones += [before | {name: other} for other in range(kind.low, kind.high + 1) if other != value]
                before[name] = value
            if after is not None:
                values = self._execution.layout.decode(after)
                yield after, {name: _number(values[name]) for name in self._places}

    def _fits(self, name: str, value: int) -> bool:
        return self._chosen[name].low <= value <= self._chosen[name].high

    def _difference(self, moves: Sequence[Mapping[str, int]], wanted: Mapping[str, int]) -> Difference:
        found = {tuple(given.items()) for record in self.records for _, given in self._ways(record, moves[0], wanted)}
        ways = [dict(way) for way in sorted(found)]
        wrong = [name for name, value in wanted.items() if all(way[name] != value for way in ways)]
        names = tuple(wrong[:1] or wanted)
        given = {name: self._text(name, wanted[name]) for name in names}
        allowed = dict.fromkeys(tuple((name, self._text(name, way[name])) for name in names) for way in ways)
        return Difference(names, given, tuple(dict(way) for way in allowed))

    def _text(self, name: str, value: int) -> str:
        kind, labels = self._places[name]
        return value_text(kind, labels, value)


def check_surroundings(recording: Recording, load: Load, instead: str | None = None) -> Followed | None:
    """Whether what the surroundings did in a recording is a run of the models that its arrangement has of them, or that
    the one in the file `instead` has; None: it has none, or the models made the run themselves.

    DiagnosticError: the recording is damaged before its first frame. Differs: it is of another arrangement.
    """
    arrangement = arrangement_of(recording, load, instead, modelled=True)
    if not arrangement.plants or recording.header.get("simulated"):
        return None
    names = tuple(plant.request.name if plant.request else plant.name for plant in arrangement.plants)
    if recording.goes_on:
        return Followed(names, "undecided", 0, "it goes on with an earlier run, so it does not tell how that began")
    code = code_of(recording, arrangement_of(recording, load, instead))
    plants = Plants(arrangement, code.program.choices, free_of(recording, code.program))
    done = frames = 0
    for turn in performed(recording, code):
        moves = [] if turn.frame[ENDING] else [r.move.choices for r in ringlets([turn], code, done=done) if not r.fails]
        done += len(moves)
        if not moves:
            continue
        number = turn.frame[0]
        try:
            difference = plants.follow(moves)
        except TooManyWays as many:
            return Followed(names, "undecided", frames, f"in frame {number:,} {many}")
        if difference is not None:
            return Followed(names, "violated", frames, f"in frame {number:,}: {difference.sentence}")
        frames += 1
    if recording.damaged is not None:
        return Followed(
            names, "undecided", frames, f"it is damaged after {counted(frames, 'cycle')}: {recording.damaged}"
        )
    return Followed(names, "satisfied", frames, f"all {counted(frames, 'cycle')} are a run of them")


def _inputs_of_plants(arrangement: Arrangement, program: Program) -> dict[str, tuple[Int, tuple[str, ...]]]:
    """The scalars of inputs that plants write, with their types and labels."""
    driven = tuple(w.variable.name for w in arrangement.whiteboard if w.driven)
    found: dict[str, tuple[Int, tuple[str, ...]]] = {}
    for var in program.vars:
        if var.origin.kind == "input" and _variable(var.name) in driven:
            assert isinstance(var.type, Int)
            found[var.name] = var.type, var.origin.labels
    return found


def _written_once(arrangement: Arrangement, program: Program, chosen: Mapping[str, Int]) -> dict[str, str]:
    """The choices whose value is that of an input after the cycle, with that input: one statement writes it."""
    names = [choice.name for choice in program.choices]
    found: dict[str, str] = {}
    for plant in arrangement.plants:
        stores = [a.target for a in of_kind(plant.actions, Assign) if isinstance(a.target, Read)]
        for name in (scalar for scalar in _inputs_of_plants(arrangement, program) if scalar == _variable(scalar)):
            choice = f"{plant.name}.choose({name})"
            once = sum(target.variable.name == name for target in stores) == 1 and f"{choice}#2" not in names
            if choice in chosen and once and _is_whole(program, choice, name):
                found[choice] = name
    return found


def _is_whole(program: Program, choice: str, name: str) -> bool:
    """Whether a choice has the values of an input themselves, and not their numbers in a list."""
    kinds = {c.name: (c.type.low, c.labels) for c in program.choices}
    var = next(v for v in program.vars if v.name == name)
    return isinstance(var.type, Int) and kinds[choice] == (var.type.low, var.origin.labels)


def _variable(scalar: str) -> str:
    return scalar.partition(".")[0].partition("[")[0]


def _number(value: int | tuple[int, ...]) -> int:
    assert isinstance(value, int), "inputs are stored scalar by scalar"
    return value


def _some(texts: Sequence[str], between: str = ", ") -> str:
    shown = list(texts[:MOST_SHOWN])
    last = f"{len(texts) - MOST_SHOWN:,} more" if len(texts) > MOST_SHOWN else shown.pop()
    return f"{between.join(shown)} or {last}" if shown else last


def _together(values: Mapping[str, str]) -> str:
    return ", ".join(f"`{name}` = {value}" for name, value in values.items())
