"""The page of a report: its numbers, and the frames behind them, driven in a browser."""

import csv
import json
import re
import shutil
import zlib
from base64 import b64decode
from html.parser import HTMLParser
from urllib.parse import urlencode

import cv2
import numpy as np
import pytest

import bench
import datasets
from bench.experiments.experiment import Experiment, SequenceSource
from bench.metrics.centre_error import centre_error, centre_inside
from bench.metrics.overlap import overlap
from bench.metrics.preset import State
from bench.pages.report import Said, write_report_page
from bench.reporting.by_preset import beside_native, tables_by
from bench.reporting.pictures import judged_runs, scored_runs
from bench.reporting.tables import tables
from reports.page import page as pages
from reports.page.film import ABSENT
from tests import browser

HOSTILE = "</script><script>alert('x')</script> \"q\" & ключ 跟踪"

DRIFTING = '''
"""Goes astray, each time another way."""
from trackers.base.interface import Estimate, Randomness, TrackerPlugin


class Drifting(TrackerPlugin):
    """Drifts."""

    randomness = Randomness.GENERATOR

    def init(self, image, box, mask=None):
        import numpy
        self.box, self.random = box, numpy.random.default_rng(self.seed)

    def update(self, image):
        self.box = self.box + [*self.random.normal(0.5, 1.5, 2), 0, 0]
        return Estimate(self.box)

    def finish(self):
        return {3: self.box}
'''


class Cells(HTMLParser):
    """Tables of a page, as somebody reads them who knows nothing of ours."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.links, self.tags = {}, [], []
        self._table = self._row = self._cell = None
        self.feed(text)

    def handle_starttag(self, tag, given):
        told = dict(given)
        self.tags.append(tag)
        if tag == "table":
            self._table = self.tables[told["id"]] = []
        if tag == "tr":
            self._row = []
            self._table.append(self._row)
        if tag in ("td", "th"):
            self._cell = {"text": "", "value": told.get("data-value"), "link": None}
            self._row.append(self._cell)
        if tag == "a" and self._cell is not None:
            self._cell["link"] = told["href"]

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._cell = None

    def handle_data(self, text):
        if self._cell is not None:
            self._cell["text"] += text


@pytest.fixture(autouse=True)
def without_plots(monkeypatch):
    """Plots and film strips are other tests' matter, and take longer than pages."""
    monkeypatch.setattr("bench.reporting.pictures.write_pictures", lambda *_: [])
    monkeypatch.setattr("bench.pages.paper.write_figure", lambda path, _: path)


@pytest.fixture(scope="module")
def results(tmp_path_factory, without_processes):
    folder = tmp_path_factory.mktemp("paged")
    (folder / "drifting.py").write_text(DRIFTING)
    sources = [f"plain/target:length=60:scene={n}" for n in range(5)]
    sources += ["plain/target:length=60:scene=9:noise=30"]
    trackers = ("static", "camshift", f"{folder / 'drifting.py'}:Drifting")
    asked = Experiment("trial", trackers, tuple(map(SequenceSource, sources)), repetitions=3)
    with without_processes():
        return bench.run(asked, folder, jobs=1)


def written(experiment, folder, **options):
    """The page of an experiment."""
    said = Said(str(experiment))
    made = tables(experiment)
    paths = write_report_page(
        experiment, folder / "report.html", made, "Trial", said, lambda *_: None, **options
    )
    return paths[0]


@pytest.fixture(scope="module")
def page(results, tmp_path_factory):
    return written(results, tmp_path_factory.mktemp("page"))


@pytest.fixture
def shown(chromium, page):
    """The page in a browser that has nothing to complain of."""
    chromium.open("data:text/html,")  # what the page before has still to say is its own matter
    chromium.console.clear()
    chromium.size(1280, 900)
    chromium.open(page.as_uri())
    yield chromium
    assert chromium.console == []


def state(shown):
    return dict(shown.run("[...state]"))


def named(text):
    """A sequence's canonical name."""
    return datasets.load(text).name


def seen(shown, **address):
    """Open the player at an address, and wait for its frame."""
    shown.run(f"location.hash = {json.dumps(urlencode(address))}")
    number = address["frame"]
    name = json.dumps(address["sequence"])
    shown.wait(f"scene && scene.name === {name} && paintedFrame === {number}")


