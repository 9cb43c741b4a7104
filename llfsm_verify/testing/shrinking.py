"""A failed run made shorter: what Hypothesis cannot try, since it changes one choice at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain, pairwise, product

from llfsm_verify.testing.run import Run, RunFailed
from llfsm_verify.testing.stretches import Stretch
from llfsm_verify.values import Shown

MAX_TRIES = 5_000
"""Runs that are tried for one failure: well below a second of machine code."""
FEW_PAIRS = 600
"""So many lengths of two stretches are tried together."""


def polish(run: Run) -> Run:
    """A run that fails in the same way with no more steps and changes: `run` itself, when none is found.

    Greedy: stretches are left out or made shorter, and changes are left out or replaced by others, as long as the run
    still fails earlier, or as early with fewer changes. The last stretch may become longer meanwhile, as far as the sum
    becomes smaller.
    """
    best, tries = run, 0
    others = [(name, value) for name, knob in run.subject.knobs.items() for value in knob.likely]
    improved = True
    while improved:
        improved = False
        for candidate in chain(_candidates(best.stretches), _with_others(best.stretches, others)):
            tries += 1
            if tries > MAX_TRIES:
                return best
            found = _failing(best, candidate)
            if found is not None and (found.steps, found.changes) < (best.steps, best.changes):
                best, improved = found, True
                break
    return best


def _candidates(stretches: Sequence[Stretch]) -> Iterator[list[Stretch]]:
    """Simpler runs: fewer stretches, then shorter ones, two at once where that is little work, then fewer changes."""
    total, count = sum(one.turns for one in stretches), len(stretches)
    for size in range(count - 1, 0, -1):
        for i in range(count - size + 1):
            front, back = stretches[:i], stretches[i + size :]
            yield _ending(front, back, total)
            if front and back:
                yield from (_ending([*front[:-1], front[-1].of(n)], back, total) for n in range(1, total))
    for i, one in enumerate(stretches[:-1]):
        for turns in range(one.turns):
            yield _ending([*stretches[:i], one.of(turns)], stretches[i + 1 :], total)
    for i, (one, two) in enumerate(pairwise(stretches[:-1])):
        if one.turns * two.turns <= FEW_PAIRS:
            for a, b in product(range(one.turns + 1), range(two.turns + 1)):
                yield _ending([*stretches[:i], one.of(a), two.of(b)], stretches[i + 2 :], total)
    for i, one in enumerate(stretches):
        for name in one.changes:
            rest = {other: value for other, value in one.changes.items() if other != name}
            yield [*stretches[:i], replace(one, changes=rest), *stretches[i + 1 :]]
        for name in one.reads:
            rest = {other: value for other, value in one.reads.items() if other != name}
            yield [*stretches[:i], replace(one, reads=rest), *stretches[i + 1 :]]


def _with_others(stretches: Sequence[Stretch], others: Sequence[tuple[str, Shown]]) -> Iterator[list[Stretch]]:
    """One change is replaced by each of `others`, of the same input or another one."""
    total = sum(one.turns for one in stretches)
    for i, one in enumerate(stretches):
        for name, value in one.changes.items():
            rest = {n: v for n, v in one.changes.items() if n != name}
            for other in others:
                if other[0] not in rest and other != (name, value):
                    changed = replace(one, changes={**rest, other[0]: other[1]})
                    yield _ending([*stretches[:i], changed], stretches[i + 1 :], total)


def _ending(front: Sequence[Stretch], back: Sequence[Stretch], total: int) -> list[Stretch]:
    """Both, the last stretch as long as the sum allows: it ends with the failure."""
    found = [*front, *back]
    if found:
        found[-1] = found[-1].of(max(1, total - sum(one.turns for one in found[:-1])))
    return found


def _failing(run: Run, stretches: Sequence[Stretch]) -> Run | None:
    """A run of these stretches, if it fails as `run` does."""
    assert run.failure is not None
    try:
        again = run.subject.start(run.free)
        for stretch in stretches:
            again.take(stretch)
    except RunFailed as failed:
        same = failed.failure.fault == run.failure.fault and set(failed.failure.names) >= set(run.failure.names)
        return failed.run if same else None
    return None
