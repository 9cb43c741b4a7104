"""Random tests of your own arrangements with Hypothesis (the extra `testing`); imported when first asked for.

- `ArrangementStateMachine`: a state machine test that runs an arrangement, with its properties as invariants
- `inputs(arrangement)`, `input_sequences(arrangement)`, `runs(arrangement)`: strategies
- `load(arrangement, properties)`: a `Subject`, whose `start()` gives a `Run`; needs no Hypothesis

For those who work on llfsm-verify itself there are strategies for whole arrangements (`arrangements`, `programs`),
formulas and property texts (`formulas`, `properties`) in modules of these names.
"""

from __future__ import annotations

from llfsm_verify.lazily import imported, places


def __getattr__(name: str) -> object:
    try:
        return imported(__name__, name)
    except ModuleNotFoundError as error:
        if error.name is None or error.name.partition(".")[0] != "hypothesis":
            raise
        message = f"{name} needs Hypothesis, which is not installed: pip install 'llfsm-verify[testing]'"
        raise ModuleNotFoundError(message, name="hypothesis") from None


def __dir__() -> list[str]:
    return sorted({*globals(), *places(__name__)})
