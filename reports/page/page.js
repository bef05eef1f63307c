"use strict";
// Tables that sort, charts that open the player, and the address that holds what is seen.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";
const CROWDED = 7;  // lines in one plot; where there are more each has a plot of its own

function make(name, attributes = {}, ...children) {
  const node = attributes.svg ? document.createElementNS(SVG, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (key !== "svg") node.setAttribute(key, value);
  node.append(...children);
  return node;
}
const draw = (name, attributes, ...children) => make(name, { svg: true, ...attributes }, ...children);

// ---- The address: all that was chosen, so that a link shows the same.
let state = new URLSearchParams();
const listeners = [];
let later = 0;

function readAddress() {
  const text = location.hash.slice(1) || data.start;
  data.start = "";
  if (text && !text.includes("=")) {  // a part of the page
    ["sequence", "tracker", "repetition", "start", "frame"].forEach((key) => state.delete(key));
    const part = byId(text);
    for (let node = part; node; node = node.parentElement) if (node.matches("details")) node.open = true;
    part?.scrollIntoView();
    if (state.size) writeAddress();  // sorting and filter stay
  }
  else state = new URLSearchParams(text);
  listeners.forEach((listener) => listener());
}

/** Change what is chosen; `null` takes a choice back. A `step` can be gone back from. */
function choose(changes, step = false) {
  for (const [key, value] of Object.entries(changes)) {
    if (value === null || value === "") state.delete(key);
    else state.set(key, value);
  }
  clearTimeout(later);
  if (step) writeHistory("pushState", address());
  else later = setTimeout(writeAddress, 200);  // not each frame of what is played
  listeners.forEach((listener) => listener());
}
const address = () => `#${state}`;
const writeAddress = () => writeHistory("replaceState", state.size ? address() : location.pathname + location.search);
function writeHistory(how, url) {
  try { history[how](null, "", url); } catch { /* a page inside a notebook has no address of its own */ }
}

function opening([scene, tracker, repetition, frame]) {
  return { sequence: data.scenes[scene].name, tracker: data.labels[tracker], repetition, frame, start: null, trace: null, show: null };
}
addEventListener("popstate", readAddress);
addEventListener("hashchange", readAddress);
addEventListener("click", (event) => {
  const link = event.target.closest?.("a[href^='#sequence=']");
  if (!link || event.ctrlKey || event.metaKey) return;
  event.preventDefault();
  choose({ tracker: null, repetition: null, start: null, trace: null, show: null, ...Object.fromEntries(new URLSearchParams(link.getAttribute("href").slice(1))) }, true);
});

// A click anywhere on a row that leads to a part of the page follows its link.
addEventListener("click", (event) => {
  const link = event.target.closest?.("tbody tr")?.querySelector("th a[href^='#']");
  if (link && !event.target.closest("a") && getSelection().isCollapsed) link.click();
});

// What is led to stands below the header, which is as high as its links take.
const header = document.querySelector("header");
new ResizeObserver(() => {
  const stays = getComputedStyle(header).position === "sticky";
  document.documentElement.style.setProperty("--head", `${stays ? header.offsetHeight : 0}px`);
}).observe(header);

// ---- Tables.
const shownTables = [...document.querySelectorAll("table")].map((table) => {
  const rows = [...table.tBodies[0].rows];
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => head.addEventListener("click", () => {
    const now = head.getAttribute("aria-sort");
    const next = now === "descending" ? `${column}a` : now === "ascending" ? null : `${column}d`;
    choose({ [`sort.${table.id}`]: next });
  }));
  return { table, rows, heads, sorted: "" };
});

/** A number that a text begins with: `~3.1`, `< .001`, `[-0.2, 0.1]`, `54 of 99`; but no date. */
const NUMBER = /^[[(~<>≤≥]*\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)(?=$|[\s,;%\])±–*])/i;

