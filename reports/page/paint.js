"use strict";
// A frame with what truth and trackers say on top, and the curve of all frames beneath.
const LENS = 4;  // how much the magnifier enlarges
const LAYERS = ["boxes", "masks", "contours", "particles"];  // a map is chosen by its name
const screen = byId("screen"), pen = screen.getContext("2d", { alpha: false });
const curvePen = byId("curve").firstChild.getContext("2d");

function paint(image, map) {
  const scale = screen.width / scene.size[0];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  const drawn = (enlarged) => drawFrame(pen, scene, frame, image, map, drawnTakes(), Math.max(1.6, screen.width / 480) / enlarged, { layers: shownLayers(), focus: focus(), rowOf });
  drawn(1);
  if (!image && scene.kept) {
    const em = 16 * screen.width / screen.clientWidth;  // of what is seen, also where the frame is small
    pen.fillStyle = "#d8dade";
    pen.font = `${em}px system-ui`;
    pen.fillText("This page has only the worst frames:", 0.7 * em, 1.5 * em);
    pen.fillText("those with a line below the curve.", 0.7 * em, 2.9 * em);
  }
  const at = state.has("lens") && (pointer || middleOf(scale));
  if (at) {
    const radius = screen.height / 4.5;
    pen.save();
    pen.beginPath();
    pen.arc(...at, radius, 0, 2 * Math.PI);
    pen.clip();
    pen.translate(...at);
    pen.scale(LENS, LENS);
    pen.translate(-at[0], -at[1]);
    drawn(LENS);
    pen.restore();
    pen.lineWidth = 2;
    pen.strokeStyle = "#fff";
    pen.setLineDash([]);
    pen.stroke();
  }
}

/** The middle of the target, of the tracker that is looked at where nobody knows; null for none. */
function middleOf(scale) {
  const take = drawnTakes().find((one) => one.tracker === focus());
  const box = scene.box(0, frame) || (take && scene.box(rowOf(take), frame));
  return box && centreOf(box).map((value) => value * scale);
}

/** Layers that are drawn; all that are not hidden. */
function shownLayers() {
  const hidden = (state.get("hide") || "").split(".");
  return new Set(LAYERS.filter((layer) => !hidden.includes(layer)));
}

function addLines(path, lines, scale) {
  for (const line of lines) {
    line.forEach(([x, y], i) => path[i ? "lineTo" : "moveTo"](x * scale, y * scale));
    path.closePath();
  }
}

/** All lines of a row of boxes in the frame, as one path; `take` is whose they are, if anybody's. */
function linesOf(scene, frame, row, shapes, layers, scale, take) {
  const path = new Path2D(), box = scene.box(row, frame);
  if (box && layers.has("boxes")) path.rect(...box.map((value) => value * scale));
  if (box && take?.round && layers.has("contours")) {
    const [x, y, width, height] = box.map((value) => value * scale / 2);
    path.moveTo(2 * x + 2 * width, 2 * y + height);
    path.ellipse(2 * x + width, 2 * y + height, width, height, 0, 0, 2 * Math.PI);
  }
  if (shapes.contours && layers.has("contours")) addLines(path, shapes.contours, scale);
  if (shapes.masks && layers.has("masks") && !take) addLines(path, shapes.masks, scale);  // those of takes are filled
  return path;
}

