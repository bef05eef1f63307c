"use strict";
// The player: frames of a sequence with the boxes of truth and trackers on top.
const AHEAD = 10;  // frames that are made ready while one is shown
const KEPT = 80;  // frames that are kept ready
const LENS = 4;  // how much the magnifier enlarges
const APART = 10;  // frames between two disagreements that are told apart

// ---- What lies in the page, or beside it, is unpacked when it is needed.
const awaited = new Map();
function trackmark(name, text) { awaited.get(name)?.(text); }  // files beside the page call it

function block(name) {
  const inside = byId(name);
  if (inside) return Promise.resolve(inside.textContent);
  return new Promise((resolve, reject) => {
    awaited.set(name, resolve);
    const script = make("script", { src: `${data.beside}/${name}.js` });
    script.onerror = () => reject(new Error(`Frames lie in ${data.beside}, which is not beside this page.`));
    document.head.append(script);
  });
}
const bytesOf = async (name) => (await fetch(`data:application/octet-stream;base64,${await block(name)}`)).arrayBuffer();
const unsqueezed = async (name) =>
  new Response(new Blob([await bytesOf(name)]).stream().pipeThrough(new DecompressionStream("deflate")));

class Reel {
  constructor(name, sizes) {
    this.name = name;
    this.places = sizes.flatMap((chunk, number) => {
      let end = 0;
      return chunk.map((size) => ({ number, from: end, to: (end += size) }));
    });
    this.chunks = new Map();
    this.images = new Map();
  }
  /** A frame as an image that can be drawn at once; the promise of one otherwise. */
  get(frame) {
    if (!this.images.has(frame)) {
      const promise = this.read(frame).then((image) => { this.images.set(frame, image); return image; });
      promise.catch(() => this.images.delete(frame));
      this.images.set(frame, promise);
      if (this.images.size > KEPT) this.images.delete(this.images.keys().next().value);
    }
    return this.images.get(frame);
  }
  async read(frame) {
    const { number, from, to } = this.places[frame];
    if (!this.chunks.has(number)) this.chunks.set(number, bytesOf(`${this.name}-${number}`));
    const bytes = await this.chunks.get(number);
    return createImageBitmap(new Blob([new Uint8Array(bytes, from, to - from)], { type: "image/webp" }));
  }
}

class Scene {
  constructor(number) {
    this.number = number;
    Object.assign(this, data.scenes[number]);
    this.takes = this.takes.map(([tracker, repetition, row, revised, failure]) => ({ tracker, repetition, row, revised, failure }));
    this.films = Object.fromEntries(Object.entries(this.reels).map(([kind, sizes]) => [kind, new Reel(`${kind}-${number}`, sizes)]));
    this.curves = new Map();
  }
  async open() {
    const planes = new Uint8Array(await (await unsqueezed(`boxes-${this.number}`)).arrayBuffer());
    const n = planes.length / 4, boxes = new Int32Array(n), wide = this.frames * 4;
    for (let i = 0; i < n; i++) {
      const step = planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24;
      boxes[i] = i % wide < 4 ? step : boxes[i - 4] + step | 0;
    }
    this.boxes = boxes;
    this.outlines = this.shapes ? await (await unsqueezed(`shapes-${this.number}`)).json() : {};
    return this;
  }
  /** A box in pixels; null where there is none. Row 0 is the truth. */
  box(row, frame) {
    const at = (row * this.frames + frame) * 4;
    return this.boxes[at] === data.absent ? null : [0, 1, 2, 3].map((i) => this.boxes[at + i] / 10);
  }
  /** The tracker's run of a repetition; its first where it has no such one, as it never draws. */
  take(tracker, repetition) {
    const its = this.takes.filter((take) => take.tracker === tracker);
    return its.find((take) => take.repetition === repetition) || its[0];
  }
  /** Centre error and overlap of a row of boxes, by frame; NaN where there is no truth. */
  curve(row) {
    if (!this.curves.has(row)) {
      const found = { error: new Float32Array(this.frames).fill(NaN), overlap: new Float32Array(this.frames).fill(NaN), out: new Uint8Array(this.frames) };
      for (let frame = 0; frame < this.frames; frame++) {
        const truth = this.box(0, frame), box = this.box(row, frame);
        if (!truth || frame < this.first) continue;
        found.overlap[frame] = box ? overlapOf(truth, box) : 0;
        if (box) found.error[frame] = distanceOf(truth, box);
        const [x, y] = box ? centreOf(box) : [NaN, NaN];
        found.out[frame] = !(x >= truth[0] && x < truth[0] + truth[2] && y >= truth[1] && y < truth[1] + truth[3]);
      }
      this.curves.set(row, found);
    }
    return this.curves.get(row);
  }
}
const centreOf = ([x, y, width, height]) => [x + width / 2, y + height / 2];
const distanceOf = (a, b) => Math.hypot(centreOf(a)[0] - centreOf(b)[0], centreOf(a)[1] - centreOf(b)[1]);
function overlapOf(a, b) {
  const across = Math.min(a[0] + a[2], b[0] + b[2]) - Math.max(a[0], b[0]);
  const down = Math.min(a[1] + a[3], b[1] + b[3]) - Math.max(a[1], b[1]);
  const both = Math.max(0, across) * Math.max(0, down);
  return both / (a[2] * a[3] + b[2] * b[3] - both) || 0;
}

