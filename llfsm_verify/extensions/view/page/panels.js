// Tells what stands around the drawings: verdicts, sources, values, events, statistics, coverage, how a live run does.

import { fill, line, make, quote, say, sayQuoted } from "./drawing.js";
import { KINDS, SYMBOLS, changesAt, clip, firedAt, lastAt, listOrder, marksAt, placesAt, spell, valueAt, wordRow, wordTime, wordValue } from "./model.js";

const VERDICTS = { holds: "✓", violated: "✗", unknown: "?", undecided: "…" };
const STATUSES = { covered: "✓", reachable: "○", unreachable: "–", unknown: "?" };
const MOST = 400;
const NEWEST = 200;
const BLOCK = 100;

function table(label, heads, rows) {
  const head = make("tr", {}, ...heads.map((text) => make("th", { scope: "col", text })));
  return make("div", { class: "wide", tabindex: 0, role: "region", "aria-label": label },
    make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows)));
}

function placeButton(view, place, open) {
  if (!place || !view.files[place[0]]) return null;
  const where = `${clip(view.files[place[0]].name, 60)}:${place[1]}`;
  const attributes = { type: "button", class: "link", text: where, "aria-label": `Show ${where}` };
  return make("button", { ...attributes, onclick: () => open(place) });
}

function sign(text) {
  return make("span", { class: "sign", "aria-hidden": "true", text });
}

/** How many verdicts there are of each kind, in words. */
export function countVerdicts(verdicts) {
  const counts = new Map();
  for (const { verdict } of verdicts) counts.set(verdict, (counts.get(verdict) || 0) + 1);
  const word = (kind) => (kind === "holds" && counts.get(kind) > 1 ? "hold" : kind);
  return ["violated", "holds", "unknown", "undecided"].filter((kind) => counts.has(kind))
    .map((kind) => `${spell(counts.get(kind))} ${word(kind)}`).join(", ");
}

/** List the verdicts; `choose` opens a run by its index, `open` a place in the sources. */
export function listVerdicts(view, section, choose, open) {
  const verdicts = view.verdicts || [];
  section.hidden = !verdicts.length;
  const rows = verdicts.map((one) => {
    const runs = (one.runs || []).filter((index) => view.runs[index]).map((index) => make("button", {
      type: "button", text: `Show ${view.runs[index].kind}`, "data-run": index, title: clip(view.runs[index].title),
      "aria-label": `Show ${view.runs[index].kind} of ${clip(one.name)}`, onclick: () => choose(index),
    }));
    const said = [one.reason, ...(one.notes || [])].filter(Boolean);
    const reasons = said.map((text) => make("p", {}, ...quote(clip(text, 2000))));
    const row = line([sign(VERDICTS[one.verdict]), ` ${clip(one.name)}`],
      make("span", { class: "words", text: clip(one.words, 400) }),
      [make("code", { text: clip(one.text, 2000) }), ...reasons],
      [one.engine ? `${clip(one.engine)} ` : "", placeButton(view, one.place, open)], runs);
    row.className = one.verdict;
    Object.assign(row.dataset, { verdict: one.verdict, name: one.name });
    return row;
  });
  fill(section, make("p", { class: "summary", text: countVerdicts(verdicts) }),
    table("Verdicts", ["Property", "Verdict", "Formula and reason", "How, where", "Runs"], rows));
}

/** The last folders of a path, as many as have room. */
function shortPath(path, most = 36) {
  const parts = path.split("/");
  while (parts.length > 1 && parts.join("/").length > most) parts.shift();
  const kept = parts.join("/");
  return `${kept === path ? "" : "…/"}${kept.slice(-most)}`;
}

