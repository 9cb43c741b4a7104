"""From an arrangement and the settings of a run to its processes: the one place for the command line and for Python.
A supervisor serves while the loop runs."""

from __future__ import annotations

import select
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Protocol

from llfsm_verify.arrangement.draft import Draft
from llfsm_verify.arrangement.model import Arrangement
from llfsm_verify.arrangement.replacing import Change
from llfsm_verify.registry import Registry
from llfsm_verify.runtime.live.loop import LiveCode, Loop
from llfsm_verify.runtime.live.plan import Plan
from llfsm_verify.runtime.live.run import Running
from llfsm_verify.runtime.live.slots import inputs_of, slots_of
from llfsm_verify.runtime.ports.file import read_ports
from llfsm_verify.runtime.ports.port import PortSpec, Unopened
from llfsm_verify.runtime.ports.ports import Ports, RunLink, opened, unopened
from llfsm_verify.runtime.stepping.drawing import free_inputs
from llfsm_verify.runtime.swapping.hot_swap import Answer, Follow, SwappableRun
from llfsm_verify.runtime.swapping.settings import RunSettings
from llfsm_verify.runtime.whiteboard.audit import AuditLog
from llfsm_verify.runtime.whiteboard.permissions import Permissions
from llfsm_verify.runtime.whiteboard.posts import Refused
from llfsm_verify.runtime.whiteboard.server import KEEPS, Server
from llfsm_verify.runtime.whiteboard.shared import Shared

PATIENCE = 0.05
"""Seconds between two looks, at most."""


class Attendant(Protocol):
    """What is served beside the loop: a whiteboard, ports."""

    @property
    def patience(self) -> float:
        """After so many seconds `serve` should be called in any case."""

    def fileno(self) -> int:
        """Readable when `serve` has something to do."""

    def serve(self, seconds: float) -> None:
        """Do what is to be done, and wait at most so long for it."""


class Panel(Attendant, Protocol):
    """Shows a run beside its loop."""

    def follow(self, shared: Shared) -> None:
        """Show another run from now on."""

    def close(self) -> None:
        """Show it for the last time."""


PANELS: Registry[Callable[[Shared, Launch], Panel]] = Registry("panel", (), "llfsm_verify.panels")
"""Each makes what shows a run on standard output, which is a terminal. The first is asked."""


def serve(running: Running | SwappableRun, attendants: Sequence[Attendant]) -> None:
    """Serve until the run has ended."""
    poll = select.poll()
    for descriptor in (running.fileno(), *(one.fileno() for one in attendants)):
        poll.register(descriptor, select.POLLIN)
    while not running.wait(0):
        poll.poll(1000 * min([PATIENCE, *(one.patience for one in attendants)]))
        for one in attendants:
            one.serve(0)


