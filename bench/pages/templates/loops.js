"use strict";
// Worst frames: a loop plays while it is seen; its poster is an image of the page.
const still = matchMedia("(prefers-reduced-motion: reduce)");
let looping = !still.matches;
const loops = [...document.querySelectorAll("[data-loop]")].map((link) => {
  const [number, first, last] = link.dataset.loop.split(",").map(Number);
  return { link, number, first, last, frame: first, seen: false, busy: false, due: 0, canvas: null };
});

async function showLoop(loop, now) {
  loop.busy = true;
  const opened = await openSequence(loop.number), image = await opened.readers.thumbnails?.get(loop.frame);
  loop.busy = false;
  if (!image) return;
  if (!loop.canvas) {
    loop.canvas = make("canvas", { width: 480, height: Math.round(480 * opened.size[1] / opened.size[0]), "aria-hidden": "true" });
    loop.link.querySelector(".still").before(loop.canvas);
  }
  const runs = [...new Set(opened.runs.map((run) => run.tracker))].slice(0, data.n_looped).map((tracker) => opened.run(tracker, 0, 0));
  drawFrame(loop.canvas.getContext("2d", { alpha: false }), opened, loop.frame, image, null, runs, 2.2);
  loop.due = Math.max(loop.due + 1000 / Math.min(opened.fps || 25, 25), now);
  loop.frame = loop.frame >= loop.last ? loop.first : loop.frame + 1;
}
function playLoops(now) {
  if (looping && !document.hidden && !dialog.open) for (const loop of loops) if (loop.seen && !loop.busy && now >= loop.due) showLoop(loop, now).catch(() => { loop.seen = false; });
  if (looping) requestAnimationFrame(playLoops);
}
function setLooping(on) {
  looping = on;
  byId("loops").textContent = on ? "Pause" : "Play";
  if (on) requestAnimationFrame(playLoops);
}
if (loops.length) {
  const seen = new IntersectionObserver((entries) => {
    for (const entry of entries) loops.find((loop) => loop.link === entry.target).seen = entry.isIntersecting;
  });
  for (const loop of loops) seen.observe(loop.link);
  byId("loops").addEventListener("click", () => setLooping(!looping));
  setLooping(looping);
}