/** Show the sources in an element. Returns functions that mark what ran at a row, and open a place. */
export function showSources(view, section) {
  section.hidden = !view.files.length;
  const files = make("select", { id: "files", onchange: () => open([Number(files.value), 1, 0, 0, 0]) },
    ...view.files.map(({ name }, i) => make("option", { value: i, text: shortPath(name) })));
  const along = make("input", { type: "checkbox", id: "along", checked: true });
  const text = make("div", { class: "text", tabindex: 0, role: "region", "aria-label": "Source text" });
  const none = make("p", { class: "quiet ran-none", text: "" });
  const choices = [make("label", { text: "file " }, files)];
  if (view.runs.length) choices.push(make("label", {}, along, " follow the run"));
  fill(section, make("div", { class: "buttons" }, ...choices), text, none);
  let shown = -1;
  let marked = [];
  let ran = [];
  const placeOf = ([machine, transition]) => view.machines[machine].transitions[transition].place;

  function load(index) {
    if (shown === index) return;
    shown = index;
    files.value = index;
    const { text: all, cut, name } = view.files[index];
    const lines = all.replace(/\n$/, "").split("\n");
    const blocks = [];
    for (let i = 0; i < lines.length; i += BLOCK) {
      const part = lines.slice(i, i + BLOCK).map((line, j) => make("div", { class: "line", "data-line": i + j + 1 },
        make("span", { class: "number", text: i + j + 1 }), make("code", { text: clip(line, 2000) })));
      const style = `contain-intrinsic-height: auto ${part.length * 1.45}em`;
      blocks.push(make("div", { class: "block", style }, ...part));
    }
    if (cut) blocks.push(make("p", { class: "quiet", text: `${spell(cut)} more lines are not in this page` }));
    text.replaceChildren(...blocks);
    text.dataset.file = name;
    marked = [];
  }

  function mark(places, kind) {
    for (const line of marked) {
      line.classList.remove("ran", "chosen");
      line.lastChild.textContent = line.lastChild.textContent;
      line.removeAttribute("aria-current");
    }
    marked = [];
    for (const [file, from, start, to, end] of places) {
      if (file !== shown) continue;
      for (let number = from; number <= Math.max(from, Math.min(to, from + MOST)); number += 1) {
        const line = text.children[Math.floor((number - 1) / BLOCK)]?.children[(number - 1) % BLOCK];
        if (!line) break;
        line.classList.add(kind);
        line.setAttribute("aria-current", "true");
        marked.push(line);
        underline(line.lastChild, number === from ? start - 1 : 0, number === to ? end - 1 : Infinity);
      }
    }
    const first = marked[0];
    if (!first) return;
    const box = text.getBoundingClientRect();
    const at = first.getBoundingClientRect();
    if (at.top < box.top || at.bottom > box.bottom) text.scrollTop += at.top - box.top - box.height / 3;
  }

  function open(place) {
    load(place[0]);
    along.checked = false;
    mark([place], "chosen");
    if (place[2] > 0) section.scrollIntoView({ block: "nearest" });
  }

  /** Mark what ran at a row or, where only that is known and the run is not followed, which transitions fired. */
  function show(run, row, followed) {
    const known = run.ran ? placesAt(run, row) : followed ? [] : firedAt(run, row).map(placeOf);
    const places = known.filter(Boolean);
    section.dataset.ran = places.map(([file, line]) => `${file}:${line}`).join(" ");
    none.textContent = run.ran && !places.length ? "no line ran in this row" : "";
    if (!along.checked || (places === ran && marked.length)) return;
    ran = places;
    if (places.length && !places.some((place) => place[0] === shown)) load(places[0][0]);
    mark(places, "ran");
  }

  const sizes = view.files.map((file) => file.text.length);
  if (sizes.length) load(view.source === "live" ? sizes.indexOf(Math.max(...sizes)) : 0);
  return { show, open };
}

function underline(code, start, end) {
  if (code.childElementCount || start < 0 || end <= start) return;
  const all = code.textContent;
  code.replaceChildren(all.slice(0, start), make("mark", { text: all.slice(start, end) }), all.slice(end));
}

