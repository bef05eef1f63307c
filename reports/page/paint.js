"use strict";
// A frame with the boxes of truth and trackers on top, and the curve of all frames beneath.
const LENS = 4;  // how much the magnifier enlarges
const screen = byId("screen"), pen = screen.getContext("2d");
const curvePen = byId("curve").firstChild.getContext("2d");

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
