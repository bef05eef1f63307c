"""What short runs of the trackers show on painted targets."""

from math import isnan

import numpy as np
import pytest

from bench.papers.wang2010.short_runs import (
    displaced,
    drifted,
    on_against_off,
    outcome,
    particle_drift,
    particle_weights,
    seen_by_cameras,
    starts_beside,
    ways,
)

GREEN, GREY = (0, 160, 0), (128, 128, 128)


@pytest.fixture(scope="module")
def walking(paint):
    """A green square on grey whose left top corner is at these places."""

    def walking(xs, ground=None, name="painted"):
        masks = [paint.square(x) for x in xs]
        images = [paint.image((mask, GREEN)) for mask in masks]
        for image, mask, under in zip(images, masks, ground or [], strict=bool(ground)):
            image[~mask] = under[~mask]
        return paint.sequence(images, masks, name=name)

    return walking


def test_a_drift_is_told_by_distance_spread_and_similarity():
    arrays = {
        "predicted": np.array([[0.0, 0.0], [8.0, 0.0]]),
        "particles": np.array([[3.0, 4.0], [3.0, 4.0]]),
        "predicted_similarity": np.array([0.1, 0.5]),
        "similarity": np.array([0.4, 0.5]),
    }
    before, after = drifted(arrays, np.array([0.0, 0.0]))
    assert before["stage"] == "predicted"
    assert (before["distance"], before["spread"], before["similarity"]) == (4.0, 4.0, 0.3)
    assert isnan(before["risen"])
    told = {"stage": "drifted", "distance": 5.0, "spread": 0.0, "similarity": 0.45}
    assert after == told | {"risen": 0.5, "fallen": 0.0}


def test_particles_drift_to_a_target_that_nothing_looks_like(walking):
    rows = particle_drift(walking([40 + 2 * frame for frame in range(15)]), quick=True)["wa-11"]
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
    found = on_against_off(particles, np.array([0.5, 0.3, 0.1, 0.1]), box)
    assert found == {"on_target": 0.5, "on_over_off": pytest.approx(4.0)}
    for some in (particles[:2], particles[2:]):
        assert isnan(on_against_off(some, np.array([0.5, 0.5]), box)["on_over_off"])


def test_weights_as_written_differ_by_no_more_than_the_formula_can(walking):
    rows = particle_weights(walking([40 + 2 * frame for frame in range(15)]), quick=True)["wa-29"]
    written = rows[rows["preset"] == "as-written"]
    assert set(rows["tracker"]) == {"wang2010", "particle-filter"}
    assert written["weight_ratio"].between(1.0, np.exp(0.5)).all()
    assert written["on_over_off"].dropna().between(1.0, np.exp(0.5)).all()
    assert (written["effective_share"] > 0.95).all()
    recommended = rows[rows["preset"] == "recommended"]
    assert recommended["effective_share"].mean() < written["effective_share"].mean()


def test_a_start_is_moved_by_widths_as_far_as_the_image_reaches():
    found = list(ways(np.array([30.0, 50.0, 20.0, 30.0]), (120, 100, 3)))
    assert found[0] == (0, (0, 0))
    assert found[1:5] == [(1, (20, 0)), (1, (-20, 0)), (1, (0, 20)), (1, (0, -20))]
    assert found[5:] == [(2, (40, 0)), (2, (0, 40)), (2, (0, -40))]


def test_a_copy_of_the_target_stands_where_the_tracker_starts(paint):
    image, box = paint.image((paint.square(40), GREEN)), np.array([40.0, 50.0, 20.0, 20.0])
    view, beside = displaced(image, box, (60, -20))
    assert beside.tolist() == [100.0, 30.0, 20.0, 20.0]
    both = (paint.square(40), GREEN), (paint.square(100, 30), GREEN)
    assert (view == paint.image(*both)).all()
    assert (image == paint.image(both[0])).all()
    same, here = displaced(image, box, (0, 0))
    assert (same == image).all()
    assert (here == box).all()


@pytest.mark.parametrize(
    ("errors", "told"),
    [
        ([1.0, 2.0], (1.0, 1.0, 1.0)),
        ([9.0, 2.0, 8.0, 4.0], (1.0, 4.0, 1.0)),
        ([9.0, 1.0, 4.1], (0.0, np.nan, 1.0)),
        ([9.0, 9.0], (0.0, np.nan, 0.0)),
    ],
)
def test_a_target_is_found_from_where_the_error_stays_within_the_tolerance(errors, told):
    expected = dict(zip(("recovered", "recovered_from", "reached"), told, strict=True))
    assert outcome(np.array(errors), 4.0) == pytest.approx(expected, nan_ok=True)


def test_a_start_on_the_target_needs_no_recovery_and_camshift_finds_nothing_from_afar(walking):
    rows = starts_beside(walking([60 + frame for frame in range(25)]), quick=True)["wa-28"]
    assert set(rows["repetition"]) == {0}
    assert rows["widths"].value_counts().to_dict() == {0: 6, 1: 24, 2: 24, 3: 12}
    near = rows[rows["widths"] == 0]
    assert near["recovered"].sum() >= 4  # the flat filter without drift spreads from the start
    assert (near.loc[near["tracker"] != "particle-filter", "recovered_from"] == 1.0).all()
    far = rows[(rows["widths"] >= 2) & rows["tracker"].str.startswith("camshift")]
    assert (far[["recovered", "reached"]] == 0.0).all(axis=None)
    assert far["recovered_from"].isna().all()
    assert set(far["preset"]) == {"any"}


def test_filters_start_several_times_with_other_random_numbers_and_camshift_once(walking):
    rows = starts_beside(walking([60 + frame for frame in range(21)]), quick=False)["wa-28"]
    starts = rows.query("widths == 1").groupby(["tracker", "preset"])["repetition"].nunique()
    assert {n for key, n in starts.items() if "camshift" in key[0]} == {1}
    assert {n for key, n in starts.items() if "camshift" not in key[0]} == {5}
    ours = rows.query("widths == 1 and tracker == 'wang2010' and preset == 'as-written'")
    assert ours.groupby(["right", "down"])["recovered_from"].nunique().max() > 1


def test_everything_changes_under_a_camera_that_moves_and_the_target_alone_under_one_at_rest(
    walking,
):
    wide = np.random.default_rng(0).integers(0, 256, (120, 320, 3), np.uint8)
    xs = [40 + 2 * frame for frame in range(15)]
    still = walking(xs, [wide[:, :160]] * 15, "at-rest")
    panned = [wide[:, 6 * frame : 6 * frame + 160] for frame in range(15)]
    following = walking(xs, panned, "multipart/1")
    at_rest, moving = (seen_by_cameras(one, quick=True)["camera"] for one in (still, following))
    assert at_rest["camera"].unique().tolist() == ["at rest"]
    assert moving["camera"].unique().tolist() == ["moving"]
    assert at_rest["frame"].tolist() == list(range(1, 12))
    assert (at_rest["changing"] < 0.1).all()
    assert (moving["changing"] > 0.9).all()
    assert (at_rest["moving_inside"] > moving["moving_inside"]).all()
