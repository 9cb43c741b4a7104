"""The LLVM text that is the same for all programs: sampling choices, and the loops over steps.

A word in angle brackets stands for a number of the program at hand (`fill`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from llfsm_verify.backends.native.context import (
    DRAWN,
    ENDED,
    EVENTS,
    PREFIX,
    PROCESS,
    RANDOM,
    SAMPLES,
    SOURCE,
    STATUS,
    STEP,
    STEPPED,
)


def fill(text: str, numbers: Mapping[str, int]) -> str:
    """The text with its words in angle brackets replaced."""
    for name, number in numbers.items():
        text = text.replace(f"<{name}>", str(number))
    return text


def emit_function(arity: int, table: int) -> str:
    """The function that notes an event with `arity` arguments; events begin at word `table` of the context."""
    parameters = "".join(f", i64 %a{i}" for i in range(3 + arity))
    stores = "".join(
        f"\n  %s{i} = getelementptr i64, ptr %at, i64 {i}\n  store i64 %a{i}, ptr %s{i}" for i in range(3 + arity)
    )
    return f"""\
define internal void @emit{arity}(ptr %c{parameters}) #1 {{
  %used = getelementptr i64, ptr %c, i64 {EVENTS}
  %n = load i64, ptr %used
  %m = add i64 %n, {3 + arity}
  store i64 %m, ptr %used
  %place = add i64 %n, {table}
  %at = getelementptr i64, ptr %c, i64 %place{stores}
  ret void
}}"""


# The value of a choice in this step: the one it was first read with; else the next prescribed one; else a random one
# (xorshift64*: S. Vigna, An experimental exploration of Marsaglia's xorshift generators, scrambled, 2016; scaled by the
# high word of a product), or its default.
# draw: the choices of a table (`runtime.stepping.drawing`) keep their values or get new ones; where %fresh all get new
# ones.
HELPERS = f"""\
define internal i64 @random(ptr %c, i64 %size) #1 {{
  %x0 = load i64, ptr %c
  %x1 = lshr i64 %x0, 12
  %x2 = xor i64 %x0, %x1
  %x3 = shl i64 %x2, 25
  %x4 = xor i64 %x2, %x3
  %x5 = lshr i64 %x4, 27
  %x6 = xor i64 %x4, %x5
  store i64 %x6, ptr %c
  %x7 = mul i64 %x6, 2685821657736338717
  %whole = icmp eq i64 %size, 0
  %wide = zext i64 %x7 to i128
  %factor = zext i64 %size to i128
  %product = mul i128 %wide, %factor
  %high = lshr i128 %product, 64
  %scaled = trunc i128 %high to i64
  %result = select i1 %whole, i64 %x7, i64 %scaled
  ret i64 %result
}}
define internal i64 @among(ptr %random, ptr %low.p, ptr %size.p) #1 {{
  %size = load i64, ptr %size.p
  %offset = call i64 @random(ptr %random, i64 %size)
  %low = load i64, ptr %low.p
  %value = add i64 %low, %offset
  ret i64 %value
}}
define internal i64 @sample(ptr %c, i64 %choice) memory(argmem: readwrite) nounwind {{
  %step.p = getelementptr i64, ptr %c, i64 {STEP}
  %step = load i64, ptr %step.p
  %stamp.i = add i64 %choice, <STAMPS>
  %stamp.p = getelementptr i64, ptr %c, i64 %stamp.i
  %stamp = load i64, ptr %stamp.p
  %value.i = add i64 %choice, <VALUES>
  %value.p = getelementptr i64, ptr %c, i64 %value.i
  %known = icmp eq i64 %stamp, %step
  br i1 %known, label %again, label %first
again:
  %old = load i64, ptr %value.p
  ret i64 %old
first:
  store i64 %step, ptr %stamp.p
  %n.p = getelementptr i64, ptr %c, i64 {SAMPLES}
  %n = load i64, ptr %n.p
  %n1 = add i64 %n, 1
  store i64 %n1, ptr %n.p
  %twice = shl i64 %n, 1
  %pair.i = add i64 %twice, <SAMPLES>
  %pair.p = getelementptr i64, ptr %c, i64 %pair.i
  %pair.v = getelementptr i64, ptr %pair.p, i64 1
  %prefix.p = getelementptr i64, ptr %c, i64 {PREFIX}
  %prefix = load i64, ptr %prefix.p
  %given = icmp ult i64 %n, %prefix
  br i1 %given, label %prescribed, label %open
prescribed:
  %told = load i64, ptr %pair.v
  br label %done
open:
  %seed = load i64, ptr %c
  %fixed = icmp eq i64 %seed, 0
  br i1 %fixed, label %default, label %free
free:
  %table.p = getelementptr i64, ptr %c, i64 {DRAWN}
  %table = load i64, ptr %table.p
  %anew = icmp eq i64 %table, 0
  br i1 %anew, label %drawn, label %default
default:
  %default.i = add i64 %choice, <DEFAULTS>
  %default.p = getelementptr i64, ptr %c, i64 %default.i
  %preset = load i64, ptr %default.p
  br label %done
drawn:
  %size.p = getelementptr i64, ptr @sizes, i64 %choice
  %low.p = getelementptr i64, ptr @lows, i64 %choice
  %random = call i64 @among(ptr %c, ptr %low.p, ptr %size.p)
  br label %done
done:
  %value = phi i64 [%told, %prescribed], [%preset, %default], [%random, %drawn]
  store i64 %choice, ptr %pair.p
  store i64 %value, ptr %pair.v
  store i64 %value, ptr %value.p
  ret i64 %value
}}
define internal void @draw(ptr %c, ptr %table, ptr %random, i1 %fresh) #1 {{
entry:
  %never = icmp eq ptr %table, null
  br i1 %never, label %out, label %loop
