"""Seconds by which checks go beyond their time limit, from the shell: python -m benchmarks.limits [FOLDER …].

A folder has one arrangement, `arrangement.yaml` or `chain.yaml`, and one file of properties; without any, the models of
this repository are taken, and those of `benchmarks.practice`. Two seconds are promised
(docs/decisions/0063-time-limits.md), on a computer that has a core for it.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from benchmarks.practice import rows

ROOT = Path(__file__).parents[1]
ENGINES = ("auto", "explicit", "bmc", "induction", "pdr", "all")
PROMISED = 2.0


PAST = (
    """cycle_ms: 100
whiteboard: {x: {type: bool, role: input}, lamp: {type: bool}}
machines:
  m: {inline: {machine: M, states: [{name: A, transitions: [{when: x, to: A}]}]}}
schedule: [m]
""",
    "a: G O[0:1048576] x\nb: G (lamp S[999:1000000] x)\nc: F G O[100000s:100000s] x\nd: G (x -> X H[0:1048576] !x)\n",
)
"""One configuration, and properties that look back far."""


def tasks(folders: list[Path]) -> Iterator[tuple[Path, Path]]:
    """Arrangements, each with its properties."""
    for folder in folders:
        arrangement = next(f for n in ("arrangement", "chain", "a") for f in folder.glob(f"{n}.yaml"))
        yield arrangement, next(iter(sorted(folder.glob("*.ltl"))), ROOT / "properties" / f"{folder.name}.ltl")


def practice(folder: Path) -> Iterator[Path]:
    """The largest chains, the crossing, the lifts, and bounds that look back far, written below a folder."""
    large = ((r.name, r.arrangement, r.properties) for r in rows() if not r.name.startswith(("chain(8)", "chain(16)")))
    for name, arrangement, properties in (*large, ("past", *PAST)):
        place = folder / name.replace(", ", "-").replace(" ", "-")
        place.mkdir()
        (place / "arrangement.yaml").write_text(arrangement, encoding="utf-8")
        (place / "properties.ltl").write_text(properties, encoding="utf-8")
        yield place


def beyond(arrangement: Path, properties: Path, engine: str, limit: float) -> float:
    """Seconds that a check takes more than its limit; negative where it ends before."""
    words = ["verify", str(arrangement), str(properties), "--engine", engine, "--timeout", f"{limit:g}", "-q"]
    began = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "llfsm_verify", *words], capture_output=True, check=False)
    if done.returncode not in (0, 1, 4):
        raise SystemExit(f"{arrangement}: exit code {done.returncode}\n{done.stderr.decode()}")
    return time.perf_counter() - began - limit


def main() -> int:
    """Exit code 1 where a check takes longer than is promised."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", nargs="*", type=Path)
    parser.add_argument("--timeout", nargs="+", type=float, default=[1.0, 5.0], metavar="SECONDS")
    parser.add_argument("--engine", nargs="+", default=ENGINES, choices=ENGINES)
    options = parser.parse_args()
    worst, what = -float("inf"), ""
    with tempfile.TemporaryDirectory() as name:
        models = sorted(path.parent for path in (ROOT / "models").glob("*/arrangement.yaml"))
        for arrangement, properties in tasks(options.folders or [*models, *practice(Path(name))]):
            for engine in options.engine:
                for limit in options.timeout:
                    over = beyond(arrangement, properties, engine, limit)
                    task = f"{arrangement.parent.name} {engine} --timeout {limit:g}"
                    worst, what = max((worst, what), (over, task))
                    if over > 0:
                        print(f"{over:6.2f} s beyond  {task}", flush=True)
    print(f"at most {worst:.2f} s beyond the limit: {what}")
    return int(worst > PROMISED)


if __name__ == "__main__":
    sys.exit(main())
