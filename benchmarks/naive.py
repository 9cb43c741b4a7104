"""Searches that one would write in plain Python: tuples in a dictionary, one function for each model.

`python -m benchmarks.naive ring 5 3` (or `microwave`, `traffic`) prints a JSON object: `states` and `transitions`
(distinct pairs) as llfsm-verify counts them with all bits kept, seconds `wall` and `cpu` of the search.
"""

from __future__ import annotations

import json
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable
from functools import partial

State = tuple[int, ...]
Successors = Callable[[State], Iterable[State]]


def search(initial: State, successors: Successors) -> tuple[int, int]:
    """Numbers of reachable states and of distinct pairs of a state and a successor."""
    parents: dict[State, State | None] = {initial: None}
    queue = deque([initial])
    transitions = 0
    while queue:
        state = queue.popleft()
        for following in dict.fromkeys(successors(state)):
            transitions += 1
            if following not in parents:
                parents[following] = state
                queue.append(following)
    return len(parents), transitions


def ring(size: int, modulus: int, state: State) -> list[State]:
    """Three numbers a machine (is it ON, its counter, has it been entered), then whose turn it is."""
    turn = state[-1]
    at = 3 * turn
    on, count, entered = state[at : at + 3]
    left = state[3 * ((turn - 1) % size)]
    if not entered and on:
        count = (count + 1) % modulus
    following = []
    for go in (0, 1):
        fires = (not go or left) if on else (go and not left)
        successor = list(state)
        successor[at : at + 3] = (1 - on, count, 0) if fires else (on, count, 1)
        successor[-1] = (turn + 1) % size
        following.append(tuple(successor))
    return following


def microwave(state: State) -> list[State]:
    """Only the timer looks at the button."""
    buttons = (0, 1) if state[0] == 1 else (0,)
    return [_ringlet(state, door, button, tick) for door in (0, 1) for tick in (0, 1) for button in buttons]


def _ringlet(state: State, door: int, button: int, tick: int) -> State:
    turn, left, motor, light, sound, cook, cook_entered, timer, timer_entered, lamp, lamp_entered, alarm, armed = state
    if turn == 0:
        motor = motor if cook_entered else cook
        fires = (door or not left) if cook else (not door and left)
        cook, cook_entered = (1 - cook, 0) if fires else (cook, 1)
    elif turn == 1:
        if not timer_entered:
            left += (0, 1, -1)[timer]
        first = 1 if button and left < 15 else 2 if not door and left and tick else 0
        to = (first, button, 0)[timer]
        timer, timer_entered = to, int(to == timer)
    elif turn == 2:
        light = light if lamp_entered else lamp
        fires = (not door and not left) if lamp else (door or left)
        lamp, lamp_entered = (1 - lamp, 0) if fires else (lamp, 1)
    else:
        sound = sound if armed else int(alarm == 2)
        fires = (left, not left, tick)[alarm]
        alarm, armed = ((alarm + 1) % 3, 0) if fires else (alarm, 1)
    turn = (turn + 1) % 4
    return (turn, left, motor, light, sound, cook, cook_entered, timer, timer_entered, lamp, lamp_entered, alarm, armed)


def traffic(state: State) -> list[State]:
    """Colours are 0 RED, 1 YELLOW, 2 GREEN; a light goes RED, GREEN, YELLOW, RED."""
    turn, t, request, east, ns, ns_entered, ns_light, ew, ew_entered, ew_light, timer_entered = state
    if turn == 2:
        return [(0, min(t + 1, 9), request | sensor, east, *state[4:10], 1) for sensor in (0, 1)]
    if turn == 0:
        if not ns_entered:
            ns_light, t = ns, 0
        fires = bool((not east, t >= 3, request and t >= 9)[ns])
        if fires and ns == 1:
            east = 1
        ns, ns_entered = ((2, 0, 1)[ns], 0) if fires else (ns, 1)
    else:
        if not ew_entered:
            ew_light, t = ew, 0
        fires = bool((east, t >= 3, t >= 9)[ew])
        if fires and ew == 1:
            east = 0
        if fires and ew == 2:
            request = 0
        ew, ew_entered = ((2, 0, 1)[ew], 0) if fires else (ew, 1)
    return [(turn + 1, t, request, east, ns, ns_entered, ns_light, ew, ew_entered, ew_light, timer_entered)]


def model(name: str, *numbers: int) -> tuple[State, Successors]:
    """The first state and the successor function of a model. Raises KeyError for an unknown one."""
    if name == "ring":
        size, modulus = numbers
        return (0,) * (3 * size + 1), partial(ring, size, modulus)
    models: dict[str, tuple[State, Successors]] = {
        "microwave": ((0,) * 13, microwave),
        "traffic": ((0, 0, 0, 0, 2, 0, 0, 0, 0, 0, 0), traffic),
    }
    return models[name]


def main(arguments: list[str]) -> None:
    initial, successors = model(arguments[0], *map(int, arguments[1:]))
    wall, cpu = time.perf_counter(), time.process_time()
    states, transitions = search(initial, successors)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    print(json.dumps({"states": states, "transitions": transitions, "wall": wall, "cpu": cpu}))


if __name__ == "__main__":
    main(sys.argv[1:])
