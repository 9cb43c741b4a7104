"""Automata as text in the Hanoi Omega-Automata format, version 1."""

from __future__ import annotations

from llfsm_verify.plug import Automaton, is_deterministic
from llfsm_verify.plug import AutomatonEdge as Edge


def write_hoa(automaton: Automaton, name: str | None = None) -> str:
    """`automaton` with acceptance on transitions; one without states gets a state that leads nowhere."""
    sets = automaton.acceptance_sets
    kind = "all" if sets == 0 else "Buchi" if sets == 1 else f"generalized-Buchi {sets}"
    condition = "&".join(f"Inf({k})" for k in range(sets)) or "t"
    atoms = " ".join([str(len(automaton.atoms)), *map(_quoted, automaton.atoms)])
    properties = ["trans-labels", "explicit-labels", "trans-acc", "no-univ-branch"]
    properties += ["deterministic"] if is_deterministic(automaton) else []
    lines = [
        "HOA: v1",
        *([f"name: {_quoted(name)}"] if name is not None else []),
        f"States: {max(1, len(automaton.edges))}",
        "Start: 0",
        f"AP: {atoms}",
        f"acc-name: {kind}",
        f"Acceptance: {sets} {condition}",
        f"properties: {' '.join(properties)}",
        "--BODY--",
    ]
    for state, row in enumerate(automaton.edges or ((),)):
        lines.append(f"State: {state}")
        lines += _transitions(row, sets)
    return "\n".join([*lines, "--END--"]) + "\n"


def _transitions(row: tuple[Edge, ...], sets: int) -> list[str]:
    labels: dict[tuple[int, int], list[str]] = {}
    for edge in row:
        labels.setdefault((edge.target, edge.acceptance), []).append(_cube(edge))
    return [
        f"[{' | '.join(cubes)}] {target}"
        + (f" {{{' '.join(str(k) for k in range(sets) if acceptance >> k & 1)}}}" if acceptance else "")
        for (target, acceptance), cubes in labels.items()
    ]


def _cube(edge: Edge) -> str:
    used = edge.positive | edge.negative
    literals = [f"{'' if edge.positive >> i & 1 else '!'}{i}" for i in range(used.bit_length()) if used >> i & 1]
    return "&".join(literals) or "t"


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