function valueOf(cell) {
  if (cell.dataset.value !== undefined) return Number(cell.dataset.value);
  const text = cell.textContent.trim(), number = NUMBER.exec(text);
  return number ? Number(number[1]) : text;
}

function compareCells(a, b) {
  const [one, two] = [valueOf(a), valueOf(b)];
  const numbers = [one, two].map((value) => typeof value === "number");
  if (numbers[0] !== numbers[1]) return numbers[0] ? 1 : -1;
  return numbers[0] ? one - two : two.localeCompare(one);
}

let arrangedFor = null;
function arrangeTables() {
  const asked = [...state].filter(([key]) => key === "filter" || key.startsWith("sort.")).join();
  if (asked === arrangedFor) return;
  arrangedFor = asked;
  const wanted = (state.get("filter") || "").toLowerCase();
  let all = 0, left = 0;
  for (const shown of shownTables) {
    const sort = state.get(`sort.${shown.table.id}`) || "";
    if (sort !== shown.sorted) {
      const column = parseInt(sort, 10), sign = sort.endsWith("a") ? 1 : -1;
      const order = [...shown.rows];
      if (sort && column >= 0 && column < shown.heads.length) order.sort((a, b) => sign * compareCells(a.cells[column], b.cells[column]));
      shown.table.tBodies[0].append(...order);
      shown.heads.forEach((head, number) => {
        if (sort && number === column) head.setAttribute("aria-sort", sign > 0 ? "ascending" : "descending");
        else head.removeAttribute("aria-sort");
      });
      shown.sorted = sort;
    }
    const has = (node) => node.textContent.toLowerCase().includes(wanted);
    // Trackers may be columns: where no row has the word, the columns that have it stay.
    const columns = shown.heads.map((head) => head.classList.contains("label") || has(head));
    const named = shown.heads.some((head) => !head.classList.contains("label") && has(head));
    const across = wanted && named && !shown.rows.some(has);
    for (const row of shown.rows) {
      row.hidden = !across && !has(row);
      all += 1;
      left += !row.hidden;
      const fold = wanted && !row.hidden && row.closest("details.fold:not([open])");
      if (fold) fold.open = true;
    }
    for (const row of [shown.table.tHead.rows[0], ...shown.rows])
      [...row.cells].forEach((cell, column) => { cell.hidden = Boolean(across) && !columns[column]; });
  }
  if (byId("filter") !== document.activeElement) byId("filter").value = state.get("filter") || "";
  byId("filtered").textContent = wanted ? `${left} of ${all} rows` : "";
}
byId("filter").addEventListener("input", (event) => choose({ filter: event.target.value }));
listeners.push(arrangeTables);

// ---- Charts.
const colourOf = (position) => data.colours[position % data.colours.length];
const dashOf = (position) => data.dashes[position % data.dashes.length];
const MARKS = ["M-4,0A4,4 0 1,0 4,0A4,4 0 1,0 -4,0", "M-4,-4H4V4H-4Z", "M0,-5L5,4H-5Z", "M0,-5L5,0L0,5L-5,0Z", "M0,5L5,-4H-5Z"];
const markOf = (position, attributes) => draw("path", { d: MARKS[position % MARKS.length], fill: colourOf(position), ...attributes });

function sampleOf(position) {
  return draw("svg", { viewBox: "0 0 34 12", "aria-hidden": "true" },
    draw("line", { x1: 0, x2: 34, y1: 6, y2: 6, stroke: colourOf(position), "stroke-width": 2.5, "stroke-dasharray": dashOf(position) }),
    markOf(position, { transform: "translate(17,6)" }));
}

function ticksOf(low, high, logarithmic) {
  if (logarithmic) {
    const found = [];
    for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power++)
      for (const digit of [1, 2, 5]) if (digit * 10 ** power >= low && digit * 10 ** power <= high) found.push(digit * 10 ** power);
    if (found.length > 1) return found;
  }
  const rough = (high - low) / 8 || 1, power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].find((digit) => digit * power >= rough) * power;  // four to eight of them
  const found = [];
  for (let tick = Math.ceil(low / step - 1e-9) * step; tick <= high + 1e-9 * step; tick += step) found.push(Number(tick.toPrecision(10)));
  return found;
}

