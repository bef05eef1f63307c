"""Reproduction of a tiny paper: verdicts, tables, figures, pages and terminal output."""

import csv
import json
import re
from dataclasses import replace
from urllib.parse import parse_qsl

import cv2
import numpy as np
import pandas as pd
import pytest

from tests import browser
from tests.bench.commands.conftest import assert_tables_have_rows
from tests.bench.pages.reading import address_of, check_accessibility, check_texts, data_of
from tests.bench.papers.claim_entries import TEXTS as CLAIM_TEXTS
from trackmark import datasets
from trackmark.bench.commands._table_files import write_tables
from trackmark.bench.papers import SETTINGS, cases, figures, markdown_page, player_content
from trackmark.bench.papers import evidence as evidence_module
from trackmark.bench.papers.claims import Claim
from trackmark.bench.papers.criteria import read_criteria
from trackmark.bench.papers.evidence import evidence
from trackmark.bench.papers.figures import draw_figures
from trackmark.bench.papers.html_page import write_html_page
from trackmark.bench.papers.index_page import write_front_page
from trackmark.bench.papers.reproduction import report_data
from trackmark.bench.papers.terminal_report import report_lines
from trackmark.bench.store.database import ResultsError


def test_verdicts_rest_on_scenes_that_meet_the_criteria(report):
    order, share, _ = report.verdicts
    assert set(order.evidence["recommended"].first["scene"]) == {
        f"plain/target:length=20:scene={scene}" for scene in (200, *range(202, 213))
    }
    assert order.verdicts["recommended"].effect.endswith("px, 12 scenes")
    assert share.verdicts["as-written"] == share.verdicts["recommended"]


def test_main_table_counts_scenes_in_the_units_of_the_paper(report):
    main, times = report.main
    assert main.headings == ["statement", "tracker", "paper", "as written", "recommended"]
    runs = report.context.runs
    static = [runs.measured_run(STATIC, scene) for scene in SCENES]
    camshift = [runs.measured_run(ADAPTIVE, scene) for scene in SCENES]
    frames = [np.mean([run.on_target.sum() for run in runs_of]) for runs_of in (camshift, static)]
    smaller = sum(a.error.mean() < b.error.mean() for a, b in zip(camshift, static, strict=True))
    n_kept = sum(run.on_target[-10:].all() and run.on_target.mean() >= 0.9 for run in static)
    assert [row[-1].text for row in main.rows] == [
        f"{n_kept} of 12", f"{frames[0]:.0f} / {frames[1]:.0f} of 20", f"{smaller} of 12",
    ]  # fmt: skip
    assert times.caption == "Times."


def test_sensitivity_table_changes_one_choice(report):
    (table,) = (table for table in report.tables if table.name == "sensitivity")
    (row,) = table.rows
    assert [cell.text for cell in row[:2]] == ["16 bins", "recommended"]
    assert row[2].text.endswith(" px")
    assert row[3].text in {"0.0", "1.0", "2.0"}, "a share that is added up over members is a count"


def positions(text, parts):
    indices = [text.index(part) for part in parts]
    return indices == sorted(indices)


def test_page_begins_with_the_answer_and_ends_with_commands(report, tmp_path):
    file = tmp_path / "docs" / "papers" / "tiny.md"
    markdown_page.write_markdown_pages(file, tmp_path / "docs" / "pictures" / "papers", report)
    assert positions(
        file.read_text("utf-8"),
        [
            "# A tiny paper",
            "A. Author.",
            "**CamShift keeps the target.**",
            "recommended: Main results reproduced: ",
            "[Details](tiny-details.md)",
            "## The paper's results and ours",
            "20 / 3 of 20",
            "## Pictures",
            "](../pictures/papers/tiny-figure-1.webp)",
            "*Fig. 1: Frames 1, 10 and 20 with both trackers. Scene ",
            "## Verdicts",
            "TI-1",
            "## What differs and why",
            "- The window.",
            "## From the text to the default",
            "## Decided after results had been seen",
            "- The length of the scenes.",
            "## How to run it",
            "trackmark reproduce tiny --all",
            "trackmark run --sequences CLIP --name clip --trackers static:preset=recommended,",
        ],
    )


