"""What is measured on scenes without a filter: closed forms on painted targets."""

import numpy as np
import pandas as pd
import pytest

import trackers
from bench.papers.nummiaro2003 import models, scenes
from bench.papers.nummiaro2003.models import Model, clear_frames, clutter, ellipses_in, grid
from datasets import Sequence

BOX = np.array([140.0, 80.0, 40.0, 60.0])
ELLIPSE = np.array([160.0, 110.0, 20.0, 30.0])
RED, BLUE, GREY, GREEN = (40, 40, 200), (200, 60, 40), (128, 128, 128), (60, 160, 60)


def blank(colour=GREY):
    return np.full((220, 320, 3), colour, np.uint8)


def within(ellipse, scale=1.0):
    """Which pixels an ellipse holds."""
    rows, columns = np.mgrid[:220, :320] + 0.5
    across, down = (columns - ellipse[0]) / ellipse[2], (rows - ellipse[1]) / ellipse[3]
    return across**2 + down**2 <= scale**2


def ringed(inner=RED, outer=BLUE, ground=GREY, at=ELLIPSE):
    """A core of one colour in a rim of another: its proportions tell its scale."""
    image = blank(ground)
    image[within(at)] = outer
    image[within(at, 0.6)] = inner
    return image


def sequence(images, boxes=None, visibility=None):
    n = len(images)
    boxes = np.tile(BOX, (n, 1)) if boxes is None else boxes
    seen = np.ones(n) if visibility is None else visibility
    return Sequence("painted", images, boxes, fingerprint="p", visibility=seen)


def test_a_model_is_the_weighted_histogram_of_the_text():
    image = ringed()
    inside = within(ELLIPSE)
    rows, columns = np.mgrid[:220, :320] + 0.5
    weights = 1 - ((columns - 160) ** 2 + (rows - 110) ** 2) / (20**2 + 30**2)
    blue, green, red = (image[inside].astype(int) >> 5).T
    counts = np.bincount(red * 64 + green * 8 + blue, weights[inside], 512)
    assert Model(image, ELLIPSE).histogram == pytest.approx(counts / counts.sum(), abs=1e-4)
    # The same ellipse, turned by nothing.
    turned = scenes.turned_histogram(image, ELLIPSE, 0.0)
    assert turned == pytest.approx(counts / counts.sum(), abs=1e-9)


def test_coefficients_are_the_sum_of_roots_and_nothing_where_too_little_is_inside():
    model = Model(ringed(), ELLIPSE, kernel="uniform")
    outside, partly = (ELLIPSE * [0, 1, 1, 1] - [x, 0, 0, 0] for x in (15, 5))
    found = model.coefficients(ringed(RED, GREEN, BLUE), np.stack([ELLIPSE, outside, partly]))
    assert found[0] == pytest.approx(0.36, abs=0.01)  # the core's share of the area
    assert found[1] == 0.0
    assert found[2] == pytest.approx(0.8, abs=0.01)  # the rim's colour alone


@pytest.mark.parametrize(("rim", "least", "most"), [(BLUE, 1.0, 1.0), (RED, 0.0, 0.9)])
def test_the_proportions_of_two_colours_tell_the_scale_and_one_colour_does_not(rim, least, most):
    image = ringed(outer=rim)
    factors = np.arange(15, 101) / 50
    sizes = ELLIPSE * np.column_stack([np.ones((86, 2)), factors, factors])
    best = factors[Model(image, ELLIPSE).coefficients(image, sizes).argmax()]
    assert least <= best <= most


def test_clutter_is_what_a_score_calls_a_miss_within_three_widths_and_in_the_image():
    around = clutter(ELLIPSE, blank())
    offsets = np.abs(around[:, :2] - ELLIPSE[:2])
    assert offsets.max() == 3 * 40
    assert not (offsets <= ELLIPSE[2:]).all(axis=1).any()
    assert ((around[:, :2] >= 0) & (around[:, :2] <= [320, 220])).all()
    assert (around[:, 2:] == ELLIPSE[2:]).all()
    assert len(around) == 25 * 23 - 5 * 7  # of a grid of 10 pixels, less what hits


def test_a_grid_reaches_as_far_to_all_sides_and_holds_the_middle():
    assert ellipses_in(np.stack([BOX, BOX]))[1].tolist() == ELLIPSE.tolist()
    places = grid(ELLIPSE, (2.0, 3.5), 1.0)
    assert len(places) == 5 * 7
    assert np.ptp(places[:, 0]) == 4.0
    assert (places == ELLIPSE).all(axis=1).any()