loop:
  %i = phi i64 [0, %entry], [%i.next, %next]
  %over = icmp uge i64 %i, <CHOICES>
  br i1 %over, label %out, label %look
look:
  %row.i = mul i64 %i, 3
  %row = getelementptr i64, ptr %table, i64 %row.i
  %like = load i64, ptr %row
  %place.i = add i64 %i, <DEFAULTS>
  %place = getelementptr i64, ptr %c, i64 %place.i
  %itself = icmp eq i64 %like, %i
  br i1 %itself, label %own, label %other
other:
  %on = icmp sge i64 %like, 0
  br i1 %on, label %copy, label %next
copy:
  %model.i = add i64 %like, <DEFAULTS>
  %model.p = getelementptr i64, ptr %c, i64 %model.i
  %model = load i64, ptr %model.p
  store i64 %model, ptr %place
  br label %next
own:
  %keep.p = getelementptr i64, ptr %row, i64 1
  %keep = load i64, ptr %keep.p
  %holds = icmp ne i64 %keep, 0
  %old = xor i1 %fresh, true
  %held = and i1 %holds, %old
  br i1 %held, label %chance, label %pick
chance:
  %luck = call i64 @random(ptr %random, i64 0)
  %stays = icmp ult i64 %luck, %keep
  br i1 %stays, label %next, label %pick
pick:
  %pieces.p = getelementptr i64, ptr %row, i64 2
  %pieces = load i64, ptr %pieces.p
  %even = icmp eq i64 %pieces, 0
  br i1 %even, label %whole, label %weigh
whole:
  %size.p = getelementptr i64, ptr @sizes, i64 %i
  %low.p = getelementptr i64, ptr @lows, i64 %i
  br label %put
weigh:
  %word = call i64 @random(ptr %random, i64 0)
  br label %piece
piece:
  %at = phi i64 [%pieces, %weigh], [%at.next, %piece]
  %at.next = add i64 %at, 3
  %until.p = getelementptr i64, ptr %table, i64 %at
  %until = load i64, ptr %until.p
  %within = icmp ule i64 %word, %until
  %from.p = getelementptr i64, ptr %until.p, i64 1
  %many.p = getelementptr i64, ptr %until.p, i64 2
  br i1 %within, label %put, label %piece
