"""Hypothesis strategies for inputs of an arrangement, sequences of them, and whole runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import combinations

from hypothesis import strategies as st

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.testing.run import Run, RunFailed, Subject
from llfsm_verify.testing.stretches import Stretch, Wrapper, unwrap
from llfsm_verify.testing.tested import Stimulus, Tested
from llfsm_verify.values import Shown

FEW = 2
"""Most changes touch at most so many inputs."""
WRITTEN_OUT = 900
"""So many pairs of changes are written out."""


def inputs(arrangement: Arrangement | Wrapper | Subject) -> st.SearchStrategy[dict[str, Shown]]:
    """A value for every input that can change, by name (of arrays and records: of each scalar).

    Shrinks towards the inputs' `init`; favours the values around which guards change (`boundaries.boundaries`).
    """
    stimuli = _inputs(_subject(arrangement))
    return st.fixed_dictionaries({name: values(each) for name, each in stimuli.items()})


@st.composite
def input_sequences(
    draw: st.DrawFn, arrangement: Arrangement | Wrapper | Subject, *, min_size: int = 1, max_size: int = 50
) -> list[dict[str, Shown]]:
    """A value for every input, step by step; each keeps its value until it changes, from its `init` on.

    Shrinks towards fewer steps, fewer changes, and earlier ones. Favours boundaries as `inputs` does.
    """
    if not 1 <= min_size <= max_size:
        raise ValueError("sequences have at least one step, and min_size at most max_size")
    stimuli = _inputs(_subject(arrangement))
    size = draw(st.integers(min_size, max_size))
    place = st.integers(0, size - 1)
    at = (
        draw(st.lists(st.tuples(place, changes(stimuli)), max_size=size, unique_by=lambda one: one[0]))
        if stimuli
        else []
    )
    now = {name: each.shown(each.start) for name, each in stimuli.items()}
    changed = dict(at)
    found = []
    for number in range(size):
        now = {**now, **changed.get(number, {})}
        found.append(now)
    return found


@st.composite
def runs(
    draw: st.DrawFn,
    arrangement: Arrangement | Wrapper | Subject,
    *,
    max_stretches: int = 20,
    longest: int | None = None,
) -> Run:
    """A run that the executor has performed; one that violates a property of the subject, or faults, ends there.

    It has at most `max_stretches` stretches, each of at most `longest` cycles. `run.failure` says whether it failed;
    `run.table()` shows it and `run.save(folder)` writes it as a trace file. Shrinks towards few and short stretches.
    """
    subject = _subject(arrangement)
    free = draw(starts(subject))
    try:
        run = subject.start(free)
        for _ in range(draw(st.integers(0, max_stretches))):
            run.take(draw(stretches(run, longest=longest)))
    except RunFailed as failed:
        return failed.run
    return run


def starts(subject: Tested) -> st.SearchStrategy[dict[str, Shown]]:
    """Values for the inputs that have any value at first and keep it, by name."""
    return st.fixed_dictionaries({name: values(each) for name, each in subject.free.items()})


def stretches(run: Run, *, without: Sequence[str] = (), longest: int | None = None) -> st.SearchStrategy[Stretch]:
    """How a run can go on: a few changes of inputs (none of those named in `without`), and for how long.

    At most `longest` cycles. Shrinks towards no change and no turn.
    """
    return _stretches(run.subject, run.simulation.enabled, tuple(without), longest)


@lru_cache(maxsize=64)  # made anew for every stretch they would take most of the time
def _stretches(
    subject: Subject, enabled: tuple[str, ...], without: tuple[str, ...], longest: int | None
) -> st.SearchStrategy[Stretch]:
    """`enabled` are the processes that can step."""
    stimuli = {name: each for name, each in subject.stimuli.items() if name not in without}
    unit = "cycles" if subject.by_cycle else "ringlets"
    size = 1 if subject.by_cycle else max(1, subject.cycle_length)
    most = size * (longest or subject.longest) if enabled else 2 * size  # only stutters are left
    parts: dict[str, st.SearchStrategy[object]] = {}
    if stimuli:
        parts["changes"] = changes(stimuli)
    parts[unit] = _turns(most)
    single = [st.tuples(st.just(choice), values(each)) for each in stimuli.values() for choice in each.choices]
    if single:
        parts["reads"] = st.lists(st.one_of(single), max_size=FEW).map(dict)
    if len(subject.program.processes) > 1 and enabled:
        parts["process"] = st.sampled_from((None, *enabled))
    return st.fixed_dictionaries(parts).map(_stretch)


def _stretch(parts: dict[str, object]) -> Stretch:
    return Stretch(**parts)  # type: ignore[arg-type]  # of what types they are, the strategies above say


def _turns(most: int) -> st.SearchStrategy[int]:
    """0 to `most`, n with a probability like 1/n: one choice, which grows with the number.

    A stretch of no turns joins its changes to those of the next one, so that shrinking can bring changes together.
    """
    return st.sampled_from([0, *(n for n in range(1, most + 1) for _ in range(round(most / n)))])


def changes(stimuli: Mapping[str, Stimulus]) -> st.SearchStrategy[dict[str, Shown]]:
    """New values for some of `stimuli`, mostly few; shrinks towards none.

    What there is to choose from is written out as far as it is short, the fewest changes first: a change is then one
    choice of Hypothesis, which makes drawing and shrinking quick.
    """
    single = [(name, value) for name, each in stimuli.items() for value in each.likely]
    pairs = [(a, b) for a, b in combinations(single, 2) if a[0] != b[0]] if len(single) ** 2 <= WRITTEN_OUT else []
    some = [{name: value} for name, value in single for _ in range(3)] + [dict(pair) for pair in pairs]
    # About half of what there is to choose from changes nothing: the value is the one that the input has.
    likely = st.sampled_from([{}, *some])
    if all(each.is_small for each in stimuli.values()) and (len(stimuli) == 1 or (len(stimuli) == FEW and pairs)):
        return likely
    each = st.one_of([st.tuples(st.just(name), values(each)) for name, each in stimuli.items()])
    return st.one_of(likely, st.lists(each, max_size=len(stimuli), unique_by=lambda one: one[0]).map(dict))


def values(each: Stimulus) -> st.SearchStrategy[Shown]:
    """Values of one input: its `init` first, then those around which something changes, then any."""
    likely = st.sampled_from(each.likely)
    return likely if each.is_small else st.one_of(likely, st.integers(each.type.low, each.type.high).map(each.shown))


def _inputs(subject: Subject) -> dict[str, Stimulus]:
    """The stimuli that are inputs, and neither ages nor what models choose."""
    others = {c.name for c in subject.program.choices if not c.input}
    return {name: each for name, each in subject.stimuli.items() if name not in others}


def _subject(arrangement: Arrangement | Wrapper | Subject) -> Subject:
    return arrangement if isinstance(arrangement, Subject) else Subject(unwrap(arrangement))
