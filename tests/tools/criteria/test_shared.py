"""Shared criteria, and the check of scenes by a paper's `criteria.toml`."""

import numpy as np
import pandas as pd
import pytest

from tests.tools.criteria.scenes import blank, moving, painted
from tools import scene_check
from tools.criteria import shared as criteria
from trackmark.bench import papers
from trackmark.bench.papers.criteria import (
    Criterion,
    passing_scenes,
    read_criteria,
    read_values,
)


def test_speeds_are_displacements_of_box_centres():
    scene = moving([20, 20, 20, 26], [30, 30.5, 33.5, 41.5])
    assert criteria.speeds(scene) == pytest.approx([0.5, 3, 10])
    assert criteria.slow_share(scene, limit=1) == pytest.approx(1 / 3)
    assert criteria.median_speed(scene) == pytest.approx(3)
    assert criteria.relative_speed(scene, percentile=100) == pytest.approx(1)


def test_frames_without_target_do_not_count_as_motion():
    boxes = [[5, 5, 4, 4], [5, 7, 4, 4], [np.nan] * 4, [5, 30, 4, 4]]
    assert criteria.median_speed(blank(boxes)) == pytest.approx(2)


def test_area_ratio_is_of_the_largest_and_smallest_box():
    scene = blank([[5, 5, 10, 4], [5, 5, 10, 10], [5, 5, 5, 4]])
    assert criteria.area_ratio(scene) == pytest.approx(5)


def test_background_is_the_unmasked_share_of_the_first_box():
    mask = np.zeros((40, 40), bool)
    mask[10:20, 10:15] = True
    scene = blank([[10, 10, 10, 10]], masks=[mask])
    assert criteria.background_in_first_box(scene) == pytest.approx(0.5)


def test_ring_surrounds_the_target_within_the_enlarged_box():
    scene = moving([30])
    assert len(scene.target_colours(0)) == 100
    assert len(scene.ring_colours(0)) == 300
    assert len(scene.ring_colours(0, 3.0)) == 800


@pytest.mark.parametrize(("ground", "distance"), [(40, 1.0), (200, 0.0)])
def test_ring_distance_spans_zero_to_one(ground, distance):
    scene = moving([30], colour=(200, 200, 200), ground=ground)
    assert criteria.ring_distance(scene, 0) == pytest.approx(distance, abs=1e-6)


def test_bhattacharyya_of_half_overlapping_histograms():
    first, second = np.array([0.5, 0.5, 0.0]), np.array([0.0, 0.5, 0.5])
    assert criteria.bhattacharyya(first, second) == pytest.approx(np.sqrt(0.5))


def test_auc_counts_ties_as_one_half():
    scores = np.array([1.0, 2.0, 2.0, 3.0])
    assert criteria.auc(scores, np.array([False, False, True, True])) == pytest.approx(0.875)
    assert criteria.auc(np.zeros(4), np.array([True, False, True, False])) == pytest.approx(0.5)


def test_colour_auc_is_high_only_while_the_colours_last():
    before = moving([30])
    after = np.where(before.mask(0)[..., None], 40, np.uint8([20, 120, 240]))
    scene = painted([before.image(0), after.astype(np.uint8)], [before.boxes[0]] * 2)
    assert criteria.colour_auc(scene, 0, 0) == pytest.approx(1)
    assert criteria.colour_auc(scene, 1, 0) == pytest.approx(0)
    assert criteria.colour_auc(scene, 1, 1) == pytest.approx(1)


def test_longest_hidden_is_the_longest_stretch_in_frames():
    visible = np.array([0.1, 1, 0.2, 0.0, 0.2, 1, 0.1])
    scene = blank([[5, 5, 5, 5]] * 7, visibility=visible)
    assert criteria.longest_hidden(scene, visible=0.3) == 3
    assert criteria.longest_stretch(np.zeros(4, bool)) == 0


def criterion(**fields):
    about = {"sequence": "s", "name": "n", "measure": "median_speed", "sentence": "§"}
    return Criterion(**{"kind": "situation", **about, **fields})


@pytest.mark.parametrize(
    ("target", "passing"),
    [("", [1, 4, 9, 10]), (">= 4", [4, 9, 10]), ("<= 4", [1, 4]), (">= 4, <= 9", [4, 9])],
)
def test_criterion_passes_within_all_bounds(target, passing):
    row = criterion(target=target)
    assert [value for value in (1, 4, 9, 10) if row.passes(value)] == passing


def test_criterion_measures_with_its_options():
    scene = moving([20, 20.5, 23.5])
    assert scene_check.measure(criterion(sequence="wang2010/hand"), scene) == pytest.approx(1.75)
    slow = criterion(sequence="wang2010/hand", measure="slow_share:limit=1")
    assert scene_check.measure(slow, scene) == 0.5


VALUES = pd.DataFrame(
    [
        ("a", 200, "speed", 2.5, True),
        ("a", 200, "contrast", 49.0, False),
        ("a", 201, "speed", 3.0, True),
        ("a", 201, "contrast", 60.0, True),
        ("b", 200, "speed", 1.0, True),
    ],
    columns=["sequence", "scene", "name", "value", "passes"],
)


def test_passing_scenes_meet_all_criteria_of_their_sequence():
    assert passing_scenes(VALUES, "a") == [201]
    assert passing_scenes(VALUES, "b") == [200]


def test_files_of_a_paper_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(papers, "FOLDER", tmp_path)
    (tmp_path / "paper").mkdir()
    (tmp_path / "paper" / "criteria.toml").write_text(
        '[first_scene]\ns = 200\n[[criterion]]\nsequence = "s"\nname = "n"\n'
        'kind = "situation"\nmeasure = "slow_share:limit=1"\ntarget = "<= 0.1"\nsentence = "§"\n'
    )
    expected = criterion(measure="slow_share:limit=1", target="<= 0.1")
    assert read_criteria("paper") == ({"s": 200}, [expected])
    scene_check.write_values("paper", VALUES)
    pd.testing.assert_frame_equal(read_values("paper"), VALUES)


def test_summary_counts_scenes_and_prints_the_median():
    declared = [criterion(sequence="a", name="speed", target=">= 2")]
    first, *others = scene_check.summary(declared, VALUES).splitlines()
    assert "median 2.75 [2.5, 3] target >= 2: 2 of 2" in first
    assert others == ["a: 1 of 2 scenes meet all criteria", "b: 1 of 1 scenes meet all criteria"]