def test_numbers_on_the_page_are_those_of_csv_and_json(trackmark, here):
    trackers = "static,camshift,knob.py:Knob"
    where = "plain/target:length=20:noise=10,plain/target:length=20:noise=30,data/Small"
    trackmark("run", "--trackers", trackers, "--sequences", where, "--seeds", 2, "--name", "mine")
    trackmark("report", "results/mine", "--folder", "report", "--metrics", "native,otb")
    said = trackmark("report", "results/mine", "--json", "--metrics", "native,otb").stdout
    told = {one["table"]: one["rows"] for one in map(json.loads, said.splitlines())}
    page = (here / "report" / "report.html").read_text()
    shown = Cells(page).tables
    assert told.keys() == shown.keys()
    assert {"summary", "sequences", "metrics-otb", "heat", "comparison", "comparison-pairs",
            "parts", "comparison-parts", "trackers", "circumstances"} <= told.keys()  # fmt: skip
    for name, rows in told.items():
        with (here / "report" / f"{name}.csv").open() as file:
            in_csv = [*csv.DictReader(file)]
        assert len(rows) == len(in_csv)
        for row, line in zip(rows, in_csv, strict=True):
            assert row.keys() == line.keys()
            assert {key: as_written(value, line[key]) for key, value in row.items()} == row
        cells = [cell for row in shown[name][1:] for cell in row]
        on_page = [float(cell["value"]) for cell in cells if cell["value"] is not None]
        if name in ("summary", "sequences", "metrics-otb"):
            assert on_page == [row["mean"] for row in rows]
        numbers = {value for row in rows for value in row.values() if type(value) in (int, float)}
        assert numbers >= set(on_page)
        texts = (here / "report" / f"{name}.txt").read_text()
        assert all(cell["text"] in texts for cell in cells)
    for row, line in zip(told["comparison"], shown["comparison"][1:], strict=True):
        assert line[2]["text"] == f"{row['mean']:.3f}"
    for row, line in zip(told["comparison-pairs"], shown["comparison-pairs"][1:], strict=True):
        assert line[0]["text"] == f"{row['first']} - {row['second']}"
        assert line[2]["text"] == f"{row['difference']:+.3f}"
    intervals_are_equal(told["summary"], here / "report" / "summary.csv", shown["summary"], page)


def as_written(value, text):
    """What a CSV says, read as what JSON says."""
    if value is None:
        return None if text == "" else text
    if isinstance(value, bool):
        return {"True": True, "False": False}[text]
    if isinstance(value, str):
        return text.removeprefix("'") if value[:1] in "=+-@" else text
    return type(value)(text)


def test_parts_open_the_worst_frame_of_their_sequences(trackmark, here):
    where = [f"plain/target:length=20:noise={noise}" for noise in (0, 30)]
    run = ("run", "--trackers", "static,camshift", "--sequences", ",".join(where), "--name", "mine")
    trackmark(*run)
    trackmark("report", "results/mine", "--folder", "report")
    shown = Cells((here / "report" / "report.html").read_text()).tables
    worst = {(row[0]["text"], row[1]["text"]): row[2]["link"] for row in shown["sequences"][1:]}
    parts = {row[0]["text"]: row for row in shown["parts"][1:]}
    for text in where:
        noise = text.rpartition(":")[2]
        if noise in parts:
            name = named(text)
            links = [cell["link"] for cell in parts[noise][2:]]
            assert links == [worst[name, tracker] for tracker in ("static", "camshift")]
    assert "noise=30" in parts
    for row in shown["comparison-parts"][1:]:
        if row[1]["text"] == "noise=30":
            assert all("noise%3D30" in cell["link"] for cell in row[2:])


