"use strict";
// The player: it shows what the page address selects; controls and keys change the address.
const AHEAD = 10;  // frames that are decoded in advance
const TEXT_INTERVAL = 150;  // shortest time between updates of texts during playback [ms]

const WORST_ONLY = "This page has only the worst frames, those with a line below the curve.";

const dialog = byId("player");
const openedSequences = new Map();
let sequence = null, frame = 0, playing = 0, held = false, pointer = null;
let textAt = 0;
let pointed = false;  // true if the last input was by pointer, false if by key
let painted = null, paintedMap = null, paintedFrame = -1;  // image, map and number of the frame on the screen

const repetition = () => Number(state.get("repetition") || 0);
const start = () => Number(state.get("start") || 0);
const focus = () => data.labels.indexOf(state.get("tracker"));
const alone = () => (state.has("alone") ? Number(state.get("alone")) : -1);  // the only tracker that is shown
const trackersHere = () => [...new Set(sequence.runs.map((run) => run.tracker))].sort((a, b) => a - b);
/** Return the trackers that are not hidden, also while only one of them is shown. */
function selectedTrackers() {
  const here = trackersHere(), selected = state.get("show");
  let shown = selected === null ? here.slice(0, 9) : selected.split(".").map(Number).filter((tracker) => here.includes(tracker));
  if (selected === null && here.includes(focus()) && !shown.includes(focus())) shown = [...shown, focus()];
  return shown;
}
const shownTrackers = () => (trackersHere().includes(alone()) ? [alone()] : selectedTrackers());
const rowOf = (run) => (state.get("trajectory") === "revised" && run.revised !== null ? run.revised : run.row);
function otherRun() {
  return state.has("other") ? sequence.runs.find((run) => nameOf(run) === state.get("other")) : undefined;
}
const nameOf = (run) => [run.tracker, run.repetition, ...(run.start ? [run.start] : [])].join(".");
const shownRuns = () => shownTrackers().map((tracker) => sequence.run(tracker, repetition(), start()));
/** Return the runs to draw; only the other run while `c` is pressed. */
const drawnRuns = () => (held && otherRun() ? [otherRun()] : shownRuns());

// ---- Display of a frame.
/** Return the run whose map is shown: of the selected tracker, else of the first one with this map. */
function mapRun() {
  const runs = drawnRuns().filter((run) => run.maps.includes(state.get("map")));
  return runs.find((one) => one.tracker === focus()) || runs[0];
}
function mapReader() {
  const run = mapRun();
  return run && sequence.readers[`map${run.number}.${run.maps.indexOf(state.get("map"))}`];
}
const mapNames = () => [...new Set(sequence.runs.flatMap((run) => run.maps))];

/** Show a frame; the promise resolves when the frame is drawn. */
async function seek(number) {
  const before = frame;
  frame = Math.max(0, Math.min(sequence.n_frames - 1, Math.round(number) || 0));
  const wanted = frame, here = sequence, seen = () => wanted === frame && here === sequence;
  const { full, thumbnails } = here.readers;
  showFrameNumber();
  let image = null, map = null;
  const weighed = mapReader();
  const small = thumbnails && thumbnails.get(wanted), large = full && full.get(wanted);
  try {
    const ready = large instanceof ImageBitmap ? large : small;
    image = ready ? await ready : null;
    map = weighed ? await weighed.get(wanted) : null;
  } catch (error) { showError(error); }
  if (!seen()) return;
  repaint(image, map);
  if (here.frame_numbers && (!image || byId("message").textContent === WORST_ONLY)) showMessage(image ? "" : WORST_ONLY);
  const better = image === large ? null : large?.then((it) => { if (seen()) repaint(it); });
  Promise.resolve(better).catch(showError).then(() => {
    for (const reader of [thumbnails, full, weighed]) if (reader) prepare(reader, wanted, wanted < before ? -1 : 1, seen).catch(() => {});
  });
}
/** Decode the next frames one by one: parallel decoding would delay the frame that is shown. */
async function prepare(reader, from, step, needed) {
  for (let next = from + step; Math.abs(next - from) <= AHEAD && next >= 0 && next < sequence.n_frames && needed(); next += step) await reader.get(next);
}
function repaint(image = painted, map = paintedMap) {
  painted = image;
  paintedMap = map;
  paintedFrame = frame;
  paint(image, map);
}
const showError = (error) => { byId("message").textContent = error.message; };

