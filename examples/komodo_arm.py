"""The Komodo robot stretches its arm: the further it is out, the slower the wheels turn, inside the region.

Verifies models/komodo_arm with both monitors and with one of them, lets each run for ten minutes of its time with any
stroll and any arm, and counts how often the wheels were too fast for the arm.

Run it from the repository: python examples/komodo_arm.py
"""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from komodo_region import CYCLES, cycles_of

import llfsm_verify as lv

MODELS = Path(__file__).parent.parent / "models" / "komodo_arm"
STEADY = "steady: G (abs(speed) <= 0.4 - 0.3 * env.stretched)"


def too_fast(row: dict[str, str]) -> bool:
    return abs(float(row["speed"])) > 0.4 - 0.3 * float(row["env.stretched"]) + 1e-9


def main() -> int:
    for name, what in (("faulty_one_monitor", "without the arm's monitor"), ("arrangement", "with both monitors")):
        path = MODELS / f"{name}.yaml"
        holds = lv.load(path).check([STEADY]).exit_code == 0
        with TemporaryDirectory() as temporary:
            rows = [row for seed in (1, 2) for row in cycles_of(path, seed, Path(temporary))]
        count = sum(map(too_fast, rows))
        print(f"{what}: `steady` is {'proved' if holds else 'violated, says the verifier'};")
        print(f"  in {2 * CYCLES:,} cycles the wheels are too fast for the arm {count:,} times")
        if bool(count) is holds:
            print("the runs and the verifier contradict each other")
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
