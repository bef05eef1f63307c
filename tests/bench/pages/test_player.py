"""The player of a page, driven in a browser."""

import json
import re
import shutil
from urllib.parse import urlencode

import cv2
import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import (
    address_of,
    canonical_name,
    data_of,
    failing_tracker,
    frames_in,
    open_frame,
    state,
    stored_runs,
    write_experiment_page,
)
from trackmark import datasets
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.metrics.boxes import centre_error, centre_inside, overlap
from trackmark.bench.pages import page as pages

pytestmark = browser.needs_browser

FIRST = "plain/target:length=60:scene=0"
NOISY = "plain/target:length=60:scene=9:noise=30"
PIXELS = "screen.toDataURL()"
MESSAGE = "byId('message').textContent"


def test_number_and_copied_link_open_worst_frame(opened_page):
    link = opened_page.run("document.querySelector('#heat tbody tr:nth-child(3) a').hash")
    href = address_of(link, opened_page.run("data"))
    opened_page.click("#heat tbody tr:nth-child(3) a")
    opened_page.wait("byId('player').open && paintedFrame >= 0")
    address = dict(opened_page.run(f"[...new URLSearchParams({json.dumps(href)}.slice(1))]"))
    assert state(opened_page) == address
    for key in ("2", "e", "m", "ArrowLeft"):
        opened_page.key(key)
    opened_page.run("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    opened_page.key("l")
    link = opened_page.wait("window.copied")
    before = state(opened_page)
    changes = {"show": "0.2", "curve": "error", "lens": "1"}
    assert before == address | {"frame": str(int(address["frame"]) - 1)} | changes
    opened_page.open(link)
    opened_page.wait("byId('player').open && paintedFrame >= 0")
    assert state(opened_page) == before
    assert opened_page.run("frame") == int(before["frame"])
    opened_page.key("Escape")
    opened_page.wait("!byId('player').open && !location.hash.includes('sequence')")


def test_boxes_are_drawn_at_their_places(opened_page, results):
    stored = {row["tracker"]: (row, run, truth) for row, run, truth in stored_runs(results)}
    row, run, truth = stored["camshift"]
    tracker = opened_page.run("data.labels.indexOf('camshift')")
    repetition = row["repetition"]
    open_frame(
        opened_page, sequence=row["sequence"], tracker="camshift", repetition=repetition, frame=30
    )
    got = opened_page.run(f"sequence.box(sequence.run({tracker}, {repetition}).row, 30)")
    assert got == pytest.approx(run.boxes[30], abs=0.0501)
    assert opened_page.run("sequence.box(0, 30)") == pytest.approx(truth.boxes[30], abs=0.0501)
    # The right edge of the ground truth, in the middle, is white or black: its dashes.
    opened_page.run("choose({show: 'none'})")
    opened_page.wait("byId('legend').querySelectorAll('.off').length === 3")
    x, y, width, height = truth.boxes[30]
    scale = opened_page.run("screen.width / sequence.size[0]")
    pixels = opened_page.run(
        f"[...pen.getImageData({(x + width) * scale - 1}, {y * scale}, 2, {height * scale}).data]"
    )
    colours = np.reshape(pixels, (-1, 4))[:, :3]
    assert (colours.max(axis=1) < 90).any()
    assert (colours.min(axis=1) > 200).any()


def test_keys_move_by_frames_and_to_failures(opened_page, results):
    name = canonical_name(NOISY)
    open_frame(
        opened_page, sequence=name, tracker=opened_page.run("data.labels[0]"), repetition=1, frame=5
    )
    for key, shift, frame in (
        ("ArrowRight", False, 6), ("ArrowRight", True, 16), ("ArrowLeft", False, 15),
        ("ArrowLeft", True, 5), ("End", False, 59), ("ArrowRight", False, 59), ("Home", False, 0),
    ):  # fmt: skip
        opened_page.key(key, shift=shift)
        assert opened_page.run("frame") == frame, key
    boxes, truth = {}, None
    for row, run, stored in stored_runs(results, sequence=name):
        if row["repetition"] == 1 or row["tracker"] not in boxes:
            boxes[row["tracker"]], truth = run.boxes, stored.boxes
    out = [~centre_inside(truth, its) for its in boxes.values()]
    leaving = sorted({int(f) for entry in out for f in np.flatnonzero(entry[1:] & ~entry[:-1]) + 1})
    for frame in [*leaving, leaving[0]]:
        opened_page.key("f")
        assert opened_page.run("frame") == frame
    for keys, frame in (("4Escape", opened_page.run("frame")), ("42Enter", 42)):
        opened_page.key("g")
        opened_page.run("byId('frame').select()")
        for key in re.findall(r"\d|[A-Z]\w+", keys):
            opened_page.key(key)
        assert opened_page.run("[byId('frame').value, frame]") == [str(frame), frame]
        assert opened_page.run("document.activeElement === byId('curve')")
        assert not opened_page.run("state.has('show')")  # no digit hid a tracker
    opened_page.key("?")
    opened_page.key("Escape")
    assert opened_page.run("byId('player').open && byId('help').hidden")


CONTROLS = ["#play", "#curve", "#screen", "#link", "#legend button:nth-child(2)", "#repetition"]


def test_keys_work_after_a_click_on_any_control(opened_page):
    open_frame(opened_page, sequence=canonical_name(NOISY), frame=5)
    opened_page.run("navigator.clipboard.writeText = async () => {}; save = () => {}; 0")
    for control in CONTROLS:
        opened_page.click(control)
        if control == "#repetition":  # a menu, which is a window of its own
            opened_page.run("byId('repetition').value = 1")
            opened_page.run("byId('repetition').dispatchEvent(new Event('change'))")
            assert opened_page.run("repetition()") == 1
        opened_page.run("stop(); move(20)")
        opened_page.key("ArrowRight")
        assert opened_page.run("frame") == 21, control
        opened_page.key(" ")
        assert opened_page.run("!!playing"), control
        opened_page.key(" ")
        assert not opened_page.run("playing"), control


def test_keyboard_keeps_the_focus_and_does_one_thing_at_a_time(opened_page):
    open_frame(opened_page, sequence=canonical_name(NOISY), frame=5)
    where = "document.activeElement.id || document.activeElement.dataset.key"
    visited = [opened_page.run(where)]
    assert visited == ["curve"]
    while visited[-1] != "lens":
        opened_page.key("Tab")
        visited.append(opened_page.run(where))
        assert opened_page.run("document.activeElement.matches(':focus-visible')")
    assert {"play", "frame", "speed"} <= {*visited}
    opened_page.key(" ")
    assert state(opened_page)["lens"] == "1"
    assert not opened_page.run("playing")
    assert opened_page.run(where) == "lens"
    opened_page.run("byId('legend').children[2].focus()")
    opened_page.key(" ")
    assert opened_page.run("[...byId('legend').children].indexOf(document.activeElement)") == 2


def test_one_tracker_is_shown_alone_by_click_and_key(opened_page):
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=5)
    drawn, all_boxes = "drawnRuns().map((run) => run.tracker)", opened_page.run(PIXELS)
    pressed = "trackerButtons().map((button) => button.ariaPressed).join(' ')"
    name = opened_page.run("data.trackers[1]")
    for act, back in (
        (lambda: opened_page.click("#legend button:nth-child(3)"),) * 2,
        (lambda: opened_page.key("Enter"), lambda: opened_page.key("a")),
    ):
        act()
        opened_page.wait(f"{pressed} === 'false true false' && {PIXELS} !== {all_boxes!r}")
        assert opened_page.run(drawn) == [1]
        assert opened_page.run(MESSAGE) == f"Only {name} is shown."
        assert opened_page.run("trackerButtons()[0].lastChild.textContent") == "hidden"
        assert state(opened_page)["alone"] == "1"
        back()
        opened_page.wait(f"{pressed} === 'false false false' && {PIXELS} === {all_boxes!r}")
        assert opened_page.run(MESSAGE) == "The trackers are shown as before."
        opened_page.run("byId('legend').children[2].focus()")
    opened_page.run("document.activeElement.blur()")
    for expected in ("1", "0,1,2", "0"):  # the selected tracker, or the one that is alone
        if expected == "1":
            opened_page.run("choose({tracker: data.labels[1]})")
        elif expected == "0":
            opened_page.run("choose({tracker: null})")
        opened_page.key("a")
        opened_page.wait(f"{drawn}.join() === '{expected}'")
    opened_page.key("3")  # shows another one as well
    opened_page.wait(f"{drawn}.join() === '0,2'")
    opened_page.run("byId('legend').children[1].focus()")
    opened_page.key("Enter", shift=True)  # hides it, as a key does for the first nine trackers
    opened_page.wait(f"{drawn}.join() === '2'")
    assert "; 1 or Shift and click: show or hide it" in opened_page.run(
        "document.activeElement.title"
    )
    assert opened_page.run("byId('help').textContent.includes('show only the selected tracker')")


