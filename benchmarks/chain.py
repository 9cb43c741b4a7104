"""A trip chain: one machine that trips on any of N digital inputs, as programs of PLCs are written, for three checkers.

Three properties for each input: the output is off when it has tripped, an invariant, and that it does not stay tripped
while the input is off. The models of SPIN and NuSMV are written as users who know these tools well write them.
"""

from __future__ import annotations

KINDS = ("free", "held", "rose")
"""Inputs that change at any sample, or between cycles only; `rose`: the invariant looks at what has begun."""


def arrangement(n: int, kind: str) -> str:
    """The machine with `n` inputs."""
    held = ", changes: cycle" if kind == "held" else ""
    lines = ["name: chain", "cycle_ms: 20", "whiteboard:"]
    lines += [f"  s{i}: {{type: bool, role: input{held}}}" for i in range(n)]
    lines += ["  run: {type: bool, init: false, role: output}", "machines:", "  m:", "    inline:", "      machine: M"]
    lines += ["      states:", "        - name: OK", "          on_entry: run = true;", "          transitions:"]
    lines += [f"            - {{when: s{i}, to: T{i}}}" for i in range(n)]
    for i in range(n):
        lines += [f"        - name: T{i}", "          on_entry: run = false;", "          transitions:"]
        lines += [f"            - {{when: after(2) && not s{i}, to: OK}}"]
    return "\n".join([*lines, "schedule: [m]", ""])


def properties(n: int, kind: str) -> str:
    """`q`, `r` and `d` of each input; all hold."""
    lines = []
    for i in range(n):
        began = f"m.ran && rose(m@T{i}) -> Y m@OK"
        lines += [f"q{i}: G (m@T{i} && m.entered -> !run)"]
        lines += [f"r{i}: G ({began if kind == 'rose' else f'sampled(s{i}) && m@T{i} -> !m@OK'})"]
        lines += [f"d{i}: G (m@T{i} -> F (m@OK || s{i}))"]
    return "\n".join([*lines, ""])


def promela(n: int, kind: str) -> str:
    """The same for SPIN. `st` is 0 for OK and i + 1 for the trip of input i, `s` the input that was read last: all
    inputs in one image would be 2^n states."""
    rose = kind == "rose"
    claims = []
    for i in range(1, n + 1):
        began = f"st == {i} && before != {i} -> before == 0" if rose else f"s && st == {i} -> st != 0"
        claims += [f"ltl q{i - 1} {{ [] (st == {i} -> !on) }}", f"ltl r{i - 1} {{ [] ({began}) }}"]
        claims += [f"ltl d{i - 1} {{ [] (st == {i} -> <> (st == 0 || s)) }}"]
    return f"""#define N {n}
byte st, t, i{", before" if rose else ""};
bit s, on = 1;
active proctype plc() {{
  do
  :: atomic {{{" before = st;" if rose else ""}
       if
       :: st == 0 ->
            i = 0;
            do
            :: i < N -> if :: s = 1; st = i + 1; on = 0; break :: s = 0; i++ fi
            :: i == N -> break
            od;
            i = 0
       :: st > 0 ->
            if :: s = 0 :: s = 1 fi;
            if :: t == 100 && !s -> st = 0; t = 0; on = 1 :: else -> if :: t < 100 -> t++ :: else fi fi
       fi
     }}
  od
}}
""" + "\n".join([*claims, ""])


def smv(n: int, kind: str) -> str:
    """The same for NuSMV."""
    # The order of variables is that of its diagrams: with the inputs first it does not end with 16 of them.
    lines = ["MODULE main", "VAR", f"  st : {{OK, {', '.join(f'T{i}' for i in range(n))}}};", "  on : boolean;"]
    lines += ["  t : 0..100;", *(f"  s{i} : boolean;" for i in range(n))]
    lines += ["ASSIGN", "  init(st) := OK;", "  next(st) := case"]
    lines += [f"    st = OK & s{i} : T{i};" for i in range(n)]
    lines += [f"    st = T{i} & t = 100 & !s{i} : OK;" for i in range(n)]
    lines += ["    TRUE : st;", "  esac;", "  init(on) := TRUE;", "  next(on) := next(st) = OK;", "  init(t) := 0;"]
    lines += ["  next(t) := case next(st) != st | st = OK : 0; t < 100 : t + 1; TRUE : t; esac;"]
    for i in range(n):
        began = f"LTLSPEC NAME r{i} := G (st = T{i} & Y st != T{i} -> Y st = OK);"
        plain = f"INVARSPEC NAME r{i} := s{i} & st = T{i} -> st != OK;"
        lines += [f"INVARSPEC NAME q{i} := st = T{i} -> !on;", began if kind == "rose" else plain]
        lines += [f"LTLSPEC NAME d{i} := G (st = T{i} -> F (st = OK | s{i}));"]
    return "\n".join([*lines, ""])
