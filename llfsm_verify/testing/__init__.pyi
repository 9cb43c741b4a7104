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