def drifting_index(opened_page):
    """Return the index of the stochastic tracker, which also revises boxes."""
    return opened_page.run("data.labels.findIndex((label) => label.includes('Drifting'))")


def test_player_plays_scrubs_holds_enlarges_and_saves(opened_page, results):
    name, index = canonical_name(FIRST), drifting_index(opened_page)
    tracker = opened_page.run(f"data.labels[{index}]")
    open_frame(opened_page, sequence=name, tracker=tracker, repetition=0, frame=0)
    opened_page.run(
        "window.visited = [];"
        "{ const before = seek; seek = (f) => { visited.push(f); return before(f); }; }"
    )
    opened_page.key(" ")
    opened_page.wait("visited.length >= 12")
    opened_page.key(" ")
    assert opened_page.run("visited")[:12] == list(range(1, 13))  # no frame is skipped
    place = "(({{x, y, width}}) => [x, y, width])(byId('{}').getBoundingClientRect())"
    x, y, width = opened_page.run(place.format("curve"))
    left, right = opened_page.run("[PLOT.left, PLOT.right]")
    position = {"x": x + left + 33 / 59 * (width - left - right), "y": y + 30}
    mouse = {"button": "left", "buttons": 1, "clickCount": 1, **position}
    for kind in ("mousePressed", "mouseReleased"):
        opened_page.call("Input.dispatchMouseEvent", type=kind, **mouse)
    opened_page.wait("paintedFrame === 33")
    assert opened_page.run("byId('curve').ariaValueNow") == "33"
    x, _, width = opened_page.run(place.format("cursor"))
    assert x + width / 2 == pytest.approx(position["x"], abs=0.6)
    plain, entry = opened_page.run(PIXELS), f"byId('legend').children[{index + 1}].textContent"
    opened_page.run(f"choose({{other: '{index}.1', show: '{index}'}})")
    numbers = []
    for held in (False, True):
        if held:
            opened_page.key("c", held=True)
            assert opened_page.run("drawnRuns().map(run => run.repetition)") == [1]
            assert "(repetition 1)" in opened_page.run(entry)
        numbers.append(
            re.findall(r"[\d.]+", opened_page.run(entry.replace("]", "].lastChild")))[-2:]
        )
    opened_page.release("c")
    for row, run, truth in stored_runs(results, sequence=name):
        if row["tracker"] == tracker and row["repetition"] < 2:
            near, error = map(float, numbers[row["repetition"]])
            assert near == pytest.approx(overlap(truth.boxes[33:34], run.boxes[33:34])[0], abs=0.01)
            expected = centre_error(truth.boxes[33:34], run.boxes[33:34])[0]
            assert error == pytest.approx(expected, abs=0.15)
    opened_page.run("choose({show: null})")
    assert opened_page.run(PIXELS) == plain
    opened_page.key("m")
    opened_page.wait(f"{PIXELS} !== {json.dumps(plain)}")  # without a pointer, at the target
    opened_page.run(
        "HTMLAnchorElement.prototype.click = function () {"
        " window.saved = [this.href, this.download]; }"
    )
    opened_page.key("s")
    url, file = opened_page.wait("window.saved")
    size = opened_page.run(
        f"fetch({url!r}).then(r => r.blob()).then(createImageBitmap).then(i => [i.width, i.height])"
    )
    assert size == opened_page.run("[screen.width, screen.height]")
    assert file == re.sub(r"[^\w.-]+", "-", name) + "-00033.png"


