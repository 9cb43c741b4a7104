// Goes through a run: a slider over steps, cycles or time, play, and jumps to what one looks for.

import { make, quote, say } from "./drawing.js";
import { SYMBOLS, lastAt, nextChange, nextMark, rowAfter, rowCount, rowOfCycle, rowOfTime, spell, tell, wordRow } from "./model.js";

export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 50, 200, 1000];
export const JUMPS = {
  event: ["event", "cause", "reached", "verdict", "overrun", "missed"],
  violation: ["violation", "fault"],
};
const RATE = 4;
const RATES = { most: 12, part: 0.1 };

/**
 * Draws when it is asked to: `ask()` in the next frame; `offer()`, for what comes by itself, at most `RATES.most` times
 * a second, and so seldom that drawing takes at most `RATES.part` of the time. A hidden page draws nothing.
 */
export function createPace(draw, outside = globalThis) {
  let [waiting, timer, free] = [false, null, 0];
  const clock = () => outside.performance.now();
  const frame = (now) => {
    outside.clearTimeout(timer);
    [waiting, timer] = [false, null];
    const began = clock();
    const rest = () => (free = began + Math.max(1000 / RATES.most, (clock() - began) / RATES.part));
    draw(now);
    rest();
    outside.setTimeout(rest);
  };
  const ask = () => {
    if (!waiting) outside.requestAnimationFrame(frame);
    waiting = true;
  };
  const offer = () => {
    if (!waiting && timer === null) timer = outside.setTimeout(wake, Math.max(0, free - clock()));
  };
  const wake = () => {
    timer = null;
    if (clock() < free) offer();
    else ask();
  };
  return { ask, offer };
}

/** Where one is in a run: the row, the unit of the slider, whether it plays; without any drawing. */
export class Walk {
  constructor(run) {
    Object.assign(this, { unit: "step", speed: 1, playing: false, follow: false, watched: new Set() });
    this.load(run);
  }

  load(run) {
    Object.assign(this, { run, row: 0, laps: 0, debt: 0, playing: false });
    if (this.unit === "time" && !run.rows.time_ms) this.unit = "step";
  }

  get last() {
    return Math.max(0, rowCount(this.run) - 1);
  }

  /** The least and the greatest value of the slider, and the one of the row. */
  get scale() {
    const column = { step: null, cycle: this.run.rows.cycle, time: this.run.rows.time_ms }[this.unit];
    if (!column || !column.length) return { low: 0, high: this.last, now: this.row };
    return { low: column[0], high: column[this.last], now: column[this.row] };
  }

  /** Go to a value of the slider. */
  slide(value) {
    if (this.unit === "step") this.go(value);
    else this.go(this.unit === "cycle" ? rowOfCycle(this.run, value) : rowOfTime(this.run, value));
  }

  go(row) {
    this.row = Math.max(0, Math.min(this.last, Math.round(row)));
    this.laps = 0;
    this.follow = false;
  }

  /** One step, cycle or moment on or back. */
  move(way, unit = "step") {
    if (unit === "step") this.go(this.row + way);
    else this.go(way > 0 ? this.cycleAfter() : this.cycleBefore());
  }

  cycleAfter() {
    const { cycle } = this.run.rows;
    const next = lastAt(cycle, cycle[this.row]) + 1;
    return Math.min(next, this.last);
  }

  cycleBefore() {
    const { cycle } = this.run.rows;
    const first = rowOfCycle(this.run, cycle[this.row]);
    return first < this.row ? first : rowOfCycle(this.run, cycle[Math.max(0, first - 1)]);
  }

  /** Jump to the nearest `event`, `violation` or `change` of a watched signal (of any, if none is watched). */
  jump(what, way) {
    const signals = this.watched.size ? this.watched : this.run.changes.keys();
    const found = what === "change" ? nextChange(this.run, signals, this.row, way)
      : nextMark(this.run, JUMPS[what], this.row, way);
    if (found === null) return false;
    this.go(found);
    return true;
  }

  faster(way) {
    const at = SPEEDS.indexOf(this.speed) + way;
    this.speed = SPEEDS[Math.max(0, Math.min(SPEEDS.length - 1, at))];
  }

  /** Start or stop; at the end of a run that does not loop, from the start again. */
  toggle() {
    this.playing = !this.playing;
    this.debt = 0;
    if (this.playing && rowAfter(this.run, this.row) === this.row) this.go(0);
  }

  /** Play for so many milliseconds; whether the row is another one. */
  tick(elapsed) {
    if (!this.playing) return false;
    const before = this.row;
    this.debt += (elapsed * this.speed) / (this.unit === "time" ? 1 : 1000 / RATE);
    while (this.playing) {
      const next = this.unit === "cycle" ? this.turnCycle() : rowAfter(this.run, this.row);
      if (next === this.row) {
        this.playing = false;
        break;
      }
      const cost = this.unit === "time" ? this.wait(next) : 1;
      if (cost > this.debt) break;
      this.debt -= cost;
      if (next < this.row) this.laps += 1;
      this.row = next;
    }
    return this.row !== before;
  }

  turnCycle() {
    const next = this.cycleAfter();
    return next > this.row ? next : rowAfter(this.run, this.last);
  }

  wait(next) {
    const time = this.run.rows.time_ms;
    return next > this.row ? time[next] - time[this.row] : 1;
  }
}

