"""A service of this node, which the arrangement answers.

A request becomes inputs: `asked` is true, and fields of the request have values. When the arrangement sets `answered`,
its outputs are the answer, and `asked` is false again; the next request waits until `answered` is false as well.
"""

from __future__ import annotations

import threading
import time
from typing import Any, Container, Dict, List, Mapping

import rospy

from .channel import Channel
from .fields import Field, Unfit, digits_of, fits
from .messages import Types

ASKED, ANSWERED = "asked", "answered"
LOOK = 0.05
"""Seconds between two looks whether the node is still there."""


class Server:
    """One service. NoType; NoField."""

    def __init__(
        self, channel: Channel, name: str, of: Mapping[str, Any], types: Types, inputs: Mapping[str, Any],
        outputs: List[str], known: Container[str],
    ) -> None:  # fmt: skip
        self._channel, self._timeout = channel, float(of["timeout"])
        made = types.service(of["type"])
        begin, self._response = len(name) + 1, made._response_class
        self._asked, self._answered = f"{name}.{ASKED}", f"{name}.{ANSWERED}"
        self._reads = [
            (field, Field(made._request_class, field[begin:]), of_it)
            for field, of_it in inputs.items() if field.startswith(f"{name}.") and field != self._asked
        ]  # fmt: skip
        self._known = known
        self._writes = [
            (field, Field(self._response, field[begin:], output=True))
            for field in outputs if field.startswith(f"{name}.") and field != self._answered
        ]  # fmt: skip
        self._turn, self._heard = threading.Lock(), threading.Condition()
        self._values: Dict[str, Any] = {}
        rospy.Service(name, made, self._serve)

    def hear(self, values: Dict[str, Any]) -> None:
        """The outputs have new values."""
        with self._heard:
            self._values = values
            self._heard.notify_all()

    def _serve(self, request: Any) -> Any:
        given = {}
        for name, field, of in self._reads:
            try:
                given[name] = value = field.get(request, digits_of(of))
            except Unfit as problem:
                raise rospy.ServiceException(f"{field.path} {problem}") from None
            if not fits(value, of, self._known):  # the arrangement would answer with the value before
                raise rospy.ServiceException(f"{field.path} cannot be {value!r}, which its input does not have")
        limit = time.monotonic() + self._timeout
        if not self._turn.acquire(timeout=self._timeout):
            raise rospy.ServiceException("other requests are before this one")
        try:
            if self._await(False, limit) is None:
                raise rospy.ServiceException("the arrangement takes no request")
            self._channel.values({**given, self._asked: True}, event=True)
            answer = self._await(True, limit)
            self._channel.values({self._asked: False}, event=True)
            if answer is None:
                raise rospy.ServiceException(f"no answer within {self._timeout:g} s")
            response = self._response()
            for name, field in self._writes:
                try:
                    field.put(response, answer[name])
                except Unfit as problem:
                    self._channel.say(f"{name} {problem}")
                    raise rospy.ServiceException(f"{name} {problem}") from None
            return response
        finally:
            self._turn.release()

    def _await(self, answered: bool, limit: float) -> Any:
        """The outputs when `answered` is so; None: it was not until then."""
        with self._heard:
            while self._values.get(self._answered) is not answered:
                left = limit - time.monotonic()
                if left <= 0 or rospy.is_shutdown():
                    return None
                self._heard.wait(min(left, LOOK))
            return self._values
