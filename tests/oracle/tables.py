"""Running a monitor's table letter by letter, as its file says that one does."""

from llfsm_verify.monitoring.json import MonitorTable


def letter_class(table: MonitorTable, letter: int) -> int:
    """The class of `letter`, the mask of the atoms that hold; each letter is in just one."""
    (found,) = (
        c
        for c, cubes in enumerate(table.classes)
        if any(positive & ~letter == 0 and negative & letter == 0 for positive, negative in cubes)
    )
    return found