function showFrameNumber() {
  byId("frame").value = frame;
  byId("frame-text").textContent = `frame ${frame} of ${sequence.n_frames - 1}`;
  for (const [name, value] of [["valuenow", frame], ["valuetext", byId("frame-text").textContent]]) byId("curve").setAttribute(`aria-${name}`, value);
  byId("cursor").style.left = `calc(${PLOT.left}px + ${alongCurve(frame)} * (100% - ${PLOT.left + PLOT.right}px))`;
  if (playing && performance.now() - textAt < TEXT_INTERVAL) return;  // each update of a text costs a layout
  textAt = performance.now();
  markStrip();
  showNumbers();
}

function nameIn(run) {
  const other = run.repetition === repetition() ? "" : ` (repetition ${run.repetition})`;
  return data.trackers[run.tracker] + other + (run.failure ? " (failed)" : "");
}
/** Return overlap, centre error and a warning if the centre is outside the ground-truth box. */
function scoresIn(run) {
  const { error, overlap, outside } = sequence.curve(rowOf(run));
  if (Number.isNaN(overlap[frame])) return [];
  const missing = Number.isNaN(error[frame]);
  const parts = [make("b", {}, overlap[frame].toFixed(2)), ` ${missing ? "no box" : `${error[frame].toFixed(1)} px`}`];
  return outside[frame] && !missing ? [...parts, " ", make("em", {}, "off target")] : parts;
}

function numbersIn(run) {
  return Object.entries(run.numbers).filter(([, values]) => values[frame] !== null).map(([name, values]) => `${name} ${withMinus(values[frame])}`).join(" · ");
}

/** Update scores and numbers of the trackers in the frame. */
function showNumbers() {
  const drawn = drawnRuns();
  for (const button of trackerButtons()) {
    const run = drawn.find((one) => one.tracker === button.tracker);
    button.label.textContent = nameIn(run || sequence.run(button.tracker, repetition(), start()));
    button.lastChild.replaceChildren(...(run ? scoresIn(run) : ["hidden"]));
  }
  const weighing = mapRun();
  byId("map-tracker").textContent = weighing ? `of ${data.trackers[weighing.tracker]}` : "";
  const telling = drawn.filter((run) => run.numbers);
  byId("values").textContent = telling.map((run) => [data.trackers[run.tracker], numbersIn(run)]).filter(([, text]) => text).map((both) => both.join(": ")).join("\n");
  byId("values").style.minHeight = `${byId("values").offsetHeight}px`;  // the height never shrinks, so that the frame keeps its size
}

function options(select, entries, chosen) {
  select.replaceChildren(...entries.map(([value, text]) => { const one = make("option", { value }); one.textContent = text; return one; }));
  select.value = chosen;
  if (select.selectedIndex < 0) select.value = "";  // an unknown value selects the empty option
}

/** Make a button per tracker, which shows only this tracker, or shows or hides it. */
function makeLegend() {
  const truth = make("button", { type: "button", disabled: "", title: "ground-truth box" }, "- - truth");
  byId("legend").replaceChildren(truth, ...trackersHere().map((tracker, position) => {
    const name = make("span"), attributes = { type: "button", class: `c${Math.min(tracker, 6)}` };
    const hint = `Click or a: show only this tracker; ${position < 9 ? `${position + 1} or ` : ""}Shift and click: show or hide it`;
    const button = Object.assign(make("button", attributes, sampleOf(tracker), name, make("span", { class: "scores" })), { tracker, label: name, hint });
    button.addEventListener("click", (event) => (event.shiftKey ? toggle : showAlone)(tracker));
    button.addEventListener("contextmenu", (event) => { event.preventDefault(); toggle(tracker); });  // a long press, too
    return button;
  }));
}
const trackerButtons = () => [...byId("legend").children].slice(1);

