"""A shaft and passengers for the lift as a daemon: moves a cabin as the motor runs, and presses buttons.

    python examples/lift_daemon/shaft.py lift/lift --record monday --cycles 6000

It starts the program, with what follows it, and ends when the program does, or at Ctrl-C.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import selectors
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field

SPEED = 0.5
"""Floors in a second."""
NEAR = 0.02
"""How near to a floor the cabin is level with it."""
DOOR = 0.3
"""Seconds in which the door opens."""
LOOK = 0.004
"""Seconds between two looks."""


@dataclass(slots=True)
class Shaft:
    """Where the cabin and its door are, and which buttons are pressed until when."""

    height: float = 0.0
    gap: float = 0.0
    floor: int = 0
    pressed: dict[int, float] = field(default_factory=dict)
    calls: int = 0
    stops: int = 0

    def move(self, motor: str, opens: bool, seconds: float) -> None:
        """So much time has passed."""
        self.height += {"UP": SPEED, "DOWN": -SPEED}.get(motor, 0) * seconds
        if not -4 * NEAR < self.height < 2 + 4 * NEAR:
            raise SystemExit(f"the cabin has left the shaft: it is at {self.height:.2f}")
        was = self.gap
        self.gap = min(1.0, max(0.0, self.gap + (seconds if opens else -seconds) / DOOR))
        self.stops += was < 1.0 <= self.gap
        if self.level:
            self.floor = round(self.height)

    @property
    def level(self) -> bool:
        return abs(self.height - round(self.height)) <= NEAR

    def press(self, now: float, chance: random.Random, seconds: float) -> None:
        """Somebody comes every three seconds, and keeps the button pressed for a moment."""
        if chance.random() < seconds / 3:
            self.pressed[chance.randrange(3)] = now + 0.1 + 0.2 * chance.random()
            self.calls += 1
        self.pressed = {floor: until for floor, until in self.pressed.items() if until > now}

    @property
    def inputs(self) -> dict[str, object]:
        calls = {f"call[{i}]": i in self.pressed for i in range(3)}
        return {**calls, "floor": self.floor, "level": self.level, "shut": self.gap == 0.0}


def drive(program: subprocess.Popen[bytes], shaft: Shaft, chance: random.Random) -> str:
    """Until the program has ended: why."""
    assert program.stdin is not None
    assert program.stdout is not None
    outputs: dict[str, object] = {"motor": "STOP", "open": False}
    rest, shown, before = b"", dict[str, object](), time.monotonic()
    with selectors.DefaultSelector() as ready:
        ready.register(program.stdout, selectors.EVENT_READ)
        while "end" not in outputs:
            if ready.select(LOOK):
                read = os.read(program.stdout.fileno(), 1 << 16)
                if not read:
                    break
                *lines, rest = (rest + read).split(b"\n")
                outputs = json.loads(lines[-1]) if lines else outputs
            now = time.monotonic()
            shaft.move(str(outputs["motor"]), bool(outputs["open"]), now - before)
            shaft.press(now, chance, now - before)
            before, inputs = now, shaft.inputs
            if inputs != shown:
                program.stdin.write(json.dumps(inputs).encode() + b"\n")
                program.stdin.flush()
                shown = inputs
    return str(outputs.get("end", "it says no more"))


def main() -> None:
    parser = argparse.ArgumentParser(description="A shaft and passengers for the lift as a daemon.")
    parser.add_argument("program", help="what `llfsm build --for posix` and make have made")
    parser.add_argument("--seed", type=int, default=1, help="of the passengers")
    options, words = parser.parse_known_args()
    command = [options.program, *words]
    shaft = Shaft()
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as program:
        signal.signal(signal.SIGINT, lambda *_: program.terminate())
        try:
            why = drive(program, shaft, random.Random(options.seed))  # noqa: S311 - for buttons
        except BrokenPipeError:
            why = "it reads no more"
        program.terminate()
    print(f"{why}: {shaft.calls} call{'s' * (shaft.calls != 1)}, {shaft.stops} times the door was open")
    sys.exit(program.returncode)


if __name__ == "__main__":
    main()
