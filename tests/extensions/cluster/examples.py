"""A command that makes the program say what is wrong with a cluster."""

from __future__ import annotations

from tests.extensions.sweep.examples import COUNTER
from tests.outputs.provoking import Provoked

PROVOKED = {
    "E604": Provoked(("llfsm sweep s.yaml --scheduler tcp://here",), {**COUNTER, "s.yaml": "arrangements: [a.yaml]\n"}),
}
