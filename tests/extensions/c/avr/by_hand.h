/* The microwave as somebody would write it, to compare sizes with. */
#ifndef MICROWAVE_H
#define MICROWAVE_H

#include <stdbool.h>
#include <stdint.h>

#define microwave_LAYOUT 0
#define microwave_OK 0
#define microwave_CORRUPT 1
typedef uint8_t microwave_status;

typedef struct {
    bool button;
    bool door_open;
} microwave_inputs;

typedef struct {
    struct {
        bool motor;
        bool lamp;
        bool sound;
    } outputs;
    uint8_t time_left;
    uint8_t timer;    /* 0: ready, 1: add, 2: held */
    uint8_t beeper;   /* 0: silent, 1: armed, 2: beeping */
    uint8_t beeping;  /* cycles */
    bool cooking;
    bool lit;
    uint8_t entered; /* a bit for each machine */
} microwave_state;

void microwave_init(microwave_state *state);
void microwave_first(microwave_inputs *inputs);
void microwave_safe(microwave_state *state);
uint32_t microwave_layout(void);
microwave_status microwave_cycle(microwave_state *state, const microwave_inputs *inputs);

#endif
