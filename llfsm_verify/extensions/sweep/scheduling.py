"""The scheduler of a sweep: one of the registered ones, of which each task gets an outcome, also one that was lost."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from llfsm_verify.extensions.sweep.task import Outcome, Scheduler, Task
from llfsm_verify.extensions.sweep.worker import guarded, patience
from llfsm_verify.plug import SCHEDULERS, LostTask, TaskScheduler, Unregistered

PROCESSES = "processes"
"""The scheduler where no address is given."""
HOST = re.compile(r"(?:localhost|[\w-]+(?:\.[\w-]+)+|[\w.-]+:[0-9]+|\[[0-9a-fA-F:]+\]:[0-9]+)(?::[0-9]+)?\Z", re.ASCII)
"""A machine, and perhaps a port, without a scheme before it."""


def opened(address: str | None = None, workers: int | None = None) -> Scheduler:
    """The scheduler at an address such as `tcp://host:8786` (None: processes of this machine, as many as `workers`,
    or else as processors).

    Unregistered: there is none for the address. ModuleNotFoundError, DiagnosticError: it cannot be used.
    """
    address = PROCESSES if address is None else address
    if address not in SCHEDULERS and HOST.match(address) and "tcp" in SCHEDULERS:
        instead = f"tcp://{address}" if ":" in address else f"tcp://{address}:8786"
        raise Unregistered(f"`{address}` does not begin with the name of a scheduler: for one of Dask write {instead}")
    return Performing(SCHEDULERS.load(address.partition("://")[0])(address, workers))


def is_elsewhere(address: str | None) -> bool:
    """Whether it has workers of its own."""
    return address is not None and address.partition("://")[0] != PROCESSES


@dataclass(frozen=True, slots=True)
class Performing:
    """Tasks of a sweep on any scheduler."""

    scheduler: TaskScheduler

    def run(self, tasks: Iterable[Task], ended: Callable[[Task, Outcome], None]) -> None:
        """See `Scheduler`."""

        def told(task: Task, found: Outcome | LostTask) -> None:
            ended(task, _killed(task, found) if isinstance(found, LostTask) else found)

        self.scheduler.run(guarded, tasks, told)

    def close(self) -> None:
        """See `Scheduler`."""
        self.scheduler.close()


def _killed(task: Task, lost: LostTask) -> Outcome:
    """What is known of a task whose process ended: by `guarded`, or by something else."""
    limit = patience(task.timeout)
    if limit is not None and lost.seconds >= limit:
        message = f"the time limit of {task.timeout:g} s was reached, and the check did not end by itself"
        return Outcome("timeout", None, message, lost.seconds)
    return Outcome("killed", None, lost.reason, lost.seconds)