def test_player_switches_to_revised_boxes(opened_page, results):
    name, index = canonical_name(FIRST), drifting_index(opened_page)
    tracker = opened_page.run(f"data.labels[{index}]")
    open_frame(opened_page, sequence=name, tracker=tracker, repetition=0, frame=3)
    online = opened_page.run("drawnRuns().map(rowOf)")
    opened_page.key("o")
    assert state(opened_page)["trajectory"] == "revised"
    revised = opened_page.run("drawnRuns().map(rowOf)")
    # One of the trackers revises.
    assert revised == [row + (position == index) for position, row in enumerate(online)]
    (run, *_) = (
        run for row, run, _ in stored_runs(results, sequence=name) if row["tracker"] == tracker
    )
    rows = opened_page.run(
        f"[{online[index]}, {revised[index]}].map((row) => sequence.box(row, 3)[0])"
    )
    assert rows == pytest.approx([run.boxes[3, 0], run.revised[3, 0]], abs=0.051)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "height"), [(1920, 1080), (390, 844), (844, 390)])
def test_frame_keeps_aspect_ratio_and_fills_space(opened_page, width, height):
    opened_page.size(width, height, mobile=width < 900)
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=3)
    rect = "(({width, height}) => [width, height])(screen.getBoundingClientRect())"
    wide, tall = opened_page.run(rect)
    shape = opened_page.run("sequence.size[0] / sequence.size[1]")
    assert wide / tall == pytest.approx(shape, rel=0.005)
    assert wide > {1920: 900, 390: 360}.get(width, 300)
    assert opened_page.run("dialog.scrollHeight <= dialog.clientHeight")
    assert opened_page.run("dialog.scrollWidth") <= width
    if height > 600:  # else controls scroll beside the frame
        bottom = "(one) => one.getBoundingClientRect().bottom"
        assert (
            max(opened_page.run(f"[...dialog.querySelectorAll('button')].map({bottom})")) <= height
        )


