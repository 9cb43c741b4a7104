import assert from "node:assert/strict";
import { test } from "node:test";

import { harmless } from "../../../../llfsm_verify/extensions/view/page/drawing.js";

test("drawings keep shapes and colours, and nothing that runs or loads", () => {
  for (const [name, value] of [["d", "M0,0h9"], ["fill", "white"], ["fill", "url(#g)"], ["id", "node1"]]) {
    assert.ok(harmless(name, value), `${name}=${value}`);
  }
  for (const [name, value] of [["onclick", "x()"], ["onload", "x()"], ["href", "#a"], ["xlink:href", "#a"],
    ["style", "fill:red"], ["fill", "url(http://a.b/c)"], ["fill", "url( 'http://a.b/c#d')"], ["fill", "u\\72l(//a.b)"],
    ["clip-path", 'url("//a.b")']]) {
    assert.ok(!harmless(name, value), `${name}=${value}`);
  }
});