def intervals_are_equal(rows, csv_file, shown, page):
    """Ends in JSON and CSV, what stands behind ± in the table, and bars of the chart of speed."""
    with csv_file.open() as file:
        ends = [[row[key] or None for key in ("low", "high")] for row in csv.DictReader(file)]
    assert [[None if end is None else float(end) for end in both] for both in ends] == [
        [row["low"], row["high"]] for row in rows
    ]
    cells = [cell["text"] for row in shown[1:] for cell in row[1:]]
    assert len(cells) == len(rows)
    checked = 0
    for text, row in zip(cells, rows, strict=True):
        assert ("±" in text or "[" in text) == (row["low"] is not None)
        if "[" in text and row["measure"] == "mean_overlap":
            assert text == f"{row['mean']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"
            assert row["low"] == 0 or row["high"] == 1
            checked += 1
        if "±" in text and row["measure"] == "mean_overlap":
            assert text == f"{row['mean']:.3f} ±{(row['high'] - row['low']) / 2:.3f}"
            checked += 1
    assert checked == 1  # of the tracker that draws
    dots = json.loads(re.search(r'id="data">(.*?)</script>', page, re.S)[1])["charts"]["speed-0"]
    of = {row["tracker"]: row for row in rows if row["measure"] == "mean_overlap"}
    assert [line["label"] for line in dots["lines"]] == list(of)
    for line in dots["lines"]:
        for key, name in (("y", "mean"), ("low", "low"), ("high", "high")):
            wanted = of[line["label"]][name]
            assert line[key] == [None if wanted is None else pytest.approx(wanted, rel=1e-4)]


def test_a_link_of_a_number_leads_to_the_worst_frame_of_the_worst_run(results, page):
    cells = {
        (row[0]["text"], row[1]["text"]): row
        for row in Cells(page.read_text()).tables["sequences"][1:]
    }
    checked = 0
    worst = {}
    for row, run, truth in scored_runs(results):
        judged = np.arange(1, len(truth.boxes))
        overlaps = overlap(truth.boxes[1:], run.boxes[1:])
        errors = centre_error(truth.boxes[1:], run.boxes[1:])
        least = judged[overlaps == overlaps.min()]
        furthest = int(least[np.argmax(errors[least - 1])])
        key = row["sequence"], row["tracker"]
        worst.setdefault(key, []).append((overlaps.mean(), row["repetition"], furthest))
    for (sequence, tracker), runs in worst.items():
        _, repetition, frame = min(runs)
        asked = {"sequence": sequence, "tracker": tracker}
        asked |= {"repetition": repetition, "frame": frame}
        assert cells[sequence, tracker][2]["link"] == "#" + urlencode(asked)
        checked += 1
    assert checked == 18


def test_names_and_messages_of_others_do_no_harm(trackmark, here, spoil, otb):
    spoil(f"raise ValueError({HOSTILE!r} + chr(10) + '=1+1')")
    name = HOSTILE.replace("/", "⁄")  # a folder has no slash
    otb(here / "data" / name, 4)
    run = ("run", "--trackers", "static,knob.py:Knob", "--sequences", f"data/{name}")
    trackmark(*run, "--name", "mine", status=1)
    trackmark("report", "results/mine", "--folder", "report")
    text = (here / "report" / "report.html").read_text()
    found = Cells(text)
    assert "alert('x')" not in re.sub(
        r"\\u[0-9a-f]{4}", "", re.search(r"<main>.*</main>", text, re.S)[0]
    )
    assert found.tags.count("script") == text.count("<script")
    row = found.tables["failed"][1]
    assert row[1]["text"] == name
    assert HOSTILE in row[4]["text"]
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    assert data["scenes"][0]["name"] == name


def test_failures_stand_up_front_and_lead_to_the_last_box(trackmark, here, spoil):
    spoil(
        "self.n = getattr(self, 'n', 0) + 1\n"
        "        if self.n > 2: raise ValueError('lost')\n        return Estimate(self.box)"
    )
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1)
    trackmark("report", "results", "--folder", "report")
    text = (here / "report" / "report.html").read_text()
    assert text.index("Not all is here: ") < text.index('id="sequences"')
    assert text.count("ValueError: lost") == 2  # of two trackers' one: in a row, and its take
    for row in Cells(text).tables["failed"][1:]:
        assert row[3]["text"] == "2"
        assert "frame=2" in row[3]["link"]


