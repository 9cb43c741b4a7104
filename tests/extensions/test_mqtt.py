"""Topics of a real broker, Mosquitto: values both ways, a broker that dies and comes back, and one that refuses."""

from __future__ import annotations

import signal
import socket
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import paho.mqtt.client as mqtt
import pytest
from paho.mqtt.enums import CallbackAPIVersion

from llfsm_verify.diagnostics import DiagnosticError
from tests.outside import needs, program
from tests.runtime.ports.bench import Bench, bench, declared

pytestmark = needs("mosquitto")
TEXT = """\
ports:
  house:
    kind: mqtt
    host: 127.0.0.1
    port: %d
    inputs: {level: in/level, mode: in/mode, speed: in/speed}
    outputs: {level: out/level, mode: out/mode, speed: out/speed}
    on_failure: safe
    safe: {level: -3, mode: HIGH, speed: 0.5}
    retain: true
"""


class Broker:
    """A broker on a port of its own, which may die and come back."""

    def __init__(self, folder: Path, settings: str = "allow_anonymous true") -> None:
        self._folder, self._settings = folder, settings
        self.port = 0
        self.start()

    def start(self) -> None:
        while True:
            if not self.port:
                with socket.create_server(("127.0.0.1", 0)) as free:
                    self.port = free.getsockname()[1]
            configuration = self._folder / "mosquitto.conf"
            configuration.write_text(f"listener {self.port} 127.0.0.1\n{self._settings}\n")
            self._process = subprocess.Popen(
                [program("mosquitto"), "-c", configuration], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            while self._process.poll() is None:
                try:
                    socket.create_connection(("127.0.0.1", self.port)).close()
                    return
                except ConnectionRefusedError:
                    time.sleep(0.005)
            self.port = 0  # somebody else has taken it meanwhile

    def pause(self) -> None:
        self._process.send_signal(signal.SIGSTOP)
        while Path(f"/proc/{self._process.pid}/stat").read_text().rpartition(") ")[2][0] != "T":
            time.sleep(0)

    def resume(self) -> None:
        self._process.send_signal(signal.SIGCONT)

    def stop(self) -> None:
        self._process.kill()
        self._process.wait()


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    running = Broker(tmp_path)
    yield running
    running.stop()


class World:
    """Another client of the broker."""

    def __init__(self, port: int) -> None:
        self.heard: dict[str, str] = {}
        self._client = mqtt.Client(CallbackAPIVersion.VERSION2)
        self._client.on_message = self._hear
        self._client.connect("127.0.0.1", port)
        self._client.on_subscribe = self._listen
        self._listens = False
        self._client.subscribe("out/#", qos=1)
        while not self._listens:  # what is published before is not heard
            self.look()

    def _listen(self, *_: object) -> None:
        self._listens = True

    def _hear(self, _client: object, _data: object, message: mqtt.MQTTMessage) -> None:
        self.heard[message.topic] = message.payload.decode()

    def publish(self, topic: str, text: str | bytes) -> None:
        self._client.publish(topic, text, qos=1)

    def look(self) -> None:
        assert self._client.loop(0.001) is mqtt.MQTT_ERR_SUCCESS, f"the broker is gone; heard until then: {self.heard}"

    def close(self) -> None:
        self._client.disconnect()


@contextmanager
def connected(port: int) -> Iterator[World]:
    world = World(port)
    try:
        yield world
    finally:
        world.close()


def wait(made: Bench, world: World, heard: dict[str, str]) -> None:
    """Until the world has heard all this."""
    while any(world.heard.get(topic) != text for topic, text in heard.items()):
        made.turn()
        world.look()


@pytest.mark.slow
def test_values_go_both_ways_and_a_broker_dies(broker: Broker, tmp_path: Path) -> None:
    with bench(*declared(TEXT % broker.port, tmp_path)) as made:
        counts = made.ports.counts["house"]
        with connected(broker.port) as world:
            wait(made, world, {"out/level": "-1", "out/mode": "LOW", "out/speed": "0.00"})
            for topic, text in (
                ("in/level", "9"), ("in/level", "x"), ("in/level", ""), ("in/mode", b"\xff"),
                ("in/speed", "y" * 70_000), ("in/mode", "HIGH"), ("in/speed", "-0.75"), ("in/level", "2"),
            ):  # fmt: skip
                world.publish(topic, text)
            wait(made, world, {"out/level": "2", "out/mode": "HIGH", "out/speed": "-0.75"})
            assert (counts.refused, counts.malformed, counts.taken) == (3, 2, 3)

        broker.stop()
        made.until(made.has("level", -3))
        made.until(made.has("mode", "HIGH"))
        assert str(made.value("speed")) == "0.50" and counts.failures == 3
        made.now += 10
        made.turn()  # nobody answers, and the loop goes on
        assert made.ports.failure is None

        broker.start()
        made.now += 10
        with connected(broker.port) as world:  # whose broker knows nothing any more
            wait(made, world, {"out/level": "-3", "out/mode": "HIGH", "out/speed": "0.50"})
            world.publish("in/level", "4")
            wait(made, world, {"out/level": "4"})
            made.end("stopped")
            wait(made, world, {"out/level": "-3", "out/mode": "HIGH"})


def test_the_broker_keeps_what_was_sent_last(broker: Broker, tmp_path: Path) -> None:
    with bench(*declared(TEXT % broker.port, tmp_path)) as made:
        made.turn()
        made.board.posts.post({"level": 3})
        made.loop.go(1)
        made.end("ended")
        with connected(broker.port) as world:
            wait(made, world, {"out/level": "3", "out/mode": "LOW"})
            assert made.ports.counts["house"].unsent == 0


def test_a_broker_that_wants_a_password(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-b", "-c", passwords, "me", "secret"], check=True)
    passwords.chmod(0o644)
    text = TEXT.replace("    retain: true\n", "    username: me\n    password_env: LLFSM_TEST_PASSWORD\n")
    running = Broker(tmp_path, f"allow_anonymous false\npassword_file {passwords}\nuser root")
    try:
        for given, why in (("wrong", "Not authorized"), (None, "LLFSM_TEST_PASSWORD")):
            if given is None:
                monkeypatch.delenv("LLFSM_TEST_PASSWORD")
            else:
                monkeypatch.setenv("LLFSM_TEST_PASSWORD", given)
            with pytest.raises(DiagnosticError, match=why) as caught, bench(*declared(text % running.port, tmp_path)):
                pass
            assert [d.code for d in caught.value.diagnostics] == ["E495"]
        monkeypatch.setenv("LLFSM_TEST_PASSWORD", "secret")
        with bench(*declared(text % running.port, tmp_path)) as made:
            made.until(lambda: made.ports.counts["house"].sent == 3)
            assert made.said == []
    finally:
        running.stop()


def test_nobody_answers(broker: Broker, tmp_path: Path) -> None:
    broker.stop()
    with pytest.raises(DiagnosticError, match="Connection refused"), bench(*declared(TEXT % broker.port, tmp_path)):
        pass


def test_a_broker_that_stands_still_holds_nobody_up(broker: Broker, tmp_path: Path) -> None:
    text = (TEXT % broker.port).replace("retain: true", "keepalive: 3600")
    with bench(*declared(text, tmp_path)) as made, connected(broker.port) as world:
        counts = made.ports.counts["house"]
        wait(made, world, {"out/level": "-1"})
        broker.pause()
        for turn in range(20):
            level = turn % 4
            made.board.posts.post({"level": level})
            made.loop.go(1)
            made.ports.serve(0)
        assert counts.unsent >= 5, (counts, made.said)
        broker.resume()
        wait(made, world, {"out/level": str(level)})
        assert made.said == ["port house: an output is not written: the broker is not fast enough"]
