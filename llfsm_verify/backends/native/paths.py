"""What a path through a block can do at most, found without running it."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from llfsm_verify.program.program import Block, If, Program, Sample, Stmt, Switch


def statements(block: Block) -> Iterator[Stmt]:
    """Every statement of a block, nested ones included, in textual order."""
    todo: list[Stmt] = list(reversed(block))
    while todo:
        statement = todo.pop()
        yield statement
        for inner in reversed(branches(statement)):
            todo.extend(reversed(inner))


def branches(statement: Stmt) -> tuple[Block, ...]:
    """The blocks of which a statement runs one."""
    match statement:
        case If(_, then, otherwise):
            return then, otherwise
        case Switch(_, cases, default):
            return (*(block for _, block in cases), default)
        case _:
            return ()


def heaviest(block: Block, weight: Callable[[Stmt], int]) -> int:
    """The largest total `weight` of the statements on a path through a block."""
    # Each frame: what is left of the block, the total so far, the largest total of its finished sibling blocks.
    frames: list[tuple[Iterator[Stmt], list[int], list[Block]]] = [(iter(block), [0, 0], [])]
    while True:
        left, totals, siblings = frames[-1]
        statement = next(left, None)
        if statement is not None:
            totals[0] += weight(statement)
            inner = [b for b in branches(statement) if b]
            if inner:
                frames.append((iter(inner.pop()), [0, 0], inner))
            continue
        totals[1] = max(totals[1], totals[0])
        if siblings:
            frames[-1] = (iter(siblings.pop()), [0, totals[1]], siblings)
            continue
        frames.pop()
        if not frames:
            return totals[1]
        frames[-1][1][0] += totals[1]


def heaviest_step(program: Program, weight: Callable[[Stmt], int]) -> int:
    """A bound of the total `weight` of the statements of one step."""

    def total(block: Block) -> int:
        return heaviest(block, weight)

    letter = total(program.letter)
    bound = total(program.letter_stutter)
    for process in program.processes:
        fixed = total(process.epilogue) + letter
        for slot in (program.slots[i] for i in process.slots):
            block = max((total(b) for b in slot.blocks), default=0)
            bound = max(bound, fixed + total(slot.prologue) + block + total(slot.epilogue) + total(slot.canonical))
    return bound


def most_samples(program: Program) -> int:
    """A bound of the number of different choices that one step reads."""
    return min(len(program.choices), heaviest_step(program, lambda s: int(isinstance(s, Sample))))
