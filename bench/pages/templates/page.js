"use strict";
// The page address, which stores the selection; sorting of tables, readouts of charts, and tooltips.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

function make(name, attributes = {}, ...children) {
  const node = attributes.svg ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (key !== "svg") node.setAttribute(key, value);
  node.append(...children);
  return node;
}
const withMinus = (number) => String(number).replace(/^-/, "−");
const draw = (name, attributes, ...children) => make(name, { svg: true, ...attributes }, ...children);

// ---- The page address stores the selection, so that a link opens the same view.
let state = new URLSearchParams();
const listeners = [];
let later = 0;

function readAddress() {
  const text = location.hash.slice(1) || data.start, part = byId(text);
  data.start = "";
  state = new URLSearchParams(selectionOf(text));
  for (let node = part; node; node = node.parentElement) if (node.matches("details")) node.open = true;
  part?.scrollIntoView();
  listeners.forEach((listener) => listener());
}
/** Return the selection of a link as text: `sequence=…`, or numbers, which `PlayerPosition.link` writes. */
function selectionOf(text) {
  if (!/^\d+\.\d+\./.test(text)) return text.includes("=") ? text : "";
  const [sequence, tracker, repetition, frame, start, revised, ...show] = text.split(".");
  const more = { start: Number(start) && start, trajectory: Number(revised) && "revised", show: show.join(".") };
  const given = Object.entries(more).filter(([, value]) => value);
  return `${new URLSearchParams({ sequence: data.sequences[sequence]?.name, tracker: data.labels[tracker], repetition, frame, ...Object.fromEntries(given) })}`;
}

/** Change the selection; null removes a key. With `step` the back button restores the previous selection. */
function choose(changes, step = false) {
  for (const [key, value] of Object.entries(changes)) {
    if (value === null || value === "") state.delete(key);
    else state.set(key, value);
  }
  clearTimeout(later);
  if (step) writeHistory("pushState", address());
  else later = setTimeout(writeAddress, 200);  // not for each frame during playback
  listeners.forEach((listener) => listener());
}
const address = () => `#${state}`;
const writeAddress = () => writeHistory("replaceState", state.size ? address() : location.pathname + location.search);
function writeHistory(how, url) {
  try { history[how](null, "", url); } catch { /* a page inside a notebook has no address of its own */ }
}

addEventListener("popstate", readAddress);
addEventListener("hashchange", readAddress);
addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href^='#']"), selection = link && selectionOf(link.getAttribute("href").slice(1));
  if (!selection || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  openPlayer(selection);
});
const openPlayer = (selection) => choose({ tracker: null, repetition: null, start: null, trajectory: null, show: null, alone: null, ...Object.fromEntries(new URLSearchParams(selection)) }, true);

// ---- Tables: a click on a head sorts by its column, first the largest numbers; other texts follow.
const NUMBER = /^[[(~<>≤≥]*\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?=$|[\s,;%\])±–*])/i;

/** Return the number at the start of a text, such as `~3.1`, `< .001`, `[-0.2, 0.1]` or `54 of 99`; dates are no numbers. */
const numberIn = (text) => Number(NUMBER.exec(text.replace(/−/g, "-"))?.[1] ?? -Infinity);
for (const head of document.querySelectorAll("table:not(#heat, #main) thead th")) {
  head.replaceChildren(make("button", head.textContent ? {} : { "aria-label": "row" }, ...head.childNodes));
  head.addEventListener("click", () => sortRows(head));
}
function sortRows(head) {
  const body = head.closest("table").tBodies[0], sign = head.ariaSort === "descending" ? 1 : -1;
  const key = (row) => row.cells[head.cellIndex].textContent.trim();
  body.append(...[...body.rows].sort((a, b) => sign * (numberIn(key(a)) - numberIn(key(b)) || key(b).localeCompare(key(a)))));
  for (const other of head.parentElement.cells) other.ariaSort = null;
  head.ariaSort = sign > 0 ? "ascending" : "descending";
}

