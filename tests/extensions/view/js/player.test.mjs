import assert from "node:assert/strict";
import { test } from "node:test";

import { SPEEDS, Walk, createPace } from "../../../../llfsm_verify/extensions/view/page/player.js";
import { sample } from "./sample.mjs";

function walked(loop) {
  return new Walk(sample(loop).runs[0]);
}

test("rows, cycles and the ends", () => {
  const walk = walked();
  const rows = (...moves) => moves.map(([way, unit]) => {
    walk.move(way, unit);
    return walk.row;
  });
  assert.deepEqual(rows([1], [1], [-1], [-1], [-1]), [1, 2, 1, 0, 0]);
  assert.deepEqual(rows(...Array(4).fill([1, "cycle"])), [1, 3, 5, 5]);
  assert.deepEqual(rows(...Array(4).fill([-1, "cycle"])), [3, 1, 0, 0]);
});

test("the slider counts steps, cycles or milliseconds", () => {
  const walk = walked();
  walk.go(3);
  assert.deepEqual(walk.scale, { low: 0, high: 5, now: 3 });
  walk.unit = "cycle";
  assert.deepEqual(walk.scale, { low: 0, high: 4, now: 2 });
  walk.slide(4);
  assert.equal(walk.row, 5);
  walk.unit = "time";
  walk.slide(10);
  assert.equal(walk.row, 2);
});

test("jumps", () => {
  const walk = walked();
  assert.ok(walk.jump("violation", 1));
  assert.equal(walk.row, 5);
  assert.ok(!walk.jump("violation", 1));
  walk.jump("event", -1);
  assert.equal(walk.row, 3);
  walk.go(0);
  walk.jump("change", 1);
  assert.equal(walk.row, 1);
  walk.watched.add(1);
  walk.jump("change", 1);
  assert.equal(walk.row, 4);
  assert.ok(!walk.jump("change", 1));
});

test("playing counts laps of a lasso, stops at another end, and starts again", () => {
  const walk = walked(1);
  walk.toggle();
  for (let i = 0; i < 9; i += 1) walk.tick(250);
  assert.deepEqual([walk.row, walk.laps, walk.playing], [5, 1, true]);
  const other = walked(null);
  other.toggle();
  for (let i = 0; i < 9; i += 1) other.tick(250);
  assert.deepEqual([other.row, other.playing], [5, false]);
  other.toggle();
  assert.deepEqual([other.row, other.playing], [0, true]);
  const still = walked(5);
  still.go(5);
  still.toggle();
  still.tick(1000);
  assert.ok(still.row < 5);
});

test("by time a run takes as long as it took", () => {
  const walk = walked(null);
  walk.unit = "time";
  walk.toggle();
  const rows = [];
  for (let i = 0; i < 5; i += 1) {
    walk.tick(10);
    rows.push(walk.row);
  }
  assert.deepEqual(rows, [2, 4, 4, 5, 5]);
});

test("by cycle, and fast", () => {
  const walk = walked(1);
  walk.unit = "cycle";
  walk.toggle();
  const rows = [];
  for (let i = 0; i < 5; i += 1) {
    walk.tick(250);
    rows.push(walk.row);
  }
  assert.deepEqual(rows, [1, 3, 5, 2, 3]);
  for (let i = 0; i < 20; i += 1) walk.faster(1);
  assert.equal(walk.speed, SPEEDS.at(-1));
  walk.tick(250);
  assert.ok(walk.laps > 100);
});

test("what comes by itself is drawn seldom, the more so the longer a drawing takes; what is asked for at once", () => {
  let [now, drawn, frame, cost, made] = [1000, [], null, 0, 0];
  const timers = new Map();
  const run = (until) => {
    for (; now <= until; now += 1) {
      for (const [timer, { at, work }] of [...timers]) if (at <= now && timers.delete(timer)) work();
      if (now % 10 || !frame) continue;
      const work = frame;
      [frame, drawn] = [null, [...drawn, now]];
      work(now);
    }
  };
  const outside = {
    performance: { now: () => now }, requestAnimationFrame: (work) => (frame = work),
    setTimeout: (work, after = 0) => timers.set(made += 1, { at: now + after, work }) && made,
    clearTimeout: (timer) => timers.delete(timer),
  };
  const pace = createPace(() => (now += cost), outside);
  const offered = (until) => {
    drawn = [];
    for (const end = until; now < end;) {
      pace.offer();
      run(Math.min(end, now + 33));
    }
    return drawn.length;
  };
  const cheap = offered(3000);
  assert.ok(cheap > 15 && cheap <= 25, String(cheap));
  cost = 40;
  const dear = offered(7000);
  assert.ok(dear >= 8 && dear <= 11, String(dear));
  drawn = [];
  pace.ask();
  run(now + 10);
  assert.equal(drawn.length, 1);
});
