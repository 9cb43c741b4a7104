"""Images on AVR microcontrollers: pins from a table, a tick from timer 1.

What a user writes, and what that prints:

    $ llfsm build models/microwave/arrangement.yaml --target c --for avr --output oven
    written: oven/microwave.h
    written: oven/microwave.c
    written: oven/microwave_main.c
    written: oven/Makefile
    written: oven/README.md

    Pins: models/microwave/pins.yaml.
    Timer 1 of the atmega328p at 16000000 Hz: prescaler 256, 62500 counts, 1 interrupt a cycle.
    Compile it there: make

Mistakes:

    pins.yaml:3:11: error[E506]: the atmega328p has no pin `PB9`
    pins.yaml:4:10: error[E506]: `PD2` is the pin of `button` already
    a.yaml: error[E507]: a cycle of 10000 ms is too long for timer 1 of the atmega328p at 16000000 Hz
"""
