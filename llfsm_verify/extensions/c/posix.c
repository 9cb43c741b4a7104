/* Lines of JSON in, lines of JSON out. */
#define LINE 4096

static volatile sig_atomic_t stopping = 0;

static void stop(int signal)
{
    stopping = signal;
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
    bool given[sizeof inputs_of / sizeof inputs_of[0]] = {false};
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
        if (given[i]) {
            return "an input twice";
        }
        given[i] = true;
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

/* Lines that standard output has not taken yet: it has room for all verdicts, a line of outputs and the last one. */
static struct {
    char text[UNSENT];
    size_t used;
    int failed; /* why it takes no more, as of `errno`, unless its reader has closed it; 0 */
} unsent;

static void add(const char *format, ...)
{
    const size_t room = sizeof unsent.text - unsent.used;
    va_list values;
    int size;
    va_start(values, format);
    size = vsnprintf(unsent.text + unsent.used, room, format, values);
    va_end(values);
    unsent.used += size > 0 && (size_t)size < room ? (size_t)size : 0;
}

/* How many bytes a file takes without waiting for a reader, after at most `wait` milliseconds; -1: nobody reads on.
   Where a pipe has room, it has room for PIPE_BUF bytes. */
static ssize_t put_bytes(int file, const char *text, size_t size, int wait)
{
    struct pollfd ready;
    ssize_t count;
    ready.fd = file;
    ready.events = POLLOUT;
    if (poll(&ready, 1, wait) <= 0) {
        return 0;
    }
    size = size < PIPE_BUF ? size : PIPE_BUF;
    count = send(file, text, size, MSG_DONTWAIT);
    if (count < 0 && errno == ENOTSOCK) {
        count = write(file, text, size);
    }
    return count >= 0 ? count : errno == EINTR || errno == EAGAIN || errno == EWOULDBLOCK ? 0 : -1;
}

/* Send what it takes; `patience`: how often a tenth of a second is waited for more room, if a signal does not end that
   before. false: nobody reads on. */
static bool send_lines(unsigned patience, bool last)
{
    while (unsent.used > 0) {
        const ssize_t count = put_bytes(STDOUT_FILENO, unsent.text, unsent.used, patience > 0 ? 100 : 0);
        if (count < 0) {
            unsent.failed = errno == EPIPE || errno == ECONNRESET ? unsent.failed : errno;
            unsent.used = 0;
            return false;
        }
        unsent.used -= (size_t)count;
        memmove(unsent.text, unsent.text + count, unsent.used);
        if (count == 0 && (patience == 0 || (stopping && !last))) {
            break;
        }
        patience -= count == 0 && patience != UINT_MAX ? 1 : 0;
    }
    return true;
}

static void write_value(const kind *of, number value)
{
    char text[24];
    int length;
    if (of->count > 0) {
        add("\"%s\"", value.size < of->count ? of->labels[value.size] : "");
        return;
    }
    if (of->truth) {
        add("%s", value.size != 0 ? "true" : "false");
        return;
    }
    length = snprintf(text, sizeof text, "%0*" PRIu64, (int)of->digits + 1, value.size);
    add("%s%.*s", value.negative ? "-" : "", length - (int)of->digits, text);
    if (of->digits > 0) {
        add(".%s", text + length - (int)of->digits);
    }
}

static void write_text(const char *text)
{
    add("\"");
    for (; *text != '\0'; text++) {
        if (*text == '"' || *text == '\\') {
            add("\\%c", *text);
        } else if (*text > 0 && *text < ' ') {
            add("\\u%04x", (unsigned)*text);
        } else {
            add("%c", *text);
        }
    }
    add("\"");
}

static void write_line(const NAME_outputs *outputs, uint64_t cycle, const char *end)
{
    size_t i;
    add("{\"cycle\": %" PRIu64, cycle);
    for (i = 0; i < outputs_count; i++) {
        add(", \"%s\": ", outputs_of[i].name);
        write_value(&outputs_of[i], got(outputs, i));
    }
    if (end != NULL) {
        add(", \"end\": ");
        write_text(end);
    }
    add("}\n");
}

typedef struct {
    char text[LINE];
    size_t used;
    bool skipping;
    bool over;
} reader;

/* `wait` for a line, or take what is there, at most LINE bytes of it: who writes much delays no cycle. Whether a line
   was taken. */
static bool take(reader *from, NAME_inputs *inputs, bool wait)
{
    bool taken = false;
    size_t left = LINE;
    while (!from->over && !stopping) {
        struct pollfd ready;
        char *end = memchr(from->text, '\n', from->used);
        if (end != NULL) {
            size_t size = (size_t)(end - from->text) + 1;
            const char *wrong;
            *end = '\0';
            wrong = from->skipping ? "more than 4095 characters"
                : strlen(from->text) < size - 1 ? "a byte of zero"
                : read_line(from->text, inputs);
            if (wrong != NULL) {
                char told[96];
                const int length = snprintf(told, sizeof told, "refused: %s\n", wrong);
                (void)put_bytes(STDERR_FILENO, told, (size_t)length, 0);
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
        if (left == 0) {
            break;
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
            const size_t room = LINE - from->used;
            ssize_t count = read(STDIN_FILENO, from->text + from->used, wait || room < left ? room : left);
            if (count > 0) {
                from->used += (size_t)count;
                left -= wait ? 0 : (size_t)count;
            } else if (count == 0 && from->used > 0) {
                from->text[from->used++] = '\n';
            } else if (count == 0 || errno != EINTR) {
                from->over = true;
            }
        }
    }
    return taken;
}

/* NAME=VALUE of an input that never changes; what is wrong, or NULL. */
static const char *set(const char *word, NAME_state *state)
{
    const char *equal = strchr(word, '=');
    const char *end = NULL;
    number value;
    size_t i;
    size_t label;
    for (i = 0; equal != NULL && i < free_count; i++) {
        const kind *of = &free_of[i];
        if (!same(of->name, word, (size_t)(equal - word))) {
            continue;
        }
        value.negative = false;
        for (label = 0; label < of->count; label++) {
            if (strcmp(of->labels[label], equal + 1) == 0) {
                value.size = label;
                end = "";
            }
        }
        end = of->count > 0 ? end : read_value(equal + 1, of, &value);
        if (end == NULL || *end != '\0') {
            return "no value of the input";
        }
        store(state, i, value);
        return NULL;
    }
    return "no input of this name that never changes and has no `init`";
}

typedef struct {
    char **words;
    int count;
    reader from;
    NAME_outputs shown;
    bool begun;
@monitors     NAME_verdict told[NAME_PROPERTIES];
@monitors     bool violated;
    bool lines;
} program;

static void set_inputs(void *context, NAME_state *state)
{
    const program *p = context;
    int i;
    for (i = 1; i < p->count; i++) {
        if (strcmp(p->words[i - 1], "--set") == 0) {
            (void)set(p->words[i], state);
        }
    }
}

static bool take_inputs(void *context, NAME_inputs *inputs)
{
    program *p = context;
    return take(&p->from, inputs, p->lines) || !p->lines;
}

@monitors /* Those that are new. */
@monitors static void write_verdicts(program *p, const NAME_report *report)
@monitors {
@monitors     size_t i;
@monitors     for (i = 0; i < NAME_PROPERTIES; i++) {
@monitors         const NAME_verdict verdict = NAME_monitors_verdict(report->monitors, (NAME_property)i);
@monitors         if (verdict != p->told[i]) {
@monitors             p->told[i] = verdict;
@monitors             p->violated = p->violated || verdict == NAME_VIOLATED;
@monitors             add("{\"cycle\": %" PRIu64 ", \"property\": \"%s\", \"verdict\": \"%s\", \"step\": %" PRIu64 "}\n",
@monitors                 report->cycles, properties[i], verdict == NAME_VIOLATED ? "violated" : "satisfied",
@monitors                 step_of(report, i));
@monitors         }
@monitors     }
@monitors }
@monitors 
/* Where a reader is slow, no cycle waits for it: outputs that find no room are left out, and the newest ones are shown
   when there is some. With `--lines` a cycle waits. The last line waits a second. */
static bool show_outputs(void *context, const NAME_outputs *outputs, const NAME_report *report)
{
    program *p = context;
    const bool over = report->ending != NAME_END_RUNNING;
    const bool read = send_lines(0, over);
    const bool room = unsent.used == 0;
@monitors     write_verdicts(p, report);
    if (over || (room && (p->lines || !p->begun || differ(outputs, &p->shown)))) {
        write_line(outputs, report->cycles, over ? report->why : NULL);
        p->shown = *outputs;
        p->begun = true;
    }
    return send_lines(over ? 10 : p->lines ? UINT_MAX : 0, over) && read;
}

static void show_report(const NAME_report *report, const NAME_options *options)
{
    struct pollfd ready;
    ready.fd = STDERR_FILENO;
    ready.events = POLLOUT;
    if (poll(&ready, 1, 1000) <= 0) {
        return;
    }
    if (unsent.used > 0) {
        fprintf(stderr, "nobody has read the last lines of standard output\n");
    }
    if (unsent.failed != 0) {
        fprintf(stderr, "standard output cannot be written: %s\n", strerror(unsent.failed));
    }
    if (!options->at_once) {
        fprintf(stderr, "{\"cycles\": %" PRIu64 ", \"ringlets\": %" PRIu64 ", \"late_ns\": {", report->cycles,
            report->ringlets);
        fprintf(stderr, "\"50 %%\": %" PRId64 ", \"99 %%\": %" PRId64 ", \"99.9 %%\": %" PRId64 ", \"worst\": %" PRId64
            "}, \"overruns\": %" PRIu64 ", \"moved_ns\": %" PRId64 "}\n", NAME_percentile(report, 500),
            NAME_percentile(report, 990), NAME_percentile(report, 999), report->worst, report->overruns,
            report->moved);
    }
    if (report->unrecorded != 0) {
        fprintf(stderr, "%s: the recording ended before the run, after %" PRIu64 " frames: %s\n", options->record,
            report->frames, strerror(report->unrecorded));
    } else if (options->record != NULL) {
        fprintf(stderr, "recorded: %s (%" PRIu64 " frames)\n", options->record, report->frames);
    }
}

static int usage(void)
{
    fprintf(stderr, "usage: NAME [--lines] [--strict] [--cycles N] [--set INPUT=VALUE] [--record FILE]\n"
                    "--lines: a cycle for each line of standard input, without waiting\n"
                    "--strict: end where a cycle is late by a period\n"
@monitors                     "          or a property is violated\n"
                    "--cycles N: end after so many\n"
                    "--set INPUT=VALUE: of an input that never changes; may be repeated\n"
                    "--record FILE: write what happens to a new file, for llfsm replay and llfsm check-recording\n");
    return 2;
}

/* A number of cycles; 0: it is none. */
static uint64_t count_of(const char *word)
{
    uint64_t found = 0;
    for (; *word >= '0' && *word <= '9'; word++) {
        if (!shifted(&found, (unsigned)(*word - '0'))) {
            return 0;
        }
    }
    return *word == '\0' ? found : 0;
}

/* A standard file that is closed becomes /dev/null: no other file is to be opened in its place. */
static bool open_files(void)
{
    int file;
    for (file = STDIN_FILENO; file <= STDERR_FILENO; file++) {
        if (fcntl(file, F_GETFD) < 0 && open("/dev/null", O_RDWR) != file) {
            return false;
        }
    }
    return true;
}

int main(int count, char **words)
{
    static program context;
    static NAME_report report;
    NAME_calls calls;
    NAME_options options;
    struct sigaction action;
    int error;
    int i;
    if (!open_files()) {
        fprintf(stderr, "/dev/null: %s\n", strerror(errno));
        return 3;
    }
    memset(&options, 0, sizeof options);
    options.stop = &stopping;
    for (i = 1; i < count; i++) {
        const bool more = i + 1 < count;
        if (strcmp(words[i], "--lines") == 0) {
            options.at_once = true;
        } else if (strcmp(words[i], "--strict") == 0) {
            options.strict = true;
        } else if (more && strcmp(words[i], "--record") == 0) {
            options.record = words[++i];
        } else if (more && strcmp(words[i], "--set") == 0) {
            static NAME_state scratch;
            const char *wrong = set(words[++i], &scratch);
            if (wrong != NULL) {
                fprintf(stderr, "--set %s: %s\n", words[i], wrong);
                return 2;
            }
        } else if (more && strcmp(words[i], "--cycles") == 0 && count_of(words[i + 1]) != 0) {
            options.cycles = count_of(words[++i]);
        } else {
            return usage();
        }
    }
    context.words = words;
    context.count = count;
    context.lines = options.at_once;
    calls.context = &context;
    calls.read = take_inputs;
    calls.write = show_outputs;
    calls.fault = NULL;
    calls.begin = set_inputs;
    memset(&action, 0, sizeof action);
    action.sa_handler = stop;
    sigaction(SIGTERM, &action, NULL);
    sigaction(SIGINT, &action, NULL);
    sigaction(SIGHUP, &action, NULL);
    action.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &action, NULL);
    sigaction(SIGXFSZ, &action, NULL); /* a recording may reach the largest size of files */
    error = NAME_run(&calls, &options, &report);
    if (error == -1) {
        fprintf(stderr, "NAME.c and NAME_loop.c are of different builds\n");
        return 3;
    }
    if (error != 0) {
        fprintf(stderr, "%s: %s\n", options.record != NULL ? options.record : "NAME",
            error == EEXIST ? "a file is there already; name a new one" : strerror(error));
        return 3;
    }
    show_report(&report, &options);
@monitors     if (context.violated) {
@monitors         return 1;
@monitors     }
    return unsent.used > 0 || unsent.failed != 0 || report.unrecorded != 0 || report.ending > NAME_END_STOPPED ? 1 : 0;
}