/** Update all controls from the page address. */
function arrange() {
  options(byId("sequence"), data.sequences.map((one) => [one.name, one.title]), sequence.name);
  const repetitions = [...new Set(sequence.runs.map((run) => run.repetition))].sort((a, b) => a - b);
  byId("repetitions").hidden = repetitions.length < 2;
  options(byId("repetition"), repetitions.map((one) => [one, one]), repetition());
  const segments = sequence.runs.filter((run) => run.start_label), own = segments.filter((run) => run.tracker === focus());
  const labels = new Map((own.length ? own : segments).map((run) => [run.start, run.start_label]));
  byId("starts").hidden = !labels.size;
  options(byId("start"), [...labels].sort((a, b) => a[0] - b[0]), start());
  byId("trajectories").hidden = sequence.runs.every((run) => run.revised === null);
  byId("trajectory").value = state.get("trajectory") || "online";
  options(byId("other"), [["", "another run"], ...sequence.runs.map((run) => [nameOf(run), `${data.trackers[run.tracker]}, repetition ${run.repetition}${run.start_label && `, start ${run.start_label}`}`])], state.get("other") || "");
  byId("frame").max = sequence.n_frames - 1;
  byId("curve").setAttribute("aria-valuemax", sequence.n_frames - 1);
  byId("lens").setAttribute("aria-pressed", state.has("lens"));
  byId("values").style.minHeight = `${1.5 * drawnRuns().filter((run) => run.numbers).length}em`;
  const shown = shownTrackers();
  for (const button of trackerButtons()) {
    button.classList.toggle("off", !shown.includes(button.tracker));
    button.setAttribute("aria-pressed", button.tracker === alone());
    button.title = sequence.run(button.tracker, repetition(), start()).failure || button.hint;
    const isFocus = button.tracker === focus();
    if (isFocus && !button.label.classList.contains("focus")) requestAnimationFrame(() => button.scrollIntoView({ block: "nearest" }));
    button.label.classList.toggle("focus", isFocus);
  }
  arrangeLayers();
  screen.classList.toggle("lens", state.has("lens"));
  showMessage([notice, statusText()].filter(Boolean).join(" "));
  notice = "";
  drawCurve();
  drawStrip().catch(showError);
}

/** Return messages on selected items that do not exist, and on failed runs. */
function statusText() {
  const own = sequence.runs.filter((run) => run.tracker === focus());
  const exists = {
    tracker: own.length, repetition: sequence.runs.some((run) => run.repetition === repetition()), start: sequence.runs.some((run) => run.start === start()),
    frame: state.get("frame") >= 0 && state.get("frame") < sequence.n_frames, other: otherRun(), map: mapNames().includes(state.get("map")), show: state.get("show") === "none" || shownTrackers().length, alone: trackersHere().includes(alone()),
  };
  const messages = Object.keys(exists).filter((key) => state.has(key) && !exists[key]).map((key) => `This sequence has no ${NOUNS[key] || key} ${state.get(key)}.`);
  if (sequence.reason) messages.push(sequence.reason);
  const runs = new Set([...(own.length ? [sequence.run(focus(), repetition(), start())] : []), ...shownRuns()]);
  for (const run of runs) if (run.failure) messages.push(`${data.trackers[run.tracker]}, repetition ${run.repetition}, failed: ${run.failure}`);
  return messages.join(" ");
}
const NOUNS = { other: "run", show: "tracker", alone: "tracker" };

/** Update the menu of layers, maps and other runs. */
function arrangeLayers() {
  const layers = shownLayers(), names = mapNames();
  for (const button of byId("layers").querySelectorAll("button")) {
    button.hidden = !sequence.layers.has(button.dataset.layer);
    button.setAttribute("aria-pressed", layers.has(button.dataset.layer));
  }
  byId("map").parentNode.hidden = !names.length;
  options(byId("map"), [["", "none"], ...names.map((name) => [name, name])], state.get("map") || "");
  byId("layers").hidden = sequence.layers.size < 2 && !names.length;
  byId("other-run").hidden = sequence.runs.length < 2;
  byId("menu").hidden = byId("layers").hidden && byId("other-run").hidden;
}
function toggleLayer(layer) {
  if (!sequence.layers.has(layer)) { showMessage(`There are no ${layer}.`); return; }
  const shown = shownLayers();
  choose({ hide: LAYERS.filter((one) => shown.has(one) === (one === layer)).join(".") });
}
function nextMap() {
  const names = ["", ...mapNames()];
  if (names.length === 1) { showMessage("There are no maps."); return; }
  choose({ map: names[(names.indexOf(state.get("map") || "") + 1) % names.length] });
}

