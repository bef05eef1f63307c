"""Trackers watched frame by frame: what they tell is on the page, and the player shows it."""

import json
import re
import zlib
from base64 import b64decode

import cv2
import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import data_of
from trackmark import bench, datasets
from trackmark.bench.commands import show
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSource
from trackmark.bench.pages.live_page import write_live_page
from trackmark.bench.reporting.pictures import scored_runs

SEEING = '''
"""Tells all that can be told, of where the target was at first."""
import numpy as np
from trackmark.trackers.base.interface import Estimate, TrackerPlugin


class Seeing(TrackerPlugin):
    """Sees much."""

    name = "seeing"

    def init(self, image, box, mask=None):
        self.box, self.frame = box, 0

    def update(self, image):
        self.frame += 1
        x, y, width, height = self.box
        mask = np.zeros(image.shape[:2], bool)
        mask[int(y) : int(y + height), int(x) : int(x + width)] = True
        corners = [[x, y], [x + width, y], [x + width / 2, y + height]]
        particles = np.array([[x, y, 9.0], [x + width, y + height, 9.0]])
        arrays = {"contour": np.array(corners), "particles": particles}
        arrays["weights"] = np.array([0.2, 0.8])
        details = {"half_width": width / 2, "half_height": height / 2}
        details["frame_number"] = float(self.frame)
        return Estimate(self.box, mask=mask, details=details, arrays=arrays)

    def maps(self, image):
        weights = np.zeros(image.shape[:2])
        weights[:, : image.shape[1] // 2] = 1.0
        return {"left": weights, "right <b>": 1 - weights}
'''
SEQUENCE = "plain/target:length=12"


@pytest.fixture(scope="module")
def page(tmp_path_factory, without_processes):
    folder = tmp_path_factory.mktemp("live")
    (folder / "seeing.py").write_text(SEEING)
    trackers = [f"{folder / 'seeing.py'}:Seeing", "static"]
    with without_processes():
        (path,), failures = write_live_page(
            trackers, SequenceSource(SEQUENCE), folder / "live.html", lambda *_: None
        )
    assert failures == []
    return path


def block(page, name):
    return b64decode(re.search(f'id="{re.escape(name)}">(.*?)</script>', page.read_text())[1])


def test_a_live_page_holds_what_trackers_tell_of_each_frame(page):
    data = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text(), re.S)[1])
    (scene,) = data["scenes"]
    assert data["labels"] == ["seeing", "static"]
    assert scene["takes"][0][5:8] == [True, ["left", "right <b>"], True]
    assert scene["takes"][1][5:8] == [False, [], False]
    x, y, width, height = datasets.load(SEQUENCE).boxes[0].round(1)
    true, shapes = json.loads(zlib.decompress(block(page, "shapes-0"))).values()
    mask = datasets.load(SEQUENCE).mask(7)
    drawn = np.zeros(mask.shape, np.uint8)
    outlines = [np.int32(np.float64(line) - 0.5) for line in true["7"]["masks"]]
    cv2.fillPoly(drawn, outlines, 1)
    assert np.array_equal(drawn.astype(bool), mask)
    assert list(shapes) == [str(frame) for frame in range(1, 12)]
    assert shapes["7"]["particles"] == [
        [pytest.approx(x, abs=0.1), pytest.approx(y, abs=0.1), 0.25],
        [pytest.approx(x + width, abs=0.1), pytest.approx(y + height, abs=0.1), 1.0],
    ]
    assert len(shapes["7"]["contours"][0]) == 3
    assert len(shapes["7"]["masks"]) == 1
    numbers = json.loads(zlib.decompress(block(page, "numbers-0-0")))
    assert numbers["frame_number"] == [None, *range(1, 12)]
    (sizes,) = scene["reels"]["map0.0"]
    assert sizes[0] == 0  # of the first frame the tracker told nothing
    film = block(page, "map0.0-0-0")
    shown = cv2.imdecode(np.frombuffer(film[: sizes[1]], np.uint8), 1)
    assert shown[:, :40].mean() > 100 > 20 > shown[:, -40:].mean()


