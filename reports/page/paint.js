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
    pen.fillStyle = "#d8dade";
    pen.font = "16px system-ui";
    if (scene.kept) pen.fillText("The page keeps the worst frames alone.", 12, 26);
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
    const shapes = shapesOf(take.row), colour = data.colours[take.tracker % data.colours.length];
    const rim = colour === "#000000" ? "#fff" : "#000";  // readable on any ground
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
    stroke(path, rim, width + 1.2);
    stroke(path, colour, width, dashOf(take.tracker));
    if (shapes.particles && layers.has("particles")) for (const [x, y, weight] of shapes.particles) {
      const half = unit * (0.5 + 0.9 * Math.sqrt(weight));  // heavier ones are larger
      pen.fillRect(x * scale - half, y * scale - half, 2 * half, 2 * half);
    }
  }
  stroke(truth, "#fff", 1, [4, 4]);
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
  const inks = getComputedStyle(dialog), ink = inks.color;
  curvePen.clearRect(0, 0, canvas.width, canvas.height);
  curvePen.fillStyle = curvePen.strokeStyle = ink;
  curvePen.font = `${11 * ratio}px system-ui`;
  curvePen.fillText(kind === "error" ? `centre error, up to ${top.toFixed(0)} px` : "overlap, up to 1", 4 * ratio, 12 * ratio);
  for (const [take, values] of curves) {
    curvePen.strokeStyle = inks.getPropertyValue(`--line-${take.tracker % data.colours.length}`);
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
    curvePen.setLineDash([]);
    curvePen.fillStyle = curvePen.strokeStyle;
    for (const mark of take.marks) {  // begun again with the truth: a triangle on its foot, and a line up
      const x = (mark + 0.5) / scene.frames * canvas.width, foot = canvas.height;
      curvePen.fill(new Path2D(`M${x - 5 * ratio},${foot}H${x + 5 * ratio}L${x},${foot - 9 * ratio}Z`));
      curvePen.fillRect(x - ratio / 2, 16 * ratio, ratio, foot);
    }
  }
}