def touch(opened_page, kind, *places):
    opened_page.call("Input.dispatchTouchEvent", type=kind, touchPoints=list(places))


def test_finger_opens_points_holds_a_run_and_moves_the_magnifier(opened_page, page):
    opened_page.size(390, 844, dark=True, mobile=True)
    opened_page.call("Emulation.setTouchEmulationEnabled", enabled=True)
    opened_page.open(page.as_uri())
    assert opened_page.run("document.documentElement.scrollWidth") == 390
    opened_page.point("#success svg")
    middle = (
        "(({{x, y, width, height}}) => ({{x: x + width / 2, y: y + height / 2}}))"
        "(document.querySelector('{}').getBoundingClientRect())"
    )
    touch(opened_page, "touchStart", opened_page.run(middle.format("#success svg")))
    touch(opened_page, "touchEnd")
    opened_page.wait("byId('player').open && paintedFrame >= 0")
    index = drifting_index(opened_page)
    opened_page.run(f"choose({{other: '{index}.1'}}); byId('menu').open = true; 0")
    touch(opened_page, "touchStart", opened_page.run(middle.format("#hold")))
    opened_page.wait("held && drawnRuns().some((run) => run.repetition === 1)")
    touch(opened_page, "touchEnd")
    opened_page.wait("!held")
    opened_page.key("m")
    place = opened_page.run(middle.format("#screen"))
    touch(opened_page, "touchStart", place)
    drawn = opened_page.run(PIXELS)
    touch(opened_page, "touchMove", {"x": place["x"] + 60, "y": place["y"] + 40})
    opened_page.wait(f"{PIXELS} !== {json.dumps(drawn)}")
    moved = opened_page.run(PIXELS)
    touch(opened_page, "touchEnd")
    assert opened_page.run(PIXELS) == moved
    opened_page.call("Emulation.setTouchEmulationEnabled", enabled=False)


