"""`--for posix`: a program around an image, with inputs and outputs as lines of JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence

from llfsm_verify.extensions.c.blocks import comment, titled
from llfsm_verify.extensions.c.image import MARK, Image
from llfsm_verify.extensions.c.loop import fault_texts, free_fields, loop_files, quoted, text_of
from llfsm_verify.extensions.c.numbers import stored_as
from llfsm_verify.extensions.c.worlds import World
from llfsm_verify.plug import Int, Made, Type, element_names, header_of, value_text
from llfsm_verify.plug import TargetWanted as Wanted

_HEAD = """\
#define _POSIX_C_SOURCE 200809L
#include "NAME_loop.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <limits.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#ifndef PIPE_BUF
#define PIPE_BUF 512 /* POSIX has no smaller one */
#endif
#define UNSENT ROOM

typedef struct {
    bool negative;
    uint64_t size;
} number;

typedef struct {
    const char *name;
    uint8_t digits;
    bool truth;
    const char *const *labels;
    size_t count;
    number low;
    number high;
} kind;
"""


_README = """\
    make            # the program `NAME` and the library `libNAME.so`
    make lib        # the library alone

A cycle takes PERIOD ms. One that begins late by a cycle or more moves all later ones, so that none is made up for in a
burst.

## The program

    ./NAME

Its standard input takes values of inputs, such as `SHOWN`, one object a line; they hold until the next. A
cycle takes at most 4096 bytes of it. It prints an object where outputs have changed. No cycle waits for who reads that:
where a pipe is full, the line that it does not take waits, later ones are left out, and the newest outputs are printed
once there is room (with `--lines` a cycle waits). The program ends where its reader closes it (exit code 0) or it
cannot be written (1). A standard file that is closed from the beginning is as `/dev/null`.

On SIGTERM, SIGINT and SIGHUP, and after a fault, outputs get their safe values, which are printed with the reason. They
wait a second for room. Standard error then says how late cycles began, in nanoseconds.

    ./NAME --strict             # a cycle that is late by a whole one ends it, with safe values; exit code 1
    ./NAME --cycles 6000        # end after so many
    ./NAME --lines              # a cycle for each line that it reads, without waiting
    ./NAME --set INPUT=VALUE    # an input that never changes and has no `init`; else its first value
    ./NAME --record monday      # what happens, in a new file; it is complete up to the last cycle, also after a kill

Where the recording is, with the arrangement that it was made of in it:

    llfsm replay monday                         # the same, bit for bit, by the executor
    llfsm check-recording monday -p 'FORMULA'   # properties, decided on it
    llfsm trace monday --to csv                 # a row for each frame; --to vcd, svg and others

Exit codes: 0 finished or stopped, 1 a fault, a late cycle (`--strict`), last lines that nobody took, outputs that
cannot be written, or a recording that ended before the run, 2 wrong usage, 3 a recording that cannot be begun.

## The library

`NAME_loop.h` says what `NAME_run` calls: `read` before a cycle, `write` after it, `fault`.

    cc -std=c99 yours.c NAME.c NAME_loop.c -o yours
    cc -std=c99 yours.c -L. -lNAME -Wl,-rpath,. -o yours
"""
_MONITORED = """
## Monitors

