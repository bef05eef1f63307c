"""The page of a reproduction, of a report that was made up: no tracker runs."""

import io
import json
import re
from dataclasses import replace
from html import unescape
from urllib.parse import parse_qs, parse_qsl

import numpy as np
import pandas as pd
import pytest
from PIL import Image

import datasets
from bench.claims.judging import NOT_RUN
from bench.claims.ledger import read_claims
from bench.claims.readings import Readings
from bench.papers import NO_EVIDENCE, Effort, Report, footage, paper_names
from bench.papers.description import read_description
from bench.papers.front_page import write_front_page
from bench.papers.grounds import Ground, Number, all_grounds
from bench.papers.html_page import _by_reading, _scenes, write_html_page
from bench.papers.report import AMOUNT
from bench.papers.runs import tidy_runs
from bench.papers.tables import RunTable
from bench.store.layout import run_path
from bench.store.loading import load_results
from bench.store.results import Results
from reports.tables import Cell, Table
from tests import browser

HOSTILE = "<script>alert('x')</script> \"q\" & 跟踪"


def finding(reading, verdict, **told):
    told = {"metric": "first_loss", "light": "both", "scenes": "kept", "group": ""} | told
    numbers = {"statistic": 1.0, "interval": [0.5, 1.5], "unit": "px", "cells": 8}
    return {
        "reading": reading, "post_hoc": reading.startswith("σ"), "verdict": verdict,
        "effect": "1.0 [0.5, 1.5] px, 8 scenes", "counted": "scene", "reason": "",
        **numbers, **told,
    }  # fmt: skip


def claim(name, verdict, **evidence):
    known = {
        "reason": "It lies above zero.", "quote": f"It is tracked {HOSTILE}.", "kind": "order",
        "asserted": False, "ours": False, "falsifier": "It is lost.", "fragile": False,
        "published": [{"label": "sequence 1", "value": 788, "unit": "frames"}],
        "experiment": ["p-table-1"], "all_drawn_scenes": verdict, "post_hoc": "0 of 1",
        "findings": [finding("as written", verdict), finding("σ = 0.2", "does not hold")],
    }  # fmt: skip
    return {
        "id": name, "source": "Section 3", "text": "The target is tracked.", "short": "",
        "verdict": verdict, "effect": "1.0 [0.5, 1.5] px, 8 scenes", "statistic": 1.0,
        "interval": [0.5, 1.5], "unit": "px", "cells": 8, "counted": "scene",
        "readings": "1 of 1", "evidence": known | evidence,
    }  # fmt: skip


READINGS = Readings.model_validate(
    {"axes": {"text": {"as written": {"sigma": 1}, "σ = 0.2": {"sigma": 0.2, "post_hoc": True}}}}
)


SCENES = [f"plain/target:length=20:scene={scene}" for scene in range(3)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, store_runs):
    """Results of two trackers on three scenes."""
    folder = tmp_path_factory.mktemp("results")
    store_runs(folder / "p-table-1", ["static", "camshift"], SCENES)
    return folder


def rests_on(folder):
    """A number a scene and tracker."""
    names = ["static", "camshift"]

    def number(scene, tracker):
        file = folder / "p-table-1" / run_path(tracker, datasets.load(scene).name, 0, "accuracy")
        return Number(1.0 + scene.count("2"), str(file))

    rows = [(scene, [Number(0.5), *(number(scene, one) for one in names)]) for scene in SCENES]
    return [Ground("than others", ["ahead", *names], rows, 20, kind="centre_error")]


