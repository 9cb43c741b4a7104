// What does not need an editor: which program is started, which properties are meant, how a page is let into a panel.
"use strict";

const path = require("node:path");

const KEYS = ["machine", "states", "machines", "schedule", "processes", "whiteboard", "levels", "ports"];
const OURS = new RegExp(`^(?:${KEYS.join("|")})[ \\t]*:`, "m");

/** Whether a text is a property file, or YAML that begins one of its lines with a key of ours. */
function isOurs(language, text) {
  return language === "llfsm-ltl" || (language === "yaml" && OURS.test(text));
}

/** The program that the setting `llfsm.path` names; `folder`: that of the workspace, if there is one. */
function program(setting, folder) {
  const named = (setting || "").trim() || "llfsm";
  return folder ? named.replaceAll("${workspaceFolder}", folder) : named;
}

/** How the language server is started. */
function server(setting, folder) {
  return { command: program(setting, folder), args: ["lsp"], options: { cwd: folder } };
}

/** How a trace or a recording becomes a page. */
function viewer(setting, folder, file, page) {
  return { command: program(setting, folder), args: ["view", "-o", page, "--", file] };
}

/** A file for the page of a trace or a recording in `folder`. */
function pageOf(folder, file) {
  return path.join(folder, `${path.basename(file).replace(/[^\w.-]/g, "_")}.html`);
}

/** The names of the properties at a line or above it: those of the last lenses; a family has several in one place. */
function namesAt(lenses, line) {
  const checks = lenses.filter((lens) => lens.command?.command === "llfsm.check" && lens.range.start.line <= line);
  const last = Math.max(...checks.map((lens) => lens.range.start.line));
  return [...new Set(checks.filter((lens) => lens.range.start.line === last).map((lens) => lens.command.arguments[1]))];
}

/** The Content-Security-Policy of a panel: the scripts of the page and its styles, and nothing from elsewhere. */
function policy(nonce) {
  const scripts = `script-src 'nonce-${nonce}'`;
  return `default-src 'none'; ${scripts}; style-src 'unsafe-inline'; img-src data: blob:; font-src data:`;
}

/** A page as a panel shows it: with its policy, and the nonce on each of its scripts. */
function inPanel(html, nonce) {
  const meta = `<meta http-equiv="Content-Security-Policy" content="${policy(nonce)}">`;
  // A script ends at the first `</script`; what looks like a tag before that is its text.
  const marked = html.replace(
    /<script(?=[\s>/])([^>]*>[\s\S]*?<\/script\s*>)/gi,
    (_, rest) => `<script nonce="${nonce}"${rest}`,
  );
  const before = marked.slice(0, Math.max(0, marked.search(/<script[\s>/]/i)));
  const tag = /<head(?:\s[^>]*)?>/i.exec(before) ?? /<!doctype[^>]*>/i.exec(before);
  const at = tag ? tag.index + tag[0].length : 0;
  return marked.slice(0, at) + meta + marked.slice(at);
}

module.exports = { inPanel, isOurs, namesAt, pageOf, policy, program, server, viewer };
