"""Region similarity and contour accuracy against closed forms, slow references and properties."""

from math import ceil, hypot, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_edt

from trackmark.bench.metrics.regions import contour_accuracy, mean_recall_decay, region_similarity

MASKS = st.tuples(st.integers(1, 14), st.integers(1, 14)).flatmap(
    lambda shape: st.tuples(arrays(bool, shape), arrays(bool, shape))
)
TOLERANCES = st.floats(0, 0.3)
VALUES = st.lists(st.floats(0, 1), min_size=1, max_size=60)


def rectangle(x, y, width, height, shape=(60, 80)):
    mask = np.zeros(shape, bool)
    mask[y : y + height, x : x + width] = True
    return mask


def disc(x, y, radius, shape=(240, 320)):
    rows, columns = np.indices(shape) + 0.5
    return np.hypot(columns - x, rows - y) <= radius


def contour_in_words(mask):
    """Pixels of which a neighbour to the right, below, or both, is another, one by one."""
    height, width = mask.shape
    contour = np.zeros_like(mask)
    for row, column in np.ndindex(mask.shape):
        neighbours = mask[row : min(row + 2, height), column : min(column + 2, width)]
        contour[row, column] = (neighbours != mask[row, column]).any()
    return contour


def accuracy_in_words(estimate, truth, tolerance):
    """F by the distance of every contour pixel to the nearest of the other contour."""
    reach = ceil(tolerance * hypot(*truth.shape))
    e, t = contour_in_words(estimate), contour_in_words(truth)
    if not e.any() or not t.any():
        return float(e.any() == t.any())
    precision = (distance_transform_edt(~t)[e] <= reach).mean()
    recall = (distance_transform_edt(~e)[t] <= reach).mean()
    return 0.0 if precision + recall == 0 else 2 / (1 / precision + 1 / recall)


@given(MASKS)
def test_region_similarity_counts_pixels(masks):
    estimate, truth = masks
    pairs = list(zip(estimate.ravel().tolist(), truth.ravel().tolist(), strict=True))
    shared, covered = sum(a and b for a, b in pairs), sum(a or b for a, b in pairs)
    assert region_similarity(estimate, truth) == (shared / covered if covered else 1.0)


@given(MASKS, TOLERANCES)
def test_contour_accuracy_is_what_distances_between_contours_give(masks, tolerance):
    expected = accuracy_in_words(*masks, tolerance)
    if 0 < expected < 1:
        assert contour_accuracy(*masks, tolerance) == pytest.approx(expected, abs=1e-12)
    else:
        assert contour_accuracy(*masks, tolerance) == expected


@given(MASKS, TOLERANCES)
def test_both_are_symmetric_between_zero_and_one_and_one_for_equal_masks(masks, tolerance):
    estimate, truth = masks
    for measure in (region_similarity, lambda a, b: contour_accuracy(a, b, tolerance)):
        value = measure(estimate, truth)
        assert 0.0 <= value <= 1.0
        assert value == measure(truth, estimate)
        assert measure(truth, truth) == 1.0


@given(MASKS)
def test_a_wider_tolerance_is_never_worse(masks):
    found = [contour_accuracy(*masks, tolerance) for tolerance in (0, 0.05, 0.1, 0.3, 1)]
    assert found == sorted(found)


@pytest.mark.parametrize("shift", [0, 1, 5, 20, 30])
def test_similarity_of_a_shifted_square(shift):
    shared = max(0, 20 - shift) * 20
    found = region_similarity(rectangle(10 + shift, 10, 20, 20), rectangle(10, 10, 20, 20))
    assert found == shared / (800 - shared)


def test_accuracy_of_a_square_that_is_shifted_beyond_the_tolerance():
    # The contour of 20x20 pixels is a ring of 21x21. Shifted by 5 to the right, at a tolerance of
    # 1 pixel (0.008 of the diagonal of 100), there are near the other ring: of the upper and the
    # lower side the 16 pixels that both have and the next one, and of the side that lies within
    # the other ring its ends but for the corners.
    truth, moved = rectangle(10, 10, 20, 20), rectangle(15, 10, 20, 20)
    assert contour_in_words(truth).sum() == 4 * 20
    assert contour_accuracy(moved, truth) == pytest.approx((2 * (16 + 1) + 2) / 80)


def test_a_shift_within_the_tolerance_costs_no_accuracy():
    # 0.008 of the diagonal of 320x240 is 3.2 pixels, rounded up to 4.
    assert contour_accuracy(disc(164, 120, 40), disc(160, 120, 40)) == 1.0
    assert contour_accuracy(disc(165, 120, 40), disc(160, 120, 40)) < 1.0


