"""Timelines as a timing diagram: a lane for each signal, in groups, time from left to right, in the shapes of pages."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, BinaryIO
from xml.etree import ElementTree as ET

from llfsm_verify.extensions.view.colours import colour_of
from llfsm_verify.extensions.view.shapes import shapes
from llfsm_verify.extensions.view.values import FEW, exact, group_of
from llfsm_verify.plug import Signal, Timeline, take, text
from llfsm_verify.plug import TimelineRow as Row

MOST_ROWS = 2000
LANE, GAP, GROUP, HEAD, FOOT, MARGIN = 24, 10, 20, 68, 40, 16
LETTER = 7.2
"""Width of a letter of the font, 12 pixels high."""
NARROWEST, WIDEST, USUAL = 4.0, 60.0, 900.0
"""Pixels of a row at least and at most, and of the whole diagram where that allows it."""
MOST_NAME, MOST_TITLE = 48, 110
"""Letters that are written of a name, and of a title; the rest is left out."""
INK, QUIET, DENSE, BAD, LOOP = "#1c2733", "#56626e", "#c3cad1", "#a8201a", "#1f4e9c"
STYLE = (
    f"text{{font:12px 'DejaVu Sans Mono',Menlo,Consolas,monospace;fill:{INK}}}.quiet{{fill:{QUIET}}}"
    f".bad{{fill:{BAD};font-weight:bold}}.loop{{fill:{LOOP}}}.title{{font-weight:bold}}"
)


def write_svg(timeline: Timeline, file: BinaryIO) -> None:
    """States, values of enumerations and few numbers are boxes with their names, Booleans lines of two levels, many
    numbers curves between their least and greatest. Signals that never change are listed below. The step that violates
    the property of a trace and its loop are marked. What is too long says how much it shows."""
    rows, more = take(timeline.rows, MOST_ROWS)
    moving = [i for i in range(len(timeline.signals)) if len({row.values[i] for row in rows}) > 1]
    still = [i for i in range(len(timeline.signals)) if i not in moving]
    groups = [_short(group, MOST_NAME) for group in dict.fromkeys(group_of(timeline.signals[i]) for i in moving)]
    moving.sort(key=lambda i: groups.index(_short(group_of(timeline.signals[i]), MOST_NAME)))
    names = [_short(timeline.signals[i].name, MOST_NAME) for i in moving]
    left = MARGIN + LETTER * max([*map(len, names), *map(len, groups), 4]) + 12
    step = min(WIDEST, max(NARROWEST, USUAL / max(1, len(rows))))
    right = left + step * len(rows)
    title = _short(": ".join(filter(None, (timeline.title, timeline.shows))), MOST_TITLE)
    notes = list(_notes(timeline, rows, still, more, right))
    bottom = HEAD + len(moving) * (LANE + GAP) + len(groups) * GROUP
    height = bottom + FOOT + 18 * len(notes)
    width = max([right, *(MARGIN + LETTER * len(line) for line in (title, *notes))]) + MARGIN
    root = ET.Element(
        "svg", xmlns="http://www.w3.org/2000/svg", width=f"{width:.0f}", height=f"{height:.0f}",
        viewBox=f"0 0 {width:.0f} {height:.0f}", role="img",
    )  # fmt: skip
    ET.SubElement(root, "title").text = title
    ET.SubElement(root, "style").text = STYLE
    ET.SubElement(root, "rect", width="100%", height="100%", fill="white")
    _write(root, MARGIN, 20, title, kind="title")
    entries = [_entry(timeline.signals[i], [row.values[i] for row in rows]) for i in moving]
    if rows:
        times = [timeline.time_ms(row) for row in rows]
        changes = [_changes([row.values[i] for row in rows]) for i in moving]
        columns = {
            "cycle": [row.cycle for row in rows],
            "time_ms": None if None in times else [float(time) for time in times if time is not None],
        }
        run = {"rows": columns, "changes": changes}
        cycle_ms = None if timeline.cycle_ms is None else float(timeline.cycle_ms)
        document = {"signals": entries, "arrangement": {"cycle_ms": cycle_ms}}
        drawn = shapes(document, run, 0, len(rows) - 1, step * len(rows))
        _marks(root, timeline, rows, (left, step, bottom))
        _axis(root, drawn["ticks"], left, right, bottom)
        top, group = HEAD - LANE - GAP, ""
        for lane, (name, entry) in enumerate(zip(names, entries, strict=True)):
            top += LANE + GAP
            if entry["group"] != group:
                group = entry["group"]
                _write(root, MARGIN, top + 12, _short(group, MOST_NAME), kind="quiet")
                top += GROUP
            _write(root, left - 12, top + 16, name, anchor="end")
            draw = _boxes if entry["draw"] == "boxes" else _line
            draw(root, entry, [_moved(one, left) for one in drawn["lanes"][lane]], top)
    for number, note in enumerate(notes):
        _write(root, MARGIN, bottom + FOOT + 18 * number, note, kind="quiet")
    file.write(ET.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")


def _entry(signal: Signal, values: Sequence[Any]) -> dict[str, Any]:
    """The signal as a page has it, a number from the least to the greatest that is shown."""
    found: dict[str, Any] = {
        "name": signal.name, "group": group_of(signal), "draw": "boxes", "labels": signal.labels,
    }  # fmt: skip
    if signal.labels:
        return found
    if signal.type.boolean:
        return found | {"draw": "levels"}
    if len(set(values)) <= FEW:
        return found
    return found | {"draw": "curve", "low": exact(min(values)), "high": exact(max(values))}


def _changes(values: Sequence[Any]) -> dict[str, list[Any]]:
    at = [i for i, value in enumerate(values) if i == 0 or value != values[i - 1]]
    return {"at": at, "values": [values[i] for i in at]}


def _moved(stretch: dict[str, Any], left: float) -> dict[str, Any]:
    return stretch | {"begin": left + stretch["begin"], "end": left + stretch["end"]}


def _boxes(root: ET.Element, entry: dict[str, Any], stretches: Sequence[dict[str, Any]], top: float) -> None:
    for stretch in stretches:
        begin, end, dense = stretch["begin"], stretch["end"], stretch["value"] is None
        label = "" if dense else text(stretch["value"])
        fill = DENSE if dense else colour_of(label)[0] if label in entry["labels"] else "#f3f5f7"
        box = _box(root, begin, end, top, LANE, fill=fill, stroke=INK)
        box.set("stroke-width", "0.7")
        _tell(box, entry, stretch)
        room = int((end - begin - 4) / LETTER)
        if len(label) > room:
            label = label[: room - 1] + "…" if room >= 3 else ""
        if label:
            _write(root, (begin + end) / 2, top + 16, label, anchor="middle")


def _tell(box: ET.Element, entry: dict[str, Any], stretch: dict[str, Any]) -> None:
    """The exact value, for whoever points at the box."""
    value = stretch["value"]
    said = "changes that are too many to be drawn" if value is None else _short(text(value), MOST_TITLE)
    ET.SubElement(box, "title").text = f"{entry['name']} = {said}"


def _line(root: ET.Element, entry: dict[str, Any], stretches: Sequence[dict[str, Any]], top: float) -> None:
    def y(height: float) -> float:
        return top + 3 + (LANE - 6) * (1 - height)

    points = []
    for s in stretches:
        begin, end, low, high = s["begin"], s["end"], s["low"], s["high"]
        points += [f"{begin:.1f},{y(low):.1f}", f"{end:.1f},{y(low):.1f}"]
        if s["value"] is None:
            _box(root, begin, end, y(high) - 1, y(low) - y(high) + 2, fill=DENSE)
        elif entry["draw"] == "levels" and high > 0:
            _box(root, begin, end, top + 3, LANE - 6, fill="#dbe9f8")
        _tell(_box(root, begin, end, top, LANE, **{"fill": "none", "pointer-events": "all"}), entry, s)
    line = ET.SubElement(root, "polyline", points=" ".join(points), fill="none", stroke=INK)
    line.set("stroke-width", "1.4")
    for s in stretches if entry["draw"] == "curve" else ():
        label = "" if s["value"] is None else text(s["value"])
        if label and LETTER * len(label) < s["end"] - s["begin"] - 6:
            at = (s["begin"] + s["end"]) / 2
            _write(root, at, top + (22 if s["low"] > 0.5 else 10), label, anchor="middle", kind="quiet")


def _marks(root: ET.Element, timeline: Timeline, rows: Sequence[Row], place: tuple[float, float, float]) -> None:
    """The loop and the step that violates, each as a stretch behind the lanes with words above them."""
    left, step, bottom = place
    right = left + step * len(rows)
    at = {row.step: index for index, row in enumerate(rows)}
    taken = (0.0, 0.0)
    if timeline.loop in at:
        begin = left + step * at[timeline.loop]
        _box(root, begin, right, HEAD - 4, bottom - HEAD + 4, fill="#eaf0f9")
    if timeline.failed in at:
        begin = left + step * at[timeline.failed]
        _box(root, begin, begin + step, HEAD - 4, bottom - HEAD + 4, fill="#fde3e1")
        words = _fitting(f"✗ violates {timeline.shows}".rstrip(), right - left, "✗")
        x = max(left, min(begin, right - LETTER * len(words)))
        taken = (x - LETTER, x + LETTER * (len(words) + 1))
        _write(root, x, 40, words, kind="bad")
    if timeline.loop in at:
        x = left + step * at[timeline.loop]
        for words in ("↻ repeats forever", "↻"):
            end = x + LETTER * len(words)
            if end <= right + MARGIN and (end < taken[0] or x > taken[1]):
                _write(root, x, 40, words, kind="loop")
                break


def _axis(root: ET.Element, ticks: Sequence[dict[str, Any]], left: float, right: float, bottom: float) -> None:
    """Ticks where cycles of round numbers begin, with their times where there are times."""
    end = -1.0
    for tick in ticks:
        x, label = left + tick["x"], tick["text"]
        line = ET.SubElement(
            root, "line", x1=f"{x:.1f}", x2=f"{x:.1f}", y1=f"{HEAD - 6}", y2=f"{bottom}", stroke="#c9d0d7"
        )
        line.set("stroke-dasharray", "2 3")
        half = LETTER * len(label) / 2
        if x - half > end and x + half <= right + MARGIN:
            _write(root, x, HEAD - 10, label, anchor="middle", kind="quiet")
            end = x + half + LETTER


def _notes(timeline: Timeline, rows: Sequence[Row], still: Sequence[int], more: bool, right: float) -> Iterator[str]:
    if more:
        yield f"only the first {len(rows):,} rows are shown; choose a part with --steps"
    if timeline.loop is not None:
        yield f"from step {timeline.loop} on it repeats forever"
    if still and rows:
        line = "constant: "
        for i in still:
            said = f"{_short(timeline.signals[i].name, MOST_NAME)} = {_short(text(rows[0].values[i]), MOST_NAME)}"
            if len(line) > 10 and LETTER * (len(line) + len(said)) > max(right, USUAL) - MARGIN:
                yield line.rstrip(", ")
                line = "          "
            line += said + ", "
        yield line.rstrip(", ")


def _short(words: str, most: int) -> str:
    """Without its middle if it is longer."""
    return words if len(words) <= most else f"{words[: most // 2]}…{words[1 - most // 2 :]}"


def _fitting(words: str, pixels: float, least: str) -> str:
    """As much as has room."""
    room = int(pixels / LETTER)
    return words if len(words) <= room else words[: room - 1] + "…" if room >= 4 else least


def _box(root: ET.Element, begin: float, end: float, top: float, height: float, **style: str) -> ET.Element:
    place = {"x": begin, "y": top, "width": end - begin, "height": height}
    return ET.SubElement(root, "rect", {name: f"{value:.1f}" for name, value in place.items()} | style)


def _write(root: ET.Element, x: float, y: float, words: str, *, anchor: str = "start", kind: str = "") -> None:
    element = ET.SubElement(root, "text", x=f"{x:.1f}", y=f"{y:.1f}")
    element.set("text-anchor", anchor)
    element.set("xml:space", "preserve")
    if kind:
        element.set("class", kind)
    element.text = words
