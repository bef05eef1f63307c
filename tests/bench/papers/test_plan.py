"""Runs that a paper needs: scenes that meet the criteria, settings, experiments, a new claim."""

import re
from pathlib import Path

import pytest

from tests.bench.claims.entries import claim
from trackmark.bench.claims.claims_file import read_claims
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers import Effort, plan
from trackmark.bench.papers.description import read_description
from trackmark.bench.papers.measures import check_measure
from trackmark.bench.papers.plan import experiments, requests, scene_names, tracker_text

PAPER = """
version = 1
title = "A paper"
citation = "A. Author. A paper. 2000."
method = "It tracks."
finding = "It tracks here, too."
setting_table = [["N", "15", "100", "printed"]]
{repetitions}
[trackers]
"proposed" = "wang2010:particles=15"
"CamShift" = "camshift"
[settings.as-written]
wang2010 = "preset=as-written"
[settings.recommended]
wang2010 = "preset=recommended:particles=100"
camshift = "window=adaptive"
[sequences]
cup = "wang2010/cup"
hand = "wang2010/hand"
both = ["wang2010/cup", "wang2010/hand"]
[main_table]
caption = "Kept."
heads = ["sequence"]
[[main_table.rows]]
labels = "cup"
paper = "1"
sequences = "cup"
trackers = "{tracker}"
measures = "kept"
"""


def described(folder, repetitions="repetitions = 3", tracker="CamShift"):
    path = folder / "paper.toml"
    path.write_text(PAPER.format(repetitions=repetitions, tracker=tracker), "utf-8")
    return read_description("wang2010", path)


@pytest.fixture
def description(tmp_path, monkeypatch):
    passing = {"wang2010/cup": tuple(range(200, 240)), "wang2010/hand": (200, *range(202, 240))}
    monkeypatch.setattr(plan, "verdict_scenes", lambda _, sequence: passing[sequence])
    return described(tmp_path)


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"repetitions": "repetitions = 2"}, "expected: an odd number"),
        ({"tracker": "Camshift"}, "unknown tracker 'Camshift'; known: proposed, CamShift"),
        ({"repetitions": "colour = 1"}, "colour: Extra inputs"),
    ],
)
def test_error_names_file_and_entry(tmp_path, fields, message):
    with pytest.raises(ExperimentError) as caught:
        described(tmp_path, **fields)
    assert str(tmp_path / "paper.toml") in str(caught.value)
    assert message in str(caught.value)


def test_tracker_keeps_its_own_options_in_a_setting(description):
    assert tracker_text(description, "proposed", "as-written") == (
        "wang2010:preset=as-written:particles=15"
    )
    recommended = tracker_text(description, "proposed", "recommended")
    assert recommended == "wang2010:preset=recommended:particles=15"
    changed = tracker_text(description, "proposed", "recommended", {"proposed": "particles=7"})
    assert changed == "wang2010:preset=recommended:particles=7"


def test_scenes_that_fail_the_criteria_are_skipped(description):
    names = scene_names(description, "hand", 2, "background=face")
    assert names == [
        ["wang2010/hand:background=face:scene=200"],
        ["wang2010/hand:background=face:scene=202"],
    ]
    with pytest.raises(ExperimentError, match="40 scenes of hand are requested, but only 39 meet"):
        scene_names(description, "hand", 40)


def test_group_has_the_passing_scenes_of_all_members(description):
    assert scene_names(description, "both", 2) == [
        ["wang2010/cup:scene=200", "wang2010/hand:scene=200"],
        ["wang2010/cup:scene=201", "wang2010/hand:scene=202"],
    ]


def test_claim_requests_both_settings_and_its_scenes(description):
    claims = {"AB-1": claim(sequences="both", of=["proposed", "CamShift"], test="share")}
    by_name = {e.name: e for e in experiments(description, requests(description, claims, Effort()))}
    assert by_name.keys() == {"wang2010-cup", "wang2010-both"}
    both = by_name["wang2010-both"]
    assert len(both.sequences) == 2 * 24
    assert both.repetitions == 3
    assert both.trackers == (
        "wang2010:preset=as-written:particles=15",
        "wang2010:preset=recommended:particles=15",
        "camshift",
        "camshift:window=adaptive",
    )
    (quick,) = experiments(description, requests(description, claims, Effort(quick=True)))
    assert (quick.name, len(quick.sequences), quick.repetitions) == ("wang2010-cup", 3, 1)


# The recipe for a claim in CONTRIBUTING.md

ROOT = Path(__file__).parents[3]


@pytest.fixture
def claims(tmp_path):
    """Return the claim of the recipe."""
    section = (ROOT / "CONTRIBUTING.md").read_text("utf-8").partition("### A claim")[2]
    (text,) = re.findall(r"```toml\n(.*?)```", section.partition("\n## ")[0], re.DOTALL)
    (tmp_path / "claims.toml").write_text(text, "utf-8")
    return read_claims("wang2010", tmp_path / "claims.toml")


@pytest.fixture
def plain_description():
    """Return the description of wang2010 without main table and figures."""
    whole = read_description("wang2010")
    main = whole.main_table.model_copy(update={"rows": ()})
    return whole.model_copy(update={"figure": {}, "main_table": main})


def test_claim_of_contributing_is_planned(claims, plain_description):
    (claim,) = claims.values()
    check_measure(claim.measure, "wang2010")
    (experiment,) = experiments(plain_description, requests(plain_description, claims, Effort()))
    assert (experiment.name, len(experiment.sequences)) == ("wang2010-hand", 12)
