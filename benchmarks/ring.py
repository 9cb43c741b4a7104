"""Print the arrangement ring(N, C): N machines that look at their left neighbour, each with a counter modulo C.

`python benchmarks/ring.py N C > ring.yaml`. Every machine has an input of its own; it turns ON when the input holds and
the left neighbour is not ON, and OFF when the input fails or the neighbour is ON.
"""

from __future__ import annotations

import sys

_MACHINE = """\
  m{i}:
    inline:
      machine: Link
      parameters: {{go: {{whiteboard: bool}}, left: machine}}
      variables:
        n: {{type: 0..{top}, init: 0}}
      states:
        - name: "OFF"
          transitions:
            - {{when: go && not left@ON, to: "ON"}}
        - name: "ON"
          on_entry: n = (n + 1) % {modulus};
          transitions:
            - {{when: not go || left@ON, to: "OFF"}}
    parameters: {{go: go{i}, left: m{left}}}
"""


def ring(size: int, modulus: int) -> str:
    """The YAML text of ring(size, modulus); both at least 1."""
    lines = [f"name: ring_{size}_{modulus}\nwhiteboard:\n"]
    lines += [f"  go{i}: {{type: bool, init: false, role: input}}\n" for i in range(size)]
    lines.append("machines:\n")
    lines += [_MACHINE.format(i=i, left=(i - 1) % size, top=modulus - 1, modulus=modulus) for i in range(size)]
    lines.append("schedule: [" + ", ".join(f"m{i}" for i in range(size)) + "]\n")
    return "".join(lines)


def main(arguments: list[str]) -> int:
    """Exit code 2 when the arguments are not two positive numbers."""
    if len(arguments) != 2 or not all(a.isascii() and a.isdigit() and int(a) >= 1 for a in arguments):
        print("usage: python benchmarks/ring.py N C   (machines and modulus, each at least 1)", file=sys.stderr)
        return 2
    sys.stdout.write(ring(int(arguments[0]), int(arguments[1])))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
