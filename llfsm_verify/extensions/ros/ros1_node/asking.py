"""What the run asks of others: services, each on a thread of its own, and goals of actions."""

from __future__ import annotations

import socket
import threading
from typing import Any, Dict, Mapping, Optional

import actionlib
import rospy
from actionlib import CommState, TerminalState

from .channel import Channel, nested
from .fields import Field, Json, Unfit, digits_of
from .messages import Types

POLL = 0.01
"""Seconds between two looks whether the server of an action is there."""


class _Filled:
    """A message whose fields the run gives, or from which it takes them."""

    def __init__(self, message: Any, fields: Mapping[str, Mapping[str, Any]], output: bool) -> None:
        self._message = message
        self._fields = [(name, Field(message, name, output=output), digits_of(of)) for name, of in fields.items()]

    def filled(self, values: Mapping[str, Json]) -> Any:
        """A new message. Unfit."""
        made = self._message()
        for name, field, _ in self._fields:
            try:
                field.put(made, values[name])
            except Unfit as problem:
                raise Unfit(f"{name} {problem}") from None
        return made

    def read(self, message: Any) -> Dict[str, Json]:
        """The fields of a message. Unfit."""
        found = {}
        for name, field, digits in self._fields:
            try:
                found[name] = field.get(message, digits)
            except Unfit as problem:
                raise Unfit(f"{name} {problem}") from None
        return found


class Service:
    """A service of another node. NoType; NoField."""

    def __init__(self, channel: Channel, name: str, of: Mapping[str, Any], types: Types) -> None:
        self._channel, self._name, self._service = channel, name, of["service"]
        self._type = types.service(of["type"])
        self._sends = _Filled(self._type._request_class, of["sends"], output=True)
        self._answers = _Filled(self._type._response_class, of["answers"], output=False)
        self._calls: Dict[int, Optional[rospy.ServiceProxy]] = {}

    def ask(self, number: int, values: Mapping[str, Json]) -> None:
        """Call it."""
        try:
            request = self._sends.filled(values)
        except Unfit as problem:
            self._fail(number, str(problem))
            return
        proxy = rospy.ServiceProxy(self._service, self._type, persistent=True)  # so that it can be closed meanwhile
        self._calls[number] = proxy
        threading.Thread(target=self._call, args=(number, proxy, request), daemon=True).start()

    def _call(self, number: int, proxy: rospy.ServiceProxy, request: Any) -> None:
        try:
            values = self._answers.read(proxy.call(request))
        except Exception as error:  # noqa: BLE001 - whatever a server or its type makes of it
            if self._calls.pop(number, None) is not None:
                self._fail(number, str(error))
        else:
            if self._calls.pop(number, None) is not None:
                self._channel.tell({"answer": number, "state": "DONE", "values": nested(values)})
        finally:
            proxy.close()

    def _fail(self, number: int, why: str) -> None:
        self._channel.say(f"{self._name}: {self._service} has failed: {why}"[:400])
        self._channel.tell({"answer": number, "state": "FAILED"})

    def cancel(self, number: int) -> None:
        """Wait no longer."""
        proxy = self._calls.pop(number, None)
        connection = None if proxy is None or proxy.transport is None else proxy.transport.socket
        if connection is not None:
            try:
                connection.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass

    def look(self) -> None:
        """Nothing needs to be seen: a server that dies closes its connection."""


class _Goal:
    def __init__(self) -> None:
        self.handle: Any = None
        self.state = "PENDING"
        self.cancelled = threading.Event()
        self.told = False
        """Whether the server was told so."""


