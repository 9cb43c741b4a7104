"""BatMan's behaviours walk a Nao through a room with pillars, and two of them die on the way.

Verifies models/batman, then lets its machines run, in the machine code that was verified, in a small world: a room with
pillars, a battery that runs down, a sonar that sometimes lies, and people who put the robot back when it has bumped
into something. After six minutes `avoid` dies, after ten the emergency stop. Draws where the robot was.

Run it from the repository: python examples/batman.py [FOLDER]
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import llfsm_verify as lv

HERE = Path(__file__).parent.parent
ROOM, CHARGER = 2.0, (0.0, 0.0)
"""Metres: the walls are so far from the charger, which is in the middle."""
PILLARS = [(-1.3, 0.9), (0.9, 1.2), (1.3, -0.7), (-0.7, -1.3)]
STEP, TOUCH, SEEN = 0.03, 0.18, 0.5
"""Metres of a step, and from the middle of a pillar to where a foot touches it and to where the sonar sees it."""
DIES = {"avoid": 3600, "halt": 6000}
"""The cycles, of a tenth of a second, at whose beginning an operator suspends a behaviour for good."""
CYCLES = 6600


@dataclass
class World:
    """The room, the robot in it, and its battery."""

    random: Random
    x: float = 0.3
    y: float = 0.0
    heading: float = 0.0
    charge: float = 0.6
    held: int = 0
    """Cycles since a foot began to touch something."""
    path: list[tuple[float, float]] = field(default_factory=list)

    @property
    def docked(self) -> bool:
        return math.dist((self.x, self.y), CHARGER) < STEP

    @property
    def bumper(self) -> bool:
        near = any(math.dist((self.x, self.y), pillar) < TOUCH for pillar in PILLARS)
        return near or max(abs(self.x), abs(self.y)) > ROOM

    def sonar(self) -> str:
        """What is near and before the robot; one reading of fifty is wrong."""
        if self.random.random() < 0.02:
            return self.random.choice(["CLEAR", "NEAR_LEFT", "NEAR_RIGHT"])
        walls = [(ROOM, self.y), (-ROOM, self.y), (self.x, ROOM), (self.x, -ROOM)]
        for px, py in PILLARS + walls:
            angle = (math.atan2(py - self.y, px - self.x) - self.heading + math.pi) % (2 * math.pi) - math.pi
            if math.dist((self.x, self.y), (px, py)) < SEEN and abs(angle) < 0.9:
                return "NEAR_LEFT" if angle > 0 else "NEAR_RIGHT"
        return "CLEAR"

    def readings(self) -> dict[str, str | bool]:
        """What the sensors say."""
        battery = "LOW" if self.charge < 0.3 else "FULL" if self.charge > 0.95 else "HALF"
        return {"battery": battery, "docked": self.docked, "sonar": self.sonar(), "bumper": self.bumper}

    def move(self, motor: str) -> None:
        """A tenth of a second in which the legs do what they are told, about."""
        self.charge = min(1.0, self.charge + 0.01) if self.docked else max(0.0, self.charge - 0.0008)
        step = STEP * self.random.uniform(0.7, 1.1)
        if motor == "WALK":
            self.heading += self.random.gauss(0.0, 0.12)
        elif motor == "TO_CHARGER":
            self.heading = math.atan2(CHARGER[1] - self.y, CHARGER[0] - self.x)
            step = min(step, math.dist((self.x, self.y), CHARGER))
        elif motor in ("STEP_LEFT", "STEP_RIGHT"):
            self.heading += 0.35 if motor == "STEP_LEFT" else -0.35
        if motor != "STAND":
            self.x += step * math.cos(self.heading)
            self.y += step * math.sin(self.heading)
        self.held = self.held + 1 if self.bumper else 0
        if self.held > 20:  # somebody has seen it, and turns it round
            self.heading = math.atan2(-self.y, -self.x)
            self.x, self.y, self.held = self.x * 0.7, self.y * 0.7, 0
        self.path.append((self.x, self.y))


def picture(path: list[tuple[float, float]]) -> str:
    """The room from above, as SVG, with the path in one colour for as long as the same behaviours live."""
    scale, middle = 150.0, 330.0

    def at(x: float, y: float) -> tuple[float, float]:
        return middle + x * scale, middle - y * scale

    lines = [
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 660 700" font-family="sans-serif" font-size="14">',
        '<rect width="660" height="700" fill="white"/>',
        '<rect x="30" y="30" width="600" height="600" fill="#f4f4ee" stroke="#444"/>',
    ]
    for pillar in PILLARS:
        x, y = at(*pillar)
        lines.append(f'<circle cx="{x:.0f}" cy="{y:.0f}" r="{TOUCH * scale / 2:.0f}" fill="#888"/>')
    x, y = at(*CHARGER)
    lines.append(f'<rect x="{x - 6:.0f}" y="{y - 6:.0f}" width="12" height="12" fill="#2a8a2a"/>')
    ends = [0, *sorted(DIES.values()), len(path)]
    names = ["all behaviours live", "avoid is dead", "the emergency stop is dead: it stands"]
    for number, (name, colour) in enumerate(zip(names, ("#2060a0", "#c07010", "#b03030"), strict=True)):
        points = " ".join("{:.1f},{:.1f}".format(*at(*place)) for place in path[ends[number] : ends[number + 1]])
        lines.append(f'<polyline fill="none" stroke="{colour}" stroke-width="1" points="{points}"/>')
        lines.append(f'<text x="{30 + 170 * number}" y="670" fill="{colour}">{name}</text>')
    return "\n".join([*lines, "</svg>"]) + "\n"


def main() -> int:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    model = lv.load(HERE / "models" / "batman" / "arrangement.yaml")
    checked = model.check(HERE / "properties" / "batman.ltl")
    held = sum(found.verdict is lv.Verdict.HOLDS for found in checked)
    print(f"{held} of {len(checked)} properties hold on {checked.states:,} configurations")

    world, robot = World(Random(1)), model.start(seed=1)  # noqa: S311 - a world of chance that can be repeated
    wrong, bumps, charged, touching, docked = 0, [0, 0, 0], 0, False, False
    for cycle in range(CYCLES):
        readings = world.readings()
        commands = {f"operator.suspend({name})": cycle == when for name, when in DIES.items()}
        robot.cycle(readings | commands | {"operator.suspend(charge)": False})
        motor = str(robot.values["motor"])
        dead = sum(cycle >= when for when in DIES.values())
        wrong += bool(readings["bumper"]) and motor != "STAND"  # `stops`
        wrong += cycle > DIES["avoid"] and motor in ("STEP_LEFT", "STEP_RIGHT")  # `dead_avoid`
        wrong += cycle > DIES["halt"] and motor != "STAND"  # `dead_halt`
        bumps[dead] += bool(readings["bumper"]) and not touching
        charged += bool(readings["docked"]) and not docked and readings["battery"] != "FULL"
        touching, docked = bool(readings["bumper"]), bool(readings["docked"])
        world.move(motor)
    minutes = [DIES["avoid"] / 600, (DIES["halt"] - DIES["avoid"]) / 600]
    print(f"all behaviours live, {minutes[0]:g} minutes: it bumps into something {bumps[0]} times")
    print(f"avoid is dead, {minutes[1]:g} minutes: {bumps[1]} times; it went to the charger {charged} times in all")
    print(f"the emergency stop is dead: it stands; cycles in which a proved property fails: {wrong}")
    target = folder / "batman.svg"
    target.write_text(picture(world.path))
    print(f"picture: {target}")
    return 1 if wrong or held != len(checked) else 0


if __name__ == "__main__":
    sys.exit(main())
