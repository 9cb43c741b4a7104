// Puts the page together: reads the document, shows a row of a run everywhere at once, listens to keys and to updates.

import { drawMachines, fill, lightCoverage, line, make, quote, say } from "./drawing.js";
import { appendUpdate, clip, readDocument, rowCount, spell, visitsUpTo } from "./model.js";
import { listCoverage, listEvents, listStatistics, listValues, listVerdicts, showLive, showSources } from "./panels.js";
import { JUMPS, Walk, createPace, createPlayer, createTeller } from "./player.js";
import { createTiming } from "./timeline.js";
import { embeddedText, fetchWindow, follow } from "./transport.js";

const SOURCES = {
  check: "report of a check", coverage: "report of coverage", trace: "saved trace", recording: "recording",
  live: "live run",
};
const NO_ROWS = { step: [], cycle: [], time_ms: null, turn: [] };
const NO_RUN = { name: "", kind: "trace", title: "no run", rows: NO_ROWS, fired: [], marks: [] };

/** Show the document that is in this page. */
export function start(page) {
  const by = (id) => page.getElementById(id);
  chooseTheme(page, by("theme"));
  let view;
  try {
    view = readDocument(embeddedText(page, "view-document") ?? "");
  } catch (error) {
    by("problem").textContent = error.message;
    by("problem").hidden = false;
    return null;
  }
  by("title").textContent = clip(view.title);
  by("about").textContent = `${SOURCES[view.source]} of ${clip(view.arrangement.name)}`;
  for (const note of view.notes || []) by("notes").append(make("li", {}, ...quote(clip(note, 1000))));
  by("notes").hidden = !(view.notes || []).length;
  const style = paint(page, view.colours);
  const sources = showSources(view, by("source"));
  listVerdicts(view, by("verdicts"), (index) => choose(index, "end"), sources.open);
  listCoverage(view, by("coverage"), sources.open);
  listStatistics(view, by("statistics"));
  const walk = new Walk(view.runs[0] || { ...NO_RUN, changes: view.signals.map(() => ({ at: [], values: [] })) });
  const pace = createPace(show);
  const refresh = () => {
    fresh.asked = true;
    pace.ask();
  };
  const fresh = { asked: true, grown: false, marked: 0 };
  const seen = inSight(["live", "machines", "source", "timing", "values", "events"].map(by), refresh);
  const player = createPlayer(by("player"), view, walk, refresh);
  const light = drawMachines(view, by("machines").querySelector(".body"), style);
  const watch = (signal) => {
    if (!walk.watched.delete(signal)) walk.watched.add(signal);
    refresh();
  };
  const go = (row) => {
    walk.go(row);
    refresh();
  };
  const timing = createTiming(by("timing"), view, walk, { go, watch, style });
  const values = listValues(view, by("values"), walk, watch);
  const tellRow = createTeller(by("said"), view, walk);
  const listed = listEvents(by("events"), go);
  let live = null;
  let index = 0;
  let before = null;

  function show(now) {
    const drawn = (id) => fresh.asked || seen.has(by(id));
    if (walk.playing && walk.tick(before === null ? 0 : Math.min(250, now - before)) | walk.playing) refresh();
    before = walk.playing ? now : null;
    const { run, row } = walk;
    player.show();
    if (fresh.grown) timing.grow();
    if (fresh.grown && (fresh.asked || now > fresh.marked + 1000)) {
      fresh.marked = now;
      player.mark();
    }
    if (drawn("timing")) timing.show();
    if (rowCount(run)) {
      if (drawn("machines")) light(run, row);
      if (drawn("source")) sources.show(run, row, walk.follow);
      if (drawn("values")) values(run, row);
      if (drawn("machines")) tellVisits(row);
    }
    if (by("events").hidden || drawn("events")) listed.show(row);
    if (live && drawn("live")) live.show(now);
    tellRow();
    Object.assign(fresh, { asked: walk.playing, grown: false });
    page.body.dataset.row = row;
    page.body.dataset.run = index;
  }

  function tellVisits(row) {
    const known = [...view.machines.keys()].filter((machine) => typeof view.machines[machine].signal === "number");
    const all = known.map((machine) => visitsUpTo(view, walk.run, machine, row));
    const said = ["entered", "fired"].map((kind) => {
      const counts = all.flatMap((visits) => visits[kind]);
      return [counts.filter(Boolean).length, counts.length];
    });
    const place = by("machines").querySelector("h3");
    place.dataset.visits = said.flat().join(" ");
    say(place, `Machines: up to here ${said[0].join(" of ")} states, ${said[1].join(" of ")} transitions`);
  }

  /** Show a run, at the row that violates; without one, at the first row or, if asked for, at the `end`. */
  function choose(chosen, at = "violation") {
    index = chosen;
    const run = view.runs[chosen];
    walk.load(run);
    by("runs").value = chosen;
    by("run-title").textContent = clip(run.name || "Run");
    const { first, total } = run.kind === "live" ? {} : run.window || {};
    const whole = typeof total === "number" ? ` of ${spell(total)}` : "";
    const many = first === undefined ? "" : `; rows ${spell(first)} to ${spell(first + rowCount(run) - 1)}${whole}`;
    const ending = run.ending ? `; ${clip(run.ending, 400)}` : "";
    const again = typeof run.loop === "number" && !run.ending;
    const loops = again ? `; after row ${spell(run.loop)} it repeats forever` : "";
    by("run-text").replaceChildren(...quote(`${clip(run.title, 1000)}${loops}${ending}${many}`));
    player.load();
    timing.load();
    listed.load(run);
    const kinds = [...JUMPS.violation, ...(at === "end" ? ["reached"] : [])];
    const grave = at === "first" || run.kind === "live" ? null : run.marks.find(({ kind }) => kinds.includes(kind));
    walk.go(grave ? grave.row : at === "end" ? walk.last : 0);
    if (at === "end") {
      by("run").scrollIntoView({ block: "start" });
      by("player").focus({ preventScroll: true });
    }
    refresh();
  }

  by("run").hidden = !view.runs.length && !view.machines.length;
  by("run-choice").hidden = view.runs.length < 2;
  const title = (run, i) => `${i + 1}: ${clip(run.name, 60)} (${run.kind})`;
  by("runs").append(...view.runs.map((run, i) => make("option", { value: i, text: title(run, i) })));
  by("runs").addEventListener("change", () => choose(Number(by("runs").value)));
  if (view.runs.length) choose(0);
  else showNoRun(view, by);
  const { events, window: windows } = JSON.parse(embeddedText(page, "view-endpoints") || "null") ?? {};
  const turn = windows && view.runs.length && view.runs[0].window ? offerWindows(view, by, windows, choose) : () => {};
  const other = (way) => view.runs.length && choose((index + way + view.runs.length) % view.runs.length);
  listenKeys(page, by("help"), by("keys"), keyTable({ walk, timing, by, refresh, other, turn }));
  if (events && view.runs.length) {
    live = showLive(by("live"));
    listen(view, walk, events, live.take, (lasting) => {
      fresh.grown = true;
      fresh.asked ||= lasting;
      pace.offer();
    });
  }
  page.defaultView.addEventListener("resize", refresh);
  return { view, walk, refresh };
}

