"""Runs by other protocols than one pass, on the page of a report."""

import json
import re
import zlib
from base64 import b64decode
from urllib.parse import urlencode

import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import Cells, data_of, named, seen
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.preset import State
from trackmark.bench.pages.report import Commands, write_report_page
from trackmark.bench.reporting.by_preset import beside_native, tables_by
from trackmark.bench.reporting.stored_runs import judged_runs
from trackmark.reports.page.film import ABSENT

PROTOCOLS = (
    "one-pass",
    "real-time:seconds=0.1",
    "supervised:threshold=0.6",
    "tre:starts=3",
    "anchors:spacing=20",
    "sre",
)


LENGTH = 60


@pytest.fixture(scope="module")
def by_protocols(drifting, tmp_path_factory, without_processes):
    """Runs of a tracker by several protocols, and their page."""
    folder = tmp_path_factory.mktemp("protocols")
    source = (SequenceSource("plain/target:length=60:scene=9:noise=30"),)
    for protocol in PROTOCOLS:
        asked = Experiment("trial", (drifting,), source, repetitions=2, protocol=protocol)
        with without_processes():
            made = bench.run(asked, folder, jobs=1)
    scored = beside_native(made, ["native"])
    said = Commands(str(made))
    path = folder / "report.html"
    tables = tables_by(made, ["native"], scored=scored)
    write_report_page(made, path, tables, "Trial", said, lambda *_: None)
    return made, path


def unpacked(text, frames):
    """Boxes of a page in pixels, (rows, frames, 4); NaN where there is none."""
    content = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8).reshape(4, -1)
    steps = np.ascontiguousarray(content.T).view("<i4").reshape(-1, frames, 4)
    whole = steps.cumsum(axis=1, dtype=np.int32)
    return np.where(whole == ABSENT, np.nan, whole / 10)


def test_runs_by_other_protocols_have_their_boxes_over_the_frames_they_are_of(by_protocols):
    folder, page = by_protocols
    text = page.read_text()
    assert "and no frames" not in text
    data = data_of(text)
    (scene,) = data["scenes"]
    boxes = unpacked(re.search(r'id="boxes-0">(.*?)</script>', text, re.S)[1], LENGTH)
    held = 0
    for row, run, truth in judged_runs(folder):
        name = row["tracker"]
        name += "" if row["protocol"] == "accuracy" else f" ({row['protocol']})"
        takes = [
            take for take in scene["takes"]
            if data["labels"][take[0]] == name and take[1] == row["repetition"]
        ]  # fmt: skip
        parts = run.segments or (np.arange(LENGTH),)
        assert [take[8] for take in takes] == [*range(len(parts))]
        pieces = np.split(run.boxes, np.cumsum([len(part) for part in parts])[:-1])
        for take, frames, piece in zip(takes, parts, pieces, strict=True):
            wanted = np.full((LENGTH, 4), np.nan)
            wanted[frames] = piece
            np.testing.assert_allclose(boxes[take[2]], wanted, atol=0.0501)
            judged = {frame for first, last in take[10] for frame in range(first, last + 1)}
            if run.segments:
                assert judged == {*frames[1:].tolist()}
                assert f"from frame {frames[0]}" in take[9]
            if run.states is not None:
                assert take[11] == [*np.flatnonzero(run.states == State.INITIALISED)[1:]]
                assert judged == {*np.flatnonzero(run.states >= State.FAILED).tolist()}
                held += len(take[11])
            if row["protocol"] == "accuracy":
                assert not judged
        assert np.isfinite(truth.boxes).all()
    assert held  # something was begun again


def test_a_number_by_another_protocol_opens_the_start_and_frame_that_are_worst(by_protocols):
    folder, page = by_protocols
    tables = Cells(page.read_text()).tables
    by = {
        protocol: name for name in tables for protocol in PROTOCOLS if name.startswith(protocol[:3])
    }
    worst = []
    for row, run, truth in judged_runs(folder, protocol="sre"):
        pieces = np.split(run.boxes, np.cumsum([len(part) for part in run.segments])[:-1])
        for number, (frames, piece) in enumerate(zip(run.segments, pieces, strict=True)):
            errors = centre_error(truth.boxes[frames], piece)[1:]
            furthest = int(frames[1:][np.argmax(errors)])
            worst.append((errors.mean(), row["repetition"], number, furthest))
    _, repetition, number, frame = max(worst)
    assert number  # not the first start, to which a link would lead anyhow
    links = {cell["link"] for row in tables[by["sre"]][1:] for cell in row if cell["link"]}
    wanted = f"%28sre%29&repetition={repetition}&frame={frame}&start={number}"
    assert any(link.endswith(wanted) for link in links)
    for name in PROTOCOLS:
        assert name == "one-pass" or any(
            cell["link"] for row in tables[by[name]][1:] for cell in row
        )


@browser.needs_browser
def test_the_player_shows_starts_and_where_a_tracker_was_begun_again(chromium, by_protocols):
    _, page = by_protocols
    chromium.console.clear()
    chromium.size(1280, 1000)
    chromium.open(page.as_uri())
    labels = chromium.run("data.labels")
    name = named("plain/target:length=60:scene=9:noise=30")
    (supervised,) = [one for one in labels if "supervised" in one]
    (tre,) = [one for one in labels if "tre" in one]
    shown = labels.index(supervised)
    chromium.run(f"location.hash = {json.dumps(urlencode({'sequence': name, 'frame': 1}))}")
    chromium.wait("scene && paintedFrame === 1")
    chromium.run(f"choose({{show: '{shown}', tracker: {json.dumps(supervised)}}})")
    mark = chromium.run(f"scene.take({shown}, 0, 0).marks[0]")
    seen(chromium, sequence=name, tracker=supervised, show=shown, repetition=0, frame=mark)
    assert "begun with the truth" in chromium.run("byId('told').textContent")
    seen(chromium, sequence=name, tracker=supervised, show=shown, repetition=0, frame=mark - 1)
    assert "not asked" in chromium.run("byId('told').textContent")
    tall = chromium.run("byId('told').clientHeight")
    seen(chromium, sequence=name, tracker=supervised, show=shown, repetition=0, frame=1)
    assert chromium.run("byId('told').textContent") == ""  # nothing was done: no name either
    assert chromium.run("byId('told').clientHeight") == tall  # and nothing moves
    assert chromium.run(f"Number.isNaN(scene.curve(scene.take({shown}, 0, 0).row).error[{mark}])")
    told = []
    for _ in range(4):
        chromium.key("f")
        told.append(chromium.run("byId('said').textContent"))
    assert any(f"begun again at frame {mark}." in one for one in told)
    assert chromium.run("byId('shown').parentNode.hidden")  # `show` knows runs in one pass alone
    number = labels.index(tre)
    seen(chromium, sequence=name, tracker=tre, show=number, repetition=1, frame=50)
    before = chromium.run("screen.toDataURL()")
    assert chromium.run("[...byId('start').options].length") == 3
    chromium.run("byId('start').value = '2'; byId('start').dispatchEvent(new Event('change'))")
    chromium.wait(f"screen.toDataURL() !== {json.dumps(before)}")
    assert chromium.run("state.get('start')") == "2"
    assert chromium.console == []
