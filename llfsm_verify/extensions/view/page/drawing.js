// Draws machines: puts in Graphviz's drawings, and lights the states of a row and the transitions that fired.

import { clip, firedAt, marksAt, stateAt, tellFired, valueAt, visitsUpTo, spell } from "./model.js";

const SVG = "http://www.w3.org/2000/svg";
const ELEMENTS = new Set(
  ("svg g path polygon polyline ellipse circle rect line text tspan title desc defs marker linearGradient " +
    "radialGradient stop clipPath").split(" "),
);
const ATTRIBUTES = new Set(
  ("id class d points x y x1 y1 x2 y2 dx dy cx cy r rx ry width height viewBox transform fill stroke stroke-width " +
    "stroke-dasharray stroke-opacity fill-opacity opacity text-anchor font-family font-size font-weight font-style " +
    "dominant-baseline textLength lengthAdjust offset stop-color preserveAspectRatio gradientUnits role " +
    "marker-end marker-start refX refY orient markerWidth markerHeight clip-path").split(" "),
);

/** An element of HTML: attributes by name (`text` is its text, `on…` are listeners), then children. */
export function make(tag, attributes = {}, ...children) {
  return dress(document.createElement(tag), attributes, children);
}

/** Let an element have this text; nothing is laid out again where it has it already. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** The parts of a text, in which what stands between backticks is code. */
export function quote(text) {
  const parts = text.split(/`([^`]+)`/).map((part, i) => (i % 2 ? make("code", { text: part }) : part));
  return parts.filter((part) => part !== "");
}

/** Say a text with what it quotes; see `quote` and `say`. */
export function sayQuoted(element, text) {
  if (element.textContent !== text.replace(/`([^`]+)`/g, "$1")) element.replaceChildren(...quote(text));
}

/** A row of a table: its head, then its cells; each is a text, an element or a list of them. */
export function line(head, ...cells) {
  const within = (what) => (Array.isArray(what) ? what : [what]).filter((part) => part !== null);
  const shown = cells.map((cell) => make("td", {}, ...within(cell)));
  return make("tr", {}, make("th", { scope: "row" }, ...within(head)), ...shown);
}

/** Put these into the body of a section. */
export function fill(section, ...children) {
  section.querySelector(".body").replaceChildren(...children.filter((child) => child !== null));
}

/** An element of SVG. */
export function draw(tag, attributes = {}, ...children) {
  return dress(document.createElementNS(SVG, tag), attributes, children);
}

/** Give an element attributes and children; see `make`. */
export function dress(element, attributes, children = []) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") element.textContent = value;
    else if (name === "style") element.style.cssText = value;
    else if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null));
  return element;
}

