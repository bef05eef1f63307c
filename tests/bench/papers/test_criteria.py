"""Kinds of the criteria of all papers, and the claims that the selection of scenes favours."""

import re

import pytest

from trackmark.bench import papers
from trackmark.bench.experiments.experiment import ExperimentError
from trackmark.bench.papers import cases, paper_names
from trackmark.bench.papers.criteria import favoured, read_criteria

RESULT_WORDS = re.compile(r"\b(lost|loses?|tracked|successful(ly)?|fails?|recovered)\b", re.I)
"""Words about the result of a tracker."""

SOURCE = re.compile("“.+”|recorded")
"""Words of the paper, or recorded data."""

OUTCOME = """
[first_scene]
"s/video:others=exchanged" = 400

[[criterion]]
sequence = ["s/video", "s/video:others=exchanged"]
name = "own score"
kind = "outcome"
favours = ["AB-1", "AB-2"]
measure = "score"
target = ">= 0.5"
sentence = "Table 1: the method keeps the target"

[[criterion]]
sequence = "s/video"
name = "other score"
kind = "outcome"
favours = ["AB-3"]
measure = "other"
sentence = "Table 1"

[[criterion]]
sequence = "s/video"
name = "speed [px]"
kind = "situation"
measure = "median_speed"
target = ">= 1"
sentence = "“a moving target”"
"""


@pytest.fixture
def write(tmp_path, monkeypatch):
    """Return a function that writes the criteria of the paper `ab`, the only paper."""
    monkeypatch.setattr(papers, "FOLDER", tmp_path)
    (tmp_path / "ab").mkdir()
    (tmp_path / "ab" / "criteria.csv").write_text(
        "sequence,scene,name,value,passes\ns/video,200,own score,0.7,yes\n"
        "s/video:others=exchanged,400,own score,0.4,no\n"
        "s/video:others=exchanged,401,own score,0.6,yes\n"
    )

    def write(text):
        (tmp_path / "ab" / "criteria.toml").write_text(text, "utf-8")

    return write


@pytest.mark.parametrize("paper", paper_names())
def test_bounds_of_situation_and_difficulty_have_a_source(paper):
    criteria = [row for row in read_criteria(paper)[1] if row.kind != "outcome"]
    assert criteria
    for criterion in criteria:
        assert not RESULT_WORDS.search(criterion.sentence), criterion.sentence
        if criterion.target:
            assert SOURCE.search(criterion.sentence), criterion.sentence


def test_printed_outcome_favours_no_claim(write):
    write(OUTCOME)
    assert favoured("ab") == {"AB-1", "AB-2"}
    assert read_criteria("ab")[0] == {"s/video": 200, "s/video:others=exchanged": 400}


@pytest.mark.parametrize(
    ("member", "scene"),
    [
        ("s/video", "s/video:scene=200"),
        ("s/video:length=20", "s/video:length=20:scene=200"),
        ("s/video:others=exchanged", "s/video:others=exchanged:scene=401"),
    ],
)
def test_variant_with_own_criteria_has_its_own_scenes(write, member, scene):
    assert cases.PaperSequence("name", "ab", (member,)).scenes(1) == [(scene,)]
    cases.verdict_scenes.cache_clear()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('kind = "situation"\n', "", "criterion 3, kind: Field required"),
        ('"situation"', '"sight"', "criterion 3, kind: Input should be 'situation'"),
        ('favours = ["AB-3"]\n', "", "criterion 2: outcome 'other score' needs `favours`"),
        ('"situation"\n', '"situation"\nfavours = []\n', "situation 'speed [px]' has `favours`"),
    ],
)
def test_kind_and_favours_of_an_entry_are_checked(write, old, new, message):
    assert OUTCOME.count(old) == 1
    write(OUTCOME.replace(old, new))
    with pytest.raises(ExperimentError) as caught:
        read_criteria("ab")
    assert message in str(caught.value)
