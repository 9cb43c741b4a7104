/* A recording, as llfsm_verify/runtime/recording/file.py describes it. `used` is written after each entry, so what a
   program that is killed has completed stays readable. Space is reserved before it is needed: a full disk is noticed
   there, the file says so, and the run goes on. */
#define HEAD 16
#define ROOM UINT64_C(1048576)
#define WHOLE 1
#define NAP INT64_C(50000000)

typedef struct {
    NAME_state state;
@monitors     NAME_monitors monitors;
    NAME_inputs inputs;
    NAME_inputs good; /* the last ones that were taken */
    uint64_t frame[WORDS];
    uint64_t before[WORDS]; /* what the recording has */
    unsigned char entry[LARGEST];
    int file; /* -1: nothing is recorded */
    uint64_t used;
    uint64_t length;
    uint32_t check;
    int64_t base; /* when cycle 0 was due */
    int64_t started; /* when the last one began */
} loop;

static size_t put_number(unsigned char *to, size_t at, uint64_t number)
{
    for (; number >= 128; number >>= 7) {
        to[at++] = (unsigned char)(128 | (number & 127));
    }
    to[at++] = (unsigned char)number;
    return at;
}

static size_t put_bytes(unsigned char *to, size_t at, uint64_t number, size_t count)
{
    for (; count > 0; count--, number >>= 8) {
        to[at++] = (unsigned char)(number & 255);
    }
    return at;
}

static uint32_t checksum(unsigned char *entry, size_t size, uint32_t before)
{
    uint64_t mixed = (uint64_t)size << 32 | before;
    size_t at;
    memset(entry + size, 0, 8);
    for (at = 0; at < size; at += 8) {
        uint64_t word = 0;
        size_t i;
        for (i = 8; i > 0; i--) {
            word = word << 8 | entry[at + i - 1];
        }
        mixed = (mixed ^ word) * UINT64_C(0x9E3779B97F4A7C15);
        mixed ^= mixed >> 32;
    }
    return (uint32_t)(mixed & UINT32_MAX);
}

/* 0, or an `errno`. */
static int write_at(int file, const void *bytes, size_t size, uint64_t at)
{
    const unsigned char *from = bytes;
    while (size > 0) {
        ssize_t count = pwrite(file, from, size, (off_t)at);
        if (count > 0) {
            from += count;
            size -= (size_t)count;
            at += (uint64_t)count;
        } else if (count == 0 || errno != EINTR) {
            return count == 0 ? EIO : errno;
        }
    }
    return 0;
}

/* Room for an entry; while the file is written it ends with a whole page of any size. */
static int reserve(loop *l)
{
    const uint64_t wanted = BEGIN + l->used + LARGEST;
    while (l->length < wanted) {
        const uint64_t more = (wanted - l->length + ROOM - 1) / ROOM * ROOM;
        int error = posix_fallocate(l->file, (off_t)l->length, (off_t)more);
        if (error == 0) {
            l->length += more;
        } else if (error != EINTR) {
            return error;
        }
    }
    return 0;
}

/* Nothing more is recorded, since the last frame is there (0), or the file cannot grow. */
static void close_recording(loop *l, NAME_report *report, int error)
{
    unsigned char closed[4];
    const unsigned why = error > 0 && error < 32767 ? WHOLE + (unsigned)error : error == 0 ? WHOLE : WHOLE + EIO;
    int failed;
    if (l->file < 0) {
        return;
    }
    put_bytes(closed, 0, why | (why ^ 0xFFFFu) << 16, 4);
    failed = write_at(l->file, closed, 4, BEGIN - HEAD + 8);
    if (ftruncate(l->file, (off_t)(BEGIN + l->used)) != 0 || fsync(l->file) != 0) {
        failed = errno;
    }
    if (close(l->file) != 0) {
        failed = errno;
    }
    l->file = -1;
    report->unrecorded = error != 0 ? error : failed;
}

