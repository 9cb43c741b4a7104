"""Blocks in which a fault does not end the run: what follows a check that fails is left out."""

from __future__ import annotations

from collections.abc import Callable

from llfsm_verify.program.program import Block, Expr, Fault, If, Stmt, Switch
from llfsm_verify.program.trees import statements, with_branches


def stop_at_faults(block: Block, fine: Expr, instead: Callable[[Fault], Stmt]) -> Block:
    """A block with `instead` in the place of each check, in which nothing follows one that has made `fine` false.

    Blocks nest as deep as the source does, which the parser limits.
    """
    out: list[Stmt] = []
    part: list[Stmt] = []

    def close() -> None:
        out.extend(while_fine(fine, tuple(part)) if out else part)
        part.clear()

    for s in block:
        faults = any(isinstance(each, Fault) for each in statements((s,)))
        match s:
            case Fault():
                part.append(instead(s))
            case If() | Switch() if faults:
                part.append(with_branches(s, lambda inner: stop_at_faults(inner, fine, instead)))
            case _:
                part.append(s)
        if faults:
            close()
    close()
    return tuple(out)


def while_fine(fine: Expr, block: Block) -> Block:
    return (If(fine, block),) if block else ()
