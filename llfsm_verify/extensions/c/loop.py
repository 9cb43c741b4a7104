"""The loop of `--for posix`: cycles at their times, call-backs, and a recording as `llfsm run --record` writes it.

    $ llfsm build models/lift/arrangement.yaml --target c --for posix --output lift && make -C lift
    $ lift/lift --cycles 60 --record monday < calls.jsonl
    $ llfsm replay monday

What goes wrong:

    monday: a file is there already; name a new one
    monday: the recording ended before the run, after 4211 frames: No space left on device
    monday: differs: frame 17: word 0 of the record is 5, and was 4
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator
from importlib import resources

from llfsm_verify.extensions.c.blocks import comment, titled
from llfsm_verify.extensions.c.image import MARK, Image
from llfsm_verify.extensions.c.names import Field
from llfsm_verify.extensions.c.numbers import unsigned64
from llfsm_verify.plug import FRAME_HEADER, OPERATOR, BitField, FrameLayout, Json, Layout, Program, largest_entry
from llfsm_verify.plug import RECORDING_HEAD as HEAD
from llfsm_verify.plug import RECORDING_MAGIC as MAGIC
from llfsm_verify.plug import RECORDING_PAGE as PAGE

_HEAD = """\
#define _POSIX_C_SOURCE 200809L
#define _DEFAULT_SOURCE /* flock */
#define _FILE_OFFSET_BITS 64
#include "NAME_loop.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>
"""
PIECE = 96
"""Characters of a line of the header."""


def loop_files(image: Image, header: dict[str, Json]) -> dict[str, str]:
    """NAME_loop.h and NAME_loop.c. `header`: that of its recordings (`runtime.recording.origin.header_of`)."""
    p = image.prefix
    first = comment(titled(image.program.name, MARK))
    head = text_of("loop.h", image).replace("GUARD", p.upper())
    if all(field.group != "outputs" for field in image.names.fields.values()):
        head = head.replace(
            "typedef enum {", f"typedef struct {{\n    uint8_t none;\n}} {p}_outputs;\n\ntypedef enum {{", 1
        )
    body = [_HEAD.replace("NAME", p), *_numbers(image, header), *_functions(image), text_of("loop.c", image)]
    return {f"{p}_loop.h": f"{first}\n{head}", f"{p}_loop.c": "\n".join([first, *body])}


def quoted(text: str) -> str:
    """A string of C without trigraphs: three octal digits for each byte of UTF-8 that is not printable ASCII."""
    bytes_of = text.encode(errors="backslashreplace")
    plain = "".join(chr(n) if 32 <= n < 127 and n not in b'"\\' else rf"\{n:03o}" for n in bytes_of)
    return re.sub("[?](?=[?])", '?""', f'"{plain}"')


def text_of(name: str, image: Image) -> str:
    """A text of this folder, with the lines for monitors where there are some."""
    text = resources.files(__package__).joinpath(name).read_text(encoding="utf-8")
    text = re.sub(r"^@monitors (.*\n)", r"\1" if image.monitors is not None else "", text, flags=re.MULTILINE)
    return text.replace("NAME", image.prefix)


def _numbers(image: Image, header: dict[str, Json]) -> Iterator[str]:
    """Where things are in a frame and in the file, and the texts."""
    program = image.recorded
    frames = FrameLayout.of(program, Layout.of(program))
    build: Json = {"target": "c", "for": "posix", "layout": f"0x{image.layout():08x}"}
    known = {key: value for key, value in header.items() if key != "free"}
    line = json.dumps({**known, "words": frames.words, "build": build})[:-1] + ', "free": {'
    rest = sum(len(json.dumps(field.var.name)) + 24 for field in free_fields(image)) + len("}}\n")
    begin = -(-(len(MAGIC) + len(line) + rest) // PAGE) * PAGE
    yield comment("A frame: words of 64 bits before the record, and where its parts begin.")
    yield "enum {\n" + ",\n".join(f"    {name} = {place}" for name, place in FRAME_HEADER.items()) + "\n};"
    parts = {"RECORD": frames.record, "FIRED": frames.fired, "CHOICES": frames.choices, "EVENTS": frames.events}
    for name, number in {**parts, "WORDS": frames.words, "LARGEST": largest_entry(program, frames)}.items():
        yield f"#define {name} {number}"
    yield comment("Bytes of a recording before its entries, those of its header after this text, and its CRC-32.")
    yield f"#define BEGIN UINT64_C({begin + HEAD})\n#define HEADER_END {begin - len(MAGIC) - len(line)}"
    yield f"#define HEADER_CHECK UINT32_C({zlib.crc32(MAGIC + line.encode())})"
    yield f"static const char *const header[] = {{\n    {quoted(MAGIC.decode())},"
    yield "\n".join(f"    {quoted(line[at : at + PIECE])}," for at in range(0, len(line), PIECE)) + "\n};\n"
    texts = ",\n".join(f"    {quoted(text)}" for text in fault_texts(program)) or '    ""'
    yield f"static const char *const faults[] = {{\n{texts}\n}};\n"


def _functions(image: Image) -> Iterator[str]:
    """What reads states and inputs."""
    names, program, p = image.names, image.recorded, image.prefix
    fields = Layout.of(program).fields
    state, ran, fired, cycle = (f"const {p}_state *state", *(names.fields[n].path for n in
                                (program.ran, program.fired, program.cycle)))  # fmt: skip
    words = max((f.place(f.elements - 1)[0] for f in fields.values() if f.bits), default=-1) + 1
    lines = [line for name, field in fields.items() for line in _packed(field, f"state->{names.fields[name].path}")]
    counter = ["size_t i;"] * any("for (i" in line for line in lines)
    clear = [f"memset(words, 0, {words} * sizeof words[0]);"] if words else ["(void)state;", "(void)words;"]
    yield _function(f"size_t put_free({state}, char *text, size_t size)", *_free(image))
    yield comment("The variables as the executor packs them.")
    yield _function(f"void put_record({state}, uint64_t *words)", *counter, *clear, *lines)
    yield _function(
        f"void put_fired({state}, uint64_t *words)",
        f"if (state->{ran} != 0) {{", f"    words[state->{ran} - 1] = (uint64_t)state->{fired};", "}",
    )  # fmt: skip
    yield _function(f"bool cycle_over({state})", f"return state->{cycle} != 0;")
    given = [f"words[{i}] = (uint64_t)inputs->{names.inputs[c.name]};" for i, c in enumerate(program.choices)]
    unused = [] if given else ["(void)inputs;", "(void)words;"]
    yield _function(f"void put_choices(const {p}_inputs *inputs, uint64_t *words)", *unused, *given)
    commands = [names.inputs[c.name] for c in program.choices if c.name.startswith(OPERATOR) and c.type.boolean]
    cleared = [f"inputs->{name} = false;" for name in commands] or ["(void)inputs;"]
    yield _function(f"void clear_commands({p}_inputs *inputs)", *cleared)
    there = any(field.group == "outputs" for field in names.fields.values())
    own = (
        ["return &state->outputs;"]
        if there
        else [f"static const {p}_outputs none = {{0}};", "(void)state;", "return &none;"]
    )
    yield _function(f"const {p}_outputs *outputs({state})", *own)


def fault_texts(program: Program) -> list[str]:
    """What is said of each fault of a program."""
    return [f"{'' if s.span is None else f'{s.span}: '}{s.code} {s.message}" for s in program.faults]


def free_fields(image: Image) -> list[Field]:
    """The inputs that never change and have no value of their own."""
    return [field for field in image.names.fields.values() if field.var.free]


def _free(image: Image) -> Iterator[str]:
    """Lines that write the values of inputs that never change, as the end of a header."""
    fields = free_fields(image)
    yield "size_t at = 0;"
    yield from ["(void)state;"] * (not fields)
    for number, field in enumerate(fields):
        wide = field.type == "uint64_t"
        name = f"{', ' * (number > 0)}{json.dumps(field.var.name)}: %"
        value = f"({'u' * wide}int64_t)state->{field.path}"
        yield f"at += (size_t)snprintf(text + at, size - at, {quoted(name)} PRI{'u' if wide else 'd'}64, {value});"
    yield 'return at + (size_t)snprintf(text + at, size - at, "}}");'


def _packed(field: BitField, path: str) -> Iterator[str]:
    """Lines that put a variable where it lies in a record."""
    if not field.bits:
        return

    def put(word: str, value: str, shift: str) -> str:
        low = f" - {unsigned64(field.low)}" if field.low else ""
        bits = f"((uint64_t){value}{low})" if low else f"(uint64_t){value}"
        return f"words[{word}] |= {bits}{f' << {shift}' if shift != '0' else ''};"

    if field.length is None:
        yield put(str(field.word), path, str(field.shift))
        return
    each = field.per_word
    word = f"{field.word}" if each >= field.elements else f"{field.word} + i" + (f" / {each}" if each > 1 else "")
    position = f"(i % {each})" if each < field.elements else "i"
    apart = f"{field.bits} * {position}" if field.bits > 1 else position
    shift = str(field.shift) if each == 1 else f"({field.shift} + {apart})" if field.shift else f"({apart})"
    yield f"for (i = 0; i < {field.elements}; i++) {{"
    yield f"    {put(word, f'{path}[i]', shift)}"
    yield "}"


def _function(head: str, *lines: str) -> str:
    return "\n".join([f"static {head}", "{", *(f"    {line}" for line in lines), "}", ""])
