"use strict";
// A frame with what truth and trackers say on top, and the curve of all frames beneath.
const LENS = 4;  // how much the magnifier enlarges
const LAYERS = ["boxes", "masks", "contours", "particles"];  // a map is chosen by its name
const screen = byId("screen"), pen = screen.getContext("2d", { alpha: false });
const curvePen = byId("curve").firstChild.getContext("2d");

function paint(image, map) {
  const scale = screen.width / scene.size[0];
  pen.setTransform(1, 0, 0, 1, 0, 0);
  drawScene(image, map, scale);
  if (!image && scene.kept) {
    const em = 16 * screen.width / screen.clientWidth;  // of what is seen, also where the frame is small
    pen.fillStyle = "#d8dade";
    pen.font = `${em}px system-ui`;
    pen.fillText("The page keeps the worst frames alone,", 0.7 * em, 1.5 * em);
    pen.fillText("those with a line beneath the curve.", 0.7 * em, 2.9 * em);
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
    drawScene(image, map, scale, LENS);
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
function linesOf(row, shapes, layers, scale, take) {
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

function drawScene(image, map, scale, enlarged = 1) {
  if (image) pen.drawImage(image, 0, 0, screen.width, screen.height);
  else {
    pen.fillStyle = "#3a3d42";
    pen.fillRect(0, 0, screen.width, screen.height);
  }
  if (map) {
    pen.globalAlpha = 0.6;
    pen.drawImage(map, 0, 0, screen.width, screen.height);
    pen.globalAlpha = 1;
  }
  const unit = Math.max(1.6, screen.width / 480) / enlarged, layers = shownLayers();
  const stroke = (path, colour, width, dash = []) => {
    pen.strokeStyle = colour;
    pen.lineWidth = width * unit;
    pen.setLineDash(dash.map((length) => length * unit));
    pen.stroke(path);
  };
  const shapesOf = (row) => scene.shapes[row]?.[frame] || {};
  const truth = linesOf(0, shapesOf(0), layers, scale);
  stroke(truth, "#000", 1.6);
  for (const take of drawnTakes()) {
    const shapes = shapesOf(take.row), colour = colourOf(take.tracker);
    const width = take.tracker === focus() ? 2.6 : 1.8;
    pen.fillStyle = colour;
    if (shapes.masks && layers.has("masks")) {
      const inside = new Path2D();
      addLines(inside, shapes.masks, scale);
      pen.globalAlpha = 0.3;
      pen.fill(inside, "evenodd");
      pen.globalAlpha = 1;
      stroke(inside, colour, 0.8);
    }
    const path = linesOf(rowOf(take), shapes, layers, scale, take);
    stroke(path, "#000", width + 1.2);  // a rim: readable on any ground
    stroke(path, colour, width, dashOf(take.tracker));
    if (shapes.particles && layers.has("particles")) for (const [x, y, weight] of shapes.particles) {
      const half = unit * (0.5 + 0.9 * Math.sqrt(weight));  // heavier ones are larger
      pen.fillRect(x * scale - half, y * scale - half, 2 * half, 2 * half);
    }
  }
  stroke(truth, "#fff", 1, [4, 4]);
}

// Where the curve lies in its canvas [CSS pixels]; the slider below begins and ends there.
const PLOT = { left: 36, right: 8, top: 16, bottom: 16 };
const SUCCESS = 0.5;  // the least overlap that counts as success
/** How far along the curve a frame is, in [0, 1]. */
const alongCurve = (number) => number / Math.max(1, scene.frames - 1);

/** The curve of all frames beneath; drawn when what is shown changes. */
function drawCurve() {
  const canvas = curvePen.canvas, ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  curvePen.scale(ratio, ratio);
  const kind = state.get("curve") === "overlap" ? "overlap" : "error";
  byId("measured").textContent = `Curve: ${kind}`;
  const curveOf = (take) => scene.curve(rowOf(take))[kind];
  let top = 1;  // the same while another run is held, so that both compare
  if (kind === "error") for (const take of [...shownTakes(), otherTake()].filter(Boolean)) for (const value of curveOf(take)) if (value > top) top = value;
  const x = (number) => PLOT.left + alongCurve(number) * (width - PLOT.left - PLOT.right);
  const y = (value) => height - PLOT.bottom - value / top * (height - PLOT.top - PLOT.bottom);
  const inks = getComputedStyle(dialog), ink = (name) => inks.getPropertyValue(name);
  curvePen.font = "11px system-ui";
  const line = (x0, y0, x1, y1) => { curvePen.beginPath(); curvePen.moveTo(x0, y0); curvePen.lineTo(x1, y1); curvePen.stroke(); };
  curvePen.strokeStyle = ink("--line");
  curvePen.fillStyle = ink("--faint");
  curvePen.textAlign = "end";
  for (const tick of ticksOf(0, 2 * top)) if (tick <= top) {
    line(PLOT.left, y(tick), width - PLOT.right, y(tick));
    curvePen.fillText(String(tick), PLOT.left - 5, y(tick) + 4);
  }
  curvePen.textAlign = "center";
  for (const tick of ticksOf(0, scene.frames - 1)) if (Number.isInteger(tick)) {
    line(x(tick), height - PLOT.bottom, x(tick), height - PLOT.bottom + 3);
    curvePen.fillText(String(tick), x(tick), height - 3);
  }
  curvePen.fillStyle = ink("--accent");
  for (const number of scene.kept || []) curvePen.fillRect(x(number - 0.5), height - PLOT.bottom, Math.max(1, x(1) - x(0)), 3);
  curvePen.fillStyle = ink("--faint");
  curvePen.textAlign = "start";
  curvePen.fillText(kind === "error" ? "centre error [px]" : `overlap; success from ${SUCCESS}`, PLOT.left, 11);
  if (kind === "overlap") {
    curvePen.strokeStyle = ink("--bad");
    curvePen.setLineDash([6, 4]);
    line(PLOT.left, y(SUCCESS), width - PLOT.right, y(SUCCESS));
  }
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
    for (const mark of take.marks) {  // begun again with the truth: a triangle on its foot, and a line up
      const foot = height - PLOT.bottom;
      curvePen.fill(new Path2D(`M${x(mark) - 5},${foot}H${x(mark) + 5}L${x(mark)},${foot - 9}Z`));
      curvePen.fillRect(x(mark) - 0.5, PLOT.top, 1, foot - PLOT.top);
    }
  }
}
