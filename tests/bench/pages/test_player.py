"""The player of a page: frames and boxes behind numbers, driven in a browser."""

import json
import re
import shutil
from base64 import b64decode
from urllib.parse import urlencode

import cv2
import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import data_of, named, scroll_to, seen, state, written
from trackmark import bench, datasets
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.metrics.centre_error import centre_error, centre_inside
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.reporting.stored_runs import one_pass_runs
from trackmark.reports.page import page as pages

pytestmark = browser.needs_browser

FIRST = "plain/target:length=60:scene=0"
NOISY = "plain/target:length=60:scene=9:noise=30"
PIXELS = "screen.toDataURL()"
MESSAGE = "byId('said').textContent"


def test_number_opens_its_worst_frame_and_the_copied_link_the_same(shown):
    href = shown.run("document.querySelector('#sequences tbody tr:nth-child(3) a').hash")
    shown.click("#sequences tbody tr:nth-child(3) a")
    shown.wait("byId('player').open && paintedFrame >= 0")
    address = dict(shown.run(f"[...new URLSearchParams({json.dumps(href)}.slice(1))]"))
    assert state(shown) == address
    for key in ("2", "e", "m", "ArrowLeft"):
        shown.key(key)
    shown.run("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    shown.key("l")
    link = shown.wait("window.copied")
    before = state(shown)
    changes = {"show": "0.2", "curve": "overlap", "lens": "1"}
    assert before == address | {"frame": str(int(address["frame"]) - 1)} | changes
    shown.open(link)
    shown.wait("byId('player').open && paintedFrame >= 0")
    assert state(shown) == before
    assert shown.run("frame") == int(before["frame"])
    shown.key("Escape")
    shown.wait("!byId('player').open && !location.hash.includes('sequence')")


def test_boxes_are_drawn_at_their_places(shown, results):
    stored = {row["tracker"]: (row, run, truth) for row, run, truth in one_pass_runs(results)}
    row, run, truth = stored["camshift"]
    tracker = shown.run("data.labels.indexOf('camshift')")
    repetition = row["repetition"]
    seen(shown, sequence=row["sequence"], tracker="camshift", repetition=repetition, frame=30)
    got = shown.run(f"scene.box(scene.take({tracker}, {repetition}).row, 30)")
    assert got == pytest.approx(run.boxes[30], abs=0.0501)
    assert shown.run("scene.box(0, 30)") == pytest.approx(truth.boxes[30], abs=0.0501)
    # The right edge of the ground truth, in the middle, is white or black: its dashes.
    shown.run("choose({show: 'none'})")
    shown.wait("!byId('legend').querySelector('[aria-pressed=true]')")
    x, y, width, height = truth.boxes[30]
    scale = shown.run("screen.width / scene.size[0]")
    pixels = shown.run(
        f"[...pen.getImageData({(x + width) * scale - 1}, {y * scale}, 2, {height * scale}).data]"
    )
    colours = np.reshape(pixels, (-1, 4))[:, :3]
    assert (colours.max(axis=1) < 90).any()
    assert (colours.min(axis=1) > 200).any()


def test_keys_move_by_frames_to_failures_and_to_disagreements(shown, results):
    name = named(NOISY)
    seen(shown, sequence=name, tracker=shown.run("data.labels[0]"), repetition=1, frame=5)
    for key, shift, frame in (
        ("ArrowRight", False, 6), ("ArrowRight", True, 16), ("ArrowLeft", False, 15),
        ("ArrowLeft", True, 5), ("End", False, 59), ("ArrowRight", False, 59), ("Home", False, 0),
    ):  # fmt: skip
        shown.key(key, shift=shift)
        assert shown.run("frame") == frame, key
    boxes, truth = {}, None
    for row, run, stored in one_pass_runs(results, sequence=name):
        if row["repetition"] == 1 or row["tracker"] not in boxes:
            boxes[row["tracker"]], truth = run.boxes, stored.boxes
    out = [~centre_inside(truth, its) for its in boxes.values()]
    leaving = sorted({int(f) for one in out for f in np.flatnonzero(one[1:] & ~one[:-1]) + 1})
    for frame in [*leaving, leaving[0]]:
        shown.key("f")
        assert shown.run("frame") == frame
    pairs = [(a, b) for a in boxes for b in boxes if a < b]
    apart = np.max([centre_error(boxes[a], boxes[b]) for a, b in pairs], axis=0)
    shown.key("d")
    first = shown.run("frame")
    assert apart[first] == pytest.approx(apart.max(), abs=0.2)
    shown.key("d")
    far = np.abs(np.arange(60) - first) >= 10
    assert apart[shown.run("frame")] == pytest.approx(apart[far].max(), abs=0.2)
    shown.run("byId('play').focus()")
    for keys, frame in (("4Escape", shown.run("frame")), ("42Enter", 42)):
        shown.key("g")
        shown.run("byId('frame').select()")
        for key in re.findall(r"\d|[A-Z]\w+", keys):
            shown.key(key)
        assert shown.run("[byId('frame').value, frame]") == [str(frame), frame]
        assert shown.run("document.activeElement === byId('play')")
        assert not shown.run("state.has('show')")  # no digit hid a tracker
    shown.key("?")
    shown.key("Escape")
    assert shown.run("byId('player').open && byId('help').hidden")


CONTROLS = [
    "#play", "#slider", "#curve", "#screen", "#link", "#save", "#helped", "#measured", "#lens",
    "#legend button:nth-child(2)", "[data-key=f]", "[data-key=d]", "[data-key=ArrowLeft]",
    "#repetition",
]  # fmt: skip


def test_keys_work_after_a_click_on_any_control(shown):
    seen(shown, sequence=named(NOISY), frame=5)
    shown.run("navigator.clipboard.writeText = async () => {}; screen.toBlob = () => {}; 0")
    for control in CONTROLS:
        shown.click(control)
        if control == "#repetition":  # a menu, which is a window of its own
            shown.run("byId('repetition').value = 1")
            shown.run("byId('repetition').dispatchEvent(new Event('change'))")
            assert shown.run("repetition()") == 1
        shown.run("stop(); move(20)")
        shown.key("ArrowRight")
        assert shown.run("frame") == 21, control
        shown.key(" ")
        assert shown.run("!!playing"), control
        shown.key(" ")
        assert not shown.run("playing"), control


def test_keyboard_keeps_the_focus_and_does_one_thing_at_a_time(shown):
    seen(shown, sequence=named(NOISY), frame=5)
    where = "document.activeElement.id || document.activeElement.dataset.key"
    visited = [""]
    while visited[-1] != "lens":
        shown.key("Tab")
        visited.append(shown.run(where))
        assert shown.run("document.activeElement.matches(':focus-visible')")
    assert {"scene", "other", "play", "frame", "slider"} <= {*visited}
    shown.key(" ")
    assert state(shown)["lens"] == "1"
    assert not shown.run("playing")
    assert shown.run(where) == "lens"
    shown.run("byId('legend').children[2].focus()")
    shown.key(" ")
    assert shown.run("[...byId('legend').children].indexOf(document.activeElement)") == 2


def test_player_plays_scrubs_holds_enlarges_and_saves(shown, results):
    name = named(FIRST)
    tracker = shown.run("data.labels[2]")
    seen(shown, sequence=name, tracker=tracker, repetition=0, frame=0)
    shown.run(
        "window.visited = [];"
        "{ const before = seek; seek = (f) => { visited.push(f); return before(f); }; }"
    )
    shown.key(" ")
    shown.wait("visited.length >= 12")
    shown.key(" ")
    assert shown.run("visited")[:12] == list(range(1, 13))  # no frame is skipped
    shown.run("byId('slider').value = 33; byId('slider').dispatchEvent(new Event('input'))")
    shown.wait("paintedFrame === 33")
    place = "(({{x, width}}) => [x, width])(byId('{}').getBoundingClientRect())"
    cursor, slider = (shown.run(place.format(one)) for one in ("cursor", "slider"))
    thumb = slider[0] + 8 + 33 / 59 * (slider[1] - 16)  # its centre; it is 16 pixels wide
    assert cursor[0] + cursor[1] / 2 == pytest.approx(thumb, abs=0.6)
    plain, entry = shown.run(PIXELS), "byId('legend').children[3].textContent"
    shown.run("choose({other: '2.1', show: '2'})")
    numbers = []
    for held in (False, True):
        if held:
            shown.key("c", held=True)
            assert shown.run("drawnTakes().map(take => take.repetition)") == [1]
            assert "(repetition 1)" in shown.run(entry)
        numbers.append(re.findall(r"[\d.]+", shown.run(entry.replace("]", "].lastChild")))[-2:])
    shown.release("c")
    for row, run, truth in one_pass_runs(results, sequence=name):
        if row["tracker"] == tracker and row["repetition"] < 2:
            near, error = map(float, numbers[row["repetition"]])
            assert near == pytest.approx(overlap(truth.boxes[33:34], run.boxes[33:34])[0], abs=0.01)
            expected = centre_error(truth.boxes[33:34], run.boxes[33:34])[0]
            assert error == pytest.approx(expected, abs=0.15)
    shown.run("choose({show: null})")
    assert shown.run(PIXELS) == plain
    shown.key("m")
    shown.wait(f"{PIXELS} !== {json.dumps(plain)}")  # without a pointer, at the target
    shown.run(
        "HTMLAnchorElement.prototype.click = function () {"
        " window.saved = [this.href, this.download]; }"
    )
    shown.key("s")
    url, file = shown.wait("window.saved")
    size = shown.run(
        f"fetch({url!r}).then(r => r.blob()).then(createImageBitmap).then(i => [i.width, i.height])"
    )
    assert size == shown.run("[screen.width, screen.height]")
    assert file == re.sub(r"[^\w.-]+", "-", name) + "-00033.png"


def test_player_switches_to_revised_boxes(shown, results):
    name, tracker = named(FIRST), shown.run("data.labels[2]")
    seen(shown, sequence=name, tracker=tracker, repetition=0, frame=3)
    online = shown.run("drawnTakes().map(rowOf)")
    shown.key("o")
    assert state(shown)["trace"] == "revised"
    revised = shown.run("drawnTakes().map(rowOf)")
    assert revised == [*online[:2], online[2] + 1]  # one of the trackers revises
    (run, *_) = (
        run for row, run, _ in one_pass_runs(results, sequence=name) if row["tracker"] == tracker
    )
    rows = shown.run(f"[{online[2]}, {revised[2]}].map((row) => scene.box(row, 3)[0])")
    assert rows == pytest.approx([run.boxes[3, 0], run.revised[3, 0]], abs=0.051)


@pytest.mark.parametrize(
    ("width", "height"), [(1366, 768), (1920, 1080), (390, 844), (844, 390), (1280, 500)]
)
def test_frame_keeps_its_shape_and_uses_its_room(shown, width, height):
    shown.size(width, height, mobile=width < 900)
    seen(shown, sequence=named(FIRST), frame=3)
    rect = "(({width, height}) => [width, height])(screen.getBoundingClientRect())"
    wide, tall = shown.run(rect)
    assert wide / tall == pytest.approx(shown.run("scene.size[0] / scene.size[1]"), rel=0.005)
    assert wide > {1920: 900, 390: 360}.get(width, 300)
    assert shown.run("dialog.scrollHeight <= dialog.clientHeight")
    assert shown.run("dialog.scrollWidth") <= width
    if height > 600:  # else controls scroll beside the frame
        bottom = "(one) => one.getBoundingClientRect().bottom"
        assert max(shown.run(f"[...dialog.querySelectorAll('button')].map({bottom})")) <= height


def touch(shown, kind, *places):
    shown.call("Input.dispatchTouchEvent", type=kind, touchPoints=list(places))


def test_finger_opens_points_holds_a_run_and_moves_the_magnifier(shown, page):
    shown.size(390, 844, dark=True, mobile=True)
    shown.call("Emulation.setTouchEmulationEnabled", enabled=True)
    shown.open(page.as_uri())
    assert shown.run("document.documentElement.scrollWidth") == 390
    scroll_to(shown, "errors-2")
    middle = (
        "(({{x, y, width, height}}) => ({{x: x + width / 2, y: y + height / 2}}))"
        "(document.querySelector('{}').getBoundingClientRect())"
    )
    touch(shown, "touchStart", shown.run(middle.format("#errors-2 svg")))
    touch(shown, "touchEnd")
    shown.wait("byId('player').open && paintedFrame >= 0")
    assert shown.run("scene.number") == 2
    shown.run("choose({other: '2.1'})")
    touch(shown, "touchStart", shown.run(middle.format("#hold")))
    shown.wait("held && drawnTakes()[0].repetition === 1")
    touch(shown, "touchEnd")
    shown.wait("!held")
    shown.key("m")
    place = shown.run(middle.format("#screen"))
    touch(shown, "touchStart", place)
    drawn = shown.run(PIXELS)
    touch(shown, "touchMove", {"x": place["x"] + 60, "y": place["y"] + 40})
    shown.wait(f"{PIXELS} !== {json.dumps(drawn)}")
    moved = shown.run(PIXELS)
    touch(shown, "touchEnd")
    assert shown.run(PIXELS) == moved
    shown.call("Emulation.setTouchEmulationEnabled", enabled=False)


def test_link_to_what_is_not_there_is_answered(shown):
    for asked, message in (
        ({"tracker": "none <b>", "frame": 3}, "There is no run of none <b> here."),
        ({"repetition": 77, "frame": 3}, "There is no repetition 77 here."),
        ({"repetition": 77, "frame": 6000}, "There is no repetition 77 here. There is no frame"),
        ({"frame": 6000}, "There is no frame 6000: the last one is 59."),
        ({"frame": "x"}, "There is no frame x: the last one is 59."),
        ({"start": 3, "frame": 3}, "There is no start 3 here."),
        ({"show": "7.x", "frame": 3}, "No tracker is shown."),
        ({"other": "1.9", "frame": 3}, "There is no run of camshift, repetition 9, to hold."),
        ({"map": "hue", "frame": 3}, "There is no map hue here."),
    ):
        shown.run(f"location.hash = {json.dumps(urlencode({'sequence': named(FIRST), **asked}))}")
        shown.wait(f"{MESSAGE}.startsWith({json.dumps(message)})")
        chosen = "['other', 'map'].map((id) => byId(id).selectedOptions[0].text)"
        assert shown.run(chosen) == ["another run", "none"]
    shown.run(f"location.hash = {json.dumps(urlencode({'sequence': 'gone <b>', 'frame': 3}))}")
    words = "There is no sequence gone <b> on this page"
    shown.wait(f"byId('missing').textContent.includes('{words}')")
    assert shown.run("!dialog.open && byId('missing').role === 'status'")
    assert shown.run("state.get('sequence')") == "gone <b>"  # the address keeps the request
    shown.call("Emulation.setEmulatedMedia", media="print")
    assert not shown.run("byId('missing').checkVisibility()")
    shown.call("Emulation.setEmulatedMedia", media="")
    shown.click("#missing button")
    shown.wait("byId('missing').textContent === '' && !location.hash")


def test_page_of_some_frames_marks_these_and_explains_others(shown):
    shown.run("data.scenes[0].kept = [10, 11, 12, 30]; 0")
    shown.run(
        "window.texts = []; { const before = pen.fillText; pen.fillText = function (...given) {"
        " texts.push(given[0]); before.apply(this, given); }; } window.marks = [];"
        " CanvasRenderingContext2D.prototype.fillRect = function (x) {"
        " if (this === curvePen) marks.push(x); }; 0"
    )
    seen(shown, sequence=named(FIRST), frame=11)
    assert shown.run("painted !== null && texts.length === 0")
    left, right = shown.run("[PLOT.left, curvePen.canvas.clientWidth - PLOT.right]")
    ends = [left + (number - 0.5) / 59 * (right - left) for number in (10, 11, 12, 30)]
    assert shown.run("marks") == [pytest.approx(end) for end in ends]
    shown.key("ArrowRight", shift=True)
    shown.wait("paintedFrame === 21")
    assert shown.run("texts") == [
        "The page keeps the worst frames alone,", "those with a line beneath the curve."
    ]  # fmt: skip


def test_curve_of_overlaps_has_the_line_of_success(shown):
    seen(shown, sequence=named(FIRST), frame=3)
    shown.run(
        "window.texts = []; { const before = curvePen.fillText; curvePen.fillText = function"
        " (...given) { texts.push(given[0]); before.apply(this, given); }; } 0"
    )
    shown.key("e")
    assert {"0", "0.5", "1", "20", "40", "overlap; success from 0.5"} <= {*shown.wait("texts")}


def test_frames_beside_the_page_are_loaded_when_needed(chromium, results, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "MAX_INLINE_FRAMES", 0)
    beside = written(results, tmp_path, full=True)
    assert len(list((tmp_path / "report-frames").glob("thumbnails-*.js"))) >= 6
    chromium.console.clear()
    chromium.open(beside.as_uri())
    assert chromium.run("document.querySelectorAll('script[src]').length") == 0
    name = named("plain/target:length=60:scene=1")
    seen(chromium, sequence=name, frame=7)
    size = datasets.load(name).image_size
    chromium.wait(f"painted.width === {size[0]}")  # its own size, by --frames
    assert chromium.console == []
    shutil.rmtree(tmp_path / "report-frames")
    chromium.open(beside.as_uri() + "#" + urlencode({"sequence": name, "frame": 7}))
    assert "not beside this page" in chromium.wait(MESSAGE)


def test_frames_are_kept_in_order_and_small(page):
    text = page.read_text()
    for number, scene in enumerate(data_of(text)["scenes"]):
        sequence = datasets.load(scene["name"])
        sizes = scene["reels"]["thumbnails"]
        assert sum(map(len, sizes)) == len(sequence)
        block = re.search(f'id="thumbnails-{number}-0">(.*?)</script>', text, re.S)[1]
        content = b64decode(block)
        for frame in (0, 17, 40):
            start = sum(sizes[0][:frame])
            got = cv2.imdecode(np.frombuffer(content[start : start + sizes[0][frame]], np.uint8), 1)
            assert got.shape[0] <= 160
            wanted = cv2.resize(sequence[frame], got.shape[1::-1], interpolation=cv2.INTER_AREA)
            assert np.abs(got.astype(int) - wanted).mean() < 14  # of noise, too


def test_absent_failures_and_disagreements_are_stated(shown):
    trackers = shown.run("data.labels")
    seen(shown, sequence=named(FIRST), frame=3)
    alone = f"{trackers[0]} alone is shown: a disagreement needs two."
    none = "No tracker is shown."
    for show, key, message in (("none", "f", none), ("none", "d", none), ("0", "d", alone)):
        shown.run(f"choose({{show: '{show}', frame: 3}})")
        shown.key(key)
        assert shown.run(MESSAGE).startswith(message)
        assert shown.run("frame") == 3
    shown.run("{ const curve = scene.curve(1); curve.out.fill(0); curve.out[40] = 1; } 0")
    shown.run("choose({show: '0'})")
    for frame in (3, 40, 50):
        shown.run(f"move({frame})")
        shown.key("f")
        assert shown.run("frame") == 40
        message = f"{trackers[0]} leaves the truth's box at frame 40. It is the only one."
        assert shown.run(MESSAGE) == message
    shown.run("scene.curve(1).out.fill(0)")
    shown.key("f")
    assert shown.run(MESSAGE) == "No shown tracker leaves the truth's box."


FAILING = '''
"""Fails in frame 12."""
from trackmark.trackers.base.interface import Estimate, TrackerPlugin


class Failing(TrackerPlugin):
    """Fails in frame 12."""

    def init(self, image, box, mask=None):
        self.box, self.frame = box, 0

    def update(self, image):
        self.frame += 1
        if self.frame == 12:
            raise ValueError("no <b>colour</b> is left")
        return Estimate(self.box + [12 * self.frame, 0, 0, 0])
'''


def test_failed_run_is_shown_to_its_last_box_with_the_reason(chromium, tmp_path, without_processes):
    (tmp_path / "failing.py").write_text(FAILING)
    trackers = ("static", f"{tmp_path / 'failing.py'}:Failing")
    experiment = Experiment("mine", trackers, (SequenceSource("plain/target:length=20"),))
    with without_processes():
        page = written(bench.run(experiment, tmp_path, jobs=1), tmp_path)
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    chromium.click("#failed tbody a")
    chromium.wait("dialog.open && paintedFrame === 11")  # its last box
    legend = "byId('legend').children[2].textContent"
    why = "failing.py:Failing, repetition 0, failed: frame 12: ValueError: no <b>colour</b> is left"
    assert chromium.run(MESSAGE) == why
    assert re.search(r"Failing \(failed\)0\.00 · \d+\.\d px$", chromium.run(legend))
    chromium.run("choose({tracker: 'static'})")
    for message in ("", why):  # the reason is shown with the run
        chromium.key("2")
        assert chromium.run(MESSAGE) == message
    chromium.key("Home")
    messages = []
    for frame in (chromium.run("scene.curve(2).out.indexOf(1)"), 12):
        chromium.key("f")
        chromium.wait(f"paintedFrame === {frame}")
        messages.append(chromium.run(MESSAGE))
    assert "Failing leaves the truth's box at frame" in messages[0]
    assert messages[1].startswith("failing.py:Failing stops at frame 12. Its run failed: frame 12")
    assert chromium.run(legend).endswith("Failing (failed)0.00 · no box")
    curve = "[...scene.curve(2).error].map((one) => !Number.isNaN(one))"
    assert chromium.run(curve) == [True] * 12 + [False] * 8
    assert chromium.console == []


MANY = """for (let number = data.labels.length; number < 24; number++) {
  data.labels.push(`particle-filter:particles=${number}`);
  data.trackers.push(data.labels[number]);
  scene.takes.push({ ...scene.takes[0], number, tracker: number });
}
const inLegend = (one) => {
  const [its, all] = [one, byId("legend")].map((node) => node.getBoundingClientRect());
  return its.top >= all.top - 1 && its.bottom <= all.bottom + 1; };
makeLegend();
drawnFor = "";
follow(); 0"""
"""Gives the sequence two dozen trackers."""


@pytest.mark.parametrize(("width", "height"), [(390, 667), (768, 1024), (1280, 720)])
def test_legend_of_many_trackers_scrolls_to_the_chosen_one(shown, width, height):
    shown.size(width, height, mobile=width < 400)
    seen(shown, sequence=named(FIRST), frame=3)
    shown.run(MANY)
    shown.wait("byId('legend').children.length === 25")
    assert shown.run("byId('legend').scrollWidth <= byId('legend').clientWidth")
    assert shown.run("byId('legend').scrollHeight > byId('legend').clientHeight")
    assert shown.run("byId('stage').getBoundingClientRect().height") > height / 5
    shown.run("choose({tracker: data.labels[20]})")
    shown.wait("inLegend(byId('legend').children[21])")
    shown.run("byId('legend').lastChild.focus()")
    assert shown.run("inLegend(byId('legend').lastChild)")
    shown.key(" ")
    assert shown.run("byId('legend').lastChild.ariaPressed") == "true"