/** Whether a drawing may keep an attribute: names are known, and what it refers to is inside of the drawing. */
export function harmless(name, value) {
  return ATTRIBUTES.has(name) && !/url\(\s*['"]?\s*[^#'"\s]/i.test(value) && !/[\\]/.test(value);
}

/** The `<svg>` of a drawing without what could run or load something; null: it is none. */
export function cleanDrawing(text) {
  const parsed = new DOMParser().parseFromString(text, "image/svg+xml");
  const root = parsed.documentElement;
  if (root.localName !== "svg" || parsed.querySelector("parsererror")) return null;
  for (const element of [...root.querySelectorAll("a")].reverse()) element.replaceWith(...element.childNodes);
  for (const element of [root, ...root.querySelectorAll("*")]) {
    if (element.namespaceURI !== SVG || !ELEMENTS.has(element.localName)) {
      element.remove();
      continue;
    }
    for (const { name, value } of [...element.attributes]) {
      if (name !== "xmlns" && !harmless(name, value)) element.removeAttribute(name);
    }
  }
  return document.importNode(root, true);
}

/** Draw all machines of a document into an element. Returns a function that shows a row of a run. */
export function drawMachines(view, place, style) {
  const shown = view.machines.map((machine, index) => drawMachine(view, machine, index, style));
  const nested = make("input", { type: "checkbox", id: "nested", checked: true, onchange: () => {
    view.machines.forEach((machine, i) => (shown[i].element.hidden = Boolean(machine.inside) && !nested.checked));
  } });
  const choice = make("label", { class: "quiet" }, nested, " machines that run inside of states");
  place.replaceChildren(...showArrangement(view), view.machines.some((machine) => machine.inside) ? choice : "",
    make("div", { class: `figures${shown.length > 6 ? " many" : ""}` }, ...shown.map((one) => one.element)));
  return (run, row) => shown.forEach((one, index) => lightMachine(view, run, row, one, index));
}

/**
 * Mark what is covered in the machines of an element, without a run: a goal is that of a state or a transition by its
 * machine and its place. Without coverage nothing is marked as missing. Returns how many there are, by kind.
 */
export function lightCoverage(view, place) {
  const goals = view.coverage ? view.coverage.goals : [];
  const key = (kind, machine, span) => `${kind} ${machine} ${span}`;
  const known = new Map(goals.map(({ kind, name, span, status }) => [key(kind, name.split(": ")[0], span), status]));
  const counts = { state: [0, 0], transition: [0, 0] };
  const light = (element, kind, machine, item) => {
    const status = item.place ? known.get(key(kind, machine, item.place)) : undefined;
    if (status !== undefined) element.dataset.status = status;
    element.classList.toggle("visited", status === undefined || status === "covered");
    if (status === undefined) return;
    counts[kind][0] += status === "covered";
    counts[kind][1] += 1;
  };
  for (const figure of place.querySelectorAll("[data-machine]")) {
    const { name, states, transitions } = view.machines[figure.dataset.machine];
    const stated = new Map(states.map((state) => [state.name, state]));
    for (const element of figure.querySelectorAll("[data-state]")) {
      light(element, "state", name, stated.get(element.dataset.state));
    }
    for (const element of figure.querySelectorAll("[data-transition]")) {
      light(element, "transition", name, transitions[element.dataset.transition]);
    }
    for (const said of figure.querySelectorAll(".fired, .mark")) said.hidden = true;
  }
  return counts;
}

/** The drawing of the arrangement, and whose turn follows whose. */
function showArrangement({ arrangement: { svg, processes } }) {
  const drawing = svg ? cleanDrawing(svg) : null;
  if (drawing) fit(drawing);
  const turns = processes.map(({ name, machines }) => `${processes.length > 1 ? `${clip(name)}: ` : ""}${
    machines.map((machine) => clip(machine)).join(" → ")}`);
  const summary = make("summary", { text: `Turns: ${turns.join("; ")}` });
  if (!drawing) return turns.length ? [make("p", { class: "quiet", text: summary.textContent })] : [];
  return [make("details", {}, summary, make("div", { class: "drawing" }, drawing))];
}

function drawMachine(view, machine, index, style) {
  const drawing = machine.svg ? cleanDrawing(machine.svg) : null;
  const state = make("strong", { class: "state" });
  const count = make("span", { class: "quiet count" });
  const fired = make("p", { class: "fired" });
  const marks = make("p", { class: "mark" });
  const inside = machine.inside ? make("span", { class: "quiet", text: ` inside ${clip(machine.inside)}` }) : null;
  const toggle = (kind, text, label) => make("button", {
    type: "button", class: "small", text, "aria-label": `${label} ${clip(machine.name)}`, title: label,
    "aria-pressed": false,
    onclick: (event) => event.currentTarget.setAttribute("aria-pressed", element.classList.toggle(kind)),
  });
  const sizes = make("span", { class: "sizes" }, toggle("folded", "–", "Fold"), toggle("large", "⤢", "Enlarge"));
  const name = make("span", { class: "name", text: clip(machine.name) });
  const head = make("figcaption", {}, sizes, name, inside, " ", state, " ", count);
  const element = make("figure", { class: "machine", "data-machine": index }, head, fired, marks);
  const nodes = drawing ? byId(drawing, machine.states, "node") : listStates(machine);
  const edges = drawing ? byId(drawing, machine.transitions, "edge") : [];
  if (drawing) {
    drawing.setAttribute("role", "img");
    drawing.setAttribute("aria-label", `Drawing of ${clip(machine.name)}`);
    for (const named of drawing.querySelectorAll("[id]")) if (named.localName === "g") named.removeAttribute("id");
    element.append(make("div", { class: "drawing", tabindex: 0, role: "group", "aria-label": "Drawing" }, drawing));
    const width = fit(drawing);
    if (width > 0) element.style.flexBasis = `${Math.ceil(width) + 22}px`;
  } else {
    element.append(make("ol", { class: "states" }, ...nodes));
  }
  nodes.forEach((node, i) => {
    if (!node) return;
    node.dataset.state = machine.states[i].name;
    style(node, machine.states[i].name);
  });
  edges.forEach((edge, i) => edge && (edge.dataset.transition = i));
  return { element, nodes, edges, state, count, fired, marks };
}

/** Graphviz says sizes in points; all drawings are as large, in pixels, or as their place allows. Returns the width. */
function fit(drawing) {
  const [, , width] = (drawing.getAttribute("viewBox") || "").split(/[\s,]+/).map(Number);
  drawing.removeAttribute("height");
  drawing.removeAttribute("width");
  if (width > 0) drawing.style.width = `${width}px`;
  return width;
}

/** Scroll a drawing so that what is active can be seen. */
function reveal(node) {
  const place = node.closest(".drawing");
  if (!place || (place.scrollHeight <= place.clientHeight && place.scrollWidth <= place.clientWidth)) return;
  const [box, at] = [place.getBoundingClientRect(), node.getBoundingClientRect()];
  if (at.top < box.top || at.bottom > box.bottom) place.scrollTop += at.top - box.top - (box.height - at.height) / 2;
  if (at.left < box.left || at.right > box.right) place.scrollLeft += at.left - box.left - (box.width - at.width) / 2;
}

function byId(drawing, items, key) {
  const found = new Map([...drawing.querySelectorAll("[id]")].map((element) => [element.id, element]));
  return items.map((item) => (item[key] === null ? null : found.get(item[key]) || null));
}

function listStates(machine) {
  return machine.states.map((state) => make("li", { text: clip(state.name, 40) }));
}

function lightMachine(view, run, row, shown, index) {
  const machine = view.machines[index];
  const current = stateAt(view, run, index, row);
  const fired = firedAt(run, row).filter(([other]) => other === index).map(([, transition]) => transition);
  const marks = marksAt(run, row);
  const wrong = marks.some((mark) => mark.kind === "violation" || mark.kind === "fault");
  const mine = marks.filter((mark) => mark.kind === "cause" && (mark.signals || []).includes(machine.signal));
  const visits = visitsUpTo(view, run, index, row);
  const unknown = typeof machine.signal !== "number";
  const acts = run.rows.turn[row] === index || fired.length > 0;
  shown.nodes.forEach((node, i) => {
    if (!node) return;
    if (i === current && !node.classList.contains("lit")) reveal(node);
    node.classList.toggle("lit", i === current);
    node.classList.toggle("wrong", i === current && wrong && acts);
    node.classList.toggle("visited", unknown || visits.entered[i] > 0);
    node.dataset.visits = visits.entered[i];
  });
  shown.edges.forEach((edge, i) => {
    if (!edge) return;
    edge.classList.toggle("lit", fired.includes(i));
    edge.classList.toggle("wrong", fired.includes(i) && wrong);
    edge.classList.toggle("visited", unknown || visits.fired[i] > 0);
    edge.dataset.visits = visits.fired[i];
  });
  shown.element.classList.toggle("acts", acts);
  shown.element.classList.toggle("cause", mine.length > 0);
  const known = unknown ? undefined : valueAt(run, machine.signal, row);
  say(shown.state, known === undefined ? "" : `in ${clip(known, 60)}`);
  shown.element.dataset.state = known === undefined ? "" : String(known);
  shown.element.dataset.fired = fired.join(" ");
  const times = current < 0 ? 0 : visits.entered[current];
  const turn = run.rows.turn[row] === index ? "its turn" : "";
  say(shown.count, [turn, times ? `entered ${spell(times)}×` : ""].filter(Boolean).join(", "));
  const words = fired.map((i) => tellFired(view, index, i).slice(clip(machine.name).length + 2));
  say(shown.fired, words.length ? `→ fired: ${words.join("; ")}` : "");
  const said = mine.map((mark) => `◆ cause: ${clip(mark.text)}`);
  if (wrong && acts) said.push("✗ in the violating step");
  sayQuoted(shown.marks, said.join("; "));
}
