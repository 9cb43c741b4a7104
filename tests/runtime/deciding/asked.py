"""The child of a port that begins the cycles, and does with requests what it likes: `python asked.py SEED`.

It answers late, twice, with values that do not fit, with ends that there are not, after it was told not to, or never.
"""

from __future__ import annotations

import json
import random
import sys

RNG = random.Random(int(sys.argv[1]))
LAZY = RNG.choice([0.3, 0.6, 0.9])
ENDS = {
    "service": ["DONE", "FAILED"],
    "action": ["SUCCEEDED", "DONE", "ABORTED", "PREEMPTED", "REJECTED", "RECALLED", "LOST", "ACTIVE"],
}


def say(**message):
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def value(kind):
    if RNG.random() < 0.03:
        return RNG.choice([None, "nonsense", 10**6, [], {}])
    if kind["labels"] or kind["boolean"]:
        return RNG.choice(kind["labels"] or [True, False])
    number = RNG.randint(kind["low"], kind["high"])
    return round(number / 10 ** kind["digits"], kind["digits"])


def some(kinds):
    return {field: value(kind) for field, kind in kinds.items() if RNG.random() < 0.9}


def go_on(number, of):
    """Say something of a request, or nothing; whether it is still under way."""
    if RNG.random() < LAZY:
        return True
    if of["kind"] == "action" and RNG.random() < 0.7:
        say(state=RNG.choice(["ACTIVE", "ACTIVE", "PENDING"]), of=number, values=some(of["feedback"]))
        return True
    for _ in range(RNG.choice([1, 1, 1, 2])):
        say(answer=number, state=RNG.choice([*ENDS[of["kind"]], "nonsense"]), values=some(of["answers"]))
    return False


asked, kinds = {}, {}
for line in sys.stdin:
    message = json.loads(line)
    if "hello" in message:
        kinds = message["requests"]
        say(hello=1, values={"halt": False})
        say(cycle=message["cycle"], values={})
    elif "request" in message:
        asked[message["request"]] = kinds[message["name"]]
    elif "cancel" in message and RNG.random() < 0.5:
        asked.pop(message["cancel"], None)
    asked = {number: of for number, of in asked.items() if go_on(number, of)}
    if "values" in message and "cycle" in message:
        say(cycle=message["cycle"] + 1, values={"halt": RNG.random() < 0.2})
