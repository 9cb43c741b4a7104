"""Strongly connected components of a finite graph, and the nodes before some."""

from __future__ import annotations

from collections.abc import Sequence


def components(successors: Sequence[Sequence[int]]) -> list[int]:
    """The component of each node 0, 1, …; components are numbered so that edges never lead to a higher number.

    Tarjan, Depth-first search and linear graph algorithms, SIAM J. Comput. 1 (1972), without recursion.
    """
    n = len(successors)
    component, index, low = [-1] * n, [-1] * n, [0] * n
    stack: list[int] = []
    found = counter = 0
    for root in range(n):
        if index[root] >= 0:
            continue
        path: list[tuple[int, int]] = [(root, 0)]
        while path:
            node, i = path.pop()
            if i == 0:
                index[node] = low[node] = counter
                counter += 1
                stack.append(node)
            else:
                low[node] = min(low[node], low[successors[node][i - 1]])
            for k in range(i, len(successors[node])):
                target = successors[node][k]
                if index[target] < 0:
                    path += [(node, k + 1), (target, 0)]
                    break
                if component[target] < 0:
                    low[node] = min(low[node], index[target])
            else:
                if low[node] == index[node]:
                    while component[node] < 0:
                        component[stack.pop()] = found
                    found += 1
    return component


def reaching(targets: Sequence[Sequence[int]], goal: Sequence[bool]) -> list[bool]:
    """The nodes of a graph from which one of `goal` can be reached: backwards from these."""
    sources: list[list[int]] = [[] for _ in targets]
    for state, row in enumerate(targets):
        for target in row:
            sources[target].append(state)
    found = list(goal)
    queue = [state for state, has in enumerate(found) if has]
    for state in queue:
        for source in sources[state]:
            if not found[source]:
                found[source] = True
                queue.append(source)
    return found
