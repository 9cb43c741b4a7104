"""A formula up to the names of its atoms: many formulas of one pattern have one shape."""

from __future__ import annotations

from llfsm_verify.logic.bounds import HIDDEN, rebuilt
from llfsm_verify.logic.formula import Formula, atom, postorder


def shape(*formulas: Formula) -> tuple[tuple[Formula, ...], dict[str, str]]:
    """`formulas` with their atoms renamed in order of first appearance, the same for all formulas of one pattern; and
    the atoms' keys by the new ones, in that order."""
    names: dict[str, str] = {}
    done: dict[Formula, Formula] = {}
    for node in postorder(*formulas):
        if node.op == "atom":
            name = f"{HIDDEN}shape{len(names)}"
            names[name] = node.key
            done[node] = atom(name)
        elif node.args:
            done[node] = rebuilt(node, tuple(done[a] for a in node.args))
        else:
            done[node] = node
    return tuple(done[f] for f in formulas), names
