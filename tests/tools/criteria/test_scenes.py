"""Stored criteria of the papers' scenes, measured again on a scene of each sequence.

The stored values select the scenes on which claims are judged, so no criterion may change.
"""

import pytest

from tests.datasets.synthetic.scenes import slow_if_unchanged
from tools.scene_check import CLIPS, check_scene
from trackmark.bench.papers import paper_names
from trackmark.bench.papers.criteria import passing_scenes, read_criteria, read_values
from trackmark.datasets.spec_string import parse_text

EVERYDAY = (
    *("moreno2005/leaf", "multipart/8", "wang2010/hand"),
    *("nummiaro2003/person", "nummiaro2003/students", "wang2010/table-tennis"),
)
"""Cheap scenes whose criteria are measured every day, even if their source is unchanged."""


def parametrized(paper, sequence):
    """Mark unchanged scenes as slow, except for `EVERYDAY`."""
    scenes = "nguyen2002/clip-01" if sequence == CLIPS else parse_text(sequence)[0]
    marks = () if sequence in EVERYDAY else slow_if_unchanged(scenes)
    return pytest.param(paper, sequence, marks=marks, id=sequence)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("paper", "sequence"),
    [
        parametrized(paper, sequence)
        for paper in paper_names()
        for sequence in read_criteria(paper)[0]
    ],
)
def test_scene_has_its_stored_criteria(paper, sequence):
    stored = read_values(paper)
    scene = passing_scenes(stored, sequence)[0]
    criteria = [row for row in read_criteria(paper)[1] if row.sequence == sequence]
    measured = check_scene(sequence, scene, criteria).set_index("name")
    of_scene = stored[(stored["sequence"] == sequence) & (stored["scene"] == scene)]
    expected = of_scene.set_index("name")
    assert measured["value"].to_dict() == pytest.approx(expected["value"].to_dict(), rel=1e-3)
    assert expected["passes"].all()