// ---- What is chosen, as the address says it.
const dialog = byId("player"), screen = byId("screen"), pen = screen.getContext("2d");
const curvePen = byId("curve").firstChild.getContext("2d");
const scenes = new Map();
let scene = null, frame = 0, playing = 0, held = false, pointer = null;
let painted = null, paintedFrame = -1;  // what is seen of the frame, and which it is

const repetition = () => Number(state.get("repetition") || 0);
const focus = () => data.labels.indexOf(state.get("tracker"));
const trackersHere = () => [...new Set(scene.takes.map((take) => take.tracker))].sort((a, b) => a - b);
function shownTrackers() {
  const here = trackersHere(), said = state.get("show");
  let shown = said === null ? here.slice(0, 9) : said.split(".").map(Number).filter((tracker) => here.includes(tracker));
  if (said === null && here.includes(focus()) && !shown.includes(focus())) shown = [...shown, focus()];
  return shown;
}
const rowOf = (take) => (state.get("trace") === "revised" && take.revised !== null ? take.revised : take.row);
function otherTake() {
  const [tracker, number] = (state.get("other") || "").split(".").map(Number);
  return state.has("other") ? scene.takes.find((take) => take.tracker === tracker && take.repetition === number) : undefined;
}
/** Runs that are drawn: while `c` is held the other one alone. */
function drawnTakes() {
  if (held && otherTake()) return [otherTake()];
  return shownTrackers().map((tracker) => scene.take(tracker, repetition()));
}

// ---- Drawing.
function paint(image) {
  const scale = screen.width / scene.size[0];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  drawScene(image, scale);
  if (state.has("lens") && pointer) {
    const radius = screen.height / 4.5;
    pen.save();
    pen.beginPath();
    pen.arc(...pointer, radius, 0, 2 * Math.PI);
    pen.clip();
    pen.translate(...pointer);
    pen.scale(LENS, LENS);
    pen.translate(-pointer[0], -pointer[1]);
    drawScene(image, scale, LENS);
    pen.restore();
    pen.lineWidth = 2;
    pen.strokeStyle = "#fff";
    pen.setLineDash([]);
    pen.stroke();
  }
}