def test_a_page_of_sequences_that_are_gone_or_changed_has_numbers_and_says_why_no_frames(
    trackmark, here, otb
):
    otb(here / "data" / "Other", 4)
    where = "data/Small,data/Other"
    trackmark("run", "--trackers", "static", "--sequences", where, "--name", "mine")
    shutil.rmtree(here / "data" / "Small")
    (here / "data" / "Other" / "groundtruth_rect.txt").write_text("5,6,10,13\n" * 4)
    trackmark("report", "results/mine")
    text = (here / "results" / "mine" / "report.html").read_text()
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    why = {scene["name"]: scene["why"] for scene in data["scenes"]}
    assert re.match("No frames: Small can't be opened at .*/data/Small any more.", why["Small"])
    assert re.match("No frames: Other at .*/data/Other has changed since it was run.", why["Other"])
    rows = Cells(text).tables["sequences"][1:]
    assert [(row[0]["text"], row[2]["text"]) for row in rows] == [
        ("Small", "1.000"), ("Other", "1.000")
    ]  # fmt: skip
    assert "image/webp;base64" not in text
    assert "No frames" in bench.player("results/mine", "Other").page


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
def by_protocols(results, tmp_path_factory, without_processes):
    """Runs of a tracker by several protocols, and their page."""
    folder = tmp_path_factory.mktemp("protocols")
    drifting = f"{results.parent / 'drifting.py'}:Drifting"
    source = (SequenceSource("plain/target:length=60:scene=9:noise=30"),)
    for protocol in PROTOCOLS:
        asked = Experiment("trial", (drifting,), source, repetitions=2, protocol=protocol)
        with without_processes():
            made = bench.run(asked, folder, jobs=1)
    scored = beside_native(made, ["native"])
    said = Said(str(made))
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
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
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


def test_a_score_of_revised_boxes_opens_these(results, page):
    found = Cells(page.read_text()).tables
    checked = set()
    for name in ("sequences", "sequences-revised"):
        for row in found[name][1:]:
            link = row[2]["link"]
            drifting = "Drifting" in link
            assert ("trace=revised" in link) == (drifting and name == "sequences-revised")
            checked.add((name, drifting))
    assert len(checked) == 4


@browser.needs_browser
def test_tables_are_sorted_and_filtered_and_a_link_keeps_that(shown, page):
    column = "[...document.querySelectorAll('#summary tbody tr')].map(row => row.cells[1])"
    shown.click("#summary thead th:nth-child(2) button")
    values = [float(value) for value in shown.run(f"{column}.map(cell => cell.dataset.value)")]
    assert values == sorted(values, reverse=True)
    shown.click("#summary thead th:nth-child(2) button")
    assert shown.run("document.querySelector('th[aria-sort]').ariaSort") == "ascending"
    shown.run("byId('filter').value = 'noise=30'; byId('filter').dispatchEvent(new Event('input'))")
    visible = "[...document.querySelectorAll('#heat tbody tr')].filter(row => !row.hidden).length"
    assert shown.run(visible) == 1
    shown.wait("location.hash.includes('sort.summary=1a')")
    shown.open(shown.run("location.href"))
    assert shown.run(visible) == 1
    assert (
        values == [float(v) for v in shown.run(f"{column}.map(cell => cell.dataset.value)")][::-1]
    )


@browser.needs_browser
def test_the_word_of_a_filter_may_be_in_a_column(shown, page):
    shown.run("byId('filter').value = 'camshift'; byId('filter').dispatchEvent(new Event('input'))")
    seen_in = (
        "[...document.querySelectorAll('#heat tr')].filter(row => !row.hidden)"
        ".map(row => [...row.cells].filter(cell => !cell.hidden).map(cell => cell.textContent))"
    )
    rows = shown.run(seen_in)
    assert len(rows) == 7
    assert [row[1:] for row in rows[:1]] == [["camshift"]]
    assert {len(row) for row in rows} == {2}
    assert (
        shown.run(
            "[...document.querySelectorAll('#summary tbody tr')].filter(r => !r.hidden).length"
        )
        == 1
    )
    shown.run("byId('filter').value = ''; byId('filter').dispatchEvent(new Event('input'))")
    assert {len(row) for row in shown.run(seen_in)} == {4}


