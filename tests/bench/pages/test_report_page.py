"""The page of a report: its numbers, links, tables and charts."""

import csv
import json
import re
import shutil
from urllib.parse import urlencode

import numpy as np
import pytest

import trackmark as tm
from tests import browser
from tests.bench.pages.reading import (
    Cells,
    canonical_name,
    curves_of,
    data_of,
    rows_of_sequences,
    stored_runs,
)
from trackmark.bench.analysis.published_sets import SETS
from trackmark.bench.analysis.times import time_text
from trackmark.bench.metrics.boxes import centre_error, overlap
from trackmark.bench.pages.content import Page, PageSection, PageTable
from trackmark.bench.pages.page import card, write_page
from trackmark.reports.tables import Cell, Table

HOSTILE = "</script><script>alert('x')</script> \"q\" & ключ 跟踪"


@pytest.fixture(autouse=True)
def without_figures(monkeypatch):
    """Skip figures and film strips, which take longer than pages."""
    monkeypatch.setattr(
        "trackmark.bench.pages.report_figures.write_figures", lambda *_, **options: []
    )


def test_numbers_are_those_of_csv_and_json(trackmark, workspace):
    small = "plain/target:length=12:width=96:height=72"
    where = ",".join(f"{small}:noise={10 * (1 + n % 2)}:scene={n}" for n in range(6))
    run = ("run", "--trackers", "static,camshift,knob.py:Knob", "--sequences", where)
    trackmark(*run, "--repetitions", 2, "--name", "mine")
    lines = trackmark("report", "results/mine", "--output", "report", "--metrics", "native,otb")
    assert lines.stderr.splitlines()[-2] == "report/report.html"
    output = trackmark("report", "results/mine", "--json", "--metrics", "native,otb").stdout
    tables = {entry["table"]: entry["rows"] for entry in map(json.loads, output.splitlines())}
    page = (workspace / "report" / "report.html").read_text()
    page_tables = Cells(page).tables
    assert {"summary", "sequences", "metrics-otb"} <= tables.keys()
    assert {"summary", "metrics-otb", "heat", "subsets", "trackers"} <= page_tables.keys()
    page_tables["sequences"] = [[], *(row[1:] for row in rows_of_sequences(page))]
    for name, rows in tables.items():
        with (workspace / "report" / f"{name}.csv").open() as file:
            in_csv = [*csv.DictReader(file)]
        for row, line in zip(rows, in_csv, strict=True):
            assert {key: as_in_json(value, line[key]) for key, value in row.items()} == row
        cells = [cell for row in page_tables.get(name, [])[1:] for cell in row]
        if name in ("summary", "sequences", "metrics-otb"):
            starts = [re.match(r"~?(none|\d+\.?\d*)(?= |$)", cell["text"]) for cell in cells]
            numbers = [start[1] for start in starts if start]
            for number, row in zip(numbers, rows, strict=True):
                if number != "none":  # shares of frames are in %
                    assert any(is_rounded(number, scale * row["mean"]) for scale in (1, 100))
        texts = (workspace / "report" / f"{name}.txt").read_text()
        assert all(cell["text"] in texts for cell in cells)
    overlaps = {r["tracker"]: r for r in tables["summary"] if r["measure"] == "mean_overlap"}
    for cells, (tracker, row) in zip(page_tables["summary"][1:], overlaps.items(), strict=True):
        interval = f"{row['mean']:.3f} [{row['low']:.3f}, {row['high']:.3f}]"
        assert [cell["text"] for cell in cells[:2]] == [tracker, interval]
    by_sequence = {
        (row["sequence"], row["tracker"]): row["mean"]
        for row in tables["sequences"]
        if row["measure"] == "mean_overlap"
    }
    comparison = json.loads(trackmark("compare", "--results", "results/mine", "--json").stdout)
    check_cards(page, tables, by_sequence, comparison)
    check_subsets(page_tables["subsets"], by_sequence)
    main_text = re.sub("<.*?>", " ", page[page.index("<main") : page.index("</main>")])
    assert not re.search(r"(?<=[\s\[(~])-\.?\d", main_text)  # true minus signs
    check_terminal(lines.stdout, page, tables, comparison)


