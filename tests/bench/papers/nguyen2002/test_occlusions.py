"""Outliers and matches about occlusions of a painted target."""

import numpy as np
import pytest

from bench.papers.nguyen2002 import occlusions
from bench.papers.nguyen2002.follower import FEATURES, Patch, pale
from datasets import Sequence
from tests.bench.papers.nguyen2002.painted import HEIGHT, WIDTH, frame, occluded, sequence


@pytest.fixture(scope="module")
def tables():
    return occlusions.watched(occluded(), quick=False)


def test_outliers_tell_what_is_hidden_and_every_frame_is_compared_once(tables):
    rows = tables["ng-15"]
    assert set(rows["features"]) == set(FEATURES)
    for _, one in rows.groupby("features"):
        assert one["frame"].tolist() == list(range(1, 60))
    assert (rows["hidden"] == (rows["visibility"] < 0.5)).all()
    assert rows["visibility"].between(0.1, 0.49).any()
    assert rows["exceeds"][rows["hidden"] == 1].mean() > 0.95
    assert rows["stays_below"][rows["visibility"] == 1].mean() > 0.9
    assert (rows["exceeds"] + rows["stays_below"] == 1).all()


def test_an_occlusion_ends_where_it_is_over_and_both_searches_are_timed(tables):
    ends = tables["ng-17"]
    counts = ends["candidates"].value_counts().to_dict()
    assert counts == {"skipped": 4, "all": 4, "all from 5 to L": 4}
    assert ends["beginning"].between(15, 19).all()
    assert (ends[["in_view", "found"]] == 1).all(axis=None)
    assert (ends["beginning"] + ends["offset"] >= 33).all()
    assert ends.loc[ends["candidates"] == "skipped", "offset"].isin([5, 7, 11, 19, 35]).all()
    assert (tables["ng-17-times"][["all_seconds", "skipped_seconds"]] > 0).all(axis=None)


def test_all_frames_are_those_from_the_first_after_an_occlusions_beginning(monkeypatch):
    monkeypatch.setattr(occlusions, "_best", lambda looks, offsets: min({*offsets} & {*looks}))
    ends = occlusions.watched(occluded(), quick=True)["ng-17"]
    first = ends.groupby("candidates")["offset"].unique().map(list)
    assert first.to_dict() == {"skipped": [5], "all": [1], "all from 5 to L": [5]}


def test_an_end_is_found_only_where_the_target_is_in_view():
    shown = occluded()
    half = shown.visibility.copy()
    half[33:] = 0.6  # as if something else hid a part of it from then on
    partly = Sequence("half", list(shown), shown.boxes, fingerprint="h", visibility=half)
    rows = occlusions.watched(partly, quick=False)["ng-17"]
    assert (rows["overlap"] > 0.5).all()
    assert (rows[["in_view", "found"]] == 0).all(axis=None)


def test_a_template_that_is_watched_follows_the_light():
    dimming = sequence(40, lamp=[1 - 0.01 * t for t in range(40)])
    rows = occlusions.watched(dimming, quick=False)["ng-15"]
    assert rows.loc[rows["features"] == "rgb", "stays_below"].mean() > 0.9


def test_a_target_that_was_lost_to_its_double_is_given_again():
    n, jump = 40, 15
    xs = [30 + t + 45 * (t >= jump) for t in range(n)]
    images = [frame(x, 40, seed=t) for t, x in enumerate(xs)]
    rows = slice(40, 40 + HEIGHT)
    for t in range(jump, jump + 6):
        images[t][rows, 30 + t : 30 + t + WIDTH] = images[t][rows, xs[t] : xs[t] + WIDTH]
    boxes = [[x, 40, WIDTH, HEIGHT] for x in xs]
    shown = Sequence("double", images, boxes, fingerprint="d", visibility=np.ones(n))
    rows = occlusions.watched(shown, quick=False)["ng-15"]
    assert rows.loc[rows["features"] == "rgb", "stays_below"].all()


def test_an_occluder_at_the_slowest_speed_is_declared_in_time():
    rows = occlusions.by_speed(sequence(2), quick=False)["ng-16"]
    assert len(rows) == len(FEATURES) * 3
    assert (rows["declared"] == 1).all()
    assert (rows["contaminated"] == 0).all()
    assert rows["coverage"].between(0.25, 0.35).all()


def test_with_reaches_an_occluder_at_five_per_cent_becomes_the_template():
    wide = np.array([30.0, 20.0, 60.0, 40.0])  # a twentieth is three whole pixels
    images = [pale(frame(40, 40))] * 30
    patch = Patch(np.full_like(images[0], occlusions.DARK_BLUE), wide)
    found = {
        rule: occlusions.slid_over(images, [wide] * 30, patch, "rgb", rule, 0.05, matched=False)
        for rule in occlusions.RULES
    }
    assert found["exceeds"] == {"declared": 1.0, "coverage": pytest.approx(0.3), "contaminated": 0}
    assert found["reaches"]["declared"] == 0
    assert found["reaches"]["contaminated"] > 0.7


def test_targets_as_they_are_are_covered_by_both_rules():
    rows = occlusions.by_speed_on_targets(sequence(30), quick=True)["ng-16-targets"]
    assert rows["rule"].value_counts().to_dict() == {"exceeds": 3, "reaches": 3}
    assert (rows["declared"] == 1).all()
