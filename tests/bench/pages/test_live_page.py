"""Pages of `show --live`: all estimates of a tracker are on the page."""

import json
import re
import zlib
from base64 import b64decode, b64encode

import cv2
import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import data_of, frames_in, stored_runs
from trackmark import bench, datasets
from trackmark.bench.commands import show
from trackmark.bench.evaluation.loop import evaluate_run
from trackmark.bench.experiments.experiment import Experiment, ExperimentError, SequenceSpec
from trackmark.bench.pages.live_page import write_live_page

SEEING = '''
"""Returns all kinds of estimates at the init box."""
import numpy as np
from trackmark.trackers.base.interface import Estimate, TrackerPlugin


class Seeing(TrackerPlugin):
    """Returns all kinds of estimates."""

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
    source, path = SequenceSpec(SEQUENCE), folder / "live.html"
    with without_processes():
        (path,), failures = write_live_page(trackers, source, path, lambda *_: None)
    assert failures == []
    return path


@pytest.fixture
def player(chromium, page):
    chromium.console.clear()
    chromium.size(1280, 1000)
    chromium.open(page.as_uri())
    chromium.wait("sequence && paintedFrame === 0 && byId('player').open")
    yield chromium
    assert chromium.console == []


def block(page, name):
    return b64decode(re.search(f'id="{re.escape(name)}">(.*?)</script>', page.read_text())[1])


@pytest.mark.slow
def test_page_contains_estimates_of_each_frame(page):
    data = data_of(page.read_text())
    (sequence,) = data["sequences"]
    assert data["labels"] == ["seeing", "static"]
    keys = "is_ellipse", "maps", "numbers"
    assert [[run[key] for key in keys] for run in sequence["runs"]] == [
        [True, ["left", "right <b>"], True],
        [False, [], False],
    ]
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
    assert sequence["chunk_lengths"]["map0.0"] == [12]
    empty, second, *_ = frames_in(b64encode(block(page, "map0.0-0-0")))
    assert empty == b""  # the first frame has no map
    decoded = cv2.imdecode(np.frombuffer(second, np.uint8), 1)
    assert decoded[:, :40].mean() > 100 > 20 > decoded[:, -40:].mean()


@pytest.mark.slow
@browser.needs_browser
def test_player_shows_layers_maps_and_numbers(player):
    for number in range(1, 4):
        player.key("ArrowRight")
        player.wait(f"paintedFrame === {number} && paintedMap !== null")
        text = player.run("byId('values').textContent")
        assert "seeing: half_width" in text
        assert f"frame_number {number}" in text
    pixels = "screen.toDataURL()"
    seen = {player.run(pixels)}
    for key, layer in (("b", "boxes"), ("k", "masks"), ("n", "contours"), ("p", "particles")):
        player.key(key)
        button = f"byId('layers').querySelector('[data-layer={layer}]').ariaPressed"
        assert player.run(button) == "false"
        seen.add(player.run(pixels))
    assert len(seen) == 5  # each key removes something
    before = player.run(pixels)
    player.key("h")
    player.wait(f"state.get('map') === 'right <b>' && {pixels} !== '{before}'")
    assert player.run("byId('map-tracker').textContent") == "of seeing"
    player.key("h")
    player.wait("!state.has('map') && paintedMap === null")
    assert player.run("byId('map-tracker').textContent") == ""
    player.key("o")
    assert "No run on this sequence has revised boxes" in player.run("byId('message').textContent")
    player.run("choose({show: 'none', hide: 'boxes'}); 0")
    drawn = player.run(pixels)
    player.key("k")  # the mask of the ground truth
    assert player.run(pixels) != drawn


@browser.needs_browser
def test_frame_keeps_its_size_while_numbers_change(player):
    player.size(768, 1024)
    numbers = "sequence.runs.find((run) => run.numbers).numbers"
    player.run(f"{numbers}.much = [1, 2, 30, null].map((n) => n && 'x '.repeat(n)); 0")
    heights = []
    for frame in (2, 0, 1, 3):
        player.run(f"move({frame})")
        player.wait(f"paintedFrame === {frame}")
        heights.append(player.run("byId('view').clientHeight"))
    assert len(set(heights)) == 1


def first_box(text):
    """Return the box of the first run in frame 2."""
    content = zlib.decompress(b64decode(re.search(r'id="boxes-0">(.*?)</script>', text)[1]))
    planes = np.frombuffer(content, np.uint8).reshape(4, -1)
    steps = np.ascontiguousarray(planes.T).view("<i4").reshape(-1, 5, 4)
    return (steps[1, :3].sum(axis=0) / 50).tolist()


@pytest.mark.slow
def test_show_live_runs_the_requested_repetition(trackmark, workspace):
    trackers = "knob.py:Knob,static"
    run = ("run", "--trackers", trackers, "--sequences", "data/Small", "--name", "mine")
    trackmark(*run, "--repetitions", 3)
    stored = {
        row["repetition"]: run.boxes[2].tolist()
        for row, run, _ in stored_runs(workspace / "results" / "mine")
        if row["tracker"] == "knob.py:Knob"
    }
    assert stored[0] != stored[2]
    command = "show", "--live", trackers, "data/Small"
    for repetition, options in ((0, ()), (2, ("--repetition", 2))):
        trackmark(*command, *options)
        text = (workspace / "live.html").read_text()
        runs = data_of(text)["sequences"][0]["runs"]
        # A deterministic tracker has one repetition.
        assert [run["repetition"] for run in runs] == [repetition, 0]
        assert first_box(text) == pytest.approx(stored[repetition], abs=0.051)
        assert f"in repetition {repetition}. Select" in text
        ending = ", repetition 2" if repetition else ""
        assert f"on Small{ending}</title>" in text
        assert f"repetition={repetition}" in data_of(text)["start"]
    trackmark("show", "--live", "static", "data/Small", "--repetition", 2)
    text = (workspace / "live.html").read_text()
    assert "in repetition 0. Select" in text


def test_show_live_writes_a_page_of_a_failed_run(trackmark, break_tracker, workspace):
    break_tracker()
    run = ("show", "--live", "knob.py:Knob", "data/Small", "--output", "bad.html")
    assert "no idea" in trackmark(*run, status=1).stderr
    assert "no idea" in (workspace / "bad.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--live", "statik", "data/Small"), "static"),
        (("--live", "static", "data/Smal"), "data/Smal"),
        (("--live", "static", "data/Small", "--output", "a.png"), "not an .html"),
        (("--live", "static", "data/Small", "--frames", 3), "--frames and --live"),
        (("data/Small",), "--output"),
    ],
)
def test_show_live_refuses_wrong_arguments(trackmark, arguments, message):
    assert message in trackmark("show", *arguments, status=2).stderr


def test_arrays_are_stored_for_new_one_pass_runs(workspace, trackmark, monkeypatch):
    (workspace / "seeing.py").write_text(SEEING)
    run = ("run", "--trackers", "seeing.py:Seeing", "--sequences", "data/Small", "--name", "mine")
    trackmark(*run, "--arrays")
    trackmark("report", "results/mine")
    assert '"left"' in (workspace / "results" / "mine" / "report.html").read_text()
    drawn, read, strips = ("show", "data/Small", "--frames", 2, "--output"), show._boxes_of_runs, []
    for name in ("outlined.png", "boxes.png"):
        trackmark(*drawn, name, "--results", "results/mine")
        strips.append(cv2.imread(str(workspace / name)))
        monkeypatch.setattr(show, "_boxes_of_runs", lambda *arguments: (read(*arguments)[0], {}))
    assert (strips[0] != strips[1]).any(axis=2).sum() > 50  # the contour's pixels
    with pytest.raises(ExperimentError, match="one-pass"):
        Experiment("a", ("static",), (SequenceSpec("b"),), keeps_arrays=True, protocol="tre")
    assert "one-pass" in trackmark(*run, "--arrays", "--timing", status=2).stderr


def test_map_of_another_size_fails_the_run(make_sequence):
    class Wrong:
        def __init__(self, seed):
            pass

        def init(self, image, box, mask=None):
            self.box = box

        def update(self, image):
            return bench.evaluation.recorder.Estimate(self.box)

        def maps(self, image):
            return {"small": np.zeros((2, 2))}

    assert not evaluate_run(Wrong, make_sequence()).failure
    assert "map 'small'" in evaluate_run(Wrong, make_sequence(), keep_arrays=True).failure
