"""Settings of the papers: the chain from the text to the defaults, and its development data."""

import re
from pathlib import Path

import pytest

from trackmark import trackers
from trackmark.bench.papers import SETTINGS, paper_names
from trackmark.bench.papers.development import (
    ALL,
    read_development,
    read_effects,
    read_sensitivity,
    variants,
)
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.sections import chain_section
from trackmark.bench.papers.settings import clip_command, differences, parameters
from trackmark.bench.papers.tables import chain_table
from trackmark.bench.statistics.rules import CLAIM_MARGIN
from trackmark.datasets.spec_string import format_value
from trackmark.reports.renderers import to_markdown

PAGES = Path(__file__).parents[3] / "docs" / "papers"
MAX_SENSITIVITY_ROWS = 7

TRACKERS = [(name, tracker) for name in paper_names() for tracker in read_paper(name).trackers]


def effects_on_all(paper):
    """Return the rows of `development.csv` on all scenes, and on all recordings."""
    effects = read_effects(paper)
    return effects[effects["sequence"] == ALL]


@pytest.mark.parametrize(("name", "tracker"), TRACKERS)
def test_chain_has_exactly_the_values_that_differ(name, tracker):
    paper = read_paper(name)
    entry = paper.trackers[tracker]
    chain = {
        (step.parameter, step.as_written, step.recommended)
        for step in paper.steps(entry.registered_name)
        if step.parameter not in entry.options
    }
    differing = differences(*(parameters(paper.spec(tracker, setting)) for setting in SETTINGS))
    assert chain == {
        (parameter, *map(format_value, values)) for parameter, values in differing.items()
    }


@pytest.mark.parametrize(("name", "tracker"), TRACKERS)
def test_recommended_is_the_preset_of_created_trackers(name, tracker):
    entry = read_paper(name).trackers[tracker]
    default = trackers.create(entry.registered_name).parameters
    recommended = parameters(entry.spec("recommended"))
    assert {*differences(default, recommended)} <= {*entry.options}


@pytest.mark.parametrize("name", paper_names())
def test_development_data_contain_every_variant(name):
    paper = read_paper(name)
    development = read_development(paper)
    effects = read_effects(name)
    for runs in development.runs:
        rows = effects[effects["tracker"] == runs.tracker.name]
        expected = {variant.name for variant in variants(paper, development, runs.tracker)}
        scenes = rows[rows["data"] == "scenes"]
        assert expected == {*scenes["variant"]}
        assert {*scenes["sequence"]} == {sequence.name for sequence in runs.sequences}
    recordings = effects[(effects["data"] == "recordings") & (effects["sequence"] == ALL)]
    assert {*recordings["n"]} == {development.n_recordings}


@pytest.mark.parametrize("name", paper_names())
def test_no_step_is_worse_on_development_data(name):
    effects = effects_on_all(name)
    steps = effects[effects["variant"].str.startswith("up to ")]
    assert "worse" not in {*steps["decision"]}


@pytest.mark.parametrize("name", paper_names())
def test_best_of_equally_founded_values_is_the_default(name):
    effects = effects_on_all(name)
    for candidate in read_development(read_paper(name)).candidates:
        rows = effects[effects["variant"] == candidate.name]
        for _, of_tracker in rows.groupby("tracker") if candidate.reason else ():
            is_worse = "worse" in {*of_tracker["decision"]}
            assert is_worse or of_tracker["difference"].mean() <= 0, candidate.name


@pytest.mark.parametrize("name", paper_names())
def test_sensitivity_has_only_choices_that_matter(name):
    paper = read_paper(name)
    read_effects(name)
    effects = effects_on_all(name)
    moving = effects[(effects["data"] == "scenes") & (effects["difference"].abs() > CLAIM_MARGIN)]
    rows = read_sensitivity(paper).rows
    assert len(rows) <= MAX_SENSITIVITY_ROWS
    assert {row.name for row in rows} <= {*moving["variant"]}


def test_chain_table_has_the_effect_of_each_step():
    rows = [[cell.text for cell in row] for row in chain_table(read_paper("wang2010")).rows]
    (written, step, *_) = (row for row in rows if row[0] == "particle-filter")
    assert written[1:3] == ["as written", ""]
    assert step[1:4] == ["sigma", "1", "0.158"]
    effects = effects_on_all("wang2010").set_index(["data", "tracker", "variant"])["value"]
    values = [effects["scenes", "particle-filter", name] for name in ("only sigma", "up to sigma")]
    values.append(effects["recordings", "particle-filter", "up to sigma"])
    assert step[5:] == [f"{value:.2f}" for value in values]


@pytest.mark.parametrize("name", paper_names())
def test_page_has_the_chain_and_the_command_of_the_code(name):
    page, paper = (PAGES / f"{name}.md").read_text("utf-8"), read_paper(name)
    (section,) = re.findall(
        r"^## From the text to the default\n\n(.*?)\n\n## ", page, re.DOTALL | re.MULTILINE
    )
    expected = chain_section(paper)
    tables = [to_markdown(table).rstrip("\n") for table in expected.tables]
    assert section == "\n\n".join([*expected.paragraphs, *tables])
    assert f"\n    {clip_command(paper)}\n" in page


def test_recipe_has_the_command_of_a_page():
    command = clip_command(read_paper("wang2010")).replace("CLIP", "tennis.mp4")
    assert f"\n    {command}\n" in (PAGES / "clips.md").read_text("utf-8")