/** A table of the exact values of a row; what has changed is marked. Returns a function that shows a row. */
export function listValues(view, section, walk, watch) {
  const cells = [];
  const rows = [];
  let group = null;
  const order = listOrder(view);
  order.forEach((index) => {
    const signal = view.signals[index];
    if (signal.group !== group) {
      group = signal.group;
      rows.push(make("tr", { class: "group" }, make("th", { scope: "colgroup", colspan: 5, text: clip(group) })));
    }
    const name = clip(signal.name, 60);
    const [seen, value, since] = ["sign", "value", "quiet"].map((kind) => make("span", { class: kind }));
    const box = make("input", { type: "checkbox", "aria-label": `Watch ${name}`, onchange: () => watch(index) });
    Object.assign(value.dataset, { signal: index });
    const row = line(name, seen, value, since, box);
    cells[index] = { seen, value, since, box, row };
    rows.push(row);
  });
  fill(section, table("Values of this row", ["Signal", "", "Value", "Since", "Watch"], rows));
  return (run, row) => {
    const marked = marksAt(run, row).filter((mark) => mark.kind === "cause");
    const causes = new Set(marked.flatMap((mark) => mark.signals || []));
    cells.forEach(({ seen, value, since, box, row: shown }, index) => {
      const now = valueAt(run, index, row);
      const words = clip(wordValue(now, view.signals[index]), 200);
      say(value, words);
      const changed = changesAt(run, index, row);
      const { at } = run.changes[index];
      const step = run.rows.step[at[lastAt(at, row)]];
      say(since, changed ? "now" : step === undefined ? "" : `step ${spell(step)}`);
      say(seen, causes.has(index) ? "◆" : changed ? "●" : "");
      seen.title = causes.has(index) ? "cause" : changed ? "changed" : "";
      shown.classList.toggle("changed", changed);
      box.checked = walk.watched.has(index);
    });
  };
}

/**
 * A list of the marks of a run, at most the last `MOST` (of a live run, the `NEWEST`); a click goes there. Returns
 * functions that list a run, and that show a row and what has come since.
 */
export function listEvents(section, go) {
  const list = make("ol", { class: "events", tabindex: 0, "aria-label": "Events" });
  const more = make("p", { class: "quiet" });
  let [run, listed, newest] = [null, 0, -1];
  let now = [];
  fill(section, list, more);

  function add(marks) {
    const most = run.kind === "live" ? NEWEST : MOST;
    const past = run.forgotten || 0;
    list.append(...marks.slice(-most).map((mark) => make("li", { class: mark.kind, "data-row": mark.row + past },
      make("button", { type: "button", class: "link", onclick: () => go(mark.row + past - (run.forgotten || 0)) },
        sign(SYMBOLS[mark.kind]),
        ...quote(` ${wordRow(run, mark.row)}: ${KINDS[mark.kind]}: ${clip(mark.text, 400)}`)))));
    listed += marks.length;
    if (marks.length) newest = marks[marks.length - 1].row + past;
    while (list.childElementCount > most) list.firstChild.remove();
    section.hidden = !listed;
    const less = listed - list.childElementCount;
    say(more, less > 0 ? `${spell(less)} earlier events are not listed` : "");
  }

  function load(other) {
    [run, listed, newest] = [other, 0, -1];
    list.replaceChildren();
    add([...run.marks].sort((a, b) => a.row - b.row));
  }

  function show(row) {
    if (run === null) return;
    const past = run.forgotten || 0;
    let from = run.marks.length;
    while (run.kind === "live" && from > 0 && run.marks[from - 1].row + past > newest) from -= 1;
    if (from < run.marks.length) add(run.marks.slice(from));
    for (const item of now) item.classList.remove("now");
    now = list.querySelectorAll(`[data-row="${row + past}"]`);
    for (const item of now) item.classList.add("now");
  }
  return { load, show };
}

function unlisted(more, words) {
  return more > 0 ? make("p", { class: "quiet", text: `${spell(more)} ${words} are not listed` }) : null;
}

export function listStatistics(view, section) {
  const groups = view.statistics || [];
  section.hidden = !groups.length;
  const facts = ({ title, lines }) => make("table", { class: "facts" }, make("caption", { text: clip(title) }),
    make("tbody", {}, ...lines.map(([name, value]) => line(clip(name), clip(value, 400)))));
  fill(section, ...groups.map(facts));
}