function scalesOf(chart, width, height) {
  const numbers = (...names) => chart.lines.flatMap((line) => names.flatMap((name) => line[name] || [])).filter((value) => value !== null);
  const xs = numbers("x"), ys = numbers("y", "low", "high");
  let [left, right] = [Math.min(...xs), Math.max(...xs)];
  let [bottom, top] = [chart.kind === "dots" ? Math.min(...ys) : 0, chart.top ?? Math.max(...ys, 1e-9)];
  if (chart.log) [left, right] = [left / 1.5, right * 1.5];
  else if (left === right) [left, right] = [left - 1, right + 1];
  if (chart.kind === "dots") {  // bars end within the frame
    const room = (top - bottom || 1) / 20;
    [bottom, top] = [bottom < 0 ? bottom - room : Math.max(0, bottom - room), top + room];
  }
  const frame = { left: 46, right: width - 18, top: 8, bottom: height - 34 };
  const along = chart.log ? Math.log10 : (value) => value;
  const x = (value) => frame.left + (along(value) - along(left)) / (along(right) - along(left)) * (frame.right - frame.left);
  const y = (value) => frame.bottom - (value - bottom) / (top - bottom) * (frame.bottom - frame.top);
  return { x, y, frame, ticks: [ticksOf(left, right, chart.log), ticksOf(bottom, top, false)] };
}

function pathOf(line, { x, y }, step) {
  let path = "", pen = false;
  line.x.forEach((value, i) => {
    if (line.y[i] === null) { pen = false; return; }
    const at = `${x(value).toFixed(1)},${y(line.y[i]).toFixed(1)}`;
    path += pen ? (step ? `H${x(value).toFixed(1)}L${at}` : `L${at}`) : `M${at}`;
    pen = true;
  });
  return path;
}

/** Draw a chart: all its lines, or one of them before the others. */
function plot(chart, only = null) {
  const width = 460, height = only === null ? 300 : 200, scales = scalesOf(chart, width, height);
  const { x, y, frame, ticks } = scales, step = chart.kind === "step";
  const svg = draw("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": chart.words });
  for (const tick of ticks[0]) svg.append(
    draw("line", { class: "grid", x1: x(tick), x2: x(tick), y1: frame.top, y2: frame.bottom }),
    draw("text", { x: x(tick), y: frame.bottom + 14, "text-anchor": "middle" }, String(tick)));
  for (const tick of ticks[1]) svg.append(
    draw("line", { class: "grid", x1: frame.left, x2: frame.right, y1: y(tick), y2: y(tick) }),
    draw("text", { x: frame.left - 6, y: y(tick) + 4, "text-anchor": "end" }, String(tick)));
  svg.append(draw("text", { x: (frame.left + frame.right) / 2, y: height - 4, "text-anchor": "middle" }, chart.x),
    draw("text", { x: 11, y: (frame.top + frame.bottom) / 2, "text-anchor": "middle", transform: `rotate(-90 11 ${(frame.top + frame.bottom) / 2})` }, chart.y));
  if (only !== null) for (const line of chart.lines) svg.append(draw("path", { class: "other", d: pathOf(line, scales, step) }));
  const lines = only === null ? chart.lines : [chart.lines[only]];
  for (const line of lines) {
    const style = { stroke: colourOf(line.position) };
    if (chart.kind === "dots") {
      if (line.low[0] !== null) svg.append(draw("line", { x1: x(line.x[0]), x2: x(line.x[0]), y1: y(line.low[0]), y2: y(line.high[0]), "stroke-width": 2, ...style }));
    } else {
      if (line.low) svg.append(draw("path", { fill: colourOf(line.position), opacity: 0.12, d: bandOf(line, scales) }));
      svg.append(draw("path", { class: "curve", d: pathOf(line, scales, step), "stroke-dasharray": dashOf(line.position), ...style }));
    }
    const every = Math.max(1, Math.round(line.x.length / 6)), offset = Math.floor(every * ((line.position % 5) / 5));
    line.x.forEach((value, i) => {
      if (line.y[i] !== null && i % every === offset) svg.append(markOf(line.position, { transform: `translate(${x(value)},${y(line.y[i])})` }));
    });
  }
  if (data.scenes.length) listenTo(svg, chart, lines, scales);
  return svg;
}

