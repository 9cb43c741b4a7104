/* The loop with a clock of ours: each sleep lasts as long as it was asked to, and as a line of standard input says. */
#define _POSIX_C_SOURCE 200809L
#include "everything_loop.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

static int64_t clock_ns = INT64_C(1000000000);
static int64_t late_ns;

int fake_gettime(clockid_t clock, struct timespec *time)
{
    (void)clock;
    time->tv_sec = (time_t)(clock_ns / INT64_C(1000000000));
    time->tv_nsec = (long)(clock_ns % INT64_C(1000000000));
    return 0;
}

int fake_nanosleep(clockid_t clock, int flags, const struct timespec *until, struct timespec *left)
{
    const int64_t wanted = (int64_t)until->tv_sec * INT64_C(1000000000) + (int64_t)until->tv_nsec;
    (void)clock;
    (void)left;
    (void)flags;
    clock_ns = (wanted > clock_ns ? wanted : clock_ns) + late_ns;
    return 0;
}

static bool work(void *context, const everything_outputs *outputs, const everything_report *report)
{
    int64_t busy;
    (void)context;
    (void)outputs;
    if (report->ending != everything_END_RUNNING) {
        printf("%s %" PRIu64 " %" PRId64 " %" PRId64 "\n", report->why, report->overruns, report->moved, report->worst);
        return false;
    }
    printf("%" PRId64 "\n", clock_ns - INT64_C(1000000000));
    if (scanf("%" SCNd64 " %" SCNd64, &busy, &late_ns) != 2) {
        return false;
    }
    clock_ns += busy;
    return true;
}

int main(int argc, char **argv)
{
    everything_calls calls = {NULL, NULL, work, NULL, NULL};
    everything_options options;
    everything_report report;
    unsigned i;
    memset(&options, 0, sizeof options);
    options.strict = argc > 1 && strcmp(argv[1], "strict") == 0;
    if (everything_run(&calls, &options, &report) != 0) {
        return 1;
    }
    for (i = 0; i < 512; i++) {
        printf("%" PRIu64 " ", report.late[i]);
    }
    printf("\n%" PRId64 " %" PRId64 " %" PRId64 "\n", everything_percentile(&report, 500),
        everything_percentile(&report, 990), everything_percentile(&report, 999));
    return 0;
}
