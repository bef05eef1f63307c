"""Stored criteria of the papers' scenes, measured again on the first scene of each sequence."""

import pytest

from tests.datasets.synthetic.scenes import slow_if_unchanged
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.scene_check import (
    CLIPS,
    check_scene,
    passing_scenes,
    read_criteria,
    read_values,
)

SEQUENCES = [(paper, sequence) for paper in paper_names() for sequence in read_criteria(paper)[0]]


def parametrized(paper, sequence):
    """Mark unchanged scenes as slow."""
    scenes = "nguyen2002/clip-01" if sequence == CLIPS else sequence
    return pytest.param(paper, sequence, marks=slow_if_unchanged(scenes))


@pytest.mark.parametrize(
    ("paper", "sequence"), [parametrized(paper, sequence) for paper, sequence in SEQUENCES]
)
def test_scene_has_its_stored_criteria(paper, sequence):
    stored = read_values(paper)
    scene = next(passing_scenes(stored, sequence))
    criteria = [row for row in read_criteria(paper)[1] if row.sequence == sequence]
    measured = {row.name: row.value for row in check_scene(sequence, scene, criteria)}
    expected = [row for row in stored if (row.sequence, row.scene) == (sequence, scene)]
    assert measured == pytest.approx({row.name: row.value for row in expected}, rel=1e-3)
    assert all(row.passes for row in expected)
