"""Random tests of your own arrangements with Hypothesis (the extra `testing`); imported when first asked for.

- `ArrangementStateMachine`: a state machine test that runs an arrangement, with its properties as invariants
- `inputs(arrangement)`, `input_sequences(arrangement)`, `runs(arrangement)`: strategies
- `load(arrangement, properties)`: a `Subject`, whose `start()` gives a `Run`; needs no Hypothesis

For those who work on llfsm-verify itself there are strategies for whole arrangements (`arrangements`, `programs`),
formulas and property texts (`formulas`, `properties`) in modules of these names.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from llfsm_verify.lazily import imported

if TYPE_CHECKING:
    from llfsm_verify.testing.run import Run, RunFailed, Subject, load
    from llfsm_verify.testing.stateful import ArrangementStateMachine
    from llfsm_verify.testing.strategies import input_sequences, inputs, runs
    from llfsm_verify.testing.stretches import Stretch
    from llfsm_verify.testing.tested import UntestedWarning

__all__ = [
    "ArrangementStateMachine",
    "Run",
    "RunFailed",
    "Stretch",
    "Subject",
    "UntestedWarning",
    "input_sequences",
    "inputs",
    "load",
    "runs",
]

_PLACES = {
    "testing.run": ("Run", "RunFailed", "Subject", "load"),
    "testing.stateful": ("ArrangementStateMachine",),
    "testing.strategies": ("input_sequences", "inputs", "runs"),
    "testing.stretches": ("Stretch",),
    "testing.tested": ("UntestedWarning",),
}


def __getattr__(name: str) -> object:
    try:
        return imported(__name__, _PLACES, name)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "hypothesis":
            raise
        message = f"{name} needs Hypothesis, which is not installed: pip install 'llfsm-verify[testing]'"
        raise ModuleNotFoundError(message, name="hypothesis") from None
