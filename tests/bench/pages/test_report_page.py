"""The page of a report: its numbers, tables and charts, driven in a browser."""

import csv
import json
import re
import shutil
from pathlib import Path
from urllib.parse import urlencode

import numpy as np
import pytest

from tests import browser
from tests.bench.pages.reading import Cells, data_of, named, written
from trackmark import bench
from trackmark.bench.experiments.experiment import Experiment, SequenceSource
from trackmark.bench.metrics.centre_error import centre_error
from trackmark.bench.metrics.overlap import overlap
from trackmark.bench.reporting.stored_runs import one_pass_runs

HOSTILE = "</script><script>alert('x')</script> \"q\" & ключ 跟踪"


@pytest.fixture(autouse=True)
def without_plots(monkeypatch):
    """Plots and film strips are other tests' matter, and take longer than pages."""
    monkeypatch.setattr("trackmark.bench.reporting.pictures.write_pictures", lambda *_: [])
    monkeypatch.setattr(
        "trackmark.bench.pages.paper_export.write_for_papers", lambda path, _: [path]
    )


def test_numbers_on_the_page_are_those_of_csv_and_json(trackmark, here):
    trackers = "static,camshift,knob.py:Knob"
    where = ",".join(f"plain/target:length=12:noise={10 * (1 + n % 2)}:scene={n}" for n in range(6))
    trackmark("run", "--trackers", trackers, "--sequences", where, "--seeds", 2, "--name", "mine")
    asked = ("--folder", "report", "--metrics", "native,otb")
    written = trackmark("report", "results/mine", *asked).stderr.splitlines()[-2:]
    assert written[0] == str(Path("report", "report.html"))
    count = len([*(here / "report").glob("*.csv")])
    assert written[1].startswith(f"Beside it: {count} tables as .txt, .md, .csv and .tex")
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
        assert line[1]["text"] == f"{row['mean']:.3f}"
    for row, line in zip(told["comparison-pairs"], shown["comparison-pairs"][1:], strict=True):
        assert line[0]["text"] == f"{row['first']} - {row['second']}"
        assert line[1]["text"] == f"{row['difference']:+.3f}"
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
    """Compare intervals in JSON, CSV, the table, and the chart of speed."""
    with csv_file.open() as file:
        ends = [[row[key] or None for key in ("low", "high")] for row in csv.DictReader(file)]
    assert [[None if end is None else float(end) for end in both] for both in ends] == [
        [row["low"], row["high"]] for row in rows
    ]
    cells = [cell["text"] for row in shown[1:] for cell in row[1:]]
    assert len(cells) == len(rows)
    checked = 0
    for text, row in zip(cells, rows, strict=True):
        assert ("[" in text) == (row["low"] is not None)
        if "[" in text and row["measure"] == "mean_overlap":
            assert text == f"{row['mean']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"
            checked += 1
    assert checked == 3
    dots = data_of(page)["charts"]["speed-0"]
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
    for row, run, truth in one_pass_runs(results):
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
    trackmark("report", "results/mine", "--folder", "report", status=1)
    text = (here / "report" / "report.html").read_text()
    found = Cells(text)
    assert "alert('x')" not in re.sub(
        r"\\u[0-9a-f]{4}", "", re.search(r"<main>.*</main>", text, re.S)[0]
    )
    assert found.tags.count("script") == text.count("<script")
    row = found.tables["failed"][1]
    assert row[1]["text"] == name
    assert HOSTILE in row[4]["text"]
    data = data_of(text)
    assert data["scenes"][0]["name"] == name


def test_failures_stand_up_front_and_lead_to_the_last_box(trackmark, here, spoil):
    spoil(
        "self.n = getattr(self, 'n', 0) + 1\n"
        "        if self.n > 2: raise ValueError('lost')\n        return Estimate(self.box)"
    )
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1)
    trackmark("report", "results", "--folder", "report", status=1)
    text = (here / "report" / "report.html").read_text()
    assert text.index("Runs not finished: ") < text.index('id="sequences"')
    # In a row, with its boxes, in the note, and in the table and the paragraph of the comparison.
    assert text.count("ValueError: lost") == 5
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
    data = data_of(text)
    why = {scene["name"]: scene["why"] for scene in data["scenes"]}
    assert re.match("No frames: Small can't be opened at .*/data/Small any more.", why["Small"])
    assert re.match("No frames: Other at .*/data/Other has changed since it was run.", why["Other"])
    rows = Cells(text).tables["sequences"][1:]
    assert [(row[0]["text"], row[2]["text"]) for row in rows] == [
        ("Small", "1.000"), ("Other", "1.000")
    ]  # fmt: skip
    assert "image/webp;base64" not in text
    assert "No frames" in bench.player("results/mine", "Other").page


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
    shown.click("#comparison-pairs thead th:nth-child(3) button")
    texts = shown.run(
        "[...document.querySelectorAll('#comparison-pairs tbody tr')]"
        ".map(row => row.cells[2].textContent)"
    )
    lows = [float(text[1:].partition(",")[0]) for text in texts]
    assert lows == sorted(lows, reverse=True)
    values = ["[-0.2, 0.1]", "< .001", "~3.1", "54 of 99", "2026-11-23", "294f9cd0", "— (1 failed)"]
    cells = json.dumps(values)
    assert shown.run(f"{cells}.map(text => valueOf(make('td', {{}}, text)))") == [
        -0.2, 0.001, 3.1, 54, *values[4:],
    ]  # fmt: skip


def test_a_point_of_a_curve_opens_the_frame_nearest_to_its_threshold(results, page):
    data = data_of(page.read_text())
    charts = data["charts"]
    values = {0: {}, 1: {}}
    for row, run, truth in one_pass_runs(results):
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


@browser.needs_browser
def test_a_link_to_a_part_keeps_what_was_sorted_and_filtered(chromium, page):
    chromium.size(1280, 900)
    chromium.open(page.as_uri() + "#filter=camshift&sort.summary=1d")
    chromium.run("document.querySelector('nav a').click()")
    chromium.wait("location.hash.includes('filter=camshift')")
    assert "sort.summary=1d" in chromium.run("location.hash")


def test_runs_of_other_protocols_alone_are_not_compared_and_it_says_why(
    tmp_path, without_processes
):
    with without_processes():
        sources = (SequenceSource("plain/target:length=20"),)
        asked = Experiment("trial", ("static", "camshift"), sources, protocol="supervised")
        experiment = bench.run(asked, tmp_path, jobs=1)
    assert (
        "No comparison: nothing was run in one pass." in written(experiment, tmp_path).read_text()
    )
