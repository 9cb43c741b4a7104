"""What a monitor machine sees of a run, and what it misses: it reads one letter per turn of its own."""

from __future__ import annotations

from collections.abc import Iterator

from llfsm_verify.arrangement.model import Arrangement, Machine, Process
from llfsm_verify.monitoring.machine_reads import Reads

GENERAL = (
    "It reads one letter per turn of its own: the configuration as it stands, and the inputs that this turn samples.",
    "A step of the property (`X`, a bound, two neighbours) is from one turn of the monitor to its next one.",
)
ANYWHERE = (
    "It misses the letters after the ringlets of all other machines. One in its own process takes a turn between two "
    "of the monitor's, so no state at the end of that is missed, but states that two of them had together may be."
)


def sight(read: Reads, arrangement: Arrangement | None) -> list[str]:
    """Sentences on what the machine sees, and which letters it misses, in an arrangement or in any."""
    if arrangement is None:
        return [*GENERAL, ANYWHERE, "With --arrangement FILE this is said for its machines."]
    return [*GENERAL, *_in(read, arrangement)]


def _in(read: Reads, arrangement: Arrangement) -> Iterator[str]:
    home = _home(read, arrangement)
    others = list(home.schedule)
    several = len(arrangement.processes) > 1
    where = f"In process {home.name}" if several else "In this schedule"
    yield (
        f"{where} it sees 1 letter of {len(others) + 1} in a cycle: it misses those after the ringlets of "
        f"{_listed(others)}" + (", and of the other processes, as many as there are." if several else ".")
    )
    once: list[str] = []
    often: list[str] = []
    for name in read.machines:
        (often if _moves_often(arrangement.machine(name), home, arrangement) else once).append(f"the state of {name}")
    for name in read.variables:
        variable = next(w for w in arrangement.whiteboard if w.variable.name == name)
        if variable.role == "input":
            continue
        writers = [m for m in arrangement.machines if any(name == written for written, _ in m.writes())]
        inside = all(m.name in home.schedule for m in writers)
        (once if len(writers) <= 1 and inside else often).append(name)
    if once:
        names = _listed(once)
        yield f"Between two of its turns at most one ringlet changes each of these, and no value is skipped: {names}."
    if often:
        yield f"Several ringlets in between can change {_listed(often)}: values can be missed."
    if len(once) + len(often) > 1:
        yield (
            "What holds only between two ringlets of a cycle, such as two states at the same time, is missed: its "
            "place in the schedule decides which letter of a cycle it sees."
        )
    if any(w.role == "input" and w.variable.name in read.variables for w in arrangement.whiteboard):
        yield "Inputs are seen only as its own turns sample them."


def _home(read: Reads, arrangement: Arrangement) -> Process:
    """The process with most of the machines that are read: the place for the monitor."""
    return max(arrangement.processes, key=lambda p: sum(m in p.schedule for m in read.machines))


def _moves_often(machine: Machine, home: Process, arrangement: Arrangement) -> bool:
    """Whether its state can change more than once between two turns of a machine in `home`."""
    if machine.name not in home.schedule:
        return True
    commanded = any(c.machine == machine.name for m in arrangement.machines for c in m.commands())
    return arrangement.profile.commands == "end_of_ringlet" and commanded


def _listed(names: list[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + f" and {names[-1]}"
