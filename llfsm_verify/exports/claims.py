"""Büchi automata as never claims of SPIN that read one letter a step."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.automata.automaton import Automaton, Edge

State = tuple[int, int]
"""A state of the automaton, and the acceptance set that has to come next; after the last one comes acceptance."""


def never_claim(name: str, automaton: Automaton, proposition: Callable[[str], str]) -> str:
    """The claim that the automaton accepts the letters of the states in which `tick` holds.

    `tick` has to hold in one state of each step and not in the next, and infinitely often. Acceptance sets are waited
    for one after the other (degeneralization: Gastin and Oddoux, Fast LTL to Büchi Automata Translation, CAV 2001).
    """
    if automaton.is_empty:
        return f"never {name} {{ /* no word */\nT0:\n  if\n  :: false -> goto T0\n  fi\n}}"
    sets = automaton.acceptance_sets
    texts = [proposition(key) for key in automaton.atoms]
    first: State = (0, 0)
    found, queue, lines = {first}, [first], [f"never {name} {{"]
    for state in queue:
        lines += [f"{_label(state, sets)}:", "  if", f"  :: (!tick) -> goto {_label(state, sets)}"]
        for edge in automaton.edges[state[0]]:
            target = edge.target, _waiting(edge, state[1] % sets if sets else 0, sets)
            lines.append(f"  :: ({' && '.join(['tick', *_guard(edge, texts)])}) -> goto {_label(target, sets)}")
            if target not in found:
                found.add(target)
                queue.append(target)
        lines.append("  fi;")
    lines[-1] = "  fi"
    return "\n".join([*lines, "}"])


def _waiting(edge: Edge, waiting: int, sets: int) -> int:
    while waiting < sets and edge.acceptance >> waiting & 1:
        waiting += 1
    return waiting


def _guard(edge: Edge, texts: list[str]) -> list[str]:
    yes = [text for i, text in enumerate(texts) if edge.positive >> i & 1]
    no = [f"!{text}" for i, text in enumerate(texts) if edge.negative >> i & 1]
    return [*yes, *no]


def _label(state: State, sets: int) -> str:
    accepting = state[1] == sets
    return f"{'accept' if accepting else 'T'}_{state[0]}_{state[1]}"
