#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "NAME.h"
@monitors #include "NAME_monitors.h"

#ifndef STOP_WHEN_LATE
#define STOP_WHEN_LATE 0 /* 1: safe values, and no more cycles, where one begins a whole period late */
#endif

@monitors #ifndef STOP_WHEN_VIOLATED
@monitors #define STOP_WHEN_VIOLATED 1 /* safe values, and no more cycles, where a property is violated */
@monitors #endif
@monitors 
static volatile uint8_t due = 1; /* cycles that are to begin */

ISR(TIMER1_COMPA_vect)
{
@TICK@
}

static void read_inputs(NAME_inputs *inputs)
{
@READ@
}

static void write_outputs(const NAME_state *state)
{
@WRITE@
}

/* After a fault. */
static void write_last(const NAME_state *state)
{
@LAST@
}

static void set_up(const NAME_state *state)
{
@SERIAL@
    write_outputs(state); /* before pins become outputs */
@PINS@
    OCR1A = @COUNTS@U - 1U;
    TCCR1A = 0;
    TCCR1B = (uint8_t)(_BV(WGM12) | @PRESCALER@); /* CPU clock / @DIVIDED@ */
    TIMSK1 = _BV(OCIE1A);
    SMCR = 0; /* sleep means idle: the timer goes on */
}

/* Sleep until a cycle is due; whether more than one is. */
static bool wait(void)
{
    bool late;
    cli();
    while (due == 0) {
        sleep_enable();
        sei(); /* the instruction after it is executed before an interrupt */
        sleep_cpu();
        sleep_disable();
        cli();
    }
    late = due > 1;
    due = 0;
    sei();
    return late;
}

int main(void)
{
@monitors     static NAME_monitors monitors;
    static NAME_state state;
    static NAME_inputs inputs;
    bool stopped = false;
    NAME_init(&state);
    NAME_first(&inputs);
@monitors     NAME_monitors_init(&monitors, &state);
    set_up(&state);
    while (!stopped) {
        if (wait() && STOP_WHEN_LATE) {
            NAME_safe(&state);
            stopped = true;
        } else {
            read_inputs(&inputs);
@plain             stopped = NAME_cycle(&state, &inputs) != NAME_OK;
@monitors             stopped = NAME_monitored_cycle(&monitors, &state, &inputs) != NAME_OK;
        }
@monitors         if (STOP_WHEN_VIOLATED && NAME_violated(&monitors)) {
@monitors             NAME_safe(&state);
@monitors             stopped = true;
@monitors         }
        write_outputs(&state); /* after a fault, those that have safe values have them */
    }
    write_last(&state);
    cli();
    for (;;) {
        sleep_enable();
        sleep_cpu();
    }
}
