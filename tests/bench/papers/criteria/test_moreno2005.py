"""Criteria of moreno2005's scenes, on painted images with known answers."""

import pytest

from tests.bench.papers.criteria.scenes import blocks, inside, painted
from trackmark.bench.papers.criteria import moreno2005 as criteria

RED, BLUE, GREEN = (30, 30, 220), (220, 30, 30), (30, 220, 30)


BOX = (30, 20, 20, 16)
SWAPPED = blocks([(BOX, RED, BLUE), (BOX, RED, BLUE), (BOX, BLUE, RED), (BOX, BLUE, RED)])


def test_model_auc_is_zero_if_target_and_ring_swap_colours():
    assert criteria.model_auc(SWAPPED, frame=1, age=1) == 1
    assert criteria.model_auc(SWAPPED, frame=2, age=1) == 0
    assert criteria.model_auc(SWAPPED, frame=2, age=0) == 1


def test_hard_share_counts_frames_not_separated_by_old_colours():
    assert criteria.hard_share(SWAPPED, limit=0.75, age=1) == pytest.approx(1 / 3)
    assert criteria.hard_share(SWAPPED, limit=0.75, age=2) == 1


def test_auc_percentile_uses_own_or_first_colours():
    assert criteria.auc_percentile(SWAPPED, percentile=10, step=1) == 1
    first = criteria.auc_percentile(SWAPPED, percentile=50, first_model=True, step=1)
    assert first == pytest.approx(0.5)


def test_channel_gain_ratio_ignores_an_even_gain():
    scene = blocks(
        [(BOX, (40, 80, 160), GREEN), (BOX, (20, 40, 80), GREEN), (BOX, (40, 40, 80), GREEN)]
    )
    assert criteria.channel_gain_ratio(scene, frame=1) == pytest.approx(1)
    assert criteria.channel_gain_ratio(scene, frame=2) == pytest.approx(2)


def test_speeds_are_displacements_of_the_centre():
    boxes = [(10, 10, 8, 8), (13, 14, 8, 8), (13, 15, 8, 8)]
    scene = blocks([(box, RED, BLUE) for box in boxes])
    assert criteria.speed_at(scene, frame=1) == 5
    assert criteria.speed_at(scene, frame=2) == 1
    assert criteria.speed_percentile(scene, percentile=100) == 5


def test_colour_step_is_the_length_of_the_mean_change():
    scene = blocks([(BOX, (0, 0, 0), RED), (BOX, (51, 0, 0), RED), (BOX, (51, 51, 0), RED)])
    assert criteria.colour_step(scene) == pytest.approx(0.2)


def test_affine_overlap_is_low_for_split_shapes_only():
    stretched = blocks([(BOX, RED, BLUE), ((10, 10, 40, 12), RED, BLUE)])
    assert criteria.affine_overlap(stretched, percentile=50, step=1) > 0.93

    whole = inside((60, 80), BOX)
    parted = whole.copy()
    parted[:, 36:44] = False
    split = painted([stretched.image(0)] * 2, [BOX] * 2, [parted, whole])
    assert criteria.affine_overlap(split, percentile=50, step=1) < 0.8