/** Without a run there are only machines, in which coverage is marked, if it is known. */
function showNoRun(view, by) {
  by("run-title").textContent = "Model";
  for (const id of ["player", "said", "timing", "values"]) by(id).hidden = true;
  const { state, transition } = lightCoverage(view, by("machines"));
  if (!view.coverage) return;
  const words = `${state.join(" of ")} states, ${transition.join(" of ")} transitions`;
  by("machines").querySelector("h3").textContent = `Machines: covered are ${words}; what is not is dashed`;
}

/** The elements that are on the screen or near it; `changed` is called when others are. */
function inSight(elements, changed) {
  const seen = new Set(elements);
  const watcher = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) if (isIntersecting) seen.add(target);
      else seen.delete(target);
    changed();
  }, { rootMargin: "100px" });
  for (const element of elements) watcher.observe(element);
  return seen;
}

/** Light, dark, or as the browser wants it; a button goes through them. */
function chooseTheme(page, button) {
  const wanted = page.defaultView.matchMedia("(prefers-color-scheme: dark)");
  const themes = ["auto", "light", "dark"];
  let chosen = 0;
  const set = () => {
    page.documentElement.dataset.theme = chosen ? themes[chosen] : wanted.matches ? "dark" : "light";
    button.textContent = `Theme: ${themes[chosen]}`;
  };
  wanted.addEventListener("change", set);
  button.addEventListener("click", () => {
    chosen = (chosen + 1) % themes.length;
    set();
  });
  set();
}

