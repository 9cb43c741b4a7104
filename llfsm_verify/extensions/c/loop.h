#ifndef GUARD_LOOP_H
#define GUARD_LOOP_H

#include <signal.h>
#include "NAME.h"
@monitors #include "NAME_monitors.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum {
    NAME_END_RUNNING, /* it goes on */
    NAME_END_FINISHED, /* all machines have finished */
    NAME_END_STOPPED, /* by a signal, a call-back or `cycles` */
    NAME_END_FAULT, /* a ringlet failed */
    NAME_END_OVERFLOW, /* an `int` would have left 64 bits */
    NAME_END_LATE, /* a cycle was late by a period, and `strict` ends it there */
@monitors     NAME_END_VIOLATED = 7, /* a property is violated, and `strict` ends it there */
    NAME_END_CORRUPT = 6 /* the state names no state of a machine */
} NAME_ending;

/* How a run goes, and how it went. Times are in nanoseconds. */
typedef struct {
    NAME_ending ending;
    int detail; /* of a fault its number, of `stop` its value */
    const char *why; /* why it ended */
    const NAME_state *state; /* during call-backs */
@monitors     const NAME_monitors *monitors; /* as well */
    uint64_t cycles; /* complete ones */
    uint64_t ringlets;
    uint64_t refused; /* cycles for which an input outside its range was read; all inputs stayed as they were */
    uint64_t overruns; /* cycles that began late by a period or more */
    int64_t moved; /* by how much these moved all later cycles */
    int64_t worst; /* the largest lateness */
    uint64_t late[512]; /* how often: up to 8 one each, then eight for each power of two, as in HdrHistogram */
    uint64_t frames; /* in the recording */
    int unrecorded; /* why the recording ended before the run, as of `errno`; 0 */
} NAME_report;

/* What the loop calls; each of it may be NULL. */
typedef struct {
    void *context; /* for all of it */
    /* Before a cycle: store what inputs are now. They hold until they are stored again. false: end. */
    bool (*read)(void *context, NAME_inputs *inputs);
    /* After a cycle, and once more at the end, with safe values: take the outputs. false: end. */
    bool (*write)(void *context, const NAME_outputs *outputs, const NAME_report *report);
    /* After that last one, where a ringlet failed. */
    void (*fault)(void *context, NAME_status status, const char *why);
    /* Once, before all: store values of inputs that never change; a recording has these. */
    void (*begin)(void *context, NAME_state *state);
} NAME_calls;

typedef struct {
    const char *record; /* a file that is not there yet, for what happens; NULL: none. Ignore SIGXFSZ beside it. */
    const volatile sig_atomic_t *stop; /* the run ends when it is not 0; NULL: never */
    uint64_t cycles; /* end after so many; 0: never */
    bool at_once; /* cycles follow each other without waiting */
    bool strict; /* end where a cycle is late by a period */
@monitors     /* with `strict`: also where a property is violated */
} NAME_options;

/* A cycle in each NAME_PERIOD_NS, until the run ends. One that is late by a period or more moves all later ones.
   Memory is taken once, before the first cycle. 0; -1: sources of different builds; an `errno`: no memory, or the
   recording cannot be written, and nothing has run. */
int NAME_run(const NAME_calls *calls, const NAME_options *options, NAME_report *report);

/* The lateness that so many of 1,000 cycles did not exceed, to an eighth; 0 without a cycle that waited. */
int64_t NAME_percentile(const NAME_report *report, unsigned of_1000);

#ifdef __cplusplus
}
#endif

#endif