function drawScene(image, scale, enlarged = 1) {
  if (image) pen.drawImage(image, 0, 0, screen.width, screen.height);
  else { pen.fillStyle = "#3a3d42"; pen.fillRect(0, 0, screen.width, screen.height); }
  const unit = Math.max(1.6, screen.width / 480) / enlarged;
  const stroke = (path, colour, width, dash = []) => {
    pen.strokeStyle = colour;
    pen.lineWidth = width * unit;
    pen.setLineDash(dash.map((length) => length * unit));
    pen.stroke(path);
  };
  const boxPath = (box) => { const path = new Path2D(); path.rect(...box.map((value) => value * scale)); return path; };
  const outline = (line) => new Path2D(`M${line.map(([x, y]) => `${x * scale},${y * scale}`).join("L")}Z`);
  const outlinesOf = (row) => scene.outlines[row]?.[frame] || {};
  const truth = scene.box(0, frame);
  const truths = [...(outlinesOf(0).lines || []).map(outline), ...(truth ? [boxPath(truth)] : [])];
  for (const path of truths) stroke(path, "#000", 1.6);
  for (const take of drawnTakes()) {
    const row = rowOf(take), box = scene.box(row, frame), colour = data.colours[take.tracker % data.colours.length];
    const rim = colour === "#000000" ? "#fff" : "#000";  // readable on any ground
    const width = take.tracker === focus() ? 2.6 : 1.8;
    const { lines = [], points = [] } = outlinesOf(take.row);
    const paths = lines.map(outline);
    if (box) paths.push(boxPath(box));
    for (const path of paths) { stroke(path, rim, width + 1.2); stroke(path, colour, width, dashOf(take.tracker)); }
    pen.fillStyle = colour;
    for (const [x, y] of points) pen.fillRect(x * scale - unit, y * scale - unit, 2 * unit, 2 * unit);
  }
  for (const path of truths) stroke(path, "#fff", 1, [4, 4]);
}

/** Show a frame; done when it is painted. */
async function seek(number) {
  frame = Math.max(0, Math.min(scene.frames - 1, Math.round(number) || 0));
  const wanted = frame, here = scene;
  const { full, thumbnails } = here.films;
  tellFrame();
  let image = null;
  try {
    const small = thumbnails && thumbnails.get(wanted), large = full && full.get(wanted);
    const ready = large instanceof ImageBitmap ? large : small;
    image = ready ? await ready : null;
    if (large && image !== large) large.then((better) => { if (wanted === frame && here === scene) repaint(better); }, tellError);
  } catch (error) { tellError(error); }
  if (wanted !== frame || here !== scene) return;
  repaint(image);
  for (let next = wanted + 1; next <= Math.min(wanted + AHEAD, here.frames - 1); next++) for (const film of [thumbnails, full]) film?.get(next)?.catch?.(() => {});
}
function repaint(image = painted) {
  painted = image;
  paintedFrame = frame;
  paint(image);
}
const tellError = (error) => { byId("said").textContent = error.message; };

function tellFrame() {
  byId("frame").value = byId("slider").value = frame;
  byId("slider").setAttribute("aria-valuetext", `frame ${frame} of ${scene.frames - 1}`);
  byId("cursor").style.left = `${(frame + 0.5) / scene.frames * 100}%`;
  for (const button of byId("legend").children) if (button.take) {
    const { error, overlap } = scene.curve(rowOf(button.take));
    const known = !Number.isNaN(overlap[frame]);
    button.lastChild.textContent = known ? `${overlap[frame].toFixed(2)} · ${Number.isNaN(error[frame]) ? "no box" : `${error[frame].toFixed(1)} px`}` : "";
  }
  if (scene.show) byId("shown").textContent =
    `${scene.show} --repetition ${repetition()} --first ${frame} --last ${frame}${state.get("trace") === "revised" ? " --trace revised" : ""} --output frame.png`;
}

