// Draws a run as a timing diagram: lanes of boxes, levels and curves in groups that fold; zooms, pans, tells values.

import { draw, dress, fill, make, say, sayQuoted } from "./drawing.js";
import { KINDS, SYMBOLS, clip, listOrder, marksAt, rowCount, spell, valueAt, wordRow, wordValue } from "./model.js";
import { LETTER, placeMarks, shapes, tenths } from "./shapes.js";

const LANE = 24;
const GAP = 10;
const GROUP = 28;
const HEAD = 48;
const USUAL_ROWS = 200;
const FEWEST_ROWS = 4;
const GRAVE = ["violation", "fault", "reached", "cause"];
const HINT = "Click to go to a row. The wheel pans with Shift, and zooms with Ctrl or once the diagram was clicked.";

/** Draw the timing diagram of a walk. Returns functions that show its row, zoom and pan. */
export function createTiming(section, view, walk, { go, watch, style }) {
  const folded = new Set();
  const order = listOrder(view);
  const groups = [...new Set(order.map((i) => view.signals[i].group))];
  const names = make("div", { class: "names" });
  const axis = draw("svg", { class: "axis", "aria-hidden": "true" });
  const picture = draw("svg", { class: "lanes", role: "img" });
  const here = draw("rect", { class: "here", y: 0 });
  const pin = draw("rect", { class: "here", y: HEAD - 3, height: 3 });
  const cross = draw("line", { class: "cross", y1: 0 });
  const field = make("div", { class: "field", tabindex: 0, role: "group" }, axis, picture);
  const grid = make("div", { class: "timing" }, names, field);
  const still = make("p", { class: "still quiet" });
  const all = make("input", { type: "checkbox", id: "constant", onchange: () => relist() });
  const readout = make("output", { class: "readout" });
  const range = make("span", { class: "quiet range" });
  const tool = (text, title, onclick) => make("button", { type: "button", text, "aria-label": title, title, onclick });
  fill(section, make("div", { class: "buttons" }, tool("−", "Zoom out (-)", () => zoom(2)),
    tool("+", "Zoom in (+)", () => zoom(0.5)), tool("Fit", "Show the whole run (0)", fit),
    tool("‹", "Earlier (<)", () => pan(-0.5)), tool("›", "Later (>)", () => pan(0.5)), range,
    make("label", {}, all, " constant signals too"), readout), grid, still,
  make("p", { class: "quiet hint", text: HINT }));
  const state = { first: 0, last: 0, width: 0, height: 0, hover: null, stale: true };
  let tops = new Map();
  let labels = [];

  function fit() {
    look(0, walk.last);
  }

  function look(first, last) {
    const most = walk.last;
    const span = Math.min(most, Math.max(FEWEST_ROWS - 1, last - first));
    state.first = Math.max(0, Math.min(Math.round(first), most - span));
    state.last = state.first + Math.round(span);
    state.stale = true;
    show();
  }

  function zoom(factor, at = walk.row) {
    const { first, last } = state;
    const middle = at >= first && at <= last ? at : (first + last) / 2;
    look(middle - (middle - first) * factor, middle + (last - middle) * factor);
  }

  function pan(part) {
    const by = Math.trunc((state.last - state.first + 1) * part) || Math.sign(part);
    look(state.first + by, state.last + by);
  }

  function load() {
    state.stale = true;
    state.hover = null;
    readout.textContent = "";
    listNames();
    look(0, walk.last < 2 * USUAL_ROWS ? walk.last : USUAL_ROWS - 1);
  }

  /** A live run has more rows. */
  function grow() {
    const span = Math.max(USUAL_ROWS - 1, state.last - state.first);
    if (walk.follow) Object.assign(state, { last: walk.last, first: Math.max(0, walk.last - span) });
    state.last = Math.min(walk.last, Math.max(state.last, Math.min(walk.last, span)));
    state.first = Math.min(state.first, state.last);
    state.stale = true;
    if (walk.run.changes.filter((change) => change.at.length > 1).length !== state.moving) listNames();
  }

  function listNames() {
    tops = new Map();
    labels = [];
    const rows = [make("div", { class: "corner", style: `height: ${HEAD}px` })];
    let top = 0;
    const moves = (index) => walk.run.changes[index].at.length > 1;
    const [moving, constant] = [true, false].map((which) => order.filter((i) => moves(i) === which));
    const word = (i) => clip(wordValue(valueAt(walk.run, i, 0), view.signals[i]), 40);
    const words = constant.map((i) => `${clip(view.signals[i].name, 60)} = ${word(i)}`);
    still.textContent = words.length && !all.checked ? `constant: ${words.join(", ")}` : "";
    state.moving = moving.length;
    for (const group of groups) {
      const open = !folded.has(group);
      const own = (all.checked ? order : moving).filter((i) => view.signals[i].group === group);
      if (!own.length) continue;
      rows.push(make("button", {
        type: "button", class: "group", "aria-expanded": open, "data-group": group, style: `height: ${GROUP}px`,
        text: `${open ? "▾" : "▸"} ${clip(group, 40)} (${own.length})`, onclick: () => fold(group),
      }));
      top += GROUP;
      for (const index of open ? own : []) {
        const value = make("span", { class: "value" });
        const name = make("button", {
          type: "button", class: "name", "aria-pressed": false, "data-lane": index, onclick: () => watch(index),
          title: `Watch ${clip(view.signals[index].name)}`,
        }, ...halves(clip(view.signals[index].name, 80)));
        labels.push({ index, name, value });
        rows.push(make("div", { class: "label", style: `height: ${LANE + GAP}px` }, name, value));
        tops.set(index, top + GAP / 2);
        top += LANE + GAP;
      }
    }
    state.height = top;
    names.replaceChildren(...rows);
  }

  function fold(group) {
    if (!folded.delete(group)) folded.add(group);
    relist();
    names.querySelector(`[data-group="${CSS.escape(group)}"]`).focus();
  }

  function relist() {
    listNames();
    state.stale = true;
    show();
  }

  function show() {
    const { run, row } = walk;
    if (!rowCount(run)) return;
    const span = state.last - state.first;
    if (row < state.first || row > state.last) {
      state.first = Math.max(0, Math.min(walk.last - span, row - Math.round(span * (row > state.last ? 0.1 : 0.9))));
      state.last = state.first + span;
      state.stale = true;
    }
    if (state.stale) drawLanes(state.width || wide());
    const step = state.width / (state.last - state.first + 1);
    for (const mark of [here, pin]) {
      mark.setAttribute("x", tenths((row - state.first) * step));
      mark.setAttribute("width", Math.max(2, tenths(step)));
    }
    for (const { index, name, value } of labels) {
      say(value, clip(wordValue(valueAt(run, index, state.hover ?? row), view.signals[index]), 24));
      name.setAttribute("aria-pressed", walk.watched.has(index));
    }
    field.setAttribute("aria-label", `Timing diagram, rows ${state.first} to ${state.last}`);
    Object.assign(grid.dataset, { first: state.first, last: state.last, row });
  }

  function wide() {
    return Math.max(100, field.clientWidth);
  }

  function drawLanes(width) {
    const { run } = walk;
    Object.assign(state, { width, stale: false });
    const found = shapes(view, run, state.first, state.last, width);
    for (const [svg, height] of [[axis, HEAD], [picture, state.height]]) {
      dress(svg, { width, height, viewBox: `0 0 ${width} ${height}`, preserveAspectRatio: "none" });
    }
    picture.setAttribute("aria-label", `Timing diagram of ${clip(run.title)}`);
    here.setAttribute("height", state.height);
    cross.setAttribute("y2", state.height);
    const back = draw("g", { class: "back" });
    const over = draw("g", { class: "marks" });
    const head = draw("g", {});
    const step = width / (state.last - state.first + 1);
    let end = 0;
    for (const { x, text } of found.ticks) {
      back.append(draw("line", { class: "tick", x1: x, x2: x, y1: 0, y2: state.height }));
      const half = (LETTER * text.length) / 2;
      const middle = Math.max(half, Math.min(width - half, x));
      if (middle - half < end) continue;
      head.append(draw("text", { class: "tick", x: tenths(middle), y: HEAD - 4, "text-anchor": "middle", text }));
      end = middle + half + LETTER;
    }
    drawLoop(run, step, width, back, head);
    drawMarks(run, step, back, over, head);
    const lanes = [...tops].map(([index, top]) => drawLane(view.signals[index], index, found.lanes[index], top, style));
    axis.replaceChildren(head, pin);
    picture.replaceChildren(back, here, ...lanes, over, cross);
    say(range, `rows ${spell(state.first)}–${spell(state.last)} of ${spell(walk.last)}`);
  }

  function drawLoop(run, step, width, back, head) {
    if (typeof run.loop !== "number" || state.last <= run.loop) return;
    const x = tenths(Math.max(0, (run.loop + 1 - state.first) * step));
    back.append(draw("rect", { class: "loop", x, y: 0, width: tenths(width - x), height: state.height }));
    head.append(draw("path", { class: "loop", d: `M${x} 20V16H${width - 1}V20` }));
    const text = width - x > 180 ? "↻ repeats forever" : "↻";
    if (width - x > 24) head.append(draw("text", { class: "loop", x: x + 4, y: 12, text }));
  }

  function drawMarks(run, step, back, over, head) {
    const shown = run.marks.filter((mark) => mark.row >= state.first && mark.row <= state.last).slice(0, 2000);
    const grave = (mark) => GRAVE.indexOf(mark.kind) + 1 || 9;
    const heads = shown.sort((a, b) => grave(a) - grave(b)).map((mark) => {
      const x = tenths((mark.row - state.first + 0.5) * step);
      const kind = `mark ${mark.kind}`;
      const group = draw("g", { class: kind, "data-row": mark.row });
      if (grave(mark) < 9) back.append(draw("line", { class: kind, x1: x, x2: x, y1: 0, y2: state.height }));
      const framed = grave(mark) < 9 || mark.kind === "verdict" ? mark.signals || [] : [];
      for (const top of framed.map((signal) => tops.get(signal)).filter((known) => known !== undefined)) {
        const side = Math.max(6, step);
        group.append(draw("rect", { x: tenths(x - side / 2), y: top - 1.5, width: tenths(side), height: LANE + 3 }),
          draw("text", { x, y: top - 2.5, "text-anchor": "middle", text: SYMBOLS[mark.kind] }));
      }
      over.append(group);
      const named = mark.kind === "violation" && run.property ? ` of ${clip(run.property, 40)}` : "";
      return { x, kind: mark.kind, words: grave(mark) < 4 ? `${KINDS[mark.kind]}${named}` : "" };
    });
    for (const { x, side, text, kind } of placeMarks(heads, state.width)) {
      head.append(draw("text", { class: `mark ${kind}`, x, y: 31, "text-anchor": side, text }));
    }
  }

  function rowUnder(event) {
    const { left } = field.getBoundingClientRect();
    const part = (event.clientX - left) / state.width;
    return Math.max(0, Math.min(walk.last, state.first + Math.floor(part * (state.last - state.first + 1))));
  }

  function point(event) {
    const row = rowUnder(event);
    const y = event.clientY - picture.getBoundingClientRect().top;
    const lane = [...tops].find(([, top]) => y >= top && y <= top + LANE);
    state.hover = row;
    const x = tenths(((row - state.first + 0.5) * state.width) / (state.last - state.first + 1));
    cross.setAttribute("x1", x);
    cross.setAttribute("x2", x);
    const said = marksAt(walk.run, row).map((mark) => `${SYMBOLS[mark.kind]} ${clip(mark.text)}`);
    const signal = lane && view.signals[lane[0]];
    if (lane) said.unshift(`${clip(signal.name, 60)} = ${clip(wordValue(valueAt(walk.run, lane[0], row), signal))}`);
    sayQuoted(readout, `${wordRow(walk.run, row)}${said.length ? `: ${said.join("; ")}` : ""}`);
    grid.classList.add("pointed");
    show();
    if (event.buttons & 1) go(row);
  }

  new ResizeObserver(() => {
    if (wide() === state.width) return;
    Object.assign(state, { width: wide(), stale: true });
    show();
  }).observe(field);
  field.addEventListener("pointermove", point);
  field.addEventListener("pointerdown", point);
  field.addEventListener("pointerleave", () => {
    state.hover = null;
    readout.textContent = "";
    grid.classList.remove("pointed");
    show();
  });
  field.addEventListener("wheel", (event) => {
    const focused = field.contains(document.activeElement);
    const sideways = event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY);
    if (!sideways && !event.ctrlKey && !focused) return;
    event.preventDefault();
    const by = event.deltaY || event.deltaX;
    if (sideways) pan(Math.sign(event.deltaX || event.deltaY) * 0.1);
    else zoom(by > 0 ? 1.25 : 0.8, rowUnder(event));
  }, { passive: false });
  return { load, show, grow, zoom, pan, fit };
}

