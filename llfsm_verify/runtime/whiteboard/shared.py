"""What a run shares with its readers and with those who post: made before its processes are forked."""

from __future__ import annotations

from contextlib import ExitStack, closing

from llfsm_verify.runtime.live import control
from llfsm_verify.runtime.live.loop import Loop
from llfsm_verify.runtime.whiteboard.posts import Posts
from llfsm_verify.runtime.whiteboard.segment import Segment
from llfsm_verify.runtime.whiteboard.waking import Wakes


class Shared:
    """The segment of a run's frames, the posts for its inputs, and whom each frame wakes.

    `served`: other processes may read and post, so that memory for their posts is made. OSError: there are not enough
    descriptors for it.
    """

    def __init__(self, name: str, loop: Loop, *, served: bool = True) -> None:
        self.name = name
        self.loop = loop
        self.served = served
        with ExitStack() as made:
            self.segment = made.enter_context(
                closing(Segment(name, loop.code.frames.words, loop.control[control.PERIOD]))
            )
            self.posts = made.enter_context(closing(Posts(loop, lends=served)))
            self.wakes = Wakes(loop)
            made.pop_all()
        loop.control[control.SEGMENT] = self.segment.address

    @property
    def descriptors(self) -> tuple[int, ...]:
        """What a process needs that runs the loop."""
        return (self.wakes.fileno(),)

    def close(self) -> None:
        """Readers keep what they have; the loop must not run."""
        self.loop.control[control.SEGMENT] = 0
        self.wakes.close()
        self.posts.close()
        self.segment.close()