@browser.needs_browser
def test_a_column_of_intervals_is_sorted_by_their_lower_ends(shown, page):
    shown.click("#comparison-pairs thead th:nth-child(4) button")
    texts = shown.run(
        "[...document.querySelectorAll('#comparison-pairs tbody tr')]"
        ".map(row => row.cells[3].textContent)"
    )
    lows = [float(text[1:].partition(",")[0]) for text in texts]
    assert lows == sorted(lows, reverse=True)
    values = ["[-0.2, 0.1]", "< .001", "~3.1", "54 of 99", "2026-11-23", "294f9cd0", "— (1 failed)"]
    cells = json.dumps(values)
    assert shown.run(f"{cells}.map(text => valueOf(make('td', {{}}, text)))") == [
        -0.2, 0.001, 3.1, 54, *values[4:],
    ]  # fmt: skip


def test_a_point_of_a_curve_opens_the_frame_nearest_to_its_threshold(results, page):
    charts = json.loads(re.search(r'id="data">(.*?)</script>', page.read_text(), re.S)[1])
    data, charts = charts, charts["charts"]
    values = {0: {}, 1: {}}
    for row, run, truth in scored_runs(results):
        key = row["tracker"], row["sequence"], row["repetition"]
        values[0][key] = overlap(truth.boxes[1:], run.boxes[1:])
        values[1][key] = centre_error(truth.boxes[1:], run.boxes[1:])
    for number, of in values.items():
        for line in charts[f"curves-{number}"]["lines"]:
            mine = {key: one for key, one in of.items() if key[0] == line["label"]}
            every = np.concatenate([*mine.values()])
            for threshold, place in zip(line["x"], line["places"], strict=True):
                sequence, tracker, repetition, frame = place
                key = data["labels"][tracker], data["scenes"][sequence]["name"], repetition
                far = abs(mine[key][frame - 1] - threshold)
                assert far == pytest.approx(np.abs(every - threshold).min())
    area = {line["label"]: float(line["told"]) for line in charts["curves-0"]["lines"]}
    for tracker, told in area.items():
        means = [one.mean() for key, one in values[0].items() if key[0] == tracker]
        assert told == pytest.approx(np.mean(means), abs=5.1e-4)  # all are repeated as often


@browser.needs_browser
def test_ticks_and_bars_of_charts_stay_in_their_frames(shown):
    chart = {
        "x": "ms", "y": "overlap", "words": "w", "kind": "dots", "log": True, "top": None,
        "told": "", "lines": [
            {"label": "a", "position": 0, "told": "", "places": [], "x": [0.3], "y": [0.3],
             "low": [-0.4], "high": [1.1]},
        ],
    }  # fmt: skip
    made = json.dumps(chart)
    ends = shown.run(
        f"[...plot({made}).querySelectorAll('line:not(.grid)')]"
        ".map(line => [Number(line.getAttribute('y1')), Number(line.getAttribute('y2'))])"
    )
    assert all(8 <= end <= 300 - 34 for bar in ends for end in bar)
    ticks = shown.run(f"scalesOf({made}, 460, 300).ticks")
    assert all(4 <= len(one) <= 9 for one in ticks[1:])
    assert len(ticks[0]) >= 2
    shown.wait(
        "new Promise((done) => {"
        " byId('survival-0').scrollIntoView({block: 'center', behavior: 'instant'});"
        " requestAnimationFrame(() => done(document.querySelector('#survival-0 svg') !== null)); })"
    )
    assert shown.run(
        "(() => { const svg = document.querySelector('#survival-0 svg');"
        " const edge = svg.getBoundingClientRect().right + 0.5;"
        " return [...svg.querySelectorAll('text')]"
        ".every(text => text.getBoundingClientRect().right <= edge); })()"
    )


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
        one for one in scored_runs(results) if one[0]["tracker_name"] == "camshift"
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
    for row, run, stored in scored_runs(results, sequence=name):
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
        one for one in scored_runs(results, sequence=sequence) if one[0]["tracker"] == tracker
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
        for row, run, truth in scored_runs(results, sequence=name)
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
        ({"frame": 6000}, "There is no frame 6000: the last one is 59."),
    ):
        shown.run(f"location.hash = {json.dumps(urlencode({'sequence': name, **asked}))}")
        shown.wait(f"byId('said').textContent === {json.dumps(told)}")


