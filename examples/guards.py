"""Faulty machines under a guard: what the requirements prohibit is kept, proved and run.

For each faulty microwave or radiation machine, and each requirement that says when its tube or its beam is off, `llfsm
guard` puts a monitor and a switch before that output, and proves that it is kept, whatever the machines do. Then the
machine runs for an hour of random doors and buttons, without the guard and with it.

Run it from the repository: python examples/guards.py microwave|xray [REQUIREMENT ...]
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import llfsm_verify as lv

HERE = Path(__file__).parent.parent
CASES = {
    "microwave": ("motor=false", ("R1_no_longer", "R5_stops_cooking", "R5_does_not_start", "R7_tube_off")),
    "xray": ("beam=false", ("no_overdose", "no_underdose", "as_shown", "door_stops")),
}
"""For each model what comes in the place of what its machines wish, and what it keeps."""
CYCLES = 3600


def violated(path: Path, requirement: str) -> bool:
    """Whether an hour of a random run violates it."""
    report = lv.load(path).run([requirement], simulate=True, seed=1, cycles=CYCLES, rate=0).wait()
    return any(verdict == "violated" for _, verdict, _ in report.monitored)


def guard(path: Path, requirement: str, fallback: str, folder: Path) -> bool:
    """Write the guarded arrangement; whether what it keeps is proved."""
    command = [sys.executable, "-m", "llfsm_verify", "guard", str(path), "--fallback", fallback, "-p", requirement]
    return subprocess.run([*command, "-o", str(folder)], capture_output=True, text=True, check=False).returncode == 0


def main() -> int:
    if len(sys.argv) < 2 or sys.argv[1] not in CASES:
        print(f"python examples/guards.py {'|'.join(CASES)} [REQUIREMENT ...]")
        return 2
    model, good = sys.argv[1], True
    fallback, prohibitions = CASES[model]
    texts = (HERE / "properties" / f"{model}.ltl").read_text().splitlines()
    lines = {line.split(":")[0]: line for line in texts}
    with TemporaryDirectory() as temporary:
        for path in sorted((HERE / "models" / model).glob("faulty_*.yaml")):
            for name in sys.argv[2:] or prohibitions:
                folder = Path(temporary) / path.stem / name
                proved = guard(path, lines[name], fallback, folder)
                without, within = violated(path, lines[name]), violated(folder / path.name, lines[name])
                told = "violated" if without else "not violated in this hour"
                kept = "violated" if within else "not violated"
                print(f"{path.stem} {name}: {told}; guarded: {'proved' if proved else 'not proved'}, {kept}")
                good = good and proved and not within
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