// ---- The heat map: the filter keeps the rows that contain a word.
byId("filter")?.addEventListener("input", ({ target }) => {
  for (const row of byId("heat").tBodies[0].rows) row.hidden = !row.textContent.toLowerCase().includes(target.value.toLowerCase());
  byId("heat").classList.toggle("all", Boolean(target.value));
});
byId("all-rows")?.addEventListener("click", ({ target }) => { target.ariaExpanded = byId("heat").classList.toggle("all"); });

// ---- Charts: the page contains them; the pointer and the arrow keys add a readout and open frames.
const colourOf = (position) => getComputedStyle(document.documentElement).getPropertyValue(`--c${Math.min(position, 6)}`);
const dashOf = (position) => data.dashes[position % data.dashes.length];

function sampleOf(position) {
  return draw("svg", { viewBox: "0 0 34 12", "aria-hidden": "true" },
    draw("path", { class: `curve c${Math.min(position, 6)}`, d: "M0,6H34", "stroke-dasharray": dashOf(position) }),
    draw("path", { class: `mark c${Math.min(position, 6)}`, d: data.markers[position % data.markers.length], transform: "translate(17,6)" }));
}

function ticksOf(low, high) {
  const rough = (high - low) / 8 || 1, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].find((digit) => digit * power >= rough) * power;  // four to eight ticks
  const ticks = [];
  for (let tick = Math.ceil(low / step - 1e-9) * step; tick <= high + 1e-9 * step; tick += step) ticks.push(Number(tick.toPrecision(10)));
  return ticks;
}

const tip = make("div", { class: "tip", role: "status", hidden: "" });
document.body.append(tip);
function showTip(text, left, top) {
  tip.textContent = text;
  tip.hidden = false;
  tip.style.left = `${Math.max(4, Math.min(left + 14, innerWidth - tip.offsetWidth - 8))}px`;
  tip.style.top = `${Math.min(top + 14, innerHeight - tip.offsetHeight - 8)}px`;
}

/** Return the points of a path of absolute moves and relative lines. */
function pointsOf(path) {
  return path.split("M").slice(1).flatMap((line) => {
    const steps = line.match(/-?[\d.]+/g).map(Number), points = [];
    for (let i = 0, x = 0, y = 0; i < steps.length; i += 2) points.push([x += steps[i], y += steps[i + 1]]);
    return points;
  });
}

