"""What a file of ports says of a broker."""

from __future__ import annotations

from collections.abc import Mapping

from llfsm_verify.extensions.mqtt.port import MqttPort, MqttSettings
from llfsm_verify.plug import (
    NUMBER,
    TRUTHS,
    WRONG_PORT,
    Field,
    Link,
    Node,
    Report,
    Single,
    Started,
    Table,
    Words,
    mark,
    whole_number,
)

MOST_TOPIC = 65_535


class Mqtt:
    """The settings of `MqttSettings`, by their names."""

    table = Table(
        "topics of a broker; a message is the text of a value",
        (
            Field("host", "where the broker is", Single(("string",)), required=True),
            Field("port", "its port; the default is 1883", NUMBER),
            Field("client_id", "the name of the client; by default the broker chooses one"),
            Field("username", "the user"),
            Field("password_env", "the environment variable that has the password", Single(("string",))),
            Field("qos", "the quality of service, 0, 1 or 2; the default is 1", Words(("0", "1", "2"))),
            Field(
                "retain",
                "whether the broker keeps the last values for later subscribers; the default is `false`",
                Words(TRUTHS),
            ),
            Field(
                "keepalive",
                "seconds between two pings, 15 by default; a broker that does not answer is lost",
                NUMBER,
            ),
        ),
        needs={"password_env": ("username",)},
    )
    keys, required = table.keys, table.required

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:  # noqa: ARG002 - no path here
        """See `Kind`."""
        before = len(report.diagnostics)
        words: dict[str, str] = {}
        for key in ("host", "client_id", "username", "password_env"):
            scalar = report.scalar(found[key], f"`{key}`") if key in found else None
            if scalar is not None:
                words[key] = scalar.text
        if "password_env" in words and "username" not in found:
            message = f"{what} has a `password_env` and no `username`"
            report.error(WRONG_PORT, message, mark(found["password_env"]), "write `username: …`")
        port = whole_number(report, found, "port", 1, 65_535, 1883)
        qos = whole_number(report, found, "qos", 0, 2, 1)
        keepalive = whole_number(report, found, "keepalive", 1, 3600, 15)
        retain = report.choice(found.get("retain"), f"`retain` of {what}", TRUTHS, "false") == "true"
        if len(report.diagnostics) > before or port is None or qos is None or keepalive is None:
            return None
        of = MqttSettings(
            words["host"], port, words.get("client_id", ""), words.get("username"), words.get("password_env"), qos,
            retain, keepalive,
        )  # fmt: skip

        def start(link: Link) -> MqttPort:
            return MqttPort(link, of)

        return Started(start)

    def field_problem(self, name: str, *, output: bool) -> str | None:  # noqa: ARG002 - a topic is a topic
        """See `Kind`."""
        if "+" in name or "#" in name:
            return "a topic has no `+` or `#` here: each input and output has one of its own"
        if not name or "\0" in name or len(name.encode("utf-8", "replace")) > MOST_TOPIC:
            return f"a topic has at least one character and at most {MOST_TOPIC:,} bytes"
        return None


KIND = Mqtt()
