// Tokens by the tokeniser of VS Code. Reads {modules, grammars: {scope: file}, injections: [scope],
// jobs: [[scope, text]]}, and prints for each text its lines, each a list of [start, end, scopes].
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const asked = JSON.parse(readFileSync(0, "utf8"));
const load = createRequire(`${asked.modules}/`);
const oniguruma = load("vscode-oniguruma");
const { INITIAL, Registry, parseRawGrammar } = load("vscode-textmate");

await oniguruma.loadWASM(readFileSync(load.resolve("vscode-oniguruma/release/onig.wasm")).buffer);
const registry = new Registry({
  onigLib: Promise.resolve({
    createOnigScanner: (patterns) => new oniguruma.OnigScanner(patterns),
    createOnigString: (text) => new oniguruma.OnigString(text),
  }),
  loadGrammar: async (scope) => {
    const file = asked.grammars[scope];
    return file ? parseRawGrammar(readFileSync(file, "utf8"), file) : null;
  },
  getInjections: (scope) => (scope === "source.yaml" ? asked.injections : undefined),
});

const answers = [];
for (const [scope, text] of asked.jobs) {
  const grammar = await registry.loadGrammar(scope);
  let stack = INITIAL;
  const lines = [];
  for (const line of text.split("\n")) {
    const made = grammar.tokenizeLine(line, stack);
    stack = made.ruleStack;
    lines.push(made.tokens.map((token) => [token.startIndex, token.endIndex, token.scopes]));
  }
  answers.push(lines);
}
process.stdout.write(JSON.stringify(answers));
