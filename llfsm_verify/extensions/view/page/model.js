// Reads the view document (view.schema.json): values at a row, rows and their cycles and times, what comes next.

export const VERSION = 1;
export const SYMBOLS = {
  violation: "✗", fault: "✗", reached: "◎", cause: "◆", event: "▾", verdict: "✓", overrun: "△", missed: "⋯",
};
export const KINDS = {
  violation: "violation", fault: "fault", reached: "reached", cause: "cause", event: "event", verdict: "verdict",
  overrun: "overrun", missed: "frames missed",
};
export const LONGEST = 120;

/** The document of a JSON text. Throws an Error whose message is for the user. */
export function readDocument(text) {
  let read;
  try {
    read = JSON.parse(text);
  } catch (error) {
    throw new Error(`The page holds no readable document: ${error.message}`, { cause: error });
  }
  if (read === null || typeof read !== "object" || read.format !== "llfsm-view") {
    throw new Error("The page holds no document of the format llfsm-view.");
  }
  if (read.version !== VERSION) {
    throw new Error(`The document has version ${read.version}; this page reads version ${VERSION}.`);
  }
  return read;
}

/** At most `most` characters of a text, and how many there are if it is far longer. */
export function clip(text, most = LONGEST) {
  const all = String(text);
  if (all.length <= most) return all;
  return `${all.slice(0, most - 1)}…${all.length > 1000 ? ` (${spell(all.length)} characters)` : ""}`;
}

/** A whole number with commas between thousands. */
export function spell(number) {
  return String(number).replace(/\B(?=(\d{3})+$)/g, ",");
}

/** The index of the last of ascending numbers that is at most `limit`; -1: none is. */
export function lastAt(ascending, limit, key = (item) => item) {
  let low = 0;
  let high = ascending.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (key(ascending[middle]) <= limit) low = middle + 1;
    else high = middle;
  }
  return low - 1;
}

/** The indices of the signals as they are listed: states, inputs, the whiteboard, each machine's own, verdicts. */
export function listOrder(view) {
  const rank = new Map();
  const ranks = { state: 0, input: 1, machine: 3, verdict: 4 };
  for (const { group, kind } of view.signals) if (!rank.has(group)) rank.set(group, ranks[kind] ?? 2);
  const groups = [...rank.keys()].sort((a, b) => rank.get(a) - rank.get(b));
  return groups.flatMap((group) => [...view.signals.keys()].filter((i) => view.signals[i].group === group));
}

export function rowCount(run) {
  return run.rows.step.length;
}

/** The value of a signal at a row; undefined: it has none yet. */
export function valueAt(run, signal, row) {
  const { at, values } = run.changes[signal];
  return values[lastAt(at, row)];
}

/** Whether a signal has another value at this row than before it. */
export function changesAt(run, signal, row) {
  const { at } = run.changes[signal];
  return row > 0 && at[lastAt(at, row)] === row;
}

/** The first row of a cycle or, where none is, of the next one; the last row, if there is none. */
export function rowOfCycle(run, cycle) {
  return Math.min(lastAt(run.rows.cycle, cycle - 1) + 1, Math.max(0, rowCount(run) - 1));
}

/** The last row that is not later than a time in milliseconds. */
export function rowOfTime(run, time) {
  return Math.max(0, lastAt(run.rows.time_ms, time));
}

/** The row after this one; after the last one, where a loop goes on; the same row where nothing does. */
export function rowAfter(run, row) {
  const last = rowCount(run) - 1;
  if (row < last) return row + 1;
  return typeof run.loop === "number" && run.loop < last ? run.loop + 1 : last;
}

/** The nearest row after (`way` 1) or before (-1) a row at which a mark of these kinds is; null: none. */
export function nextMark(run, kinds, row, way) {
  const rows = run.marks.filter((mark) => kinds.includes(mark.kind)).map((mark) => mark.row);
  const beyond = rows.filter((other) => (other - row) * way > 0);
  return beyond.length ? (way > 0 ? Math.min(...beyond) : Math.max(...beyond)) : null;
}

/** The nearest row after or before a row at which one of these signals changes; null: none. */
export function nextChange(run, signals, row, way) {
  let nearest = null;
  for (const signal of signals) {
    const { at } = run.changes[signal];
    const found = at[way > 0 ? lastAt(at, row) + 1 : lastAt(at, row - 1)];
    if (found === undefined || found === 0) continue;
    if (nearest === null || (found - nearest) * way < 0) nearest = found;
  }
  return nearest;
}

/** The transitions that fired at a row: pairs of a machine's and a transition's index. */
export function firedAt(run, row) {
  const fired = [];
  for (let i = lastAt(run.fired, row, (item) => item[0]); i >= 0 && run.fired[i][0] === row; i -= 1) {
    fired.unshift([run.fired[i][1], run.fired[i][2]]);
  }
  return fired;
}

export function marksAt(run, row) {
  return run.marks.filter((mark) => mark.row === row);
}

/** The places that ran at a row. */
export function placesAt(run, row) {
  return (run.ran && run.ran.sets[run.ran.rows[row]]) || [];
}