/** Draw a frame with the boxes of runs; `unit`: width of a thin line [px of the canvas]. */
function drawFrame(pen, scene, frame, image, map, takes, unit, { layers = new Set(["boxes"]), focus = -1, rowOf = (take) => take.row } = {}) {
  const { width: wide, height: high } = pen.canvas, scale = wide / scene.size[0];
  if (image) pen.drawImage(image, 0, 0, wide, high);
  else {
    pen.fillStyle = "#3a3d42";
    pen.fillRect(0, 0, wide, high);
  }
  if (map) {
    pen.globalAlpha = 0.6;
    pen.drawImage(map, 0, 0, wide, high);
    pen.globalAlpha = 1;
  }
  const stroke = (path, colour, width, dash = []) => {
    pen.strokeStyle = colour;
    pen.lineWidth = width * unit;
    pen.setLineDash(dash.map((length) => length * unit));
    pen.stroke(path);
  };
  const shapesOf = (row) => scene.shapes[row]?.[frame] || {};
  const truth = linesOf(scene, frame, 0, shapesOf(0), layers, scale);
  stroke(truth, "#000", 1.6);
  for (const take of takes) {
    const shapes = shapesOf(take.row), colour = colourOf(take.tracker);
    const width = take.tracker === focus ? 2.6 : 1.8;
    pen.fillStyle = colour;
    if (shapes.masks && layers.has("masks")) {
      const inside = new Path2D();
      addLines(inside, shapes.masks, scale);
      pen.globalAlpha = 0.3;
      pen.fill(inside, "evenodd");
      pen.globalAlpha = 1;
      stroke(inside, colour, 0.8);
    }
    const path = linesOf(scene, frame, rowOf(take), shapes, layers, scale, take);
    stroke(path, "#000", width + 1.2);  // a rim: readable on any ground
    stroke(path, colour, width, dashOf(take.tracker));
    if (shapes.particles && layers.has("particles")) for (const [x, y, weight] of shapes.particles) {
      const half = unit * (0.5 + 0.9 * Math.sqrt(weight));  // heavier ones are larger
      pen.fillRect(x * scale - half, y * scale - half, 2 * half, 2 * half);
    }
  }
  stroke(truth, "#fff", 1, [4, 4]);
}

// Where the curve lies in its canvas [CSS pixels]; below are a lane per tracker and the frame numbers.
const PLOT = { left: 30, right: 8, top: 8, height: 66, lane: 7, bottom: 16 };
const SUCCESS = 0.5;  // the least overlap that counts as success
const LOST = 10;  // frames outside the true box from which a target is lost
const MAX_LANES = 9;
/** How far along the curve a frame is, in [0, 1]. */
const alongCurve = (number) => number / Math.max(1, scene.frames - 1);

/** First frame of a run from which the target is lost, or in which a failed run ends; -1 for none. */
function lostFrame(take) {
  const { out } = scene.curve(rowOf(take));
  if (take.failure && !take.begun) return endOf(take);
  for (let i = 0, length = 0; i < out.length; i++) {
    length = out[i] ? length + 1 : 0;
    if (length === LOST) return i - LOST + 1;
  }
  return -1;
}