/** The curve of all frames beneath; drawn when what is shown changes. */
function drawCurve() {
  const canvas = curvePen.canvas, ratio = devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * ratio;
  canvas.height = canvas.clientHeight * ratio;
  const kind = state.get("curve") === "overlap" ? "overlap" : "error";
  byId("measured").textContent = `Curve: ${kind}`;
  const curves = drawnTakes().map((take) => [take, scene.curve(rowOf(take))[kind]]);
  let top = 1;
  if (kind === "error") for (const [, values] of curves) for (const value of values) if (value > top) top = value;
  const ink = getComputedStyle(dialog).color;
  curvePen.clearRect(0, 0, canvas.width, canvas.height);
  curvePen.fillStyle = curvePen.strokeStyle = ink;
  curvePen.font = `${11 * ratio}px system-ui`;
  curvePen.fillText(kind === "error" ? `centre error, up to ${top.toFixed(0)} px` : "overlap, up to 1", 4 * ratio, 12 * ratio);
  for (const [take, values] of curves) {
    const colour = data.colours[take.tracker % data.colours.length];
    curvePen.strokeStyle = colour === "#000000" ? ink : colour;
    curvePen.lineWidth = (take.tracker === focus() ? 2.2 : 1.3) * ratio;
    curvePen.setLineDash(dashOf(take.tracker).map((length) => length * ratio));
    curvePen.beginPath();
    let down = false;
    values.forEach((value, i) => {
      if (Number.isNaN(value)) { down = false; return; }
      curvePen[down ? "lineTo" : "moveTo"]((i + 0.5) / values.length * canvas.width, (1 - value / top) * (canvas.height - 18 * ratio) + 16 * ratio);
      down = true;
    });
    curvePen.stroke();
  }
}

function options(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => { const one = make("option", { value }); one.textContent = text; return one; }));
  select.value = chosen;
}

/** Everything around the frame, as the address says. */
function arrange() {
  options(byId("scene"), data.scenes.map((one) => [one.name, one.title]), scene.name);
  const repetitions = [...new Set(scene.takes.map((take) => take.repetition))].sort((a, b) => a - b);
  options(byId("repetition"), repetitions.map((one) => [one, one]), repetition());
  byId("traces").hidden = scene.takes.every((take) => take.revised === null);
  byId("trace").value = state.get("trace") || "online";
  options(byId("other"), [["", "another run"], ...scene.takes.map((take) => [`${take.tracker}.${take.repetition}`, `${data.trackers[take.tracker]}, repetition ${take.repetition}`])], state.get("other") || "");
  byId("frame").max = byId("slider").max = scene.frames - 1;
  byId("lens").setAttribute("aria-pressed", state.has("lens"));
  const shown = shownTrackers();
  const truth = make("button", { type: "button", disabled: "" }, "- - truth");
  byId("legend").replaceChildren(truth, ...trackersHere().map((tracker, position) => {
    const take = scene.take(tracker, repetition()), on = shown.includes(tracker);
    const other = take.repetition === repetition() ? "" : ` (repetition ${take.repetition})`;
    const name = make("span", tracker === focus() ? { class: "focus" } : {}, data.trackers[tracker] + other + (take.failure ? " (failed)" : ""));
    const button = make("button", { type: "button", "aria-pressed": on, title: take.failure || "" },
      make("b", {}, position < 9 ? position + 1 : ""), sampleOf(tracker), name, make("span"));
    if (on) button.take = take;
    button.addEventListener("click", () => toggle(tracker));
    return button;
  }));
  byId("said").textContent = scene.why;
  drawCurve();
}

function toggle(tracker) {
  const shown = shownTrackers();
  choose({ show: (shown.includes(tracker) ? shown.filter((one) => one !== tracker) : [...shown, tracker]).sort((a, b) => a - b).join(".") || "none" });
}

// ---- From the address to what is seen.
let drawnFor = "";
async function follow() {
  const name = state.get("sequence");
  const number = data.scenes.findIndex((one) => one.name === name);
  if (number < 0) {
    if (dialog.open) dialog.close();
    stop();
    return;
  }
  if (!scenes.has(number)) scenes.set(number, new Scene(number).open());
  const opened = await scenes.get(number);
  if (state.get("sequence") !== name) return;
  if (!dialog.open) { dialog.showModal(); dialog.focus(); }
  const around = new URLSearchParams(state);
  around.delete("frame");
  const moved = Number(state.get("frame") ?? opened.first);
  if (scene !== opened) {
    scene = opened;
    painted = null;
    paintedFrame = -1;
    screen.width = Math.max(640, Math.min(1280, scene.size[0]));
    screen.height = Math.round(screen.width * scene.size[1] / scene.size[0]);
    screen.style.width = `${screen.width}px`;
  }
  if (`${around}` !== drawnFor) { drawnFor = `${around}`; arrange(); }
  await seek(moved);
}
listeners.push(() => { follow().catch(tellError); });

