"""A certificate beside one made anew: what its verifier only believes is to be the same in both."""

from __future__ import annotations

import json

BELIEVED = {
    "format": "its format is another one",
    "program": "its step program is not that of the arrangement",
    "automata": "its automata are not those of the properties",
    "assumptions": "its assumptions are not those of the properties",
    "premises": "its fairness is not that of the arrangement",
}
OF_PROPERTIES = ("name", "kind", "text", "formula", "verdict", "violations", "early", "safe")


def differences(given: str, anew: str) -> list[str]:
    """What of the text `given`, which the verifier has accepted, is not as in `anew`: a sentence for each part."""
    first, second = json.loads(given), json.loads(anew)
    found = [sentence for name, sentence in BELIEVED.items() if first[name] != second[name]]
    sides = [[{key: p[key] for key in OF_PROPERTIES} for p in side["properties"]] for side in (first, second)]
    if sides[0] != sides[1]:
        found.append("its properties, or their verdicts, are not those of the files")
    return found
