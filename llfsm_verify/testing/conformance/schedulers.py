"""The suite of schedulers."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator

from llfsm_verify.registry import Entry
from llfsm_verify.testing.conformance.outcome import Case
from llfsm_verify.testing.conformance.plugs import demand, entry_of
from llfsm_verify.verification.schedulers import SCHEDULERS, Lost


def squared(number: int) -> int:
    """What workers do; a negative number ends their process."""
    return number * number if number >= 0 else os._exit(1)


def scheduler_cases(scheduler: Entry | str, address: str) -> list[Case]:
    """Of a scheduler, at an `address` where it has workers with this package. Unregistered."""
    make = entry_of(scheduler, SCHEDULERS).load

    def ends(tasks: Iterable[int], most: int) -> list[tuple[int, int | Lost]]:
        found: list[tuple[int, int | Lost]] = []

        def ended(task: int, end: int | Lost) -> None:
            found.append((task, end))
            if len(found) == most:
                raise KeyboardInterrupt

        used = make()(address, 2)  # type: ignore[operator]
        try:
            used.run(squared, tasks, ended)
        except KeyboardInterrupt:
            found.append((-1, Lost("interrupted")))
        finally:
            used.close()
        return found

    def performs() -> None:
        demand(sorted(ends(iter(range(30)), 99)) == [(n, n * n) for n in range(30)], "a result is another one")
        found = dict(ends([1, -1, 2], 99))
        demand(isinstance(found.pop(-1), Lost) and found == {1: 1, 2: 4}, "another task is lost than that one")

    def stops() -> None:
        taken = [0]

        def tasks() -> Iterator[int]:
            for taken[0] in range(10**6):
                yield taken[0]

        demand(ends(tasks(), 1)[-1][0] == -1, "an interrupt does not pass")
        demand(taken[0] < 100, "tasks are taken long before there are workers for them")

    about = "each task once; one that ends its process is lost"
    return [Case("performs", about, performs), Case("stops", "tasks that are given up", stops)]