def test_clear_frames_are_after_the_first_and_show_the_target():
    shown = sequence([blank()] * 20, visibility=[1.0] * 5 + [0.5] * 5 + [1.0] * 10)
    assert clear_frames(shown, 100) == [1, 2, 3, 4, *range(10, 20)]
    assert clear_frames(shown, 3) == [1, 12, 19]
    assert clear_frames(shown, 100, 0.5) == list(range(1, 20))


def test_a_target_on_ground_of_another_colour_is_above_the_threshold_and_all_ground_below():
    tables = scenes.background(sequence([ringed()] * 10), quick=False)
    assert tables["appearance"]["above_threshold"].tolist() == [1.0] * 9
    assert (tables["background"]["below_threshold"] == 1.0).all()


def test_ground_of_the_targets_colour_is_a_false_positive_in_frames_that_set_no_threshold():
    twin = ELLIPSE + [100, 0, 0, 0]
    image = ringed()
    image[within(twin)] = BLUE
    image[within(twin, 0.6)] = RED
    shown = sequence([ringed(), *[image] * 9])
    frames = scenes.background(shown, quick=False)["background"].set_index("frame")
    first, *others = frames["below_threshold"]
    assert first == 1.0
    assert all(0.7 < below < 0.99 for below in others)


def test_the_threshold_is_two_deviations_above_the_mean_of_an_empty_frame():
    half = blank()
    half[:, 160:] = BLUE
    boxes = np.array([[np.nan] * 4, BOX, BOX])
    shown = sequence([half, ringed(), ringed()], boxes, [0.0, 1.0, 1.0])
    model = Model(ringed(), ELLIPSE)
    frame, threshold = scenes.threshold(shown, model)
    assert frame == 0
    blue = float(np.sqrt(model.histogram.max()))  # ρ of one half of the frame; 0 of the other
    assert threshold == pytest.approx(blue / 2 + 2 * blue / 2, rel=0.15)
    waiting = trackers.create("nummiaro2003")
    waiting.watch(half)
    waiting.init(shown[1], BOX)
    details = waiting.update(shown[2]).details
    assert threshold == pytest.approx(details["appearance_threshold"], abs=1e-12)


def test_a_target_half_hidden_by_the_ground_has_the_root_of_what_is_seen():
    hidden = ringed(RED, RED)
    hidden[:, :160] = GREY
    images = [ringed(RED, RED), hidden, ringed(RED, RED)]
    tables = scenes.occlusion(sequence(images, visibility=[1.0, 0.5, 0.9]), quick=False)
    (half,) = tables["occlusion"].to_dict("records")
    assert half["frame"] == 1
    assert half["coefficient"] == pytest.approx(np.sqrt(0.5), abs=0.01)
    assert half["above_threshold"] == 1.0
    assert tables["occlusion_curve"]["frame"].tolist() == [1, 2]


def test_a_turned_ellipse_of_a_turned_image_looks_the_same_and_an_upright_one_does_not():
    tables = scenes.turned_and_scaled(sequence([ringed()] * 3), quick=True)
    whole, upright = tables["transformed"], tables["transformed_upright"]
    assert set(whole["transformation"]) == {"rotation", "scale"}
    shrunk = whole["amount"] < 1  # rims mix: a camera farther away sees that, too
    assert whole.loc[~shrunk, "coefficient"].min() > 0.98
    assert whole.loc[shrunk, "coefficient"].min() > 0.9
    by_region = upright.set_index(["region", "amount"])["coefficient"]
    assert by_region["upright ellipse in its extents", 45.0] < 0.95
    assert by_region["upright ellipse in its extents", 180.0] > 0.98
    assert by_region["greatest circle in it, upright anyway"].min() > 0.9


def test_a_round_target_without_direction_is_the_same_upright():
    round_one = np.array([160.0, 110.0, 25.0, 25.0])
    boxes = np.tile([135.0, 85.0, 50.0, 50.0], (3, 1))
    shown = sequence([ringed(at=round_one)] * 3, boxes)
    upright = scenes.turned_and_scaled(shown, quick=True)["transformed_upright"]
    assert upright["coefficient"].min() > 0.98


