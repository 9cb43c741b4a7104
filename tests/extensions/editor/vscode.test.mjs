// The extension of VS Code without one: what it starts, which property it means, how it lets a page into its panel.
import assert from "node:assert/strict";
import { mkdtempSync, writeFileSync } from "node:fs";
import Module, { createRequire } from "node:module";
import { tmpdir } from "node:os";
import path from "node:path";
import { test } from "node:test";

const require = createRequire(import.meta.url);
const folder = path.resolve("editors/vscode");
const pages = require(path.join(folder, "pages.js"));

test("the server is started as the setting says", () => {
  assert.deepEqual(pages.server("", undefined), { command: "llfsm", args: ["lsp"], options: { cwd: undefined } });
  const own = pages.server("${workspaceFolder}/.venv/bin/llfsm", "/work/robot");
  assert.deepEqual(own, { command: "/work/robot/.venv/bin/llfsm", args: ["lsp"], options: { cwd: "/work/robot" } });
  assert.equal(pages.program("${workspaceFolder}/llfsm", undefined), "${workspaceFolder}/llfsm");
});

test("a file that begins with a hyphen is no option of the viewer", () => {
  const { command, args } = pages.viewer("", "/work", "-o", "/tmp/x.html");
  assert.deepEqual([command, ...args], ["llfsm", "view", "-o", "/tmp/x.html", "--", "-o"]);
  assert.equal(pages.pageOf("/tmp/p", "/work/a/<b> c.rec"), path.join("/tmp/p", "_b__c.rec.html"));
});

test("only files of ours start a server", () => {
  assert.ok(pages.isOurs("llfsm-ltl", ""));
  assert.ok(pages.isOurs("yaml", "# lights\nname: x\nmachines:\n  a: {file: a.yaml}\n"));
  assert.ok(pages.isOurs("yaml", "ports:\n"));
  assert.ok(!pages.isOurs("yaml", "services:\n  machine: 1\n"));
  assert.ok(!pages.isOurs("json", "machine: A\n"));
});

/** Lenses of a server, each of a line and a command with a property. */
function lenses(...found) {
  return found.map(([line, command, name]) => {
    return { range: { start: { line } }, command: { command, arguments: ["file:///w/a.ltl", name] } };
  });
}

test("the properties at a line are those of its lenses, or of the last above", () => {
  const found = lenses(
    [1, "llfsm.show", "both"], [1, "llfsm.check", "both"], [4, "llfsm.check", "s_a"], [4, "llfsm.check", "s_b"],
    [5, "other", "x"],
  );
  const expected = [[], ["both"], ["both"], ["both"], ["s_a", "s_b"], ["s_a", "s_b"]];
  assert.deepEqual(expected.map((_, line) => pages.namesAt(found, line)), expected);
});

const NASTY = `<!doctype html><html lang="en"><head class="a"><title>x</title></head><body>
<script type="application/json" id="d">{"a": "\\u003cscript>", "b": "<head>"}</script>
<SCRIPT type="module">document.title = "<script>" + 1;</SCRIPT></body></html>`;

test("each script of a page has the nonce, and nothing comes from elsewhere", () => {
  const html = pages.inPanel(NASTY, "N0");
  assert.equal(html.match(/<script nonce="N0"/gi).length, 2);
  assert.ok(html.includes('document.title = "<script>" + 1;'));
  assert.ok(html.indexOf("Content-Security-Policy") < html.indexOf("<title>"));
  assert.ok(html.includes('<head class="a"><meta http-equiv='));
  const rules = Object.fromEntries(pages.policy("N0").split("; ").map((rule) => [rule.split(" ")[0], rule]));
  assert.equal(rules["default-src"], "default-src 'none'");
  assert.equal(rules["script-src"], "script-src 'nonce-N0'");
  assert.ok(!/https?:|\*|unsafe-eval|connect-src/.test(pages.policy("N0")));
  assert.ok(pages.inPanel("<p>no head</p>", "N").startsWith("<meta http-equiv="));
  assert.ok(pages.inPanel("<!doctype html>\n<script>'<head>'</script>", "N").startsWith("<!doctype html><meta"));
});