// ---- Moving.
const move = (number) => choose({ frame: Math.max(0, Math.min(scene.frames - 1, Math.round(number) || 0)) });
const say = (text) => { byId("said").textContent = text; };

function play() {
  if (playing) { stop(); return; }
  if (frame >= scene.frames - 1) move(0);
  const each = 1000 / (scene.fps || 30);
  let due = performance.now() + each, busy = false;
  const tick = async (now) => {
    if (!playing) return;
    playing = requestAnimationFrame(tick);
    if (now < due || busy) return;
    due = Math.max(due + each, now - each);  // who is late goes on from there: no frame is left out
    if (frame >= scene.frames - 1) { stop(); return; }
    busy = true;
    state.set("frame", frame + 1);
    await seek(frame + 1);
    busy = false;
  };
  playing = requestAnimationFrame(tick);
  byId("play").textContent = "❚❚";
  byId("play").setAttribute("aria-label", "Pause");
}
function stop() {
  if (!playing) return;
  cancelAnimationFrame(playing);
  playing = 0;
  byId("play").textContent = "▶";
  byId("play").setAttribute("aria-label", "Play");
  if (dialog.open) move(frame);
}

/** The next frame in which the centre of a shown tracker leaves the truth's box. */
function nextFailure() {
  const found = [];
  for (const take of drawnTakes()) {
    const { out } = scene.curve(rowOf(take));
    for (let i = 1; i < out.length; i++) if (out[i] && !out[i - 1]) found.push([i, take]);
  }
  found.sort((a, b) => a[0] - b[0]);
  const next = found.find(([i]) => i > frame) || found[0];
  if (!next) { say("No shown tracker leaves the truth's box."); return; }
  move(next[0]);
  say(`${data.trackers[next[1].tracker]} leaves the truth's box at frame ${next[0]}.${next[1].failure ? ` Its run failed: ${next[1].failure}` : ""}`);
}

/** Frames in which two shown trackers are furthest apart, the furthest first. */
function disagreements() {
  const rows = drawnTakes().map((take) => [take, rowOf(take)]);
  const at = Array.from({ length: scene.frames }, (_, i) => {
    const boxes = rows.map(([take, row]) => [take, scene.box(row, i)]).filter(([, box]) => box);
    let most = { i, far: 0, pair: [] };
    boxes.forEach(([one, a], k) => boxes.slice(k + 1).forEach(([other, b]) => {
      const far = distanceOf(a, b);
      if (far > most.far) most = { i, far, pair: [one, other] };
    }));
    return most;
  });
  const found = [];
  for (const one of at.sort((a, b) => b.far - a.far || a.i - b.i))
    if (one.far > 0 && found.length < 50 && found.every((other) => Math.abs(other.i - one.i) >= APART)) found.push(one);
  return found;
}
let rank = 0, rankedAt = -1;
function nextDisagreement() {
  const found = disagreements();
  if (!found.length) { say("No two shown trackers disagree."); return; }
  rank = rankedAt === frame ? (rank + 1) % found.length : 0;  // the largest, unless one is looked at
  const next = found[rank];
  rankedAt = next.i;
  move(next.i);
  say(`${next.pair.map((take) => data.trackers[take.tracker]).join(" and ")} are ${next.far.toFixed(1)} px apart at frame ${next.i}.`);
}

function hold(on) {
  if (held === on) return;
  if (on && !otherTake()) { say("Choose a run to hold against first."); return; }
  held = on;
  if (on) say(`${data.trackers[otherTake().tracker]}, repetition ${otherTake().repetition}`);
  else say(scene.why);
  drawCurve();
  repaint();
}