def test_details_have_criteria_choices_and_figures(report, tmp_path):
    text = markdown_page.details_page(report, tmp_path / "tiny.md")
    (_, file, *_) = (drawing.path for drawing in report.figures)
    assert positions(
        text,
        [
            "# Details: A tiny paper",
            "[Results and verdicts](tiny.md)",
            "CamShift on short sequences.",
            "The paper's videos are not included;",
            "## Criteria of the scenes",
            "a moving target",
            "Scenes of sequence target that miss a criterion and are not used: 201.",
            "## Choices of the trackers",
            "## Values that were not taken",
            "16 bins",
            "## Sensitivity",
            "## Times",
            "## Figures",
            f"`{file.name}`: ",
        ],
    )


def test_pages_have_equal_bytes_the_second_time(tiny, report, tmp_path):
    folders = []
    for number, repeated in enumerate([report, tiny.report(with_sensitivity=True)]):
        folders.append(tmp_path / str(number))
        markdown_page.write_markdown_pages(folders[-1] / "tiny.md", folders[-1], repeated)
    names = ["tiny-details.md", "tiny-figure-1.webp", "tiny.md"]
    assert sorted(file.name for file in folders[0].iterdir()) == names
    for name in names:
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes()


def test_terminal_shows_the_sum_lines_first(report, tmp_path):
    lines = report_lines(report, tmp_path, verbose=True)
    for line, setting in zip(lines, SETTINGS, strict=False):
        assert line.startswith(f"{setting}: Main results reproduced: ")
    file = str(tmp_path / "report.html")
    assert positions("\n".join(lines), ["CamShift keeps the target.", "20 / 3 of 20", "TI-1", file])
    labels = [("holds", "does not hold"), ("does not hold", "holds"), ("holds", "by construction")]
    listed = "\n".join(report_lines(relabelled(report, labels), tmp_path))
    assert "Does not hold (1)" in listed  # as recommended
    assert ("TI-1" in listed, "TI-2" in listed, "TI-3" in listed) == (True, False, False)


def relabelled(report, labels):
    """Return a report whose claims have other verdicts, given by setting for each claim."""
    rows = [
        replace(row, verdicts={s: replace(row.verdicts[s], verdict=label) for s, label in changed})
        for row, of_claim in zip(report.verdicts, labels, strict=True)
        for changed in [zip(SETTINGS, of_claim, strict=True)]
    ]
    return replace(report, verdicts=rows)


def test_no_csv_has_fewer_rows_than_its_table(report, tmp_path):
    write_tables(tmp_path, report.tables)
    assert_tables_have_rows(tmp_path)
    assert {table.name for table in report.tables} == {file.stem for file in tmp_path.glob("*.csv")}
    for table in report.tables:
        assert len(rows_of(tmp_path / f"{table.name}.csv")) >= len(table.rows), table.name


def rows_of(file):
    with file.open(newline="") as text:
        return list(csv.DictReader(text))


def judged(report, **fields):
    """Return the evidence of a claim of the tiny paper, with some fields replaced."""
    entry = {"name": "TI-1", **CLAIM_TEXTS, "sequences": "target", "scenes": 12, **fields}
    claim = Claim.model_validate(entry, context=report.context.paper.names)
    return evidence(claim, "recommended", report.context)


def test_trackers_with_equal_boxes_do_not_pose_a_problem(report):
    sides = {"test": "order", "margin": 0.02}
    equal = judged(report, better="static", worse="static", **sides)
    assert equal.equal_runs == 1.0
    different = judged(report, better="camshift", worse="static", **sides)
    assert different.equal_runs == 0.0
    assert {*different.kept_first["tracker"]} == {ADAPTIVE}
    assert different.kept_second["value"].between(0, 1).all()
    errors = judged(report, better="camshift", worse="static", measure="mean_error", **sides)
    assert errors.kept_first.empty