def check_subsets(subset_table, overlaps):
    """Check the mean overlaps by parameter value against those by sequence."""
    trackers = [cell["text"].strip() for cell in subset_table[0][2:]]
    rows = {row[0]["text"]: row[1:] for row in subset_table[1:]}
    for noise in (10, 20):
        members = {name for name, _ in overlaps if f"noise={noise}" in name}
        n, *cells = rows[f"noise={noise}"]
        assert int(n["text"]) == len(members) == 3
        for tracker, cell in zip(trackers, cells, strict=True):
            mean = np.mean([overlaps[name, tracker] for name in members])
            assert cell["text"] == f"{mean:.3f}"


def is_rounded(text, value):
    """Return whether a text is a number with fewer decimals."""
    return float(text) == pytest.approx(value, abs=0.5001 * 10 ** -len(text.partition(".")[2]))


def check_cards(page, tables, overlaps, comparison):
    """Check the values of the answer, leaderboard, heat map and pairs against the tables."""
    means = {r["tracker"]: r for r in tables["summary"] if r["measure"] == "mean_overlap"}
    board = re.findall(r'<li[^>]* data-k="(\d+)".*?class="value"><b>(.*?)</b>', page, re.S)
    labels = data_of(page)["labels"]
    assert {labels[int(k)]: mean for k, mean in board} == {
        name: f"{row['mean']:.2f}" for name, row in means.items()
    }
    ranked = [means[labels[int(k)]]["mean"] for k, _ in board]
    assert ranked == sorted(ranked, reverse=True)
    best = means[labels[int(board[0][0])]]
    answer = re.search("<h1>(.*?)</h1>", page)[1]
    assert best["tracker"] in answer
    assert f"{best['mean']:.2f}" in answer
    heat = Cells(page).tables["heat"]
    trackers = [cell["text"].strip() for cell in heat[0][1:]]
    assert trackers == [labels[int(k)] for k, _ in board]
    assert len(heat) == 2 + len(overlaps) / len(trackers)
    for sequence, *row in heat[1:-1]:
        texts = [cell["text"].partition(" ")[0] for cell in row]
        assert texts == [f"{overlaps[sequence['text'], name]:.2f}" for name in trackers]
    assert [cell["text"] for cell in heat[-1][1:]] == [
        f"{means[name]['mean']:.2f}" for name in trackers
    ]
    pairs = {(pair["first"], pair["second"]): pair for pair in comparison["pairs"]}
    opposite = {"better": "worse", "worse": "better"}
    n_rows = 0
    for group in page.split('<div class="lead-head differences">')[1:]:
        first = re.search(r"<b>(.*?)</b> minus", group)[1].replace("<wbr>", "")
        row = r'<li class="(\w+)"><\w+ class="row".*?</b> <span>(.*?)</span>.*?([+−]\d\.\d\d)'
        for decision, label, value in re.findall(row, group, re.S):
            second = label.replace("<wbr>", "")
            turned = (first, second) not in pairs
            pair = pairs[(second, first) if turned else (first, second)]
            difference = pair["difference"] * (-1 if turned else 1)
            assert value.replace("−", "-") == f"{difference:+.2f}"
            assert decision == (
                opposite.get(pair["decision"], pair["decision"]) if turned else pair["decision"]
            )
            n_rows += 1
    assert n_rows == len(pairs)


def check_terminal(output, page, tables, comparison):
    """Check answer, overlaps and times of the terminal against the page and the tables.

    Each tracker has one time: in leaderboard, terminal, summary and comparison.
    """
    (heading,) = re.findall("<h1>(.*?)</h1>", page)
    assert " ".join(output.split()).startswith(heading.replace("\u00a0", " "))
    by_measure = {(row["tracker"], row["measure"]): row["mean"] for row in tables["summary"]}
    board = dict(re.findall(r'data-k="(\d+)".*?<i>ms/frame </i>(.*?)</span>', page, re.S))
    labels = data_of(page)["labels"]
    assert {labels[int(k)] for k in board} == {row["tracker"] for row in comparison["trackers"]}
    for row in comparison["trackers"]:
        name = row["tracker"]
        time = time_text(by_measure[name, "ms_per_frame"])
        assert time_text(row["ms_per_frame"]) == time
        assert board[str(labels.index(name))] == f"~{time}"
        rows = output.partition("\n\n")[2].splitlines()
        line = next(line for line in rows if line.startswith(f"{name} "))
        assert f" {by_measure[name, 'mean_overlap']:.2f} " in line
        assert f"~{time}" in line.split()


