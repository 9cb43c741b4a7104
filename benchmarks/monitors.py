"""Print what a step of a compiled monitor costs, beside a table walk in C: ``python -m benchmarks.monitors``.

Letters are drawn at random among those that leave the property undecided, so that nothing ends early; both programs
read the same ones from memory. The C program is the table of all letters (`state = table[state][letter]`), compiled by
gcc with -O2 in the same run; without gcc its column is empty. Below that: a million ringlets of the traffic lights in
machine code, alone and with the monitors of their properties. Nanoseconds of processor time, best of several runs.
"""

from __future__ import annotations

import argparse
import ctypes
import random
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import FEATURES, PropertySet, parse_properties
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.monitoring.properties import monitor_properties
from llfsm_verify.monitoring.states import Monitor, Monitorability
from llfsm_verify.runtime.stepping.monitored import MonitoredSimulation
from llfsm_verify.runtime.stepping.simulation import Simulation
from llfsm_verify.semantics.lowering import lower
from tools import oracles

ROOT = Path(__file__).parents[1]
LIGHTS = ROOT / "models/traffic_lights/arrangement.yaml"

PROPERTIES = """
always:   G p
reply:    G (p -> X q)
until:    (p W q) && G (r -> X X s)
bounded:  G (p -> F[0:5] q)
past:     G (p -> O q)
enforce order:  (p q r)*
forbid  both:   [p && q] [r && s]
wide:     G (a0 && a1 && a2 && a3 && a4 && a5 && a6 && a7 && a8 && a9 && a10 && a11 -> X (b0 || b1 || b2 || b3))
"""
LIGHT_PROPERTIES = """
both:        G !(ns@GREEN && ew@GREEN)
after_green: G (ns@GREEN -> (ns@GREEN W ns@AMBER))
after_amber: G (ew@AMBER -> (ew@AMBER W ew@RED))
lamps:       G !(ns_light == GREEN && ew_light == GREEN)
enforce ns_order: (ns@RED ns@GREEN ns@AMBER)*
enforce ew_order: (ew@RED ew@GREEN ew@AMBER)*
"""


def best(run: Callable[[], object], count: int, runs: int) -> float:
    """Nanoseconds of processor time for one of `count` things that `run` does."""
    found = []
    for _ in range(runs):
        start = time.process_time()
        run()
        found.append(time.process_time() - start)
    return min(found) / count * 1e9


def undecided(monitor: Monitor, count: int, source: random.Random) -> list[int]:
    """Random letters after none of which there is a verdict."""
    size = len(monitor.atoms)
    settled = [all(edge.target == q for edge in row) for q, row in enumerate(monitor.edges)]
    letters, state = [], 0
    for _ in range(count):
        for _ in range(1000):
            letter = source.getrandbits(size)
            following = monitor.step(state, letter)
            if not settled[following]:
                break
        else:
            raise SystemExit("hardly any letter leaves this property undecided")
        letters.append(letter)
        state = following
    return letters


def c_walk(monitor: Monitor, folder: Path) -> Callable[[bytes, int], int] | None:
    """The table walk in C, as a function of the letters and their number; None: no gcc, or more than 16 atoms."""
    size = len(monitor.atoms)
    if oracles.find("gcc") is None or size > 16:
        return None
    entries = [monitor.step(q, letter) for q in range(len(monitor.edges)) for letter in range(1 << size)]
    kind = "uint8_t" if len(monitor.edges) <= 256 else "uint16_t"
    text = f"""#include <stdint.h>
static const {kind} table[] = {{{",".join(map(str, entries))}}};
int64_t walk(const uint64_t *letters, int64_t count) {{
  int64_t state = 0;
  for (int64_t i = 0; i < count; i++) state = table[state << {size} | (letters[i] & {(1 << size) - 1})];
  return state;
}}
"""
    source = folder / "walk.c"
    library = folder / f"walk{len(list(folder.iterdir()))}.so"
    source.write_text(text)
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    function = ctypes.CDLL(str(library)).walk
    function.restype, function.argtypes = ctypes.c_int64, (ctypes.c_char_p, ctypes.c_int64)
    return function


def monitors_of(text: str) -> tuple[PropertySet, dict[str, Monitor]]:
    """The properties and their monitors."""
    lines = parse_properties([Source("benchmark", text)], features=FEATURES)
    return lines, {line.name: monitor_properties(line).monitor for line in lines}


def letters_table(count: int, runs: int) -> None:
    """A line for each property, and one for several together on the same letters."""
    _, monitors = monitors_of(PROPERTIES)
    source = random.Random(1)
    print(f"{'property':12}{'states':>7}{'atoms':>7}{'ours ns':>9}{'C ns':>7}   a step, {count:,} letters")
    with tempfile.TemporaryDirectory() as name:
        for key, monitor in monitors.items():
            compiled = CompiledMonitors({key: monitor})
            letters = undecided(monitor, count, source)
            data = compiled.pack(letters)
            compiled.feed(data)
            assert not compiled.settled, "the letters leave the property undecided"
            ours = best(lambda c=compiled, d=data: (c.reset(), c.feed(d)), count, runs)
            walk = c_walk(monitor, Path(name))
            peer = ""
            if walk is not None:
                if walk(data, count) != compiled.states[key]:
                    raise SystemExit(f"{key}: C and we end in different states")
                peer = f"{best(lambda w=walk, d=data: w(d, count), count, runs):.1f}"
            print(f"{key:12}{len(monitor.edges):7}{len(monitor.atoms):7}{ours:9.1f}{peer:>7}")
        four = {key: monitor for key, monitor in monitors.items() if set(monitor.atoms) <= set("pqrs")}
        together = CompiledMonitors(four, tuple("pqrs"))
        data = together.pack([source.getrandbits(4) for _ in range(count)])
        ours = best(lambda: (together.reset(), together.feed(data)), count * len(four), runs)
        print(f"{f'{len(four)} at once':12}{'':7}{4:7}{ours:9.1f}          a step and property")


def simulation_table(ringlets: int, runs: int) -> None:
    """A million ringlets alone and watched."""
    lines, monitors = monitors_of(LIGHT_PROPERTIES)
    assert all(monitor.monitorability is not Monitorability.NEVER for monitor in monitors.values())
    arrangement = load_arrangement(str(LIGHTS))
    program = lower(arrangement, bind(arrangement, lines).atoms)
    plain = Simulation(NativeProgram(program, effort="full"), seed=1)
    watched = MonitoredSimulation(program, monitors, seed=1)
    empty = MonitoredSimulation(program, {}, seed=1)
    for simulation in (plain, watched, empty):
        simulation.run(ringlets)
    if watched.settled:
        raise SystemExit(f"a property of the traffic lights is settled: {watched.settled}")
    alone, none, all_of_them = (best(lambda s=s: s.run(ringlets), ringlets, runs) for s in (plain, empty, watched))
    each = (all_of_them - none) / len(monitors)
    print(f"\n{ringlets:,} ringlets of the traffic lights, ns a ringlet: {alone:.1f} by Simulation.run,")
    print(f"{none:.1f} without monitors, {all_of_them:.1f} with {len(monitors)}: {each:.1f} a step and property")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--letters", type=int, default=1_000_000, help="letters and ringlets (default: %(default)s)")
    parser.add_argument("--runs", type=int, default=5, help="runs, of which the best counts (default: %(default)s)")
    arguments = parser.parse_args()
    letters_table(arguments.letters, arguments.runs)
    simulation_table(arguments.letters, arguments.runs)


if __name__ == "__main__":
    main()
