"use strict";
// The player: it shows what the page address selects; controls and keys change the address.
const AHEAD = 10;  // frames that are decoded in advance
const TOLD_EVERY = 150;  // shortest time between updates of texts during playback [ms]

const WORST_ONLY = "This page has only the worst frames, those with a line below the curve.";

const dialog = byId("player");
const scenes = new Map();
let scene = null, frame = 0, playing = 0, held = false, pointer = null;
let toldAt = 0;
let pointed = false;  // true if the last input was by pointer, false if by key
let painted = null, paintedMap = null, paintedFrame = -1;  // image, map and number of the frame on the screen

const repetition = () => Number(state.get("repetition") || 0);
const start = () => Number(state.get("start") || 0);
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
  return state.has("other") ? scene.takes.find((take) => nameOf(take) === state.get("other")) : undefined;
}
const nameOf = (take) => [take.tracker, take.repetition, ...(take.start ? [take.start] : [])].join(".");
const shownTakes = () => shownTrackers().map((tracker) => scene.take(tracker, repetition(), start()));
/** Return the runs to draw; only the other run while `c` is pressed. */
const drawnTakes = () => (held && otherTake() ? [otherTake()] : shownTakes());

// ---- Display of a frame.
/** Return the run whose map is shown: of the selected tracker, else of the first one with this map. */
function mapTake() {
  const takes = drawnTakes().filter((take) => take.maps.includes(state.get("map")));
  return takes.find((one) => one.tracker === focus()) || takes[0];
}
function mapFilm() {
  const take = mapTake();
  return take && scene.films[`map${take.number}.${take.maps.indexOf(state.get("map"))}`];
}
const mapNames = () => [...new Set(scene.takes.flatMap((take) => take.maps))];

/** Show a frame; the promise resolves when the frame is drawn. */
async function seek(number) {
  const before = frame;
  frame = Math.max(0, Math.min(scene.frames - 1, Math.round(number) || 0));
  const wanted = frame, here = scene, seen = () => wanted === frame && here === scene;
  const { full, thumbnails } = here.films;
  tellFrame();
  let image = null, map = null;
  const weighed = mapFilm();
  const small = thumbnails && thumbnails.get(wanted), large = full && full.get(wanted);
  try {
    const ready = large instanceof ImageBitmap ? large : small;
    image = ready ? await ready : null;
    map = weighed ? await weighed.get(wanted) : null;
  } catch (error) { tellError(error); }
  if (!seen()) return;
  repaint(image, map);
  if (here.kept && (!image || byId("said").textContent === WORST_ONLY)) say(image ? "" : WORST_ONLY);
  const better = image === large ? null : large?.then((it) => { if (seen()) repaint(it); });
  Promise.resolve(better).catch(tellError).then(() => {
    for (const film of [thumbnails, full, weighed]) if (film) prepare(film, wanted, wanted < before ? -1 : 1, seen).catch(() => {});
  });
}
/** Decode the next frames one by one: parallel decoding would delay the frame that is shown. */
async function prepare(film, from, step, needed) {
  for (let next = from + step; Math.abs(next - from) <= AHEAD && next >= 0 && next < scene.frames && needed(); next += step) await film.get(next);
}
function repaint(image = painted, map = paintedMap) {
  painted = image;
  paintedMap = map;
  paintedFrame = frame;
  paint(image, map);
}
const tellError = (error) => { byId("said").textContent = error.message; };

function tellFrame() {
  byId("frame").value = frame;
  byId("where").textContent = `frame ${frame} of ${scene.frames - 1}`;
  for (const [name, value] of [["valuenow", frame], ["valuetext", byId("where").textContent]]) byId("curve").setAttribute(`aria-${name}`, value);
  byId("cursor").style.left = `calc(${PLOT.left}px + ${alongCurve(frame)} * (100% - ${PLOT.left + PLOT.right}px))`;
  if (playing && performance.now() - toldAt < TOLD_EVERY) return;  // each update of a text costs a layout
  toldAt = performance.now();
  markStrip();
  tellNumbers();
}

