// A run of a light and a number, small enough to be followed by hand.

export function sample(loop = 1) {
  const states = ["RED", "GREEN", "AMBER"].map((name) => ({ name, node: null, place: null }));
  const transitions = [0, 1, 2].map((source) => (
    { source, target: (source + 1) % 3, when: `t${source}`, edge: null, place: null }));
  const run = {
    name: "r", kind: "violation", title: "r", loop, ending: null, window: null,
    rows: {
      step: [0, 1, 2, 3, 4, 5], cycle: [0, 1, 1, 2, 2, 4], time_ms: [0, 10, 10, 20, 20, 40], turn: [-1, 0, 0, 0, 0, 0],
    },
    changes: [
      { at: [0, 2, 3, 5], values: ["RED", "GREEN", "AMBER", "RED"] },
      { at: [0, 4], values: [0, 7] },
      { at: [0, 1, 2], values: [false, true, false] },
    ],
    fired: [[2, 0, 0], [3, 0, 1], [5, 0, 2]],
    ran: { sets: [[], [[0, 1, 1, 1, 4]]], rows: [0, 1, 0, 1, 0, 0] },
    marks: [
      { row: 5, kind: "violation", text: "bad" }, { row: 1, kind: "cause", text: "x", signals: [2] },
      { row: 3, kind: "event", text: "came" },
    ],
  };
  return {
    format: "llfsm-view", version: 1, source: "check", title: "t", files: [],
    arrangement: { name: "a", cycle_ms: 10, processes: [] },
    machines: [{ name: "light", kind: "Light", signal: 0, states, transitions, svg: null }],
    signals: [
      { name: "light", kind: "state", group: "states", draw: "boxes" },
      { name: "n", kind: "whiteboard", group: "whiteboard", draw: "curve", low: 0, high: 7, unit: "m" },
      { name: "b", kind: "input", group: "inputs", draw: "levels" },
    ],
    colours: {}, verdicts: [], runs: [run],
  };
}

/** Numbers at random, the same for the same seed (a linear congruential generator, Numerical Recipes). */
export function chance(seed) {
  let now = seed;
  return (most) => {
    now = (Math.imul(now, 1664525) + 1013904223) >>> 0;
    return Math.floor((now / 2 ** 32) * most);
  };
}