def as_in_json(value, text):
    """Return the text of a CSV as the value of JSON."""
    if value is None:
        return None if text == "" else text
    if isinstance(value, bool):
        return {"True": True, "False": False}[text]
    if isinstance(value, str):
        return text.removeprefix("'") if value[:1] in "=+-@" else text
    return type(value)(text)


def test_number_opens_the_worst_frame_of_the_worst_run(results, page):
    rows = rows_of_sequences(page.read_text())
    cells = {(row[0], row[1]["text"]): row[2]["link"] for row in rows}
    worst = {}
    for row, run, truth in stored_runs(results):
        judged = np.arange(1, len(truth.boxes))
        overlaps = overlap(truth.boxes[1:], run.boxes[1:])
        loss, least = int(row["scores"]["first_loss"]), int(judged[overlaps.argmin()])
        frame = loss if loss < len(truth.boxes) else least
        key = row["sequence"], row["tracker"]
        worst.setdefault(key, []).append((overlaps.mean(), row["repetition"], frame))
    assert len(worst) == 18
    for (sequence, tracker), runs in worst.items():
        _, repetition, frame = min(runs)
        address = {"sequence": sequence, "tracker": tracker, "repetition": repetition}
        assert cells[sequence, tracker] == "#" + urlencode(address | {"frame": frame})


def test_score_of_revised_boxes_opens_these(page):
    text = page.read_text()
    online = [row[2]["link"] for row in rows_of_sequences(text)]
    again = [row[2]["link"] for row in Cells(text).tables["sequences-revised"][1:]]
    for links in (online, again):
        revised = {link for link in links if "trajectory=revised" in link}
        drifting = {link for link in links if "Drifting" in link}
        assert revised == (drifting if links is again else set())
        assert len(drifting) == 6


def test_subsets_open_the_worst_frame_of_their_sequences(results, page):
    text = page.read_text()
    tables = Cells(text).tables
    name = canonical_name("plain/target:length=60:scene=9:noise=30")
    worst = {(row[0], row[1]["text"]): row[2]["link"] for row in rows_of_sequences(text)}
    subsets = {row[0]["text"]: row for row in tables["subsets"][1:]}
    trackers = [heading["text"].strip() for heading in tables["subsets"][0][2:]]
    links = [cell["link"] for cell in subsets["noise=30"][2:]]
    assert links == [worst[name, tracker] for tracker in trackers]


def test_names_and_messages_cannot_inject_markup(trackmark, workspace, break_tracker, otb):
    break_tracker(f"raise ValueError({HOSTILE!r} + chr(10) + '=1+1')")
    name = HOSTILE.replace("/", "⁄")  # a folder has no slash
    otb(workspace / "data" / name, 4)
    run = ("run", "--trackers", "static,knob.py:Knob", "--sequences", f"data/{name}")
    trackmark(*run, "--name", "mine", status=1)
    trackmark("report", "results/mine", "--output", "report", status=1)
    text = (workspace / "report" / "report.html").read_text()
    cells = Cells(text)
    main = re.search(r"<main.*</main>", text, re.S)[0]
    assert "alert('x')" not in re.sub(r"\\u[0-9a-f]{4}", "", main)
    assert cells.tags.count("script") == text.count("<script")
    row = cells.tables["failed"][1]
    assert row[1]["text"] == name
    assert HOSTILE in row[4]["text"]
    assert data_of(text)["sequences"][0]["name"] == name


def test_failures_open_the_last_box(trackmark, workspace, break_tracker):
    break_tracker(
        "self.n = getattr(self, 'n', 0) + 1\n"
        "        if self.n > 2: raise ValueError('lost')\n        return Estimate(self.box)"
    )
    trackmark("run", "--trackers", "static,knob.py:Knob", "--sequences", "data/Small", status=1)
    trackmark("report", "results", "--output", "report", status=1)
    text = (workspace / "report" / "report.html").read_text()
    also = re.search('<p class="also">(.*?)</p>', text)[1]
    assert "1 of 2 runs failed" in also
    assert "ValueError: lost" in also
    assert "Lost and failed runs: of 2 runs, 1 failed" in text
    (lost,) = re.findall('<ul class="failures few">.*?</ul>', text, re.S)
    assert "failed: 0004.png: ValueError: lost" in lost
    assert re.search(r'href="#0\.\d\.0\.2"', lost)
    for row in Cells(text).tables["failed"][1:]:
        assert row[3]["text"] == "2"
        assert "frame=2" in row[3]["link"]