class Action:
    """An action of another node. NoType; NoField."""

    def __init__(self, channel: Channel, name: str, of: Mapping[str, Any], types: Types) -> None:
        self._channel, self._name, self._action = channel, name, of["action"]
        made = types.action(of["type"])
        action = made()
        self._sends = _Filled(type(action.action_goal.goal), of["sends"], output=True)
        self._answers = _Filled(type(action.action_result.result), of["answers"], output=False)
        self._feedback = _Filled(type(action.action_feedback.feedback), of["feedback"], output=False)
        self._client = actionlib.ActionClient(self._action, made)
        self._goals: Dict[int, _Goal] = {}
        self._lock = threading.RLock()

    def ask(self, number: int, values: Mapping[str, Json]) -> None:
        """Send a goal, as soon as the server is there."""
        try:
            goal = self._sends.filled(values)
        except Unfit as problem:
            self._channel.say(f"{self._name}: {problem}; no goal is sent")
            self._channel.tell({"answer": number, "state": "REJECTED"})
            return
        self._goals[number] = _Goal()
        threading.Thread(target=self._send, args=(number, self._goals[number], goal), daemon=True).start()

    def _send(self, number: int, of: _Goal, goal: Any) -> None:
        while not self._is_there() and not of.cancelled.wait(POLL):
            pass
        with self._lock:
            if of.cancelled.is_set():
                self._end(number, "RECALLED", {})
                return

            def moved(handle: Any) -> None:
                self._moved(number, of, handle)

            def fed(_: Any, feedback: Any) -> None:
                self._fed(number, of, feedback)

            of.handle = self._client.send_goal(goal, moved, fed)

    def _is_there(self) -> bool:
        """Whether all connections to the server are there, so that nothing of it is missed.

        `wait_for_server` of actionlib does the same, and waits by the clock of ROS.
        """
        seen, client = self._client.last_status_msg, self._client
        if seen is None:
            return False
        server = seen._connection_header["callerid"]
        return bool(
            client.pub_goal.impl.has_connection(server) and client.pub_cancel.impl.has_connection(server)
            and all(any(c.callerid_pub == server for c in sub.impl.connections)
                    for sub in (client.result_sub, client.feedback_sub, client.status_sub))
        )  # fmt: skip

    def _moved(self, number: int, of: _Goal, handle: Any) -> None:
        self._tell(number, of, handle)
        if of.cancelled.is_set():
            self._cancel(of, handle)

    def _tell(self, number: int, of: _Goal, handle: Any) -> None:
        with self._lock:
            if number not in self._goals:
                return
            comm, result = handle.get_comm_state(), handle.get_result()
            end = TerminalState.to_string(handle.get_terminal_state()) if comm == CommState.DONE else ""
            accepted = comm in (CommState.ACTIVE, CommState.PREEMPTING) or end in ("SUCCEEDED", "PREEMPTED", "ABORTED")
            if accepted and of.state != "ACTIVE":  # a cancelled goal is accepted without a word
                of.state = "ACTIVE"
                self._channel.tell({"state": "ACTIVE", "of": number, "values": {}})
            if not end:
                return
            try:
                values = {} if result is None or end == "LOST" else self._answers.read(result)
            except Unfit as problem:
                self._channel.say(f"{self._name}: the result of {self._action}: {problem}")
                values, end = {}, "ABORTED" if end == "SUCCEEDED" else end
            self._end(number, end, values)

    def _fed(self, number: int, of: _Goal, feedback: Any) -> None:
        with self._lock:
            if number in self._goals:
                try:
                    values = self._feedback.read(feedback)
                except Unfit as problem:
                    self._channel.say(f"{self._name}: feedback of {self._action}: {problem}")
                else:
                    self._channel.feed(number, of.state, nested(values))

    def _end(self, number: int, state: str, values: Dict[str, Json]) -> None:
        if self._goals.pop(number, None) is not None:
            self._channel.tell({"answer": number, "state": state, "values": nested(values)})

    def cancel(self, number: int) -> None:
        """Tell the server; its answer ends the goal. One that was not sent yet is recalled."""
        of = self._goals.get(number)
        if of is not None:
            with self._lock:
                of.cancelled.set()
                handle = of.handle
            if handle is not None:
                self._cancel(of, handle)  # who has the lock of a handle may wait for ours

    def _cancel(self, of: _Goal, handle: Any) -> None:
        """Tell the server, once it has the goal: an older status without the goal would be the end of it."""
        if handle.get_comm_state() not in (CommState.WAITING_FOR_GOAL_ACK, CommState.DONE):
            with self._lock:
                told, of.told = of.told, True
            if not told:
                handle.cancel()

    def look(self) -> None:
        """Goals at a server that has gone are lost."""
        gone = not any(one.socket is not None for one in self._client.status_sub.impl.connections)
        with self._lock:
            for number, of in list(self._goals.items()) if gone else ():
                if of.handle is not None:
                    self._client.last_status_msg = None  # the next goal waits for the next server
                    self._channel.say(f"{self._name}: the server of {self._action} is gone")
                    self._end(number, "LOST", {})
