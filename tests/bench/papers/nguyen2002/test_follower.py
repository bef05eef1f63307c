"""A template that is followed outside the tracker, and what is done to frames of a scene."""

import numpy as np
import pytest

import trackers
from bench.papers.nguyen2002.follower import (
    FEATURES,
    Follower,
    Patch,
    clear_frames,
    true_pose,
    turned,
    wholly_seen,
)
from tests.bench.papers.nguyen2002.painted import HEIGHT, WIDTH, frame, sequence
from trackers.templates.occlusion import visited


@pytest.mark.parametrize("features", FEATURES)
def test_a_follower_sees_what_the_tracker_sees(features):
    shown = sequence(25)
    tracker = trackers.create(
        "nguyen2002",
        np.random.SeedSequence(0),
        preset="as-written",
        features=features,
        report="raw",
    )
    tracker.init(shown[0], shown.boxes[0])
    follower = Follower(shown[0], shown.boxes[0], features, report="raw")
    for t in range(1, 25):
        said, view = tracker.update(shown[t]), follower.look(shown[t])
        follower.take(view)
        assert said.visible
        np.testing.assert_allclose(follower.box(view.pose), said.box)
        assert view.seen.share == said.details["outliers"]
        assert view.cost == pytest.approx(said.details["cost"])
        assert np.trace(follower.appearance.state) == said.details["state_noise"]


def test_a_follower_finds_a_target_again_where_the_tracker_does():
    n, begin, end = 40, 15, 25
    xs = [30 + 2 * min(t, begin) for t in range(n)]  # it stops while it is hidden
    images = [
        frame(x, 40, seed=t) if not begin < t < end else frame(x, 40, covered=1.0, seed=t)
        for t, x in enumerate(xs)
    ]
    tracker = trackers.create(
        "nguyen2002",
        np.random.SeedSequence(0),
        preset="as-written",
        features="rgb",
        report="raw",
        longest_occlusion=19,
    )
    box = np.array([xs[0], 40.0, WIDTH, HEIGHT])
    tracker.init(images[0], box)
    revised = {}
    for t, image in enumerate(images[1:], 1):
        said = tracker.update(image)
        revised |= {t: said.box, **(said.revised or {})}
    follower = Follower(images[0], box, "rgb", longest_occlusion=19, report="raw")
    for beginning in range(1, n):
        view = follower.look(images[beginning])
        if view.seen.share > 0.25:
            break
        follower.take(view)
    looks = {m: follower.look(images[beginning + m], m) for m in visited(19, "skipped")}
    offset = min(looks, key=lambda m: looks[m].cost)
    np.testing.assert_allclose(follower.box(looks[offset].pose), revised[beginning + offset])
    assert abs(revised[beginning + offset][0] - xs[-1]) < 1.5
    ended = beginning + offset
    follower.restart_after(images[ended], looks[offset].pose, offset + 1)
    view = follower.look(images[ended + 1])
    np.testing.assert_allclose(follower.box(view.pose), revised[ended + 1])
    speed = follower.look(images[ended], 1).pose.x - looks[offset].pose.x
    assert abs(speed) < 1  # at rest again


def test_a_template_that_begins_anew_goes_on_as_it_went_or_rests():
    shown = sequence(30)
    follower = Follower(shown[0], shown.boxes[0], "rgb", search_range=4)
    pose = true_pose(shown.boxes[0], shown.boxes[20])
    follower.restart_after(shown[20], pose, 2)  # 10 pixels to the right in a frame: too far
    assert follower.look(shown[21]).pose.x > pose.x + 4
    follower.restart(shown[20], shown.boxes[20])
    assert follower.look(shown[21]).pose.x == pytest.approx(pose.x + 1, abs=0.6)


def test_a_target_that_was_hidden_is_looked_for_where_it_should_be_by_now():
    shown = sequence(40)
    follower = Follower(shown[0], shown.boxes[0], "rgb", search_range=4)
    for t in range(1, 15):
        follower.take(follower.look(shown[t]))
    found = follower.box(follower.look(shown[34], hidden=19).pose)
    np.testing.assert_allclose(found, shown.boxes[34], atol=1.5)
    missed = follower.box(follower.look(shown[34]).pose)
    assert missed[0] < shown.boxes[34, 0] - 5  # too near to where it was


def test_a_template_is_compared_with_the_truth_where_the_target_truly_is():
    shown = sequence(10)
    follower = Follower(shown[0], shown.boxes[0], "rgb")
    np.testing.assert_array_equal(
        follower.truth(shown[9], shown.boxes[9]),
        shown[9][43 : 43 + HEIGHT, 39 : 39 + WIDTH, ::-1],
    )
    noise = follower.errors(shown[9], shown.boxes[9]).mean()
    follower.appearance.template += 10
    assert 0 < noise < follower.errors(shown[9], shown.boxes[9]).mean()
    assert follower.on_template(shown.mask(9), shown.boxes[9]).all()
    assert follower.on_template(shown.mask(9), shown.boxes[9] + [10, 0, 0, 0]).mean() == 20 / 30


def test_the_true_pose_has_the_scale_of_the_box():
    pose = true_pose(np.array([0.0, 0.0, 20.0, 10.0]), np.array([5.0, 5.0, 30.0, 15.0]))
    assert pose == (19.5, 12.0, 1.5)


def test_a_patch_slides_over_the_share_that_is_asked_for():
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


def test_what_slides_moves_with_its_edge():
    shown = sequence(2)
    patch = Patch(shown[0], shown.boxes[0])
    x, y = shown.boxes[1, :2].astype(int)
    (half, _), (more, _) = (patch.slid_over(shown[1], shown.boxes[1], s) for s in (0.5, 0.6))
    assert (half[y, x + 5 : x + 15] == more[y, x + 8 : x + 18]).all()


def test_clear_frames_are_those_in_which_as_much_is_seen_as_ever():
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


def test_a_target_is_turned_about_its_middle():
    shown = sequence(2)
    box = shown.boxes[0]
    half_turn = turned(shown[0], box, 180)
    here = half_turn[40 : 40 + HEIGHT, 30 : 30 + WIDTH].astype(int)
    there = shown[0][40 : 40 + HEIGHT, 30 : 30 + WIDTH][::-1, ::-1]
    assert np.abs(here - there).max() <= 1