put:
  %low.at = phi ptr [%low.p, %whole], [%from.p, %piece]
  %size.at = phi ptr [%size.p, %whole], [%many.p, %piece]
  %value = call i64 @among(ptr %random, ptr %low.at, ptr %size.at)
  store i64 %value, ptr %place
  br label %next
next:
  %i.next = add i64 %i, 1
  br label %loop
out:
  ret void
}}"""

# step: one step of process %p (their number: the stutter).
# advance: the next combination of the choices that the last step read, as an odometer whose last wheel is the choice
#   read last; false when there is none.
# expand: an edge for every step from the records, from where the context says until the buffer is full; returns the
#   number of edges written. All is done when the context's SOURCE reaches the number of records.
# pick: the process that steps next in a run (their number: none is left).
LOOPS = f"""\
declare void @llvm.memcpy.p0.p0.i64(ptr noalias, ptr noalias, i64, i1)
define i32 @step(ptr noalias %r, ptr noalias %c, i64 %p) #1 {{
  %step.p = getelementptr i64, ptr %c, i64 {STEP}
  %step = load i64, ptr %step.p
  %next = add i64 %step, 1
  store i64 %next, ptr %step.p
  %samples.p = getelementptr i64, ptr %c, i64 {SAMPLES}
  store i64 0, ptr %samples.p
  %events.p = getelementptr i64, ptr %c, i64 {EVENTS}
  store i64 0, ptr %events.p
  %status = call i32 @ringlet(ptr %r, ptr %c, i64 %p)
  ret i32 %status
}}
define internal i1 @advance(ptr %c) #1 {{
entry:
  %n.p = getelementptr i64, ptr %c, i64 {SAMPLES}
  %prefix.p = getelementptr i64, ptr %c, i64 {PREFIX}
  %n = load i64, ptr %n.p
  br label %look
look:
  %i = phi i64 [%n, %entry], [%j, %wheel]
  %none = icmp eq i64 %i, 0
  br i1 %none, label %exhausted, label %wheel
wheel:
  %j = sub i64 %i, 1
  %twice = shl i64 %j, 1
  %pair.i = add i64 %twice, <SAMPLES>
  %pair.p = getelementptr i64, ptr %c, i64 %pair.i
  %pair.v = getelementptr i64, ptr %pair.p, i64 1
  %choice = load i64, ptr %pair.p
  %value = load i64, ptr %pair.v
  %high.p = getelementptr i64, ptr @highs, i64 %choice
  %high = load i64, ptr %high.p
  %room = icmp ne i64 %value, %high
  br i1 %room, label %turn, label %look
turn:
  %more = add i64 %value, 1
  store i64 %more, ptr %pair.v
  store i64 %i, ptr %prefix.p
  ret i1 true
exhausted:
  store i64 0, ptr %prefix.p
  ret i1 false
}}
define i64 @expand(ptr noalias %records, i64 %count, ptr noalias %buffer, i64 %capacity, ptr noalias %c) #1 {{
entry:
  %n.v = alloca i64
  store i64 0, ptr %n.v
  %source.p = getelementptr i64, ptr %c, i64 {SOURCE}
  %process.p = getelementptr i64, ptr %c, i64 {PROCESS}
  %stepped.p = getelementptr i64, ptr %c, i64 {STEPPED}
  %samples.p = getelementptr i64, ptr %c, i64 {SAMPLES}
  %status.p = getelementptr i64, ptr %c, i64 {STATUS}
  %table.p = getelementptr i64, ptr %c, i64 <SAMPLES>
  br label %again
again:
  %n = load i64, ptr %n.v
  %source = load i64, ptr %source.p
  %full = icmp uge i64 %n, %capacity
  %over = icmp uge i64 %source, %count
  %stop = or i1 %full, %over
  br i1 %stop, label %out, label %find
find:
  %p = load i64, ptr %process.p
  %at = mul i64 %source, <RECORD>
  %in = getelementptr i8, ptr %records, i64 %at
  %last = icmp uge i64 %p, <PROCESSES>
  br i1 %last, label %ended, label %candidate