/** The curve of all frames with a lane per tracker; drawn when what is shown changes. */
function drawCurve() {
  const lanes = drawnTakes().slice(0, MAX_LANES);
  byId("curve").style.height = `${PLOT.top + PLOT.height + 6 + PLOT.lane * shownTakes().slice(0, MAX_LANES).length + PLOT.bottom}px`;
  const canvas = curvePen.canvas, ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  curvePen.scale(ratio, ratio);
  const kind = state.get("curve") === "error" ? "error" : "overlap";
  byId("measured").textContent = `Curve: ${kind}`;
  const curveOf = (take) => scene.curve(rowOf(take))[kind], foot = PLOT.top + PLOT.height;
  let top = 1;  // the same while another run is held, so that both compare
  if (kind === "error") for (const take of [...shownTakes(), otherTake()].filter(Boolean)) for (const value of curveOf(take)) if (value > top) top = value;
  const x = (number) => PLOT.left + alongCurve(number) * (width - PLOT.left - PLOT.right);
  const y = (value) => foot - value / top * PLOT.height;
  const inks = getComputedStyle(dialog), ink = (name) => inks.getPropertyValue(name);
  curvePen.font = "11px system-ui";
  const line = (x0, y0, x1, y1) => { curvePen.beginPath(); curvePen.moveTo(x0, y0); curvePen.lineTo(x1, y1); curvePen.stroke(); };
  curvePen.strokeStyle = ink("--line");
  curvePen.fillStyle = ink("--faint");
  curvePen.textAlign = "end";
  for (const tick of kind === "overlap" ? [0, SUCCESS, 1] : ticksOf(0, 2 * top).filter((one) => one <= top)) {
    line(PLOT.left, y(tick), width - PLOT.right, y(tick));
    curvePen.fillText(String(tick), PLOT.left - 5, y(tick) + 4);
  }
  curvePen.textAlign = "center";
  for (const tick of ticksOf(0, scene.frames - 1)) if (Number.isInteger(tick)) curvePen.fillText(String(tick), x(tick), height - 3);
  curvePen.fillStyle = ink("--accent");
  for (const number of scene.kept || []) curvePen.fillRect(x(number - 0.5), foot, Math.max(1, x(1) - x(0)), 3);
  curvePen.textAlign = "start";
  curvePen.fillStyle = ink("--faint");
  curvePen.fillText(kind === "error" ? "centre error [px]" : "overlap", PLOT.left + 4, foot - 4);
  for (const take of drawnTakes()) {
    curvePen.strokeStyle = curvePen.fillStyle = colourOf(take.tracker);
    curvePen.lineWidth = take.tracker === focus() ? 2.2 : 1.3;
    curvePen.setLineDash(dashOf(take.tracker));
    curvePen.beginPath();
    let down = false;
    curveOf(take).forEach((value, i) => {
      if (!Number.isNaN(value)) curvePen[down ? "lineTo" : "moveTo"](x(i), y(value));
      down = !Number.isNaN(value);
    });
    curvePen.stroke();
    curvePen.setLineDash([]);
    for (const mark of take.marks) {  // restarted with the true box: a triangle on its foot, and a line up
      curvePen.fill(new Path2D(`M${x(mark) - 5},${foot}H${x(mark) + 5}L${x(mark)},${foot - 9}Z`));
      curvePen.fillRect(x(mark) - 0.5, PLOT.top, 1, foot - PLOT.top);
    }
  }
  lanes.forEach((take, number) => drawLane(take, x, foot + 6 + number * PLOT.lane, ink));
}

/** A lane: solid for success, pale below, a thin line outside the true box, a cross where it is lost. */
function drawLane(take, x, top, ink) {
  const { overlap, out } = scene.curve(rowOf(take)), colour = colourOf(take.tracker), wide = Math.max(1, x(1) - x(0));
  overlap.forEach((value, i) => {
    if (Number.isNaN(value)) return;
    curvePen.fillStyle = out[i] ? ink("--ink") : colour;
    curvePen.globalAlpha = out[i] || value >= SUCCESS ? 1 : 0.35;
    curvePen.fillRect(x(i) - wide / 2, top + (out[i] ? 2 : 0), wide + 0.3, out[i] ? 1.5 : PLOT.lane - 2);
  });
  curvePen.globalAlpha = 1;
  const lost = lostFrame(take);
  if (lost < 0) return;
  curvePen.lineWidth = 2;
  curvePen.strokeStyle = ink("--bad");
  const [at, middle] = [x(lost), top + PLOT.lane / 2 - 1];
  curvePen.stroke(new Path2D(`M${at - 4},${middle - 4}l8,8m-8,0l8,-8`));
}

// ---- Thumbnails of frames at equal distances; a click goes to a frame.
const THUMBNAILS = 20;
async function drawStrip() {
  const here = scene, film = here.films.thumbnails, strip = byId("strip"), takes = drawnTakes();
  const count = film ? Math.min(THUMBNAILS, here.frames) : 0;
  if (strip.children.length !== count) strip.replaceChildren(...Array.from({ length: count }, () => make("canvas", { width: 120, height: 90 })));
  for (let i = 0; i < count; i++) {
    const number = Math.round((i + 0.5) * here.frames / count - 0.5), canvas = strip.children[i];
    canvas.onclick = () => move(number);
    canvas.frame = number;
    const image = await film.get(number);
    if (scene !== here) return;
    canvas.height = Math.round(120 * here.size[1] / here.size[0]);
    if (image) drawFrame(canvas.getContext("2d", { alpha: false }), here, number, image, null, takes, 1.4, { rowOf });
  }
  markStrip();
}
function markStrip() {
  const all = [...byId("strip").children], far = (one) => Math.abs(one.frame - frame);
  for (const one of all) one.classList.toggle("on", far(one) === Math.min(...all.map(far)));
}
