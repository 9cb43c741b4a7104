"""Arrangements as programs for machines where neither Python nor LLVM is.

What a user writes, and what that prints:

    $ llfsm build models/microwave/arrangement.yaml --target c --for none --output oven
    written: oven/microwave.h
    written: oven/microwave.c

    Call microwave_cycle once in 1000 ms.

Mistakes:

    models/batman/arrangement.yaml:19:3: error[E503]: `wander` is a model of something else (`model: true`), …
    a.yaml:2:46: error[E504]: input `k_0` and input `k[0]` would both be `k_0` in C
    oven: error[E505]: microwave.c is there already, and `llfsm build` has not written it
"""

from typing import Final

IMPOSSIBLE: Final = "E503"
UNWRITABLE: Final = "E505"
ABSENT: Final = "E515"
TOO_LARGE: Final = "E516"

CODES: Final = {
    IMPOSSIBLE: "An arrangement has something that one image of a target cannot do.",
    UNWRITABLE: "The files of a target cannot be written there, or would replace others.",
    ABSENT: "A property that a target is to monitor speaks of the model of the surroundings, which is not there.",
    TOO_LARGE: "The monitor of a property is too large for a target.",
}