function save() {
  screen.toBlob((blob) => {
    const url = URL.createObjectURL(blob);
    make("a", { href: url, download: `${scene.title.replace(/[^\p{L}\p{N}.-]+/gu, "-")}-${String(frame).padStart(5, "0")}.png` }).click();
    setTimeout(() => URL.revokeObjectURL(url), 10000);
  }, "image/png");
}
async function copyLink() {
  writeAddress();
  await copy(location.href);
  say("The link is copied.");
}
function help() {
  byId("help").hidden = !byId("help").hidden;
  byId("helped").setAttribute("aria-expanded", !byId("help").hidden);
}
const flip = (key, value, without = null) => choose({ [key]: state.get(key) === value ? without : value });

const KEYS = {
  " ": play, ArrowLeft: () => move(frame - 1), ArrowRight: () => move(frame + 1),
  "Shift+ArrowLeft": () => move(frame - 10), "Shift+ArrowRight": () => move(frame + 10),
  PageUp: () => move(frame - 10), PageDown: () => move(frame + 10),
  Home: () => move(0), End: () => move(scene.frames - 1),
  g: () => { byId("frame").focus(); byId("frame").select(); },
  f: nextFailure, d: nextDisagreement, c: () => hold(true),
  o: () => flip("trace", "revised"), e: () => flip("curve", "overlap"), m: () => flip("lens", "1"),
  s: save, l: copyLink, "?": help,
};
dialog.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (event.target === byId("frame")) {
    if (event.key === "Enter") { move(byId("frame").value); event.target.blur(); }
    return;
  }
  if (event.target.matches("select") || (event.key === " " && event.target.matches("button"))) return;
  const act = KEYS[(event.shiftKey && event.key.startsWith("Arrow") ? "Shift+" : "") + event.key];
  const tracker = /^[1-9]$/.test(event.key) ? trackersHere()[event.key - 1] : undefined;
  if (!act && tracker === undefined) return;
  event.preventDefault();
  if (playing && act !== play && /Arrow|Page|Home|End|^[fdg]$/.test(event.key)) stop();
  if (act) act();
  else toggle(tracker);
});
addEventListener("keyup", (event) => { if (event.key === "c" && held) hold(false); });
addEventListener("blur", () => { if (held) hold(false); });
dialog.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button?.dataset.key) KEYS[button.dataset.key]();
  if (button && event.detail) button.blur();  // keys are the player's again after a click
});
dialog.addEventListener("close", () => {
  stop();
  if (state.has("sequence")) choose({ sequence: null, tracker: null, repetition: null, frame: null }, true);
});
byId("play").addEventListener("click", play);
byId("link").addEventListener("click", copyLink);
byId("save").addEventListener("click", save);
byId("helped").addEventListener("click", help);
byId("close").addEventListener("click", () => dialog.close());
byId("scene").addEventListener("change", (event) => choose({ sequence: event.target.value, frame: null }));
byId("repetition").addEventListener("change", (event) => choose({ repetition: event.target.value }));
byId("trace").addEventListener("change", (event) => choose({ trace: event.target.value === "online" ? null : event.target.value }));
byId("other").addEventListener("change", (event) => choose({ other: event.target.value }));
byId("frame").addEventListener("change", (event) => move(event.target.value));
byId("slider").addEventListener("input", (event) => move(event.target.value));
for (const select of dialog.querySelectorAll("select")) select.addEventListener("change", () => select.blur());

byId("curve").addEventListener("pointerdown", (event) => byId("curve").setPointerCapture(event.pointerId));
for (const kind of ["pointerdown", "pointermove"]) byId("curve").addEventListener(kind, (event) => {
  if (!(event.buttons & 1)) return;
  const seen = byId("curve").getBoundingClientRect();
  stop();
  move(Math.floor((event.clientX - seen.left) / seen.width * scene.frames));
});
screen.addEventListener("pointermove", (event) => {
  const seen = screen.getBoundingClientRect();
  pointer = [(event.clientX - seen.left) * screen.width / seen.width, (event.clientY - seen.top) * screen.height / seen.height];
  if (state.has("lens")) repaint();
});
screen.addEventListener("pointerleave", () => { pointer = null; if (scene) repaint(); });
const redrawn = () => { if (dialog.open && scene) drawCurve(); };
addEventListener("resize", redrawn);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawn);
readAddress();