Each verdict of a property is an object as well, with the step that decided it: a ringlet, as `llfsm check-recording`
counts them. Where one is violated, the exit code is 1, and `--strict` ends with safe values.
"""


def posix(image: Image, wanted: Wanted, /) -> Made:
    """See `World`."""
    p = image.prefix
    source = image.meaning.arrangement
    header = {} if source is None else header_of(wanted.sources, source, simulated=False, seed=None, free={})
    files = loop_files(image, header)
    made = {**files, f"{p}_main.c": program(image), "Makefile": makefile(image), "README.md": readme(image)}
    return Made(made, ("Compile it with make; README.md says how to run it.",))


POSIX = World(posix, counts=True)


def program(image: Image) -> str:
    """NAME_main.c."""
    head, body = _HEAD.replace("NAME", image.prefix).replace("ROOM", str(_room(image))), text_of("posix.c", image)
    return "\n".join([comment(titled(image.program.name, MARK)), head, *_properties(image), *_tables(image), body])


def makefile(image: Image) -> str:
    """What compiles the program and the library."""
    p = image.prefix
    program = f"{p}_program" if p in ("all", "lib", "clean") else p
    monitors = "" if image.monitors is None else f" {p}_monitors"
    both = f"{p}.c {p}_loop.c{monitors}{'.c' * bool(monitors)}"
    headers = f"{p}.h {p}_loop.h{monitors}{'.h' * bool(monitors)}"
    return f"""# {titled(image.program.name, MARK)}
CFLAGS = -O2
STRICT = -std=c99 -Wall -Wextra -Wpedantic -Wconversion

.PHONY: all lib clean
all: {program} lib
lib: lib{p}.so

{program}: {both} {p}_main.c {headers}
\t$(CC) $(STRICT) $(CFLAGS) {both} {p}_main.c -o $@

lib{p}.so: {both} {headers}
\t$(CC) $(STRICT) $(CFLAGS) -fPIC -shared {both} -o $@

