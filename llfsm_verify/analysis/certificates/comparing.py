"""A certificate beside one made anew: what its verifier only believes is to be the same in both."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

from llfsm_verify.analysis.certificates.making import canonical
from llfsm_verify.jsonvalue import Json

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
OTHERS = "its properties, or the verdicts in it, are not those of the files"
NAMED = ("name", "kind", "text", "formula")
OF_PROPERTIES = (*NAMED, "verdict", "violations", "early", "safe")

Sections = dict[str, Any]
"""A certificate that the verifier has accepted: its shape is known."""


def differences(given: str, anew: str) -> tuple[list[str], list[str]]:
    """What of the text `given`, which the verifier has accepted, is not as in `anew`: a sentence for each part; and
    what cannot be compared, because only one of the two certifies it."""
    first, second = json.loads(given), json.loads(anew)
    unlike = [*_certified_once(first, second)]
    if unlike:
        found, more = _differences_in_parts(first, second)
        return found, [*unlike, *more]
    found = [said for name, said in (SECTIONS | OF_PROOFS).items() if canonical(first[name]) != canonical(second[name])]
    if _of_properties(first, OF_PROPERTIES) != _of_properties(second, OF_PROPERTIES) or (
        first["faults"]["verdict"] != second["faults"]["verdict"]
    ):
        found.append(OTHERS)
    return found, []


def _certified_once(first: Sections, second: Sections) -> Iterator[str]:
    listed = [[*side["properties"], {**side["faults"], "name": "faults"}] for side in (first, second)]
    if [p["name"] for p in listed[0]] != [p["name"] for p in listed[1]]:
        return  # then it is another certificate
    for one, other in zip(*listed, strict=True):
        if (one["reason"] is None) != (other["reason"] is None):
            where, reason = ("there", one["reason"]) if other["reason"] is None else ("now", other["reason"])
            plain = "".join(
                c if c.isprintable() else " " for c in f"{one['name']}, because it is not certified {where}: {reason}"
            )
            yield f"not compared: {plain}"


def _of_properties(side: Sections, keys: tuple[str, ...]) -> str:
    return canonical([[p[key] for key in keys] for p in side["properties"]])


# ---------------------------------------------------------------- where one of the two certifies less


def _differences_in_parts(first: Sections, second: Sections) -> tuple[list[str], list[str]]:
    """The same property by property, for those that both certify."""
    found = [said for name, said in SECTIONS.items() if canonical(first[name]) != canonical(second[name])]
    if _of_properties(first, NAMED) != _of_properties(second, NAMED):
        return [*found, OTHERS], []
    unlike: list[str] = []
    # Of assumptions more is written out the more is certified, and what is explored shapes the automata of a violation.
    alike = canonical(first["configurations"]) == canonical(second["configurations"])
    comparable = alike and not (second["assumptions"] or second["premises"] or second["configurations"] is None)
    pairs = [*zip(first["properties"], second["properties"], strict=True), (first["faults"], second["faults"])]
    for one, other in pairs:
        if one["reason"] is not None or other["reason"] is not None:
            continue
        if one["verdict"] != other["verdict"]:
            found.append(OTHERS)
        elif "name" in one and canonical(_believed(first, one)) != canonical(_believed(second, other)):
            if comparable:
                found.append(OF_PROOFS["automata"])
            else:
                unlike.append(f"not compared: {one['name']}, because its automata are not written out alike in both")
    return list(dict.fromkeys(found)), unlike


def _believed(side: Sections, of: Sections) -> Json:
    """What the verifier believes of a property, with its automata, and those of the assumptions, in full."""
    automata = side["automata"]
    assumed = [[a["name"], a["text"], a["formula"], automata[a["automaton"]]] for a in side["assumptions"]]
    premises = [automata[number] for number in side["premises"]]
    own = [None if number is None else automata[number] for number in (of["violations"], of["early"])]
    return [of["safe"], *own, assumed, premises]
