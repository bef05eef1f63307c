"""What short runs of the trackers show on painted targets, and how all tables are kept."""

from math import isnan

import numpy as np
import pytest

from bench.papers.scenes import short_runs
from bench.papers.wang2010.checks import camera, drift, recovery, weights
from datasets import Sequence, SequenceError

GREEN, GREY, SIDE = (0, 160, 0), (128, 128, 128), 20


def painted(x, y=50):
    image = np.full((120, 160, 3), GREY, np.uint8)
    image[y : y + SIDE, x : x + SIDE] = GREEN
    return image


def walking(xs, images=None, name="painted"):
    """A green square on grey whose left top corner is at these places."""
    boxes = np.array([[x, 50, SIDE, SIDE] for x in xs], float)
    return Sequence(name, images or [painted(x) for x in xs], boxes, fingerprint="p")


def test_a_drift_is_told_by_distance_spread_and_similarity():
    arrays = {
        "predicted": np.array([[0.0, 0.0], [8.0, 0.0]]),
        "particles": np.array([[3.0, 4.0], [3.0, 4.0]]),
        "predicted_similarity": np.array([0.1, 0.5]),
        "similarity": np.array([0.4, 0.5]),
    }
    before, after = drift.drifted(arrays, np.array([0.0, 0.0]))
    assert before["stage"] == "predicted"
    assert (before["distance"], before["spread"], before["similarity"]) == (4.0, 4.0, 0.3)
    assert isnan(before["risen"])
    assert after == {
        "stage": "drifted",
        "distance": 5.0,
        "spread": 0.0,
        "similarity": 0.45,
        "risen": 0.5,
        "fallen": 0.0,
    }


def test_particles_drift_to_a_target_that_nothing_looks_like():
    rows = drift.measure(walking([40 + 2 * frame for frame in range(15)]), quick=True)["wa-11"]
    assert set(rows["preset"]) == {"as-written", "recommended"}
    assert rows["frame"].unique().tolist() == list(range(1, 15))
    assert rows["inside"].all()
    means = rows.groupby("stage")[["distance", "spread", "similarity"]].mean()
    assert means.loc["drifted", "distance"] < means.loc["predicted", "distance"] - 0.5
    assert means.loc["drifted", "spread"] < means.loc["predicted", "spread"] - 0.5
    assert means.loc["drifted", "similarity"] > means.loc["predicted", "similarity"]
    after = rows[rows["stage"] == "drifted"]
    assert (after["risen"] + after["fallen"] <= 1).all()
    assert after["risen"].mean() > 0.5


def test_weights_on_the_target_are_compared_with_those_beside_it():
    particles = np.array([[10.0, 10.0], [19.9, 29.9], [20.0, 15.0], [0.0, 0.0]])
    box = np.array([10.0, 10.0, 10.0, 20.0])
    found = weights.on_against_off(particles, np.array([0.5, 0.3, 0.1, 0.1]), box)
    assert found == {"on_target": 0.5, "on_over_off": pytest.approx(4.0)}
    assert isnan(weights.on_against_off(particles[:2], np.array([0.5, 0.5]), box)["on_over_off"])
    assert isnan(weights.on_against_off(particles[2:], np.array([0.5, 0.5]), box)["on_over_off"])


def test_weights_as_written_differ_by_no_more_than_the_formula_can():
    rows = weights.measure(walking([40 + 2 * frame for frame in range(15)]), quick=True)["wa-29"]
    written = rows[rows["preset"] == "as-written"]
    assert set(rows["tracker"]) == {"wang2010", "particle-filter"}
    assert written["weight_ratio"].between(1.0, np.exp(0.5)).all()
    assert written["on_over_off"].dropna().between(1.0, np.exp(0.5)).all()
    assert (written["effective_share"] > 0.95).all()
    recommended = rows[rows["preset"] == "recommended"]
    assert recommended["effective_share"].mean() < written["effective_share"].mean()


def test_a_start_is_moved_by_widths_as_far_as_the_image_reaches():
    box = np.array([30.0, 50.0, 20.0, 30.0])
    found = list(recovery.ways(box, (120, 100, 3)))
    assert found[0] == (0, (0, 0))
    assert found[1:5] == [(1, (20, 0)), (1, (-20, 0)), (1, (0, 20)), (1, (0, -20))]
    assert found[5:] == [(2, (40, 0)), (2, (0, 40)), (2, (0, -40))]


