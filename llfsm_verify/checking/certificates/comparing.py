"""A certificate beside one made anew: what its verifier only believes is to be the same in both."""

from __future__ import annotations

import json

from llfsm_verify.checking.certificates.making import canonical

SECTIONS = {
    "format": "its format is another one",
    "inputs": "its input files are others, or have changed",
    "program": "its step program is not that of the arrangement",
    "automata": "its automata are not those of the properties",
    "assumptions": "its assumptions are not those of the properties",
    "premises": "its fairness is not that of the arrangement",
}
OF_PROPERTIES = ("name", "kind", "text", "formula", "verdict", "violations", "early", "safe")


def differences(given: str, anew: str) -> list[str]:
    """What of the text `given`, which the verifier has accepted, is not as in `anew`: a sentence for each part."""
    first, second = json.loads(given), json.loads(anew)
    found = [said for name, said in SECTIONS.items() if canonical(first[name]) != canonical(second[name])]
    sides = [[[p[key] for key in OF_PROPERTIES] for p in side["properties"]] for side in (first, second)]
    if canonical([*sides[0], first["faults"]["verdict"]]) != canonical([*sides[1], second["faults"]["verdict"]]):
        found.append("its properties, or the verdicts in it, are not those of the files")
    return found
