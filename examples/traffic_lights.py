"""Verify the traffic lights from Python, then run a million ringlets of them in machine code.

Run it from the repository: python examples/traffic_lights.py
"""

from __future__ import annotations

from pathlib import Path

import llfsm_verify as lv

HERE = Path(__file__).parent.parent


def main() -> None:
    lights = lv.load(HERE / "models" / "traffic_lights" / "arrangement.yaml")
    result = lights.check(HERE / "properties" / "traffic_lights.ltl")
    held = sum(found.verdict is lv.Verdict.HOLDS for found in result)
    print(f"{held} of {len(result)} properties hold on {result.states} configurations")

    simulation = lights.start(seed=1)
    simulation.cycle({"car": True})
    print(f"after a cycle with a car waiting the timer is in {simulation.state('timer')}")
    simulation.run(1_000_000)
    print(f"after {simulation.steps} ringlets NS shows {simulation.values['ns_light']}")


if __name__ == "__main__":
    main()