candidate:
  %on = call i1 @enabled(ptr %in, i64 %p)
  br i1 %on, label %go, label %skip
skip:
  %p.skip = add i64 %p, 1
  store i64 %p.skip, ptr %process.p
  br label %again
ended:
  %stepped = load i64, ptr %stepped.p
  %live = icmp ne i64 %stepped, 0
  br i1 %live, label %following, label %go
following:
  %source.next = add i64 %source, 1
  store i64 %source.next, ptr %source.p
  store i64 0, ptr %process.p
  store i64 0, ptr %stepped.p
  br label %again
go:
  %edge.i = mul i64 %n, <EDGE>
  %edge = getelementptr i8, ptr %buffer, i64 %edge.i
  %body = getelementptr i8, ptr %edge, i64 <BODY>
  call void @llvm.memcpy.p0.p0.i64(ptr %body, ptr %in, i64 <RECORD>, i1 false)
  %status = call i32 @step(ptr %body, ptr %c, i64 %p)
  %source.32 = trunc i64 %source to i32
  store i32 %source.32, ptr %edge
  %p.32 = trunc i64 %p to i32
  %shown = select i1 %last, i32 -1, i32 %p.32
  %edge.process = getelementptr i8, ptr %edge, i64 4
  store i32 %shown, ptr %edge.process
  %edge.status = getelementptr i8, ptr %edge, i64 8
  store i32 %status, ptr %edge.status
  %samples = load i64, ptr %samples.p
  %samples.32 = trunc i64 %samples to i32
  %edge.samples = getelementptr i8, ptr %edge, i64 12
  store i32 %samples.32, ptr %edge.samples
  %tail = getelementptr i8, ptr %edge, i64 <TAIL>
  %samples.bytes = shl i64 %samples, 4
  call void @llvm.memcpy.p0.p0.i64(ptr %tail, ptr %table.p, i64 %samples.bytes, i1 false)
  %n.next = add i64 %n, 1
  store i64 %n.next, ptr %n.v
  %bad = icmp eq i32 %status, <BROKEN>
  br i1 %bad, label %broken, label %advance
broken:
  store i64 <BROKEN>, ptr %status.p
  br label %advance
advance:
  %more = call i1 @advance(ptr %c)
  br i1 %more, label %again, label %exhausted
exhausted:
  br i1 %last, label %following, label %more.processes
more.processes:
  store i64 1, ptr %stepped.p
  %p.next = add i64 %p, 1
  store i64 %p.next, ptr %process.p
  br label %again
out:
  ret i64 %n
}}
define internal i64 @pick(ptr noalias %r, ptr noalias %c) #1 {{
entry:
  %process.p = getelementptr i64, ptr %c, i64 {PROCESS}
  %turn = load i64, ptr %process.p
  %seed = load i64, ptr %c
  %fixed = icmp eq i64 %seed, 0
  br i1 %fixed, label %robin, label %count
robin:
  %k = phi i64 [0, %entry], [%k.next, %robin.next]
  %none = icmp uge i64 %k, <PROCESSES>
  br i1 %none, label %nobody, label %try
try:
  %sum = add i64 %turn, %k
  %p = urem i64 %sum, <PROCESSES>
  %on = call i1 @enabled(ptr %r, i64 %p)
  br i1 %on, label %found, label %robin.next
robin.next:
  %k.next = add i64 %k, 1
  br label %robin
found:
  ret i64 %p
count:
  %i = phi i64 [0, %entry], [%i.next, %count.next]
  %live = phi i64 [0, %entry], [%live.next, %count.next]
  %counted = icmp uge i64 %i, <PROCESSES>
  br i1 %counted, label %draw, label %count.next
count.next:
  %i.on = call i1 @enabled(ptr %r, i64 %i)
  %one = zext i1 %i.on to i64
  %live.next = add i64 %live, %one
  %i.next = add i64 %i, 1
  br label %count
draw:
  %empty = icmp eq i64 %live, 0
  br i1 %empty, label %nobody, label %choose
choose:
  %wanted = call i64 @random(ptr %c, i64 %live)
  br label %seek
