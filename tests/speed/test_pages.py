"""Size of a report page, time to write it, and speed of its player; `make bench` prints them."""

import time

import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import write_experiment_page
from tests.bench.pages.test_page_size import MEGABYTE, stored
from tests.speed.rivals import print_ratio
from trackmark.datasets import load

pytestmark = browser.needs_browser

SCENES = [f"plain/target:length=400:width=640:height=480:scene={n}" for n in range(8)]
SEEKS, PLAYED_SECONDS = 100, 4


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Write a page of 8 sequences, 6 trackers and 20 repetitions; print its size and time."""
    folder = stored(tmp_path_factory.mktemp("stored"), SCENES, 20)
    began = time.perf_counter()
    path = write_experiment_page(folder, tmp_path_factory.mktemp("page"))
    seconds = time.perf_counter() - began
    print_ratio(
        f"page of 8 x 6 x 20 runs: {path.stat().st_size / MEGABYTE:.1f} MB in {seconds:.1f} s"
    )
    return path


@pytest.fixture(scope="module")
def opened(page, tmp_path_factory):
    """Open the page in a window of 1280 by 900 pixels."""
    chromium = browser.Browser(tmp_path_factory.mktemp("profile"))
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    yield chromium
    chromium.close()


def milliseconds_to(opened, action, frame):
    """Return the time from an action to the painted frame [ms], measured in the page."""
    return opened.run(
        f"new Promise((done) => {{ const began = performance.now(); {action};"
        f" const look = () => dialog.open && paintedFrame === {frame}"
        " ? done(performance.now() - began) : requestAnimationFrame(look); look(); })"
    )


def test_player_shows_frames_at_once(opened):
    name = load(SCENES[3]).name
    first = milliseconds_to(opened, f"choose({{sequence: {name!r}, frame: 7}})", 7)
    frames = np.random.default_rng(0).integers(1, 400, SEEKS)
    seeks = [
        milliseconds_to(opened, f"choose({{sequence: {name!r}, frame: {frame}}})", frame)
        for frame in frames
    ]
    p95 = np.percentile(seeks, 95)
    print_ratio(
        f"first frame after {first:.0f} ms; seek: p95 {p95:.0f} ms, max {max(seeks):.0f} ms"
    )


def test_player_keeps_its_rate_with_six_trackers(opened):
    name = load(SCENES[3]).name
    milliseconds_to(opened, f"choose({{sequence: {name!r}, frame: 1}})", 1)
    # At double speed, 50 frames per second are wanted.
    opened.run("document.querySelector('#speed').value = '2'")
    opened.key(" ")
    painted = opened.run(
        "new Promise((done) => { const seen = new Set(), began = performance.now();"
        " const look = () => { seen.add(paintedFrame);"
        f" performance.now() - began > {PLAYED_SECONDS * 1000} ? done(seen.size)"
        " : requestAnimationFrame(look); }; look(); })"
    )
    opened.key(" ")
    print_ratio(f"playing: {painted / PLAYED_SECONDS:.1f} frames per second")
