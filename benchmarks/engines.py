"""Our engines beside each other on what enumeration alone does not do: wide inputs, counters without bounds, depth.

`python -m benchmarks.engines [--timeout SECONDS] [--only TEXT] [--runs N]` prints a table: of each arrangement the
seconds of each engine (median of the runs) and how deep it looked, or how much it decided until then, and the engine
that wins under `--engine auto`; where NuSMV is installed, the same of it on the exported model. Every answer is
compared with the one that is known; the exit code is 1 when one is wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from benchmarks import nusmv
from benchmarks.children import expect, run
from benchmarks.measure import Wrong
from benchmarks.ring import ring
from llfsm_verify.verification.engines import ENGINES

ROOT = Path(__file__).parents[1]
NAMES = tuple(name for name in ENGINES if name not in ("auto", "all"))

COUNTER = """
name: counter
whiteboard:
  go: {{type: bool, init: false, role: input}}
  n: {{type: {type}, init: 0}}
machines:
  m:
    inline:
      machine: Counter
      states:
        - name: COUNT
          internal: "{step}"
          transitions:
            - {{when: n == {limit}, to: DONE}}
        - name: DONE
schedule: [m]
"""
GUARDED = "if (go) {{ if (n < {limit}) n += 1; }}"

SENSOR = """\
  m{i}:
    inline:
      machine: Watcher
      parameters: {{distance: {{whiteboard: 0..65535}}, near: {{whiteboard: bool}}}}
      states:
        - name: FAR
          on_entry: near = false;
          transitions:
            - {{when: distance < {low}, to: NEAR}}
        - name: NEAR
          on_entry: near = true;
          transitions:
            - {{when: distance > {high}, to: FAR}}
    parameters: {{distance: d{i}, near: near{i}}}
