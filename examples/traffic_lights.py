"""Verify the traffic lights from Python, then run a million ringlets of them in machine code.

Run it from the repository: python examples/traffic_lights.py
"""

from __future__ import annotations

from pathlib import Path

from llfsm_verify.arrangement import load_arrangement
from llfsm_verify.checking.verdict import Verdict
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.runtime.simulation import Simulation
from llfsm_verify.semantics.lowering import lower
from llfsm_verify.verification.verify import verify

HERE = Path(__file__).parent.parent


def main() -> None:
    lights = load_arrangement(HERE / "models" / "traffic_lights" / "arrangement.yaml")
    properties = parse_properties([read_source(HERE / "properties" / "traffic_lights.ltl")])
    result = verify(lights, properties)
    held = sum(p.verdict is Verdict.HOLDS for p in result.properties)
    print(f"{held} of {len(result.properties)} properties hold on {result.exploration.states} configurations")

    simulation = Simulation(lower(lights, keep_all_bits=True), seed=1)
    simulation.cycle({"car": True})
    print(f"after a cycle with a car waiting the timer is in {simulation.state('timer')}")
    simulation.run(1_000_000)
    print(f"after {simulation.steps} ringlets NS shows {simulation.values['ns_light']}")


if __name__ == "__main__":
    main()