@dataclass(frozen=True, slots=True)
class Early:
    """The ports that are open before the run, and the values that inputs without a change get from them."""

    links: Mapping[str, RunLink] = field(default_factory=dict)
    free: Mapping[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Launch:
    """An arrangement that is ready to run: what was read of it (None: it is not from files), how it runs, and its loop
    at the beginning."""

    draft: Draft | None
    settings: RunSettings
    plan: Plan
    loop: Loop
    ports: tuple[PortSpec, ...] = ()
    early: Early = Early()


@dataclass(frozen=True, slots=True)
class Launched:
    """A run that is to be started, what it shares, and the server of its whiteboard, if that has a name."""

    run: Running | SwappableRun
    shared: Shared
    server: Server | None
    permissions: Permissions

    @property
    def attendants(self) -> list[Attendant]:
        """Whom to serve while it goes on."""
        return [one for one in (self.server, self.run) if isinstance(one, Server | SwappableRun)]

    def ask(self, change: Change, answer: Answer, unchecked: bool) -> None:
        """See `SwappableRun.ask`."""
        if not isinstance(self.run, SwappableRun):
            raise Refused(self.permissions.undeclared(change) or KEEPS)
        self.run.ask(change, answer, unchecked)

    def start(self, *followers: Follow) -> None:
        """Let it run. The server and these are told of each run that goes on with it."""
        if isinstance(self.run, SwappableRun):
            self.run.tell(*([] if self.server is None else [self.server.follow]), *followers)
        self.run.start()


@contextmanager
def launched(
    ready: Launch, *, audit: AuditLog | None = None, refused: Callable[[str], None] = lambda _: None, swaps: bool = True
) -> Iterator[Launched]:
    """The processes of a run. What still runs at the end is ended.

    Where `operators:` allows that machines or the policy are replaced, another run may go on with it, if it `swaps`.
    `audit` and `refused` are as for `Server`. Raises NameTaken, NoPlace, OSError, and DiagnosticError (E480: the
    recording cannot be written).
    """
    settings, arrangement = ready.settings, ready.plan.arrangement
    name = settings.whiteboard
    with ExitStack() as left:
        if settings.pace is not None:
            left.enter_context(closing(settings.pace))
        shared = left.enter_context(closing(Shared(name or "run", ready.loop, served=name is not None)))
        server, permissions = None, Permissions.of(arrangement)
        if name is not None:
            server = Server(name, shared, permissions, refused=refused, fed=settings.fed, audit=audit, of=arrangement)
            left.enter_context(closing(server))
        if not swaps or not (arrangement.replaceable or arrangement.policy_users):
            yield Launched(left.enter_context(settings.running(arrangement, shared)), shared, server, permissions)
            return
        run = left.enter_context(SwappableRun(ready.draft, shared, settings, arrangement))
        if server is not None:
            server.takes(run)
        yield Launched(run, shared, server, permissions)


# ---------------- ports


def declared_ports(path: str, arrangement: Arrangement, code: LiveCode) -> tuple[PortSpec, ...]:
    """The ports in a file. DiagnosticError: see `read_ports`."""
    requests = {of.name: of for plant in arrangement.plants if (of := plant.request) is not None}
    return read_ports(path, inputs_of(code.program), slots_of(code), requests, free_inputs(code.program))


def with_ports(settings: RunSettings, specs: Sequence[PortSpec]) -> RunSettings:
    """The settings of a run with these ports."""
    fed = frozenset(name for spec in specs for name in spec.fed)
    shown = frozenset(name for spec in specs for name in spec.shown)
    return replace(settings, fed=fed, shown=shown)


@contextmanager
def opened_early(specs: Sequence[PortSpec], plan: Plan, code: LiveCode, say: Callable[[str], None]) -> Iterator[Early]:
    """Open those ports that give values before the run, until the end. DiagnosticError (E495): they cannot be opened,
    or give none."""
    links: dict[str, RunLink] = {}
    free: dict[str, int] = {}
    slots = {slot.name: slot for slot in slots_of(code)}
    try:
        for spec in specs:
            if spec.never:
                links[spec.name] = link = opened(spec, slots, float(plan.cycle), say)
                try:
                    free |= link.parameters()
                except Unopened as problem:
                    raise unopened(spec, problem) from None
        yield Early(links, free)
    finally:
        for link in links.values():
            if link.port is not None:
                link.port.close()


def following(ports: Ports) -> Follow:
    """What lets ports serve another run."""
    return lambda shared: ports.follow(shared.posts, shared.segment.newest, slots_of(shared.loop.code))


@contextmanager
def serving(ready: Launch, done: Launched, say: Callable[[str], None]) -> Iterator[Ports | None]:
    """The ports of a run, none where none is declared. They are opened when the processes of the run have been forked,
    so that these inherit none of their descriptors, but for those that must be open before.

    DiagnosticError: one cannot be opened (E495); the recording, in which nothing is yet, is removed.
    """
    if not ready.ports:
        yield None
        return
    shared, settings = done.shared, ready.settings
    try:
        ports = Ports(
            ready.ports, shared.posts, shared.segment.newest, slots_of(shared.loop.code),
            period=shared.segment.period / 1e9, stop=done.run.stop, say=say, pace=settings.pace,
            cycle_ms=float(ready.plan.cycle), early=ready.early.links,
        )  # fmt: skip
    except BaseException:
        if settings.record is not None:
            Path(settings.record).unlink(missing_ok=True)
        raise
    try:
        yield ports
    finally:
        ports.finish("died")  # where nothing better was said before
