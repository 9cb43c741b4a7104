"""Seconds from a large arrangement's text to machine code: ``python benchmarks/compiling.py [MACHINES STATES LINES]``.

By default the largest is 60 machines of 10 states with 20 lines of action each; halves of it show how the time grows.
What an earlier run has kept in LLFSM_CACHE is loaded: an empty folder there shows a first run.
"""

from __future__ import annotations

import argparse
import time
from random import Random

from llfsm_verify.arrangement.loader import load_arrangement_text
from llfsm_verify.backends.native.executor import NativeProgram
from llfsm_verify.semantics.lowering import lower


def large(machines: int, states: int, lines: int) -> str:
    """The YAML text of an arrangement whose machines all differ: arithmetic, conditions, arrays, faults."""
    random = Random(1)
    text = ["name: large\nwhiteboard:\n"]
    text += [f"  go{m}: {{type: bool, init: false, role: input}}\n" for m in range(machines)]
    text.append("machines:\n")
    for m in range(machines):
        text.append(f"  m{m}:\n    inline:\n      machine: Large\n      variables:\n")
        text.append("        a: {type: 0..99, init: 0}\n        b: {type: int8, init: 0}\n")
        text.append("        c: {type: int32, init: 1}\n        t: {type: {array: uint8, size: 8}}\n      states:\n")
        for s in range(states):
            forms = (
                "a = (a + {k} + b * b) % 100;", "b += c - {k};", "c = c * {k} + a;", "t[a % 8] = b + {k};",
                "if (a > {k}) {{ c -= b; }} else {{ a = t[{j}] % 100; }}",
            )  # fmt: skip
            action = " ".join(random.choice(forms).format(k=random.randrange(1, 90), j=s % 8) for _ in range(lines))
            targets = [random.randrange(states) for _ in range(2)]
            text.append(f'        - name: S{s}\n          on_entry: "{action}"\n          transitions:\n')
            text.append(f"            - {{when: go{m} && a > {s}, to: S{targets[0]}}}\n")
            text.append(f"            - {{when: b == {s}, to: S{targets[1]}}}\n")
    text.append("schedule: [" + ", ".join(f"m{m}" for m in range(machines)) + "]\n")
    return "".join(text)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("size", type=int, nargs="*", default=[60, 10, 20], help="machines, states, lines")
    parser.add_argument("--full", action="store_true", help="optimise as well")
    options = parser.parse_args()
    machines, states, lines = options.size
    print("machines  load s  lower s  compile s  LLVM lines  ns/ringlet")
    for share in (8, 4, 2, 1):
        count = max(1, machines // share)
        begin = time.perf_counter()
        arrangement = load_arrangement_text(large(count, states, lines))
        loaded = time.perf_counter()
        program = lower(arrangement)
        lowered = time.perf_counter()
        native = NativeProgram(program, effort="full" if options.full else "quick")
        native.compile()
        compiled = time.perf_counter()
        ran = native.run(native.layout.first(), 300_000, mode="random", seed=1)
        each = (time.perf_counter() - compiled) / max(1, ran.steps) * 1e9
        print(
            f"{count:8}  {loaded - begin:6.2f}  {lowered - loaded:7.2f}  {compiled - lowered:9.2f}"
            f"  {native.lines:10}  {each:10.0f}"
        )


if __name__ == "__main__":
    main()
