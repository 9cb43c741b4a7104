"""Every faulty microwave under a guard: what the requirements prohibit of the tube is kept, proved and run.

For each faulty arrangement of models/microwave and each requirement that says when the tube is off, `llfsm guard` puts
a monitor and a switch before `motor`, and proves that it is kept, whatever the machines do. Then the microwave runs for
an hour of random doors and buttons, without the guard and with it.

Run it from the repository: python examples/microwave_guard.py [REQUIREMENT ...]
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import llfsm_verify as lv

HERE = Path(__file__).parent.parent
PROPERTIES = HERE / "properties" / "microwave.ltl"
PROHIBITIONS = ("R1_no_longer", "R5_stops_cooking", "R5_does_not_start", "R7_tube_off")
CYCLES = 3600


def violated(path: Path, requirement: str) -> bool:
    """Whether an hour of a random run violates it."""
    report = lv.load(path).run([requirement], simulate=True, seed=1, cycles=CYCLES, rate=0).wait()
    return any(verdict == "violated" for _, verdict, _ in report.monitored)


def guard(path: Path, requirement: str, folder: Path) -> bool:
    """Write the guarded arrangement; whether what it keeps is proved."""
    command = [sys.executable, "-m", "llfsm_verify", "guard", str(path), "--fallback", "motor=false", "-p", requirement]
    return subprocess.run([*command, "-o", str(folder)], capture_output=True, text=True, check=False).returncode == 0


def main() -> int:
    lines = {line.split(":")[0]: line for line in PROPERTIES.read_text().splitlines()}
    good = True
    with TemporaryDirectory() as temporary:
        for path in sorted((HERE / "models" / "microwave").glob("faulty_*.yaml")):
            for name in sys.argv[1:] or PROHIBITIONS:
                folder = Path(temporary) / path.stem / name
                proved = guard(path, lines[name], folder)
                without, within = violated(path, lines[name]), violated(folder / path.name, lines[name])
                told = "violated" if without else "not violated in this hour"
                kept = "violated" if within else "not violated"
                print(f"{path.stem} {name}: {told}; guarded: {'proved' if proved else 'not proved'}, {kept}")
                good = good and proved and not within
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
