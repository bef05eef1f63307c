"""Runs by other protocols than one-pass on the page of a report."""

import json
import re
import zlib
from base64 import b64decode
from urllib.parse import urlencode

import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import (
    Cells,
    canonical_name,
    data_of,
    open_frame,
    stored_runs,
    write_experiment_page,
)
from trackmark.bench.analysis.by_metrics import metric_tables
from trackmark.bench.execution.executor import run_experiment
from trackmark.bench.experiments.experiment import Experiment, SequenceSpec
from trackmark.bench.metrics.boxes import centre_error
from trackmark.bench.metrics.interface import FrameState
from trackmark.bench.pages.player_frames import ABSENT
from trackmark.bench.store.runs import Runs

SOURCE = "plain/target:length=60:scene=9:noise=30"
LENGTH = 60
PROTOCOLS = (
    "real-time:update_seconds=0.1",
    "supervised:threshold=0.6",
    "tre:starts=3",
    "anchors:spacing=20",
    "sre",
    "one-pass",
)


@pytest.fixture(scope="module")
def by_protocols(drifting, tmp_path_factory, without_processes):
    """Provide runs of a tracker by several protocols, and their page."""
    folder = tmp_path_factory.mktemp("protocols")
    for protocol in PROTOCOLS:
        sources = (SequenceSpec(SOURCE),)
        experiment = Experiment("trial", (drifting,), sources, repetitions=2, protocol=protocol)
        with without_processes():
            stored = run_experiment(experiment, folder, jobs=1)
        if protocol == "real-time:update_seconds=0.1":
            text = write_experiment_page(stored, folder / "first").read_text()
            assert "There is no comparison: there are no one-pass runs." in text
    tables, _ = metric_tables(Runs.open(stored), ["native"])
    return stored, write_experiment_page(stored, folder, tables)


def unpacked(text, frames):
    """Return boxes of a page in pixels, (rows, frames, 4); NaN if missing."""
    content = np.frombuffer(zlib.decompress(b64decode(text)), np.uint8).reshape(4, -1)
    steps = np.ascontiguousarray(content.T).view("<i4").reshape(-1, frames, 4)
    whole = steps.cumsum(axis=1, dtype=np.int32)
    return np.where(whole == ABSENT, np.nan, whole / 50)


@pytest.mark.slow
def test_segments_have_boxes_in_their_frames(by_protocols):
    folder, page = by_protocols
    text = page.read_text()
    data = data_of(text)
    (sequence,) = data["sequences"]
    boxes = unpacked(re.search(r'id="boxes-0">(.*?)</script>', text, re.S)[1], LENGTH)
    restarts = 0
    runs = Runs.open(folder)
    for row, run, _ in runs.read(runs.evaluated_rows()):
        name = row["tracker"]
        name += "" if row["protocol"] == "one-pass" else f" ({row['protocol']})"
        number = data["labels"].index(name)
        key = number, row["repetition"]
        parts_of_run = [p for p in sequence["runs"] if (p["tracker"], p["repetition"]) == key]
        earlier = sequence["runs"][: sequence["runs"].index(parts_of_run[0])]
        # The ground truth and revised boxes have rows of their own.
        first = 1 + sum(1 + part["has_revised"] for part in earlier)
        parts = run.segments or (np.arange(LENGTH),)
        assert [part["start"] for part in parts_of_run] == [*range(len(parts))]
        pieces = np.split(run.boxes, np.cumsum([len(part) for part in parts])[:-1])
        for part, frames, piece in zip(parts_of_run, parts, pieces, strict=True):
            wanted = np.full((LENGTH, 4), np.nan)
            wanted[frames] = piece
            np.testing.assert_allclose(
                boxes[first + part["start"] * (1 + part["has_revised"])], wanted, atol=0.0501
            )
            judged = {frame for first, last in part["scored"] for frame in range(first, last + 1)}
            if run.segments:
                assert judged == {*frames[1:].tolist()}
                assert f"from frame {frames[0]}" in part["start_label"]
            if run.states is not None:
                assert part["restarts"] == [
                    *np.flatnonzero(run.states == FrameState.INITIALISED)[1:]
                ]
                assert judged == {*np.flatnonzero(run.states >= FrameState.FAILED).tolist()}
                restarts += len(part["restarts"])
            assert judged or row["protocol"] == "one-pass"
    assert restarts


@pytest.mark.slow
def test_number_opens_the_worst_segment_and_frame(by_protocols):
    folder, page = by_protocols
    tables = Cells(page.read_text()).tables
    worst = []
    for row, run, truth in stored_runs(folder, protocol="sre"):
        pieces = np.split(run.boxes, np.cumsum([len(part) for part in run.segments])[:-1])
        for number, (frames, piece) in enumerate(zip(run.segments, pieces, strict=True)):
            errors = centre_error(truth.boxes[frames], piece)[1:]
            furthest = int(frames[1:][np.argmax(errors)])
            worst.append((errors.mean(), row["repetition"], number, furthest))
    _, repetition, number, frame = max(worst)
    assert number  # not the first segment, which any link could open
    links = {
        name: {cell["link"] for row in rows[1:] for cell in row if cell["link"]}
        for name, rows in tables.items()
    }
    wanted = f"%28sre%29&repetition={repetition}&frame={frame}&start={number}"
    assert any(link.endswith(wanted) for link in links["sre-metrics-native"])
    for protocol in PROTOCOLS[:-1]:
        assert any(links[name] for name in tables if name.startswith(protocol[:3]))


@browser.needs_browser
def test_player_shows_segments_and_restarts(chromium, by_protocols):
    _, page = by_protocols
    chromium.console.clear()
    chromium.size(1280, 1000)
    chromium.open(page.as_uri())
    labels, name, text = (
        chromium.run("data.labels"),
        canonical_name(SOURCE),
        "byId('values').textContent",
    )
    supervised, tre = (
        next(label for label in labels if word in label) for word in ("supervised", "tre")
    )
    number = labels.index(supervised)
    address = {"sequence": name, "tracker": supervised, "show": number, "repetition": 0}
    chromium.run(f"location.hash = {json.dumps(urlencode({'sequence': name, 'frame': 1}))}")
    chromium.wait("sequence && paintedFrame === 1")
    mark = chromium.run(f"sequence.run({number}, 0, 0).restarts[0]")
    heights = []
    expected = (mark, "initialised with the ground-truth box"), (mark - 1, "skipped"), (1, "")
    for frame, words in expected:
        open_frame(chromium, **address, frame=frame)
        visible_text = chromium.run(text)
        assert words in visible_text if words else visible_text == ""
        heights.append(chromium.run("byId('values').clientHeight"))
    assert len({*heights[1:]}) == 1  # nothing moves
    assert chromium.run(
        f"Number.isNaN(sequence.curve(sequence.run({number}, 0, 0).row).error[{mark}])"
    )
    messages = []
    for _ in range(4):
        chromium.key("f")
        messages.append(chromium.run("byId('message').textContent"))
    assert any(f"is restarted at frame {mark}." in message for message in messages)
    open_frame(chromium, sequence=name, tracker=tre, show=labels.index(tre), repetition=1, frame=50)
    before = chromium.run("screen.toDataURL()")
    assert chromium.run("[...byId('start').options].length") == 3
    chromium.run("byId('start').value = '2'; byId('start').dispatchEvent(new Event('change'))")
    chromium.wait(f"screen.toDataURL() !== {json.dumps(before)}")
    assert chromium.run("state.get('start')") == "2"
    assert chromium.console == []