seek:
  %j = phi i64 [0, %choose], [%j.next, %seek.next]
  %left = phi i64 [%wanted, %choose], [%left.next, %seek.next]
  %j.on = call i1 @enabled(ptr %r, i64 %j)
  %zero = icmp eq i64 %left, 0
  %here = and i1 %zero, %j.on
  br i1 %here, label %chosen, label %seek.next
seek.next:
  %less = zext i1 %j.on to i64
  %left.next = sub i64 %left, %less
  %j.next = add i64 %j, 1
  br label %seek
chosen:
  ret i64 %j
nobody:
  ret i64 <PROCESSES>
}}"""


@dataclass(frozen=True, slots=True)
class Between:
    """What a run does between its steps: LLVM text for the places of `run_loop`.

    It may use the record %r, the context %c, the number of steps taken %n and, in `after`, that of the step %n.next.
    """

    parameters: str
    """What the function is given after the record and the number of steps."""
    after: str
    """After a step of a process: branches to `on` where the run goes on; may return %n.next itself."""
    before: str = ""
    """Before the first step."""
    carried: str = ""
    """At the head of the loop: values that are carried around it."""
    enough: str = "\n  %enough = icmp uge i64 %n, %steps"
    """Makes %enough, which ends the run before its next step."""
    end: str = ""
    """After the step by which the arrangement shows that it has ended."""
    leave: str = ""
    """Before every return."""


def run_loop(name: str, between: Between) -> str:
    """A function of a record that takes step after step, as `@pick` chooses them, and returns their number: up to its
    second argument, the end of the arrangement or a fault, with the record then as it was before the faulty step."""
    return f"""\
define i64 @{name}(ptr noalias %r, i64 %steps, {between.parameters}) #1 {{
entry:
  %process.p = getelementptr i64, ptr %c, i64 {PROCESS}
  %status.p = getelementptr i64, ptr %c, i64 {STATUS}
  %saved = getelementptr i64, ptr %c, i64 <SAVED>{between.before}
  br label %loop
loop:
  %n = phi i64 [0, %entry], [%n.next, %on]{between.carried}{between.enough}
  br i1 %enough, label %out, label %once
once:
  call void @llvm.memcpy.p0.p0.i64(ptr %saved, ptr %r, i64 <RECORD>, i1 false)
  %p = call i64 @pick(ptr %r, ptr %c)
  %drawn.p = getelementptr i64, ptr %c, i64 {DRAWN}
  %drawn = load ptr, ptr %drawn.p
  %random.p = getelementptr i64, ptr %c, i64 {RANDOM}
  call void @draw(ptr %c, ptr %drawn, ptr %random.p, i1 false)
  %status = call i32 @step(ptr %r, ptr %c, i64 %p)
  %bad = icmp ne i32 %status, 0
  br i1 %bad, label %failed, label %good
failed:
  call void @llvm.memcpy.p0.p0.i64(ptr %r, ptr %saved, i64 <RECORD>, i1 false)
  %status.64 = sext i32 %status to i64
  store i64 %status.64, ptr %status.p
  store i64 %p, ptr %process.p{between.leave}
  ret i64 %n
good:
  %n.next = add i64 %n, 1
  %p.next = add i64 %p, 1
  store i64 %p.next, ptr %process.p
  %none = icmp uge i64 %p, <PROCESSES>
  br i1 %none, label %ended, label %check
ended:{between.end}
  store i64 {ENDED}, ptr %status.p{between.leave}
  ret i64 %n.next
check:{between.after}
on:
  br label %loop
out:{between.leave}
  ret i64 %n
}}"""


RUN = run_loop(
    "run",
    Between(
        parameters="i64 %stop, ptr noalias %c",
        after="""
  %asked = icmp ne i64 %stop, 0
  %closed = call i1 @cycle(ptr %r)
  %halt = and i1 %asked, %closed
  br i1 %halt, label %stopped, label %on
stopped:
  ret i64 %n.next""",
    ),
)
"""As many steps; where `stop` is not 0, to the end of a cycle at most."""
