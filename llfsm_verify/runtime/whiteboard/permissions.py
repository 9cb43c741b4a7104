"""Who may do what to a running arrangement: the keys `operators` and `access`, for processes of this machine."""

from __future__ import annotations

import os
import pwd
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

from llfsm_verify.arrangement.access import Access
from llfsm_verify.arrangement.model import POLICY, Arrangement
from llfsm_verify.arrangement.replacing import Change, Replacement
from llfsm_verify.runtime.whiteboard.posts import WRITE

OWN, COMMANDS, READS = range(3)
"""The run's own user and root; others who may command something; others who may not."""


@dataclass(frozen=True, slots=True)
class Permissions:
    """What `access:` allows to users, who are known by their accounts; without it, the run's own user may everything
    that `operators:` declares."""

    access: Access | None = None
    policy_users: frozenset[str] = frozenset()
    """Who may change the policy."""
    operated: tuple[tuple[str, str], ...] = ()
    """The commands that `operators:` declares, each with its target."""
    replaceable: tuple[str, ...] = ()
    """The machines that it allows to replace."""

    @classmethod
    def of(cls, arrangement: Arrangement) -> Self:
        """Those of an arrangement."""
        users = frozenset(operator.target for operator in arrangement.policy_users)
        operated = tuple((operator.kind, operator.target) for operator in arrangement.operated)
        return cls(arrangement.access, users, operated, tuple(o.target for o in arrangement.replaceable))

    def rank(self, uid: int) -> int:
        """`OWN`, `COMMANDS` or `READS`."""
        if uid in (os.getuid(), 0):
            return OWN
        return COMMANDS if any(self.denial(uid, *command) is None for command in self.operated) else READS

    def may_connect(self, uid: int) -> bool:
        """The run's own user, root, and whom `users:` names."""
        return uid in (os.getuid(), 0) or (self.access is not None and user_name(uid) in self.access.users)

    @property
    def admits_others(self) -> bool:
        """Whether other users may connect."""
        return self.access is not None and bool(set(self.access.users) - {user_name(os.getuid())})

    def undeclared(self, change: Change) -> str | None:
        """Why nobody may make this change; None: `operators:` declares it."""
        if isinstance(change, Replacement):
            if change.machine in self.replaceable:
                return None
            offered = ", ".join(self.replaceable) or "nothing"
            return f"`operators:` does not declare replace of `{change.machine[:60]}`, only {offered}"
        if self.policy_users:
            return None
        return "`operators:` does not declare `policy`, so this run keeps the policy that it has"

    def denial(self, uid: int, kind: str, target: str) -> str | None:
        """Why a user may not give this command; None: he may."""
        access = self.access
        if kind == POLICY and user_name(uid) not in self.policy_users:
            offered = ", ".join(sorted(self.policy_users)) or "nobody"
            return f"user `{user_name(uid)}` may not change the policy: `operators:` allows it to {offered}"
        if access is None or kind == POLICY:
            return None
        needed = access.write_class(target) if kind == WRITE else access.command_class(target)
        has = access.users.get(user_name(uid), 0)
        if has >= needed:
            return None
        levels = access.levels
        return f"user `{user_name(uid)}` ({levels[has]}) may not {kind} `{target}`: that needs `{levels[needed]}`"


@lru_cache(256)
def user_name(uid: int) -> str:
    """The name of an account, or its number where it has none. It is looked up once."""
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return str(uid)
