/* The microwave as somebody would write it, to compare sizes with. */
#include "microwave.h"

#include <string.h>

enum { COOKING = 1, LIGHT = 2, BEEPER = 4, TIMER = 8 };

void microwave_init(microwave_state *state)
{
    memset(state, 0, sizeof *state);
}

void microwave_first(microwave_inputs *inputs)
{
    memset(inputs, 0, sizeof *inputs);
}

void microwave_safe(microwave_state *state)
{
    (void)state;
}

uint32_t microwave_layout(void)
{
    return microwave_LAYOUT;
}

static bool begins(microwave_state *state, uint8_t machine)
{
    const bool entered = (state->entered & machine) != 0;
    state->entered = (uint8_t)(state->entered | machine);
    return !entered;
}

static void leave(microwave_state *state, uint8_t machine)
{
    state->entered = (uint8_t)(state->entered & ~machine);
}

static void count_down(microwave_state *state, bool door_open)
{
    if (state->time_left > 0 && !door_open) {
        state->time_left--;
    }
}

microwave_status microwave_cycle(microwave_state *state, const microwave_inputs *inputs)
{
    const bool button = inputs->button;
    const bool door_open = inputs->door_open;
    const bool time_is_left = state->time_left > 0;
    uint8_t next;
    if (begins(state, COOKING)) {
        state->outputs.motor = state->cooking && !door_open;
    }
    if (state->cooking != (time_is_left && !door_open)) {
        state->cooking = !state->cooking;
        leave(state, COOKING);
    }
    if (begins(state, LIGHT)) {
        state->outputs.lamp = state->lit;
    }
    if (state->lit != (door_open || time_is_left)) {
        state->lit = !state->lit;
        leave(state, LIGHT);
    }
    if (begins(state, BEEPER)) {
        state->beeping = 0;
        if (state->beeper != 1) {
            state->outputs.sound = state->beeper == 2;
        }
    }
    if (state->beeper == 0 ? time_is_left : state->beeper == 1 ? !time_is_left && !state->outputs.motor
                                                               : state->beeping++ > 1) {
        state->beeper = state->beeper == 2 ? 0 : (uint8_t)(state->beeper + 1);
        leave(state, BEEPER);
    }
    next = state->timer;
    if (state->timer == 1) {
        if (begins(state, TIMER)) {
            count_down(state, door_open);
            if (state->time_left <= 120) {
                state->time_left = (uint8_t)(state->time_left + 60);
            }
        }
        next = button ? 2 : 0;
    } else {
        begins(state, TIMER);
        if (state->timer == 0 && button) {
            next = door_open ? 2 : 1;
        } else if (!button) {
            next = 0;
        }
        count_down(state, door_open);
    }
    if (next != state->timer) {
        state->timer = next;
        leave(state, TIMER);
    }
    return microwave_OK;
}