@pytest.fixture(scope="module")
def report(folder):
    picture = folder / "wang2010" / "figure-3.png"
    picture.parent.mkdir()
    stream = io.BytesIO()
    Image.fromarray(np.full((20, 30, 3), 200, np.uint8)).save(stream, "PNG")
    picture.write_bytes(stream.getvalue())
    rows = [[Cell(HOSTILE), Cell("17.7"), Cell("16")], [Cell("hue"), Cell("9"), Cell("—")]]
    table = Table("table-1", "Table 1", ["features", "ours", "paper"], 1, rows)
    verdicts = [["P-1", "holds, 1 px", "holds, 1 px", "inconclusive"], ["P-9", "—", "—", "—"]]
    cells = [[Cell(text) for text in row] for row in verdicts]
    heads = ["claim", "as written", "r = 1", "r = 2"]
    read = Table("verdicts", "Verdicts by reading; `r` is a radius", heads, 1, cells)
    files = [number.run for _, row in rests_on(folder)[0].rows for number in row[1:]]
    means = [[Cell("static"), Cell("4 of 9"), Cell("2.0")]]
    heads, runs = ["tracker", "error [px]", "elsewhere"], [[files[::2], ["not/held"]]]
    scored = RunTable("scored", "Means", heads, 1, means, runs=runs)
    claims = [
        claim("P-1", "holds"),
        claim("P-2", "inconclusive", reason=f"{NOT_RUN}; leave out --quick.", findings=[])
        | {"effect": "", "statistic": None},
        claim("P-3", "does not hold"),
        claim("P-4", "does not hold"),
    ]
    title = f"{NO_EVIDENCE}: A paper"
    remarks = [f"{AMOUNT}few.", "Other videos; `figure-3` is ours.", "B.", "C.", "The last."]
    grounds = {"P-1": rests_on(folder)}
    sums = {"P-4": ("P-1", "P-3")}
    tables = [table, read, scored]
    captions = {"figure-3": ("Fig. 3, other videos.", "Error [px] against frame.")}
    return Report(
        title, remarks, tables, [], claims, [picture], [table], grounds, sums, captions=captions
    )


@pytest.fixture(scope="module")
def page(report, folder):
    path = folder / "wang2010" / "report.html"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(footage, "QUICK_SECONDS", 1e9)  # however busy it is here
        return write_html_page(path, report, READINGS, "wang2010", Effort(quick=True))[0]


def test_a_page_has_every_claim_table_and_figure_and_says_what_is_no_evidence(page):
    text = page.read_text()
    assert f"<h1>{NO_EVIDENCE}: A paper</h1>" in text
    assert "4 claims: 2 does not hold, 1 holds, 1 not run" in text
    assert re.search(r"<td[^>]*>17\.7<", re.sub(r"</?i\b[^>]*>", "", text))
    assert 'src="data:image/png;base64,' in text
    assert 'data-mark="not run"' in text
    assert "leave out --quick" in text
    assert "σ = 0.2 (post hoc)" in text
    assert "sequence 1: 788 frames" in text
    assert "trackmark reproduce wang2010 --quick" in text
    assert "<script>alert" not in text
    assert "Than others: 3 of 20 scenes" in text


def test_a_summary_leads_to_the_claims_that_it_sums(page):
    text = page.read_text()
    (table,) = re.findall(r'<table id="summed-P-4".*?</table>', text, re.S)
    assert re.findall(r'<a href="([^"]*)">', table) == ["#claim-P-1", "#claim-P-3"]
    assert "does not hold" in table
    assert "summed-P-1" not in text


def test_a_page_is_looked_at_from_its_tally_and_says_things_once(page):
    text = page.read_text()
    main = re.search(r"<main>.*</main>", text, re.S)[0]
    tally = re.search(r'class="tally" role="img" aria-label="([^"]*)"', main)[1]
    assert tally == "1 holds, 2 does not hold, 1 not run"
    mark = '<span class="mark" data-mark="does not hold">does not hold</span>'
    assert re.search(f"<td[^>]*>{mark}", main)
    assert "MARKED" not in text
    assert AMOUNT not in main  # the section on claims says it
    assert "<code>figure-3</code> is ours" in main
    assert "<code>r</code> is a radius" in main
    assert "`" not in main
    assert 'alt="Fig. 3, other videos. Error [px] against frame."' in main
    assert "<figcaption>Fig. 3, other videos.</figcaption>" in main
    assert main.count("trackmark reproduce wang2010 --quick") == 1
    read = re.search(r'<table id="verdicts".*?</table>', main, re.S)[0]
    assert re.findall(r"<td[^>]*>(.*?)</td>", read) == ["holds, 1 px", "=", "inconclusive"]
    assert "Tested in no reading that was run: P-9." in main


def test_means_of_runs_open_the_worst_frame_that_the_page_holds(page, folder):
    text = page.read_text()
    table = re.search(r'<table id="scored".*?</table>', text, re.S)[0]
    error, elsewhere = re.findall(r"<td[^>]*>(.*?)</td>", table)
    assert elsewhere == "2.0"
    asked = parse_qs(unescape(error).partition("#")[2].partition('"')[0])
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    scene = next(one for one in data["scenes"] if one["name"] == asked["sequence"][0])
    assert asked["tracker"] == ["static"]
    assert scene["kept"] is None or int(asked["frame"][0]) in scene["kept"]
    runs = load_results(folder / "p-table-1")
    runs = runs[runs["tracker"] == "static"]
    assert asked["sequence"][0] == runs.loc[runs["centre_error"].idxmax(), "sequence"]


