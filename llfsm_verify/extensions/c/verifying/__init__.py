"""Built images are run on vectors, and each field of each record is compared with the executor's.

What a user writes, and what that prints:

    $ llfsm build models/microwave/arrangement.yaml --target c --for avr --verify
    Verified on simavr (atmega328p): 50916 ringlets and 20092 cycles, 0 differences.
    These are all ringlets that there can be, with each combination of the inputs that they read.
    These are all cycles that there can be, with each combination of the inputs that they read.
    Flash: 968 of 32768 bytes. RAM: 23 of 2048 bytes, and 8 of stack in a call.
    Worst ringlet: 118 CPU cycles, 0.00737 ms.
    Worst cycle: 380 CPU cycles, 0.0238 ms of 1000 ms.

Mistakes:

    error[E508]: `avr-gcc` is not installed, and the image cannot be verified without it
    error[E509]: the image does not fit: …: region `text' overflowed by 412 bytes
    On cc: sequence 3 differs in step 17: lamp is true, expected false.        (exit code 1)
"""
