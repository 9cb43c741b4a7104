"""The kind `serial`: JSON over a serial line, which pyserial opens, in lines or in frames with a checksum (COBS)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from llfsm_verify.extensions.serial.cobs import Cobs
from llfsm_verify.plug import (
    LINE_FRAMING,
    NUMBER,
    Field,
    LinePort,
    Link,
    Node,
    Report,
    Single,
    Started,
    Table,
    Unopened,
    Words,
    whole_number,
)

if TYPE_CHECKING:
    from serial import Serial

FORMATS = {"json-lines": LINE_FRAMING, "cobs": Cobs()}
BAUD = 115_200


class SerialEnd:
    """Both ends of a serial line. A device that is unplugged may come back."""

    retry = 1.0

    def __init__(self, device: str, baud: int) -> None:
        self._device, self._baud = device, baud
        self._serial: Serial | None = None
        self.returns = False

    def open(self) -> int | None:
        """See `End`. The device belongs to this process alone."""
        import serial

        try:
            self._serial = serial.Serial(self._device, self._baud, timeout=0, write_timeout=0, exclusive=True)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            if self.returns:
                return None
            hint = "connect the device, correct its path, or end what uses it"
            raise Unopened(f"{self._device}: {_reason(error)}", hint) from None
        self.returns = True
        return os.dup(self._serial.fileno())

    def renew(self, descriptor: int) -> int | None:
        """See `End`."""
        os.close(descriptor)
        self._give_back()
        return None

    def close(self) -> None:
        """See `End`."""
        self._give_back()

    def _give_back(self) -> None:
        if self._serial is not None:
            self._serial.close()
            self._serial = None


def _reason(error: Exception) -> str:
    number = getattr(error, "errno", None)
    return os.strerror(number) if number else str(error)


class SerialLine:
    """`device:`, `baud:` and `format:`."""

    table = Table(
        "JSON over a serial line",
        (
            Field("device", "its path", Single(("string",)), required=True),
            Field("baud", f"bits a second; {BAUD} when nothing is said", NUMBER),
            Field("format", "how messages are written", Words(tuple(FORMATS))),
        ),
    )
    keys, required, paths = table.keys, table.required, True

    def settings(self, report: Report, found: Mapping[str, Node], what: str, folder: str) -> Started | None:
        """See `Kind`."""
        device = report.scalar(found["device"], "`device`")
        baud = whole_number(report, found, "baud", 50, 20_000_000, BAUD)
        written = report.choice(found.get("format"), f"`format` of {what}", tuple(FORMATS), "json-lines")
        if device is None or baud is None:
            return None
        path = os.path.normpath(Path(folder, device.text))

        def start(link: Link) -> LinePort:
            end = SerialEnd(path, baud)
            return LinePort(link, end, end, FORMATS[written])

        return Started(start, (f"`{path}`",))

    def field_problem(self, name: str, *, output: bool) -> str | None:  # noqa: ARG002 - any text is a key
        """See `Kind`."""
        return None


KIND = SerialLine()
