"""Built images are run on vectors, and each field of each record is compared with the executor's.

What a user writes, and what that prints:

    $ llfsm build models/microwave/arrangement.yaml --target c --for avr --verify
    …
    Verified on simavr (atmega328p): 50916 steps in 1 sequence, 0 differences.
    flash: 1494 of 32768 bytes; RAM: 28 of 2048 bytes, and 34 of stack in a cycle
    worst ringlet: 338 CPU cycles; worst cycle: 1101 CPU cycles (0.069 of 1000 ms)

Mistakes:

    error[E508]: `avr-gcc` is not installed, and the image cannot be built without it
    error[E509]: the harness does not fit the atmega48p: region `text' overflowed by 412 bytes
    Verified on cc: sequence 3 differs in step 17: lamp is true, expected false        (exit code 1)
"""

from typing import Final

MISSING: Final = "E508"
FAILED: Final = "E509"

CODES: Final = {
    MISSING: "A compiler or an emulator that a verified build needs is not installed.",
    FAILED: "A built image cannot be verified: it does not compile or fit, it gives no answer, or its vectors are of "
    "another program.",
}