/** An extension with an editor of our own: what it registers, shows and asks of the server. */
function started(answers, failure, found = lenses([0, "llfsm.check", "p"])) {
  const seen = { panels: [], messages: [], errors: [], asked: [], commands: {}, clients: [] };
  const document = {
    languageId: "llfsm-ltl", uri: { scheme: "file", toString: () => "file:///w/a.ltl" }, getText: () => "p: G a\n",
  };
  class LanguageClient {
    constructor(...given) {
      this.given = given;
      seen.clients.push(this);
    }
    async start() {
      if (failure) throw new Error(failure);
    }
    needsStop() {
      return true;
    }
    async stop() {
      this.stopped = true;
    }
  }
  const nothing = { dispose() {} };
  const vscode = {
    ProgressLocation: { Notification: 15 },
    ViewColumn: { Beside: -2 },
    commands: {
      executeCommand: async () => found,
      registerCommand: (name, run) => ((seen.commands[name] = run), nothing),
    },
    window: {
      activeTextEditor: { document, selection: { active: { line: 0 } } },
      createWebviewPanel(_, title, __, options) {
        const panel = { options, webview: {}, reveal() {}, onDidDispose: (run) => (panel.dispose = run) };
        seen.panels.push(panel);
        return panel;
      },
      showQuickPick: async (names) => names.at(-1),
      showErrorMessage: async (text) => void seen.errors.push(text),
      showInformationMessage: async (text) => void seen.messages.push(text),
      withProgress: (_, run) => run(),
    },
    workspace: {
      textDocuments: [document],
      workspaceFolders: [{ uri: { scheme: "file", fsPath: tmpdir() } }],
      getConfiguration: () => ({ get: (name) => ({ path: "/no/llfsm", checkSeconds: 7 })[name] }),
      onDidOpenTextDocument: () => nothing,
      onDidChangeConfiguration: (run) => ((seen.changed = run), nothing),
    },
  };
  const load = Module._load;
  Module._load = (name, ...rest) => {
    if (name === "vscode") return vscode;
    if (name === "vscode-languageclient/node") return { LanguageClient, TransportKind: { stdio: 0 } };
    return load(name, ...rest);
  };
  const file = path.join(folder, "extension.js");
  delete require.cache[file];
  const extension = require(file);
  Module._load = load;
  seen.send = (command, given) =>
    seen.clients[0].given[3].middleware.executeCommand(command, given, async (name, about) => {
      seen.asked.push([name, ...about]);
      return answers[name];
    });
  return { extension, seen };
}

test("a lens shows the page of its property, in one panel", async () => {
  const page = path.join(mkdtempSync(path.join(tmpdir(), "llfsm-")), "p.html");
  writeFileSync(page, NASTY);
  const answers = {
    "llfsm.show": { name: "p", path: page, stale: false }, "llfsm.check": { verdict: "violated", text: "violated" },
  };
  const { extension, seen } = started(answers);
  await extension.activate({ subscriptions: [] });
  assert.deepEqual(seen.clients[0].given[2].args, ["lsp"]);
  assert.equal(seen.clients[0].given[3].initializationOptions.checkSeconds, 7);
  await seen.send("llfsm.show", ["file:///w/b.ltl", "q"]);
  await seen.send("llfsm.show", []);
  await seen.send("llfsm.check", []);
  await seen.send("other", [1]);
  const here = "file:///w/a.ltl";
  const asked = [["llfsm.show", "file:///w/b.ltl", "q"], ["llfsm.show", here, "p"], ["llfsm.check", here, "p"]];
  assert.deepEqual(seen.asked, [...asked, ["other", 1]]);
  assert.equal(seen.panels.length, 1);
  assert.deepEqual(seen.panels[0].options.localResourceRoots, []);
  assert.match(seen.panels[0].webview.html, /script-src 'nonce-[\w+/=]{20,}'/);
  assert.deepEqual(seen.messages, ["p: violated"]);
  seen.panels[0].dispose();
  await seen.send("llfsm.show", []);
  assert.equal(seen.panels.length, 2);
  await extension.deactivate();
  assert.ok(seen.clients[0].stopped);
});

test("a family asks which property is meant, and a comment has none", async () => {
  const family = started({ "llfsm.check": {} }, "", lenses([0, "llfsm.check", "s_a"], [0, "llfsm.check", "s_b"]));
  await family.extension.activate({ subscriptions: [] });
  await family.seen.send("llfsm.check", []);
  assert.deepEqual(family.seen.asked, [["llfsm.check", "file:///w/a.ltl", "s_b"]]);
  const none = started({}, "", []);
  await none.extension.activate({ subscriptions: [] });
  assert.equal(await none.seen.send("llfsm.check", []), undefined);
  assert.deepEqual([none.seen.asked, none.seen.messages], [[], ["There is no property at the cursor."]]);
});

test("a program that is not there is named, and another setting is tried", async () => {
  const { extension, seen } = started({}, "spawn /no/llfsm ENOENT");
  await extension.activate({ subscriptions: [] });
  assert.match(seen.errors[0], /`\/no\/llfsm lsp` does not start: spawn \/no\/llfsm ENOENT/);
  await seen.changed({ affectsConfiguration: () => true });
  assert.equal(seen.clients.length, 2);
  await seen.commands["llfsm.view"]({ fsPath: "/w/run.rec" });
  assert.match(seen.errors.at(-1), /ENOENT/);
  assert.equal(seen.panels.length, 0);
  await extension.deactivate();
});