def test_parts_of_a_claim_stand_beneath_the_readings_and_say_why():
    told = [
        finding(reading, "holds") | {"group": group, "reason": f"why {reading}{group}"}
        for reading in ("as written", "r = 1")
        for group in ("", "the hand", "the cup")
    ]
    whole, parts = _by_reading(claim("P-1", "holds", findings=told))
    assert [row[0].text for row in whole.table.rows] == ["as written", "r = 1"]
    assert not whole.folded
    assert parts.folded
    assert [cell.text for cell in parts.table.rows[3]][1::3] == ["the cup", "why r = 1the cup"]
    (alone,) = _by_reading(claim("P-1", "holds", findings=told[:3]))
    assert not alone.folded
    assert len(alone.table.rows) == 2


def test_a_metric_that_all_are_judged_by_is_no_part():
    told = [finding(f"r = {n}", "holds") | {"metric": "first_loss"} for n in range(2)]
    (made,) = _by_reading(claim("P-1", "holds", findings=told))
    assert made.table.heads[:2] == ["reading", "verdict"]


def test_numbers_that_nothing_judges_stand_apart():
    verdicts = ["holds", *["not testable"] * 3]
    told = [finding(f"r = {n}", verdict) for n, verdict in enumerate(verdicts)]
    judged, others = _by_reading(claim("P-1", "holds", findings=told))
    assert [row[0].text for row in judged.table.rows] == ["r = 0"]
    assert not judged.folded
    assert len(others.table.rows) == 3
    assert others.folded
    assert "verdict" not in others.table.heads


PAPER = """
version = 1
title = "A paper"
experiments = { always = ["table-1"] }
"""

LEDGER = """
version = 1
[claim.P-1]
source = "3"
quote = "q"
says = "s"
kind = "order"
experiment = ["p-table-1"]
falsifier = "f"
on = ["plain/target:length=20"]
parts.better.order = { better = "camshift", worse = "static", by = "centre_error", margin = 0.1 }
parts.kept.share = { of = "static", by = "mean_overlap" }
"""


READ_BY_TRACE = """
[readings.trace]
revised = { where = { trace = "revised" } }
online = { where = { trace = "online" } }
"""


def test_a_claim_rests_on_the_scenes_that_speak_most_against_it(folder, tmp_path):
    (tmp_path / "paper.toml").write_text(PAPER)
    (tmp_path / "claims.toml").write_text(LEDGER)
    description = read_description("p", tmp_path / "paper.toml").model_copy(
        update={"apart": ("length",)}
    )
    scores = tidy_runs(folder / "p-table-1", None, description, {})
    scores = scores.assign(experiments=",p-table-1,", copied=False)
    found = all_grounds(read_claims(tmp_path / "claims.toml"), scores, {})["P-1"]
    compared, shared = found
    assert compared.heads[0] == "ahead, centre error [px]"
    by = scores.pivot_table(index="name", columns="tracker", values="centre_error")
    ahead = (by["static"] - by["camshift"]).sort_values()
    assert [scene for scene, _ in compared.rows] == list(ahead.index)
    for scene, numbers in compared.rows:
        expected = [ahead[scene], by["camshift"][scene], by["static"][scene]]
        assert [one.value for one in numbers] == pytest.approx(expected)
        assert [one.run for one in numbers[1:]] == [
            str(folder / "p-table-1" / run_path(tracker, scene, 0, "accuracy"))
            for tracker in ("camshift", "static")
        ]
    least = scores[scores["tracker"] == "static"].sort_values("mean_overlap")["name"]
    assert [scene for scene, _ in shared.rows] == list(least)
    both = pd.concat([scores.assign(trace="revised"), scores], ignore_index=True)
    ledger = LEDGER.replace("[claim.P-1]", READ_BY_TRACE + "[claim.P-1]")
    (tmp_path / "claims.toml").write_text(ledger)
    for ground in all_grounds(read_claims(tmp_path / "claims.toml"), both, {})["P-1"]:
        runs = [one for _, numbers in ground.rows for one in numbers if one.run]
        assert {one.trace for one in runs} == {"revised"}


