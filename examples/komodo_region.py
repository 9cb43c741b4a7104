"""The Komodo robot strolls on a track: without its guard it leaves the region, with it never.

Verifies both arrangements of models/komodo_region, lets each run for ten minutes of its time in a world with wheels
that slip and an error of the sensor, and draws where the robot was.

Run it from the repository: python examples/komodo_region.py [FOLDER]
"""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import llfsm_verify as lv

MODELS = Path(__file__).parent.parent / "models" / "komodo_region"
REGION = "region: G (env.x >= -1.0 && env.x <= 1.0)"
CYCLES, EDGE = 2400, 1.0
"""Ten minutes, and metres."""


def cycles_of(path: Path, seed: int, folder: Path) -> list[dict[str, str]]:
    """What a simulated run shows at the end of each cycle."""
    record = folder / f"{path.stem}_{seed}"
    lv.load(path).run(simulate=True, seed=seed, cycles=CYCLES, rate=0, record=record).wait()
    command = [sys.executable, "-m", "llfsm_verify", "trace", str(record), "--to", "csv"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return list(csv.DictReader(done.stdout.splitlines()))


def places(name: str, seed: int, folder: Path) -> list[float]:
    """Where the robot is at the end of each cycle of a run, in metres."""
    return [float(row["env.x"]) for row in cycles_of(MODELS / f"{name}.yaml", seed, folder)]


def picture(paths: dict[str, list[float]]) -> str:
    """The paths over time, as SVG; the region is shaded."""
    width, height, scale = 900, 320, 70.0
    colours = ["#b03030", "#2060a0"]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
        f'<rect x="60" y="{height / 2 - EDGE * scale}" width="820" height="{2 * EDGE * scale}" fill="#e6f0e6"/>',
        f'<text x="8" y="{height / 2 - EDGE * scale + 4}">1 m</text>',
        f'<text x="8" y="{height / 2 + EDGE * scale + 4}">-1 m</text>',
    ]
    for number, (name, path) in enumerate(paths.items()):
        step = 820 / max(1, len(path) - 1)
        points = " ".join(f"{60 + i * step:.1f},{height / 2 - x * scale:.1f}" for i, x in enumerate(path))
        dashes = ' stroke-dasharray="4 3"' if number == 0 else ""
        lines.append(f'<polyline fill="none" stroke="{colours[number]}"{dashes} points="{points}"/>')
        lines.append(f'<text x="{70 + 300 * number}" y="{height - 12}" fill="{colours[number]}">{name}</text>')
    return "\n".join([*lines, "</svg>"]) + "\n"


def main() -> int:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    paths = {}
    for name, what in (("faulty_unguarded", "without the guard"), ("stroll", "with the guard")):
        checked = lv.load(MODELS / f"{name}.yaml").check([REGION])
        holds = checked.exit_code == 0
        print(f"{what}: `region` is proved" if holds else f"{what}: `region` is violated, says the verifier")
        with TemporaryDirectory() as temporary:
            runs = [places(name, seed, Path(temporary)) for seed in range(1, 4)]
        outside = [next((i for i, x in enumerate(run) if abs(x) > EDGE), None) for run in runs]
        left = [cycle for cycle in outside if cycle is not None]
        farthest = max(abs(x) for run in runs for x in run)
        first = f", at first after {min(left) / 4:g} s" if left else ""
        print(f"  {len(left)} of {len(runs)} runs leave the region{first}; the farthest place is {farthest:.2f} m away")
        paths[what] = max(runs, key=lambda run: max(map(abs, run)))
        if bool(left) is holds:
            print("the runs and the verifier contradict each other")
            return 1
    target = folder / "komodo_region.svg"
    target.write_text(picture(paths))
    print(f"picture: {target}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