class Plot {
  constructor(svg) {
    this.svg = svg;
    this.figure = svg.closest("figure");
    const [left, right, low, high, bottom, top, least, most] = svg.dataset.scale.split(" ").map(Number);
    this.digits = high > 2 ? 0 : 2;
    this.xAt = (px) => low + (px - left) / (right - left) * (high - low);
    this.yAt = (py) => least + (bottom - py) / (bottom - top) * (most - least);
    this.lines = [...svg.querySelectorAll(".curve[data-k]")].reverse().map((path) => ({
      tracker: Number(path.dataset.k), path,
      points: pointsOf(path.getAttribute("d")),
      positions: (path.dataset.positions || "").split(" "),
    }));
    this.hair = draw("path", { class: "hair" });
    svg.append(this.hair);
    for (const [name, value] of Object.entries({ tabindex: 0, "aria-roledescription": "chart; arrow keys read its points, Enter opens one" })) svg.setAttribute(name, value);
    this.line = this.lines[0];
    this.index = 0;
    svg.addEventListener("pointermove", (event) => this.aim(event));
    svg.addEventListener("pointerleave", () => this.leave());
    svg.addEventListener("click", (event) => { this.aim(event); this.open(); });  // a tap has no preceding move event
    svg.addEventListener("focus", () => { if (svg.matches(":focus-visible")) this.show(); });
    svg.addEventListener("blur", () => this.leave());
    svg.addEventListener("keydown", (event) => this.press(event));
  }
  aim(event) {
    const box = this.svg.getBoundingClientRect(), scale = this.svg.viewBox.baseVal.width / box.width;
    const [px, py] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
    let least = Infinity;
    for (const line of this.lines) line.points.forEach(([x, y], index) => {
      const far = Math.hypot(4 * (x - px), y - py);  // the abscissa counts more than the distance from a line
      if (far < least) [least, this.line, this.index] = [far, line, index];
    });
    this.show(event.clientX, event.clientY);
  }
  text(y) { return this.figure.dataset.percent ? `${Math.round(100 * this.yAt(y))} %` : withMinus(this.yAt(y).toFixed(2)); }
  show(left, top) {
    const [x, y] = this.line.points[this.index], box = this.svg.getBoundingClientRect(), scale = box.width / this.svg.viewBox.baseVal.width;
    const at = `${this.figure.dataset.x} ${this.xAt(x).toFixed(this.digits)}`;
    this.hair.setAttribute("d", `M${x},10V${this.svg.viewBox.baseVal.height - 38}`);
    showTip(`${data.trackers[this.line.tracker]}: ${this.text(y)} at ${at}`, left ?? box.left + x * scale, top ?? box.top + y * scale);
  }
  leave() { tip.hidden = true; this.hair.removeAttribute("d"); }
  /** Open the frame of a point; a line with one position opens the frames along its abscissa. */
  open() {
    const { positions, points } = this.line;
    const along = positions.length === 1 && positions[0].replace(/\d+$/, Math.round(this.xAt(points[this.index][0])));
    const selection = selectionOf(along || positions[this.index]);
    if (selection && data.sequences.length) { this.leave(); openPlayer(selection); }
  }
  press(event) {
    const step = { ArrowLeft: [0, -1], ArrowRight: [0, 1], Home: [0, -Infinity], End: [0, Infinity], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || !(step || event.key === "Enter")) return;
    event.preventDefault();
    if (!step) { this.open(); return; }
    this.line = this.lines.at((this.lines.indexOf(this.line) + step[0]) % this.lines.length);
    this.index = Math.max(0, Math.min(this.index + step[1], this.line.points.length - 1));
    this.show();
  }
}
for (const svg of document.querySelectorAll("figure.chart > svg:has(.curve[data-k])")) new Plot(svg);

// A row of the leaderboard highlights its line; a switch exchanges plots; terms have tooltips.
for (const row of document.querySelectorAll(".lead li")) for (const kind of ["pointerenter", "pointerleave", "focusin", "focusout"])
  row.addEventListener(kind, () => document.querySelectorAll(`.curve[data-k="${row.dataset.k}"]`).forEach((line) => line.classList.toggle("lit", /enter|in$/.test(kind))));
for (const button of document.querySelectorAll(".switch button")) button.addEventListener("click", () => {
  for (const other of button.parentElement.children) {
    other.setAttribute("aria-pressed", other === button);
    byId(other.dataset.plot).classList.toggle("on", other === button);
    byId(other.dataset.plot).classList.toggle("off", other !== button);
  }
});
for (const kind of ["pointerover", "focusin"]) addEventListener(kind, ({ target }) => {
  const term = target.closest?.("[data-tip]");
  if (!term || (kind === "focusin" && !target.matches(":focus-visible"))) return;
  const { left, bottom } = term.getBoundingClientRect();
  showTip(term.dataset.tip, left - 14, bottom - 8);
});
for (const kind of ["pointerout", "focusout"]) addEventListener(kind, ({ target }) => { if (target.closest?.("[data-tip]")) tip.hidden = true; });
addEventListener("keydown", (event) => { if (event.key === "Escape") tip.hidden = true; });

// ---- In print all sections are open.
addEventListener("beforeprint", () => {
  for (const fold of document.querySelectorAll("main details:not([open])")) fold.classList.toggle("unfolded", fold.open = true);
});
addEventListener("afterprint", () => {
  for (const fold of document.querySelectorAll("details.unfolded")) fold.classList.toggle("unfolded", fold.open = false);
});

// ---- Copy buttons of commands and links.
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {  // some browsers refuse the clipboard to pages from disk
    prompt("Copy this text:", text);
  }
}
addEventListener("click", async (event) => {
  const button = event.target.closest?.(".copy");
  if (!button) return;
  await copy(button.previousElementSibling.textContent);
  button.textContent = "Copied";
  setTimeout(() => { button.textContent = "Copy"; }, 1500);
});
if (!data.sequences.length) readAddress();