function nameIn(take) {
  const other = take.repetition === repetition() ? "" : ` (repetition ${take.repetition})`;
  return data.trackers[take.tracker] + other + (take.failure ? " (failed)" : "");
}
/** Return overlap, centre error and a warning if the centre is outside the true box. */
function scoresIn(take) {
  const { error, overlap, out } = scene.curve(rowOf(take));
  if (Number.isNaN(overlap[frame])) return [];
  const missing = Number.isNaN(error[frame]);
  const parts = [make("b", {}, overlap[frame].toFixed(2)), ` ${missing ? "no box" : `${error[frame].toFixed(1)} px`}`];
  return out[frame] && !missing ? [...parts, " ", make("em", {}, "off target")] : parts;
}

function numbersIn(take) {
  return Object.entries(take.numbers).filter(([, values]) => values[frame] !== null).map(([name, values]) => `${name} ${values[frame]}`).join(" · ");
}

/** Update scores and numbers of the trackers in the frame. */
function tellNumbers() {
  const drawn = drawnTakes();
  for (const button of trackerButtons()) {
    const take = drawn.find((one) => one.tracker === button.tracker);
    button.called.textContent = nameIn(take || scene.take(button.tracker, repetition(), start()));
    button.lastChild.replaceChildren(...(take ? scoresIn(take) : []));
  }
  const weighing = mapTake();
  byId("whose").textContent = weighing ? `of ${data.trackers[weighing.tracker]}` : "";
  const telling = drawn.filter((take) => take.numbers);
  byId("told").textContent = telling.map((take) => [data.trackers[take.tracker], numbersIn(take)]).filter(([, told]) => told).map((both) => both.join(": ")).join("\n");
  byId("told").style.minHeight = `${byId("told").offsetHeight}px`;  // the height never shrinks, so that the frame keeps its size
}

function options(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => { const one = make("option", { value }); one.textContent = text; return one; }));
  select.value = chosen;
  if (select.selectedIndex < 0) select.value = "";  // an unknown value selects the empty option
}

/** Make a button per tracker, which shows or hides the tracker. */
function makeLegend() {
  const truth = make("button", { type: "button", disabled: "" }, "- - true box");
  byId("legend").replaceChildren(truth, ...trackersHere().map((tracker, position) => {
    const called = make("span"), attributes = { type: "button", class: `c${Math.min(tracker, 6)}` };
    if (position < 9) attributes["aria-keyshortcuts"] = position + 1;
    const button = Object.assign(make("button", attributes, sampleOf(tracker), called, make("span", { class: "scores" })), { tracker, called });
    button.addEventListener("click", () => toggle(tracker));
    return button;
  }));
}
const trackerButtons = () => [...byId("legend").children].slice(1);

/** Update all controls from the page address. */
function arrange() {
  options(byId("scene"), data.scenes.map((one) => [one.name, one.title]), scene.name);
  const repetitions = [...new Set(scene.takes.map((take) => take.repetition))].sort((a, b) => a - b);
  byId("repetitions").hidden = repetitions.length < 2;
  options(byId("repetition"), repetitions.map((one) => [one, one]), repetition());
  const begins = scene.takes.filter((take) => take.begun), its = begins.filter((take) => take.tracker === focus());
  const begun = new Map((its.length ? its : begins).map((take) => [take.start, take.begun]));
  byId("starts").hidden = !begun.size;
  options(byId("start"), [...begun].sort((a, b) => a[0] - b[0]), start());
  byId("traces").hidden = scene.takes.every((take) => take.revised === null);
  byId("trace").value = state.get("trace") || "online";
  options(byId("other"), [["", "another run"], ...scene.takes.map((take) => [nameOf(take), `${data.trackers[take.tracker]}, repetition ${take.repetition}${take.begun && `, start ${take.begun}`}`])], state.get("other") || "");
  byId("frame").max = scene.frames - 1;
  byId("curve").setAttribute("aria-valuemax", scene.frames - 1);
  byId("lens").setAttribute("aria-pressed", state.has("lens"));
  byId("told").style.minHeight = `${1.5 * drawnTakes().filter((take) => take.numbers).length}em`;
  const shown = shownTrackers();
  for (const button of trackerButtons()) {
    button.setAttribute("aria-pressed", shown.includes(button.tracker));
    button.title = scene.take(button.tracker, repetition(), start()).failure;
    const looked = button.tracker === focus();
    if (looked && !button.called.classList.contains("focus")) requestAnimationFrame(() => button.scrollIntoView({ block: "nearest" }));
    button.called.classList.toggle("focus", looked);
  }
  arrangeLayers();
  screen.classList.toggle("lens", state.has("lens"));
  say(standing());
  drawCurve();
  drawStrip().catch(tellError);
}

