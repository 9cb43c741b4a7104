"""Timelines as a timing diagram: a lane for each signal, time from left to right."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise
from typing import BinaryIO, NamedTuple
from xml.etree import ElementTree as ET

from llfsm_verify.plug import Shown, Signal, Timeline, take, text
from llfsm_verify.plug import TimelineRow as Row

MOST_ROWS = 2000
LANE, GAP, HEAD, FOOT, MARGIN = 24, 10, 44, 40, 16
LETTER = 7.2
"""Width of a letter of the font, 12 pixels high."""
NARROWEST, WIDEST, USUAL = 4.0, 60.0, 900.0
"""Pixels of a row at least and at most, and of the whole diagram where that allows it."""
TICKS = 8
COLOURS = ("#cfe3f6", "#fbe0bd", "#d6efd2", "#ecd6f0", "#f6d3d3", "#d9e6e4", "#efe9c3", "#e2e2ea")
INK, QUIET = "#1c2733", "#8a94a0"
STYLE = f"text{{font:12px 'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:{INK}}}.quiet{{fill:{QUIET}}}"


class _Stretch(NamedTuple):
    """A value from one moment to another, in pixels."""

    begin: float
    end: float
    value: Shown


def write_svg(timeline: Timeline, file: BinaryIO) -> None:
    """States and values of enumerations are boxes with their names, Booleans lines of two levels, numbers boxes whose
    text is their value. Signals that never change are listed below. What is too long says how much it shows."""
    rows, more = take(timeline.rows, MOST_ROWS)
    moving = [i for i in range(len(timeline.signals)) if len({row.values[i] for row in rows}) > 1]
    still = [i for i in range(len(timeline.signals)) if i not in moving]
    left = MARGIN + LETTER * max([len(timeline.signals[i].name) for i in moving] + [4]) + 12
    step = min(WIDEST, max(NARROWEST, USUAL / max(1, len(rows))))
    right = left + step * len(rows)
    notes = list(_notes(timeline, rows, still, more, right))
    height = HEAD + len(moving) * (LANE + GAP) + FOOT + 18 * len(notes)
    width = max(right + MARGIN, left + LETTER * len(timeline.title))
    root = ET.Element(
        "svg", xmlns="http://www.w3.org/2000/svg", width=f"{width:.0f}", height=f"{height:.0f}",
        viewBox=f"0 0 {width:.0f} {height:.0f}", role="img",
    )  # fmt: skip
    ET.SubElement(root, "title").text = timeline.title
    ET.SubElement(root, "style").text = STYLE
    ET.SubElement(root, "rect", width="100%", height="100%", fill="white")
    _write(root, MARGIN, 20, timeline.title, weight="bold")
    bottom = HEAD + len(moving) * (LANE + GAP)
    _axis(root, timeline, rows, left, step, bottom)
    for lane, number in enumerate(moving):
        top = HEAD + lane * (LANE + GAP)
        signal = timeline.signals[number]
        _write(root, left - 12, top + 16, signal.name, anchor="end")
        stretches = list(_stretches(rows, number, left, step))
        if signal.type.boolean and not signal.labels:
            _levels(root, stretches, top)
        else:
            _boxes(root, signal, stretches, top)
    for number, note in enumerate(notes):
        _write(root, MARGIN, bottom + FOOT + 18 * number, note, quiet=True)
    file.write(ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _stretches(rows: Sequence[Row], number: int, left: float, step: float) -> Iterator[_Stretch]:
    begin = 0
    for i in range(1, len(rows) + 1):
        if i == len(rows) or rows[i].values[number] != rows[begin].values[number]:
            yield _Stretch(left + step * begin, left + step * i, rows[begin].values[number])
            begin = i


def _boxes(root: ET.Element, signal: Signal, stretches: Sequence[_Stretch], top: float) -> None:
    for stretch in stretches:
        label = text(stretch.value)
        colour = COLOURS[signal.labels.index(label) % len(COLOURS)] if label in signal.labels else "#f3f5f7"
        box = ET.SubElement(
            root, "rect", x=f"{stretch.begin:.1f}", y=f"{top}", width=f"{stretch.end - stretch.begin:.1f}",
            height=f"{LANE}", fill=colour, stroke=INK,
        )  # fmt: skip
        box.set("stroke-width", "0.7")
        ET.SubElement(box, "title").text = f"{signal.name} = {label}"
        room = int((stretch.end - stretch.begin - 4) / LETTER)
        if len(label) > room:
            label = label[: room - 1] + "…" if room >= 3 else ""
        if label:
            _write(root, (stretch.begin + stretch.end) / 2, top + 16, label, anchor="middle")


def _levels(root: ET.Element, stretches: Sequence[_Stretch], top: float) -> None:
    points = []
    for stretch in stretches:
        y = top + 3 if stretch.value else top + LANE - 3
        points += [f"{stretch.begin:.1f},{y}", f"{stretch.end:.1f},{y}"]
        if stretch.value:
            ET.SubElement(
                root, "rect", x=f"{stretch.begin:.1f}", y=f"{top + 3}", width=f"{stretch.end - stretch.begin:.1f}",
                height=f"{LANE - 6}", fill="#dbe9f8",
            )  # fmt: skip
    line = ET.SubElement(root, "polyline", points=" ".join(points), fill="none", stroke=INK)
    line.set("stroke-width", "1.4")


def _axis(root: ET.Element, timeline: Timeline, rows: Sequence[Row], left: float, step: float, bottom: float) -> None:
    """Ticks where cycles begin, at round times where there are times."""
    begins = [i for i, (before, row) in enumerate(pairwise(rows), 1) if row.cycle != before.cycle]
    begins = [0, *begins] if rows else []
    apart = _round(len(begins))
    end = -1.0
    for i in begins:
        row = rows[i]
        if row.cycle % apart:
            continue
        x = left + step * i
        line = ET.SubElement(
            root, "line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=f"{HEAD - 6}", y2=f"{bottom}", stroke="#c9d0d7"
        )
        line.set("stroke-dasharray", "2 3")
        time = timeline.time_ms(row)
        label = f"cycle {row.cycle}" if time is None else _time(time)
        if x - LETTER * len(label) / 2 > end:
            _write(root, x, HEAD - 10, label, anchor="middle", quiet=True)
            end = x + LETTER * (len(label) / 2 + 1)


def _round(cycles: int) -> int:
    """So many cycles between two ticks: 1, 2 or 5 times a power of ten, of cycles."""
    apart = 1
    while True:
        for part in (1, 2, 5):
            if cycles / (apart * part) <= TICKS:
                return apart * part
        apart *= 10


def _time(milliseconds: Fraction) -> str:
    if milliseconds >= 1000 or milliseconds == 0:
        return f"{float(milliseconds / 1000):g} s"
    return f"{float(milliseconds):g} ms"


def _notes(timeline: Timeline, rows: Sequence[Row], still: Sequence[int], more: bool, right: float) -> Iterator[str]:
    if more:
        yield f"only the first {len(rows):,} rows are shown; choose a part with --steps"
    if timeline.loop is not None:
        yield f"from step {timeline.loop} on it repeats forever"
    if still and rows:
        line = "constant: "
        for i in still:
            said = f"{timeline.signals[i].name} = {text(rows[0].values[i])}"
            if len(line) > 10 and LETTER * (len(line) + len(said)) > max(right, USUAL) - MARGIN:
                yield line.rstrip(", ")
                line = "          "
            line += said + ", "
        yield line.rstrip(", ")


def _write(
    root: ET.Element, x: float, y: float, words: str, *, anchor: str = "start", quiet: bool = False,
    weight: str = "normal",
) -> None:  # fmt: skip
    element = ET.SubElement(root, "text", x=f"{x:.1f}", y=f"{y:.1f}")
    element.set("text-anchor", anchor)
    element.set("xml:space", "preserve")
    if quiet:
        element.set("class", "quiet")
    if weight != "normal":
        element.set("font-weight", weight)
    element.text = words
