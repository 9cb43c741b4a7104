"""Nanoseconds a ringlet on ping-pong machines, in machine code and in plain Python: ``python benchmarks/pingpong.py``.

A ping-pong machine has two states, PING and PONG, counts its visits on entry (modulo 2^16), and changes over on every
turn. The table shows the median of several runs of 1, 4 and 16 such machines in one arrangement.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from statistics import median

from llfsm_verify.backends.native import NativeProgram
from llfsm_verify.semantics.program import (
    BOOL,
    Block,
    Const,
    Expr,
    Get,
    If,
    Int,
    MachineInfo,
    Op,
    Origin,
    Process,
    Program,
    Set,
    Slot,
    TransitionInfo,
    Var,
)

WORD = Int(0, 65535)
STATE = Int(0, 1)


def constant(value: int) -> Const:
    return Const(value, Int(value, value))


def pingpong(machines: int) -> Program:
    """The arrangement as a step program, as an arrangement's lowering would write it."""
    control, turn_type = Origin("control"), Int(0, machines - 1)
    variables = [
        Var("turn", turn_type, 0, control),
        Var("ran", Int(0, machines), 0, Origin("output"), output=True),
        Var("cycle", BOOL, 0, Origin("output"), output=True),
        Var("fired", Int(0, 1), 0, Origin("output"), output=True),
    ]
    slots, infos = [], []
    for m in range(machines):
        state, entered, count = f"m{m}.state", f"m{m}.entered", f"m{m}.count"
        variables += [
            Var(state, STATE, 0, Origin("control", f"m{m}", ("PING", "PONG"))),
            Var(entered, BOOL, 0, control),
            Var(count, WORD, 0, Origin("machine", f"m{m}")),
        ]
        read: Expr = Get(count, None, WORD)
        more = Op("wrap", (Op("add", (read, constant(1)), Int(1, 65536)),), WORD)
        entry: Block = (
            If(Op("not", (Get(entered, None, BOOL),), BOOL), (Set(entered, None, constant(1)), Set(count, None, more))),
        )

        def go(target: int, state: str = state, entered: str = entered) -> Block:
            return (
                Set("fired", None, constant(1)),
                Set(state, None, constant(target)),
                Set(entered, None, constant(0)),
            )

        after: Block = (Set("ran", None, constant(m + 1)),)
        slots.append(Slot(m, 0, state, entry, (go(1), go(0)), after, ()))
        transitions = tuple((TransitionInfo(target, "true", None),) for target in (1, 0))
        infos.append(MachineInfo(f"m{m}", ("PING", "PONG"), transitions))
    turn = Get("turn", None, turn_type)
    last = Op("eq", (turn, constant(machines - 1)), BOOL)
    following = Op("add", (turn, constant(1)), Int(1, machines))
    tick: Block = (
        If(
            last,
            (Set("cycle", None, constant(1)), Set("turn", None, constant(0))),
            (Set("turn", None, following),),
        ),
    )
    process = Process("main", tuple(range(machines)), "turn", None, tick)
    return Program(
        f"pingpong{machines}", "ringlet", tuple(variables), (), (), tuple(infos), tuple(slots), (process,),
        (), (), (), (), (),
    )  # fmt: skip


def plain_python(machines: int, ringlets: int) -> float:
    """Seconds of the same machines as dictionaries of functions, the way one writes them by hand."""
    counts = [0] * machines

    def machine(m: int) -> dict[str, dict[str, Callable[[], object]]]:
        def visit() -> None:
            counts[m] = (counts[m] + 1) & 65535

        return {"PING": {"entry": visit, "next": lambda: "PONG"}, "PONG": {"entry": visit, "next": lambda: "PING"}}

    arrangement = [machine(m) for m in range(machines)]
    current, entered = ["PING"] * machines, [False] * machines
    begin = time.perf_counter()
    for _ in range(ringlets // machines):
        for m, states in enumerate(arrangement):
            actions = states[current[m]]
            if not entered[m]:
                entered[m] = True
                actions["entry"]()
            target = actions["next"]()
            if target is not None:
                current[m] = str(target)
                entered[m] = False
    return time.perf_counter() - begin


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--ringlets", type=int, default=1_000_000, help="ringlets a run in machine code")
    parser.add_argument("--repeat", type=int, default=7, help="runs of which the median is shown")
    options = parser.parse_args()
    ringlets, repeat = options.ringlets, options.repeat
    print("machines  compile s  native ns/ringlet  Python ns/ringlet")
    for machines in (1, 4, 16):
        native = NativeProgram(pingpong(machines), effort="full")
        begin = time.perf_counter()
        native.compile()
        compiled = time.perf_counter() - begin
        record, native_times, python_times = native.layout.first(), [], []
        for _ in range(repeat):
            begin = time.perf_counter()
            result = native.run(record, ringlets)
            native_times.append((time.perf_counter() - begin) / ringlets * 1e9)
            if result.steps != ringlets:
                raise SystemExit(f"the run ended after {result.steps} ringlets with status {result.status}")
            fewer = max(machines, ringlets // 10)
            python_times.append(plain_python(machines, fewer) / (fewer // machines * machines) * 1e9)
        print(f"{machines:8}  {compiled:9.3f}  {median(native_times):17.1f}  {median(python_times):17.0f}")


if __name__ == "__main__":
    main()
