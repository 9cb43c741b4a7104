/* Lines of JSON in, lines of JSON out, and a cycle whenever one is due. */
#define LINE 4096

static volatile sig_atomic_t stopping = 0;

static void stop(int signal)
{
    (void)signal;
    stopping = 1;
}

static bool less(number a, number b)
{
    if (a.negative != b.negative) {
        return a.negative;
    }
    return a.negative ? a.size > b.size : a.size < b.size;
}

static const char *skipped(const char *at)
{
    while (*at == ' ' || *at == '\t' || *at == '\r') {
        at++;
    }
    return at;
}

/* The text between quotes, without escapes; NULL: there is none. */
static const char *quoted(const char *at, const char **begin, size_t *length)
{
    const char *end;
    if (*at != '"') {
        return NULL;
    }
    end = strchr(at + 1, '"');
    if (end == NULL) {
        return NULL;
    }
    *begin = at + 1;
    *length = (size_t)(end - at) - 1;
    return end + 1;
}

static bool same(const char *name, const char *begin, size_t length)
{
    return strlen(name) == length && strncmp(name, begin, length) == 0;
}

/* A digit more; false: 64 bits are full. */
static bool shifted(uint64_t *size, unsigned digit)
{
    if (*size > (UINT64_MAX - digit) / 10) {
        return false;
    }
    *size = *size * 10 + digit;
    return true;
}

static const char *read_number(const char *at, const kind *of, number *value)
{
    uint8_t left = of->digits;
    value->size = 0;
    value->negative = *at == '-';
    at += value->negative ? 1 : 0;
    if (*at < '0' || *at > '9') {
        return NULL;
    }
    for (; *at >= '0' && *at <= '9'; at++) {
        if (!shifted(&value->size, (unsigned)(*at - '0'))) {
            return NULL;
        }
    }
    if (*at == '.') {
        for (at++; *at >= '0' && *at <= '9'; at++) {
            if (left == 0 ? *at != '0' : !shifted(&value->size, (unsigned)(*at - '0'))) {
                return NULL;
            }
            left = (uint8_t)(left - (left > 0 ? 1 : 0));
        }
    }
    for (; left > 0; left--) {
        if (!shifted(&value->size, 0)) {
            return NULL;
        }
    }
    value->negative = value->negative && value->size != 0;
    return at;
}

/* A value of an input; NULL: it is none. */
static const char *read_value(const char *at, const kind *of, number *value)
{
    const char *begin;
    size_t length;
    size_t i;
    value->negative = false;
    if (of->count > 0) {
        at = quoted(at, &begin, &length);
        for (i = 0; at != NULL && i < of->count; i++) {
            if (same(of->labels[i], begin, length)) {
                value->size = i;
                return at;
            }
        }
        return NULL;
    }
    if (of->truth) {
        value->size = strncmp(at, "true", 4) == 0 ? 1 : 0;
        return value->size == 1 ? at + 4 : strncmp(at, "false", 5) == 0 ? at + 5 : NULL;
    }
    at = read_number(at, of, value);
    return at == NULL || less(*value, of->low) || less(of->high, *value) ? NULL : at;
}

/* All values of a line, or none; what is wrong, or NULL. */
static const char *read_line(const char *at, NAME_inputs *inputs)
{
    NAME_inputs made = *inputs;
    at = skipped(at);
    if (*at != '{') {
        return "no JSON object";
    }
    at = skipped(at + 1);
    while (*at != '}') {
        const char *begin;
        size_t length;
        size_t i = 0;
        number value;
        at = quoted(at, &begin, &length);
        if (at == NULL) {
            return "no name of an input";
        }
        while (i < inputs_count && !same(inputs_of[i].name, begin, length)) {
            i++;
        }
        if (i == inputs_count) {
            return "no input of this name";
        }
        at = skipped(at);
        if (*at != ':') {
            return "no colon after a name";
        }
        at = read_value(skipped(at + 1), &inputs_of[i], &value);
        if (at == NULL) {
            return "no value of the input";
        }
        put(&made, i, value);
        at = skipped(at);
        if (*at == ',' && *skipped(at + 1) == '"') {
            at = skipped(at + 1);
        } else if (*at != '}') {
            return "no comma or brace after a value";
        }
    }
    if (*skipped(at + 1) != '\0') {
        return "something after the object";
    }
    *inputs = made;
    return NULL;
}

static void write_value(const kind *of, number value)
{
    char text[24];
    int length;
    if (of->count > 0) {
        printf("\"%s\"", value.size < of->count ? of->labels[value.size] : "");
        return;
    }
    if (of->truth) {
        printf("%s", value.size != 0 ? "true" : "false");
        return;
    }
    length = snprintf(text, sizeof text, "%0*" PRIu64, (int)of->digits + 1, value.size);
    printf("%s%.*s", value.negative ? "-" : "", length - (int)of->digits, text);
    if (of->digits > 0) {
        printf(".%s", text + length - (int)of->digits);
    }
}