/** Make a style of the document's colours. Returns a function that gives an element the colour of a name. */
function paint(page, colours) {
  const sound = ({ light, dark }) => [light, dark].every((colour) => /^#[0-9a-f]{6}$/.test(colour));
  const names = Object.keys(colours).filter((name) => sound(colours[name]));
  const number = new Map(names.map((name, i) => [name, i]));
  const rules = (shade) => names.map((name, i) => `--c${i}:${colours[name][shade]}`).join(";");
  const sheet = new page.defaultView.CSSStyleSheet();
  sheet.replaceSync(`:root{${rules("light")}}@media screen{:root[data-theme="dark"]{${rules("dark")}}}`);
  page.adoptedStyleSheets = [...page.adoptedStyleSheets, sheet];
  return (element, name) => {
    if (number.has(name)) element.style.setProperty("--own", `var(--c${number.get(name)})`);
  };
}

/** What keys do: the key, its name, what it does, in words and as a function. */
function keyTable({ walk, timing, by, refresh, other, turn }) {
  const move = (way, unit) => () => walk.move(way, unit);
  const jump = (what, way) => () => walk.jump(what, way);
  return [
    [" ", "Space", "play or pause", () => walk.toggle()],
    ["ArrowRight", "→", "one row on", move(1)], ["ArrowLeft", "←", "one row back", move(-1)],
    ["Shift+ArrowRight", "Shift →", "one cycle on", move(1, "cycle")],
    ["Shift+ArrowLeft", "Shift ←", "one cycle back", move(-1, "cycle")],
    ["Home", "Home", "first row", () => walk.go(0)], ["End", "End", "last row", () => walk.go(walk.last)],
    ["e", "e", "next event", jump("event", 1)], ["E", "E", "previous event", jump("event", -1)],
    ["v", "v", "next violation", jump("violation", 1)], ["V", "V", "previous violation", jump("violation", -1)],
    ["c", "c", "next change of a watched signal (of any, if none is watched)", jump("change", 1)],
    ["C", "C", "previous change", jump("change", -1)],
    ["]", "]", "play faster", () => walk.faster(1)], ["[", "[", "play slower", () => walk.faster(-1)],
    ["+", "+", "zoom in", () => timing.zoom(0.5)], ["-", "-", "zoom out", () => timing.zoom(2)],
    ["0", "0", "show the whole run", () => timing.fit()],
    ["<", "<", "timing: earlier", () => timing.pan(-0.5)], [">", ">", "timing: later", () => timing.pan(0.5)],
    ["n", "n", "next run", () => other(1)], ["N", "N", "previous run", () => other(-1)],
    ["PageDown", "Page ↓", "later rows of a long run", () => turn(1)],
    ["PageUp", "Page ↑", "earlier rows of a long run", () => turn(-1)],
    ["f", "f", "follow the newest row of a live run", () => (walk.follow = walk.run.kind === "live" && !walk.follow)],
    ["t", "t", "light, dark, or as the browser", () => by("theme").click()],
    ["?", "?", "show these keys", () => by("help").showModal()],
  ].map(([key, name, words, act]) => ({ key, name, words, act: () => {
    act();
    refresh();
  } }));
}

function listenKeys(page, help, button, keys) {
  const lines = keys.map(({ name, words }) => line(make("kbd", { text: name }), words));
  fill(help, make("table", { class: "keys" }, make("tbody", {}, ...lines)));
  button.addEventListener("click", () => help.showModal());
  page.addEventListener("keydown", (event) => {
    const { target } = event;
    const presses = /^( |Enter)$/.test(event.key) && target.matches("button, summary, input[type=checkbox], a");
    const scrolls = target.closest("[role=region], .drawing, ol[tabindex]") && /^(Arrow|Home|End)/.test(event.key);
    const other = event.ctrlKey || event.altKey || event.metaKey || help.open || target.matches("select, textarea");
    if (other || presses || scrolls) return;
    const pressed = event.shiftKey && event.key.startsWith("Arrow") ? `Shift+${event.key}` : event.key;
    const found = keys.find(({ key }) => key === pressed);
    if (!found) return;
    event.preventDefault();
    found.act();
  });
}

/** Take the updates of the server; `grown` is told whether the newest one is the last for now. */
function listen(view, walk, events, take, grown) {
  const [run] = view.runs;
  walk.follow = true;
  follow(events, (update, connection) => {
    if (update) {
      const dropped = appendUpdate(run, update);
      if (walk.run === run) walk.row = walk.follow ? walk.last : Math.max(0, walk.row - dropped);
    }
    take(update, connection);
    grown(connection !== "live");
  });
}

/** Offer the rows before and after those that are here. Returns a function that goes there, `way` windows on. */
function offerWindows(view, by, address, choose) {
  const { first, total } = view.runs[0].window;
  const size = rowCount(view.runs[0]);
  const button = (id, text, way) => make("button", { type: "button", id, text, onclick: () => turn(way) });
  const [earlier, later] = [button("earlier", "◂ earlier rows", -1), button("later", "later rows ▸", 1)];
  let start = first;
  const show = () => {
    earlier.disabled = start <= 0;
    later.disabled = total !== null && start + size >= total;
  };
  async function turn(way) {
    const wanted = Math.max(0, start + way * size);
    if (wanted === start || (way > 0 && later.disabled)) return;
    try {
      const other = readDocument(await fetchWindow(address, wanted, wanted + size - 1));
      if (!rowCount(other.runs[0])) return;
      view.runs.splice(0, 1, other.runs[0]);
      view.signals.forEach((signal, i) => Object.assign(signal, other.signals[i]));
      start = wanted;
      by("problem").hidden = true;
    } catch (error) {
      by("problem").textContent = error.message;
      by("problem").hidden = false;
      return;
    }
    show();
    choose(0, "first");
  }
  by("windows").replaceChildren(earlier, later);
  by("windows").hidden = false;
  show();
  return turn;
}

if (typeof document !== "undefined") globalThis.llfsmView = start(document);
