"""All configurations of a small arrangement, found by the direct interpreter: what the oracles of verdicts search."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.language.typed import Expression
from tests.oracle.direct import Configuration, Direct

Letter = frozenset[str]
"""The atoms that hold."""


class TooLargeError(Exception):
    """More configurations or steps than are looked at."""


@dataclass(frozen=True, slots=True)
class Edge:
    """From one letter to the next: a step, or a whole cycle where those are observed."""

    target: Configuration
    letter: Letter
    moved: frozenset[int]
    """The processes that stepped."""


@dataclass
class Graph:
    """Configurations without what only their letter shows."""

    roots: list[tuple[Configuration, Letter]] = field(default_factory=list)
    edges: dict[Configuration, dict[Edge, None]] = field(default_factory=dict)
    """In the order in which they were found, which is always the same."""
    faults: set[tuple[str, int]] = field(default_factory=set)
    wide: bool = False
    """Some integer leaves 64 bits."""


def explore(arrangement: Arrangement, atoms: Mapping[str, Expression], largest: int, most: int) -> Graph:
    """At most `largest` configurations, by at most `most` steps. Raises TooLargeError."""
    direct, found = Direct(arrangement, dict(atoms)), Graph()
    for first in direct.initial():
        letter = direct.letter(first, _nothing_to_choose)
        found.roots.append((_settled(first), frozenset(n for n, holds in letter.items() if holds)))
        if len(found.roots) > largest:
            raise TooLargeError
    todo, steps = [c for c, _ in found.roots], 0
    while todo:
        c = todo.pop()
        if c in found.edges:
            continue
        found.edges[c] = {}
        if len(found.edges) > largest:
            raise TooLargeError
        inside: list[tuple[Configuration, frozenset[int]]] = [(c, frozenset())]
        seen = set(inside)
        while inside:
            at, moved = inside.pop()
            for process, _, step in direct.successors(at):
                steps += 1
                if steps > most:
                    raise TooLargeError
                if step.wide:
                    found.wide = True
                elif step.after is None:
                    assert step.fault is not None
                    found.faults.add(step.fault)
                elif step.letter is None:
                    further = (step.after, moved if process is None else moved | {process})
                    if further not in seen:
                        seen.add(further)
                        inside.append(further)
                else:
                    target = _settled(step.after)
                    letter = frozenset(n for n, holds in step.letter.items() if holds)
                    edge = Edge(target, letter, moved if process is None else moved | {process})
                    found.edges[c][edge] = None
                    todo.append(target)
    return found


def _settled(c: Configuration) -> Configuration:
    """Without what the last step has shown, on which nothing later depends."""
    return replace(c, ran=frozenset(), fired=frozenset(), shown=(), cycle=True, started=True)


def _nothing_to_choose(kind: str, name: str, values: Sequence[object]) -> int:
    raise AssertionError(f"the first letter chooses {kind} {name}")
