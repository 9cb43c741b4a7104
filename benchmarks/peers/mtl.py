"""reelay or rtamt on one formula: a step at a time from Python, which is all that their packages offer.

`python mtl.py reelay|rtamt` in an environment that has them reads a JSON object from its standard input: `formula`,
`atoms`, `letters` (masks) and `runs`. It prints one with `ns`, processor time of a step, the best of the runs, and
`stream`, what the monitor says after each letter; or with `failed`, why it cannot.
"""

import json
import sys
import time


def reelay(formula, atoms, letters):
    from reelay import discrete_timed_monitor

    monitor = discrete_timed_monitor(pattern=formula, semantics="boolean", condense=False)
    rows = [{name: bool(letter >> i & 1) for i, name in enumerate(atoms)} for letter in letters]
    begin = time.process_time()
    answers = [monitor.update(row) for row in rows]
    return time.process_time() - begin, [answer["value"] for answer in answers]


def rtamt(formula, atoms, letters):
    from rtamt import StlDiscreteTimeSpecification

    monitor = StlDiscreteTimeSpecification()
    for name in (*atoms, "out"):
        monitor.declare_var(name, "float")
    monitor.spec = f"out = {formula}"
    monitor.parse()
    rows = [[(name, 1.0 if letter >> i & 1 else -1.0) for i, name in enumerate(atoms)] for letter in letters]
    begin = time.process_time()
    answers = [monitor.update(number, row) for number, row in enumerate(rows)]
    return time.process_time() - begin, [answer > 0 for answer in answers]


asked = json.load(sys.stdin)
try:
    runs = [{"reelay": reelay, "rtamt": rtamt}[sys.argv[1]](asked["formula"], asked["atoms"], asked["letters"])
            for _ in range(asked["runs"])]  # fmt: skip
    print(json.dumps({"ns": min(r[0] for r in runs) / len(asked["letters"]) * 1e9, "stream": runs[0][1]}))
except Exception as error:  # noqa: BLE001 - whatever a peer raises, it cannot
    print(json.dumps({"failed": f"{type(error).__name__}: {error}"}))
