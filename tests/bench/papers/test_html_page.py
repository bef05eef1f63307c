"""The page of a tiny paper, and the page of all papers."""

import json
import re
from dataclasses import replace
from html import unescape
from urllib.parse import parse_qsl

import pandas as pd
import pytest

from tests import browser
from trackmark.bench.claims.claim_tests import Evidence
from trackmark.bench.papers import evidence_frames
from trackmark.bench.papers.evidence_frames import claim_scenes
from trackmark.bench.papers.html_page import write_html_page
from trackmark.bench.papers.index_page import write_front_page
from trackmark.bench.papers.reproduction import report_data
from trackmark.bench.store.files import ResultsError

TEXTS = ("camshift:window=adaptive", "static")


@pytest.fixture(scope="module")
def page(tiny, report):
    return write_html_page(tiny.results / "tiny" / "report.html", report)[0]


def sections(page):
    """Parts of a page by their headings."""
    parts = re.split(r"<h2>(.*?)</h2>", page.read_text())[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


def opened(text):
    """Addresses of the player that links of a text lead to."""
    links = re.findall(r'href="#(sequence=[^"]*)"', text)
    return [dict(parse_qsl(unescape(link))) for link in links]


def test_page_has_parts_in_order(page):
    assert list(sections(page)) == [
        "The paper", "The paper&#39;s numbers and ours", "Figures", "Verdicts",
        "Scenes behind the verdicts", "What differs and why", "The scenes", "Settings",
        "Sensitivity (no verdicts)", "How to run it", "History",
    ]  # fmt: skip


def test_page_shows_citation_result_figures_and_folded_history(page):
    parts = sections(page)
    assert "<p>A. Author. A tiny paper. 2001.</p>" in parts["The paper"]
    assert "CamShift follows the target." in parts["The paper"]
    assert parts["Figures"].count("<figure") == 4
    assert "Fig. 1. Paper: Frames 1, 10 and 20 with both trackers. Ours:" in parts["Figures"]
    assert "<p>The window.</p>" in parts["What differs and why"]
    assert "Skipped scenes of target: 201." in parts["The scenes"]
    assert "trackmark reproduce tiny --all" in parts["How to run it"]
    assert re.search(r"<details.*One scene was replaced.*</details>", parts["History"], re.S)


def test_page_counts_verdicts_in_both_settings(page, report):
    text = sections(page)["Verdicts"]
    assert "as-written: 2 hold, 1 does not hold." in text
    assert re.search(r"recommended: 1 holds, 1 does not hold, 1 inconclusive.", text)
    assert text.count('href="#claim-') == len(report.verdicts)


def test_scenes_of_a_claim_are_sorted_worst_first(report):
    row = report.verdicts[0]
    for setting in ("as-written", "recommended"):
        ahead = [scene_row.numbers[0] for scene_row in claim_scenes(row, setting, report.context)]
        assert ahead == sorted(ahead)
        first, second = row.evidence[setting].first, row.evidence[setting].second
        worst = min(second["value"].to_numpy() - first["value"].to_numpy())
        assert ahead[0] == pytest.approx(worst)


def test_scenes_of_a_share_are_those_that_fail_first(report):
    (_, row, timed) = report.verdicts
    scene_rows = claim_scenes(row, "recommended", report.context)
    assert [scene_row.runs[1].tracker for scene_row in scene_rows] == ["static"] * 6
    assert {scene_row.numbers[1] for scene_row in scene_rows} == {0.0}
    assert claim_scenes(timed, "recommended", report.context) == []


def test_scenes_without_runs_have_values_alone(report):
    places = {"sequence": "target", "rank": range(8), "scene": "a", "tracker": ""}
    values = {**places, "value": range(8)}
    row = replace(report.verdicts[1], evidence={"recommended": Evidence(pd.DataFrame(values))})
    scene_rows = claim_scenes(row, "recommended", report.context)
    assert [scene_row.numbers[1] for scene_row in scene_rows] == [0, 1, 2, 3, 4, 5]
    assert {run for scene_row in scene_rows for run in scene_row.runs} == {None}


def test_cell_of_main_table_opens_its_worst_run(page, report):
    *_, cell = opened(sections(page)["The paper&#39;s numbers and ours"])
    judged_runs = report.context.runs.judged_runs
    scenes = report.verdicts[0].evidence["recommended"].first["scene"]
    frames = {(text, s): judged_runs(text, s)[0].on_target.sum() for text in TEXTS for s in scenes}
    assert frames[cell["tracker"], cell["sequence"]] == min(frames.values())


@pytest.mark.parametrize("most", [0, 10_000])
def test_numbers_open_frames_that_are_in_the_page(tiny, report, monkeypatch, most):
    monkeypatch.setattr(evidence_frames, "MAX_FRAMES", most)
    path = tiny.results / "tiny" / "few.html"
    text = write_html_page(path, report)[0].read_text()
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    stored_frames = {scene["name"]: scene["kept"] for scene in data["scenes"]}
    assert any(stored_frames.values()) == (most == 0)
    places = opened(text)
    assert len(places) > 20
    for place in places:
        frames = stored_frames[place["sequence"]]
        assert frames is None or int(place["frame"]) in frames


def test_quick_page_has_numbers_and_strips_without_verdicts(tiny):
    quick = tiny.report(quick=True)
    text = write_html_page(tiny.results / "tiny" / "quick.html", quick)[0]
    parts = sections(text)
    assert "Quick report" in parts["The paper"]
    assert not {"Verdicts", "Scenes behind the verdicts", "Sensitivity (no verdicts)"} & {*parts}
    assert opened(parts["The paper&#39;s numbers and ours"])


def test_front_page_counts_verdicts_and_links_papers(tiny, report, page):
    text = json.dumps(report_data(report, 75.0))
    (tiny.results / "tiny" / "report.json").write_text(text)
    front = write_front_page(tiny.results).read_text()
    assert '<a href="tiny/report.html">tiny</a>' in front
    assert "2 hold, 1 does not hold" in front
    assert "trackmark reproduce tiny --all (1 min)" in front


def test_front_page_names_a_report_that_cannot_be_read(tiny):
    (tiny.results / "tiny" / "report.json").write_text('{"claims": [{}]}')
    with pytest.raises(ResultsError, match=r"report.json: the report cannot be read"):
        write_front_page(tiny.results)


@browser.needs_browser
def test_click_on_verdict_opens_scenes_and_player(page, tmp_path):
    player = browser.Browser(tmp_path)
    try:
        player.size(400, 800, mobile=True)
        player.open(page.as_uri())
        player.run("document.documentElement.style.scrollBehavior = 'auto'")  # a click hits
        player.click("#verdicts tbody tr:nth-child(1) td:nth-child(3)")
        player.wait("byId('claim-TI-1').open")
        assert not player.run("byId('claim-TI-2').open")
        assert player.run("document.documentElement.scrollWidth") <= 400
        player.click("#scenes-TI-1-recommended tbody tr:nth-child(1) td:nth-child(2) a")
        player.wait("byId('player').open && !!painted")
        assert player.run("state.get('tracker')") == "camshift:window=adaptive"
        assert player.run("byId('legend').querySelectorAll('[aria-pressed=true]').length") == 2
        assert player.console == []
    finally:
        player.close()