def grounds_of(folder, tmp_path, ledger, tables, together=str, **columns):
    """Grounds of a claim on the runs of the folder."""
    (tmp_path / "paper.toml").write_text(PAPER)
    (tmp_path / "claims.toml").write_text(ledger)
    description = read_description("p", tmp_path / "paper.toml")
    description = description.model_copy(update={"apart": ("length",)})
    scores = tidy_runs(folder / "p-table-1", None, description, {})
    scores = scores.assign(experiments=",p-table-1,", copied=False).assign(**columns)
    made = {name: make(scores) for name, make in tables.items()}
    claims = read_claims(tmp_path / "claims.toml")
    return scores, all_grounds(claims, scores, made, together)["P-1"]


def test_a_number_of_a_set_of_sequences_opens_the_worst_of_its_trackers_runs_there(
    folder, tmp_path
):
    ledger = LEDGER.partition("parts.")[0].replace("plain/target:length=20", "all")
    ledger += 'parts.kept.share = { of = "static", by = "seen", table = "sets" }'

    def sets(scores):
        rows = scores.groupby(["text", "tracker", "trace"], as_index=False).first()
        return rows.assign(sequence="all", scene=0, seen=0.5)

    scores, (ground,) = grounds_of(
        folder, tmp_path, ledger, {"sets": sets}, lambda _: "all", scene=0
    )
    ((name, (number,)),) = ground.rows
    assert name == "all, scene 0"
    its = scores[scores["tracker"] == "static"]
    assert number.run == its.loc[its["mean_overlap"].idxmin(), "path"]


def test_a_column_whose_runs_are_anothers_says_whose_they_are(folder, tmp_path):
    ledger = LEDGER.partition("parts.better")[0]
    ledger += 'parts.kept.share = { of = "static", by = "mean_overlap" }'
    _, (ground,) = grounds_of(folder, tmp_path, ledger, {}, copied=True)
    found = footage.footage_of({"P-1": [ground]}, folder, Effort(quick=True), lambda *_: None)
    sheet = _scenes("scenes", ground, found)
    assert "Runs of static are those of static, which does the same." in sheet.table.caption


def test_a_front_page_has_a_row_a_paper_and_leads_to_the_pages_that_there_are(report, folder):
    document = {"title": report.title, "command": "trackmark reproduce wang2010 --quick"}
    document |= {"quick": True, "seconds": 75.0, "tracking_seconds": 9000, "claims": report.claims}
    (folder / "wang2010" / "report.html").touch()
    (folder / "wang2010" / "report.json").write_text(json.dumps(document))
    text = write_front_page(folder).read_text()
    assert f"<h1>{NO_EVIDENCE}: papers reproduced</h1>" in text
    assert '<a href="wang2010/report.html">wang2010</a>' in text
    assert text.count("/report.html") == 2  # of its tile and of its row
    assert 'class="tally" role="img" aria-label="1 holds, 2 does not hold, 1 not run"' in text
    assert text.count("<article>") == len(paper_names())
    assert text.count(">not run</td>") == len(paper_names()) - 1
    assert ">wang2010 --quick</td>" in text
    cells = re.findall(r'<td data-value="[^"]*">([^<]*)</td>', text)
    assert cells == ["1", "0", "2", "0", "1", "2.5 h", "1 min"]


@pytest.mark.parametrize("seconds", [0.0, 1e9])
@pytest.mark.parametrize("frames", [0, 7, 40, 60])
def test_frames_that_are_kept_are_those_that_numbers_lead_to_and_then_those_around_them(
    folder, frames, seconds, monkeypatch
):
    monkeypatch.setattr(footage, "MOST_FRAMES", frames)
    monkeypatch.setattr(footage, "QUICK_SECONDS", seconds)
    rests = {"P-1": rests_on(folder)}
    found = footage.footage_of(rests, folder, Effort(quick=True), lambda *_: None)
    (ground,) = rests["P-1"]
    worst = [
        [found.place(one.run, "centre_error") for one in row if one.run] for _, row in ground.rows
    ]
    anyhow = {(place.sequence, place.frame) for row in worst for place in row}
    near = {(place.sequence, place.frame + step) for place in worst[0] for step in range(-2, 3)}
    anyhow |= {(sequence, frame) for sequence, frame in near if 0 <= frame < 20}
    kept = {
        (number, frame)
        for number, one in enumerate(found.scenes)
        for frame in (range(20) if one.kept is None else one.kept)
    }
    assert kept == anyhow if not seconds else kept >= anyhow
    assert found.frames == len(kept) == (max(frames, len(anyhow)) if seconds else len(anyhow))


