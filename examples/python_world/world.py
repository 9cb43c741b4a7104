"""A world for the Komodo robot, which the run waits for: each line that it writes begins a cycle.

`llfsm run models/komodo_stroll/arrangement.yaml --ports examples/python_world/world.ports.yaml --for 60s`
"""

import json
import random
import sys
from dataclasses import dataclass

SPEED = {"TOT_STOP": 0.0, "FORWARD": 0.4, "BACKWARD": -0.4}
INERTIA = 0.3
"""Seconds in which the wheels come nearly to the speed that they are told."""
WALL = 2.0


@dataclass
class World:
    """A corridor, in metres, and the robot in it."""

    dice: random.Random
    seconds: float = 0.0
    x: float = 0.0
    speed: float = 0.0
    walked: float = 0.0
    bumps: int = 0

    def step(self, motion: str, seconds: float) -> None:
        """What happens in so much time where the motors are told this motion."""
        self.speed += (SPEED[motion] - self.speed) * min(1.0, seconds / INERTIA)
        before, self.x = self.x, self.x + self.speed * seconds
        if abs(self.x) > WALL:
            self.x, self.speed = max(-WALL, min(WALL, self.x)), 0.0
            self.bumps += 1
        self.walked += abs(self.x - before)
        self.seconds += seconds


def say(**line: object) -> None:
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()


def main(seed: str = "1") -> None:
    world = World(random.Random(int(seed)))  # noqa: S311 - a dice
    hello = json.loads(sys.stdin.readline())
    say(hello=hello["hello"])
    cycle = hello["cycle"]
    say(cycle=cycle, values={"dice": world.dice.randint(1, 2)})
    for line in sys.stdin:
        told = json.loads(line)
        if "end" in told:
            break
        if told.get("cycle") == cycle:  # the frame at its end
            world.step(told["values"]["motion"], hello["cycle_ms"] / 1000)
            cycle += 1
            say(cycle=cycle, values={"dice": world.dice.randint(1, 2)})
    where = f"{world.walked:.2f} m in {world.seconds:g} s, {world.bumps} bumps, now at {world.x:+.2f} m"
    sys.stderr.write(f"the robot has walked {where}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
