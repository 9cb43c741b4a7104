"""Who may write what and command whom: clearances of machines, classes of variables and of machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from llfsm_verify.diagnostics import Span


@dataclass(frozen=True, slots=True)
class Access:
    """The key `access` of an arrangement. Levels are counted from 0, the lowest."""

    levels: tuple[str, ...]
    machines: Mapping[str, int]
    """The clearances of machines; of one that is not named the lowest."""
    write: Mapping[str, int]
    """The classes of whiteboard variables: the clearance that a write needs; of one that is not named the lowest."""
    command: Mapping[str, int]
    """The classes of machines: the clearance that a command to them needs; of one that is not named its own."""
    users: Mapping[str, int]
    """The clearances of people and programs outside, by the names of their accounts."""
    refuses: bool
    """What a machine may not do is refused when it runs; else such a text is an error."""
    marks: Mapping[str, Span] = field(default_factory=dict, compare=False, repr=False)
    """Where ``levels`` stands, and each level that is given, as in ``machines.ns``."""

    def clearance(self, machine: str) -> int:
        return self.machines.get(machine, 0)

    def write_class(self, variable: str) -> int:
        return self.write.get(variable, 0)

    def command_class(self, machine: str) -> int:
        return self.command.get(machine, self.clearance(machine))

    def may_write(self, machine: str, variable: str) -> bool:
        """Whether a machine may write a variable of the whiteboard."""
        return self.clearance(machine) >= self.write_class(variable)

    def may_command(self, machine: str, kind: str, target: str) -> bool:
        """Whether a machine may give this command; itself it may always suspend, resume and restart."""
        own = machine == target and kind in ("suspend", "resume", "restart")
        return own or self.clearance(machine) >= self.command_class(target)

    def write_denial(self, machine: str, variable: str) -> str:
        """What is said when the machine may not write the variable."""
        return self._denial(machine, f"write `{variable}`", self.write_class(variable))

    def command_denial(self, machine: str, kind: str, target: str) -> str:
        """What is said when the machine may not give this command."""
        return self._denial(machine, f"{kind} `{target}`".replace("load_suspended", "load"), self.command_class(target))

    def _denial(self, machine: str, what: str, needed: int) -> str:
        has = self.levels[self.clearance(machine)]
        return f"machine `{machine}` ({has}) may not {what}: that needs `{self.levels[needed]}`"