def test_no_number_leads_to_a_frame_that_is_not_there_when_there_is_no_time(
    report, folder, tmp_path, monkeypatch
):
    monkeypatch.setattr(footage, "QUICK_SECONDS", 0.0)
    given = tmp_path / "wang2010" / "report.html"
    (tmp_path / "p-table-1").symlink_to(folder / "p-table-1")
    page, *_ = write_html_page(given, report, READINGS, "wang2010", Effort(quick=True))
    text = page.read_text()
    data = json.loads(re.search(r'id="data">(.*?)</script>', text, re.S)[1])
    scenes = {scene["name"]: scene for scene in data["scenes"]}
    links = re.findall(r'href="#(sequence=[^"]*)"', re.search(r'id="part-claims".*', text, re.S)[0])
    asked = [dict(parse_qsl(unescape(link))) for link in links]
    assert len(asked) == 6
    without = [one for one in asked if int(one["frame"]) not in scenes[one["sequence"]]["kept"]]
    assert without == []


def test_a_number_of_revised_boxes_opens_their_worst_frame(tmp_path, store_runs, monkeypatch):
    scene = SCENES[0]
    store_runs(tmp_path / "p", ["static"], [scene])
    file = tmp_path / "p" / run_path("static", datasets.load(scene).name, 0, "accuracy")
    results = Results(tmp_path / "p")
    run = results.read(file)
    boxes, revised = (datasets.load(scene).boxes.copy() for _ in range(2))
    boxes[7, 0] += 30
    revised[12, 0] += 30
    monkeypatch.setattr(Results, "read", lambda *_: replace(run, boxes=boxes, revised=revised))
    row = [Number(1.0, str(file)), Number(1.0, str(file), "revised")]
    grounds = {"P-1": [Ground("", ["online", "revised"], [(scene, row)], 1, kind="centre_error")]}
    found = footage.footage_of(grounds, tmp_path, Effort(quick=True), lambda *_: None)
    online, again = (found.place(one.run, "centre_error", (), one.trace) for one in row)
    assert (online.frame, online.revised) == (7, False)
    assert (again.frame, again.revised) == (12, True)
    assert all({place.frame} <= {*(found.scenes[0].kept or range(20))} for place in (online, again))


@browser.needs_browser
def test_a_claim_opens_its_scenes_and_these_the_worst_frame(page, tmp_path):
    shown = browser.Browser(tmp_path)
    try:
        shown.size(400, 800, mobile=True)
        shown.open(page.as_uri())
        shown.run("document.documentElement.style.scrollBehavior = 'auto'")  # a click hits
        shown.click("#claims tbody tr:nth-child(1) a")
        shown.wait("byId('claim-P-1').open")
        assert not shown.run("byId('claim-P-3').open")
        assert shown.run("document.documentElement.scrollWidth") <= 400
        fold = "document.querySelector('#scored').closest('details').open"
        assert not shown.run(fold)
        written = "byId('filter').value = '{}'; byId('filter').dispatchEvent(new Event('input'))"
        shown.run(written.format("4 of 9"))
        assert shown.run(fold)  # what a filter finds is seen
        shown.run(written.format(""))
        shown.click(".picture button")
        assert shown.run("document.querySelector('.picture button').ariaExpanded") == "true"
        shown.click("#scenes-P-1-0 tbody tr:nth-child(2) td:nth-child(3) a")
        shown.wait("byId('player').open && !!painted")
        assert shown.run("state.get('tracker')") == "static"
        assert shown.run("scene.name") == datasets.load(SCENES[1]).name
        assert shown.run("byId('legend').querySelectorAll('[aria-pressed=true]').length") == 2
        assert shown.console == []
    finally:
        shown.close()


def test_a_side_of_several_trackers_is_named_in_words(folder, tmp_path):
    (tmp_path / "paper.toml").write_text(PAPER)
    both = '{ tracker = ["static", "camshift"] }'
    part = f'parts.kept.share = {{ table = "own", of = {both}, by = "found" }}'
    ledger = LEDGER[: LEDGER.index("parts.better")] + part
    (tmp_path / "claims.toml").write_text(ledger)
    description = read_description("p", tmp_path / "paper.toml").model_copy(
        update={"apart": ("length",)}
    )
    scores = tidy_runs(folder / "p-table-1", None, description, {})
    scores = scores.assign(experiments=",p-table-1,", copied=False)
    own = scores[["tracker", "sequence", "scene"]].assign(found=1.0)
    ((ground,),) = all_grounds(read_claims(tmp_path / "claims.toml"), scores, {"own": own}).values()
    assert ground.heads == ["static / camshift: found"]
