"""Who may do what to a running arrangement (the keys `operators` and `access`, for processes of this machine), its
clients, and how much of its server each user may have.

What a user holds takes nothing from others: those who may command have a share each, and those who may not, a share
each and another one together. Of lent memory there is a number for all (`LENT`), and a third of it is for the run's own
user and root.
"""

from __future__ import annotations

import fcntl
import os
import pwd
import socket
import struct
import termios
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Self

from llfsm_verify.arrangement.model import POLICY, Access, Arrangement
from llfsm_verify.arrangement.replacing import Change, Replacement
from llfsm_verify.runtime.whiteboard.places import MOST_REQUEST
from llfsm_verify.runtime.whiteboard.posts import LENT, WRITE
from llfsm_verify.runtime.whiteboard.segment import Segment

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
        """Why no one may make this change; None: `operators:` declares it."""
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


PIECE = 1 << 16
"""Bytes that are read at once, of a request of those who may not command, and of answers that a client leaves unread
while it asks more.
"""


class Client:
    """A connection: who is there, what it has asked, and what it holds."""

    def __init__(self, connection: socket.socket, pid: int, uid: int, rank: int) -> None:
        self.connection = connection
        self.pid, self.uid, self.rank = pid, uid, rank
        self.who = f"process {pid} of user {uid}"
        """As messages name it."""
        self.most = PIECE if rank == READS else MOST_REQUEST
        """Bytes of a request."""
        self.received = bytearray()
        self._end, self._searched = -1, 0
        self.answers = bytearray()
        self.awaited = 0
        """Events of its connection that the server waits for."""
        self.refusals = 0
        self.commanding = False
        """Its command is not taken yet, so what it sends next waits."""
        self.lent: list[Segment] = []
        self.descriptors: list[int] = []
        """To be sent with the next answer."""
        self.handed: list[socket.socket] = []
        """Of these the ones that are closed then."""
        self.wakes: set[int] = set()

    @property
    def asks(self) -> bool:
        """Whether a whole request is there."""
        if self._end < 0:
            self._end = self.received.find(b"\n", self._searched)
            self._searched = len(self.received)
        return self._end >= 0

    @property
    def may_ask(self) -> bool:
        """Whether that request may be done now."""
        return self.asks and not self.commanding and len(self.answers) <= PIECE

    def take(self) -> bytes:
        """That request."""
        line = bytes(self.received[: self._end])
        del self.received[: self._end + 1]
        self._end, self._searched = -1, 0
        return line

    def forget_requests(self) -> None:
        """Do nothing of what it has asked so far."""
        self.received.clear()
        self._end, self._searched = -1, 0

    def send(self) -> None:
        """As much of the answers as goes now. OSError."""
        if self.descriptors:  # they travel with the first byte
            sent = socket.send_fds(self.connection, [self.answers], self.descriptors)
            self.descriptors = []
            self.close_handed()
        else:
            sent = self.connection.send(self.answers)
        del self.answers[:sent]

    def close_handed(self) -> None:
        """The client has them, or will not have them."""
        for one in self.handed:
            one.close()
        self.handed = []

    @property
    def has_read_all(self) -> bool:
        """Whether it has read all answers: descriptors that wait in connections are counted, and are not many."""
        if self.answers:
            return False
        (waiting,) = struct.unpack("i", fcntl.ioctl(self.connection, termios.TIOCOUTQ, b"\0" * 4))
        return not waiting


@dataclass(frozen=True, slots=True)
class Share:
    """How much of something a user may have."""

    what: str
    own: int
    """The run's own user, and root."""
    each: int
    """Every other user; all of them who may not command, twice as much together."""
    others: int | None = None
    """All users together but the run's own and root."""

    def lacks(self, client: Client, held: Iterable[tuple[int, int]]) -> str | None:
        """Why a client gets no more of it, given the user and the rank of who holds each; None: it does."""
        taken = list(held)
        most = self.own if client.rank == OWN else self.each
        if sum(uid == client.uid for uid, _ in taken) >= most:
            return f"user `{user_name(client.uid)}` has {most} {self.what} already, which is the share of a user"
        if client.rank == READS and sum(rank == READS for _, rank in taken) >= 2 * self.each:
            return f"users who may not command have {2 * self.each} {self.what} already, which is their share"
        if client.rank != OWN and self.others is not None and sum(rank != OWN for _, rank in taken) >= self.others:
            return f"other users than root and that of the run have {self.others} {self.what} already"
        return None


CONNECTIONS = Share("connections", 64, 16)
SUBSCRIPTIONS = Share("subscriptions", 64, 16)
PIECES = Share("pieces of memory", LENT, LENT // 3, LENT - LENT // 3)