@browser.needs_browser
def test_escape_closes_the_keys_first(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=0"), frame=3)
    shown.key("?")
    shown.key("Escape")
    assert shown.run("byId('player').open && byId('help').hidden")
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
def test_a_point_of_a_curve_opens_its_frame(shown):
    shown.wait(
        "new Promise((done) => {"
        " byId('errors-2').scrollIntoView({block: 'center', behavior: 'instant'});"
        " requestAnimationFrame(() => done(document.querySelector('#errors-2 svg') !== null)); })"
    )
    shown.point("#errors-2 svg")
    tip = shown.wait("!tip.hidden && tip.textContent")
    shown.click("#errors-2 svg")
    shown.wait("byId('player').open && paintedFrame >= 0")
    assert tip.endswith(f"at frame {shown.run('frame')}")
    assert shown.run("scene.number") == 2


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
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
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


USABLE = """[...document.querySelectorAll(
  "a[href], button:not(:disabled), input, select, summary, [tabindex='0']"
)].filter((one) => one.checkVisibility())"""


@browser.needs_browser
def test_all_of_a_page_is_reached_and_used_by_the_keyboard(shown):
    shown.run(
        "document.querySelectorAll('figure.chart').forEach((one) => { near.unobserve(one);"
        " if (!one.querySelector('svg')) fill(one, data.charts[one.id]); });"
        f" window.usable = {USABLE}; 0"
    )
    reached = []
    for _ in range(shown.run("usable.length")):
        shown.key("Tab")
        reached.append(shown.run("usable.indexOf(document.activeElement)"))
        seen = "getComputedStyle(document.activeElement)"
        assert shown.run(f"{seen}.outlineStyle !== 'none' && parseFloat({seen}.outlineWidth) > 0")
    assert reached == list(range(len(reached)))
    shown.run("document.querySelector('#summary thead th:nth-child(2) button').focus()")
    shown.key(" ")
    assert shown.run("state.get('sort.summary')") == "1d"


@browser.needs_browser
def test_points_of_a_chart_are_told_and_opened_by_the_keyboard(shown):
    chart = "document.querySelector('#part-errors svg.opens')"
    shown.run("byId('part-errors').scrollIntoView({behavior: 'instant'})")
    shown.wait(f"!!{chart}")
    shown.run(f"{chart}.focus()")
    told = [shown.wait("tip.textContent")]
    for key in ("ArrowRight", "ArrowDown", "End"):
        shown.key(key)
        told.append(shown.run("tip.textContent"))
    assert len(set(told)) == 4
    assert "at frame 59" in told[-1]
    assert shown.run(f"{chart}.getAttribute('aria-roledescription')")
    assert shown.run("tip.getAttribute('role')") == "status"
    shown.key("Enter")
    shown.wait("byId('player').open && paintedFrame === 59")
    assert told[-1].startswith(shown.run("state.get('tracker')"))
    shown.key("Escape")
    shown.wait("!byId('player').open")
    assert shown.run(f"document.activeElement === {chart}")


@browser.needs_browser
def test_without_a_pointer_the_target_is_magnified(shown):
    seen(shown, sequence=named("plain/target:length=60:scene=9:noise=30"), frame=5)
    shown.run("pointer = null; repaint()")
    plain = shown.run("screen.toDataURL()")
    shown.key("m")
    shown.wait(f"screen.toDataURL() !== {json.dumps(plain)}")


@browser.needs_browser
@pytest.mark.parametrize("still", [True, False])
def test_nothing_moves_by_itself_for_who_wants_it_still(shown, still):
    shown.size(1280, 900, still=still)
    behaviour = "getComputedStyle(document.documentElement).scrollBehavior"
    assert shown.run(behaviour) == ("auto" if still else "smooth")
    moving = (
        "[...document.querySelectorAll('*')].filter((one) => { const style = getComputedStyle(one);"
        " return style.animationName !== 'none' || parseFloat(style.transitionDuration) > 0"
        " || ['MARQUEE', 'VIDEO'].includes(one.tagName); }).length"
    )
    assert shown.run(moving) == 0
    if still:
        shown.click("nav a:last-child")
        there = shown.run("scrollY")
        assert there > 0
        shown.run("new Promise((done) => setTimeout(done, 300))")
        assert shown.run("scrollY") == there  # at once
