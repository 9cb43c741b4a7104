"""Small step programs for tests: one process, one slot, one state, whatever one wants it to do."""

from __future__ import annotations

from collections.abc import Sequence

from llfsm_verify.program.program import (
    BOOL,
    Block,
    Choice,
    Const,
    FaultSite,
    Int,
    MachineInfo,
    Origin,
    Process,
    Program,
    Set,
    Slot,
    Type,
    Var,
)


def constant(value: int) -> Const:
    return Const(value, Int(value, value))


def variable(name: str, kind: Type, init: int | tuple[int, ...] = 0, *, free: bool = False) -> Var:
    length = len(init) if isinstance(init, tuple) else None
    return Var(name, kind, init, Origin("machine", "m"), length, free=free)


def tiny(body: Block, variables: Sequence[Var] = (), choices: Sequence[Choice] = (), **more: object) -> Program:
    """One process that runs `body` in each ringlet, which is a cycle."""
    control, output = Origin("control"), Origin("output")
    own = (
        Var("turn", Int(0, 0), 0, control),
        Var("state", Int(0, 0), 0, control),
        Var("cycle", BOOL, 0, output, output=True),
    )
    fields: dict[str, object] = {
        "name": "tiny",
        "observe": "ringlet",
        "vars": (*own, *variables),
        "choices": tuple(choices),
        "inputs": (),
        "machines": (MachineInfo("m", ("S",), ((),)),),
        "slots": (Slot(0, 0, "state", (), (body,), (), ()),),
        "processes": (Process("main", (0,), "turn", None, (Set("cycle", None, constant(1)),)),),
        "letter": (),
        "letter_stutter": (),
        "atoms": (),
        "fairness": (),
        "faults": tuple(FaultSite(f"E{i}", f"fault {i}", None) for i in range(3)),
    }
    return Program(**(fields | more))  # type: ignore[arg-type]
