"""Outliers and matches about the complete occlusions of a painted target."""

import numpy as np

from bench.papers.nguyen2002.checks.follower import FEATURES
from bench.papers.nguyen2002.checks.watching import measure
from datasets import Sequence

WIDTH, HEIGHT = 30, 24  # of the painted target


def test_outliers_tell_what_is_hidden_and_an_occlusion_ends_where_it_is_over(occluded):
    shown = occluded()
    tables = measure(shown, quick=False)
    frames = tables["ng-15"]
    assert set(frames["features"]) == set(FEATURES)
    hidden = frames["hidden"] == 1
    assert (frames["visibility"][hidden] < 0.5).all()
    assert frames["exceeds"][hidden].mean() > 0.95
    assert frames["stays_below"][frames["visibility"] == 1].mean() > 0.9
    assert (frames["exceeds"] + frames["stays_below"] == 1).all()
    ends = tables["ng-17"]
    assert ends["candidates"].value_counts().to_dict() == {"skipped": 4, "all from 5 to L": 4}
    assert ends["beginning"].between(15, 19).all()
    assert (ends[["in_view", "found"]] == 1).all(axis=None)
    assert (ends["beginning"] + ends["offset"] >= 33).all()
    assert ends.loc[ends["candidates"] == "skipped", "offset"].isin([5, 7, 11, 19, 35]).all()
    times = tables["ng-17-times"]
    assert (times["all_seconds"] > 2 * times["skipped_seconds"]).all()


def test_every_frame_is_compared_once_and_hidden_where_half_of_the_target_is(occluded):
    frames = measure(occluded(), quick=False)["ng-15"]
    for _, rows in frames.groupby("features"):
        assert rows["frame"].tolist() == list(range(1, 60))
    assert (frames["hidden"] == (frames["visibility"] < 0.5)).all()
    assert frames["visibility"].between(0.1, 0.49).any()


def test_an_end_is_found_only_where_the_target_is_in_view(occluded):
    shown = occluded()
    half = np.where(shown.visibility == 1, 1.0, shown.visibility)
    half[33:] = 0.6  # as if something else hid a part of it from then on
    rows = measure(
        Sequence("half", list(shown), shown.boxes, fingerprint="h", visibility=half), quick=False
    )["ng-17"]
    assert (rows["overlap"] > 0.5).all()
    assert (rows[["in_view", "found"]] == 0).all(axis=None)


def test_a_template_that_is_watched_follows_the_light(sequence):
    n = 40
    rows = measure(sequence(n, lamp=[1 - 0.01 * t for t in range(n)]), quick=False)["ng-15"]
    rgb = rows[rows["features"] == "rgb"]
    assert rgb["stays_below"].mean() > 0.9


def test_a_target_that_was_lost_to_its_double_is_given_again(frame):
    n, jump = 40, 15
    xs = [30 + t + 45 * (t >= jump) for t in range(n)]
    images = [frame(x, 40, seed=t) for t, x in enumerate(xs)]
    for t in range(jump, jump + 6):
        images[t][40 : 40 + HEIGHT, 30 + t : 30 + t + WIDTH] = images[t][
            40 : 40 + HEIGHT, xs[t] : xs[t] + WIDTH
        ]
    boxes = [[x, 40, WIDTH, HEIGHT] for x in xs]
    shown = Sequence("double", images, boxes, fingerprint="d", visibility=np.ones(n))
    rows = measure(shown, quick=False)["ng-15"]
    assert rows.loc[rows["features"] == "rgb", "stays_below"].all()
