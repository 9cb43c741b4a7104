"""Monitor the traffic lights while a million ringlets of them run in machine code, and recorded letters likewise.

Run it from the repository: python examples/monitors.py
"""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.problem import bind
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import FEATURES, parse_properties
from llfsm_verify.monitoring.native import CompiledMonitors
from llfsm_verify.monitoring.properties import Timing, monitored
from llfsm_verify.runtime.monitored import MonitoredSimulation
from llfsm_verify.semantics.lowering import lower

LIGHTS = Path(__file__).parent.parent / "models" / "traffic_lights"
PROPERTIES = """
both_green: G !(ns@GREEN && ew@GREEN)
enforce ew_order: (ew@RED ew@GREEN ew@AMBER)*
"""


def main() -> None:
    properties = parse_properties([Source("properties", PROPERTIES)], features=FEATURES)
    for name in ("arrangement", "faulty"):
        lights = load_arrangement(LIGHTS / f"{name}.yaml")
        bound = bind(lights, properties)
        timing = Timing(bound.clock)
        monitors = {p.name: monitored(p, properties.assumptions, timing).monitor for p in properties.goals}
        simulation = MonitoredSimulation(lower(lights, bound.atoms), monitors, seed=1)
        simulation.run(1_000_000)
        for key, monitor in monitors.items():
            verdict = monitor.verdicts[simulation.monitor_states[key]].value
            when = f", since ringlet {simulation.settled[key]}" if key in simulation.settled else ""
            print(f"{name}: {key} after {simulation.steps} ringlets: {verdict}{when}")

    compiled = CompiledMonitors(monitors)
    both = sum(1 << i for i, atom in enumerate(compiled.atoms) if atom in ("ns@GREEN", "ew@GREEN"))
    red = 1 << compiled.atoms.index("ew@RED")
    compiled.feed(compiled.pack([red, red, both, red]))
    print(f"recorded letters: {compiled.settled}")


if __name__ == "__main__":
    main()
