import assert from "node:assert/strict";
import { test } from "node:test";

import * as transport from "../../../../llfsm_verify/extensions/view/page/transport.js";

/** Follow a stream that the test speaks for. */
function followed() {
  const said = [];
  const stream = {
    readyState: 0, closed: false, addEventListener: (kind, act) => (stream[kind] = act),
    close: () => (stream.closed = true),
  };
  let loads = 0;
  const take = (update, connection) => said.push([update && update.behind_ms, connection]);
  const open = (address) => Object.assign(stream, { address });
  transport.follow("/events?after=1.0.0", take, { open, again: () => (loads += 1), now: () => 1000 });
  const send = (update, name) => stream.onmessage({ data: JSON.stringify(update), lastEventId: name });
  return { said, stream, send, loads: () => loads };
}

test("updates are taken with their age when they come", () => {
  const { said, stream, send } = followed();
  assert.equal(stream.address, "/events?after=1.0.0");
  stream.onopen();
  send({ behind_ms: 12, ending: null }, "1.2.0.900");
  send({ behind_ms: 12, ending: null }, "1.2.0.1200");
  send({ behind_ms: 12, ending: null }, "");
  assert.deepEqual(said, [[null, "live"], [112, "live"], [12, "live"], [12, "live"]]);
});

test("a run that is over stays so, and a lost connection is told", () => {
  const { said, stream, send } = followed();
  send({ behind_ms: 0, ending: "a process died" }, "1.2.0.1000");
  stream.onerror();
  stream.readyState = 2;
  stream.onerror();
  stream.onopen();
  const over = "■ the run is over: a process died";
  const told = said.map(([, connection]) => connection);
  assert.deepEqual(told, [over, transport.wordLost(0), transport.wordLost(2), over]);
  assert.notEqual(transport.wordLost(0), transport.wordLost(2));
});

test("another run gives another document", () => {
  const { stream, loads } = followed();
  stream.document();
  assert.deepEqual([stream.closed, loads()], [true, 1]);
});

test("text is read from the page", () => {
  const page = { getElementById: (name) => (name === "there" ? { textContent: "{}" } : null) };
  assert.deepEqual(["there", "elsewhere"].map((name) => transport.embeddedText(page, name)), ["{}", null]);
});

test("windows are asked for, and what goes wrong is an error", async () => {
  const before = globalThis.fetch;
  const asked = [];
  try {
    const text = async () => "the file is gone\n";
    globalThis.fetch = async (address) => (asked.push(address), { ok: asked.length === 1, text });
    assert.equal(await transport.fetchWindow("/window", 3, 9), "the file is gone\n");
    const gone = { message: "The rows could not be had: the file is gone" };
    await assert.rejects(transport.fetchWindow("/window", 10, 12), gone);
    assert.deepEqual(asked, ["/window?first=3&last=9", "/window?first=10&last=12"]);
  } finally {
    globalThis.fetch = before;
  }
});
