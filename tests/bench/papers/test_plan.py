"""Runs that a paper needs: scenes that meet the criteria, settings, experiments, a new claim."""

import re
from pathlib import Path

import pytest

from tests.bench.papers.claim_entries import claim_text
from trackmark.bench import papers
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers import ReproductionOptions, cases
from trackmark.bench.papers.development import read_sensitivity
from trackmark.bench.papers.paper import read_claims, read_paper
from trackmark.bench.papers.plan import experiments

PAPER = """
version = 1
title = "A paper"
citation = "A. Author. A paper. 2000."
method = "It tracks."
finding = "It tracks here, too."
{field}
[trackers]
"proposed" = "wang2010:particles=15"
"CamShift" = "camshift:preset=recommended"
[sequences]
cup = "wang2010/cup"
hand = "wang2010/hand"
both = ["wang2010/cup", "wang2010/hand"]
[main_table]
caption = "Kept."
headings = ["sequence"]
[[main_table.rows]]
labels = "cup"
paper = "1"
sequence = "cup"
trackers = "{tracker}"
measures = "kept_to_end"
"""


CLAIM = {"sequences": "both", "trackers": ["proposed", "CamShift"], "test": "share"}

SENSITIVITY = """
columns = [{ heading = "kept", sequence = "hand", tracker = "proposed", measure = "kept_to_end" }]
rows = ["N = 7"]
"""

DEVELOPMENT = """
measure = "kept_to_end"
heading = "kept"
runs = []
candidates = [{ name = "N = 7", changed_options = { proposed = "particles=7" } }]
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Return a function that writes the files of a paper, as the only paper, and reads it."""
    passing = {"wang2010/cup": tuple(range(200, 240)), "wang2010/hand": (200, *range(202, 240))}
    monkeypatch.setattr(cases, "verdict_scenes", lambda _, sequence: passing[sequence])
    monkeypatch.setattr(papers, "FOLDER", tmp_path)
    folder = tmp_path / "wang2010"
    folder.mkdir()

    def write(field="", tracker="CamShift", **claim):
        text = PAPER.format(field=field, tracker=tracker)
        (folder / "paper.toml").write_text(text, "utf-8")
        (folder / "claims.toml").write_text(claim_text("AB-1", **CLAIM | claim), "utf-8")
        (folder / "sensitivity.toml").write_text(SENSITIVITY, "utf-8")
        (folder / "development.toml").write_text(DEVELOPMENT, "utf-8")
        return read_paper("wang2010")

    return write


@pytest.mark.parametrize(
    ("fields", "file", "message"),
    [
        (
            {"tracker": "Camshift"},
            "paper.toml, main_table.rows.0.trackers.0",
            "unknown tracker 'Camshift'; known: proposed, CamShift",
        ),
        ({"field": "colour = 1"}, "paper.toml", "colour: Extra inputs"),
        (
            {"sequences": "ball"},
            "claims.toml: claim AB-1, sequences.0",
            "unknown sequence 'ball'; known: cup, hand, both",
        ),
        ({"measure": "keep"}, "claims.toml: claim AB-1, measure", "unknown measure 'keep'"),
        ({"measure": "scenes.keep"}, "claims.toml: claim AB-1", "unknown measure 'scenes.keep'"),
    ],
)
def test_error_names_file_and_entry(write, tmp_path, fields, file, message):
    with pytest.raises(ExperimentError) as caught:
        write(**fields)
    assert str(caught.value).startswith(str(tmp_path / "wang2010" / file))
    assert message in str(caught.value)


def test_tracker_keeps_its_own_options_in_a_setting(write):
    paper = write()
    assert paper.spec("proposed", "as-written") == "wang2010:preset=as-written:particles=15"
    assert paper.spec("proposed", "recommended") == "wang2010:preset=recommended:particles=15"
    table = read_sensitivity(paper)
    case = table.case(table.rows[0], table.columns[0])
    assert case.tracker == "wang2010:preset=recommended:particles=7"


def test_scenes_that_fail_the_criteria_are_skipped(write):
    hand = write().sequences["hand"]
    assert hand.scenes(2) == [("wang2010/hand:scene=200",), ("wang2010/hand:scene=202",)]
    with pytest.raises(ExperimentError, match="40 scenes of hand are requested, but only 39 meet"):
        hand.scenes(40)


def test_group_has_the_passing_scenes_of_all_members(write):
    assert write().sequences["both"].scenes(2) == [
        ("wang2010/cup:scene=200", "wang2010/hand:scene=200"),
        ("wang2010/cup:scene=201", "wang2010/hand:scene=202"),
    ]


def test_claim_requests_both_settings_and_its_scenes(write):
    paper = write()
    by_name = {e.name: e for e in experiments(paper, ReproductionOptions())}
    assert by_name.keys() == {"wang2010-cup", "wang2010-both"}
    both = by_name["wang2010-both"]
    assert len(both.sequences) == 2 * 24
    assert both.trackers == (
        "wang2010:preset=as-written:particles=15",
        "wang2010:preset=recommended:particles=15",
        "camshift:preset=recommended",
    )
    (quick,) = experiments(paper, ReproductionOptions(quick=True))
    assert (quick.name, len(quick.sequences)) == ("wang2010-cup", 3)


def test_claim_of_contributing_is_planned(tmp_path, monkeypatch):
    page = (Path(__file__).parents[3] / "CONTRIBUTING.md").read_text("utf-8")
    section = page.partition("### A claim")[2].partition("\n## ")[0]
    (text,) = re.findall(r"```toml\n(.*?)```", section, re.DOTALL)
    paper = read_paper("wang2010")
    (tmp_path / "wang2010").mkdir()
    (tmp_path / "wang2010" / "claims.toml").write_text(text, "utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(papers, "FOLDER", tmp_path)
        claims = read_claims("wang2010", paper.names)
    no_rows = paper.main_table.model_copy(update={"rows": ()})
    update = {"claims": claims, "figure": {}, "main_table": no_rows}
    (experiment,) = experiments(paper.model_copy(update=update), ReproductionOptions())
    assert (experiment.name, len(experiment.sequences)) == ("wang2010-hand", 12)
