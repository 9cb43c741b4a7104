// What is drawn of a run in so many pixels: stretches of values, ticks, marks; without any drawing.

import { SYMBOLS, lastAt, wordTime } from "./model.js";

export const LETTER = 7.2;
const NARROW = 3;
const APART = 90;

/** Pixels rounded to tenths, halves up. */
export function tenths(pixels) {
  return Math.floor(pixels * 10 + 0.5) / 10;
}

/** What is drawn of the rows `first` to `last` of a run in `width` pixels. */
export function shapes(view, run, first, last, width) {
  const step = width / (last - first + 1);
  const lanes = view.signals.map((signal, index) => laneShapes(signal, run.changes[index], first, last, step));
  return { lanes, ticks: tickShapes(run, first, last, step, view.arrangement?.cycle_ms) };
}

/**
 * Stretches of a value, begin to end. Narrow ones that touch are one without a value, as long as they begin within
 * `NARROW` pixels; `low` and `high` say how high its values are, where they are drawn as levels or curves.
 */
function laneShapes(signal, { at, values }, first, last, step) {
  const found = [];
  let dense = null;
  let since = 0;
  for (let i = Math.max(0, lastAt(at, first)); i < at.length && at[i] <= last; i += 1) {
    const from = Math.max(at[i], first);
    const to = i + 1 < at.length ? Math.min(at[i + 1], last + 1) : last + 1;
    const height = signal.draw === "boxes" ? null : heightOf(signal, values[i]);
    if (dense && (to - from) * step < NARROW && (from - since) * step < NARROW) {
      Object.assign(dense, { end: tenths((to - first) * step), value: null });
      if (height !== null) dense.low = Math.min(dense.low, height);
      if (height !== null) dense.high = Math.max(dense.high, height);
      continue;
    }
    const one = { begin: tenths((from - first) * step), end: tenths((to - first) * step), value: values[i] };
    if (height !== null) Object.assign(one, { low: height, high: height });
    dense = (to - from) * step < NARROW ? one : null;
    since = from;
    found.push(one);
  }
  return found;
}

/** How high a value is between the lowest, 0, and the highest, 1, in thousandths. */
function heightOf({ draw: how, low, high }, value) {
  if (how === "levels") return value === true || value === 1 ? 1 : 0;
  const [least, most] = [Number(low), Number(high)];
  return most > least ? Math.floor(((Number(value) - least) / (most - least)) * 1000 + 0.5) / 1000 : 0.5;
}

/** Ticks where cycles begin at round times, or, without times, where cycles of round numbers begin. */
function tickShapes(run, first, last, step, period) {
  const { cycle, time_ms: time } = run.rows;
  const ticks = [];
  if (last >= cycle.length) return ticks;
  const zero = time && period ? cycle[last] - Math.floor(time[last] / period + 0.5) : 0;
  const apart = cyclesApart(((cycle[last] - cycle[first]) * APART) / ((last - first + 1) * step), time && period);
  const from = Math.max(0, Math.ceil((cycle[first] - zero) / apart) * apart);
  for (let next = from; next + zero <= cycle[last]; next += apart) {
    const row = lastAt(cycle, next + zero - 1) + 1;
    const x = tenths((row - first) * step);
    const close = ticks.length && x - ticks[ticks.length - 1].x < APART / 2;
    if (cycle[row] !== next + zero || row < first || close) continue;
    ticks.push({ x, text: time ? wordTime(time[row]) : `cycle ${next}` });
  }
  return ticks;
}

/** At least so many cycles between ticks: those of a round time if they are whole, else a round number of them. */
function cyclesApart(wanted, period) {
  const usual = roundUp(wanted);
  if (!period) return usual;
  for (let time = roundUp(wanted * period); time <= 5 * usual * period; time = roundUp(time * 1.5)) {
    const cycles = Math.floor(time / period + 0.5);
    if (cycles >= 1 && Math.abs(time / period - cycles) < 1e-9) return cycles;
  }
  return usual;
}

/** The least of 1, 2 or 5 times a power of ten that is at least this. */
export function roundUp(wanted) {
  if (!(wanted > 1)) return 1;
  const power = 10 ** Math.floor(Math.log10(wanted));
  return [1, 2, 5, 10].map((part) => part * power).find((one) => one >= wanted);
}

/** Where marks stand above the lanes, the first ones first, with words where there is room; none lies on another. */
export function placeMarks(marks, width) {
  const placed = [];
  const apart = (one, other) => one.to < other.from - 4 || one.from > other.to + 4;
  const free = (one) => one.from >= 0 && one.to <= width && placed.every((other) => apart(one, other));
  for (const { x: wanted, kind, words } of marks) {
    const x = Math.max(6, Math.min(width - 6, wanted));
    const room = LETTER * (words.length + 2);
    const ways = [
      { side: "start", x: x - 4, text: `${SYMBOLS[kind]} ${words}`, from: x - 4, to: x - 4 + room },
      { side: "end", x: x + 4, text: `${words} ${SYMBOLS[kind]}`, from: x + 4 - room, to: x + 4 },
      { side: "middle", x, text: SYMBOLS[kind], from: x - 5, to: x + 5 },
    ];
    const found = ways.slice(words ? 0 : 2).find(free);
    if (found) placed.push({ ...found, kind });
  }
  return placed;
}