function bandOf(line, { x, y }) {
  const known = line.x.map((_, i) => i).filter((i) => line.low[i] !== null && line.high[i] !== null);
  if (!known.length) return "";
  const edge = (values, order) => order.map((i, at) => {
    const before = order[at - 1];  // a step function: it holds its value up to the next place
    const corner = before === undefined ? "" : values === line.high ? `${x(line.x[i])},${y(values[before])}L` : `${x(line.x[before])},${y(values[i])}L`;
    return `${corner}${x(line.x[i])},${y(values[i])}`;
  }).join("L");
  return `M${edge(line.high, known)}L${edge(line.low, [...known].reverse())}Z`;
}

const tip = make("div", { class: "tip", role: "status", hidden: "" });
document.body.append(tip);

/** Points say what they are, and open the frame behind them. */
function listenTo(svg, chart, lines, { x, y }) {
  const ring = draw("circle", { class: "hit", r: 6, visibility: "hidden" });
  svg.append(ring);
  svg.classList.add("opens");
  let nearest = null;
  const tell = (left, top) => {
    const { line, i } = nearest;
    ring.setAttribute("cx", x(line.x[i]));
    ring.setAttribute("cy", y(line.y[i]));
    ring.setAttribute("visibility", "visible");
    tip.textContent = `${line.label}: ${line.y[i]} at ${chart.x} ${line.x[i]}`;
    tip.hidden = false;
    tip.style.left = `${Math.min(left + 14, innerWidth - 180)}px`;
    tip.style.top = `${top + 14}px`;
  };
  const leave = () => { tip.hidden = true; ring.setAttribute("visibility", "hidden"); };
  const open = () => {
    const place = nearest && (nearest.line.places.length === 1 ? nearest.line.places[0] : nearest.line.places[nearest.i]);
    if (place) { leave(); choose(opening(place), true); }
  };
  const aim = (event) => {
    const seen = svg.getBoundingClientRect(), scale = svg.viewBox.baseVal.width / seen.width;
    const [px, py] = [(event.clientX - seen.left) * scale, (event.clientY - seen.top) * scale];
    nearest = null;
    for (const line of lines) line.x.forEach((value, i) => {
      if (line.y[i] === null) return;
      const far = Math.hypot(x(value) - px, y(line.y[i]) - py);
      if (!nearest || far < nearest.far) nearest = { far, line, i };
    });
    if (nearest) tell(event.clientX, event.clientY);
  };
  svg.addEventListener("pointermove", aim);
  svg.addEventListener("pointerleave", leave);
  svg.addEventListener("click", (event) => { aim(event); open(); });  // a finger does not move before it taps
  // By keys: left and right along a line, up and down to the next one, Enter opens.
  const known = new Map(lines.map((line) => [line, line.x.map((_, i) => i).filter((i) => line.y[i] !== null)]));
  const drawn = lines.filter((line) => known.get(line).length);
  if (!drawn.length) return;
  for (const [key, value] of Object.entries({ tabindex: 0, "aria-roledescription": "chart; arrow keys tell its points, Enter opens one" })) svg.setAttribute(key, value);
  let row = 0, column = 0;
  const look = () => {
    const line = drawn[row], places = known.get(line), box = svg.getBoundingClientRect(), scale = box.width / svg.viewBox.baseVal.width;
    column = Math.max(0, Math.min(column, places.length - 1));
    nearest = { line, i: places[column] };
    tell(box.left + x(line.x[nearest.i]) * scale, box.top + y(line.y[nearest.i]) * scale);
  };
  svg.addEventListener("focus", () => { if (svg.matches(":focus-visible")) look(); });
  svg.addEventListener("blur", leave);
  const steps = {
    ArrowLeft: () => { column -= 1; }, ArrowRight: () => { column += 1; }, Home: () => { column = 0; }, End: () => { column = Infinity; },
    ArrowUp: () => { row = (row || drawn.length) - 1; }, ArrowDown: () => { row = (row + 1) % drawn.length; },
  };
  svg.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !(event.key === "Enter" || event.key in steps)) return;
    event.preventDefault();
    if (event.key === "Enter") { open(); return; }
    steps[event.key]();
    look();
  });
}