def test_link_to_missing_item_shows_message(opened_page):
    for query, message in (
        ({"tracker": "none <b>", "frame": 3}, "This sequence has no tracker none <b>."),
        ({"repetition": 77, "frame": 6000}, "This sequence has no repetition 77. This sequence"),
        ({"frame": "x"}, "This sequence has no frame x."),
        ({"start": 3, "frame": 3}, "This sequence has no start 3."),
        ({"show": "7.x", "frame": 3}, "This sequence has no tracker 7.x."),
        ({"other": "1.9", "frame": 3}, "This sequence has no run 1.9."),
        ({"map": "hue", "frame": 3}, "This sequence has no map hue."),
    ):
        opened_page.run(
            f"location.hash = {json.dumps(urlencode({'sequence': canonical_name(FIRST), **query}))}"
        )
        opened_page.wait(f"{MESSAGE}.startsWith({json.dumps(message)})")
        chosen = "['other', 'map'].map((id) => byId(id).selectedOptions[0].text)"
        assert opened_page.run(chosen) == ["another run", "none"]
    opened_page.run(
        f"location.hash = {json.dumps(urlencode({'sequence': 'gone <b>', 'frame': 3}))}"
    )
    words = "There is no sequence gone <b> on this page"
    opened_page.wait(f"byId('missing').textContent.includes('{words}')")
    assert opened_page.run("!dialog.open && byId('missing').role === 'status'")
    assert opened_page.run("state.get('sequence')") == "gone <b>"  # the address keeps the request
    opened_page.call("Emulation.setEmulatedMedia", media="print")
    assert not opened_page.run("byId('missing').checkVisibility()")
    opened_page.call("Emulation.setEmulatedMedia", media="")
    opened_page.run(f"choose({{sequence: {canonical_name(FIRST)!r}}})")
    opened_page.wait("dialog.open && byId('missing').textContent === ''")


def test_page_of_some_frames_marks_these_and_explains_others(opened_page):
    opened_page.run("setLooping(false); openedSequences.clear()")
    opened_page.run("data.sequences[0].frame_numbers = [10, 11, 12, 30]")
    opened_page.run(
        "window.marks = []; CanvasRenderingContext2D.prototype.fillRect = function (x) {"
        " if (this === curvePen && this.fillStyle === accent) marks.push(x); };"
        " window.accent = getComputedStyle(dialog).getPropertyValue('--accent').trim(); 0"
    )
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=11)
    assert opened_page.run(f"painted !== null && !{MESSAGE}")
    left, right = opened_page.run("[PLOT.left, curvePen.canvas.clientWidth - PLOT.right]")
    ends = [left + (number - 0.5) / 59 * (right - left) for number in (10, 11, 12, 30)]
    assert opened_page.run("marks") == [pytest.approx(end) for end in ends]
    opened_page.key("ArrowRight", shift=True)
    opened_page.wait("paintedFrame === 21")
    message = "This page has only the worst frames, those with a line below the curve."
    assert opened_page.run(MESSAGE) == message
    opened_page.run("move(12)")
    opened_page.wait(f"paintedFrame === 12 && !{MESSAGE}")


