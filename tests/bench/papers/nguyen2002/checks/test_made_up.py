"""What is done to frames of a scene: patches, light, and where the target is wholly seen."""

import numpy as np
import pytest

from bench.papers.nguyen2002.checks.made_up import Patch, clear_frames, dimmed, turned, wholly_seen

WIDTH, HEIGHT = 30, 24  # of the painted target


def test_a_patch_slides_over_the_share_that_is_asked_for(sequence):
    shown = sequence(2)
    patch = Patch(shown[0], shown.boxes[0])
    for share in (0.0, 0.1, 0.5, 1.0):
        image, mask = patch.slid_over(shown[1], shown.boxes[1], share)
        x, y = shown.boxes[1, :2].astype(int)
        inside = mask[y : y + HEIGHT, x : x + WIDTH]
        assert inside.mean() == pytest.approx(share)
        assert inside[:, : round(share * WIDTH)].all()
        assert (image[~mask] == shown[1][~mask]).all()
        if share:
            assert (image[mask] != shown[1][mask]).mean() > 0.5
    part = np.array([0.2, 0.25, 0.4, 0.5])
    _, mask = patch.stuck_on(shown[1], shown.boxes[1], part)
    assert np.argwhere(mask).min(axis=0).tolist() == [46, 37]
    assert mask.sum() == 12 * 12


def test_what_slides_moves_with_its_edge(sequence):
    shown = sequence(2)
    patch = Patch(shown[0], shown.boxes[0])
    x, y = shown.boxes[1, :2].astype(int)
    (half, _), (more, _) = (patch.slid_over(shown[1], shown.boxes[1], s) for s in (0.5, 0.6))
    assert (half[y, x + 5 : x + 15] == more[y, x + 8 : x + 18]).all()


def test_clear_frames_are_those_in_which_as_much_is_seen_as_ever(sequence):
    covered = [0.02] * 10 + [0.3] * 5 + [0.02] * 15
    off = np.arange(30) >= 22
    shown = sequence(30, covered=covered, attributes={"lamp off": off})
    assert np.flatnonzero(clear_frames(shown)).tolist() == [*range(10), *range(15, 30)]
    assert np.flatnonzero(clear_frames(shown, 3)).tolist() == [
        *range(3, 10),
        *range(18, 22),
        *range(25, 30),
    ]
    part = wholly_seen(shown, 5, 9)
    assert part.boxes[0].tolist() == shown.boxes[0].tolist()
    assert len(part) == 9
    assert len(wholly_seen(shown, 5, 50)) == 10
    assert wholly_seen(shown, 11, 20) is None


def test_light_and_orientation_are_changed_about_the_target(sequence):
    shown = sequence(2)
    assert dimmed(shown[0], 0.5).mean() == pytest.approx(shown[0].mean() / 2, abs=0.5)
    box = shown.boxes[0]
    half_turn = turned(shown[0], box, 180)
    here = half_turn[40 : 40 + HEIGHT, 30 : 30 + WIDTH].astype(int)
    there = shown[0][40 : 40 + HEIGHT, 30 : 30 + WIDTH][::-1, ::-1]
    assert np.abs(here - there).max() <= 1