def test_concentric_discs_agree_up_to_the_tolerance_and_not_beyond():
    assert contour_accuracy(disc(160, 120, 43.5), disc(160, 120, 40)) == 1.0
    assert contour_accuracy(disc(160, 120, 46), disc(160, 120, 40)) == 0.0


def test_similarity_of_concentric_discs_is_the_ratio_of_their_areas():
    found = region_similarity(disc(160, 120, 30), disc(160, 120, 60))
    assert found == pytest.approx(1 / 4, abs=0.005)
    assert disc(160, 120, 60).sum() == pytest.approx(pi * 60**2, rel=0.005)


def test_what_an_empty_mask_scores():
    empty, square = rectangle(0, 0, 0, 0), rectangle(10, 10, 20, 20)
    for measure in (region_similarity, contour_accuracy):
        assert measure(empty, empty) == 1.0
        assert measure(empty, square) == measure(square, empty) == 0.0


def test_the_images_border_is_no_contour():
    everything, half = rectangle(0, 0, 80, 60), rectangle(0, 0, 40, 60)
    assert contour_accuracy(everything, rectangle(0, 0, 0, 0)) == 1.0
    assert contour_accuracy(everything, half) == 0.0
    assert contour_accuracy(half, rectangle(40, 0, 40, 60)) == 1.0  # the same line between them


def test_masks_may_lie_in_memory_as_they_like():
    truth, moved = rectangle(10, 10, 20, 20), rectangle(15, 12, 20, 20)
    expected = contour_accuracy(moved, truth)
    spread = np.zeros((120, 80), bool)
    spread[::2] = moved
    for estimate in (np.asfortranarray(moved), spread[::2], moved[::-1].copy()[::-1]):
        assert contour_accuracy(estimate, truth) == expected


@pytest.mark.parametrize("measure", [region_similarity, contour_accuracy])
def test_masks_of_different_shapes_are_refused(measure):
    with pytest.raises(ValueError, match=r"the mask has shape \(3, 4\), the truth \(4, 3\)"):
        measure(np.ones((3, 4), bool), np.ones((4, 3), bool))


def test_mean_recall_and_decay_of_a_known_course():
    # Of nine frames quarters begin at the 1st, 3rd, 5th and 7th, and end where the next begins.
    values = np.array([0.9, 0.8, 0.7, 0.5, 0.5, 0.5, 0.4, 0.2, 0.0])
    mean, recall, decay = mean_recall_decay(values)
    assert mean == pytest.approx(0.5)
    assert recall == pytest.approx(3 / 9)
    assert decay == pytest.approx(0.8 - 0.2)


@given(VALUES)
def test_a_steady_course_does_not_decay_and_a_reversed_one_decays_the_other_way(values):
    mean, recall, decay = mean_recall_decay(np.array(values))
    assert mean == pytest.approx(sum(values) / len(values))
    assert recall == sum(value > 0.5 for value in values) / len(values)
    steady = np.full(len(values), mean)
    assert mean_recall_decay(steady)[2] == pytest.approx(0)
    if len(values) % 4 == 1:  # else rounding need not make the quarters mirror each other
        assert mean_recall_decay(np.array(values[::-1]))[2] == pytest.approx(-decay)


@pytest.mark.parametrize(
    ("n", "first", "last"),
    [(1, 1, 1), (2, 1, 1), (3, 2, 1), (4, 2, 2), (6, 2, 2), (7, 3, 2), (8, 3, 3), (300, 76, 76)],
)
def test_quarters_have_as_many_frames_as_in_the_published_evaluation(n, first, last):
    # They begin and end at round(1 + k (n - 1) / 4) for k = 0 to 4, halves upwards.
    values = np.arange(n) ** 2.0
    by_hand = values[:first].mean() - values[n - last :].mean()
    assert mean_recall_decay(values)[2] == pytest.approx(by_hand)


def test_frames_without_a_value_do_not_count():
    unknown = np.nan
    mean, recall, decay = mean_recall_decay(np.array([unknown, 0.8, 0.2, unknown, 0.2]))
    assert (mean, recall) == (pytest.approx(0.4), pytest.approx(1 / 3))
    assert decay == pytest.approx(0.6)
    assert np.isnan(mean_recall_decay(np.full(5, unknown))).all()
    assert np.isnan(mean_recall_decay(np.empty(0))).all()


def test_borders_may_be_four_pixels_off_in_an_image_with_a_diagonal_of_500():
    def shifted(pixels):
        mask = np.zeros((300, 400), bool)
        mask[100:200, 150 + pixels : 250 + pixels] = True
        return mask

    # 0.008 of the diagonal, rounded up, is DAVIS's tolerance.
    assert contour_accuracy(shifted(4), shifted(0)) == 1
    assert contour_accuracy(shifted(5), shifted(0)) < 0.7
