"""The declarative closure tableau of a formula: exponential in every case, and short enough to be read at once.

A state says which atoms and which temporal subformulas are true. The expansion laws tie each state to the next; the
acceptance sets rule out an `U`, `F` or `M` that is never fulfilled, and a `W`, `G` or `R` that is false for no reason.
"""

from itertools import product

from llfsm_verify.automata.automaton import Automaton, Edge
from llfsm_verify.logic.formula import postorder

TEMPORAL = ("X", "F", "G", "U", "W", "R", "M")


def tableau(formula, keys):
    """The automaton of `formula` over the atoms `keys`; letters are on the edges into the states they belong to."""
    nodes = postorder(formula)
    temporal = [node for node in nodes if node.op in TEMPORAL]
    free = [node for node in nodes if node.op == "atom"] + temporal
    assert all(node.key in keys for node in free if node.op == "atom")
    states = [
        valued(nodes, dict(zip(free, values, strict=True))) for values in product((False, True), repeat=len(free))
    ]
    sets = [node for node in temporal if node.op != "X"]

    def into(k):
        state = states[k]
        positive = sum(
            1 << i for i, key in enumerate(keys) if any(n.key == key and state[n] for n in free if not n.args)
        )
        negative = sum(
            1 << i for i, key in enumerate(keys) if any(n.key == key and not state[n] for n in free if not n.args)
        )
        acceptance = sum(1 << i for i, node in enumerate(sets) if fair(node, state))
        return Edge(positive, negative, k + 1, acceptance)

    edges = [into(k) for k in range(len(states))]
    rows = [tuple(edges[k] for k, state in enumerate(states) if state[formula])]
    rows += (
        tuple(edges[k] for k, following in enumerate(states) if all(agrees(n, state, following) for n in temporal))
        for state in states
    )
    return Automaton(tuple(keys), tuple(rows), len(sets))


def valued(nodes, values):
    """The truth of all subformulas from that of atoms and temporal ones."""
    truth = dict(values)
    for node in nodes:
        args = [truth[a] for a in node.args]
        match node.op:
            case "true" | "false":
                truth[node] = node.op == "true"
            case "not":
                truth[node] = not args[0]
            case "and":
                truth[node] = all(args)
            case "or":
                truth[node] = any(args)
            case "xor":
                truth[node] = args[0] != args[1]
            case "iff":
                truth[node] = args[0] == args[1]
            case "implies":
                truth[node] = not args[0] or args[1]
    return truth


def agrees(node, state, following):
    """The expansion law of `node` holds between a state and the next one."""
    a, b = state[node.args[0]], state[node.args[-1]]
    match node.op:
        case "X":
            return state[node] == following[node.args[0]]
        case "F":
            return state[node] == (a or following[node])
        case "G":
            return state[node] == (a and following[node])
        case "U" | "W":
            return state[node] == (b or (a and following[node]))
        case "R" | "M":
            return state[node] == (b and (a or following[node]))


def fair(node, state):
    """The state does not put off what must happen for `node` to be true, or to be false."""
    a, b = state[node.args[0]], state[node.args[-1]]
    match node.op:
        case "F":
            return not state[node] or a
        case "U":
            return not state[node] or b
        case "M":
            return not state[node] or (a and b)
        case "G":
            return state[node] or not a
        case "W":
            return state[node] or not (a or b)
        case "R":
            return state[node] or not b
