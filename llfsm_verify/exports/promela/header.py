"""What stands above a Promela model: what it is, and the commands that check it."""

from __future__ import annotations

from llfsm_verify.exports.flat import Flat, comment
from llfsm_verify.exports.promela.blocks import Blocks, type_of

STATE_VECTOR = 1000
"""Bytes of SPIN's state vector from which on its compiler must be told (it assumes 1024)."""

_BYTES = {"bool": 1, "byte": 1, "short": 2, "int": 4}


def header(flat: Flat, blocks: Blocks, letter: int) -> list[str]:
    """The lines of the comment; `letter` is the number of variables that hold the letter.

    gcc is told -w: what SPIN writes gives dozens of warnings that say nothing about the model.
    """
    program, checked = flat.program, flat.specification.observed
    options = f"-DNOREDUCE{_vector(flat, blocks, letter)} -o pan pan.c"
    lines = [f"/* The arrangement {comment(program.name)}, written by llfsm kripke."]
    if not checked:
        unit = "cycle" if program.observe == "cycle" else "ringlet"
        lines += [
            f"   SPIN stores one state per configuration; a {unit} is one atomic sequence:",
            "     spin -o2 -a FILE",
            f"     gcc -w -O2 -DSAFETY {options}",
            "     ./pan -m1000000" + ("    stops at the first fault: an assertion" if flat.faulty else ""),
        ]
        if flat.faulty:
            lines.append("     ./pan -m1000000 -A -E    counts; a fault leads to the initial configuration")
    else:
        lines += [
            "   A letter is held until the next step is complete, so that formulas without X keep their meaning.",
            "   The others, and long ones, are never claims of ours, which read a letter where `tick` holds.",
            "     spin -o2 -a FILE",
            f"     gcc -w -O2 {options}",
            "     ./pan -m1000000 -a -N NAME    for each ltl block and never claim",
        ]
        names = ", ".join(comment(name) for name, _ in flat.specification.assumptions)
        if names:
            lines.append(f"   Assumed: {names}.")
    lines[-1] += " */"
    return lines


def _vector(flat: Flat, blocks: Blocks, letter: int) -> str:
    """The option that makes room for a large state vector."""
    size = sum(_BYTES[type_of(v.type)] * (len(v.init) if isinstance(v.init, tuple) else 1) for v in flat.vars)
    size += 8 * (len(blocks.picked) + letter) + 4 * sum(s.kept for s in blocks.scratch.values())
    return f" -DVECTORSZ={1 << (2 * size).bit_length()}" if size > STATE_VECTOR else ""