static void write_line(const NAME_state *state, uint64_t cycle, const char *end)
{
    size_t i;
    printf("{\"cycle\": %" PRIu64, cycle);
    for (i = 0; i < outputs_count; i++) {
        printf(", \"%s\": ", outputs_of[i].name);
        write_value(&outputs_of[i], got(state, i));
    }
    if (end != NULL) {
        printf(", \"end\": \"%s\"", end);
    }
    printf("}\n");
    if (fflush(stdout) != 0) {
        stopping = 1; /* nobody reads on */
    }
}

typedef struct {
    char text[LINE];
    size_t used;
    bool skipping;
    bool over;
} reader;

/* Take what is there, `wait` for a line or not; whether a line was taken. */
static bool take(reader *from, NAME_inputs *inputs, bool wait)
{
    bool taken = false;
    while (!from->over && !stopping) {
        struct pollfd ready;
        char *end = memchr(from->text, '\n', from->used);
        if (end != NULL) {
            size_t size = (size_t)(end - from->text) + 1;
            const char *wrong;
            *end = '\0';
            wrong = from->skipping ? "more than 4095 characters" : read_line(from->text, inputs);
            if (wrong != NULL) {
                fprintf(stderr, "refused: %s\n", wrong);
            }
            from->skipping = false;
            from->used -= size;
            memmove(from->text, from->text + size, from->used);
            taken = true;
            if (wait) {
                break;
            }
            continue;
        }
        if (from->used == LINE) {
            from->skipping = true;
            from->used = 0;
        }
        ready.fd = STDIN_FILENO;
        ready.events = POLLIN;
        if (poll(&ready, 1, wait ? 100 : 0) <= 0) { /* a signal may come just before it */
            if (wait && !stopping) {
                continue;
            }
            break;
        }
        {
            ssize_t count = read(STDIN_FILENO, from->text + from->used, LINE - from->used);
            if (count > 0) {
                from->used += (size_t)count;
            } else if (count == 0 && from->used > 0) {
                from->text[from->used++] = '\n';
            } else if (count == 0 || errno != EINTR) {
                from->over = true;
            }
        }
    }
    return taken;
}

static int64_t now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * INT64_C(1000000000) + (int64_t)time.tv_nsec;
}

/* Sleep until then, or until a signal. */
static void sleep_until(int64_t due)
{
    struct timespec time;
    time.tv_sec = (time_t)(due / INT64_C(1000000000));
    time.tv_nsec = (long)(due % INT64_C(1000000000));
    while (!stopping && clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL) == EINTR) {
    }
}

static int usage(void)
{
    fprintf(stderr, "usage: NAME [--lines] [--strict]\n"
                    "--lines: a cycle for each line of standard input, without waiting\n"
                    "--strict: end where a cycle is late by a period\n");
    return 2;
}

int main(int count, char **words)
{
    const int64_t period = (int64_t)NAME_PERIOD_NS;
    static reader from;
    static NAME_state state;
    static NAME_state shown;
    NAME_inputs inputs;
    NAME_status status = NAME_OK;
    struct sigaction action;
    bool lines = false;
    bool strict = false;
    const char *end = NULL;
    uint64_t cycle = 0;
    int64_t due;
    int i;
    for (i = 1; i < count; i++) {
        if (strcmp(words[i], "--lines") == 0) {
            lines = true;
        } else if (strcmp(words[i], "--strict") == 0) {
            strict = true;
        } else {
            return usage();
        }
    }
    if (NAME_layout() != NAME_LAYOUT) {
        fprintf(stderr, "NAME.c and NAME_main.c are of different builds\n");
        return 3;
    }
    memset(&action, 0, sizeof action);
    action.sa_handler = stop;
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
    NAME_init(&state);
    NAME_first(&inputs);
    due = now();
    while (!stopping) {
        if (lines) {
            if (!take(&from, &inputs, true)) {
                break;
            }
        } else {
            int64_t late;
            sleep_until(due);
            late = now() - due;
            if (late >= period) {
                if (strict) {
                    end = "late";
                    break;
                }
                due += late;
            }
            due += period;
            take(&from, &inputs, false);
        }
        if (stopping) {
            break;
        }
        status = NAME_cycle(&state, &inputs);
        clear_commands(&inputs);
        if (status != NAME_OK) {
            break;
        }
        cycle++;
        if (lines || cycle == 1 || differ(&state, &shown)) {
            write_line(&state, cycle, NULL);
            shown = state;
        }
    }
    if (status == NAME_ENDED) {
        write_line(&state, cycle, "finished");
        return 0;
    }
    NAME_safe(&state);
    if (status != NAME_OK) {
        end = status > 0 ? faults[status - 1] : status == NAME_OVERFLOW ? "an int leaves 64 bits" : "corrupt";
    }
    write_line(&state, cycle, end != NULL ? end : "stopped");
    return end != NULL ? 1 : 0;
}
