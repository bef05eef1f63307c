"""Rules of report pages: accessible, complete without scripts, offline, small, and quiet."""

import os
import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import (
    canonical_name,
    check_accessibility,
    check_texts,
    failing_tracker,
    size_without_frames,
    violations,
    write_experiment_page,
)
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec

pytestmark = browser.needs_browser

LONG = "x" * 52

STILL = """

class Still:
    def init(self, image, box):
        self.box = box

    def update(self, image):
        return self.box
"""


@pytest.fixture(scope="module")
def write_extreme(tmp_path_factory, without_processes):
    """Provide a function that runs an experiment and writes its page."""
    folder = tmp_path_factory.mktemp("extremes")
    file = folder / "failing.py"
    file.write_text(failing_tracker(3) + STILL)

    def write(name, trackers, n_scenes):
        named = tuple(tracker.replace("FILE", str(file)) for tracker in trackers)
        scenes = (f"plain/target:length=12:scene={n}" for n in range(n_scenes))
        experiment = Experiment(name, named, tuple(map(SequenceSpec, scenes)))
        with without_processes():
            stored = run_experiment(experiment, folder / name, jobs=1)
        return write_experiment_page(stored, folder / "pages" / name)

    return write


@pytest.fixture(scope="module")
def extremes(write_extreme):
    """Provide pages of extreme experiments by name."""
    return {
        "one": write_extreme("one", ["static"], 1),
        "failed": write_extreme("failed", ["FILE:Failing"], 2),
        "ties": write_extreme("ties", ["FILE:Still:as=one", "FILE:Still:as=twin"], 2),
    }


@pytest.fixture(scope="module")
def many(write_extreme):
    """Provide a page of 11 trackers, nine of them with long names, on 14 sequences."""
    named = [f"FILE:Failing:as={LONG}{n}" for n in range(9)]
    return write_extreme("many", ["static", "camshift", *named], 14)


@pytest.mark.slow
def test_page_is_accessible_and_has_no_sideways_scroll(chromium, extremes, page, axe):
    check_accessibility(chromium, axe, (page, *extremes.values()), 390, dark=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("width", "dark"), [(1280, False), (1280, True), (390, False), (320, True)]
)
def test_page_of_any_width_is_accessible(chromium, extremes, page, many, axe, width, dark):
    check_accessibility(chromium, axe, (page, many, *extremes.values()), width, dark)
    check_texts(many)


SLOW = pytest.mark.slow


@pytest.mark.slow
@pytest.mark.parametrize(("width", "dark"), [(1280, True), pytest.param(390, False, marks=SLOW)])
def test_open_player_is_accessible(opened_page, axe, width, dark):
    opened_page.size(width, 844, dark=dark, mobile=width < 400, still=True)
    opened_page.run(f"choose({{sequence: {canonical_name('plain/target:length=60')!r}, frame: 3}})")
    opened_page.wait("dialog.open && paintedFrame === 3")
    assert violations(opened_page, axe) == []


def test_first_screen_has_answer_leaderboard_plot_and_a_loop(opened_page):
    opened_page.wait("document.querySelectorAll('.loop canvas').length >= 1")
    tops = "['h1', '.lead li', '#success svg', '.loop canvas'].map((one) =>"
    tops += " document.querySelector(one).getBoundingClientRect().top)"
    assert all(0 < top < 860 for top in opened_page.run(tops))


def test_page_is_complete_without_scripts_and_in_print(chromium, page):
    chromium.call("Emulation.setScriptExecutionDisabled", value=True)
    try:
        chromium.open(page.as_uri())
        count = "[...document.querySelectorAll('{}')].filter((one) => one.checkVisibility()).length"
        for media in ("screen", "print"):
            chromium.call("Emulation.setEmulatedMedia", media=media)
            assert chromium.run(count.format("#success .curve")) == 3
            assert chromium.run(count.format("#precision .curve")) == 3
            assert chromium.run(count.format("#speed-accuracy .mark")) >= 3
            assert chromium.run(count.format(".loop image")) == 6
            assert chromium.run(count.format("#heat tbody tr")) == 6
        assert chromium.run(count.format(".switch button")) == 0
    finally:
        chromium.call("Emulation.setEmulatedMedia", media="")
        chromium.call("Emulation.setScriptExecutionDisabled", value=False)


def test_player_opens_and_closes_by_keys(opened_page):
    cell = "document.querySelector('#heat tbody tr:nth-child(2) a')"
    opened_page.run(f"{cell}.focus()")
    opened_page.key("Enter")
    opened_page.wait("dialog.open && paintedFrame >= 0")
    assert opened_page.run("document.activeElement.id") == "curve"
    before = opened_page.run("frame")
    opened_page.key("ArrowLeft" if before else "ArrowRight")
    assert abs(opened_page.run("frame") - before) == 1
    opened_page.key("f")
    assert opened_page.run("byId('message').textContent")
    opened_page.key("Escape")
    opened_page.wait("!dialog.open")
    assert opened_page.run(f"document.activeElement === {cell}")


