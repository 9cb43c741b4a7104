"""Blocks in which a fault does not end the run: what follows a check that fails is left out."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.program.program import Block, Expr, Fault, If, Stmt, Switch
from llfsm_verify.program.terms import op
from llfsm_verify.program.trees import statements


def stop_at_faults(block: Block, stopped: Expr, instead: Callable[[Fault], Stmt]) -> Block:
    """A block with `instead` in the place of each check, in which nothing follows one that has made `stopped` true.

    Blocks nest as deep as the source does, which the parser limits.
    """
    out: list[Stmt] = []
    part: list[Stmt] = []

    def close() -> None:
        out.extend(unless(stopped, tuple(part)) if out else part)
        part.clear()

    for s in block:
        faults = any(isinstance(each, Fault) for each in statements((s,)))
        match s:
            case Fault():
                part.append(instead(s))
            case If(condition, then, otherwise) if faults:
                branches = (stop_at_faults(b, stopped, instead) for b in (then, otherwise))
                part.append(If(condition, *branches))
            case Switch(value, cases, default) if faults:
                told = tuple((k, stop_at_faults(b, stopped, instead)) for k, b in cases)
                part.append(Switch(value, told, stop_at_faults(default, stopped, instead)))
            case _:
                part.append(s)
        if faults:
            close()
    close()
    return tuple(out)


def unless(stopped: Expr, block: Block) -> Block:
    return (If(op("not", stopped), block),) if block else ()
