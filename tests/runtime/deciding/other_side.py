"""The other side of the requests of picking.yaml, on standard streams: a program that keeps to them, or does not.

`python other_side.py SEED [WRONG]`; WRONG: the eighth thing that it says is an answer that nobody asked for.
"""

import json
import random
import sys

NEXT = {
    "WAITING": ["DONE", "FAILED"],
    "PENDING": ["ACTIVE", "REJECTED"],
    "ACTIVE": ["SUCCEEDED", "ABORTED", "PREEMPTED"],
}
FIRST = {"locate_state": "WAITING", "arm_state": "PENDING"}
MOST = 60
ASKS = {"locate_state": "locate", "arm_state": "reach"}


def main(seed: int, *, wrong: bool) -> None:
    """Move one state of each request when a frame has shown the last one."""
    rng, said = random.Random(seed), 0
    posted = dict.fromkeys(FIRST, "IDLE")
    for line in sys.stdin:
        seen = json.loads(line)
        for name, now in posted.items():
            ask, after = seen[ASKS[name]], now
            if seen[name] != now:
                continue
            if now == "IDLE":
                after = FIRST[name] if ask else now
            elif now in NEXT:
                after = rng.choice(NEXT[now]) if ask or name == "arm_state" else "IDLE"
            elif not ask:
                after = "IDLE"
            if after == now:
                continue
            posted[name], said = after, said + 1
            values = {name: after}
            if after == "DONE":
                values["fruits"] = rng.randrange(4)
            elif wrong and said >= 8 and after != "FAILED":
                values["fruits"], wrong = (seen["fruits"] + 1) % 4, False
            sys.stdout.write(json.dumps(values) + "\n")
            sys.stdout.flush()
            if said == MOST:
                return  # so ends the run, when a port stops it


if __name__ == "__main__":
    main(int(sys.argv[1]), wrong=len(sys.argv) > 2)