def test_the_image_turns_against_the_clock():
    image = blank()
    image[105:115, 175:180] = RED  # to the right of the centre: goes up
    assert (scenes.turned(image, ELLIPSE, 90)[90:95, 155:165] == RED).all()


def test_weights_that_fall_to_the_rim_do_better_where_the_rim_is_hidden():
    hidden = ringed()
    hidden[within(ELLIPSE) & ~within(ELLIPSE, 0.85)] = GREEN
    hidden[:, 230:250] = BLUE  # clutter of the rim's colour
    shown = sequence([ringed(), *[hidden] * 5], visibility=[1.0] + [0.72] * 5)
    found = scenes.kernels(shown, quick=False)["kernels"]
    margin = found.groupby("kernel")["margin"].mean()
    assert margin["epanechnikov"] > margin["isotropic"] > margin["uniform"]
    assert (found["centre_error"] < 0.15).all()


def test_the_centre_is_off_by_as_much_as_the_target_is():
    images = [ringed(), ringed(at=ELLIPSE + [10, 0, 0, 0])]
    found = scenes.kernels(sequence(images), quick=True)["kernels"]
    assert found["centre_error"].to_numpy() == pytest.approx(0.5, abs=0.01)


def test_hue_and_saturation_outlast_a_gain_that_moves_every_rgb_bin():
    shown = sequence([ringed((20, 20, 150), (20, 20, 150))] * 3)
    by_gain = scenes.gains(shown, quick=True)["lighting"].set_index(["colour", "gain"])
    assert by_gain.loc[("rgb", 0.5), "coefficient"] == pytest.approx(0.0)
    assert by_gain.loc[("hsv", 1.25), "coefficient"] == pytest.approx(1.0)


def test_fine_bins_suffer_from_noise_that_coarse_ones_do_not_see():
    image = ringed((48, 48, 208), (208, 48, 48), ground=(112, 112, 112))
    found, again = (
        scenes.bins_and_noise(sequence([image] * 3), quick=True)["noise"] for _ in range(2)
    )
    pd.testing.assert_frame_equal(found, again)
    by_bins = found.set_index(["bins", "noise"])["coefficient"]
    assert by_bins[32, 0] == pytest.approx(1.0)
    assert by_bins[4, 4] > 0.99
    assert by_bins[8, 16] > 0.95  # the model has seen the same noise
    assert by_bins[32, 16] < by_bins[8, 16] - 0.05


def test_a_histogram_tells_one_of_two_colours_from_both_and_a_mixture_does_not():
    random = np.random.default_rng(0)
    means = np.repeat([RED, BLUE], [600, 400], axis=0)
    target, later = (
        np.clip(means + random.normal(0, 3, means.shape), 0, 255).astype(np.uint8) for _ in "ab"
    )
    alone = later[:600]
    histogram, blended = models.Histogram(target), models.Mixture(target)
    expected = -(1 - np.sqrt(0.6)) / (2 * 0.1**2)
    assert histogram.score(later) == pytest.approx(0.0, abs=0.6)
    assert histogram.score(alone) == pytest.approx(expected, abs=0.6)
    assert blended.score(alone) > blended.score(later)


def test_a_mixture_of_gaussian_pixels_has_their_density():
    random = np.random.default_rng(1)
    pixels = np.clip(random.normal(128, 10, (4000, 3)), 0, 255).round().astype(np.uint8)
    variance = 10**2 + models.FLOOR
    expected = -1.5 * (np.log(2 * np.pi * variance) + 10**2 / variance)
    assert models.Mixture(pixels).score(pixels) == pytest.approx(expected, abs=0.02)


def test_the_separation_of_a_mixture_has_no_unit_and_that_of_a_histogram_is_greater():
    random = np.random.default_rng(2)
    image = np.clip(ringed() + random.normal(0, 3, (220, 320, 3)), 0, 255).astype(np.uint8)
    found = scenes.one_of_two_colours(sequence([image] * 4), quick=True)["mixture"]
    by_model = found.groupby("model")["separation"].mean()
    assert by_model["histogram"] > 0.1
    assert by_model["mixture"] < 0.05
    distractor = found.loc[found["model"] == "histogram", "distractor"].to_numpy()
    assert distractor == pytest.approx(-(1 - 0.8) / (2 * 0.1**2), abs=0.5)  # the rim: .64