def test_trackers_by_sequence_run_on_their_own_sequence_only(report):
    sides = {"better": ["camshift", "static"], "worse": ["static", "camshift"]}
    fields = {"test": "order", "margin": 0.02, "side_rule": "by sequence"}
    different = judged(report, sequences=["target", "twice"], **sides, **fields)
    pairs = different.first[["sequence", "tracker"]].drop_duplicates().to_numpy().tolist()
    assert pairs == [["target", ADAPTIVE], ["twice", STATIC]]
    pairs = different.second[["sequence", "tracker"]].drop_duplicates().to_numpy().tolist()
    assert pairs == [["target", STATIC], ["twice", ADAPTIVE]]


def test_criteria_of_the_scenes_limit_what_a_claim_shows(report, monkeypatch):
    fields = {"trackers": "camshift", "test": "share"}
    usual = judged(report, **fields)
    assert (usual.favoured, usual.not_posed) == (False, "")  # no criterion of difficulty
    monkeypatch.setattr(evidence_module, "favoured", lambda paper: frozenset({"TI-1"}))
    assert judged(report, **fields).favoured
    for posed, sentence in (
        (12, ""),
        (11, "11 of the first 40 scenes of target meet the criteria of difficulty"),
    ):
        monkeypatch.setattr(evidence_module, "posed_scenes", lambda *_, posed=posed: (posed, 40))
        assert judged(report, **fields).not_posed == sentence


def test_first_forty_scenes_are_asked_for_their_difficulty(tiny, monkeypatch):
    (criterion,) = read_criteria("tiny")[1]
    names = ["hard", "hard", "easy"]
    criteria = [
        criterion.model_copy(update={"name": name, "kind": kind, "favours": None})
        for name, kind in (("hard", "difficulty"), ("easy", "situation"))
    ]
    values = pd.DataFrame(
        {
            "sequence": "plain/target",
            "scene": np.repeat(np.arange(50), 3),
            "name": names * 50,
            "passes": [True, True, False] * 11 + [True, False, True] * 29 + [True] * 30,
        }
    )
    monkeypatch.setattr(cases, "read_criteria", lambda paper: ({}, criteria))
    monkeypatch.setattr(cases, "read_values", lambda paper: values)
    assert cases.posed_scenes.__wrapped__("tiny", "plain/target") == (11, 40)
    assert cases.posed_scenes.__wrapped__("tiny", "plain/other") == (0, 0)


def test_fewest_particles_are_counted_in_doublings():
    specs = [f"particle-filter:particles={n}" for n in (8, 100, 400)]
    rows = pd.DataFrame(
        {
            "sequence": "target",
            "rank": [0, 1, 2] * 3,
            "scene": "s",
            "tracker": np.repeat(specs, 3),
            "value": [1, 0, 0, 0, 1, 0, 1, 1, 0.5],
        }
    )
    fewest = evidence_module._fewest_particles(rows)
    assert fewest["value"].to_list() == pytest.approx([3, np.log2(100), np.log2(800)])
    assert fewest["rank"].to_list() == [0, 1, 2]
    assert set(fewest["tracker"]) == {specs[0]}


def test_quick_report_has_no_verdicts(tiny, tmp_path):
    quick = tiny.report(quick=True)
    text = "\n".join(report_lines(quick, tmp_path))
    assert quick.verdicts == []
    names = [drawing.name for drawing in quick.figures]
    assert names == ["figure-1", "figure-10", "figure-10-later"]
    assert len(quick.main) == 1  # nothing is timed
    assert "2 scenes per sequence" in text
    assert "TI-1" not in text
    assert "not run" not in text
    page = markdown_page.page(quick, tmp_path / "tiny.md", tmp_path)
    assert re.findall(r"^## (.*)", page, re.M) == [
        "The paper's results and ours", "Pictures", "Real video",
        "From the text to the default", "How to run it",
    ]  # fmt: skip
    html = write_html_page(tmp_path / "quick.html", quick)[0]
    parts, text = sections(html), html.read_text()
    assert [*parts] == ["The paper&#39;s results and ours", "Pictures", "Details"]
    assert "<h1>A tiny paper</h1>" in text
    assert "without verdicts. For verdicts run: trackmark reproduce tiny" in text
    assert opened(parts["The paper&#39;s results and ours"], data_of(text))


