import assert from "node:assert/strict";
import { test } from "node:test";

import * as model from "../../../../llfsm_verify/extensions/view/page/model.js";
import { chance, sample } from "./sample.mjs";

const view = sample();
const [run] = view.runs;

test("a document is read, and what is none is refused in words", () => {
  assert.equal(model.readDocument(JSON.stringify(view)).title, "t");
  for (const [text, words] of [
    ["{", /no readable document/], ["null", /format llfsm-view/], ["[]", /format llfsm-view/],
    ['{"format":"llfsm-view","version":9}', /version 9; this page reads version 1/]]) {
    assert.throws(() => model.readDocument(text), { message: words });
  }
});

test("values hold from their change on", () => {
  const rows = [0, 1, 2, 3, 4, 5];
  assert.deepEqual(rows.map((row) => model.valueAt(run, 0, row)), ["RED", "RED", "GREEN", "AMBER", "AMBER", "RED"]);
  assert.deepEqual(rows.map((row) => model.valueAt(run, 1, row)), [0, 0, 0, 0, 7, 7]);
  assert.deepEqual(rows.filter((row) => model.changesAt(run, 0, row)), [2, 3, 5]);
  assert.equal(model.valueAt({ changes: [{ at: [3], values: [1] }] }, 0, 2), undefined);
});

test("values equal those of a table that is filled row by row, at random", () => {
  const next = chance(7);
  for (let round = 0; round < 200; round += 1) {
    const table = [next(3)];
    const at = [0];
    const values = [table[0]];
    for (let row = 1; row < 40; row += 1) {
      table.push(next(4) ? table[row - 1] : next(3));
      if (table[row] === table[row - 1]) continue;
      at.push(row);
      values.push(table[row]);
    }
    const made = { changes: [{ at, values }] };
    table.forEach((value, row) => assert.equal(model.valueAt(made, 0, row), value));
    table.forEach((_, row) => {
      const after = table.findIndex((value, i) => i > row && value !== table[i - 1]);
      assert.equal(model.nextChange(made, [0], row, 1), after < 0 ? null : after);
      let back = row - 1;
      while (back > 0 && table[back] === table[back - 1]) back -= 1;
      assert.equal(model.nextChange(made, [0], row, -1), back > 0 ? back : null);
    });
  }
});

test("rows, cycles and times", () => {
  assert.deepEqual([0, 1, 2, 3, 4, 9].map((cycle) => model.rowOfCycle(run, cycle)), [0, 1, 3, 5, 5, 5]);
  assert.deepEqual([-5, 0, 9.9, 10, 39, 40, 99].map((time) => model.rowOfTime(run, time)), [0, 0, 0, 2, 4, 5, 5]);
  assert.equal(model.wordRow(run, 5), "step 5, cycle 4, 40 ms");
  assert.equal(model.wordRow(run, 0), "start, cycle 0, 0 s");
  assert.deepEqual([1500, 0.25, 1000000].map(model.wordTime), ["1.5 s", "0.25 ms", "1000 s"]);
});

test("a lasso goes back to the row after its loop's, another run stops", () => {
  assert.equal(model.rowAfter(run, 5), 2);
  assert.equal(model.rowAfter({ ...run, loop: 5 }, 5), 5);
  assert.equal(model.rowAfter({ ...run, loop: null }, 5), 5);
  assert.equal(model.rowAfter(run, 4), 5);
});

test("marks before and after", () => {
  assert.equal(model.nextMark(run, ["violation", "fault"], 0, 1), 5);
  assert.equal(model.nextMark(run, ["violation"], 5, 1), null);
  assert.equal(model.nextMark(run, ["event", "cause"], 5, -1), 3);
  assert.equal(model.nextMark(run, ["event", "cause"], 3, -1), 1);
});

test("what fired, what ran, where a machine is, how often it was there", () => {
  assert.deepEqual(model.firedAt(run, 3), [[0, 1]]);
  assert.deepEqual(model.firedAt(run, 4), []);
  assert.deepEqual(model.firedAt({ fired: [[1, 0, 2], [1, 1, 0], [2, 0, 0]] }, 1), [[0, 2], [1, 0]]);
  assert.deepEqual(model.placesAt(run, 1), [[0, 1, 1, 1, 4]]);
  assert.deepEqual(model.placesAt({}, 1), []);
  assert.equal(model.stateAt(view, run, 0, 4), 2);
  assert.deepEqual(model.visitsUpTo(view, run, 0, 4), { entered: [1, 1, 1], fired: [1, 1, 0] });
  assert.deepEqual(model.visitsUpTo(view, run, 0, 5), { entered: [2, 1, 1], fired: [1, 1, 1] });
});

test("a row in words", () => {
  assert.equal(model.tell(view, run, 5),
    "Step 5, cycle 4, 40 ms. light ran. light: AMBER → RED when t2. light in RED. Violation: bad.");
});

test("long texts and numbers are cut and grouped", () => {
  assert.equal(model.clip("x".repeat(1000000), 5), "xxxx… (1,000,000 characters)");
  assert.equal(model.clip("short"), "short");
  assert.deepEqual([7, 999, 1000, 1234567].map(model.spell), ["7", "999", "1,000", "1,234,567"]);
  assert.equal(model.wordValue(3, view.signals[1]), "3 m");
});

test("updates are added, and the oldest rows are forgotten, without a change of what is left", () => {
  const next = chance(3);
  const live = {
    rows: { step: [0], cycle: [0], time_ms: [0], turn: [-1] }, changes: [{ at: [0], values: [0] }], fired: [],
    marks: [], window: { first: 0, total: null },
  };
  const table = [0];
  let dropped = 0;
  for (let sent = 1; sent < 900;) {
    const rows = Array.from({ length: 1 + next(9) }, (_, i) => sent + i);
    const change = { at: [], values: [] };
    for (const row of rows) {
      table[row] = next(5) ? table[row - 1] : next(3);
      if (table[row] === table[row - 1]) continue;
      change.at.push(row);
      change.values.push(table[row]);
    }
    const fired = rows.filter((row) => row % 7 === 0).map((row) => [row, 0, row % 3]);
    const marks = rows.filter((row) => row % 50 === 0).map((row) => ({ row, kind: "event", text: String(row) }));
    const columns = { step: rows, cycle: rows, time_ms: rows, turn: rows.map(() => 0) };
    dropped += model.appendUpdate(live, { rows: columns, changes: [change], fired, marks }, 100);
    sent += rows.length;
    assert.ok(model.rowCount(live) <= 100);
    assert.equal(live.window.first, dropped);
    assert.equal(live.changes[0].at[0], 0);
    live.rows.step.forEach((step, row) => {
      assert.equal(step, row + dropped);
      assert.equal(model.valueAt(live, 0, row), table[step]);
      assert.deepEqual(model.firedAt(live, row), step % 7 || step === 0 ? [] : [[0, step % 3]]);
      const texts = model.marksAt(live, row).map((mark) => mark.text);
      assert.deepEqual(texts, step % 50 || step === 0 ? [] : [String(step)]);
    });
  }
  assert.ok(dropped > 700);
});

test("states come first, then inputs, the whiteboard, machines and verdicts, whatever the document's order", () => {
  const kinds = [["whiteboard", "whiteboard"], ["machine", "cabin"], ["verdict", "verdicts"], ["input", "inputs"],
    ["machine", "door"], ["state", "states"], ["machine", "cabin"], ["state", "states"]];
  const signals = kinds.map(([kind, group]) => ({ kind, group }));
  assert.deepEqual(model.listOrder({ signals }), [5, 7, 3, 0, 1, 6, 4, 2]);
});
