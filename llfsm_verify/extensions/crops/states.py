"""States in Python: what a class of the user derives from.

`execute` of a state is called on a thread of its own, never twice at a time for one object.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Mapping
from typing import Protocol

from llfsm_verify.extensions.crops.data import Data

DEADLINE = 5.0


class State:
    """A state of a state machine: executed again and again, until an outcome leads to another state."""

    outcomes: Collection[str] = ()
    """What `execute` may return. Each class or object has to say it."""
    deadline: float | None = DEADLINE
    """Seconds after which an execution gives the outcome ``timed out``; None: never."""

    def execute(self, data: Data) -> str:
        """One execution, which should be short; the outcome. An exception is the outcome ``failed``.

        One that starts what moves looks at `data.left` afterwards: `cancel` may have been called before.
        """
        raise NotImplementedError(f"{type(self).__name__} has no `execute`")

    def cancel(self) -> None:
        """The state machine is paused, ends, or is in another state by `change_state`: stop what moves.

        It is called on another thread than an `execute` under way. After a pause, `execute` is called again.
        """


class ActionClient(Protocol):
    """A client of an action, such as an `actionlib.SimpleActionClient`."""

    def send_goal(self, goal: object, *, feedback_cb: object = None) -> None:
        """Ask for a goal, without waiting; `feedback_cb` is called with each feedback."""

    def get_state(self) -> int | str:
        """The state of the client: one of the names in `CLIENT_STATES`, or its number in actionlib."""

    def get_result(self) -> object:
        """What the goal came to."""

    def cancel_goal(self) -> None:
        """The goal is not wanted any more."""


CLIENT_STATES: Mapping[int, str] = {
    0: "PENDING", 1: "ACTIVE", 2: "PREEMPTED", 3: "SUCCEEDED", 4: "ABORTED", 5: "REJECTED", 6: "ACTIVE", 7: "PENDING",
    8: "RECALLED", 9: "LOST",
}  # fmt: skip
"""Those of the thesis, and ABORTED, by the numbers of actionlib_msgs/GoalStatus (6 and 7: it is asked to cancel)."""
UNDER_WAY = ("PENDING", "ACTIVE")


class SimpleActionState(State):
    """A state that sends a goal to an action, and then tells in each execution how far that is.

    `ends` has the outcomes by states of the client in which a goal has ended, and `otherwise` is the outcome while it
    has not. An end that `ends` does not have is the outcome ``failed``.
    """

    def __init__(self, action: str, client: ActionClient, *, ends: Mapping[str, str], otherwise: str) -> None:
        """`action`: its name. ValueError: `ends` has a state in which no goal has ended."""
        last = [name for name in CLIENT_STATES.values() if name not in UNDER_WAY]
        unknown = sorted(set(ends) - set(last))
        if unknown:
            raise ValueError(f"a goal does not end as {unknown[0]!r}, only as {', '.join(last)}")
        self.action, self.client, self.ends, self.otherwise = action, client, dict(ends), otherwise
        self.outcomes = tuple(dict.fromkeys((*ends.values(), otherwise)))
        self._sent = False
        self._news: deque[object] = deque(maxlen=1)

    def goal(self, data: Data) -> object:
        """The goal to send, when the state is executed for the first time, or again after an end or a pause."""
        raise NotImplementedError(f"{type(self).__name__} has no `goal`")

    def feedback(self, feedback: object, data: Data) -> None:
        """A feedback has come since the last execution; of several, the newest."""

    def done(self, result: object, data: Data) -> None:
        """The goal has ended as `ends` says."""

    def execute(self, data: Data) -> str:
        """See `State`."""
        if not self._sent:
            goal, news = self.goal(data), deque[object](maxlen=1)
            self._news = news  # what comes of a goal before goes nowhere
            self.client.send_goal(goal, feedback_cb=news.append)
            self._sent = True
            if data.left:  # meanwhile, and `cancel` may have come before there was a goal
                self.cancel()
                return self.otherwise
        state = self.client.get_state()
        name = state if isinstance(state, str) else CLIENT_STATES.get(state, str(state))
        if self._news:
            self.feedback(self._news.popleft(), data)
        if name in UNDER_WAY:
            return self.otherwise
        if name not in CLIENT_STATES.values():
            raise RuntimeError(f"the client of {self.action} is in the state {name}, which no client of an action has")
        self._sent = False
        if name not in self.ends:
            raise RuntimeError(f"the goal of {self.action} has ended as {name}, which `ends` does not have")
        self.done(self.client.get_result(), data)
        return self.ends[name]

    def cancel(self) -> None:
        """See `State`: the goal is cancelled, and would be sent again."""
        if self._sent:
            self._sent = False
            self.client.cancel_goal()