/** Counts of goals by kind and status, and the goals: those that are covered are folded. */
export function listCoverage(view, section, open) {
  section.hidden = !view.coverage;
  if (!view.coverage) return;
  const { counts, goals } = view.coverage;
  const statuses = [...new Set(Object.values(counts).flatMap((of) => Object.keys(of)))];
  const covered = goals.filter(({ status }) => status === "covered");
  const count = ([kind, of]) => line(clip(kind), ...statuses.map((status) => spell(of[status] || 0)));
  const goal = ({ kind, status, name, span }) => line(clip(name), [sign(STATUSES[status] || "•"), ` ${status}`], kind,
    placeButton(view, span, open));
  fill(section, table("Coverage by kind", ["Kind", ...statuses], Object.entries(counts).map(count)),
    ...listGoals("not covered", goals.filter(({ status }) => status !== "covered"), goal),
    make("details", {}, make("summary", { text: `${spell(covered.length)} covered` }),
      ...listGoals("covered", covered, goal)));
}

function listGoals(title, goals, goal) {
  if (!goals.length) return [make("p", { text: `Goals that are ${title}: none` })];
  return [make("h3", { text: `Goals that are ${title}: ${spell(goals.length)}` }),
    table(`Goals that are ${title}`, ["Goal", "Status", "Kind", "Where"], goals.slice(0, MOST).map(goal)),
    unlisted(goals.length - MOST, "more goals")].filter(Boolean);
}

/**
 * How a live run does. Returns functions that take an update and the state of the connection, and that show it; the
 * histogram and the monitors once a second.
 */
export function showLive(section) {
  const facts = make("dl", { class: "live" });
  const bars = make("div", { class: "bars" });
  const monitors = make("ul", { class: "monitors", "aria-label": "Verdicts of monitors" });
  const lag = make("p", { class: "lag", role: "status" });
  const totals = { missed: 0, skipped: 0, shown: 0 };
  const known = {};
  const told = ["rows shown", "frames missed", "frames not shown", "behind"].map((text) => {
    const value = make("dd", { text: "0" });
    facts.append(make("div", {}, make("dt", { text }), value));
    return value;
  });
  let drawn = -Infinity;
  fill(section, lag, make("div", {}, facts, monitors), bars);
  section.hidden = false;

  function take(update, connection) {
    known.connection = connection;
    if (update) {
      totals.missed += update.missed;
      totals.skipped += update.skipped || 0;
      totals.shown += update.rows.step.length;
      totals.behind = update.behind_ms;
      for (const name of ["lateness", "verdicts"]) if (update[name]) known[name] = update[name];
    }
    Object.assign(section.dataset, totals, { connection });
  }

  function show(now) {
    const { connection, lateness, verdicts } = known;
    if (connection === undefined) return;
    const late = totals.behind > 500;
    sayQuoted(lag, connection !== "live" ? connection
      : late ? `⚠ the view lags by ${wordTime(totals.behind)}` : "● follows the run");
    lag.className = `lag ${connection !== "live" ? "lost" : late ? "late" : "well"}`;
    const counts = [totals.shown, totals.missed, totals.skipped].map(spell);
    const behind = totals.behind === undefined ? "–" : wordTime(Math.round(totals.behind));
    [...counts, behind].forEach((word, i) => say(told[i], word));
    if (connection === "live" && now < drawn + 1000) return;
    drawn = now;
    if (lateness) drawLateness(bars, lateness);
    if (verdicts) listMonitors(monitors, verdicts);
  }
  return { take, show };
}

function drawLateness(place, { edges_us: edges, counts, worst_us: worst, overruns }) {
  const most = Math.max(1, ...counts);
  const name = (i) => `${i < edges.length ? "≤" : ">"} ${wordTime(edges[Math.min(i, edges.length - 1)] / 1000)}`;
  const bar = (count) => make("span", { class: "bar", style: `width: ${(100 * count) / most}%` });
  const known = counts.map((count, i) => (count ? i : -1)).filter((i) => i >= 0);
  const [first, last] = [known[0] ?? 0, known[known.length - 1] ?? -1];
  const rows = counts.slice(first, last + 1).map((count, i) => line(name(first + i), spell(count), bar(count)));
  const text = `Lateness of cycles: at most ${wordTime(worst / 1000)}, ${spell(overruns)} overruns`;
  place.dataset.worst = worst;
  place.replaceChildren(make("table", {}, make("caption", { text }), make("tbody", {}, ...rows)));
}

function listMonitors(place, verdicts) {
  const item = ([name, words]) => make("li", { "data-name": name, text: `${clip(name)}: ${clip(words)}` });
  place.replaceChildren(...Object.entries(verdicts).map(item));
}
