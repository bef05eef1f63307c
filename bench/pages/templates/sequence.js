"use strict";
// Frames and boxes of a sequence, which are decoded when the player needs them.
const MAX_DECODED = 80;  // maximum number of decoded frames in memory

// ---- Encoded data of the page, or of the files next to it.
const waiting = new Map();
function trackmark(name, text) { waiting.get(name)?.(text); }  // the files next to the page call this function

function block(name) {
  const inside = byId(name);
  if (inside) return Promise.resolve(inside.textContent);
  return new Promise((resolve, reject) => {
    waiting.set(name, resolve);
    const script = make("script", { src: `${data.folder}/${name}.js` });
    script.onerror = () => reject(new Error(`The folder ${data.folder} with the frames is not next to this page.`));
    document.head.append(script);
  });
}
async function bytesOf(name) {
  const text = atob(await block(name)), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  return bytes.buffer;
}
const inflated = async (name) =>
  new Response(new Blob([await bytesOf(name)]).stream().pipeThrough(new DecompressionStream("deflate")));

/** Return the frames of a chunk; before each frame is its size in four bytes. */
function framesIn(chunk) {
  const view = new DataView(chunk), frames = [];
  for (let start = 0, size = 0; start < chunk.byteLength; start += 4 + size) {
    size = view.getUint32(start, true);
    frames.push(new Uint8Array(chunk, start + 4, size));
  }
  return frames;
}

class FrameReader {
  constructor(name, counts, kept) {
    this.name = name;
    this.numbers = kept && new Map(kept.map((frame, number) => [frame, number]));
    this.places = counts.flatMap((count, chunk) => Array.from({ length: count }, (_, index) => ({ chunk, index })));
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
      if (this.images.size > MAX_DECODED) this.images.delete(this.images.keys().next().value);
    }
    return this.images.get(frame);
  }
  async read(frame) {
    const { chunk, index } = this.places[this.numbers ? this.numbers.get(frame) : frame];
    if (!this.chunks.has(chunk)) this.chunks.set(chunk, bytesOf(`${this.name}-${chunk}`).then(framesIn));
    const bytes = (await this.chunks.get(chunk))[index];
    return bytes.length ? createImageBitmap(new Blob([bytes], { type: "image/webp" })) : null;
  }
}

// Values that the page omits from the data of a run.
const DEFAULTS = { repetition: 0, has_revised: false, failure: "", is_ellipse: false, maps: [], numbers: false, start: 0, start_label: "", scored: [], restarts: [] };

class PlayerSequence {
  constructor(number) {
    this.number = number;
    Object.assign(this, data.sequences[number]);
    let rows = 1;  // row 0 is the ground truth
    this.runs = this.runs.map((run, number) => ({ ...DEFAULTS, ...run, number, row: rows++, revised: run.has_revised ? rows++ : null }));
    this.scored = new Map(this.runs.filter((run) => run.scored.length).map((run) => [run.row, run.scored]));
    this.readers = Object.fromEntries(Object.entries(this.chunk_lengths).map(([kind, counts]) => [kind, new FrameReader(`${kind}-${number}`, counts, /^(thumbnails|full)$/.test(kind) && this.frame_numbers)]));
    this.curves = new Map();
  }
  async open() {
    const planes = new Uint8Array(await (await inflated(`boxes-${this.number}`)).arrayBuffer());
    const n = planes.length / 4, boxes = new Int32Array(n), wide = this.n_frames * 4;
    for (let i = 0; i < n; i++) {
      const step = planes[i] | planes[n + i] << 8 | planes[2 * n + i] << 16 | planes[3 * n + i] << 24;
      boxes[i] = i % wide < 4 ? step : boxes[i - 4] + step | 0;
    }
    this.boxes = boxes;
    this.shapes = this.shapes ? await (await inflated(`shapes-${this.number}`)).json() : {};
    for (const run of this.runs) if (run.numbers) run.numbers = await (await inflated(`numbers-${this.number}-${run.number}`)).json();
    const kinds = Object.values(this.shapes).flatMap(Object.values).flatMap(Object.keys);
    this.layers = new Set(["boxes", ...(this.runs.some((run) => run.is_ellipse) ? ["contours"] : []), ...kinds]);
    return this;
  }
  /** Return a box [px], or null if it is missing. Row 0 is the ground truth. */
  box(row, frame) {
    const at = (row * this.n_frames + frame) * 4;
    const { boxes } = this;
    return boxes[at] === data.absent ? null : [boxes[at] / 50, boxes[at + 1] / 50, boxes[at + 2] / 50, boxes[at + 3] / 50];
  }
  /** Return the run of a tracker, repetition and start; if it does not exist, the tracker's first run. */
  run(tracker, repetition, start) {
    const all = this.runs.filter((run) => run.tracker === tracker);
    const repeated = all.filter((run) => run.repetition === repetition);  // a deterministic tracker has only repetition 0
    const candidates = repeated.length ? repeated : all;
    return candidates.find((run) => run.start === start) || candidates[0];
  }
  /** Return centre error, overlap and "outside the ground-truth box" by frame; NaN in frames without ground truth. */
  curve(row) {
    if (!this.curves.has(row)) {
      const curve = { error: new Float32Array(this.n_frames).fill(NaN), overlap: new Float32Array(this.n_frames).fill(NaN), outside: new Uint8Array(this.n_frames) };
      for (let frame = 0; frame < this.n_frames; frame++) {
        const truth = this.box(0, frame), box = this.box(row, frame);
        if (!truth || frame < this.first) continue;
        if (this.scored.has(row) && !this.scored.get(row).some(([from, to]) => from <= frame && frame <= to)) continue;
        curve.overlap[frame] = box ? overlapOf(truth, box) : 0;
        if (box) curve.error[frame] = distanceOf(truth, box);
        const [x, y] = box ? centreOf(box) : [NaN, NaN];
        curve.outside[frame] = !(x >= truth[0] && x < truth[0] + truth[2] && y >= truth[1] && y < truth[1] + truth[3]);
      }
      this.curves.set(row, curve);
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