def test_loops_play_only_while_they_are_seen(opened_page):
    frames = "loops.map((loop) => loop.frame)"
    opened_page.wait(f"{frames}.some((frame, n) => frame !== loops[n].first)")

    def rests():
        opened_page.wait("loops.every((loop) => !loop.busy)")
        before = opened_page.run(frames)
        opened_page.run("new Promise((done) => setTimeout(done, 300))")
        return opened_page.run(frames) == before

    opened_page.click("#loops")
    assert opened_page.run("byId('loops').textContent") == "Play"
    assert rests()
    opened_page.click("#loops")
    opened_page.run("document.querySelector('footer').scrollIntoView({behavior: 'instant'})")
    opened_page.wait("loops.every((loop) => !loop.seen)")
    assert rests()
    opened_page.run("scrollTo({top: 0, behavior: 'instant'})")
    opened_page.wait("loops.some((loop) => loop.seen)")
    opened_page.run("document.querySelector('.loop').click()")
    opened_page.wait("dialog.open && paintedFrame >= 0")
    assert rests()


def test_nothing_moves_if_motion_is_reduced(chromium, page):
    chromium.size(1280, 900, still=True)
    chromium.open(page.as_uri())
    chromium.run("new Promise((done) => setTimeout(done, 300))")
    assert chromium.run("loops.every((loop) => loop.frame === loop.first && !loop.canvas)")
    assert chromium.run("byId('loops').textContent") == "Play"
    behaviour = "getComputedStyle(document.documentElement).scrollBehavior"
    assert chromium.run(behaviour) == "auto"
    moving = (
        "[...document.querySelectorAll('*')].filter((one) => { const style = getComputedStyle(one);"
        " return style.animationName !== 'none' || parseFloat(style.transitionDuration) > 0"
        " || ['MARQUEE', 'VIDEO'].includes(one.tagName); }).length"
    )
    assert chromium.run(moving) == 0
    chromium.click("#loops")
    chromium.wait("loops.some((loop) => loop.frame !== loop.first)")


@pytest.mark.slow
def test_captions_are_short_and_nothing_is_empty(extremes, page):
    check_texts(page, *extremes.values())


def test_extreme_pages_state_their_answer(extremes):
    answers = {
        name: re.search("<h1>(.*?)</h1>", path.read_text(), re.S)[1].replace("\u00a0", " ")
        for name, path in extremes.items()
    }
    assert answers["one"].startswith("static has a mean overlap of ")
    assert answers["failed"] == "There is no answer: all runs failed."
    equal = r"Mean overlap on these 2 scenes: one (0\.\d\d), twin \1\."
    assert re.fullmatch(equal, answers["ties"])
    for name in ("one", "failed", "ties"):
        text = extremes[name].read_text()
        main = re.sub("<.*?>", " ", text[text.index("<main") : text.index("</main>")])
        main = re.sub("to the left is better", "", main)
        assert not re.search(r"\b(best|better)\b", main)


def test_page_without_frames_is_small(page):
    assert size_without_frames(page.read_text()) < 170_000  # with the font


SCREENSHOTS = Path(__file__).parent / "screenshots"


@pytest.mark.slow
@pytest.mark.parametrize("width", [1280, 390])
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("view", ["page", "player"])
def test_page_looks_as_before(chromium, page, tmp_path, width, dark, view):
    """Compare small screenshots; `UPDATE_SCREENSHOTS=1` writes new ones, which a person checks."""
    chromium.size(width, 900 if width > 400 else 844, dark=dark, mobile=width < 400, still=True)
    chromium.open(page.as_uri())
    if view == "player":
        name = canonical_name("plain/target:length=60")
        chromium.run(f"choose({{sequence: {name!r}, frame: 30}})")
        chromium.wait("dialog.open && paintedFrame === 30")
        chromium.wait("[...byId('strip').children].some((one) => one.className === 'on')")
    chromium.shoot(tmp_path / "now.png")
    image = cv2.imread(str(tmp_path / "now.png"))
    small = cv2.resize(image, None, fx=0.125, fy=0.125, interpolation=cv2.INTER_AREA)
    stored = SCREENSHOTS / f"{view}-{width}-{'dark' if dark else 'light'}.png"
    if os.environ.get("UPDATE_SCREENSHOTS"):
        stored.parent.mkdir(exist_ok=True)
        cv2.imwrite(str(stored), small)
    before = cv2.imread(str(stored))
    assert before.shape == small.shape
    assert np.abs(before.astype(int) - small).mean() < 6  # fonts differ between machines