def test_missing_or_changed_sequences_keep_scores(trackmark, workspace, otb):
    otb(workspace / "data" / "Other", 4)
    trackmark("run", "--trackers", "static", "--sequences", "data/Small,data/Other", "--name", "m")
    shutil.rmtree(workspace / "data" / "Small")
    (workspace / "data" / "Other" / "groundtruth_rect.txt").write_text("5,6,10,13\n" * 4)
    trackmark("report", "results/m")
    text = (workspace / "results" / "m" / "report.html").read_text()
    why = {entry["name"]: entry["reason"] for entry in data_of(text)["sequences"]}
    assert re.match("No frames: Small cannot be opened at .*/data/Small.", why["Small"])
    assert re.match("No frames: Other at .*/data/Other has changed since the run.", why["Other"])
    scores = [(row[0], row[2]["text"]) for row in rows_of_sequences(text)]
    assert scores == [("Small", "1.000"), ("Other", "1.000")]
    assert "image/webp;base64" not in text
    assert "No frames" in tm.player("results/m", "Other").page


def test_curve_point_opens_frame_nearest_to_threshold(results, page):
    text = page.read_text()
    data = data_of(text)
    values = {"success": {}, "precision": {}}
    for row, run, truth in stored_runs(results):
        key = row["tracker"], row["sequence"], row["repetition"]
        values["success"][key] = overlap(truth.boxes[1:], run.boxes[1:])
        values["precision"][key] = centre_error(truth.boxes[1:], run.boxes[1:])
    for name, runs_by_key in values.items():
        for label, (x, y, places) in curves_of(text, name).items():
            mine = {key: entry for key, entry in runs_by_key.items() if key[0] == label}
            x = x.round(2 if name == "success" else 0)
            every = np.concatenate([*mine.values()])
            shares = [  # each sequence has equal weight, and all are repeated equally often
                np.mean([np.mean(v >= x if name == "success" else v <= x) for v in mine.values()])
                for x in x.tolist()
            ]
            np.testing.assert_allclose(y, shares, atol=4e-4)
            for threshold, place in zip(x, places, strict=True):
                sequence, tracker, repetition, frame = map(int, place.split("."))
                key = data["labels"][tracker], data["sequences"][sequence]["name"], repetition
                far = abs(mine[key][frame - 1] - threshold)
                assert far == pytest.approx(np.abs(every - threshold).min())


@browser.needs_browser
def test_click_on_a_head_sorts_its_column(opened_page):
    column = "[...document.querySelectorAll('#summary tbody tr')].map(row => row.cells[1])"
    column = f"{column}.map(cell => parseFloat(cell.textContent))"
    opened_page.run("byId('fold-summary').open = true")
    opened_page.click("#summary thead th:nth-child(2) button")
    values = opened_page.run(column)
    assert values == sorted(values, reverse=True)
    opened_page.click("#summary thead th:nth-child(2) button")
    assert opened_page.run("document.querySelector('th[aria-sort]').ariaSort") == "ascending"
    assert opened_page.run(column) == values[::-1]
    texts = [
        "[-0.2, 0.1]",
        "−0.3",
        "< .001",
        "~3.1",
        "54 of 99",
        "2026-11-23",
        "294f9cd0",
        "— (1 failed)",
    ]
    numbers = opened_page.run(f"{json.dumps(texts)}.map(numberIn).map(String)")
    assert numbers == ["-0.2", "-0.3", "0.001", "3.1", "54", *["-Infinity"] * 3]