/** Return messages on selected items that do not exist, and on failed runs. */
function standing() {
  const its = scene.takes.filter((take) => take.tracker === focus());
  const exists = {
    tracker: its.length, repetition: scene.takes.some((take) => take.repetition === repetition()), start: scene.takes.some((take) => take.start === start()),
    frame: state.get("frame") >= 0 && state.get("frame") < scene.frames, other: otherTake(), map: mapNames().includes(state.get("map")), show: state.get("show") === "none" || shownTrackers().length,
  };
  const told = Object.keys(exists).filter((key) => state.has(key) && !exists[key]).map((key) => `This sequence has no ${NOUNS[key] || key} ${state.get(key)}.`);
  if (scene.why) told.push(scene.why);
  const takes = new Set([...(its.length ? [scene.take(focus(), repetition(), start())] : []), ...shownTakes()]);
  for (const take of takes) if (take.failure) told.push(`${data.trackers[take.tracker]}, repetition ${take.repetition}, failed: ${take.failure}`);
  return told.join(" ");
}
const NOUNS = { other: "run", show: "tracker" };

/** Update the menu of layers, maps and other runs. */
function arrangeLayers() {
  const layers = shownLayers(), names = mapNames();
  for (const button of byId("layers").querySelectorAll("button")) {
    button.hidden = !scene.layers.has(button.dataset.layer);
    button.setAttribute("aria-pressed", layers.has(button.dataset.layer));
  }
  byId("map").parentNode.hidden = !names.length;
  options(byId("map"), [["", "none"], ...names.map((name) => [name, name])], state.get("map") || "");
  byId("layers").hidden = scene.layers.size < 2 && !names.length;
  byId("held").hidden = scene.takes.length < 2;
  byId("menu").hidden = byId("layers").hidden && byId("held").hidden;
}
function toggleLayer(layer) {
  if (!scene.layers.has(layer)) { say(`There are no ${layer}.`); return; }
  const shown = shownLayers();
  choose({ hide: LAYERS.filter((one) => shown.has(one) === (one === layer)).join(".") });
}
function nextMap() {
  const names = ["", ...mapNames()];
  if (names.length === 1) { say("There are no maps."); return; }
  choose({ map: names[(names.indexOf(state.get("map") || "") + 1) % names.length] });
}

function toggle(tracker) {
  const shown = shownTrackers();
  choose({ show: (shown.includes(tracker) ? shown.filter((one) => one !== tracker) : [...shown, tracker]).sort((a, b) => a - b).join(".") || "none" });
}

// ---- Reaction to a changed page address.
let drawnFor = "";
const leave = () => choose({ sequence: null, tracker: null, repetition: null, start: null, frame: null }, true);
const sceneNumber = () => data.scenes.findIndex((one) => one.name === state.get("sequence"));
function openScene(number, first) {
  if (!scenes.has(number)) {
    const made = new Scene(number);
    made.films.thumbnails?.get(Number(first ?? made.first))?.catch?.(() => {});  // decoded while boxes are unpacked
    scenes.set(number, made.open());
  }
  return scenes.get(number);
}
async function follow() {
  const name = state.get("sequence");
  const number = sceneNumber();
  byId("missing").textContent = name === null || number >= 0 ? "" : `There is no sequence ${name} on this page.`;
  if (number < 0) {
    if (dialog.open) dialog.close();
    stop();
    return;
  }
  const opened = await openScene(number, state.get("frame"));
  if (state.get("sequence") !== name) return;
  if (!dialog.open) { dialog.showModal(); byId("curve").focus(); }
  const around = new URLSearchParams(state);
  around.delete("frame");
  const moved = Number(state.get("frame") ?? opened.first);
  if (scene !== opened) {
    scene = opened;
    painted = null;
    paintedFrame = -1;
    screen.width = Math.max(960, Math.min(1280, scene.size[0]));
    screen.height = Math.round(screen.width * scene.size[1] / scene.size[0]);
    screen.style.setProperty("--shape", scene.size[0] / scene.size[1]);
    makeLegend();
  }
  if (`${around}` !== drawnFor) { drawnFor = `${around}`; arrange(); }
  else if (!(moved >= 0 && moved < scene.frames)) say(standing());
  await seek(moved);
}
listeners.push(() => { follow().catch(tellError); });

