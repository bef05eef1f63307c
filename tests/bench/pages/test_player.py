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
from tests.bench.pages.reading import data_of, named, seen, state, written
from trackmark import bench, datasets
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.metrics.centre_error import centre_error, centre_inside
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.reporting.stored_runs import one_pass_runs
from trackmark.reports.page import page as pages


@browser.needs_browser
def test_a_number_opens_its_worst_frame_and_the_copied_link_shows_the_same(shown, page):
    href = shown.run("document.querySelector('#sequences tbody tr:nth-child(3) a').hash")
    shown.click("#sequences tbody tr:nth-child(3) a")
    shown.wait("byId('player').open && paintedFrame >= 0")
    asked = dict(shown.run(f"[...new URLSearchParams({json.dumps(href)}.slice(1))]"))
    assert state(shown) == asked
    shown.key("2")
    shown.key("e")
    shown.key("m")
    shown.key("ArrowLeft")
    shown.run("navigator.clipboard.writeText = async (text) => { window.copied = text; }")
    shown.key("l")
    link = shown.wait("window.copied")
    before = state(shown)
    assert before == asked | {
        "frame": str(int(asked["frame"]) - 1), "show": "0.2", "curve": "overlap", "lens": "1"
    }  # fmt: skip
    shown.open(link)
    shown.wait("byId('player').open && paintedFrame >= 0")
    assert state(shown) == before
    assert shown.run("frame") == int(before["frame"])
    shown.key("Escape")
    shown.wait("!byId('player').open && !location.hash.includes('sequence')")


@browser.needs_browser
def test_boxes_are_drawn_where_they_are(shown, results):
    row, run, truth = next(
        one for one in one_pass_runs(results) if one[0]["tracker_name"] == "camshift"
    )
    tracker = shown.run(f"data.labels.indexOf({json.dumps(row['tracker'])})")
    seen(shown, sequence=row["sequence"], tracker=row["tracker"], repetition=0, frame=30)
    got = shown.run(f"scene.box(scene.take({tracker}, 0).row, 30)")
    assert got == pytest.approx(run.boxes[30], abs=0.0501)
    assert shown.run("scene.box(0, 30)") == pytest.approx(truth.boxes[30], abs=0.0501)
    # The right edge of the truth, in the middle, is white or black: its dashes.
    shown.key(str(1 + tracker))
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


@browser.needs_browser
def test_keys_move_by_frames_to_failures_and_to_disagreements(shown, results):
    name = named("plain/target:length=60:scene=9:noise=30")
    trackers = shown.run("data.labels")
    seen(shown, sequence=name, tracker=trackers[0], repetition=1, frame=5)
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
    assert apart[shown.run("frame")] == pytest.approx(apart.max(), abs=0.2)
    first = shown.run("frame")
    shown.key("d")
    far = np.abs(np.arange(60) - first) >= 10
    assert apart[shown.run("frame")] == pytest.approx(apart[far].max(), abs=0.2)
    shown.key("g")
    shown.run("byId('frame').value = 42")
    shown.key("Enter")
    assert shown.run("frame") == 42


CONTROLS = [
    "#play", "#slider", "#curve", "#screen", "#link", "#save", "#helped", "#measured", "#lens",
    "#legend button:nth-child(2)", "[data-key=f]", "[data-key=d]", "[data-key=ArrowLeft]",
]  # fmt: skip


@browser.needs_browser
@pytest.mark.parametrize("control", CONTROLS)
def test_keys_are_heard_after_a_click_on_any_control(shown, control):
    seen(shown, sequence=named("plain/target:length=60:scene=9:noise=30"), frame=5)
    shown.run("navigator.clipboard.writeText = async () => {}; screen.toBlob = () => {}; 0")
    shown.click(control)
    shown.run("stop(); move(20)")
    keys_are_heard(shown)


def keys_are_heard(shown):
    """An arrow moves from frame 20 to the next one, and space plays, once."""
    shown.key("ArrowRight")
    assert shown.run("frame") == 21
    shown.key(" ")
    assert shown.run("!!playing")
    shown.key(" ")
    assert not shown.run("playing")


