"""A process that watches a segment: `python -m tests.runtime.whiteboard.watching PLACE READS HOW WORD …`.

PLACE is a file of the segment's descriptor. It prints, as JSON, how many frames it has seen and each combination of
these words that it saw: of READS different frames (`frames`), the same until two words differ (`mixed`), or read one
word after the other (`words`), which is no way to read, while READS times another frame became the newest one.
"""

from __future__ import annotations

import json
import os
import sys

from llfsm_verify.runtime.whiteboard.segment import Attached


def watch(place: str, reads: int, how: str, words: list[int]) -> tuple[int, set[tuple[int, ...]]]:
    descriptor = os.open(place, os.O_RDONLY)
    attached = Attached(descriptor)
    os.close(descriptor)
    while not attached.latest:
        pass
    seen: set[tuple[int, ...]] = set()
    last, frames = 0, 0
    readers = [attached.reader(word) for word in words]
    while frames < reads:
        before = attached.latest
        if how == "words":
            values = tuple(read() for read in readers)
            frames += attached.latest != before
        else:
            frame = attached.newest()
            assert frame is not None
            assert frame[0] >= last, "frames go back"
            frames += frame[0] != last
            last, values = frame[0], tuple([frame[word] for word in words])
        seen.add(values)
        if how == "mixed" and len(set(values)) > 1:
            break
    return frames, seen


if __name__ == "__main__":
    place, reads, how, *words = sys.argv[1:]
    frames, seen = watch(place, int(reads), how, [int(word) for word in words])
    sys.stdout.write(json.dumps([frames, sorted(seen)]) + "\n")