// ---- Playback and jumps.
const move = (number) => choose({ frame: Math.max(0, Math.min(scene.frames - 1, Math.round(number) || 0)) });
const say = (text) => { byId("said").textContent = text; };

function play() {
  if (playing) { stop(); return; }
  if (frame >= scene.frames - 1) move(0);
  const each = 1000 / (scene.fps || 30) / byId("speed").value;
  let due = performance.now() + each, busy = false;
  const tick = async (now) => {
    if (!playing) return;
    playing = requestAnimationFrame(tick);
    if (now < due || busy) return;
    due = Math.max(due + each, now - each);  // slow decoding delays playback but skips no frame
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

/** The frame after the last box of a run. */
function endOf(take) {
  let end = scene.frames;
  while (end && !scene.box(rowOf(take), end - 1)) end -= 1;
  return end;
}
/** Return frame, run and description of each failure of the visible trackers. */
function failures() {
  const found = [];
  for (const take of drawnTakes()) {
    const row = rowOf(take), { out } = scene.curve(row);
    const end = take.failure && !take.begun ? endOf(take) : scene.frames;
    for (let i = 1; i < end; i++) if (out[i] && !out[i - 1]) found.push([i, take, "leaves the true box"]);
    for (const mark of take.marks) found.push([mark, take, "is restarted"]);
    if (end < scene.frames) found.push([end, take, "stops"]);
  }
  return found.sort((a, b) => a[0] - b[0]);
}
function nextFailure() {
  if (!drawnTakes().length) { say("No tracker is shown."); return; }
  const found = failures(), [next] = found.find(([i]) => i > frame) || found[0] || [];
  if (next === undefined) { say("No shown tracker leaves the true box."); return; }
  const here = found.filter(([i]) => i === next);
  const why = here.filter(([, , what]) => what === "stops").map(([, take]) => ` Its run failed: ${take.failure}`).join("");
  move(next);
  say(`${here.map(([, take, what]) => `${data.trackers[take.tracker]} ${what}`).join("; ")} at frame ${next}.${why}`);
}

function hold(on) {
  if (held === on) return;
  if (on && !otherTake()) { say("Select another run next to this button first."); return; }
  held = on;
  if (on) say(`${data.trackers[otherTake().tracker]}, repetition ${otherTake().repetition}`);
  else say(standing());
  byId("hold").setAttribute("aria-pressed", on);
  drawCurve();
  tellNumbers();
  repaint();
  if (state.has("map")) seek(frame);  // the other run has its own map
}

function save() {
  const file = `${scene.title.replace(/[^\p{L}\p{N}.-]+/gu, "-")}-${String(frame).padStart(5, "0")}.png`;
  make("a", { href: screen.toDataURL("image/png"), download: file }).click();
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

function flipTrace() {
  if (scene.takes.every((take) => take.revised === null)) say("No run on this sequence has revised boxes.");
  else flip("trace", "revised");
}

const KEYS = {
  " ": play, ArrowLeft: () => move(frame - 1), ArrowRight: () => move(frame + 1),
  "Shift+ArrowLeft": () => move(frame - 10), "Shift+ArrowRight": () => move(frame + 10),
  PageUp: () => move(frame - 10), PageDown: () => move(frame + 10),
  Home: () => move(0), End: () => move(scene.frames - 1),
  g: () => { byId("frame").focus(); byId("frame").select(); },
  f: nextFailure, c: () => hold(true),
  b: () => toggleLayer("boxes"), k: () => toggleLayer("masks"), n: () => toggleLayer("contours"), p: () => toggleLayer("particles"), h: nextMap,
  o: flipTrace, e: () => flip("curve", "error"), m: () => flip("lens", "1"),
  s: save, l: copyLink, "?": help,
};
// Keys work wherever the focus is: after a click on an element without focus no element has the focus.
addEventListener("pointerdown", () => { pointed = true; }, true);
addEventListener("keydown", (event) => {
  pointed = false;
  const letter = event.key.length === 1 ? event.key.toLowerCase() : event.key;  // also with Caps Lock
  if (!dialog.open || event.ctrlKey || event.metaKey || event.altKey) return;
  const { target } = event;
  if (event.key === "Escape" && !byId("help").hidden) {
    event.preventDefault();
    help();
    return;
  }
  if (target === byId("frame")) {
    if (!/^(Enter|Escape)$/.test(event.key)) return;
    event.preventDefault();  // Escape leaves the field and keeps the player open
    if (event.key === "Enter") move(target.value || frame);
    else target.value = frame;
    byId("curve").focus();
    return;
  }
  if (target.matches("select, summary") || (event.key === " " && target.matches("button"))) return;
  const act = KEYS[(event.shiftKey && event.key.startsWith("Arrow") ? "Shift+" : "") + event.key] || KEYS[letter];
  const tracker = /^[1-9]$/.test(event.key) ? trackersHere()[event.key - 1] : undefined;
  if (!act && tracker === undefined) return;
  event.preventDefault();
  if (playing && act !== play && /Arrow|Page|Home|End|^[fg]$/.test(letter)) stop();
  if (act) act();
  else toggle(tracker);
});
addEventListener("keyup", (event) => { if (event.key.toLowerCase() === "c") hold(false); });
byId("hold").addEventListener("pointerdown", (event) => { byId("hold").setPointerCapture(event.pointerId); hold(true); });
for (const kind of ["pointerup", "pointercancel"]) byId("hold").addEventListener(kind, () => hold(false));
byId("hold").addEventListener("contextmenu", (event) => event.preventDefault());  // a long press opens no menu
addEventListener("blur", () => { if (held) hold(false); });
dialog.addEventListener("click", (event) => {
  const button = event.target.closest("button");
  if (button?.dataset.key) KEYS[button.dataset.key]();
  if (button && event.detail) button.blur();  // after a click the space key plays
});
dialog.addEventListener("close", () => {
  stop();
  if (sceneNumber() >= 0) leave();
});
byId("close").addEventListener("click", () => dialog.close());
byId("frame").addEventListener("change", (event) => move(event.target.value || frame));
for (const select of dialog.querySelectorAll("select")) select.addEventListener("change", () => {
  const { name, value } = select;
  if (name) choose({ [name]: value === select.dataset.none ? null : value, ...(name === "sequence" && { frame: null }) });
  if (pointed) select.blur();  // after a selection by keys the menu keeps the focus
});

byId("curve").addEventListener("pointerdown", (event) => byId("curve").setPointerCapture(event.pointerId));
for (const kind of ["pointerdown", "pointermove"]) byId("curve").addEventListener(kind, (event) => {
  if (!(event.buttons & 1)) return;
  const seen = byId("curve").getBoundingClientRect();
  stop();
  move((event.clientX - seen.left - PLOT.left) / (seen.width - PLOT.left - PLOT.right) * (scene.frames - 1));
});
for (const kind of ["pointerdown", "pointermove"]) screen.addEventListener(kind, (event) => {
  const seen = screen.getBoundingClientRect();
  pointer = [(event.clientX - seen.left) * screen.width / seen.width, (event.clientY - seen.top) * screen.height / seen.height];
  if (scene && state.has("lens")) repaint();
});
screen.addEventListener("pointerleave", (event) => {
  if (event.pointerType !== "mouse") return;  // a lifted finger leaves the magnifier in its place
  pointer = null;
  if (scene) repaint();
});
const redrawn = () => { if (dialog.open && scene) { drawCurve(); repaint(); } };
addEventListener("resize", redrawn);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawn);
readAddress();
