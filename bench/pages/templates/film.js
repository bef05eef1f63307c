"use strict";
// Frames and boxes of a sequence, which are decoded when the player needs them.
const KEPT = 80;  // maximum number of decoded frames in memory

// ---- Encoded data of the page, or of the files next to it.
const awaited = new Map();
function trackmark(name, text) { awaited.get(name)?.(text); }  // the files next to the page call this function

function block(name) {
  const inside = byId(name);
  if (inside) return Promise.resolve(inside.textContent);
  return new Promise((resolve, reject) => {
    awaited.set(name, resolve);
    const script = make("script", { src: `${data.beside}/${name}.js` });
    script.onerror = () => reject(new Error(`The folder ${data.beside} with the frames is not next to this page.`));
    document.head.append(script);
  });
}
async function bytesOf(name) {
  const text = atob(await block(name)), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}
const unsqueezed = async (name) =>
  new Response(new Blob([await bytesOf(name)]).stream().pipeThrough(new DecompressionStream("deflate")));

class Reel {
  constructor(name, sizes, kept) {
    this.name = name;
    this.numbers = kept && new Map(kept.map((frame, number) => [frame, number]));
    this.places = sizes.flatMap((chunk, number) => {
      let end = 0;
      return chunk.map((size) => ({ number, from: end, to: (end += size) }));
    });
    this.chunks = new Map();
    this.images = new Map();
  }
  /** Return a decoded frame, a promise of the frame while it is decoded, or null if it does not exist. */
  get(frame) {
    if (this.numbers && !this.numbers.has(frame)) return null;
    if (!this.images.has(frame)) {
      const promise = this.read(frame).then((image) => { this.images.set(frame, image); return image; });
      promise.catch(() => this.images.delete(frame));
      this.images.set(frame, promise);
      if (this.images.size > KEPT) this.images.delete(this.images.keys().next().value);
    }
    return this.images.get(frame);
  }
  async read(frame) {
    const { number, from, to } = this.places[this.numbers ? this.numbers.get(frame) : frame];
    if (from === to) return null;
    if (!this.chunks.has(number)) this.chunks.set(number, bytesOf(`${this.name}-${number}`));
    const bytes = await this.chunks.get(number);
    return createImageBitmap(new Blob([new Uint8Array(bytes, from, to - from)], { type: "image/webp" }));
  }
}

class Scene {
  constructor(number) {
    this.number = number;
    Object.assign(this, data.scenes[number]);
    let rows = 1;  // row 0 is the ground truth
    this.takes = this.takes.map(([tracker, repetition, revised, failure, round, maps, numbers, start, begun, judged, marks], number) =>
      ({ number, tracker, repetition, row: rows++, revised: revised ? rows++ : null, failure, round, maps, numbers, start, begun, judged, marks }));
    this.judged = new Map(this.takes.filter((take) => take.judged.length).map((take) => [take.row, take.judged]));
    this.films = Object.fromEntries(Object.entries(this.reels).map(([kind, sizes]) => [kind, new Reel(`${kind}-${number}`, sizes, /^(thumbnails|full)$/.test(kind) && this.kept)]));
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
    this.shapes = this.shapes ? await (await unsqueezed(`shapes-${this.number}`)).json() : {};
    for (const take of this.takes) if (take.numbers) take.numbers = await (await unsqueezed(`numbers-${this.number}-${take.number}`)).json();
    const kinds = Object.values(this.shapes).flatMap(Object.values).flatMap(Object.keys);
    this.layers = new Set(["boxes", ...(this.takes.some((take) => take.round) ? ["contours"] : []), ...kinds]);
    return this;
  }
  /** Return a box [px], or null if it is missing. Row 0 is the ground truth. */
  box(row, frame) {
    const at = (row * this.frames + frame) * 4;
    const { boxes } = this;
    return boxes[at] === data.absent ? null : [boxes[at] / 50, boxes[at + 1] / 50, boxes[at + 2] / 50, boxes[at + 3] / 50];
  }
  /** Return the run of a tracker, repetition and start; if it does not exist, the tracker's first run. */
  take(tracker, repetition, start) {
    const its = this.takes.filter((take) => take.tracker === tracker);
    const repeated = its.filter((take) => take.repetition === repetition);  // a deterministic tracker has only repetition 0
    const found = repeated.length ? repeated : its;
    return found.find((take) => take.start === start) || found[0];
  }
  /** Return centre error, overlap and "outside the true box" by frame; NaN in frames without ground truth. */
  curve(row) {
    if (!this.curves.has(row)) {
      const found = { error: new Float32Array(this.frames).fill(NaN), overlap: new Float32Array(this.frames).fill(NaN), out: new Uint8Array(this.frames) };
      for (let frame = 0; frame < this.frames; frame++) {
        const truth = this.box(0, frame), box = this.box(row, frame);
        if (!truth || frame < this.first) continue;
        if (this.judged.has(row) && !this.judged.get(row).some(([from, to]) => from <= frame && frame <= to)) continue;
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
