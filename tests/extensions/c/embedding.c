/* A C program of somebody who embeds the lift: it presses a button, and counts what the motor does. */
#include "lift_loop.h"

#include <stdio.h>
#include <string.h>

typedef struct {
    uint64_t pressed;
    uint64_t moved;
    uint64_t rising;
} counts;

static bool press(void *context, lift_inputs *inputs)
{
    counts *c = context;
    inputs->call_2 = c->pressed++ == 3;
    return c->pressed <= 20;
}

static bool count(void *context, const lift_outputs *outputs, const lift_report *report)
{
    counts *c = context;
    c->moved += outputs->motor == lift_Motor_UP ? 1 : 0;
    c->rising += report->state->cabin.state_ == lift_cabin_RISE ? 1 : 0;
    return true;
}

int main(int argc, char **argv)
{
    counts c = {0, 0, 0};
    lift_calls calls = {NULL, NULL, NULL, NULL, NULL};
    lift_options options;
    lift_report report;
    int error;
    memset(&options, 0, sizeof options);
    calls.context = &c;
    calls.read = press;
    calls.write = count;
    options.at_once = true;
    options.record = argc > 1 ? argv[1] : NULL;
    error = lift_run(&calls, &options, &report);
    if (error != 0) {
        printf("%s\n", strerror(error));
        return 1;
    }
    printf("%s %u moved %u rising %u\n", report.why, (unsigned)report.cycles, (unsigned)c.moved, (unsigned)c.rising);
    return 0;
}