@browser.needs_browser
def test_the_player_opens_on_it_and_lays_over_what_is_chosen(chromium, page):
    chromium.console.clear()
    chromium.size(1280, 1000)
    chromium.open(page.as_uri())
    chromium.wait("scene && paintedFrame === 0 && byId('player').open")
    for number in range(1, 4):
        chromium.key("ArrowRight")
        chromium.wait(f"paintedFrame === {number} && paintedMap !== null")
        assert "seeing: half_width" in chromium.run("byId('told').textContent")
        assert f"frame_number {number}" in chromium.run("byId('told').textContent")
    pixels = "screen.toDataURL()"
    seen = {chromium.run(pixels)}
    for key, layer in (("b", "boxes"), ("k", "masks"), ("n", "contours"), ("p", "particles")):
        chromium.key(key)
        button = f"byId('layers').querySelector('[data-layer={layer}]').ariaPressed"
        assert chromium.run(button) == "false"
        seen.add(chromium.run(pixels))
    assert len(seen) == 5  # each key takes something away
    assert chromium.run("[...state.get('hide').split('.')].sort()") == [
        "boxes", "contours", "masks", "particles"
    ]  # fmt: skip
    before = chromium.run(pixels)
    chromium.key("h")
    chromium.wait(f"state.get('map') === 'right <b>' && {pixels} !== '{before}'")
    assert chromium.run("byId('whose').textContent") == "of seeing"
    chromium.key("h")
    chromium.wait("!state.has('map') && paintedMap === null")
    assert chromium.run("byId('whose').textContent") == ""
    chromium.key("o")
    assert "No run here was revised" in chromium.run("byId('said').textContent")
    assert not chromium.run("state.has('trace')")
    chromium.key("Escape")
    chromium.wait("!byId('player').open")
    assert chromium.console == []


def test_show_live_writes_a_page_also_of_a_tracker_that_fails(trackmark, here, spoil):
    trackmark("show", "--live", "static", "data/Small")
    assert "<dialog" in (here / "live.html").read_text()
    spoil()
    run = ("show", "--live", "knob.py:Knob", "data/Small", "--output", "bad.html")
    assert "no idea" in trackmark(*run, status=1).stderr
    assert "(failed)" not in (here / "bad.html").read_text().split("<script")[0]
    assert "no idea" in (here / "bad.html").read_text()


def first_boxes(text, numbers):
    """What the runs of these take numbers say of frame 2, to a tenth of a pixel."""
    content = zlib.decompress(b64decode(re.search(r'id="boxes-0">(.*?)</script>', text)[1]))
    planes = np.frombuffer(content, np.uint8).reshape(4, -1)
    steps = np.ascontiguousarray(planes.T).view("<i4").reshape(-1, 5, 4)
    return [(steps[1 + number, :3].sum(axis=0) / 10).tolist() for number in numbers]


@browser.needs_browser
def test_show_live_runs_another_repetition_and_says_which(trackmark, here, chromium):
    asked = ("knob.py:Knob,static", "data/Small")
    trackmark("show", "--live", *asked)
    trackmark("show", "--live", *asked, "--repetition", 2, "--output", "second.html")
    run = ("run", "--trackers", asked[0], "--sequences", asked[1], "--seeds", 3, "--name", "mine")
    trackmark(*run)
    stored = {
        row["repetition"]: run.boxes[2].tolist()
        for row, run, _ in scored_runs(here / "results" / "mine")
        if row["tracker"] == "knob.py:Knob"
    }
    for name, repetition in (("live.html", 0), ("second.html", 2)):
        text = (here / name).read_text()
        takes = data_of(text)["scenes"][0]["takes"]
        assert [take[1] for take in takes] == [repetition, 0]  # what never draws has one
        assert first_boxes(text, [0]) == [pytest.approx(stored[repetition], abs=0.051)]
    assert stored[0] != stored[2]
    said = "repetition 2 of trackers that draw random numbers"
    assert said in text
    assert said.replace("2", "0") in (here / "live.html").read_text()
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open((here / "second.html").as_uri())
    chromium.wait("scene && paintedFrame === 0 && byId('player').open")
    assert chromium.run("byId('repetition').selectedOptions[0].text") == "2"
    assert chromium.run("document.title").endswith("Small, repetition 2")
    assert chromium.console == []
    trackmark("show", "--live", "static", "data/Small", "--repetition", 2, "--output", "one.html")
    said = "No tracker here draws random numbers: every repetition is the same."
    assert said in (here / "one.html").read_text()


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("--live", "statik", "data/Small"), "static"),
        (("--live", "static", "data/Smal"), "data/Smal"),
        (("--live", "", "data/Small"), "names no tracker"),
        (("--live", "static", "data/Small", "--output", "a.png"), "not an .html"),
        (("--live", "static", "data/Small", "--frames", 3), "--frames and --live"),
        (("--live", "static", "data/Small/img"), "truth"),
        (("data/Small",), "--output"),
    ],
)
def test_show_live_says_what_is_wrong(trackmark, given, said):
    assert said in trackmark("show", *given, status=2).stderr


