"""A certificate beside one made anew: what its verifier only believes is to be the same in both."""

from __future__ import annotations

import json
from collections.abc import Sequence

from llfsm_verify.checking.certificates.making import canonical

SECTIONS = {
    "format": "its format is another one",
    "inputs": "its input files are others, or have changed",
    "program": "its step program is not that of the arrangement",
}
OF_PROOFS = {
    "automata": "its automata are not those of the properties",
    "assumptions": "its assumptions are not those of the properties",
    "premises": "its fairness is not that of the arrangement",
}
"""Sections that hold only what is certified: a certificate that a limit has cut short has less of them."""
NAMED = ("name", "kind", "text", "formula")
OF_PROPERTIES = (*NAMED, "verdict", "violations", "early", "safe")


def differences(given: str, anew: str) -> tuple[list[str], list[str]]:
    """What of the text `given`, which the verifier has accepted, is not as in `anew`: a sentence for each part; and
    what cannot be compared, because only one of the two certifies it."""
    first, second = json.loads(given), json.loads(anew)
    reasons = [{p["name"]: p["reason"] for p in (*side["properties"], {**side["faults"], "name": "faults"})}
               for side in (first, second)]  # fmt: skip
    unlike = [
        f"not compared: {name}, because it is not certified {where}: {one[name]}"
        for one, other, where in ((reasons[0], reasons[1], "there"), (reasons[1], reasons[0], "now"))
        for name in one
        if one[name] is not None and name in other and other[name] is None
    ]
    sections = SECTIONS if unlike else {**SECTIONS, **OF_PROOFS}
    found = [said for name, said in sections.items() if canonical(first[name]) != canonical(second[name])]
    keys: Sequence[str] = NAMED if unlike else OF_PROPERTIES
    sides = [[[p[key] for key in keys] for p in side["properties"]] for side in (first, second)]
    verdicts = [[] if unlike else [side["faults"]["verdict"]] for side in (first, second)]
    if canonical([*sides[0], *verdicts[0]]) != canonical([*sides[1], *verdicts[1]]):
        found.append("its properties, or the verdicts in it, are not those of the files")
    return found, unlike
