"""Wrong atoms of properties over the arrangement `BOARD_OF_PROPERTIES`; ``§`` marks the place."""

from __future__ import annotations

from tests.bad_input.cases import Case

BOARD_OF_PROPERTIES = """\
cycle_ms: 100
types: {Colour: [RED, AMBER, GREEN]}
whiteboard:
  car: {type: bool, role: input}
  light: {type: Colour}
  counter: {type: 0..15}
  a: {type: {array: int8, size: 3}}
  ball: {type: {record: {x: int8, y: int8}}}
machines:
  ns:
    inline:
      machine: Light
      variables: {n: {type: 0..15}, finished: {type: bool}}
      states:
        - name: RED
          variables: {k: {type: int8}}
          transitions: [{when: car, to: GREEN}, {when: true, to: RED}]
        - name: GREEN
  timer: {inline: {machine: Timer, states: [{name: TICK}]}}
environment: {inline: {machine: P, states: [{name: S, internal: car = choose(bool);}]}}
schedule: [timer, ns]
"""

PROPERTY_CASES: tuple[Case, ...] = (
    Case("a division by a variable", "1 / §counter == 1", "E143"),
    Case("a remainder by a variable", "counter % §ns.n == 1", "E143"),
    Case("a division by zero", "counter / §0 == 1", "E130"),
    Case("an index that varies", "a[§counter] == 1", "E144"),
    Case("an index outside", "a[§3] == 1", "E131"),
    Case("time", "§after(3)", "E145"),
    Case("a command", "§suspend(ns)", "E145"),
    Case("a transition that is not there", "ns.fired(RED, §2)", "E146"),
    Case("a transition of a state without any", "ns.fired(GREEN, §0)", "E146"),
    Case("fired of an unknown state", "ns.fired(§BLUE, 0)", "E112"),
    Case("fired without arguments", "§ns.fired", "E117"),
    Case("a sample of what is not an input", "sampled(§counter) == 1", "E154"),
    Case("a turn of the surroundings", "§env.ran", "E156"),
    Case("surroundings that run", "is_running(§env)", "E156"),
    Case("a sample of the surroundings", "§env.sampled(car)", "E156"),
    Case("a choice in a property", "§choose(bool)", "E145"),
    Case("a variable called finished", "§ns.finished", "E147"),
    Case("a field of an observation", "ns.suspended§.x", "E125"),
    Case("a machine as a value", "§ns", "E148"),
    Case("a machine variable without its machine", "§n == 3", "E110"),
    Case("an unknown machine variable", "ns.§m == 3", "E110"),
    Case("an unknown state variable", "ns.RED.§m == 3", "E110"),
    Case("a state without @", "ns.§RED", "E110"),
    Case("an unknown variable", "§countre == 3", "E110"),
    Case("an unknown machine", "§sn@RED", "E111"),
    Case("an unknown state", "ns@§REDD", "E112"),
    Case("an unknown function", "§fired(ns)", "E113"),
    Case("a number", "§counter", "E120"),
    Case("another enumeration's value", "light == §BLUE", "E110"),
    Case("an unknown method", "§ns.stopped(RED)", "E113"),
)