def test_arrays_are_kept_of_new_runs_in_one_pass(here, trackmark, monkeypatch):
    stored = show._stored
    (here / "seeing.py").write_text(SEEING)
    run = ("run", "--trackers", "seeing.py:Seeing", "--sequences", "data/Small", "--name", "mine")
    trackmark(*run, "--arrays")
    assert list((here / "results" / "mine").rglob("*.arrays.*"))
    trackmark("report", "results/mine")
    assert '"left"' in (here / "results" / "mine" / "report.html").read_text()
    drawn = ("show", "data/Small", "--frames", 2, "--output")
    trackmark(*drawn, "outlined.png", "--results", "results/mine")
    strips = [cv2.imread(str(here / "outlined.png"))]
    monkeypatch.setattr(show, "_stored", lambda *arguments: (stored(*arguments)[0], {}))
    trackmark(*drawn, "boxes.png", "--results", "results/mine")
    strips.append(cv2.imread(str(here / "boxes.png")))
    assert (strips[0] != strips[1]).any(axis=2).sum() > 50  # the contour's pixels
    with pytest.raises(ExperimentError, match="one pass"):
        Experiment("a", ("static",), (SequenceSource("b"),), arrays=True, protocol="tre")
    assert "one pass" in trackmark(*run, "--arrays", "--timing", status=2).stderr


def test_a_map_of_another_size_fails_the_run(make_sequence):
    class Wrong:
        def __init__(self, seed):
            pass

        def init(self, image, box, mask=None):
            self.box = box

        def update(self, image):
            return bench.evaluation.recorder.Estimate(self.box)

        def maps(self, image):
            return {"small": np.zeros((2, 2))}

    assert not bench.evaluate(Wrong, make_sequence()).failure
    assert "map 'small'" in bench.evaluate(Wrong, make_sequence(), keep_arrays=True).failure


@browser.needs_browser
def test_the_player_draws_the_true_mask_of_a_sequence_that_has_one(chromium, page):
    chromium.console.clear()
    chromium.size(1280, 1000)
    chromium.open(page.as_uri())
    chromium.wait("scene && paintedFrame === 0 && byId('player').open")
    chromium.run("choose({show: 'none', hide: 'boxes'}); 0")
    drawn = chromium.run("screen.toDataURL()")
    chromium.key("k")
    assert chromium.run("screen.toDataURL()") != drawn
    assert chromium.console == []


@browser.needs_browser
def test_the_frame_keeps_its_size_while_numbers_change(chromium, page):
    chromium.size(768, 1024)
    chromium.open(page.as_uri())
    chromium.wait("scene && paintedFrame === 0 && byId('player').open")
    told = "scene.takes.find((take) => take.numbers).numbers"
    chromium.run(f"{told}.much = [1, 2, 30, null].map((n) => n && 'x '.repeat(n)); 0")
    heights = []
    for frame in (2, 0, 1, 3):
        chromium.run(f"move({frame})")
        chromium.wait(f"paintedFrame === {frame}")
        chromium.run("{ const it = byId('legend').children[1].lastChild;"
                     " it.textContent = it.textContent && '0.00 · no box'; } 0")  # fmt: skip
        heights.append(chromium.run("byId('stage').clientHeight"))
    assert len(set(heights)) == 1