/** Where a row is under a slider whose last row is `last`, in percent. */
export function tickAt(row, last) {
  return last > 0 ? Math.round((10000 * Math.min(row, last)) / last) / 100 : 0;
}

/** Draw the player of a walk. `changed` is called when a row was chosen. Returns functions to show and to load. */
export function createPlayer(place, view, walk, changed) {
  const act = (work) => () => {
    work();
    changed();
  };
  const button = (text, label, key, work) => make("button", {
    type: "button", "aria-label": label, title: `${label} (${key})`, "aria-keyshortcuts": key, onclick: act(work), text,
  });
  const slider = make("input", {
    type: "range", id: "slider", min: 0, value: 0, "aria-label": "Position in the run",
    oninput: act(() => walk.slide(Number(slider.value))),
  });
  const strip = make("div", { class: "strip", "aria-hidden": "true" });
  const play = button("", "Play", "Space", () => walk.toggle());
  play.id = "play";
  const units = make("select", { id: "unit", onchange: act(() => (walk.unit = units.value)) });
  const speeds = make("select", { id: "speed", onchange: act(() => (walk.speed = Number(speeds.value))) },
    ...SPEEDS.map((speed) => make("option", { value: speed, text: `${speed}×` })));
  const where = make("output", { id: "where", for: "slider" });
  const follow = button("Follow", "Follow the newest row", "f", () => (walk.follow = !walk.follow));
  follow.id = "follow";
  const jump = (what, key) => make("span", { class: "jump" },
    button("◂", `Previous ${what}`, key.toUpperCase(), () => walk.jump(what, -1)), make("span", { text: what }),
    button("▸", `Next ${what}`, key, () => walk.jump(what, 1)));
  place.replaceChildren(
    make("div", { class: "buttons" }, button("|◀", "First row", "Home", () => walk.go(0)),
      button("◁", "Row before", "ArrowLeft", () => walk.move(-1)), play,
      button("▷", "Row after", "ArrowRight", () => walk.move(1)),
      button("▶|", "Last row", "End", () => walk.go(walk.last)),
      jump("event", "e"), jump("violation", "v"), jump("change", "c"), follow,
      make("label", { text: "by " }, units), make("label", { text: "speed " }, speeds)),
    make("div", { class: "slide" }, slider, strip), where);

  function load() {
    const known = ["step", "cycle", ...(walk.run.rows.time_ms ? ["time"] : [])];
    units.replaceChildren(...known.map((unit) => make("option", { value: unit, text: unit })));
    follow.hidden = walk.run.kind !== "live";
    mark();
  }

  let ticks = [];

  function mark() {
    const { run, last } = walk;
    const past = run.forgotten || 0;
    const grave = run.marks.filter((one) => JUMPS.violation.includes(one.kind));
    const others = run.marks.length > 400 ? [] : run.marks.filter((one) => !grave.includes(one));
    const near = (one, other) => Math.abs(one.row - other.row) * 100 < last;
    const shown = [...grave, ...others].filter((one, i, all) => !all.slice(0, i).some((other) => near(one, other)));
    ticks = shown.slice(0, 400).map(({ kind, row }) => ({
      row: row + past, element: make("span", { class: `tick ${kind}`, text: SYMBOLS[kind] }),
    }));
    strip.replaceChildren(...ticks.map(({ element }) => element));
    place.dataset.size = "";
  }

  /** Put the ticks where their rows are now: rows come and are forgotten. */
  function putTicks() {
    const past = walk.run.forgotten || 0;
    const size = `${past} ${walk.last}`;
    if (place.dataset.size === size) return;
    place.dataset.size = size;
    for (const { row, element } of ticks) {
      element.style.left = `${tickAt(row - past, walk.last)}%`;
      element.hidden = row < past;
    }
  }

  function show() {
    const { low, high, now } = walk.scale;
    Object.assign(slider, { min: low, max: high, step: walk.unit === "time" ? "any" : 1, value: now });
    slider.setAttribute("aria-valuetext", wordRow(walk.run, walk.row));
    const loop = walk.laps ? `, loop ${walk.laps + 1}` : "";
    say(where, `${wordRow(walk.run, walk.row)} (row ${spell(walk.row)} of ${spell(walk.last)}${loop})`);
    place.dataset.row = walk.row;
    place.dataset.laps = walk.laps;
    say(play, walk.playing ? "❚❚ Pause" : "▶ Play");
    play.setAttribute("aria-label", walk.playing ? "Pause" : "Play");
    follow.setAttribute("aria-pressed", walk.follow);
    units.value = walk.unit;
    speeds.value = walk.speed;
    strip.hidden = walk.unit !== "step";
    putTicks();
  }

  return { load, show, mark };
}

/** Tell a row in words, when it is still the same a moment later, or at once if the run violates there. */
export function createTeller(place, view, walk, moment = 350) {
  let waiting = null;
  let told = -1;
  const tellNow = () => {
    waiting = null;
    if (told === walk.row && place.textContent) return;
    told = walk.row;
    place.replaceChildren(...quote(tell(view, walk.run, walk.row)));
  };
  return () => {
    const urgent = walk.playing && walk.run.marks.some((mark) => mark.row === walk.row && mark.kind === "violation");
    clearTimeout(waiting);
    if (urgent) tellNow();
    else if (!walk.playing && !walk.follow) waiting = setTimeout(tellNow, moment);
  };
}