/** The index of the state in which a machine is at a row; -1: it is in none that is known. */
export function stateAt(document, run, machine, row) {
  const { signal, states } = document.machines[machine];
  if (signal === null || signal === undefined) return -1;
  const value = valueAt(run, signal, row);
  return states.findIndex((state) => state.name === value);
}

/** How often each state of a machine was entered, and each transition fired, up to a row. */
export function visitsUpTo(document, run, machine, row) {
  const { signal, states, transitions } = document.machines[machine];
  const names = new Map(states.map((state, index) => [state.name, index]));
  const entered = states.map(() => 0);
  if (signal !== null && signal !== undefined) {
    const { at, values } = run.changes[signal];
    for (let i = lastAt(at, row); i >= 0; i -= 1) {
      const index = names.get(values[i]);
      if (index !== undefined) entered[index] += 1;
    }
  }
  const fired = transitions.map(() => 0);
  for (let i = lastAt(run.fired, row, (item) => item[0]); i >= 0; i -= 1) {
    if (run.fired[i][1] === machine) fired[run.fired[i][2]] += 1;
  }
  return { entered, fired };
}

/** A value as text; with its unit, if the signal has one. */
export function wordValue(value, signal = {}) {
  if (value === undefined) return "–";
  return signal.unit ? `${value} ${signal.unit}` : String(value);
}

export function wordTime(time) {
  if (Math.abs(time) >= 1000 || time === 0) return `${Number((time / 1000).toFixed(6))} s`;
  return `${Number(time.toFixed(3))} ms`;
}

/** Where a row is: its step, cycle and time. */
export function wordRow(run, row) {
  const { step, cycle, time_ms: time } = run.rows;
  if (row >= step.length) return "no step yet";
  const where = row === 0 && step[0] === 0 ? "start" : `step ${spell(step[row])}`;
  return `${where}, cycle ${spell(cycle[row])}${time ? `, ${wordTime(time[row])}` : ""}`;
}

/** What a row shows, in sentences: where it is, who ran, the states, what fired, the marks. */
export function tell(document, run, row) {
  const said = [`${capital(wordRow(run, row))}.`];
  const turn = document.machines[run.rows.turn[row]];
  if (turn) said.push(`${clip(turn.name)} ran.`);
  const fired = firedAt(run, row);
  for (const [machine, transition] of fired) said.push(`${tellFired(document, machine, transition)}.`);
  const states = document.machines.filter((machine) => typeof machine.signal === "number")
    .map((machine) => `${clip(machine.name)} in ${clip(valueAt(run, machine.signal, row) ?? "no state")}`);
  if (states.length) said.push(`${states.join(", ")}.`);
  for (const mark of marksAt(run, row)) said.push(`${capital(KINDS[mark.kind])}: ${clip(mark.text)}.`);
  return said.join(" ");
}

export function tellFired(document, machine, transition) {
  const { name, states, transitions } = document.machines[machine];
  const { source, target, when } = transitions[transition];
  return `${clip(name)}: ${clip(states[source].name)} → ${clip(states[target].name)} when ${clip(when || "true")}`;
}

function capital(text) {
  return text.charAt(0).toUpperCase() + text.slice(1);
}

/**
 * Add the rows of an update to a run, whose row indices count from the first row ever sent. Where more than `limit`
 * rows are kept, forget the oldest fifth. Returns how many rows were forgotten.
 */
export function appendUpdate(run, update, limit = 20000) {
  run.forgotten ??= 0;
  const base = run.forgotten;
  for (const column of ["step", "cycle", "turn", "time_ms"]) {
    if (run.rows[column] && update.rows[column]) push(run.rows[column], update.rows[column]);
  }
  update.changes.forEach(({ at, values }, signal) => {
    const column = run.changes[signal];
    at.forEach((row, i) => {
      if (column.values[column.values.length - 1] === values[i]) return;
      column.at.push(row - base);
      column.values.push(values[i]);
    });
  });
  push(run.fired, update.fired.map(([row, machine, transition]) => [row - base, machine, transition]));
  push(run.marks, update.marks.map((mark) => ({ ...mark, row: mark.row - base })));
  if (update.ending !== undefined && update.ending !== null) run.ending = update.ending;
  const more = rowCount(run) - limit;
  if (more <= 0) return 0;
  const dropped = more + Math.floor(limit / 5);
  forget(run, dropped);
  return dropped;
}

function push(column, items) {
  for (const item of items) column.push(item);
}

function forget(run, dropped) {
  for (const column of Object.values(run.rows)) if (column) column.splice(0, dropped);
  for (const column of run.changes) {
    const kept = Math.max(0, lastAt(column.at, dropped));
    column.values.splice(0, kept);
    column.at = column.at.slice(kept).map((row) => Math.max(0, row - dropped));
  }
  run.fired = run.fired.filter(([row]) => row >= dropped).map(([row, ...rest]) => [row - dropped, ...rest]);
  run.marks = run.marks.filter((mark) => mark.row >= dropped).map((mark) => ({ ...mark, row: mark.row - dropped }));
  run.forgotten += dropped;
  if (run.window) run.window.first += dropped;
}
