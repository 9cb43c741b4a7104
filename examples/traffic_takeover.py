"""Both directions show green, and a monitor takes over: the times of the paper, section V, figures 5 to 7.

Verifies models/takeover, lets it run with controllers that do anything until the monitor has taken over and handed
over to the safe controllers, and says when what happened. It runs 50 times as fast as the lights.

Run it from the repository: python examples/traffic_takeover.py [FOLDER]
"""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import llfsm_verify as lv

HERE = Path(__file__).parent.parent
MODEL = HERE / "models" / "takeover" / "arrangement.yaml"
CYCLE = 0.5
"""Seconds."""


def trace(record: Path, form: str) -> str:
    command = [sys.executable, "-m", "llfsm_verify", "trace", str(record), "--to", form]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def both_green(row: dict[str, str]) -> bool:
    return row["ns_light"] == row["ew_light"] == "GREEN"


def main() -> int:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path()
    lights = lv.load(MODEL)
    checked = lights.check(HERE / "properties" / "takeover.ltl")
    held = sum(found.verdict is lv.Verdict.HOLDS for found in checked)
    print(f"{held} of {len(checked)} properties hold on {checked.states} configurations")
    with TemporaryDirectory() as temporary:
        record = Path(temporary) / "takeover"
        properties = ["never_again: G (blinking.ran -> G !(ns_light == GREEN && ew_light == GREEN))"]
        report = lights.run(properties, simulate=True, seed=4, cycles=200, rate=50, record=record).wait()
        rows = list(csv.DictReader(trace(record, "csv").splitlines()))
        target = folder / "traffic_takeover.svg"
        target.write_text(trace(record, "svg"))
    states = [row["monitor"] for row in rows]
    caught, safe = states.index("BLINKING"), states.index("SAFE")
    blinks = [rows[caught]["ns_light"], rows[caught]["ew_light"]]
    print(f"both controllers go to GREEN in the cycle that ends at {caught * CYCLE:g} s, and the monitor sees it")
    print(f"at the end of that cycle the lights show {' and '.join(blinks)}: the monitor has taken over")
    dark = next(i for i in range(caught, safe) if rows[i]["ns_light"] == "DARK")
    print(f"they blink (dark from {dark * CYCLE:g} s on)")
    print(f"the safe controllers have the lights {(safe - caught) * CYCLE:g} s later, at {safe * CYCLE:g} s")
    again = any(both_green(row) for row in rows[caught:])
    print(f"both lights green after that: {'yes' if again else 'never'}; the run was {report.ending}")
    if blinks != ["AMBER", "AMBER"] or not 20 < (safe - caught) * CYCLE <= 21 or again:
        print("that is not what was proved")
        return 1
    print(f"picture: {target}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
