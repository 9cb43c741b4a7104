"""LLVM text that is the same for all programs: what stands in files, and loops over steps.

A word in angle brackets stands for a number of the program at hand (`fill`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib import resources

from llfsm_verify.backends.native.context import DRAWN, ENDED, EVENTS, PROCESS, RANDOM, STATUS


@cache
def llvm_source(package: str, name: str) -> str:
    """The text of a file of a package, without the lines that are comments."""
    lines = resources.files(package).joinpath(name).read_text(encoding="utf-8").splitlines()
    return "\n".join(line for line in lines if not line.startswith(";"))


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