"""


@dataclass(frozen=True, slots=True)
class Case:
    """An arrangement with properties, and the verdicts that are known to be right."""

    key: str
    arrangement: Path | str
    properties: str
    verdicts: Mapping[str, str]


def sensors(count: int) -> str:
    """So many machines, each with a 16-bit distance of its own and two thresholds."""
    lines = [f"name: sensors_{count}\nwhiteboard:\n"]
    for i in range(count):
        lines.append(f"  d{i}: {{type: 0..65535, init: 65535, role: input}}\n")
        lines.append(f"  near{i}: {{type: bool, init: false, role: output}}\n")
    lines.append("machines:\n")
    lines += [SENSOR.format(i=i, low=1000 * (i + 1), high=1000 * (i + 1) + 500) for i in range(count)]
    lines.append("schedule: [" + ", ".join(f"m{i}" for i in range(count)) + "]\n")
    return "".join(lines)


def counter(limit: int) -> str:
    """Counts to a limit while its input holds."""
    return COUNTER.format(type=f"0..{limit}", step=GUARDED.format(limit=limit), limit=limit)


def endless() -> str:
    """Counts forever, by two."""
    return COUNTER.format(type="int", step="n += 2;", limit=-2)


def microwave(seconds: int, folder: Path) -> Path:
    """The microwave of models/, whose time left may be so many seconds; its files are written to `folder`."""
    for file in (ROOT / "models" / "microwave").glob("*.[yd]*"):
        text = file.read_text(encoding="utf-8").replace("0..180", f"0..{seconds}").replace("120", str(seconds - 60))
        (folder / file.name).write_text(text, encoding="utf-8")
    return folder / "arrangement.yaml"


MICROWAVE = "lit: G (motor -> lamp)\nstops: G (door_open -> X !motor)\nminute: G (time_left <= {seconds})\n"
SENSORS = "apart: G (near0 -> m0@NEAR)\nnever: G !(near0 && near7)\n"
COUNTERS = "below: G n >= 0\ndone: G (m@DONE -> n == {limit})\n"


def cases(folder: Path) -> list[Case]:
    found = [
        Case("eight 16-bit sensors", sensors(8), SENSORS, {"apart": "violated", "never": "violated"}),
        Case("counter to 10^6", counter(10**6), COUNTERS.format(limit=10**6), {"below": "holds", "done": "holds"}),
        Case("counter without bounds", endless(), COUNTERS.format(limit=0), {"below": "holds", "done": "holds"}),
    ]
    for name, seconds in (("microwave, 15 minutes", 900), ("microwave, 10^6 seconds", 10**6)):
        here = folder / str(seconds)
        here.mkdir()
        known = dict.fromkeys(("lit", "stops", "minute"), "holds")
        found.append(Case(name, microwave(seconds, here), MICROWAVE.format(seconds=seconds), known))
    for size in range(8, 17, 2):
        everyone = " && ".join(f"m{i}@ON" for i in range(size))
        found.append(Case(f"ring({size},3)", ring(size, 3), f"some_off: G !({everyone})\n", {"some_off": "holds"}))
    return found


def asked(case: Case, engine: str, timeout: float, folder: Path) -> tuple[float, dict[str, Any]]:
    """Seconds of the whole command, and its result as JSON. Raises Wrong and ChildFailed."""
    path, lines = written(case, folder)
    command = [sys.executable, "-m", "llfsm_verify", "verify", str(path), str(lines), "--format", "json"]
    command += ["--engine", engine, "--timeout", str(timeout)]
    usage = expect(run(command, timeout=10 * timeout + 60, cwd=ROOT), command, 0, 1, 4)
    answer: dict[str, Any] = json.loads(usage.output)
    compare(case, engine, {item["name"]: item["verdict"] for item in answer["properties"]})
    return usage.wall, answer


def written(case: Case, folder: Path) -> tuple[Path, Path]:
    """The files of an arrangement and its properties, written to `folder` where there are none."""
    path = case.arrangement
    if isinstance(path, str):
        path = folder / "arrangement.yaml"
        path.write_text(str(case.arrangement), encoding="utf-8")
    lines = folder / "properties.ltl"
    lines.write_text(case.properties, encoding="utf-8")
    return path, lines


def compare(case: Case, who: str, verdicts: Mapping[str, str]) -> None:
    """Raises Wrong when a verdict is not the one that is known."""
    for name, verdict in verdicts.items():
        if verdict not in ("unknown", case.verdicts[name]):
            raise Wrong(f"{case.key}: {who} says that {name} is {verdict}")


def cell(seconds: float, answer: Mapping[str, Any]) -> str:
    """What stands in the table for one engine: seconds, and where it did not decide all, how much."""
    depth = "" if answer["depth"] is None else f", depth {answer['depth']}"
    return share(seconds, [item["verdict"] for item in answer["properties"]]) + depth


def share(seconds: float, verdicts: Sequence[str]) -> str:
    """Seconds, and how many were decided where not all were."""
    decided = sum(verdict != "unknown" for verdict in verdicts)
    return f"{seconds:.2f}" if decided == len(verdicts) else f"{decided} of {len(verdicts)} in {seconds:.1f}"


def peers(case: Case, timeout: float, runs: int) -> list[str]:
    """The cells of NuSMV. Raises Wrong and ChildFailed."""
    cells = []
    with tempfile.TemporaryDirectory() as name:
        model = Path(name) / "model.smv"
        if not nusmv.exported(*written(case, Path(name)), model):
            return ["not in its language"] * len(nusmv.WAYS)
        for way in nusmv.WAYS:
            found = [nusmv.asked(way, model, timeout) for _ in range(runs)]
            compare(case, way, found[0].verdicts)
            cells.append(found[0].failed or share(median(a.seconds for a in found), [*found[0].verdicts.values()]))
    return cells


def row(case: Case, timeout: float, runs: int) -> list[str]:
    """The cells of one line. Raises Wrong and ChildFailed."""
    cells = [case.key]
    for engine in (*NAMES, "auto"):
        with tempfile.TemporaryDirectory() as name:
            found = [asked(case, engine, timeout, Path(name)) for _ in range(runs)]
        seconds, answer = median(s for s, _ in found), found[0][1]
        cells.append(cell(seconds, answer))
        if engine == "auto":
            winners = dict.fromkeys(i["engine"] for i in answer["properties"] if i["verdict"] != "unknown")
            cells.append(", ".join(winners) or "none")
    return cells if nusmv.missing() else [*cells, *peers(case, timeout, runs)]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--timeout", type=float, default=60.0)
    parser.add_argument("--only", default="")
    parser.add_argument("--runs", type=int, default=1)
    options = parser.parse_args()
    heads = ("arrangement", *NAMES, "auto", "decided by", *(() if nusmv.missing() else nusmv.WAYS))
    print("| " + " | ".join(heads) + " |")
    print("|---" * len(heads) + "|")
    wrong = False
    with tempfile.TemporaryDirectory() as name:
        for case in cases(Path(name)):
            if options.only in case.key:
                try:
                    print("| " + " | ".join(row(case, options.timeout, options.runs)) + " |", flush=True)
                except Wrong as error:
                    print(error, file=sys.stderr)
                    wrong = True
    return int(wrong)


if __name__ == "__main__":
    sys.exit(main())
