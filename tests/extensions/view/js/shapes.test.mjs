import assert from "node:assert/strict";
import { test } from "node:test";

import { placeMarks, roundUp, shapes, tenths } from "../../../../llfsm_verify/extensions/view/page/shapes.js";
import { chance, sample } from "./sample.mjs";

const view = sample();

test("stretches of values, from left to right", () => {
  const { lanes } = shapes(view, view.runs[0], 0, 5, 600);
  assert.deepEqual(lanes[0].map(({ begin, end, value }) => [begin, end, value]),
    [[0, 200, "RED"], [200, 300, "GREEN"], [300, 500, "AMBER"], [500, 600, "RED"]]);
  assert.deepEqual(lanes[1],
    [{ begin: 0, end: 400, value: 0, low: 0, high: 0 }, { begin: 400, end: 600, value: 7, low: 1, high: 1 }]);
  assert.deepEqual(lanes[2].map(({ low }) => low), [0, 1, 0]);
});

test("a part begins with the value that holds there", () => {
  const { lanes } = shapes(view, view.runs[0], 4, 5, 100);
  assert.deepEqual(lanes[0].map(({ begin, end, value }) => [begin, end, value]), [[0, 50, "AMBER"], [50, 100, "RED"]]);
});

test("at random, stretches touch, cover the width, and are few where rows are narrow", () => {
  const next = chance(5);
  for (let round = 0; round < 100; round += 1) {
    const rows = 2 + next(3000);
    const at = Array.from({ length: rows }, (_, row) => row).filter((row) => row === 0 || next(3) === 0);
    const change = { at, values: at.map((_, i) => i % 8) };
    const run = { rows: { cycle: Array.from({ length: rows }, (_, row) => row), time_ms: null }, changes: [change] };
    const first = next(rows - 1);
    const last = first + 1 + next(rows - first - 1);
    const { lanes: [lane], ticks } = shapes({ signals: [{ draw: "curve", low: 0, high: 7 }] }, run, first, last, 500);
    assert.equal(lane[0].begin, 0);
    assert.equal(lane.at(-1).end, 500);
    lane.slice(1).forEach((one, i) => assert.equal(one.begin, lane[i].end));
    assert.ok(lane.length <= 500 / 3 * 2 + 2, String(lane.length));
    for (const one of lane) assert.ok(0 <= one.low && one.low <= one.high && one.high <= 1);
    ticks.slice(1).forEach((tick, i) => assert.ok(tick.x - ticks[i].x >= 45));
    assert.ok(ticks.length >= 1 || last - first < 20);
  }
});

test("ticks are round and stand where rows begin", () => {
  assert.deepEqual([0.3, 1, 1.1, 3, 6, 12, 30, 99, 501].map(roundUp), [1, 1, 2, 5, 10, 20, 50, 100, 1000]);
  const { ticks } = shapes(view, view.runs[0], 0, 5, 600);
  assert.deepEqual(ticks.map(({ x, text }) => [x, text]), [[0, "0 s"], [100, "10 ms"], [300, "20 ms"], [500, "40 ms"]]);
  assert.deepEqual([0.05, 0.04, 33.349].map(tenths), [0.1, 0, 33.3]);
});

test("marks never overlap, and the gravest stays", () => {
  const next = chance(9);
  for (let round = 0; round < 200; round += 1) {
    const marks = Array.from({ length: 1 + next(40) }, () => ({ x: next(500), kind: "event", words: "" }));
    Object.assign(marks[0], { kind: "violation", words: "violation of safe" });
    const placed = placeMarks(marks, 500);
    assert.equal(placed[0].kind, "violation");
    placed.forEach((one, i) => placed.slice(i + 1).forEach((two) => assert.ok(one.to < two.from || two.to < one.from)));
  }
});
