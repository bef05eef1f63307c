"""Options of papers' trackers: each is used by a reproduction, a preset or a test."""

import re
from pathlib import Path

import pytest

from trackmark import trackers
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.paper import read_paper

ROOT = Path(__file__).parents[3]
PAPERS = {
    tracker.registered_name: paper
    for paper in paper_names()
    for tracker in read_paper(paper).trackers.values()
}


def uses(name):
    """Return the texts in which parameters of a tracker may be set."""
    tables = (ROOT / "bench" / "papers" / PAPERS[name]).glob("*.toml")
    tests = [*(ROOT / "tests" / "trackers").glob("test_*.py")]
    tests += (ROOT / "tests" / "bench" / "papers").rglob("*.py")
    files = [*tables, *(file for file in tests if file != Path(__file__))]
    return "\n".join(file.read_text() for file in files)


def is_set(parameter, text):
    """Return whether a text sets a parameter: as a keyword, in a specification or in a dict."""
    return bool(re.search(rf'\b{parameter}=|["\']{parameter}["\']: ', text))


@pytest.mark.parametrize("name", sorted(PAPERS))
def test_options_are_used(name):
    plugin = trackers.resolve(name).plugin
    preset_values = {parameter for values in plugin.presets.values() for parameter in values}
    text = uses(name)
    unused = [
        parameter
        for parameter, origin in plugin.Parameters.origins().items()
        if origin == "option" and parameter not in preset_values
        if not is_set(parameter, text)
    ]
    assert not unused
