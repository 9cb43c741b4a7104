"""Nanoseconds a ringlet on ping-pong machines, in machine code and in plain Python: ``python benchmarks/pingpong.py``.

A ping-pong machine has two states, PING and PONG, counts its visits on entry (modulo 2^16), and changes over on every
turn. The table shows the median of several runs of 1, 4 and 16 such machines in one arrangement.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from statistics import median

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.program.program import Program
from llfsm_verify.semantics.lowering import lower

_MACHINE = """\
  m{i}:
    inline:
      machine: PingPong
      variables:
        n: {{type: uint16, init: 0}}
      states:
        - name: PING
          on_entry: n += 1;
          transitions: [{{when: "true", to: PONG}}]
        - name: PONG
          on_entry: n += 1;
          transitions: [{{when: "true", to: PING}}]
"""


def text_of(machines: int) -> str:
    """An arrangement of so many ping-pong machines."""
    schedule = ", ".join(f"m{i}" for i in range(machines))
    text = f"name: pingpong_{machines}\nmachines:\n"
    text += "".join(_MACHINE.format(i=i) for i in range(machines))
    return text + f"schedule: [{schedule}]\n"


def pingpong(machines: int) -> Program:
    """The same, loaded and lowered."""
    return lower(load_arrangement_text(text_of(machines)))


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
