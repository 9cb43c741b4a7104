"""The kind `mqtt`: each input and output is a topic of a broker, and a message is the text of a value.

The client of paho-mqtt runs without a thread of its own: its socket is watched with all others. A lost connection is
followed by a new client, so that no message of the old one is sent late.
"""

from __future__ import annotations

import os
import select
import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from llfsm_verify.plug import Link, Shown, Unopened, text

if TYPE_CHECKING:
    from paho.mqtt.client import Client, MQTTMessageInfo

PATIENCE = 5.0
"""Seconds in which a broker must answer."""
RETRY = 1.0
"""Seconds between two attempts to connect again, and the longest that one may take."""
HINT = "start the broker, or correct what the port says about it"
MOST_BYTES = 1 << 16
"""Of a message."""


@dataclass(frozen=True, slots=True)
class MqttSettings:
    """Of a connection to a broker."""

    host: str
    port: int = 1883
    client_id: str = ""
    username: str | None = None
    password_env: str | None = None
    """The environment variable that has the password."""
    qos: int = 1
    retain: bool = False
    keepalive: int = 15
    """Seconds between two signs of life."""


class MqttPort:
    """A connection to a broker. Unopened: nobody answers there, or it refuses us."""

    every_frame = False

    def __init__(self, link: Link, settings: MqttSettings) -> None:
        self._link = link
        self._settings = settings
        self._client: Client | None = None
        self._next = 0.0
        self._ready = False
        """Whether the broker has taken us and our subscriptions."""
        self._refused: str | None = None
        self._since: float | None = None
        self._wanted: dict[str, str] = {}
        """What each topic shall have."""
        self._told: dict[str, str] = {}
        """What each has been told over this connection."""
        self._going: list[MQTTMessageInfo] = []
        client = self._connect()
        limit = time.monotonic() + PATIENCE
        while not self._is_settled() and time.monotonic() < limit:
            client.loop(0.1)
        problem = self._problem()
        if problem is not None:
            self.close()
            raise Unopened(f"the broker {self._where}: {problem}", HINT)

    def _problem(self) -> str | None:
        return None if self._ready else self._refused or "it does not answer"

    def _is_settled(self) -> bool:
        """Whether the broker has taken us, or will not."""
        return self._ready or self._refused is not None or self._client is None or self._client.socket() is None

    @property
    def _where(self) -> str:
        return f"{self._settings.host}:{self._settings.port}"

    def _connect(self) -> Client:
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        of = self._settings
        client = Client(CallbackAPIVersion.VERSION2, client_id=of.client_id, reconnect_on_failure=False)
        client.connect_timeout = RETRY
        if of.username is not None:
            password = None if of.password_env is None else os.environ.get(of.password_env)
            if of.password_env is not None and password is None:
                why = f"there is no environment variable {of.password_env}"
                raise Unopened(why, "set it to the password")
            client.username_pw_set(of.username, password)
        client.on_connect, client.on_subscribe = self._on_connect, self._on_subscribe
        client.on_message, client.on_disconnect = self._on_message, self._on_disconnect
        self._ready, self._refused, self._since = False, None, None
        self._told, self._going = {}, []
        try:
            client.connect(of.host, of.port, of.keepalive)
        except (OSError, ValueError) as error:
            why = getattr(error, "strerror", None) or str(error)
            raise Unopened(f"the broker {self._where}: {why}", HINT) from None
        self._client = client
        return client

    def _on_connect(self, client: Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        if reason.is_failure:
            self._refused = str(reason)
        elif self._link.fields:
            client.subscribe([(topic, self._settings.qos) for topic in sorted(self._link.fields)])
        else:
            self._ready = True

    def _on_subscribe(self, _client: Client, _data: Any, _mid: int, reasons: Any, _properties: Any) -> None:
        refused = [str(reason) for reason in reasons if reason.is_failure]
        self._refused = f"a topic is refused: {refused[0]}" if refused else None
        self._ready = not refused

    def _on_message(self, _client: Client, _data: Any, message: Any) -> None:
        if len(message.payload) > MOST_BYTES:
            self._link.malformed(f"a message is longer than {MOST_BYTES:,} bytes")
            return
        try:
            self._link.take({message.topic: message.payload.decode("utf-8")})
        except UnicodeDecodeError:
            self._link.malformed("a message is not UTF-8")

    def _on_disconnect(self, _client: Client, _data: Any, _flags: Any, reason: Any, _properties: Any) -> None:
        self._refused = self._refused or f"the connection is lost: {reason}"

    def waits(self) -> Iterator[tuple[int, int]]:
        """See `Port`."""
        connection = None if self._client is None else self._client.socket()
        if self._client is not None and connection is not None:
            yield connection.fileno(), select.POLLIN | (select.POLLOUT if self._client.want_write() else 0)

    def serve(self, ready: Mapping[int, int], now: float) -> None:
        """See `Port`."""
        if self._client is None:
            self._reconnect(now)
            return
        client, before = self._client, self._refused
        for events in ready.values():
            if events & ~select.POLLOUT:
                client.loop_read()
            if events & select.POLLOUT:
                client.loop_write()
        client.loop_misc()
        if self._since is None:
            self._since = now
        if not self._ready and now > self._since + PATIENCE:
            self._refused = self._refused or "the broker does not answer"
        if client.socket() is None or self._refused != before:
            self._lose(now)
        else:
            self._publish()

    def _reconnect(self, now: float) -> None:
        if now >= self._next:
            try:
                self._connect()
            except Unopened:
                self._next = now + RETRY

    def _lose(self, now: float) -> None:
        assert self._client is not None
        client, self._client = self._client, None
        why = self._refused or "the connection is lost"
        client.on_disconnect = None
        client.disconnect()
        self._next = now + RETRY
        self._link.lost(f"the broker {self._where}: {why}")

    def send(self, values: Mapping[str, Shown]) -> None:
        """See `Port`."""
        if not self.flushed:
            self._link.unsent("the broker is gone" if self._client is None else "the broker is not fast enough")
        self._wanted = {topic: text(value) for topic, value in values.items()}
        if self._client is not None:
            self._publish()

    def _publish(self) -> None:
        """Send what topics have not been told, when all before is with the broker."""
        assert self._client is not None
        if not self._ready or self._client.want_write() or not all(info.is_published() for info in self._going):
            return
        for _ in self._going:
            self._link.sent()
        self._going = []
        for topic, value in self._wanted.items():
            if self._told.get(topic) != value:
                self._told[topic] = value
                self._going.append(
                    self._client.publish(topic, value, qos=self._settings.qos, retain=self._settings.retain)
                )

    @property
    def flushed(self) -> bool:
        """See `Port`."""
        return self._told == self._wanted and not self._going

    def close(self) -> None:
        """See `Port`."""
        if self._client is not None:
            self._client.on_disconnect = None
            self._client.disconnect()
            self._client = None
