"""`--for posix`: a program around an image, with inputs and outputs as lines of JSON."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from importlib import resources

from llfsm_verify.program.program import Int, Type
from llfsm_verify.semantics.operators import OPERATOR
from llfsm_verify.targets.c99.blocks import comment
from llfsm_verify.targets.c99.image import MARK, Image
from llfsm_verify.targets.c99.numbers import stored_as
from llfsm_verify.targets.target import Made, Wanted
from llfsm_verify.values import element_names

_HEAD = """\
#define _POSIX_C_SOURCE 200809L
#include "NAME.h"

#include <errno.h>
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

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


def posix(image: Image, _wanted: Wanted, /) -> Made:
    """See `World`."""
    p = image.prefix
    made = {f"{p}_main.c": program(image), "README.md": readme(image)}
    return Made(made, (f"Compile it: cc -std=c99 -O2 {p}.c {p}_main.c -o {p}",))


def program(image: Image) -> str:
    """NAME_main.c."""
    text = resources.files(__package__).joinpath("posix.c").read_text(encoding="utf-8")
    head, body = (part.replace("NAME", image.prefix) for part in (_HEAD, text))
    return "\n".join([comment(f"{image.program.name}. {MARK}"), head, *_tables(image), body])


def readme(image: Image) -> str:
    """How to compile and to use it."""
    p = image.prefix
    return f"""# {image.program.name}. {MARK}

    cc -std=c99 -O2 {p}.c {p}_main.c -o {p}

`./{p}` runs a cycle in each period. Its standard input takes values of inputs, such as `{{"NAME": VALUE}}`, one object
a line; they hold until the next. It prints an object where outputs have changed. On SIGTERM and SIGINT, after a fault,
and with `--strict` where a cycle is late by a period, outputs get their safe values, which are printed with the reason.
`./{p} --lines` runs a cycle for each line that it reads, and prints each.
"""


def _tables(image: Image) -> Iterator[str]:
    names, choices = image.names, image.program.choices
    outputs = [(element, field, at) for field in names.fields.values() if field.group == "outputs"
               for at, element in enumerate(element_names(field.var))]  # fmt: skip
    labelled = {c.labels for c in choices if c.labels} | {f.var.origin.labels for _, f, _ in outputs}
    numbered = {labels: f"labels_{i}" for i, labels in enumerate(sorted(labelled - {()}))}
    for labels, name in numbered.items():
        yield f"static const char *const {name}[] = {{{', '.join(map(json.dumps, labels))}}};"
    inputs = [_kind(c.name, c.type, c.labels, numbered) for c in choices]
    yield from _described("inputs", inputs)
    found = [_kind(element, f.var.type, f.var.origin.labels, numbered) for element, f, _ in outputs]
    yield from _described("outputs", found)
    told = [f"{'' if s.span is None else f'{s.span}: '}{s.code} {s.message}" for s in image.program.faults]
    quoted = [json.dumps(json.dumps(text)[1:-1]) for text in told]
    yield f"static const char *const faults[] = {{\n{_rows(quoted or ['NULL'])}\n}};\n"
    p = image.prefix
    yield f"static void put({p}_inputs *inputs, size_t which, number value)\n{{\n    switch (which) {{"
    for number, choice in enumerate(choices):
        yield _case(number, f"inputs->{names.inputs[choice.name]} = {_from_number(choice.type)};")
    yield "    default:\n        (void)inputs;\n        (void)value;\n        break;\n    }\n}\n"
    commands = [names.inputs[c.name] for c in choices if c.name.startswith(OPERATOR) and c.type.boolean]
    cleared = [f"    inputs->{name} = false;" for name in commands] or ["    (void)inputs;"]
    yield "\n".join([f"static void clear_commands({p}_inputs *inputs)\n{{", *cleared, "}\n"])
    yield f"static number got(const {p}_state *state, size_t which)\n{{"
    yield "    number found = {false, 0};\n    switch (which) {"
    for number, (_, field, at) in enumerate(outputs):
        path = f"state->{field.path}" + ("" if field.var.length is None else f"[{at}]")
        signed = not isinstance(field.var.type, Int) or field.var.type.low < 0
        lines = [f"found.negative = {path} < 0;"] if signed else []
        size = f"found.negative ? (uint64_t)(-({path} + 1)) + 1u : (uint64_t){path}" if signed else f"(uint64_t){path}"
        yield _case(number, *lines, f"found.size = {size};")
    yield "    default:\n        (void)state;\n        break;\n    }\n    return found;\n}\n"
    yield f"static bool differ(const {p}_state *a, const {p}_state *b)\n{{\n    size_t i;"
    yield "    for (i = 0; i < outputs_count; i++) {\n        number x = got(a, i);\n        number y = got(b, i);"
    yield "        if (x.size != y.size || x.negative != y.negative) {\n            return true;\n        }\n    }"
    yield "    return false;\n}\n"


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
    return f"{{{json.dumps(name)}, {digits}, {'true' if truth else 'false'}, {named}, {low}, {high}}}"


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