def test_failed_run_counts_as_lost_and_is_named(tiny, report, monkeypatch):
    runs, scene = report.context.runs, report.verdicts[1].evidence["recommended"].first["scene"][0]
    measured_run = runs.measured_run
    measured = measured_run("static:preset=recommended", scene)
    failed = replace(measured, record=replace(measured.record, failure="frame 3: ValueError: no"))
    monkeypatch.setattr(
        runs,
        "measured_run",
        lambda *run: failed if run == ("static:preset=recommended", scene) else measured_run(*run),
    )
    values = evidence(report.context.paper.claims["TI-2"], "recommended", report.context)
    assert values.first["value"].iloc[0] == 0
    assert values.failed.startswith("1 of 12 runs failed and count as lost. First: plain/")
    assert values.failed.endswith("frame 3: ValueError: no")


# Figures

SCENES = [f"plain/target:length=20:scene={number}" for number in (200, *range(202, 213))]
ADAPTIVE, STATIC = "camshift:preset=recommended", "static:preset=recommended"


@pytest.fixture
def redraw(report, tmp_path):
    """Return a function that draws a figure of the tiny paper with other fields."""

    def redraw(name, **updates):
        paper = report.context.paper
        figure = {name: paper.figure[name].model_copy(update=updates)}
        paper = paper.model_copy(update={"figure": figure})
        return draw_figures(replace(report.context, paper=paper, folder=tmp_path))

    return redraw


def test_figures_are_drawn_in_order_of_the_entries(report):
    names = ["figure-1", "figure-2", "figure-10", "figure-10-later"]
    assert [drawing.name for drawing in report.figures] == names
    assert report.figures[0].path is None  # a strip
    for drawing in report.figures[1:]:
        assert cv2.imread(str(drawing.path)) is not None
    captions = ["Frames 1, 10 and 20 with both trackers.", "Two frames.", "The later frame."]
    assert [report.figures[index].caption for index in (0, 2, 3)] == captions
    sequence = datasets.load(SCENES[0])
    for drawing, frame in zip(report.figures[2:], (0, 9), strict=True):
        np.testing.assert_array_equal(cv2.imread(str(drawing.path)), sequence[frame])


def test_strip_has_a_row_per_tracker_with_both_settings(report, redraw):
    (drawing,) = redraw("figure-1")
    strip = drawing.strip
    errors = {
        scene: report.context.runs.measured_run(ADAPTIVE, scene).error.mean() for scene in SCENES
    }
    middle = sorted(errors, key=errors.__getitem__)[5]  # the lower one of twelve
    reason = f"Scene `{middle}`, which has the median error of camshift, recommended."
    assert drawing.description == reason
    assert strip.labels == ["frame 1", "frame 10", "frame 20"]
    rows = {row.name: [*row.outlines[1]] for row in strip.rows}
    assert rows == {"camshift": ["as written", "recommended"], "static": ["both settings"]}
    run = report.context.runs.measured_run(ADAPTIVE, middle)
    np.testing.assert_array_equal(strip.rows[0].outlines[1]["recommended"], run.boxes[9])
    np.testing.assert_array_equal(strip.truth[1], run.truth.boxes[9])


def test_plot_has_scenes_in_a_panel_per_setting(report, redraw, monkeypatch):
    panels, draw = [], figures.series_plot
    monkeypatch.setattr(figures, "series_plot", lambda *a: panels.append(a[0]) or draw(*a))
    (drawing,) = redraw(
        "figure-2", quantity=lambda measured: measured.overlap, axis_label="overlap [share]"
    )
    assert (
        "overlap [share] of camshift; static: median and quartiles over 12" in drawing.description
    )
    (panel,) = panels
    assert list(panel) == ["as written", "recommended"]
    expected = [report.context.runs.measured_run(ADAPTIVE, scene).overlap for scene in SCENES]
    np.testing.assert_allclose(panel["recommended"]["camshift"], expected)


