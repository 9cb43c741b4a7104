#ifndef GUARD_MONITORS_H
#define GUARD_MONITORS_H

#include "NAME.h"

#ifdef __cplusplus
extern "C" {
#endif

@cost
typedef enum {
@names
} NAME_property;
#define NAME_PROPERTIES @count

typedef uint8_t NAME_verdict;
#define NAME_UNDECIDED 0 /* what follows may satisfy the property, or violate it */
#define NAME_HOLDS 1 /* whatever follows satisfies it */
#define NAME_VIOLATED 2 /* whatever follows violates it */

typedef struct {
    uint32_t step; /* @units that were read after the beginning; it stops at its largest value */
    uint32_t decided[NAME_PROPERTIES]; /* `step` at each verdict; 0: that of the beginning */
    struct {
@states
    } at; /* states of the monitors */
} NAME_monitors;

/* At the beginning, after NAME_init. */
void NAME_monitors_init(NAME_monitors *monitors, const NAME_state *state);

/* After each NAME_step that returned NAME_OK; whether a property got its verdict. */
bool NAME_monitors_step(NAME_monitors *monitors, const NAME_state *state);

/* A verdict stays as it is. */
NAME_verdict NAME_monitors_verdict(const NAME_monitors *monitors, NAME_property property);

/* Whether a property is violated. */
bool NAME_violated(const NAME_monitors *monitors);

/* NAME_cycle, with NAME_monitors_step after each ringlet. */
NAME_status NAME_monitored_cycle(
    NAME_monitors *monitors, NAME_state *state, const NAME_inputs *inputs);

#ifdef __cplusplus
}
#endif

#endif
/* @source */
#include "NAME_monitors.h"

#ifdef __AVR__
#include <avr/pgmspace.h>
#define NAME_FLASH PROGMEM
#define NAME_READ8(place) pgm_read_byte(place)
#define NAME_READ16(place) pgm_read_word(place)
#define NAME_APART __attribute__((noinline)) /* its bytes once */
#else
#define NAME_FLASH
#define NAME_READ8(place) (*(place))
#define NAME_READ16(place) (*(place))
#define NAME_APART
#endif

@runtime@tables@decide
void NAME_monitors_init(NAME_monitors *monitors, const NAME_state *state)
{
@first
}

bool NAME_monitors_step(NAME_monitors *monitors, const NAME_state *state)
{
@step
}

NAME_verdict NAME_monitors_verdict(const NAME_monitors *monitors, NAME_property property)
{
    switch (property) {
@verdicts
    default:
        return NAME_UNDECIDED;
    }
}

bool NAME_violated(const NAME_monitors *monitors)
{
    size_t i;
    for (i = 0; i < NAME_PROPERTIES; i++) {
        if (NAME_monitors_verdict(monitors, (NAME_property)i) == NAME_VIOLATED) {
            return true;
        }
    }
    return false;
}

NAME_status NAME_monitored_cycle(
    NAME_monitors *monitors, NAME_state *state, const NAME_inputs *inputs)
{
    NAME_status status;
    do {
        status = NAME_step(state, inputs);
        if (status == NAME_OK) {
            (void)NAME_monitors_step(monitors, state);
        }
    } while (status == NAME_OK && !state->@cycle);
    return status;
}