def test_a_copy_of_the_target_stands_where_the_tracker_starts():
    image, box = painted(40), np.array([40.0, 50.0, 20.0, 20.0])
    view, beside = recovery.displaced(image, box, (60, -20))
    assert beside.tolist() == [100.0, 30.0, 20.0, 20.0]
    assert (view == np.where(painted(100, 30) == GREY, painted(40), painted(100, 30))).all()
    assert (image == painted(40)).all()
    same, here = recovery.displaced(image, box, (0, 0))
    assert (same == image).all()
    assert (here == box).all()


def test_a_target_is_found_from_where_the_error_stays_within_the_tolerance():
    kept = recovery.outcome(np.array([1.0, 2.0]), 4.0)
    assert kept == {"recovered": 1.0, "recovered_from": 1.0, "reached": 1.0}
    late = recovery.outcome(np.array([9.0, 2.0, 8.0, 4.0]), 4.0)
    assert late == {"recovered": 1.0, "recovered_from": 4.0, "reached": 1.0}
    passing = recovery.outcome(np.array([9.0, 1.0, 4.1]), 4.0)
    assert (passing["recovered"], passing["reached"]) == (0.0, 1.0)
    assert isnan(passing["recovered_from"])
    never = recovery.outcome(np.array([9.0, 9.0]), 4.0)
    assert (never["recovered"], never["reached"]) == (0.0, 0.0)


def test_a_start_on_the_target_needs_no_recovery_and_camshift_finds_nothing_from_afar():
    rows = recovery.measure(walking([60 + frame for frame in range(25)]), quick=True)["wa-28"]
    assert set(rows["repetition"]) == {0}
    assert rows["widths"].value_counts().to_dict() == {0: 6, 1: 24, 2: 24, 3: 12}
    near = rows[rows["widths"] == 0]
    assert near["recovered"].sum() >= 4  # the flat filter without drift spreads from the start
    assert (near.loc[near["tracker"] != "particle-filter", "recovered_from"] == 1.0).all()
    far = rows[(rows["widths"] >= 2) & rows["tracker"].str.startswith("camshift")]
    assert (far[["recovered", "reached"]] == 0.0).all(axis=None)
    assert far["recovered_from"].isna().all()
    assert set(far["preset"]) == {"any"}


def test_filters_start_several_times_with_other_random_numbers_and_camshift_once():
    short = walking([60 + frame for frame in range(21)])
    rows = recovery.measure(short, quick=False)["wa-28"].query("widths == 1")
    numbers = rows.groupby(["tracker", "preset"])["repetition"].unique()
    assert {len(found) for key, found in numbers.items() if "camshift" in key[0]} == {1}
    assert {tuple(found) for key, found in numbers.items() if "camshift" not in key[0]} == {
        (0, 1, 2, 3, 4)
    }
    ours = rows.query("tracker == 'wang2010' and preset == 'as-written'")
    assert ours.groupby(["right", "down"])["recovered_from"].nunique().max() > 1


def test_everything_changes_under_a_camera_that_moves_and_the_target_alone_under_one_at_rest():
    ground = np.random.default_rng(0).integers(0, 256, (120, 320, 3), np.uint8)

    def view(x, pan):
        image = ground[:, pan : pan + 160].copy()
        image[50:70, x : x + SIDE] = GREEN
        return image

    xs = [40 + 2 * frame for frame in range(15)]
    still = walking(xs, [view(x, 0) for x in xs], "at-rest")
    following = walking(xs, [view(x, 6 * frame) for frame, x in enumerate(xs)], "multipart/1")
    at_rest, moving = (camera.measure(shown, quick=True)["camera"] for shown in (still, following))
    assert at_rest["camera"].unique().tolist() == ["at rest"]
    assert moving["camera"].unique().tolist() == ["moving"]
    assert at_rest["frame"].tolist() == list(range(1, 12))
    assert (at_rest["changing"] < 0.1).all()
    assert (moving["changing"] > 0.9).all()
    assert (at_rest["moving_inside"] > moving["moving_inside"]).all()


def test_a_tracker_that_fails_is_named():
    outside = walking([-19.6, 40, 40], [painted(40)] * 3, "broken")
    with pytest.raises(SequenceError, match=r"broken: camshift failed: .*no pixel"):
        short_runs(outside, ["camshift"])
