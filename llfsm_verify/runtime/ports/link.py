"""What connects a port with the run: it posts what comes, knows when inputs have failed, and counts."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from llfsm_verify.jsonvalue import Json
from llfsm_verify.runtime.ports.port import PortSpec
from llfsm_verify.runtime.whiteboard.posts import Posts, Refused


@dataclass(slots=True)
class Counts:
    """What a port has done."""

    taken: int = 0
    """Messages that gave a value to an input."""
    refused: int = 0
    """Values that were not of the type of their input."""
    malformed: int = 0
    """Messages that are none, and those without a field of an input."""
    failures: int = 0
    """How often an input has failed."""
    sent: int = 0
    """Messages."""
    unsent: int = 0
    """Messages that were never sent, because newer ones took their places or nobody was there."""


class RunLink:
    """The link of one port.

    An input fails when its port says that it is lost, or when it has had no message for the time-out; with a time-out,
    what may come back by itself has that long. It has failed until its next message.
    """

    def __init__(self, spec: PortSpec, posts: Posts, say: Callable[[str], None], clock: Callable[[], float]) -> None:
        self.spec = spec
        self.counts = Counts()
        self.stop: str | None = None
        """Why the run shall end."""
        self.over = False
        """Whether the run has ended, so that nothing fails any more."""
        self._posts, self._say, self._clock = posts, say, clock
        now = clock()
        self._heard = dict.fromkeys(spec.inputs, now)
        self._failed: set[str] = set()
        self._said: set[str] = set()

    @property
    def name(self) -> str:
        """See `Link`."""
        return self.spec.name

    @property
    def fields(self) -> frozenset[str]:
        """See `Link`."""
        return frozenset(self.spec.inputs.values())

    def follow(self, posts: Posts) -> None:
        """Post to another run from now on."""
        self._posts = posts

    def begin(self) -> None:
        """The run begins now: nothing could be heard before."""
        self._heard = dict.fromkeys(self.spec.inputs, self._clock())

    def take(self, values: Mapping[str, Json]) -> None:
        """See `Link`: values that fit are posted, all together."""
        given = {name: values[field] for name, field in self.spec.inputs.items() if field in values}
        if not given:
            self.malformed(f"a message has none of the fields {', '.join(sorted(self.fields))}")
            return
        good = {name: value for name, value in given.items() if self._fits(name, value)}
        if good:
            self._posts.post(good)
            self.counts.taken += 1
            self._heard |= dict.fromkeys(good, self._clock())
            self._failed -= good.keys()

    def _fits(self, name: str, value: Json) -> bool:
        try:
            self._posts.number(name, value)
        except Refused as refused:
            self.counts.refused += 1
            self._once("refused", f"a value is refused: {refused}")
            return False
        return True

    def malformed(self, why: str) -> None:
        """See `Link`."""
        self.counts.malformed += 1
        self._once(f"malformed {why}", why)

    def lost(self, why: str, *, forever: bool = False) -> None:
        """See `Link`."""
        if self.spec.inputs and (forever or self.spec.timeout is None):
            self._fail([name for name in self._heard if name not in self._failed], why)
        else:
            self._once("lost", why)

    def sent(self) -> None:
        """See `Link`."""
        self.counts.sent += 1

    def unsent(self, why: str) -> None:
        """See `Link`."""
        self.counts.unsent += 1
        self._once(f"unsent {why}", f"an output is not written: {why}")

    def look(self, now: float) -> None:
        """Whether an input has waited for too long."""
        limit = self.spec.timeout
        if limit is not None:
            late = [n for n, heard in self._heard.items() if n not in self._failed and now - heard >= limit]
            self._fail(late, f"no message for {limit:g} s")

    @property
    def due(self) -> float | None:
        """When `look` has to be called next, if nothing comes."""
        waiting = [heard for name, heard in self._heard.items() if name not in self._failed]
        return None if self.spec.timeout is None or not waiting else min(waiting) + self.spec.timeout

    def _fail(self, names: list[str], why: str) -> None:
        if not names or self.over:
            return
        self._failed |= set(names)
        self.counts.failures += len(names)
        told = f"{why}: " + ", ".join(f"`{name}`" for name in names)
        if self.spec.on_failure == "safe":
            self._posts.post({name: self.spec.safe[name] for name in names})
            self._once("safe", f"{told} {'gets its safe value' if len(names) == 1 else 'get their safe values'}")
        elif self.spec.on_failure == "stop":
            self.stop = self.stop or f"port {self.name}: {told} failed"
        else:
            self._once("stale", f"{told} {'keeps its last value' if len(names) == 1 else 'keep their last values'}")

    def _once(self, kind: str, what: str) -> None:
        """Say it the first time; the counts have the others."""
        if kind not in self._said:
            self._said.add(kind)
            self._say(f"port {self.name}: {what}")
