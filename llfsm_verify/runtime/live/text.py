"""The LLVM text of the loop that runs an arrangement: `@live`, beside the functions of its step program.

It calls nothing of the system but `clock_gettime`, `clock_nanosleep` and, where somebody wants to be woken, `sendto`
that does not wait, so it needs no lock of Python's and nothing of Python can delay it.

Turn k is due at base + k * period. It begins no sooner than the turn before it plus a period less the jitter. A turn
that is late by a period or more moves the base, so missed turns are not caught up in a burst.
"""

from __future__ import annotations

from llfsm_verify.backends.native.code import EVENT_KINDS, FunctionText
from llfsm_verify.backends.native.context import WORDS, ContextLayout
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.backends.native.loops import fill, llvm_source
from llfsm_verify.program.program import Program
from llfsm_verify.runtime.live import control, frame, generations
from llfsm_verify.runtime.live.frame import COUNTED, FrameLayout
from llfsm_verify.runtime.stepping.visited import state_places

CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1
MSG_DONTWAIT, MSG_NOSIGNAL = 0x40, 0x4000
NAP = 50_000_000
"""Nanoseconds that the loop sleeps at most before it looks whether it is told to stop."""
CHECK_BYTES = 4
"""Of the checksum after each entry of a recording."""
MULTIPLIER = 0x9E3779B97F4A7C15
"""Of the checksums: 2^64 by the golden ratio (D. Knuth, The Art of Computer Programming 3, 6.4), an odd number."""


def live_text(native: NativeProgram, frames: FrameLayout, context: ContextLayout, *, monitors: bool) -> str:
    """The module's text but for the program's own. With `monitors`, it wants `@monitors` (monitoring.code)."""
    program, layout = native.program, native.layout
    numbers = {
        "RECORD": layout.record_bytes, "PROCESSES": len(program.processes), "SAVED": context.saved,
        "DEFAULTS": context.defaults, "TABLE": context.events, "CHOICES": len(program.choices),
        "SLOTS": len(program.slots), "FRAME": frames.words, "AT.RECORD": frames.record, "AT.FIRED": frames.fired,
        "AT.CHOICES": frames.choices, "AT.EVENTS": frames.events, "AT.MONITORS": frames.monitors,
        "MONITORS": frames.words - frames.monitors, "LARGEST": largest_entry(program, frames),
    }  # fmt: skip
    numbers |= {name: number for name, number in vars(control).items() if isinstance(number, int)}
    numbers |= {f"H.{name}": number for name, number in vars(frame).items() if isinstance(number, int)}
    numbers |= WORDS | {
        "CLOCK_MONOTONIC": CLOCK_MONOTONIC, "TIMER_ABSTIME": TIMER_ABSTIME, "NAP": NAP, "CHECK_BYTES": CHECK_BYTES,
        "MULTIPLIER": MULTIPLIER, "WITHOUT_WAITING": MSG_DONTWAIT | MSG_NOSIGNAL, "NEWEST": generations.NEWEST,
        "COUNTED": len(COUNTED),
    }  # fmt: skip
    loop = llvm_source("llfsm_verify.runtime.live", "loop.ll")
    own = [_reader(native, "ran", program.ran), _reader(native, "fired", program.fired), _visits(native)]
    watched = _WATCHED if monitors else _UNWATCHED
    shown = "true" if program.observe == "ringlet" else "%complete"
    return fill(
        "\n".join([*own, _counted(), watched.replace("<SHOWN>", shown), loop, generations.llvm_text()]), numbers
    )


def largest_entry(program: Program, frames: FrameLayout) -> int:
    """Bytes that one turn can take in a recording: prescribed choices, every word of the frame, and the checksum, which
    is computed over whole words."""
    return 2 + 30 * largest_script(program) + 20 * frames.words + CHECK_BYTES + 8


def largest_script(program: Program) -> int:
    """How many choices can be prescribed within a turn: each one before each ringlet, of which there is one a slot."""
    return len(program.choices) * len(program.slots)


def _reader(native: NativeProgram, name: str, output: str) -> str:
    """A function of that name, which reads an output of a record."""
    writer = FunctionText(native.layout, {}, ())
    writer.line(f"ret i64 {writer.number(writer.load(output))}")
    return f"define internal i64 @{name}(ptr noalias %r, ptr noalias %c) #1 {writer.text()}"


def _visits(native: NativeProgram) -> str:
    """A function that writes down in which state each machine is, a word for each state of each machine."""
    writer = FunctionText(native.layout, {}, ())
    for name, begin in state_places(native.program):
        place = writer.name(f"add i64 {writer.number(writer.load(name))}, {begin}")
        writer.line(f"store i64 1, ptr {writer.name(f'getelementptr i64, ptr %v, i64 {place}')}")
    writer.line("ret void")
    return f"define internal void @visits(ptr noalias %r, ptr noalias %c, ptr noalias %v) #1 {writer.text()}"


def _counted() -> str:
    """The place among the counters of each kind of event; `len(COUNTED)`: none."""
    places = [COUNTED.index(kind) if kind in COUNTED else len(COUNTED) for kind in EVENT_KINDS]
    return f"@counted = internal constant [{len(places)} x i64] [{', '.join(f'i64 {p}' for p in places)}]"


_UNWATCHED = """\
define internal i1 @watch(ptr %r, ptr %t, i1 %complete) #1 {
  ret i1 false
}"""
_WATCHED = """\
define internal i1 @watch(ptr %r, ptr %t, i1 %complete) #1 {
  br i1 <SHOWN>, label %read, label %out
read:
  %states.p = getelementptr i64, ptr %t, i64 <STATES>
  %states = load ptr, ptr %states.p
  %new = call i1 @monitors(ptr %r, ptr %states)
  ret i1 %new
out:
  ret i1 false
}"""