# HTML pages

TEXTS = (ADAPTIVE, STATIC)


@pytest.fixture(scope="module")
def page(tiny, report):
    return write_html_page(tiny.results / "tiny" / "report.html", report)[0]


def sections(page):
    """Return the parts of a page by their headings."""
    parts = re.split(r"<h2>(.*?)</h2>", page.read_text())[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


def main_rows(page):
    """Return the rows of the main table."""
    text = sections(page)["The paper&#39;s results and ours"]
    return re.findall(r'<tr class="first"[^>]*>(.*?)(?=<tr|</tbody>)', text, re.S)


def opened(part, data):
    """Return the player addresses in the links of a part of a page."""
    links = [address_of(link, data) for link in re.findall(r'href="(#\d[^"]*)"', part)]
    return [dict(parse_qsl(link[1:])) for link in links]


def test_page_starts_with_answer_table_and_pictures(page):
    text, parts = page.read_text(), sections(page)
    assert "<h1>CamShift keeps the target.</h1>" in text
    assert text.index("</h1>") < text.index("Main results reproduced: ") < text.index("<table")
    assert list(parts) == [
        "The paper&#39;s results and ours", "Pictures", "Verdicts", "What differs and why",
        "Details",
    ]  # fmt: skip
    assert re.findall(r'data-plot="panel-\d+">(.*?)<', parts["Pictures"]) == [
        "Fig. 1", "Fig. 2", "Fig. 10",
    ]  # fmt: skip
    assert parts["Pictures"].count("<figure>") == 6  # two trackers, three frames


def test_details_are_folded_and_captions_are_short(page):
    check_texts(page)
    text = sections(page)["Details"]
    assert re.findall(r"<summary>.*?<b>(.*?)</b>", text) == [
        "Real video", "From the text to the default", "Decided after results had been seen",
        "How to run it", "Method and videos", "Rules of the verdicts",
        "Statements that are not judged", "Criteria of the scenes", "Choices of the trackers",
        "Values that were not taken", "Sensitivity", "Times",
    ]  # fmt: skip
    for words in ("CamShift on short sequences.", "A. Author.", "target", "201"):
        assert words in text
    assert "<details open" not in text


def test_values_of_the_main_table_have_the_paper_next_to_them(page, report):
    rows = main_rows(page)
    cells = re.split("<td.*?>", rows[1])[1:]
    cells = [" ".join(re.sub("<.*?>", " ", cell).split()) for cell in cells]
    assert cells[0].endswith("20 / 3 of 20")
    assert cells[2] == report.main[0].rows[1][-1].text
    verdict = report.verdicts[1].verdicts["as-written"].verdict
    assert f"TI-2, {report.verdicts[1].claim.summary}: {verdict}" in rows[0]


def test_claims_that_are_not_counted_have_groups_of_their_own(report, tmp_path):
    labels = ["by construction", "not testable here", "does not hold"]
    judged_otherwise = relabelled(report, [("does not hold", label) for label in labels])
    text = sections(write_html_page(tmp_path / "report.html", judged_otherwise)[0])["Verdicts"]
    groups = re.split(r"<h3 .*?</span> (.*?) <small>", text)[1:]
    assert {
        heading: re.findall(r'id="claim-(.*?)"', group)
        for heading, group in zip(groups[::2], groups[1::2], strict=True)
    } == {
        "Does not hold, recommended": ["TI-3"],
        "By construction, recommended": ["TI-1"],
        "Not testable here, recommended": ["TI-2"],
    }


def test_verdict_opens_the_worst_run_of_its_first_tracker(page, report):
    text = page.read_text()
    claims = re.findall(r'id="claim-(TI-\d)">(.*?)</details>', text, re.S)
    links = {name: opened(part, data_of(text)) for name, part in claims}
    camshift = ["camshift, as written", "camshift, recommended"]
    assert {name: [link["tracker"] for link in of_claim] for name, of_claim in links.items()} == {
        "TI-1": camshift, "TI-2": ["static"] * 2, "TI-3": camshift,
    }  # fmt: skip
    values = report.verdicts[0].evidence["recommended"].first
    assert links["TI-1"][1]["sequence"] == values.loc[values["value"].idxmax(), "scene"]


def test_cell_of_main_table_opens_its_worst_run(page, report):
    _, counts, comparison = (opened(row, data_of(page.read_text())) for row in main_rows(page))
    runs = report.context.runs
    of_counts = counts[-2:]  # recommended
    assert [cell["tracker"] for cell in of_counts] == ["camshift, recommended", "static"]
    for cell, text in zip(of_counts, TEXTS, strict=True):
        frames = {scene: runs.measured_run(text, scene).on_target.sum() for scene in SCENES}
        assert frames[cell["sequence"]] == min(frames.values())
    errors = {scene: runs.measured_run(ADAPTIVE, scene).error.mean() for scene in SCENES}
    assert comparison[-1]["sequence"] == max(errors, key=errors.__getitem__)


def test_numbers_open_frames_that_are_in_the_page(tiny, report, page, monkeypatch):
    monkeypatch.setattr(player_content, "MAX_FRAMES", 0)
    few = write_html_page(tiny.results / "tiny" / "few.html", report)[0]
    for file in (page, few):
        text = file.read_text()
        data = data_of(text)
        stored_frames = {scene["name"]: scene["frame_numbers"] for scene in data["sequences"]}
        assert any(stored_frames.values()) == (file == few)
        places = opened(text, data)
        assert len(places) == 14  # eight in the main table, two for each claim
        for place in places:
            frames = stored_frames[place["sequence"]]
            assert frames is None or int(place["frame"]) in frames


@pytest.fixture
def front(tiny, report):
    """Write the front page of the results."""
    text = json.dumps(report_data(report, 75.0))
    (tiny.results / "tiny" / "report.json").write_text(text)
    return write_front_page(tiny.results)


@pytest.mark.usefixtures("page")
def test_front_page_counts_verdicts_and_links_papers(tiny, front):
    text = front.read_text()
    assert '<a href="tiny/report.html">A tiny paper</a>' in text
    assert "CamShift keeps the target." in text
    assert "1 of 1 papers reproduced" in text
    assert re.findall(r"[✓✕?] (\w[^<]*: \d)<", text)[:2] == ["holds: 2", "does not hold: 1"]
    assert "Made by <code>trackmark reproduce tiny --all</code> (1 min)" in text
    (tiny.results / "tiny" / "report.json").write_text('{"claims": [{}]}')
    with pytest.raises(ResultsError, match=r"report.json: the report cannot be read"):
        write_front_page(tiny.results)


SLOW = pytest.mark.slow


@browser.needs_browser
@pytest.mark.parametrize(
    ("width", "dark"),
    [(390, True), pytest.param(1280, False, marks=SLOW), pytest.param(320, False, marks=SLOW)],
)
def test_paper_pages_are_accessible(page, front, chromium, axe, width, dark):
    check_accessibility(chromium, axe, [page, front], width, dark)


@browser.needs_browser
def test_click_on_verdict_opens_its_runs_in_the_player(page, chromium):
    chromium.console.clear()
    chromium.size(400, 800, mobile=True)
    chromium.open(page.as_uri())
    chromium.run("document.documentElement.style.scrollBehavior = 'auto'")  # a click hits
    chromium.click("#claim-TI-1 > summary > b")
    chromium.wait("byId('claim-TI-1').open")
    assert not chromium.run("byId('claim-TI-2').open")
    assert chromium.run("document.documentElement.scrollWidth") <= 400
    chromium.click("#claim-TI-1 p a:last-of-type")
    chromium.wait("byId('player').open && !!painted")
    assert chromium.run("state.get('tracker')") == "camshift, recommended"
    assert chromium.run("shownTrackers().length") == 2
    assert chromium.console == []
