"""How large and how quick the page of many runs is; what is measured is told.

Times are judged by limits that only a page that is broken exceeds, also on a busy machine.
"""

import json
import time
from urllib.parse import urlencode

import numpy as np
import pytest

from tests import browser
from trackmark.bench.evaluation.run_record import Run
from trackmark.bench.execution.plan import make_plan
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.experiments.tracker_spec import identify
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.tables import tables
from trackmark.bench.store.results import Results
from trackmark.bench.store.truth import write_truth
from trackmark.datasets import load

TRACKERS = ("camshift", "mean-shift", "particle-filter", "opencv-mil", "multipart", "wang2010")
MEGABYTE = 1_000_000

SEEKS = """(async () => {
  const took = [];
  for (let i = 0; i < 200; i++) {
    const began = performance.now();
    await seek((i * 7919) % scene.frames);
    took.push(performance.now() - began);
  }
  return took;
})()"""

SEEKS_FULL = """(async () => {
  const took = [];
  for (let i = 0; i < 100; i++) {
    const number = (i * 7919) % scene.frames, began = performance.now();
    move(number);
    while (paintedFrame !== number || painted?.width !== 640)
      await new Promise(requestAnimationFrame);
    took.push(performance.now() - began);
  }
  return took;
})()"""
"""Until the frame of its own size is seen, to the next time that the screen is drawn."""

CLICKED = """window.took = new Promise((done) => addEventListener("click", (event) => {
  const look = () => (painted?.width === 640
    ? done(performance.now() - event.timeStamp) : requestAnimationFrame(look));
  look();
}, { capture: true, once: true })); 0"""
"""Has it kept how long the first frame of its own size takes from a click on."""

FIRST, SEEK, PACE = 5.0, 2.0, 3.0  # seconds, seconds (p95), frames a second

PLAYS = """(async () => {
  const before = frame, began = performance.now();
  play();
  await new Promise((done) => setTimeout(done, 4000));
  const seen = frame - before, took = performance.now() - began;
  stop();
  return 1000 * seen / took;
})()"""


def stored(folder, sequences, repetitions):
    """Results of trackers that walk at random around the truth."""
    sources = tuple(map(SequenceSource, sequences))
    asked = Experiment("many", TRACKERS, sources, repetitions=repetitions)
    results = Results(folder / "many")
    plan = make_plan(asked, results)
    results.prepare(plan.asked())
    rng = np.random.default_rng(0)
    for number in range(len(sequences)):
        sequence = load(plan.sequences[number].source.text)
        write_truth(results.folder, sequence)
        n = len(sequence)
        for chosen in plan.trackers.values():
            for repetition in range(repetitions):
                walk = rng.normal(0, 1.5, (n, 2)).cumsum(axis=0)
                boxes = sequence.boxes + np.hstack([walk, rng.normal(0, 0.5, (n, 2)).round(2)])
                boxes[0] = sequence.boxes[0]
                boxes[:, 2:] = boxes[:, 2:].clip(2)
                told = {"visible": np.ones(n, bool), "confidence": np.full(n, np.nan)}
                told["circumstances"] = {"source": sequences[number]}  # its frames are there
                run = Run(identify(chosen, sequence, repetition), boxes=boxes, **told)
                assert results.write(run)
    return results.folder


@pytest.mark.slow
@pytest.mark.parametrize(("count", "length", "repetitions"), [(8, 400, 20), (100, 120, 2)])
def test_a_page_of_many_runs_opens(tmp_path, evidence, count, length, repetitions):
    names = [f"plain/target:length={length}:width=640:height=480:scene={n}" for n in range(count)]
    folder = stored(tmp_path, names, repetitions)
    made = tables(folder)
    began = time.monotonic(), time.process_time()
    page, *beside = write_report_page(
        folder, tmp_path / "report.html", made, "Many", Commands("many"), lambda *_: None
    )
    seconds, cpu = time.monotonic() - began[0], time.process_time() - began[1]
    size = page.stat().st_size
    evidence(
        f"page of {count} sequences, {length} frames each: {size / MEGABYTE:.1f} MB and "
        f"{len(beside)} files beside it, written in {seconds:.0f} s ({cpu:.0f} s CPU)"
    )
    assert size < 25 * MEGABYTE
    if browser.CHROMIUM is None:
        pytest.skip("no Chromium on PATH: the page is written, and not opened")
    opened = browser.Browser(tmp_path / "profile")
    try:
        opened.size(1280, 900)
        opened.open(page.as_uri())
        loading = "performance.getEntriesByType('navigation')[0].loadEventEnd"
        evidence(f"opens in {opened.wait(loading) / 1000:.2f} s")
        asked = json.dumps(urlencode({"sequence": load(names[-1]).name, "frame": 50}))
        opened.run(
            "window.took = new Promise((done) => { const began = performance.now();"
            "const look = () => paintedFrame === 50 ? done(performance.now() - began)"
            f" : requestAnimationFrame(look); location.hash = {asked}; look(); }}); 0"
        )
        evidence(f"first frame after {opened.run('took'):.0f} ms")
        seeks = opened.run(SEEKS)
        evidence(f"seek: median {np.median(seeks):.1f} ms, p95 {np.quantile(seeks, 0.95):.1f} ms")
        opened.run("scene.fps = 60; move(0)")  # the sequence's own pace is 25
        evidence(f"plays {opened.run(PLAYS):.1f} frames a second where 60 are asked for")
        assert opened.console == []
    finally:
        opened.close()


@pytest.mark.slow
@browser.needs_browser
def test_the_player_is_quick_with_frames_of_their_own_size(tmp_path, evidence):
    names = [f"plain/target:length=300:width=640:height=480:scene={n}" for n in range(2)]
    folder = stored(tmp_path, names, 2)
    page, *_ = write_report_page(
        folder, tmp_path / "report.html", tables(folder), "Many", Commands("many"), lambda *_: None,
        full=True,
    )  # fmt: skip
    assert len(list((tmp_path / "report-frames").glob("full-*.js"))) > 2
    opened = browser.Browser(tmp_path / "profile")
    try:
        opened.size(1366, 768)
        opened.open(page.as_uri())
        opened.run(CLICKED)
        opened.click("#heat tbody tr:nth-child(2) td:nth-child(3) a")
        first = opened.run("took") / 1000
        assert opened.run("shownTrackers().length") == len(TRACKERS)
        seeks = np.array(opened.run(SEEKS_FULL)) / 1000
        opened.run("scene.fps = 60; move(0)")  # the sequence's own pace is 25
        pace = opened.run(PLAYS)
        evidence(
            f"first frame {first:.3f} s after a click, a seek {np.median(seeks) * 1000:.0f} ms "
            f"(p95 {np.quantile(seeks, 0.95) * 1000:.0f} ms), {pace:.0f} frames a second of 60"
        )
        assert first < FIRST
        assert np.quantile(seeks, 0.95) < SEEK
        assert pace > PACE
        assert opened.console == []
    finally:
        opened.close()
