"""Frames over a line that loses and flips bits: COBS with a checksum, and a program that makes lines of them.

A frame is a zero, a JSON object and its CRC-16/CCITT (polynomial 0x1021, from 0xFFFF, high byte first), stuffed so that
they have no zeros (S. Cheshire, M. Baker, Consistent Overhead Byte Stuffing, IEEE/ACM Transactions on Networking 7(2),
1999), and a zero. Whatever comes between two zeros and is no such frame is passed over, so that a reader is in step
again at the next zero.

`format: cobs` of a serial port sends values. A board that speaks the whole protocol of programs (hello, requests,
cycles; `llfsm_verify/runtime/ports/process`) is reached through this program, which `kind: process` runs:

    run: [python3, -m, llfsm_verify.extensions.serial.cobs, /dev/ttyUSB0, "115200"]

Wrong uses: `format: cob` (E035, with the two formats), a device that is not there (E495, with the system's word), and a
board that says nothing (E495: it has not said hello).
"""

from __future__ import annotations

import json
import os
import select
import sys
from binascii import crc_hqx
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import closing, suppress
from dataclasses import dataclass

from llfsm_verify.plug import Framing, LineReader, Malformed

LONGEST = 254
"""Bytes of a block without a zero."""
FIRST = 0xFFFF
CHECKED = 2
"""Bytes of the checksum."""
PIECE = 4096


def stuff(data: bytes) -> bytes:
    """The same without zeros: blocks, each after 1 + its length, with a zero after a block that is not full."""
    *most, last = data.split(b"\0")
    blocks = [piece[at : at + LONGEST] for piece in most for at in range(0, len(piece) + 1, LONGEST)]
    blocks += [last[at : at + LONGEST] for at in range(0, max(1, len(last)), LONGEST)]
    return b"".join(bytes([1 + len(block)]) + block for block in blocks)


def unstuff(frame: bytes) -> bytes:
    """What `stuff` was given. Malformed: it gives no such frame."""
    found, at = bytearray(), 0
    while at < len(frame):
        end = at + frame[at]
        if end > len(frame) or end == at:
            raise Malformed("a frame is cut short")
        found += frame[at + 1 : end]
        if end - at <= LONGEST and end < len(frame):
            found.append(0)
        at = end
    return bytes(found)


class Cobs(Framing):
    """See the page."""

    name, end = "frame", b"\0"

    def pack(self, line: bytes) -> bytes:
        """See `Framing`."""
        text = line.rstrip(b"\n")
        return b"\0" + stuff(text + crc_hqx(text, FIRST).to_bytes(CHECKED, "big")) + b"\0"

    def unpack(self, frame: bytes) -> bytes:
        """See `Framing`."""
        if not frame:
            return b""
        data = unstuff(frame)
        text, check = data[:-CHECKED], data[-CHECKED:]
        if len(check) < CHECKED or crc_hqx(text, FIRST) != int.from_bytes(check, "big"):
            raise Malformed("a frame has another checksum")
        return text


class Bridge:
    """Lines of JSON on one side, frames on the other."""

    def __init__(self) -> None:
        self._lines, self._frames = LineReader(), LineReader(Cobs.end)
        self._cobs, self._heard = Cobs(), False

    def framed(self, data: bytes) -> bytes:
        """The frames of what the run has written."""
        return b"".join(self._cobs.pack(line) for line in self._lines.lines(data) if line)

    def lined(self, data: bytes) -> bytes:
        """The lines of what the board has sent. A damaged frame is told, but not before the first whole one."""
        found = []
        for frame in self._frames.lines(data):
            try:
                if frame is None:
                    raise Malformed("a frame is too long")
                if frame:
                    found.append(self._cobs.unpack(frame).replace(b"\n", b" "))
                    self._heard = True
            except Malformed as problem:
                if self._heard:
                    found.append(json.dumps({"say": str(problem)}).encode())
        return b"".join(line + b"\n" for line in found)


@dataclass(slots=True)
class Way:
    """From one descriptor to another; what comes is only read when all before it is written."""

    source: int
    target: int
    made: Callable[[bytes], bytes]
    left: bytes = b""

    def move(self, ready: Mapping[int, int]) -> bool:
        """Read or write what can be; False: nothing comes any more. OSError: the other side is gone."""
        if self.left:
            if ready.get(self.target, 0) & ~select.POLLIN:
                self.left = self.left[os.write(self.target, self.left) :]
        elif ready.get(self.source, 0) & ~select.POLLOUT:
            data = os.read(self.source, PIECE)
            self.left = self.made(data)
            return bool(data)
        return True


def main(device: str, baud: str = "115200") -> int:
    """Until the run has ended, or the board is gone."""
    import serial

    try:
        with closing(serial.Serial(device, int(baud), timeout=0, exclusive=True)) as line:
            os.set_blocking(0, False)
            os.set_blocking(1, False)
            _carry(line.fileno())
    except (OSError, ValueError) as error:  # SerialException is an OSError
        sys.stderr.write(f"{device}: {error}\n")
        return 1
    return 0


def _carry(board: int) -> None:
    bridge = Bridge()
    ways = Way(0, board, bridge.framed), Way(board, 1, bridge.lined)
    goes_on = True
    while goes_on:
        wanted: Counter[int] = Counter()
        for way in ways:
            wanted[way.target if way.left else way.source] += select.POLLOUT if way.left else select.POLLIN
        poll = select.poll()
        for descriptor, events in wanted.items():
            poll.register(descriptor, events)
        ready = dict(poll.poll())
        with suppress(BlockingIOError):
            for way in ways:
                goes_on &= way.move(ready)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