function toggle(tracker) {
  const shown = shownTrackers();
  choose({ alone: null, show: (shown.includes(tracker) ? shown.filter((one) => one !== tracker) : [...shown, tracker]).sort((a, b) => a - b).join(".") || "none" });
}

let notice = "";  // message for the next update of the controls
/** Show only a tracker; if it is already alone, show the trackers as before. */
function showAlone(tracker) {
  const again = tracker === alone();
  notice = again ? "The trackers are shown as before." : `Only ${data.trackers[tracker]} is shown.`;
  choose({ alone: again ? null : tracker });
}
/** Return the tracker whose button has the focus, else the one that is alone, the selected one, or the first. */
const trackerAtHand = () => document.activeElement.tracker ?? [alone(), focus(), shownTrackers()[0]].find((one) => trackersHere().includes(one)) ?? trackersHere()[0];

// ---- Reaction to a changed page address.
let drawnFor = "";
const leave = () => choose({ sequence: null, tracker: null, repetition: null, start: null, frame: null }, true);
const sequenceIndex = () => data.sequences.findIndex((one) => one.name === state.get("sequence"));
function openSequence(number, first) {
  if (!openedSequences.has(number)) {
    const made = new PlayerSequence(number);
    made.readers.thumbnails?.get(Number(first ?? made.first))?.catch?.(() => {});  // decoded while boxes are unpacked
    openedSequences.set(number, made.open());
  }
  return openedSequences.get(number);
}
async function follow() {
  const name = state.get("sequence");
  const number = sequenceIndex();
  byId("missing").textContent = name === null || number >= 0 ? "" : `There is no sequence ${name} on this page.`;
  if (number < 0) {
    if (dialog.open) dialog.close();
    stop();
    return;
  }
  const opened = await openSequence(number, state.get("frame"));
  if (state.get("sequence") !== name) return;
  if (!dialog.open) { dialog.showModal(); byId("curve").focus(); }
  const around = new URLSearchParams(state);
  around.delete("frame");
  const moved = Number(state.get("frame") ?? opened.first);
  if (sequence !== opened) {
    sequence = opened;
    painted = null;
    paintedFrame = -1;
    screen.width = Math.max(960, Math.min(1280, sequence.size[0]));
    screen.height = Math.round(screen.width * sequence.size[1] / sequence.size[0]);
    screen.style.setProperty("--shape", sequence.size[0] / sequence.size[1]);
    makeLegend();
  }
  if (`${around}` !== drawnFor) { drawnFor = `${around}`; arrange(); }
  else if (!(moved >= 0 && moved < sequence.n_frames)) showMessage(statusText());
  await seek(moved);
}
listeners.push(() => { follow().catch(showError); });

// ---- Playback and jumps.
const move = (number) => choose({ frame: Math.max(0, Math.min(sequence.n_frames - 1, Math.round(number) || 0)) });
const showMessage = (text) => { byId("message").textContent = text; };

