"""Settings sections of the papers: every difference, with its reason, and the defaults."""

import re
from pathlib import Path

import pytest

from trackmark import trackers
from trackmark.bench.experiments.tracker_spec import split_text
from trackmark.bench.papers import SETTINGS, markdown_page, paper_names
from trackmark.bench.papers.paper import read_paper
from trackmark.bench.papers.sections import setting_section
from trackmark.bench.papers.settings import (
    NO_REASON,
    clip_command,
    default_sentences,
    setting_table,
)
from trackmark.datasets.spec_string import format_value

PAGES = Path(__file__).parents[3] / "docs" / "papers"


def values_of(spec):
    """Return the parameters of a created tracker by name, as texts."""
    name, options = split_text(spec)
    options.pop("init", None)
    parameters = trackers.create(name, **options).parameters
    return {key: format_value(getattr(parameters, key)) for key in type(parameters).model_fields}


@pytest.mark.parametrize("name", paper_names())
def test_table_has_exactly_the_values_that_differ(name):
    paper, rows_by_tracker = read_paper(name), {}
    for row in setting_table(paper).rows:
        parameter, _, names, *values, reason = (cell.text for cell in row)
        assert reason == paper.reasons.get(parameter, NO_REASON)
        for tracker in names.split("; "):
            rows_by_tracker.setdefault(tracker, set()).add((parameter, *values))
    assert rows_by_tracker.keys() <= paper.trackers.keys()
    for tracker in paper.trackers:
        written, recommended = (values_of(paper.spec(tracker, s)).items() for s in SETTINGS)
        table = rows_by_tracker.get(tracker, set())
        assert {(key, value) for key, value, _ in table} == written - recommended
        assert {(key, value) for key, _, value in table} == recommended - written


@pytest.mark.parametrize("name", paper_names())
def test_reasons_are_about_parameters_that_differ(name):
    paper = read_paper(name)
    assert {*paper.reasons} <= {row[0].text for row in setting_table(paper).rows}


@pytest.mark.parametrize("name", paper_names())
def test_sentences_name_the_trackers_without_their_defaults(name):
    paper, text, differing = read_paper(name), " ".join(default_sentences(read_paper(name))), {}
    for tracker in paper.trackers.values():
        default = values_of(tracker.registered_name).items()
        difference = default - values_of(tracker.spec("recommended")).items()
        nearest = differing.setdefault(tracker.registered_name, difference)
        differing[tracker.registered_name] = min(nearest, difference, key=len)
    for registered_name, difference in differing.items():
        assert (f"`{registered_name}`" in text) == bool(difference)
        assert all(f"`{key}={value}` (here " in text for key, value in difference)


def test_default_that_equals_as_written_is_named():
    assert default_sentences(read_paper("multipart")) == [
        "As `recommended`, `multipart` does not have the values of the default preset, which "
        "equals `as-written`: `binning=both` (here perez), `uv_range=full` (here srgb-gamut)."
    ]


@pytest.mark.parametrize("name", paper_names())
def test_page_has_the_settings_and_the_command_of_the_code(name):
    page, paper = (PAGES / f"{name}.md").read_text("utf-8"), read_paper(name)
    (section,) = re.findall(r"^## \d+ Settings\n\n(.*?)\n\n## ", page, re.DOTALL | re.MULTILINE)
    assert section == "\n\n".join(markdown_page.blocks(setting_section(paper), PAGES))
    assert f"\n    {clip_command(paper)}\n" in page


def test_recipe_has_the_command_of_a_page():
    command = clip_command(read_paper("wang2010")).replace("CLIP", "tennis.mp4")
    assert f"\n    {command}\n" in (PAGES / "clips.md").read_text("utf-8")


def test_trackers_on_a_clip_start_from_its_box():
    paper = read_paper("multipart")
    assert "init=full" in paper.spec("proposed", "recommended")
    assert "init" not in clip_command(paper)
