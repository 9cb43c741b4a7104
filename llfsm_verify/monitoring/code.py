"""Monitors as machine code: the LLVM text of their steps, and the loop over many letters."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from llfsm_verify.backends.native.layout import WORD_BITS
from llfsm_verify.monitoring.lookup import WalkTable

Place = tuple[int, int]
"""Where the truth of an atom lies: a 64-bit word and a bit in it."""


def monitor_text(tables: Sequence[WalkTable], places: Sequence[Sequence[Place]]) -> str:
    """Functions `@monitor.K` from a state and a pointer to words to the next state, and `@monitors`.

    `places[K][i]` is where atom i of table K lies. `@monitors` steps the states in an array, and returns whether one of
    them became settled.
    """
    functions = [_function(k, table, own) for k, (table, own) in enumerate(zip(tables, places, strict=True))]
    lines = []
    news = ["false"]
    for k, table in enumerate(tables):
        lines += [
            f"  %p{k} = getelementptr i64, ptr %states, i64 {k}",
            f"  %s{k} = load i64, ptr %p{k}",
            f"  %t{k} = call i64 @monitor.{k}(i64 %s{k}, ptr %words)",
            f"  store i64 %t{k}, ptr %p{k}",
            f"  %was{k} = icmp ult i64 %s{k}, {table.settled}",
            f"  %is{k} = icmp uge i64 %t{k}, {table.settled}",
            f"  %now{k} = and i1 %was{k}, %is{k}",
            f"  %any{k} = or i1 {news[-1]}, %now{k}",
        ]
        news.append(f"%any{k}")
    body = "\n".join([*lines, f"  ret i1 {news[-1]}"])
    stepping = f"define internal i1 @monitors(ptr noalias %words, ptr noalias %states) nounwind {{\n{body}\n}}"
    return "\n".join([*functions, stepping])


def letters_text(tables: Sequence[WalkTable], words: int) -> str:
    """`@letters`: reads letters of `words` words each until there are no more or a state becomes settled.

    Returns how many it read. The states are kept in registers.
    """
    count = len(tables)
    load = [f"  %q{k} = getelementptr i64, ptr %states, i64 {k}\n  %b{k} = load i64, ptr %q{k}" for k in range(count)]
    phis = [f"  %s{k} = phi i64 [%b{k}, %entry], [%t{k}, %go]" for k in range(count)]
    steps = []
    news = ["false"]
    for k, table in enumerate(tables):
        steps += [
            f"  %t{k} = call i64 @monitor.{k}(i64 %s{k}, ptr %at)",
            f"  %was{k} = icmp ult i64 %s{k}, {table.settled}",
            f"  %is{k} = icmp uge i64 %t{k}, {table.settled}",
            f"  %now{k} = and i1 %was{k}, %is{k}",
            f"  %any{k} = or i1 {news[-1]}, %now{k}",
        ]
        news.append(f"%any{k}")
    stores = [f"  %r{k} = phi i64 [%s{k}, %loop], [%t{k}, %go]\n  store i64 %r{k}, ptr %q{k}" for k in range(count)]
    ends = "\n".join(line.split("\n")[0] for line in stores)
    kept = "\n".join(line.split("\n")[1] for line in stores)
    return "\n".join(
        [
            "define i64 @letters(ptr noalias %words, i64 %count, ptr noalias %states) nounwind {",
            "entry:",
            *load,
            "  br label %loop",
            "loop:",
            "  %n = phi i64 [0, %entry], [%n.next, %go]",
            *phis,
            "  %more = icmp ult i64 %n, %count",
            "  br i1 %more, label %go, label %out",
            "go:",
            f"  %offset = mul i64 %n, {words}",
            "  %at = getelementptr i64, ptr %words, i64 %offset",
            *steps,
            "  %n.next = add i64 %n, 1",
            f"  br i1 {news[-1]}, label %out, label %loop",
            "out:",
            "  %read = phi i64 [%n, %loop], [%n.next, %go]",
            ends,
            kept,
            "  ret i64 %read",
            "}",
        ]
    )


def _function(k: int, table: WalkTable, places: Sequence[Place]) -> str:
    data = []
    lines = []
    node = "%state"
    at = 0
    for i, (width, stage) in enumerate(zip(table.widths, table.stages, strict=True)):
        bits = next(b for b in (8, 16, 32) if max(stage) < 1 << b)
        values = ", ".join(f"i{bits} {value}" for value in stage)
        data.append(f"@monitor.{k}.{i} = internal constant [{len(stage)} x i{bits}] [{values}]")
        read, gathered = _gather([places[p] for p in table.places[at : at + width]], f"g{i}")
        lines += [
            *read,
            f"  %base{i} = shl i64 {node}, {width}",
            f"  %index{i} = or i64 %base{i}, {gathered}",
            f"  %entry{i} = getelementptr i{bits}, ptr @monitor.{k}.{i}, i64 %index{i}",
            f"  %value{i} = load i{bits}, ptr %entry{i}, !invariant.load !{{}}",
            f"  %node{i} = zext i{bits} %value{i} to i64",
        ]
        node, at = f"%node{i}", at + width
    head = f"define internal i64 @monitor.{k}(i64 %state, ptr noalias readonly %words) alwaysinline nounwind {{"
    return "\n".join([*data, head, *lines, f"  ret i64 {node}", "}"])


def _gather(places: Sequence[Place], prefix: str) -> tuple[list[str], str]:
    """Code that brings the bits at `places` together, in runs that lie together already; the name of the result."""
    runs: list[tuple[int, int, int, int]] = []  # word, shift, length, position
    for position, (word, shift) in enumerate(places):
        if runs:
            w, s, length, p = runs[-1]
            if w == word and s + length == shift:
                runs[-1] = (w, s, length + 1, p)
                continue
        runs.append((word, shift, 1, position))
    lines: list[str] = []
    result = "0"
    for r, (word, shift, length, position) in enumerate(runs):
        name = f"%{prefix}.{r}"
        lines += [
            f"  {name}.p = getelementptr i64, ptr %words, i64 {word}",
            f"  {name}.w = load i64, ptr {name}.p",
            f"  {name}.s = lshr i64 {name}.w, {shift}",
        ]
        cut = f"{name}.s"
        if shift + length < WORD_BITS:
            lines.append(f"  {name}.m = and i64 {cut}, {(1 << length) - 1}")
            cut = f"{name}.m"
        lines += [f"  {name}.l = shl i64 {cut}, {position}", f"  {name} = or i64 {result}, {name}.l"]
        result = name
    return lines, result


def atom_places(atoms: Sequence[str], known: Mapping[str, Place]) -> list[Place]:
    """Where each atom lies. ValueError: one is unknown."""
    missing = [key for key in atoms if key not in known]
    if missing:
        raise ValueError(f"letters do not show {', '.join(missing)}")
    return [known[key] for key in atoms]


def by_word(atoms: Iterable[str]) -> dict[str, Place]:
    """Atoms as the bits of consecutive words, the first the lowest bit of the first word."""
    return {key: divmod(i, WORD_BITS) for i, key in enumerate(atoms)}