/** A name in two parts, of which only the first one is shortened where there is no room: indices are at the end. */
function halves(name) {
  const end = name.length > 12 ? name.length - 6 : name.length;
  return [make("span", { class: "begin", text: name.slice(0, end) }), make("span", { text: name.slice(end) })];
}

/** One lane: boxes of one colour are one path, texts stand where they fit. */
function drawLane(signal, index, stretches, top, style) {
  const lane = draw("g", { class: `lane ${signal.draw}`, "data-signal": index, "data-count": stretches.length });
  if (signal.draw === "boxes") drawBoxes(lane, stretches, top, style);
  else drawLine(lane, signal, stretches, top);
  return lane;
}

function drawBoxes(lane, stretches, top, style) {
  const paths = new Map();
  const texts = [];
  for (const { begin, end, value } of stretches) {
    const name = value === null ? null : String(value);
    paths.set(name, `${paths.get(name) || ""}M${begin} ${top}H${end}V${top + LANE}H${begin}Z`);
    const room = Math.floor((end - begin - 6) / LETTER);
    if (room < 1 || name === null || (name.length > room && room < 3)) continue;
    const text = name.length > room ? `${name.slice(0, room - 1)}…` : name;
    texts.push(draw("text", { x: tenths((begin + end) / 2), y: top + 16.5, "text-anchor": "middle", text }));
  }
  for (const [name, d] of paths) {
    const path = draw("path", { d, class: name === null ? "dense" : "box" });
    if (name !== null) path.dataset.value = clip(name);
    if (name !== null) style(path, name);
    lane.append(path);
  }
  lane.append(...texts);
}

function drawLine(lane, signal, stretches, top) {
  const y = (height) => tenths(top + 3 + (LANE - 6) * (1 - height));
  let line = "";
  let area = "";
  let dense = "";
  for (const { begin, end, value, low, high } of stretches) {
    line += `${line ? "L" : "M"}${begin} ${y(low)}H${end}`;
    if (signal.draw === "levels" && high > 0) area += `M${begin} ${top + 3}H${end}V${top + LANE - 3}H${begin}Z`;
    if (value === null) dense += `M${begin} ${y(high) - 1}H${end}V${y(low) + 1}H${begin}Z`;
  }
  if (area) lane.append(draw("path", { class: "area", d: area }));
  if (dense) lane.append(draw("path", { class: "dense", d: dense }));
  lane.append(draw("path", { class: "line", d: line }));
  if (signal.draw !== "curve") return;
  for (const { begin, end, value, low } of stretches) {
    const text = String(value);
    if (value !== null && text.length * LETTER < end - begin - 6) {
      const at = { x: tenths((begin + end) / 2), y: low > 0.5 ? top + 22 : top + 10, "text-anchor": "middle" };
      lane.append(draw("text", { class: "number", ...at, text }));
    }
  }
}