function fill(figure, chart) {
  if (chart.lines.length > CROWDED) {
    const grid = make("div", { class: "charts" });
    chart.lines.forEach((_, i) => grid.append(plot(chart, i)));
    figure.append(grid);
  } else figure.append(plot(chart));
  const head = chart.told ? [make("li", {}, `tracker (${chart.told}):`)] : [];
  figure.append(make("ul", { class: "key" }, ...head, ...chart.lines.map((line) => {
    const place = line.places.find((one) => one);
    const { start, trace, show, ...asked } = place ? opening(place) : {};
    const link = make("a", place ? { href: `#${new URLSearchParams(asked)}` } : {}, sampleOf(line.position));
    link.append(line.told ? `${line.label} (${line.told})` : line.label);
    return make("li", {}, link);
  })));
}
// Those that are far down are drawn when they are near: there may be a hundred.
const near = new IntersectionObserver((seen) => {
  seen.filter((one) => one.isIntersecting).forEach(({ target }) => drawn(target));
}, { rootMargin: "600px" });
const empty = new Set(document.querySelectorAll("figure.chart"));
function drawn(figure) {
  near.unobserve(figure);
  empty.delete(figure);
  figure.style.minHeight = "";
  fill(figure, data.charts[figure.id]);
}
for (const figure of empty) {
  figure.style.minHeight = "330px";
  near.observe(figure);
}

// ---- On paper all is drawn, nothing is folded, and tables are no wider than the page.
addEventListener("beforeprint", () => {
  empty.forEach(drawn);
  for (const fold of document.querySelectorAll("main details:not([open])")) {
    fold.open = true;
    fold.classList.add("unfolded");
  }
  document.body.classList.add("paper");
  for (const { table } of shownTables) {
    const fit = () => table.parentElement.clientWidth / table.offsetWidth;
    table.classList.toggle("tight", fit() < 0.7);
    table.style.setProperty("--fit", Math.min(1, 0.99 * fit()));
  }
});
addEventListener("afterprint", () => {
  document.body.classList.remove("paper");
  for (const { table } of shownTables) table.style.removeProperty("--fit");
  for (const fold of document.querySelectorAll("details.unfolded")) {
    fold.open = false;
    fold.classList.remove("unfolded");
  }
});

// ---- Pictures are enlarged.
addEventListener("click", (event) => {
  const button = event.target.closest?.(".picture button");
  if (!button) return;
  const large = button.getAttribute("aria-expanded") !== "true";
  button.setAttribute("aria-expanded", large);
  button.parentElement.classList.toggle("large", large);
});

// ---- Commands and links are copied.
async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {  // pages from disk may not, in some browsers
    const area = make("textarea", { style: "position:fixed;opacity:0" });
    (document.querySelector("dialog[open]") || document.body).append(area);
    area.value = text;
    area.select();
    document.execCommand("copy");
    area.remove();
  }
}
addEventListener("click", async (event) => {
  const button = event.target.closest?.(".copy");
  if (!button) return;
  await copy(button.previousElementSibling.textContent);
  button.textContent = "Copied";
  setTimeout(() => { button.textContent = "Copy"; }, 1500);
});
if (!data.scenes.length) readAddress();