def test_published_scores_are_ranked_among_the_trackers(trackmark, workspace):
    tiny = "plain/target:length=12:width=64:height=64"
    scenes = ",".join(f"{tiny}:scene={scene}" for scene in range(6))
    trackmark("run", "--trackers", "static,camshift", "--sequences", scenes, "--name", "mine")
    runs = tm.load_runs(workspace / "results" / "mine")
    names = runs.table["sequence"].unique()
    rows = [
        f"{tracker},{name},{score}" for tracker, score in (("A", 1.0), ("B", 0)) for name in names
    ]
    file = workspace / "theirs.csv"
    file.write_text("\n".join(["tracker,sequence,mean_overlap", *rows]))
    printed = trackmark("report", "results/mine", "--published", "theirs.csv").stdout
    page = (workspace / "results" / "mine" / "report.html").read_text()
    ranking = page.partition('<ol class="ranking">')[2].partition("</ol>")[0]
    assert re.findall(r"<span>([\w-]+)</span></span>", ranking) == ["A", "camshift", "static", "B"]
    assert ranking.count('class="ours"') == ranking.count('<a class="row" href="#') == 2
    mean = runs.means()["mean_overlap"]["camshift"]
    assert "part-subsets" not in page  # all sequences have the same parameters
    heading = f"camshift has rank 2 of 4 by mean overlap on 6 scenes: {mean:.2f}."
    assert heading in page
    assert heading in " ".join(printed.split())
    heat = Cells(page).tables["heat"]
    columns = ["camshift", "static", "A (published)", "B (published)", "median published"]
    assert [cell["text"].strip() for cell in heat[0][1:]] == columns
    assert [cell["text"] for cell in heat[-1][1:]][2:] == ["1.00", "0.00", "0.50"]
    wrong = trackmark("report", "results", "--published", "x.csv", "--json", status=2)
    assert "--published adds scores to a page" in wrong.stderr


def test_published_trackers_have_the_metric_of_the_others(trackmark, workspace, otb):
    otb(workspace / "data" / "Deer", 4)
    trackmark("run", "--trackers", "static,camshift", "--sequences", "data/Deer", "--name", "mine")
    printed = trackmark("report", "results/mine", "--published", "otb100").stdout
    page = (workspace / "results" / "mine" / "report.html").read_text()
    board = page.partition('<ol class="lead')[2].partition("</section>")[0]
    rows = {
        name.replace("<wbr>", ""): (note, value)
        for name, note, value in re.findall(
            r'<b>([^<]*)</b> <small>(.*?)</small>.*?<span class="value"><b>([\d.]+)</b>',
            board,
            re.S,
        )
    }
    runs = tm.load_runs(workspace / "results" / "mine")
    overlap_of = runs.scored("otb", "one-pass").set_index("tracker")["mean_overlap"]
    assert f"{overlap_of['camshift']:.2f}" != f"{runs.means()['mean_overlap']['camshift']:.2f}"
    with SETS["otb100"].file.open() as file:
        theirs = {
            row["tracker"]: float(row["mean_overlap"])
            for row in csv.DictReader(file)
            if row["sequence"] == "Deer"
        }
    overlaps = {**overlap_of.to_dict(), **theirs}
    assert {name: value for name, (_, value) in rows.items()} == {
        name: f"{value:.2f}" for name, value in overlaps.items()
    }
    ranked = sorted(overlaps.values(), reverse=True)
    rank = ranked.index(overlap_of["static"]) + 1
    assert printed.startswith(f"static has rank {rank} of 36 by mean overlap (otb) on this sequen")
    assert re.search(rf"^camshift +{overlap_of['camshift']:.2f} ", printed, re.M)
    assert rows["static"][0] == f"rank {rank}"
    best = max(theirs, key=theirs.__getitem__)
    assert rows[best][0] == f"rank {ranked.index(theirs[best]) + 1}, published"
    first, _, folded = board.partition("<details")
    assert "29 more published trackers" in folded
    assert first.count("<li") == 2 + 5
    heat = Cells(page).tables["heat"]
    assert float(heat[1][1]["text"].split()[0]) == pytest.approx(overlap_of.max(), abs=0.005)
    fold = page.partition('id="sequence-0"')[2].partition("</details>")[0]
    assert f"Published: {best} {theirs[best]:.2f}, " in fold
    assert f"highest: {overlap_of.idxmax()}, {overlap_of.max():.2f}" in fold


