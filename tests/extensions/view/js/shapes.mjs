// Reads a list of cases as JSON, [document, first, last, width] each, and writes what is drawn of each first run.

import { readFileSync, writeFileSync } from "node:fs";

import { shapes } from "../../../../llfsm_verify/extensions/view/page/shapes.js";

const drawn = ([view, ...part]) => shapes(view, view.runs[0], ...part);
writeFileSync(1, JSON.stringify(JSON.parse(readFileSync(0, "utf-8")).map(drawn)));