function play() {
  if (playing) { stop(); return; }
  if (frame >= sequence.n_frames - 1) move(0);
  const each = 1000 / (sequence.fps || 30) / byId("speed").value;
  let due = performance.now() + each, busy = false;
  const tick = async (now) => {
    if (!playing) return;
    playing = requestAnimationFrame(tick);
    if (now < due || busy) return;
    due = Math.max(due + each, now - each);  // slow decoding delays playback but skips no frame
    if (frame >= sequence.n_frames - 1) { stop(); return; }
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
function endOf(run) {
  let end = sequence.n_frames;
  while (end && !sequence.box(rowOf(run), end - 1)) end -= 1;
  return end;
}
/** Return frame, run and description of each loss, restart and failed end of the visible trackers. */
function events() {
  const events = [];
  for (const run of drawnRuns()) {
    const row = rowOf(run), { outside } = sequence.curve(row);
    const end = run.failure && !run.start_label ? endOf(run) : sequence.n_frames;
    for (let i = 1; i < end; i++) if (outside[i] && !outside[i - 1]) events.push([i, run, "leaves the ground-truth box"]);
    for (const mark of run.restarts) events.push([mark, run, "is restarted"]);
    if (end < sequence.n_frames) events.push([end, run, "fails"]);
  }
  return events.sort((a, b) => a[0] - b[0]);
}
function nextLoss() {
  if (!drawnRuns().length) { showMessage("No tracker is shown."); return; }
  const all = events(), [next] = all.find(([i]) => i > frame) || all[0] || [];
  if (next === undefined) { showMessage("No shown tracker leaves the ground-truth box."); return; }
  const here = all.filter(([i]) => i === next);
  const reasons = here.filter(([, , what]) => what === "fails").map(([, run]) => ` Its run failed: ${run.failure}`).join("");
  move(next);
  showMessage(`${here.map(([, run, what]) => `${data.trackers[run.tracker]} ${what}`).join("; ")} at frame ${next}.${reasons}`);
}

function hold(on) {
  if (held === on) return;
  if (on && !otherRun()) { showMessage("Select another run next to this button first."); return; }
  held = on;
  if (on) showMessage(`${data.trackers[otherRun().tracker]}, repetition ${otherRun().repetition}`);
  else showMessage(statusText());
  byId("hold").setAttribute("aria-pressed", on);
  drawCurve();
  showNumbers();
  repaint();
  if (state.has("map")) seek(frame);  // the other run has its own map
}

function save() {
  const file = `${sequence.title.replace(/[^\p{L}\p{N}.-]+/gu, "-")}-${String(frame).padStart(5, "0")}.png`;
  make("a", { href: screen.toDataURL("image/png"), download: file }).click();
}
async function copyLink() {
  writeAddress();
  await copy(location.href);
  showMessage("The link is copied.");
}
function help() {
  byId("help").hidden = !byId("help").hidden;
  byId("help-button").setAttribute("aria-expanded", !byId("help").hidden);
}
const flip = (key, value, without = null) => choose({ [key]: state.get(key) === value ? without : value });

function flipTrajectory() {
  if (sequence.runs.every((run) => run.revised === null)) showMessage("No run on this sequence has revised boxes.");
  else flip("trajectory", "revised");
}

const KEYS = {
  " ": play, ArrowLeft: () => move(frame - 1), ArrowRight: () => move(frame + 1),
  "Shift+ArrowLeft": () => move(frame - 10), "Shift+ArrowRight": () => move(frame + 10),
  PageUp: () => move(frame - 10), PageDown: () => move(frame + 10),
  Home: () => move(0), End: () => move(sequence.n_frames - 1),
  g: () => { byId("frame").focus(); byId("frame").select(); },
  f: nextLoss, a: () => showAlone(trackerAtHand()), c: () => hold(true),
  b: () => toggleLayer("boxes"), k: () => toggleLayer("masks"), n: () => toggleLayer("contours"), p: () => toggleLayer("particles"), h: nextMap,
  o: flipTrajectory, e: () => flip("curve", "error"), m: () => flip("lens", "1"),
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
  if (sequenceIndex() >= 0) leave();
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
  move((event.clientX - seen.left - PLOT.left) / (seen.width - PLOT.left - PLOT.right) * (sequence.n_frames - 1));
});
for (const kind of ["pointerdown", "pointermove"]) screen.addEventListener(kind, (event) => {
  const seen = screen.getBoundingClientRect();
  pointer = [(event.clientX - seen.left) * screen.width / seen.width, (event.clientY - seen.top) * screen.height / seen.height];
  if (sequence && state.has("lens")) repaint();
});
screen.addEventListener("pointerleave", (event) => {
  if (event.pointerType !== "mouse") return;  // a lifted finger leaves the magnifier in its place
  pointer = null;
  if (sequence) repaint();
});
const redrawn = () => { if (dialog.open && sequence) { drawCurve(); repaint(); } };
addEventListener("resize", redrawn);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redrawn);
readAddress();