def test_timeline_marks_success_failure_and_loss(opened_page):
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=3)
    opened_page.run(
        "{ const curve = sequence.curve(sequence.run(0, 0).row);"
        " curve.outside.fill(0); curve.outside.fill(1, 20, 29);"
        " curve.outside.fill(1, 40, 50); } window.lanes = []; window.crosses = 0;"
        " { const fill = curvePen.fillRect, stroke = curvePen.stroke; curvePen.fillRect ="
        " function (x, y, w, h) { lanes.push([y, h, this.globalAlpha]);"
        " fill.call(this, x, y, w, h); };"
        " curvePen.stroke = function (path) { crosses += path !== undefined; stroke.call(this,"
        " ...(path ? [path] : [])); }; } choose({show: '0'}); 0"
    )
    opened_page.wait("lanes.length")
    assert opened_page.run("lostFrame(drawnRuns()[0])") == 40  # nine frames are not enough
    thin = opened_page.run("lanes.filter(([, height]) => height === 1.5).length")
    assert thin == 19
    assert opened_page.run("new Set(lanes.map(([, , alpha]) => alpha)).size") <= 2
    assert opened_page.run("crosses") == 1
    strip = "[...byId('strip').children]"
    opened_page.wait(
        f"{strip}.length === 20 && {strip}.filter((one) => one.className).length === 1"
    )
    opened_page.run(
        "window.texts = []; { const before = curvePen.fillText; curvePen.fillText = function"
        " (...given) { texts.push(given[0]); before.apply(this, given); }; } drawCurve(); 0"
    )
    assert {"0", "0.5", "1", "20", "40", "overlap"} <= {*opened_page.run("texts.splice(0)")}
    opened_page.key("e")
    assert "centre error [px]" in opened_page.wait("texts.length && texts")
    opened_page.run(f"{strip}[10].click()")
    opened_page.wait(f"paintedFrame === {strip}[10].frame && {strip}[10].className === 'on'")


@pytest.mark.slow
def test_frames_beside_the_page_are_loaded_when_needed(chromium, results, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "MAX_INLINE_FRAMES", 0)
    beside = write_experiment_page(results, tmp_path, with_full_frames=True)
    assert len(list((tmp_path / "report-frames").glob("thumbnails-*.js"))) >= 6
    chromium.console.clear()
    chromium.size(1280, 900, still=True)  # loops do not load frames
    chromium.open(beside.as_uri())
    assert chromium.run("document.querySelectorAll('script[src]').length") == 0
    name = canonical_name("plain/target:length=60:scene=1")
    open_frame(chromium, sequence=name, frame=7)
    size = datasets.load(name).image_size
    chromium.wait(f"painted.width === {size[0]}")  # its own size, by --frames
    assert chromium.console == []
    shutil.rmtree(tmp_path / "report-frames")
    chromium.open(beside.as_uri() + "#" + urlencode({"sequence": name, "frame": 7}))
    assert "is not next to this page" in chromium.wait(MESSAGE)


def test_frames_are_kept_in_order_and_small(page):
    text = page.read_text()
    for number, entry in enumerate(data_of(text)["sequences"]):
        sequence = datasets.load(entry["name"])
        assert sum(entry["chunk_lengths"]["thumbnails"]) == len(sequence)
        block = re.search(f'id="thumbnails-{number}-0">(.*?)</script>', text, re.S)[1]
        frames = frames_in(block)
        for frame in (0, 17, 40):
            got = cv2.imdecode(np.frombuffer(frames[frame], np.uint8), 1)
            assert got.shape[0] <= 160
            wanted = cv2.resize(sequence[frame], got.shape[1::-1], interpolation=cv2.INTER_AREA)
            assert np.abs(got.astype(int) - wanted).mean() < 14  # of noise, too


def test_absent_failures_are_stated(opened_page):
    trackers = opened_page.run("data.labels")
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=3)
    opened_page.run("choose({show: 'none'})")
    opened_page.key("f")
    assert opened_page.run("frame") == 3
    assert opened_page.run(MESSAGE) == "No tracker is shown."
    first_curve = "sequence.curve(sequence.run(0, 0).row)"
    opened_page.run(f"{{ const {{ outside }} = {first_curve}; outside.fill(0); outside[40] = 1; }}")
    opened_page.run("choose({show: '0'})")
    for frame in (3, 40, 50):
        opened_page.run(f"move({frame})")
        opened_page.key("f")
        assert opened_page.run("frame") == 40
        message = f"{trackers[0]} leaves the ground-truth box at frame 40."
        assert opened_page.run(MESSAGE) == message
    opened_page.run(f"{first_curve}.outside.fill(0)")
    opened_page.key("f")
    assert opened_page.run(MESSAGE) == "No shown tracker leaves the ground-truth box."


