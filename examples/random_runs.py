"""Run the faulty traffic lights at random until both directions are green, and show the shortest run found.

Run it from the repository: python examples/random_runs.py
"""

from __future__ import annotations

from pathlib import Path

from hypothesis import settings
from hypothesis.stateful import run_state_machine_as_test

from llfsm_verify.testing import ArrangementStateMachine, RunFailed

LIGHTS = Path(__file__).parent.parent / "models" / "traffic_lights"


class Lights(ArrangementStateMachine):
    arrangement = LIGHTS / "faulty.yaml"
    properties = "both: G !(ns@GREEN && ew@GREEN)"
    traces = None


def main() -> None:
    try:
        run_state_machine_as_test(Lights, settings=settings(Lights.TestCase.settings, derandomize=True, database=None))
    except RunFailed as failed:
        run = failed.run
        print(f"{', '.join(run.failure.names) if run.failure else ''} after {run.steps} steps: {run.stretches}")
        print(run.table())


if __name__ == "__main__":
    main()
