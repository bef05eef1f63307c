"use strict";
// Drawing of a frame with boxes and layers, of the timeline, and of the thumbnails.
const LENS = 4;  // factor of the magnifier
const LAYERS = ["boxes", "masks", "contours", "particles"];  // maps are selected by name
const screen = byId("screen"), pen = screen.getContext("2d", { alpha: false });
const curvePen = byId("curve").firstChild.getContext("2d");

function paint(image, map) {
  const scale = screen.width / sequence.size[0];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  const drawn = (enlarged) => drawFrame(pen, sequence, frame, image, map, drawnRuns(), Math.max(1.6, screen.width / 480) / enlarged, { layers: shownLayers(), focus: focus(), rowOf });
  drawn(1);
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

/** Return the centre of the ground-truth box, else that of the selected tracker; null if both boxes are missing. */
function middleOf(scale) {
  const run = drawnRuns().find((one) => one.tracker === focus());
  const box = sequence.box(0, frame) || (run && sequence.box(rowOf(run), frame));
  return box && centreOf(box).map((value) => value * scale);
}

/** Return the layers that are not hidden. */
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

/** Return box, ellipse and contours of a row as one path; `run`: its run, undefined for the ground truth. */
function linesOf(sequence, frame, row, shapes, layers, scale, run) {
  const path = new Path2D(), box = sequence.box(row, frame);
  if (box && layers.has("boxes")) path.rect(...box.map((value) => value * scale));
  if (box && run?.is_ellipse && layers.has("contours")) {
    const [x, y, width, height] = box.map((value) => value * scale / 2);
    path.moveTo(2 * x + 2 * width, 2 * y + height);
    path.ellipse(2 * x + width, 2 * y + height, width, height, 0, 0, 2 * Math.PI);
  }
  if (shapes.contours && layers.has("contours")) addLines(path, shapes.contours, scale);
  if (shapes.masks && layers.has("masks") && !run) addLines(path, shapes.masks, scale);  // masks of runs are filled
  return path;
}

/** Draw a frame with the boxes of runs; `unit`: width of a thin line [px of the canvas]. */
function drawFrame(pen, sequence, frame, image, map, runs, unit, { layers = new Set(["boxes"]), focus = -1, rowOf = (run) => run.row } = {}) {
  const { width: wide, height: high } = pen.canvas, scale = wide / sequence.size[0];
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
  const shapesOf = (row) => sequence.shapes[row]?.[frame] || {};
  const truth = linesOf(sequence, frame, 0, shapesOf(0), layers, scale);
  stroke(truth, "#000", 1.6);
  for (const run of runs) {
    const shapes = shapesOf(run.row), colour = colourOf(run.tracker);
    const width = run.tracker === focus ? 2.6 : 1.8;
    pen.fillStyle = colour;
    if (shapes.masks && layers.has("masks")) {
      const inside = new Path2D();
      addLines(inside, shapes.masks, scale);
      pen.globalAlpha = 0.3;
      pen.fill(inside, "evenodd");
      pen.globalAlpha = 1;
      stroke(inside, colour, 0.8);
    }
    const path = linesOf(sequence, frame, rowOf(run), shapes, layers, scale, run);
    stroke(path, "#000", width + 1.2);  // a dark rim keeps the line visible on any frame
    stroke(path, colour, width, dashOf(run.tracker));
    if (shapes.particles && layers.has("particles")) for (const [x, y, weight] of shapes.particles) {
      const half = unit * (0.5 + 0.9 * Math.sqrt(weight));  // particles with larger weights are larger
      pen.fillRect(x * scale - half, y * scale - half, 2 * half, 2 * half);
    }
  }
  stroke(truth, "#fff", 1, [4, 4]);
}

// Layout of the timeline [CSS pixels]: the curve, then a lane per tracker, then the frame numbers.
const PLOT = { left: 30, right: 8, top: 8, height: 66, lane: 7, bottom: 16 };
const SUCCESS = 0.5;  // smallest overlap that counts as success
const LOST = 10;  // consecutive frames outside the ground-truth box after which the target counts as lost
const MAX_LANES = 9;
/** Return the position of a frame along the timeline, from 0 to 1. */
const alongCurve = (number) => number / Math.max(1, sequence.n_frames - 1);

/** Return the frame from which the target is lost, or in which a failed run ends; -1 if there is none. */
function lostFrame(run) {
  const { outside } = sequence.curve(rowOf(run));
  if (run.failure && !run.start_label) return endOf(run);
  for (let i = 0, length = 0; i < outside.length; i++) {
    length = outside[i] ? length + 1 : 0;
    if (length === LOST) return i - LOST + 1;
  }
  return -1;
}

/** Draw the curve of all frames and a lane per tracker. */
function drawCurve() {
  const lanes = drawnRuns().slice(0, MAX_LANES);
  byId("curve").style.height = `${PLOT.top + PLOT.height + 6 + PLOT.lane * Math.min(selectedTrackers().length, MAX_LANES) + PLOT.bottom}px`;
  const canvas = curvePen.canvas, ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  curvePen.scale(ratio, ratio);
  const kind = state.get("curve") === "error" ? "error" : "overlap";
  byId("curve-kind").textContent = `Curve: ${kind}`;
  const curveOf = (run) => sequence.curve(rowOf(run))[kind], foot = PLOT.top + PLOT.height;
  let top = 1;  // the scale includes the other run: it does not change while the button of the other run is held
  if (kind === "error") for (const run of [...shownRuns(), otherRun()].filter(Boolean)) for (const value of curveOf(run)) if (value > top) top = value;
  const x = (number) => PLOT.left + alongCurve(number) * (width - PLOT.left - PLOT.right);
  const y = (value) => foot - value / top * PLOT.height;
  const inks = getComputedStyle(dialog), ink = (name) => inks.getPropertyValue(name);
  curvePen.font = "11px Inter, system-ui";
  const line = (x0, y0, x1, y1) => { curvePen.beginPath(); curvePen.moveTo(x0, y0); curvePen.lineTo(x1, y1); curvePen.stroke(); };
  curvePen.strokeStyle = ink("--line");
  curvePen.fillStyle = ink("--faint");
  curvePen.textAlign = "end";
  for (const tick of kind === "overlap" ? [0, SUCCESS, 1] : ticksOf(0, 2 * top).filter((one) => one <= top)) {
    line(PLOT.left, y(tick), width - PLOT.right, y(tick));
    curvePen.fillText(String(tick), PLOT.left - 5, y(tick) + 4);
  }
  curvePen.textAlign = "center";
  for (const tick of ticksOf(0, sequence.n_frames - 1)) if (Number.isInteger(tick)) curvePen.fillText(String(tick), x(tick), height - 3);
  curvePen.fillStyle = ink("--accent");
  for (const number of sequence.frame_numbers || []) curvePen.fillRect(x(number - 0.5), foot, Math.max(1, x(1) - x(0)), 3);
  for (const run of drawnRuns()) {
    curvePen.strokeStyle = curvePen.fillStyle = colourOf(run.tracker);
    curvePen.lineWidth = run.tracker === focus() ? 2.2 : 1.3;
    curvePen.setLineDash(dashOf(run.tracker));
    curvePen.beginPath();
    let down = false;
    curveOf(run).forEach((value, i) => {
      if (!Number.isNaN(value)) curvePen[down ? "lineTo" : "moveTo"](x(i), y(value));
      down = !Number.isNaN(value);
    });
    curvePen.stroke();
    curvePen.setLineDash([]);
    for (const mark of run.restarts) {  // a triangle and a line mark a restart with the ground-truth box
      curvePen.fill(new Path2D(`M${x(mark) - 5},${foot}H${x(mark) + 5}L${x(mark)},${foot - 9}Z`));
      curvePen.fillRect(x(mark) - 0.5, PLOT.top, 1, foot - PLOT.top);
    }
  }
  const name = [kind === "error" ? "centre error [px]" : "overlap", PLOT.left + 4, foot - 4];
  [curvePen.textAlign, curvePen.fillStyle, curvePen.strokeStyle, curvePen.lineWidth] = ["start", ink("--faint"), ink("--paper"), 4];
  curvePen.strokeText(...name);  // curves do not cross the name
  curvePen.fillText(...name);
  lanes.forEach((run, number) => drawLane(run, x, foot + 6 + number * PLOT.lane, ink));
}

/** Draw a lane: solid for success, pale below, thin outside the ground-truth box, a cross where the target is lost. */
function drawLane(run, x, top, ink) {
  const { overlap, outside } = sequence.curve(rowOf(run)), colour = colourOf(run.tracker), wide = Math.max(1, x(1) - x(0));
  overlap.forEach((value, i) => {
    if (Number.isNaN(value)) return;
    curvePen.fillStyle = outside[i] ? ink("--ink") : colour;
    curvePen.globalAlpha = outside[i] || value >= SUCCESS ? 1 : 0.35;
    curvePen.fillRect(x(i) - wide / 2, top + (outside[i] ? 2 : 0), wide + 0.3, outside[i] ? 1.5 : PLOT.lane - 2);
  });
  curvePen.globalAlpha = 1;
  const lost = lostFrame(run);
  if (lost < 0) return;
  curvePen.lineWidth = 2;
  curvePen.strokeStyle = ink("--bad");
  const [at, middle] = [x(lost), top + PLOT.lane / 2 - 1];
  curvePen.stroke(new Path2D(`M${at - 4},${middle - 4}l8,8m-8,0l8,-8`));
}

// ---- Thumbnails of frames at equal distances; a click goes to a frame.
const THUMBNAILS = 20;
async function drawStrip() {
  const here = sequence, reader = here.readers.thumbnails, strip = byId("strip"), runs = drawnRuns();
  const count = reader ? Math.min(THUMBNAILS, here.n_frames) : 0;
  if (strip.children.length !== count) strip.replaceChildren(...Array.from({ length: count }, () => make("canvas", { width: 120, height: 90 })));
  const canvases = [...strip.children];
  canvases.forEach((canvas, i) => {
    canvas.frame = Math.round((i + 0.5) * here.n_frames / count - 0.5);
    canvas.onclick = () => move(canvas.frame);
  });
  markStrip();
  for (const canvas of canvases) {
    const image = await reader.get(canvas.frame);
    if (sequence !== here) return;
    canvas.height = Math.round(120 * here.size[1] / here.size[0]);
    if (image) drawFrame(canvas.getContext("2d", { alpha: false }), here, canvas.frame, image, null, runs, 1.4, { rowOf });
  }
}
function markStrip() {
  const all = [...byId("strip").children], far = (one) => Math.abs(one.frame - frame);
  const nearest = all.reduce((best, one) => (best && far(best) <= far(one) ? best : one), null);
  for (const one of all) one.classList.toggle("on", one === nearest);
}
