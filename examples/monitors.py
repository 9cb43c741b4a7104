"""Monitor the traffic lights while a million ringlets of them run in machine code, and recorded letters likewise.

Run it from the repository: python examples/monitors.py
"""

from __future__ import annotations

from pathlib import Path

import llfsm_verify as lv

LIGHTS = Path(__file__).parent.parent / "models" / "traffic_lights"
PROPERTIES = """
both_green: G !(ns@GREEN && ew@GREEN)
enforce ew_order: (ew@RED ew@GREEN ew@AMBER)*
"""


def main() -> None:
    for name in ("arrangement", "faulty"):
        monitors = lv.load(LIGHTS / f"{name}.yaml").monitor(PROPERTIES)
        simulation = monitors.start(seed=1)
        simulation.run(1_000_000)
        for key, verdict in simulation.verdicts.items():
            when = f", since ringlet {simulation.settled[key]}" if key in simulation.settled else ""
            print(f"{name}: {key} after {simulation.steps} ringlets: {verdict}{when}")

    reading = monitors.read([{"ew@RED"}, {"ew@RED"}, {"ns@GREEN", "ew@GREEN"}, {"ew@RED"}])
    print(f"recorded letters: {reading.settled}")


if __name__ == "__main__":
    main()
