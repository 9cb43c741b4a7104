"""Traffic lights that ask Prolog: what the promises say is what the program answers, and each of them is needed."""

from __future__ import annotations

import re
import subprocess
from itertools import product
from pathlib import Path

import pytest

from llfsm_verify.arrangement.loader import load_arrangement, load_arrangement_text
from llfsm_verify.checking.verdict import Result, Verdict
from llfsm_verify.diagnostics import Source
from llfsm_verify.logic.properties import parse_properties
from llfsm_verify.logic.reading import read_source
from llfsm_verify.verification.verify import verify
from tests.outside import needs, program

FOLDER = Path("models/reasoned_lights")
PROMISED = Path("properties/reasoned_lights_promised.ltl")
EACH = list(product(("ns", "ew"), (False, True), (False, True), ("red", "amber", "green"), ("red", "amber", "green")))
"""Turn, whether its time is up, whether a car waits, the lamps of both directions."""


def check(version: str, text: str) -> Result:
    return verify(load_arrangement(FOLDER / f"{version}.yaml"), parse_properties([Source("a.ltl", text)]))


def violated(result: Result) -> set[str]:
    assert result.complete
    return {p.name for p in result.properties if p.verdict is Verdict.VIOLATED}


FACTS = """
name: facts
types: {Direction: [NS, EW], Colour: [RED, AMBER, GREEN]}
whiteboard:
  turn: {type: Direction, role: input, changes: never}
  time_up: {type: bool, role: input, changes: never}
  car: {type: bool, role: input, changes: never}
  ns_light: {type: Colour, role: input, changes: never}
  ew_light: {type: Colour, role: input, changes: never}
machines: {m: {inline: {machine: M, states: [{name: A, stays: true}]}}}
schedule: [m]
"""
"""Any facts, which stay as they are."""
QUERIES = {"ns_go": "may_go(ns)", "ew_go": "may_go(ew)", "ns_stop": "must_stop(ns)", "ew_stop": "must_stop(ew)"}


def answers() -> dict[str, list[str]]:
    """For each query the facts with which the program says yes, as a port asks it, in words of properties."""
    goals = []
    for turn, up, car, ns, ew in EACH:
        facts = [f"turn({turn})", *["time_up"] * up, *["car_waiting"] * car, f"light(ns, {ns})", f"light(ew, {ew})"]
        goals.append(", ".join(f"assertz({fact})" for fact in facts))
    asked = f"forall(member(Q, [{', '.join(QUERIES.values())}]), (Q -> write(1) ; write(0))), nl"
    start = f"dynamic((turn/1, time_up/0, car_waiting/0, light/2)), consult('{FOLDER}/lights.pl')"
    goal = ", ".join([start, *(f"snapshot(({facts}, {asked}))" for facts in goals)])
    words = [program("swipl"), "-g", goal, "-t", "halt"]
    said = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60).stdout.split()
    assert len(said) == len(EACH) == 72
    found: dict[str, list[str]] = {name: [] for name in QUERIES}
    for (turn, up, car, ns, ew), bits in zip(EACH, said, strict=True):
        signs = f"{'' if up else '!'}time_up && {'' if car else '!'}car"
        lamps = f"ns_light == {ns.upper()} && ew_light == {ew.upper()}"
        for name, bit in zip(found, bits, strict=True):
            found[name] += [f"turn == {turn.upper()} && {signs} && {lamps}"] * int(bit)
    return found


@needs("swipl")
def test_the_promises_are_what_the_program_answers() -> None:
    """With all facts that there can be: what the assumptions say at last is true of its answers at once."""
    text = PROMISED.read_text("utf-8")
    meant = re.search(r"^define next_ns: .*$", text, re.MULTILINE)
    at_last = re.findall(r"^  F G (.*)$", text, re.MULTILINE)
    assert meant and len(at_last) == 2
    said = [f"define {name}: ({' || '.join(facts)})" for name, facts in answers().items()]
    goals = [f"promise_{n}: G {formula}" for n, formula in enumerate(at_last)]
    arrangement = load_arrangement_text(FACTS, "facts.yaml")
    result = verify(arrangement, parse_properties([Source("a.ltl", "\n".join([meant[0], *said, *goals]))]))
    assert {p.verdict for p in result.properties} == {Verdict.HOLDS} and len(result.properties) == 2
    assert result.exploration.states >= len(EACH)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cars_stay", "turns", "goes"])
def test_without_one_of_the_promises_somebody_starves(name: str) -> None:
    text = PROMISED.read_text("utf-8")
    left = re.sub(rf"^assume {name}: .*\n(?:  .*\n)*", "", text, flags=re.MULTILINE)
    assert left != text and violated(check("arrangement", left))


@pytest.mark.slow
def test_right_answers_do_not_make_a_hasty_light_safe() -> None:
    """An answer is right at the moment at which it is posted; the light acts later."""
    instant = read_source(FOLDER / "instant.ltl")
    assert violated(check("faulty_hasty", instant.text)) == {"mutual_exclusion"}
    never = "assume never_both: G !(go_ns.sampled(may_go_ns) && go_ew.sampled(may_go_ew))\n"
    assert violated(check("faulty_hasty", f"{never}both: G !(ns@GREEN && ew@GREEN)")) == {"both"}
    assert not violated(check("arrangement", instant.text))