@browser.needs_browser
def test_keys_are_heard_after_a_choice_and_after_a_frames_number(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=9:noise=30"), frame=5)
    shown.click("#repetition")  # opens the menu, which is a window of its own
    shown.run("byId('repetition').value = 1")
    shown.run("byId('repetition').dispatchEvent(new Event('change'))")
    assert shown.run("repetition()") == 1
    shown.run("move(20)")
    keys_are_heard(shown)
    for field in ("g", "click"):
        shown.key("g") if field == "g" else shown.click("#frame")
        shown.run("byId('frame').select()")
        for sign in "20":
            shown.key(sign)
        assert shown.run("byId('frame').value") == "20"  # and no second tracker was hidden
        assert not shown.run("state.has('show')")
        shown.key("Enter")
        keys_are_heard(shown)


@browser.needs_browser
def test_who_uses_keys_alone_keeps_the_focus_and_does_one_thing_at_a_time(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=9:noise=30"), frame=5)
    shown.key("Tab")
    where = "document.activeElement.id || document.activeElement.dataset.key"
    visited = [shown.run(where)]
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
    shown.run("byId('repetition').focus()")
    shown.key("ArrowDown")
    assert shown.run("repetition()") == 1
    assert shown.run(where) == "repetition"


def boxes_at_3(results, sequence, tracker):
    """Where a tracker's box of frame 3 begins, as it was said at once and in the end."""
    _, run, _ = next(
        one for one in one_pass_runs(results, sequence=sequence) if one[0]["tracker"] == tracker
    )
    return run.boxes[3, 0], run.revised[3, 0]


@browser.needs_browser
def test_it_plays_scrubs_holds_another_run_enlarges_and_saves(shown, results):
    name = named("plain/target:length=60:scene=0")
    trackers = shown.run("data.labels")
    seen(shown, sequence=name, tracker=trackers[2], repetition=0, frame=0)
    shown.run(
        "window.visited = [];"
        "{ const before = seek; seek = (f) => { visited.push(f); return before(f); }; }"
    )
    shown.key(" ")
    shown.wait("visited.length >= 12")
    shown.key(" ")
    visited = shown.run("visited")
    assert visited[:12] == list(range(1, 13))  # one frame means one frame
    assert not shown.run("playing")
    shown.run("byId('slider').value = 33; byId('slider').dispatchEvent(new Event('input'))")
    shown.wait("paintedFrame === 33")
    cursor, slider = (
        shown.run(f"(({{x, width}}) => [x, width])(byId('{one}').getBoundingClientRect())")
        for one in ("cursor", "slider")
    )
    thumb = slider[0] + 8 + 33 / 59 * (slider[1] - 16)  # its centre; it is 16 pixels wide
    assert cursor[0] + cursor[1] / 2 == pytest.approx(thumb, abs=0.6)
    pixels = "screen.toDataURL()"
    plain = shown.run(pixels)
    shown.run("choose({other: '2.1'})")
    shown.key("c", held=True)
    held = shown.run(pixels)
    assert held != plain
    assert shown.run("drawnTakes().map(take => take.repetition)") == [1]
    shown.release("c")
    assert shown.run(pixels) == plain
    shown.key("m")
    at = shown.run("(({x, y}) => ({x: x + 90, y: y + 90}))(screen.getBoundingClientRect())")
    shown.call("Input.dispatchMouseEvent", type="mouseMoved", **at)
    shown.wait("pointer !== null")
    assert shown.run(pixels) != plain
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
    online = shown.run("drawnTakes().map(rowOf)")
    shown.key("o")
    assert state(shown)["trace"] == "revised"
    revised = shown.run("drawnTakes().map(rowOf)")
    assert revised == [*online[:2], online[2] + 1]  # one of them revises
    assert shown.run(f"[{online[2]}, {revised[2]}].map((row) => scene.box(row, 3)[0])") == [
        pytest.approx(one, abs=0.051) for one in boxes_at_3(results, name, trackers[2])
    ]
    shown.click("#curve")
    shown.wait("paintedFrame === frame && frame !== 33")
    middle = shown.run("(({x, width}) => x + width / 2)(byId('curve').getBoundingClientRect())")
    now = shown.run("byId('cursor').getBoundingClientRect().x + 1")
    assert abs(now - middle) <= (slider[1] - 16) / 59 / 2 + 1
    shown.key("?")
    assert shown.run("!byId('help').hidden")


@browser.needs_browser
@pytest.mark.parametrize(
    ("width", "height"), [(1366, 768), (1920, 1080), (390, 844), (844, 390), (1280, 500)]
)
def test_a_frame_keeps_its_shape_in_every_window_and_uses_its_room(shown, width, height):
    shown.size(width, height, mobile=width < 900)
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    rect = "(({width, height}) => [width, height])(screen.getBoundingClientRect())"
    wide, tall = shown.run(rect)
    assert wide / tall == pytest.approx(shown.run("scene.size[0] / scene.size[1]"), rel=0.005)
    assert wide > {1920: 900, 390: 360}.get(width, 300)
    assert shown.run("dialog.scrollHeight <= dialog.clientHeight")
    if height > 600:  # else controls scroll beside the frame
        bottoms = (
            "[...dialog.querySelectorAll('button')].map(o => o.getBoundingClientRect().bottom)"
        )
        assert max(shown.run(bottoms)) <= height


def touch(shown, kind, *places):
    shown.call("Input.dispatchTouchEvent", type=kind, touchPoints=list(places))


@pytest.fixture
def phone(shown, page):
    shown.size(390, 844, mobile=True)
    shown.call("Emulation.setTouchEmulationEnabled", enabled=True)
    shown.open(page.as_uri())
    yield shown
    shown.call("Emulation.setTouchEmulationEnabled", enabled=False)


@browser.needs_browser
def test_a_finger_opens_points_holds_another_run_and_moves_the_magnifier(phone):
    phone.wait(
        "new Promise((done) => {"
        " byId('errors-2').scrollIntoView({block: 'center', behavior: 'instant'});"
        " requestAnimationFrame(() => done(document.querySelector('#errors-2 svg') !== null)); })"
    )
    middle = (
        "(({{x, y, width, height}}) => ({{x: x + width / 2, y: y + height / 2}}))"
        "(document.querySelector('{}').getBoundingClientRect())"
    )
    touch(phone, "touchStart", phone.run(middle.format("#errors-2 svg")))
    touch(phone, "touchEnd")
    phone.wait("byId('player').open && paintedFrame >= 0")
    assert phone.run("scene.number") == 2
    phone.run("choose({other: '2.1'})")
    touch(phone, "touchStart", phone.run(middle.format("#hold")))
    phone.wait("held && drawnTakes()[0].repetition === 1")
    touch(phone, "touchEnd")
    phone.wait("!held")
    phone.key("m")
    pixels = "screen.toDataURL()"
    drawn = {phone.run(pixels)}
    place = phone.run(middle.format("#screen"))
    touch(phone, "touchStart", place)
    drawn.add(phone.run(pixels))
    touch(phone, "touchMove", {"x": place["x"] + 60, "y": place["y"] + 40})
    phone.wait(f"{pixels} !== {json.dumps(max(drawn))}")
    drawn.add(phone.run(pixels))
    touch(phone, "touchEnd")
    assert phone.run(pixels) in drawn  # it stays
    assert len(drawn) == 3


WRITTEN = """window.said = [];
{ const before = curvePen.fillText; curvePen.fillText = function (...given) {
  said.push(given); before.apply(this, given); }; }"""
"""Has what is written on the curve kept, and where."""


@browser.needs_browser
def test_while_another_run_is_held_the_curves_scale_stays_and_the_numbers_are_its(shown, results):
    name = named("plain/target:length=60:scene=0")
    tracker = shown.run("data.labels[2]")
    seen(shown, sequence=name, tracker=tracker, repetition=0, frame=40)
    shown.run("choose({other: '2.1', show: '2'})")
    shown.run(WRITTEN)
    scale = "(() => { said.length = 0; drawCurve(); return said.join(); })()"  # numbers, and where
    numbers = "byId('legend').children[3].lastChild.textContent"
    before = shown.run(scale), shown.run(numbers)
    shown.key("c", held=True)
    said = shown.run(scale), shown.run(numbers)
    entry = shown.run("byId('legend').children[3].textContent")
    shown.release("c")
    assert said[0] == before[0]
    runs = {
        row["repetition"]: (run.boxes, truth.boxes)
        for row, run, truth in one_pass_runs(results, sequence=name)
        if row["tracker"] == tracker
    }
    for repetition, told in enumerate((before[1], said[1])):
        boxes, truth = (one[40:41] for one in runs[repetition])
        near, px = (float(number) for number in re.findall(r"[\d.]+", told))
        assert near == pytest.approx(overlap(truth, boxes)[0], abs=0.01)
        assert px == pytest.approx(centre_error(truth, boxes)[0], abs=0.15)
    assert before[1] != said[1]
    assert "(repetition 1)" in entry
    assert shown.run(numbers) == before[1]


@browser.needs_browser
def test_a_link_to_what_is_not_there_says_so(shown):
    name = named("plain/target:length=60:scene=0")
    for asked, told in (
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
        shown.run(f"location.hash = {json.dumps(urlencode({'sequence': name, **asked}))}")
        shown.wait(f"byId('said').textContent.startsWith({json.dumps(told)})")
        chosen = "['other', 'map'].map((id) => byId(id).selectedOptions[0].text)"
        assert shown.run(chosen) == ["another run", "none"]


@browser.needs_browser
@pytest.mark.parametrize("open_before", [False, True])
def test_a_link_to_a_sequence_that_the_page_does_not_hold_says_which(shown, open_before):
    if open_before:
        seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    shown.run(f"location.hash = {json.dumps(urlencode({'sequence': 'gone <b>', 'frame': 3}))}")
    shown.wait("byId('missing').textContent.includes('There is no sequence gone <b> on this page')")
    assert shown.run("!dialog.open && byId('missing').role === 'status'")
    seen_of = "(({x, y}) => byId('missing').contains(document.elementFromPoint(x + 9, y + 9)))"
    assert shown.run(f"{seen_of}(byId('missing').getBoundingClientRect())")
    assert shown.run("state.get('sequence')") == "gone <b>"  # the address says what was asked for
    shown.call("Emulation.setEmulatedMedia", media="print")
    assert not shown.run("byId('missing').checkVisibility()")
    shown.call("Emulation.setEmulatedMedia", media="")
    shown.click("#missing button")
    shown.wait("byId('missing').textContent === '' && !location.hash")


@browser.needs_browser
@pytest.mark.parametrize("width", [390, 1280])
def test_a_page_of_some_frames_shows_which_and_says_of_others_that_they_are_not_here(shown, width):
    shown.size(width, 900, mobile=width < 900)
    shown.run("data.scenes[0].kept = [10, 11, 12, 30]; 0")
    shown.run(
        "window.texts = []; { const before = pen.fillText; pen.fillText = function (...given) {"
        " texts.push([given[0], parseFloat(pen.font) * screen.clientWidth / screen.width]);"
        " before.apply(this, given); }; } 0"
    )
    shown.run("window.marks = []; CanvasRenderingContext2D.prototype.fillRect = function (x) {"
              " if (this === curvePen) marks.push(x); }; 0")  # fmt: skip
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=11)
    assert shown.run("painted !== null && texts.length === 0")
    left, right = shown.run("[PLOT.left, curvePen.canvas.clientWidth - PLOT.right]")
    ends = [left + (number - 0.5) / 59 * (right - left) for number in (10, 11, 12, 30)]
    assert shown.run("marks") == [pytest.approx(end) for end in ends]
    shown.key("ArrowRight", shift=True)
    shown.wait("paintedFrame === 21")
    (first, size), (second, _) = shown.run("texts")
    assert (first, second) == (
        "The page keeps the worst frames alone,", "those with a line beneath the curve."
    )  # fmt: skip
    assert size == pytest.approx(16, abs=0.5)
    shown.run("texts.length = 0")
    shown.size(width, 600, mobile=width < 900)  # the frame is smaller, the letters are not
    shown.wait("texts.length")
    assert shown.run("texts[0][1]") == pytest.approx(16, abs=0.5)


@browser.needs_browser
def test_escape_closes_the_keys_and_leaves_a_number_first(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    shown.key("?")
    shown.key("Escape")
    assert shown.run("byId('player').open && byId('help').hidden")
    shown.run("byId('play').focus()")
    shown.key("g")
    shown.key("4")
    shown.key("Escape")
    assert shown.run("byId('player').open && document.activeElement === byId('play')")
    assert shown.run("[byId('frame').value, frame]") == ["3", 3]
    shown.key("Escape")
    shown.wait("!byId('player').open")


@browser.needs_browser
def test_the_curve_of_overlaps_has_the_line_of_success(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    shown.run(WRITTEN)
    shown.key("e")
    said = shown.wait("said.map((given) => given[0])")
    assert {"0", "0.5", "1", "20", "40", "overlap; success from 0.5"} <= {*said}


@browser.needs_browser
@pytest.mark.parametrize("dark", [False, True])
def test_a_phone_shows_all_without_scrolling_aside(shown, dark):
    shown.size(390, 844, dark=dark, mobile=True)
    assert shown.run("document.documentElement.scrollWidth") == 390
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    assert shown.run("byId('player').scrollWidth <= 390")


@browser.needs_browser
def test_frames_beside_the_page_come_when_they_are_needed(chromium, results, tmp_path, monkeypatch):
    monkeypatch.setattr(pages, "INSIDE", 0)
    beside = written(results, tmp_path, full=True)
    assert len(list((tmp_path / "report-frames").glob("thumbnails-*.js"))) >= 6
    chromium.console.clear()
    chromium.open(beside.as_uri())
    assert chromium.run("document.querySelectorAll('script[src]').length") == 0
    name = named("plain/target:length=60:scene=1")
    seen(chromium, sequence=name, frame=7)
    size = datasets.load(name).image_size
    chromium.wait(f"painted.width === {size[0]}")  # of its own size: by --frames
    assert chromium.console == []
    shutil.rmtree(tmp_path / "report-frames")
    chromium.open(beside.as_uri() + "#" + urlencode({"sequence": name, "frame": 7}))
    assert "not beside this page" in chromium.wait("byId('said').textContent")


def test_frames_are_kept_in_order_and_small(results, page):
    text = page.read_text()
    data = data_of(text)
    for number, scene in enumerate(data["scenes"]):
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


@browser.needs_browser
def test_without_a_pointer_the_target_is_magnified(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=9:noise=30"), frame=5)
    shown.run("pointer = null; repaint()")
    plain = shown.run("screen.toDataURL()")
    shown.key("m")
    shown.wait(f"screen.toDataURL() !== {json.dumps(plain)}")


DECODED = """window.decoded = 0;
{ const before = createImageBitmap; window.createImageBitmap = (...given) => {
  decoded += 1; return before(...given); }; } 0"""
"""Has it counted how many images are decoded."""


@browser.needs_browser
def test_frames_ahead_are_made_ready_and_are_not_in_the_way_of_the_one_that_is_wanted(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    ready = "scene.films.thumbnails.images.get(number) instanceof ImageBitmap"
    shown.wait(f"[3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13].every((number) => {ready})")
    shown.run(DECODED)
    shown.run("(async () => { for (const number of [50, 20, 40, 30]) await seek(number); })()")
    assert shown.run("decoded") <= 8  # each, and at most one more beside it
    shown.run("seek(29)")
    shown.wait(f"[28, 27, 26, 25].every((number) => {ready})")  # who goes back goes on so


@browser.needs_browser
def test_failures_and_disagreements_that_are_not_there_are_told(shown):
    name = named("plain/target:length=60:scene=0")
    trackers = shown.run("data.labels")
    seen(shown, sequence=name, frame=3)
    for show, key, told in (
        ("none", "f", "No tracker is shown."),
        ("none", "d", "No tracker is shown."),
        ("0", "d", f"{trackers[0]} alone is shown: a disagreement needs two."),
    ):
        shown.run(f"choose({{show: '{show}', frame: 3}})")
        shown.key(key)
        assert shown.run("byId('said').textContent").startswith(told)
        assert shown.run("frame") == 3
    shown.run("{ const curve = scene.curve(1); curve.out.fill(0); curve.out[40] = 1; } 0")
    shown.run("choose({show: '0'})")
    for frame in (3, 40, 50):
        shown.run(f"move({frame})")
        shown.key("f")
        assert shown.run("frame") == 40
        told = f"{trackers[0]} leaves the truth's box at frame 40. It is the only one."
        assert shown.run("byId('said').textContent") == told
    shown.run("scene.curve(1).out.fill(0)")
    shown.key("f")
    assert shown.run("byId('said').textContent") == "No shown tracker leaves the truth's box."


FAILING = '''
"""Goes off, and then away."""
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


@browser.needs_browser
def test_a_failed_run_is_shown_as_far_as_it_got_and_says_why(chromium, tmp_path, without_processes):
    (tmp_path / "failing.py").write_text(FAILING)
    trackers = ("static", f"{tmp_path / 'failing.py'}:Failing")
    asked = Experiment("mine", trackers, (SequenceSource("plain/target:length=20"),))
    with without_processes():
        page = written(bench.run(asked, tmp_path, jobs=1), tmp_path)
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    chromium.click("#failed tbody a")
    chromium.wait("dialog.open && paintedFrame === 11")  # its last box
    said, legend = "byId('said').textContent", "byId('legend').children[2].textContent"
    why = "failing.py:Failing, repetition 0, failed: frame 12: ValueError: no <b>colour</b> is left"
    assert chromium.run(said) == why
    assert re.search(r"Failing \(failed\)0\.00 · \d+\.\d px$", chromium.run(legend))
    drawn = chromium.run("screen.toDataURL()")
    chromium.key("2")
    assert chromium.run("screen.toDataURL()") != drawn
    assert chromium.run(said) == why  # it is what was asked for
    chromium.key("2")
    chromium.run("choose({tracker: 'static'})")
    assert chromium.run(said) == why  # it is seen
    chromium.key("2")
    assert chromium.run(said) == ""
    chromium.key("2")
    chromium.key("Home")
    told = []
    for frame in (chromium.run("scene.curve(2).out.indexOf(1)"), 12):
        chromium.key("f")
        chromium.wait(f"paintedFrame === {frame}")
        told.append(chromium.run(said))
    assert "Failing leaves the truth's box at frame" in told[0]
    assert told[1].startswith("failing.py:Failing stops at frame 12. Its run failed: frame 12: Val")
    assert chromium.run("painted !== null")
    assert chromium.run(legend).endswith("Failing (failed)0.00 · no box")
    curve = "[...scene.curve(2).error].map((one) => !Number.isNaN(one))"
    assert chromium.run(curve) == [True] * 12 + [False] * 8
    chromium.key("f")
    assert "leaves the truth's box" in chromium.run(said)
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
"""Has the sequence two dozen trackers."""


@browser.needs_browser
@pytest.mark.parametrize(("width", "height"), [(390, 844), (390, 667), (768, 1024), (1280, 720)])
def test_a_legend_of_many_trackers_is_read_in_every_window(shown, width, height):
    shown.size(width, height, mobile=width < 400)
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    shown.run(MANY)
    shown.wait("byId('legend').children.length === 25")
    assert shown.run("byId('legend').scrollWidth <= byId('legend').clientWidth")
    assert shown.run("byId('legend').scrollHeight > byId('legend').clientHeight")
    cut = (
        "[...byId('legend').children].filter((one) => {"
        " const { top, bottom } = one.getBoundingClientRect();"
        " const end = byId('legend').getBoundingClientRect().bottom;"
        " return top < end - 4 && bottom > end + 4; }).length"
    )
    assert shown.run(cut)  # which shows that there are more
    assert shown.run("byId('stage').getBoundingClientRect().height") > height / 5
    shown.run("choose({tracker: data.labels[20]})")
    shown.wait("inLegend(byId('legend').children[21])")
    shown.run("byId('legend').lastChild.focus()")
    assert shown.run("inLegend(byId('legend').lastChild)")
    at = shown.run("byId('legend').scrollTop")
    shown.key(" ")
    assert shown.run("byId('legend').lastChild.ariaPressed") == "true"
    assert shown.run("byId('legend').scrollTop") == pytest.approx(at, abs=40)  # its row is longer