@pytest.mark.slow
def test_failed_run_is_shown_to_its_last_box_with_the_reason(chromium, tmp_path, without_processes):
    (tmp_path / "failing.py").write_text(failing_tracker(12, step=12))
    trackers = ("static", f"{tmp_path / 'failing.py'}:Failing")
    experiment = Experiment("mine", trackers, (SequenceSpec("plain/target:length=20"),))
    with without_processes():
        page = write_experiment_page(run_experiment(experiment, tmp_path, jobs=1), tmp_path)
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    chromium.click(".failures a")
    chromium.wait("dialog.open && paintedFrame === 11")  # its last box
    legend = "byId('legend').children[2].textContent"
    why = "failing.py:Failing, repetition 0, failed: frame 12: ValueError: no <b>colour</b> is left"
    assert chromium.run(MESSAGE) == why
    assert re.search(r"Failing \(failed\)0\.00 \d+\.\d px off target$", chromium.run(legend))
    chromium.run("choose({tracker: 'static'})")
    for message in ("", why):  # the reason is shown with the run
        chromium.key("2")
        assert chromium.run(MESSAGE) == message
    chromium.key("Home")
    messages = []
    for frame in (chromium.run("sequence.curve(2).outside.indexOf(1)"), 12):
        chromium.key("f")
        chromium.wait(f"paintedFrame === {frame}")
        messages.append(chromium.run(MESSAGE))
    assert "Failing leaves the ground-truth box at frame" in messages[0]
    assert messages[1].startswith("failing.py:Failing fails at frame 12. Its run failed: frame 12")
    assert chromium.run(legend).endswith("Failing (failed)0.00 no box")
    curve = "[...sequence.curve(2).error].map((one) => !Number.isNaN(one))"
    assert chromium.run(curve) == [True] * 12 + [False] * 8
    assert chromium.console == []


MANY = """for (let number = data.labels.length; number < 24; number++) {
  data.labels.push(`particle-filter:particles=${number}`);
  data.trackers.push(data.labels[number]);
  sequence.runs.push({ ...sequence.runs[0], number, tracker: number });
}
const inLegend = (one) => {
  const [its, all] = [one, byId("legend")].map((node) => node.getBoundingClientRect());
  return its.top >= all.top - 1 && its.bottom <= all.bottom + 1; };
makeLegend();
drawnFor = "";
follow(); 0"""
"""Gives the sequence two dozen trackers."""


@pytest.mark.parametrize(("width", "height"), [(390, 667), (1280, 720)])
def test_legend_of_many_trackers_scrolls_to_the_chosen_one(opened_page, width, height):
    opened_page.size(width, height, mobile=width < 400)
    open_frame(opened_page, sequence=canonical_name(FIRST), frame=3)
    opened_page.run(MANY)
    opened_page.wait("byId('legend').children.length === 25")
    assert opened_page.run("byId('legend').scrollWidth <= byId('legend').clientWidth")
    assert opened_page.run("byId('legend').scrollHeight > byId('legend').clientHeight")
    assert opened_page.run("byId('view').getBoundingClientRect().height") > height / 5
    opened_page.run("choose({tracker: data.labels[20]})")
    opened_page.wait("inLegend(byId('legend').children[21])")
    opened_page.run("byId('legend').lastChild.focus()")
    assert opened_page.run("inLegend(byId('legend').lastChild)")
    opened_page.key(" ")
    assert opened_page.run("byId('legend').lastChild.ariaPressed") == "true"