/* CRC-32 of more text. */
static uint32_t crc(uint32_t check, const char *text, size_t size)
{
    size_t i;
    int bit;
    check = ~check;
    for (i = 0; i < size; i++) {
        check ^= (unsigned char)text[i];
        for (bit = 0; bit < 8; bit++) {
            check = check >> 1 ^ ((check & 1) != 0 ? UINT32_C(0xEDB88320) : 0);
        }
    }
    return ~check;
}

static int begin_recording(loop *l, const char *path)
{
    unsigned char head[HEAD];
    char end[HEADER_END];
    uint64_t at = 0;
    size_t i;
    int error;
    l->file = open(path, O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (l->file < 0) {
        return errno;
    }
    if (l->file <= STDERR_FILENO) { /* which was closed: others may write there */
        const int low = l->file;
        l->file = fcntl(low, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
        error = l->file < 0 ? errno : 0;
        (void)close(low);
        if (error != 0) {
            (void)unlink(path);
            return error;
        }
    }
    (void)flock(l->file, LOCK_EX | LOCK_NB); /* so that readers see that it goes on */
    error = reserve(l);
    for (i = 0; error == 0 && i < sizeof header / sizeof header[0]; i++) {
        const size_t size = strlen(header[i]);
        error = write_at(l->file, header[i], size, at);
        at += size;
    }
    memset(end, ' ', sizeof end);
    end[put_free(&l->state, end, sizeof end)] = ' ';
    end[sizeof end - 1] = '\n';
    memset(head, 0, sizeof head);
    l->check = crc(HEADER_CHECK, end, sizeof end);
    put_bytes(head, HEAD - 4, l->check, 4);
    if (error == 0) {
        error = write_at(l->file, end, sizeof end, at);
    }
    if (error == 0) {
        error = write_at(l->file, head, HEAD, BEGIN - HEAD);
    }
    if (error != 0) {
        (void)close(l->file);
        (void)unlink(path);
        l->file = -1;
    }
    return error;
}

static int64_t now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * INT64_C(1000000000) + (int64_t)time.tv_nsec;
}

/* The frame of the state as it is now. */
static void fill(loop *l, const NAME_report *report)
{
    if (l->file < 0) {
        return;
    }
    l->frame[NUMBER]++;
    l->frame[COMMITTED] = (uint64_t)now();
    l->frame[STEPS] = report->ringlets;
    l->frame[MOVED] = (uint64_t)report->moved;
    put_record(&l->state, l->frame + RECORD);
    memcpy(l->frame + EVENTS, l->state.events, sizeof l->state.events);
}

/* The frame is complete: record how it differs from the one before. */
static void commit(loop *l, NAME_report *report)
{
    unsigned char used[8];
    size_t size = 0;
    size_t last = 0;
    size_t i;
    uint32_t check;
    int error;
    if (l->file < 0) {
        return;
    }
    size = put_number(l->entry, size, 0);
    for (i = 0; i < WORDS; i++) {
        const uint64_t change = l->frame[i] - l->before[i];
        if (change != 0) {
            size = put_number(l->entry, size, i + 1 - last);
            size = put_number(l->entry, size, change << 1 ^ (change >> 63 != 0 ? UINT64_MAX : 0));
            last = i + 1;
        }
    }
    size = put_number(l->entry, size, 0);
    check = checksum(l->entry, size, l->check);
    size = put_bytes(l->entry, size, check, 4);
    error = reserve(l);
    if (error == 0) {
        error = write_at(l->file, l->entry, size, BEGIN + l->used);
    }
    put_bytes(used, 0, l->used + size, 8);
    if (error == 0) {
        error = write_at(l->file, used, 8, BEGIN - HEAD);
    }
    if (error != 0) {
        close_recording(l, report, error);
        return;
    }
    memcpy(l->before, l->frame, sizeof l->before);
    l->used += size;
    l->check = check;
    report->frames++;
}

static size_t bucket(int64_t late)
{
    uint64_t part = (uint64_t)late;
    size_t octave = 1;
    if (late < 8) {
        return late < 0 ? 0 : (size_t)late;
    }
    for (; part >= 16; part >>= 1) {
        octave++;
    }
    return octave * 8 + (size_t)(part - 8);
}

int64_t NAME_percentile(const NAME_report *report, unsigned of_1000)
{
    uint64_t total = 0;
    uint64_t seen = 0;
    uint64_t i;
    for (i = 0; i < 512; i++) {
        total += report->late[i];
    }
    for (i = 0; total > 0 && i < 512; i++) {
        seen += report->late[i];
        if (seen >= total / 1000 * of_1000 + (total % 1000 * of_1000 + 999) / 1000) {
            const int64_t most = i < 8 ? (int64_t)i : (int64_t)(((9 + i % 8) << (i / 8 - 1)) - 1);
            return most < report->worst ? most : report->worst;
        }
    }
    return 0;
}

static bool told(const NAME_options *options)
{
    return options->stop != NULL && *options->stop != 0;
}

/* Until the next cycle may begin, which is no sooner than half a period after the one before it. */
static NAME_ending wait_for(loop *l, const NAME_options *options, NAME_report *report)
{
    const int64_t period = (int64_t)NAME_PERIOD_NS;
    const int64_t due = l->base + (int64_t)report->cycles * period;
    int64_t begin = due;
    int64_t time = now();
    int64_t late;
    if (l->started != 0 && due < l->started + period - period / 2) {
        begin = l->started + period - period / 2;
    }
    for (; time < begin && !told(options); time = now()) {
        const int64_t until = begin - time > NAP ? time + NAP : begin; /* a signal may come just before it sleeps */
        struct timespec at;
        at.tv_sec = (time_t)(until / INT64_C(1000000000));
        at.tv_nsec = (long)(until % INT64_C(1000000000));
        (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, NULL);
    }
    if (told(options)) {
        return NAME_END_STOPPED;
    }
    l->started = time;
    late = time - due;
    l->frame[LATENESS] = (uint64_t)late;
    report->late[bucket(late)]++;
    report->worst = late > report->worst ? late : report->worst;
    if (late >= period) {
        report->overruns++;
        report->moved += late;
        l->base += late;
        return options->strict ? NAME_END_LATE : NAME_END_RUNNING;
    }
    return NAME_END_RUNNING;
}

static NAME_ending failed(NAME_status status)
{
    return status == NAME_OVERFLOW ? NAME_END_OVERFLOW : status == NAME_CORRUPT ? NAME_END_CORRUPT : NAME_END_FAULT;
}

/* One cycle; why there are no more. */
static NAME_ending turn(loop *l, const NAME_calls *calls, const NAME_options *options, NAME_report *report,
    NAME_status *status)
{
    NAME_ending ending = NAME_END_RUNNING;
    if (told(options) || (options->cycles != 0 && report->cycles >= options->cycles)) {
        return NAME_END_STOPPED;
    }
    if (!options->at_once) {
        ending = wait_for(l, options, report);
        if (ending != NAME_END_RUNNING) {
            return ending;
        }
    }
    if ((calls->read != NULL && !calls->read(calls->context, &l->inputs)) || told(options)) {
        return NAME_END_STOPPED;
    }
    *status = NAME_step(&l->state, &l->inputs);
    if (*status == NAME_BAD_INPUT) {
        report->refused++;
        l->inputs = l->good;
        *status = NAME_step(&l->state, &l->inputs);
    }
    if (*status == NAME_ENDED) {
        return NAME_END_FINISHED;
    }
    l->frame[CYCLE] = report->cycles;
    l->frame[PROCESS] = 0;
    memset(l->frame + FIRED, 0, (CHOICES - FIRED) * sizeof l->frame[0]);
    put_choices(&l->inputs, l->frame + CHOICES);
    while (*status == NAME_OK) {
        report->ringlets++;
@monitors         (void)NAME_monitors_step(&l->monitors, &l->state);
        put_fired(&l->state, l->frame + FIRED);
        if (cycle_over(&l->state)) {
            break;
        }
        *status = NAME_step(&l->state, &l->inputs);
    }
    if (*status != NAME_OK) {
        return failed(*status);
    }
    report->cycles++;
    clear_commands(&l->inputs);
    l->good = l->inputs;
@monitors     if (options->strict && NAME_violated(&l->monitors)) {
@monitors         fill(l, report); /* and record it after the safe values are written */
@monitors         return NAME_END_VIOLATED;
@monitors     }
    if (calls->write != NULL && !calls->write(calls->context, outputs(&l->state), report)) {
        ending = NAME_END_STOPPED;
    }
    fill(l, report);
    commit(l, report);
    return ending;
}

static const char *reason(NAME_ending ending, NAME_status status)
{
    switch (ending) {
    case NAME_END_FINISHED:
        return "finished";
    case NAME_END_FAULT:
        return faults[status - 1];
    case NAME_END_OVERFLOW:
        return "an int leaves 64 bits";
    case NAME_END_LATE:
        return "late";
@monitors     case NAME_END_VIOLATED:
@monitors         return "violated";
    case NAME_END_CORRUPT:
        return "corrupt";
    case NAME_END_STOPPED:
    case NAME_END_RUNNING:
    default:
        return "stopped";
    }
}

int NAME_run(const NAME_calls *calls, const NAME_options *options, NAME_report *report)
{
    loop *l;
    NAME_ending ending = NAME_END_RUNNING;
    NAME_status status = NAME_OK;
    memset(report, 0, sizeof *report);
    if (NAME_layout() != NAME_LAYOUT) {
        return -1;
    }
    l = calloc(1, sizeof *l);
    if (l == NULL) {
        return ENOMEM;
    }
    l->file = -1;
    NAME_init(&l->state);
    NAME_first(&l->inputs);
    if (calls->begin != NULL) {
        calls->begin(calls->context, &l->state);
    }
    if (options->record != NULL) {
        const int error = begin_recording(l, options->record);
        if (error != 0) {
            free(l);
            return error;
        }
    }
@monitors     NAME_monitors_init(&l->monitors, &l->state);
@monitors     report->monitors = &l->monitors;
    l->good = l->inputs;
    report->state = &l->state;
    l->frame[PROCESS] = UINT64_MAX;
    put_choices(&l->inputs, l->frame + CHOICES);
    l->base = now();
    fill(l, report);
@monitors     if (options->strict && NAME_violated(&l->monitors)) {
@monitors         ending = NAME_END_VIOLATED;
@monitors     }
    if (ending == NAME_END_RUNNING) {
        commit(l, report);
    }
    while (ending == NAME_END_RUNNING) {
        ending = turn(l, calls, options, report, &status);
    }
    if (ending != NAME_END_FINISHED) {
        NAME_safe(&l->state);
    }
    report->ending = ending;
    report->why = reason(ending, status);
    if (ending == NAME_END_FAULT) {
        report->detail = status;
    } else if (ending == NAME_END_STOPPED && told(options)) {
        report->detail = (int)*options->stop;
    }
    if (calls->write != NULL) { /* before all that can take time */
        (void)calls->write(calls->context, outputs(&l->state), report);
    }
    if (calls->fault != NULL && failed(status) == ending) {
        calls->fault(calls->context, status, report->why);
    }
@monitors     if (ending == NAME_END_VIOLATED) {
@monitors         commit(l, report);
@monitors     }
    l->frame[ENDING] = (uint64_t)ending;
    l->frame[DETAIL] = ending == NAME_END_OVERFLOW ? UINT64_MAX : (uint64_t)(int64_t)report->detail;
    fill(l, report);
    commit(l, report);
    close_recording(l, report, 0);
    report->state = NULL;
@monitors     report->monitors = NULL;
    free(l);
    return 0;
}
