"""What a run shares with its readers and with those who post: made before its processes are forked."""

from __future__ import annotations

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.whiteboard.posts import Posts
from llfsm_verify.runtime.whiteboard.segment import Segment
from llfsm_verify.runtime.whiteboard.waking import Wakes


class Shared:
    """The segment of a run's frames, the posts for its inputs, and whom each frame wakes."""

    def __init__(self, name: str, loop: Loop) -> None:
        self.name = name
        self.loop = loop
        self.segment = Segment(name, loop.code.frames.words, loop.told[control.PERIOD])
        self.posts = Posts(loop)
        self.wakes = Wakes(loop)
        loop.told[control.SEGMENT] = self.segment.address

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What a process needs that runs the loop."""
        return (self.wakes.fileno(),)

    def close(self) -> None:
        """Readers keep what they have; the loop must not run."""
        self.loop.told[control.SEGMENT] = 0
        self.wakes.close()
        self.posts.close()
        self.segment.close()