@browser.needs_browser
def test_many_sequences_are_folded_and_filtered(chromium, tmp_path):
    row = {"thumbnail": b"", "overlaps": [0.5, 0.5], "positions": [None, None]}
    matrix = card(
        "overlap_matrix",
        trackers=[(0, "static"), (1, "camshift")],
        rows=[row | {"sequence": f"scene-{n}"} for n in range(20)],
        means=[0.5, 0.5],
        n_shown=12,
    )
    sections = [PageSection("heat", "Heat", [matrix])]
    (path,) = write_page(tmp_path / "a.html", Page("T", sections))
    chromium.open(path.as_uri())
    seen = (
        "[...document.querySelectorAll('#heat tbody tr')].filter(row => row.checkVisibility())"
        ".map(row => row.textContent)"
    )
    assert len(chromium.run(seen)) == 12
    chromium.click("#all-rows")
    assert len(chromium.run(seen)) == 20
    chromium.click("#all-rows")
    for words, count in (("Scene-1", 11), ("scene-19", 1), ("", 12)):
        chromium.run(f"byId('filter').value = {json.dumps(words)}")
        chromium.run("byId('filter').dispatchEvent(new Event('input'))")
        assert len(chromium.run(seen)) == count


@browser.needs_browser
def test_numbers_of_a_column_are_on_the_right(chromium, tmp_path):
    columns = [
        ["0.784 ±0.204", "0.103 [0.000, 0.210]", "0.929", "—"],
        ["7 of 119", "118.7 ±0.6 of 119", "119 of 119", "—"],
        ["better", "inconclusive", "worse", "—"],
        ["plain/target", "plain/target:noise=30:scene=4", "a", "—"],
    ]
    rows = [[*map(Cell, row)] for row in zip("abcd", *columns, strict=True)]
    table = Table("t", "", ["tracker", "overlap", "success", "the first is", "name"], 1, rows)
    (path,) = write_page(
        tmp_path / "a.html",
        Page("T", [PageSection("a", "A", [card("page_table", sheet=PageTable(table))])]),
    )
    assert ">plain/<wbr>target:<wbr>noise=<wbr>30:<wbr>scene=<wbr>4<" in path.read_text()
    chromium.open(path.as_uri())
    sides = """[...document.querySelectorAll("tbody tr")].map(row => [...row.cells]
        .map(cell => getComputedStyle(cell).textAlign))"""
    assert {tuple(row) for row in chromium.run(sides)} == {
        ("left", "right", "right", "left", "left")
    }


@browser.needs_browser
def test_chart_point_opens_by_click_and_keys(opened_page):
    opened_page.run("byId('sequence-2').open = true")
    opened_page.point("#chart-sequence-2 svg")
    tip = opened_page.wait("!tip.hidden && tip.textContent")
    opened_page.click("#chart-sequence-2 svg")
    opened_page.wait("byId('player').open && paintedFrame >= 0")
    assert tip.endswith(f"at frame {opened_page.run('frame')}")
    assert opened_page.run("sequence.number") == 2
    opened_page.key("Escape")
    chart = "document.querySelector('#chart-sequence-2 svg')"
    opened_page.run(f"{chart}.focus()")
    tips = [opened_page.wait("tip.textContent")]
    for key in ("ArrowRight", "ArrowDown", "End"):
        opened_page.key(key)
        tips.append(opened_page.run("tip.textContent"))
    assert len(set(tips)) == 4
    assert "at frame 59" in tips[-1]
    assert opened_page.run(f"{chart}.getAttribute('aria-roledescription')")
    assert opened_page.run("tip.getAttribute('role')") == "status"
    opened_page.key("Enter")
    opened_page.wait("byId('player').open && paintedFrame === 59")
    assert tips[-1].startswith(opened_page.run("state.get('tracker')"))
    opened_page.key("Escape")
    opened_page.wait("!byId('player').open")
    assert opened_page.run(f"document.activeElement === {chart}")


USABLE = """[...document.querySelectorAll(
  "a[href], button:not(:disabled), input, select, summary, [tabindex='0']"
)].filter((one) => one.checkVisibility())"""


@browser.needs_browser
def test_keyboard_reaches_all_controls(opened_page):
    opened_page.run(f"window.usable = {USABLE}; 0")
    reached = []
    for _ in range(opened_page.run("usable.length")):
        opened_page.key("Tab")
        reached.append(opened_page.run("usable.indexOf(document.activeElement)"))
        seen = "getComputedStyle(document.activeElement)"
        assert opened_page.run(
            f"{seen}.outlineStyle !== 'none' && parseFloat({seen}.outlineWidth) > 0"
        )
    assert reached == list(range(len(reached)))
