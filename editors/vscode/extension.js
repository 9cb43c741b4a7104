// llfsm-verify in VS Code: starts `llfsm lsp`, and shows its pages in a panel.
"use strict";

const { execFile } = require("node:child_process");
const { randomBytes } = require("node:crypto");
const { mkdtemp, readFile, rm } = require("node:fs/promises");
const { tmpdir } = require("node:os");
const path = require("node:path");
const vscode = require("vscode");
const { LanguageClient, TransportKind } = require("vscode-languageclient/node");
const pages = require("./pages.js");

let client;
let starting;
let panel;
let folder;

function workspace() {
  return vscode.workspace.workspaceFolders?.find((one) => one.uri.scheme === "file")?.uri.fsPath;
}

function setting(name) {
  return vscode.workspace.getConfiguration("llfsm").get(name);
}

/** Show a page in the panel; there is one for all pages. */
async function show(file, title) {
  const html = await readFile(file, "utf8");
  if (!panel) {
    const where = { viewColumn: vscode.ViewColumn.Beside, preserveFocus: true };
    const may = { enableScripts: true, localResourceRoots: [], retainContextWhenHidden: true };
    panel = vscode.window.createWebviewPanel("llfsm.page", title, where, may);
    panel.onDidDispose(() => {
      panel = undefined;
    });
  }
  panel.title = title;
  panel.webview.html = pages.inPanel(html, randomBytes(16).toString("base64"));
  panel.reveal(undefined, true);
}

/** What a command is about: the arguments of a lens, or the property at the cursor; undefined: there is none. */
async function meant(given) {
  const editor = vscode.window.activeTextEditor;
  if (given.length > 0 || !editor) return given;
  const { uri } = editor.document;
  const lenses = await vscode.commands.executeCommand("vscode.executeCodeLensProvider", uri);
  const names = pages.namesAt(lenses, editor.selection.active.line);
  if (names.length === 0) vscode.window.showInformationMessage("There is no property at the cursor.");
  const name = names.length > 1 ? await vscode.window.showQuickPick(names) : names[0];
  return name && [uri.toString(), name];
}

async function execute(command, given, next) {
  if (command !== "llfsm.check" && command !== "llfsm.show") return next(command, given);
  const about = await meant(given);
  if (!about) return undefined;
  const answer = await next(command, about);
  if (command === "llfsm.show" && answer?.path) {
    await show(answer.path, answer.stale ? `${answer.name} (before the last changes)` : answer.name);
  }
  if (command === "llfsm.check" && answer?.text && (given.length === 0 || answer.verdict === "unknown")) {
    vscode.window.showInformationMessage(`${about[1]}: ${answer.text}`);
  }
  return answer;
}

/** Start the server, once. */
function start() {
  starting ??= (async () => {
    const options = pages.server(setting("path"), workspace());
    const documents = {
      documentSelector: [
        { scheme: "file", language: "llfsm-ltl" },
        { scheme: "file", language: "yaml" },
      ],
      initializationOptions: { checkSeconds: setting("checkSeconds") },
      middleware: { executeCommand: execute },
    };
    client = new LanguageClient("llfsm", "llfsm-verify", { ...options, transport: TransportKind.stdio }, documents);
    try {
      await client.start();
    } catch (error) {
      const open = "Open Settings";
      const said = `\`${options.command} lsp\` does not start: ${error.message}.`;
      vscode.window.showErrorMessage(`${said} The setting llfsm.path names the program.`, open).then((chosen) => {
        if (chosen === open) vscode.commands.executeCommand("workbench.action.openSettings", "llfsm.path");
      });
    }
  })();
  return starting;
}

async function stop() {
  const running = client;
  client = starting = undefined;
  if (running?.needsStop()) await running.stop();
}

function startFor(document) {
  return document.uri.scheme === "file" && pages.isOurs(document.languageId, document.getText()) && start();
}

/** `llfsm view FILE -o PAGE`, and the page in the panel. */
async function view(chosen) {
  const filters = { "Traces, recordings": ["yaml", "rec"] };
  const uri = chosen ?? (await vscode.window.showOpenDialog({ filters }))?.[0];
  if (!uri) return;
  folder ??= await mkdtemp(path.join(tmpdir(), "llfsm-"));
  const page = pages.pageOf(folder, uri.fsPath);
  const { command, args } = pages.viewer(setting("path"), workspace(), uri.fsPath, page);
  const title = `Making the page of ${path.basename(uri.fsPath)}`;
  await vscode.window.withProgress({ location: vscode.ProgressLocation.Notification, title }, async () => {
    const problem = await new Promise((done) => {
      execFile(command, args, { cwd: workspace() }, (error, _, said) => done(error && (said.trim() || error.message)));
    });
    if (problem) vscode.window.showErrorMessage(problem);
    else await show(page, path.basename(uri.fsPath));
  });
}

async function activate(context) {
  const changed = async (event) => {
    if (!event.affectsConfiguration("llfsm")) return;
    await stop();
    await Promise.all(vscode.workspace.textDocuments.map(startFor));
  };
  context.subscriptions.push(
    vscode.commands.registerCommand("llfsm.view", view),
    vscode.workspace.onDidOpenTextDocument(startFor),
    vscode.workspace.onDidChangeConfiguration(changed),
  );
  await Promise.all(vscode.workspace.textDocuments.map(startFor));
}

async function deactivate() {
  await stop();
  if (folder) await rm(folder, { recursive: true, force: true });
}

module.exports = { activate, deactivate };