clean:
\trm -f {program} lib{p}.so
"""


def readme(image: Image) -> str:
    """How to compile and to use it."""
    p = image.prefix
    period = f"{float(image.program.period or 0):g}"
    shown = "{}"
    for choice in image.program.choices[:1]:
        value = value_text(choice.type, choice.labels, choice.type.high)
        shown = f'{{"{choice.name}": {json.dumps(value) if choice.labels else value}}}'
    readme = _README + ("" if image.monitors is None else _MONITORED)
    text = readme.replace("NAME", p).replace("SHOWN", shown).replace("PERIOD", period)
    return f"# {titled(image.program.name, MARK)}\n\n{text}"


def _tables(image: Image) -> Iterator[str]:
    names, choices = image.names, image.program.choices
    outputs = [(element, field, at) for field in names.fields.values() if field.group == "outputs"
               for at, element in enumerate(element_names(field.var))]  # fmt: skip
    labelled = {c.labels for c in choices if c.labels} | {f.var.origin.labels for _, f, _ in outputs}
    labelled |= {field.var.origin.labels for field in free_fields(image)}
    numbered = {labels: f"labels_{i}" for i, labels in enumerate(sorted(labelled - {()}))}
    for labels, name in numbered.items():
        yield f"static const char *const {name}[] = {{{', '.join(map(quoted, labels))}}};"
    inputs = [_kind(c.name, c.type, c.labels, numbered) for c in choices]
    yield from _described("inputs", inputs)
    found = [_kind(element, f.var.type, f.var.origin.labels, numbered) for element, f, _ in outputs]
    yield from _described("outputs", found)
    p = image.prefix
    yield f"static void put({p}_inputs *inputs, size_t which, number value)\n{{\n    switch (which) {{"
    for number, choice in enumerate(choices):
        yield _case(number, f"inputs->{names.inputs[choice.name]} = {_from_number(choice.type)};")
    yield "    default:\n        (void)inputs;\n        (void)value;\n        break;\n    }\n}\n"
    never = free_fields(image)
    yield from _described("free", [_kind(f.var.name, f.var.type, f.var.origin.labels, numbered) for f in never])
    yield f"static void store({p}_state *state, size_t which, number value)\n{{\n    switch (which) {{"
    for number, field in enumerate(never):
        assert isinstance(field.var.type, Int)
        yield _case(number, f"state->{field.path} = {_from_number(field.var.type)};")
    yield "    default:\n        (void)state;\n        (void)value;\n        break;\n    }\n}\n"
    yield f"static number got(const {p}_outputs *outputs, size_t which)\n{{"
    yield "    number found = {false, 0};\n    switch (which) {"
    for number, (_, field, at) in enumerate(outputs):
        path = f"outputs->{field.name}" + ("" if field.var.length is None else f"[{at}]")
        signed = not isinstance(field.var.type, Int) or field.var.type.low < 0
        lines = [f"found.negative = {path} < 0;"] if signed else []
        size = f"found.negative ? (uint64_t)(-({path} + 1)) + 1u : (uint64_t){path}" if signed else f"(uint64_t){path}"
        yield _case(number, *lines, f"found.size = {size};")
    yield "    default:\n        (void)outputs;\n        break;\n    }\n    return found;\n}\n"
    yield f"static bool differ(const {p}_outputs *a, const {p}_outputs *b)\n{{\n    size_t i;"
    yield "    for (i = 0; i < outputs_count; i++) {\n        number x = got(a, i);\n        number y = got(b, i);"
    yield "        if (x.size != y.size || x.negative != y.negative) {\n            return true;\n        }\n    }"
    yield "    return false;\n}\n"


def _room(image: Image) -> int:
    """Bytes of all lines with verdicts, a line of outputs, and the last one."""
    line = 64
    for field in image.names.fields.values():
        widest = max((len(label.encode()) for label in field.var.origin.labels), default=0)
        for element in element_names(field.var) if field.group == "outputs" else ():
            line += len(element.encode()) + max(widest, 24) + 8
    ends = max((6 * len(text.encode("utf-8", "backslashreplace")) for text in fault_texts(image.program)), default=0)
    walks = () if image.monitors is None else image.monitors.walks
    return 2 * line + ends + sum(128 + len(quoted(walk.of.line.name)) for walk in walks)


def _properties(image: Image) -> Iterator[str]:
    if image.monitors is not None:
        names = ",\n".join(f"    {quoted(walk.of.line.name)}" for walk in image.monitors.walks)
        yield f"static const char *const properties[] = {{\n{names}\n}};\n"
        ringlet, read = "report->monitors->decided[which]", ""
        if image.program.observe == "cycle":
            ringlet, read = f"{ringlet} == 0 ? 0 : report->ringlets", ", of which the last one in a cycle is read"
        yield comment(f"The ringlet that decided a property in this cycle{read}; 0: the beginning did.")
        yield f"static uint64_t step_of(const {image.prefix}_report *report, size_t which)"
        yield f"{{\n    return {ringlet};\n}}\n"


def _described(what: str, rows: Sequence[str]) -> Iterator[str]:
    yield f"static const size_t {what}_count = {len(rows)};"
    yield f"static const kind {what}_of[] = {{\n{_rows(rows)}\n}};\n"


def _rows(rows: Sequence[str]) -> str:
    return ",\n".join(f"    {row}" for row in rows or ['{"", 0, false, NULL, 0, {false, 0}, {false, 0}}'])


def _kind(name: str, kind: Type, labels: tuple[str, ...], numbered: dict[tuple[str, ...], str]) -> str:
    """The row of an input or output."""
    bounds = (kind.low, kind.high) if isinstance(kind, Int) else (-(1 << 63), (1 << 63) - 1)
    low, high = (f"{{{'true' if n < 0 else 'false'}, UINT64_C({abs(n)})}}" for n in bounds)
    digits, truth = (kind.digits, kind.boolean) if isinstance(kind, Int) else (0, False)
    named = f"{numbered[labels]}, {len(labels)}" if labels else "NULL, 0"
    return f"{{{quoted(name)}, {digits}, {'true' if truth else 'false'}, {named}, {low}, {high}}}"


def _case(number: int, *lines: str) -> str:
    return "\n".join([f"    case {number}:", *(f"        {line}" for line in lines), "        break;"])


def _from_number(kind: Int) -> str:
    """The value of an input, which is inside its range."""
    if kind.boolean:
        return "value.size != 0"
    of = stored_as(kind)
    if kind.low >= 0:
        return f"({of})value.size"
    return f"({of})(value.negative ? -(int64_t)(value.size - 1u) - 1 : (int64_t)value.size)"
