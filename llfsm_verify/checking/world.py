"""Which atoms are about the surroundings alone: what the arrangement does has no part in them."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.arrangement.model import WhiteboardVariable
from llfsm_verify.checking.problem import Problem
from llfsm_verify.language.trees import nodes
from llfsm_verify.language.typed import AtState, Observe, Query, Read, Sampled, Sampling
from llfsm_verify.semantics.letters import Observed, TimePasses

OWN = (AtState, Observe, Query, Sampled, Sampling)
"""What asks about machines: also what they have sampled."""


def world_atoms(problem: Problem) -> frozenset[str]:
    """The names of the atoms that read inputs only, and of the one that says that time passes.

    Not those that the model of the surroundings writes: what it does may follow from outputs.
    """
    return _atoms(problem, lambda variable: variable.role == "input" and not variable.driven)


def are_about_world(problem: Problem) -> bool:
    """Whether all assumptions are about the surroundings alone: then no arrangement escapes them."""
    about = world_atoms(problem)
    return all(about.issuperset(line.atoms) for line in problem.assumptions)


def fixed_atoms(problem: Problem) -> frozenset[str]:
    """The names of the atoms that read only inputs which never change."""
    passing = {a.name for a in problem.atoms if isinstance(a.expression, TimePasses)}
    return _atoms(problem, lambda v: v.role == "input" and v.changes == "never") - passing


def _atoms(problem: Problem, wanted: Callable[[WhiteboardVariable], bool]) -> frozenset[str]:
    names = {w.variable.name for w in problem.arrangement.whiteboard if wanted(w)}
    return frozenset(atom.name for atom in problem.atoms if _reads_only(atom, names))


def _reads_only(atom: Observed, names: set[str]) -> bool:
    return not any(
        isinstance(node, OWN) or (isinstance(node, Read) and node.variable.name not in names)
        for node in nodes(atom.expression)
    )
