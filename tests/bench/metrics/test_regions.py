"""Region similarity and contour accuracy against closed forms, slow references and properties."""

from math import ceil, hypot

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import distance_transform_edt

from trackmark.bench.metrics.regions import (
    Segmentation,
    contour_accuracy,
    mean_recall_decay,
    region_similarity,
    segmentation_scores,
)

MASKS = st.tuples(st.integers(1, 14), st.integers(1, 14)).flatmap(
    lambda shape: st.tuples(arrays(bool, shape), arrays(bool, shape))
)


def rectangle(x, y, width, height, shape=(60, 80)):
    mask = np.zeros(shape, bool)
    mask[y : y + height, x : x + width] = True
    return mask


def disc(x, y, radius):
    rows, columns = np.indices((240, 320)) + 0.5
    return np.hypot(columns - x, rows - y) <= radius


EMPTY, SQUARE = rectangle(0, 0, 0, 0), rectangle(10, 10, 20, 20)


def slow_contour(mask):
    """Return the pixels whose right, lower or lower right neighbour differs."""
    contour = np.zeros_like(mask)
    for row, column in np.ndindex(mask.shape):
        neighbours = mask[row : row + 2, column : column + 2]
        contour[row, column] = (neighbours != mask[row, column]).any()
    return contour


def slow_accuracy(estimate, truth, tolerance):
    """Compute F from the distance of each contour pixel to the other contour."""
    reach = ceil(tolerance * hypot(*truth.shape))
    e, t = slow_contour(estimate), slow_contour(truth)
    if not e.any() or not t.any():
        return float(e.any() == t.any())
    precision = (distance_transform_edt(~t)[e] <= reach).mean()
    recall = (distance_transform_edt(~e)[t] <= reach).mean()
    return 0.0 if precision + recall == 0 else 2 / (1 / precision + 1 / recall)


@given(MASKS, st.floats(0, 0.3))
def test_measures_equal_slow_definitions(masks, tolerance):
    estimate, truth = masks
    shared, covered = (estimate & truth).sum(), (estimate | truth).sum()
    assert region_similarity(estimate, truth) == (shared / covered if covered else 1.0)
    accuracy = contour_accuracy(estimate, truth, tolerance)
    assert accuracy == pytest.approx(slow_accuracy(estimate, truth, tolerance), abs=1e-12)
    assert accuracy == contour_accuracy(truth, estimate, tolerance)
    assert contour_accuracy(truth, truth, tolerance) == region_similarity(truth, truth) == 1.0


def test_tolerance_is_rounded_up_to_whole_pixels():
    # 0.008 of the diagonal of 320x240 is 3.2 pixels, rounded up to 4.
    assert contour_accuracy(disc(164, 120, 40), disc(160, 120, 40)) == 1.0
    assert contour_accuracy(disc(165, 120, 40), disc(160, 120, 40)) < 1.0
    assert contour_accuracy(disc(160, 120, 43.5), disc(160, 120, 40)) == 1.0
    assert contour_accuracy(disc(160, 120, 46), disc(160, 120, 40)) == 0.0


@pytest.mark.parametrize("measure", [region_similarity, contour_accuracy])
def test_masks_of_different_shapes_are_refused(measure):
    with pytest.raises(
        ValueError, match=r"The estimated mask has shape \(3, 4\). Expected: \(4, 3\)"
    ):
        measure(np.ones((3, 4), bool), np.ones((4, 3), bool))


def test_mean_recall_and_decay_of_known_values():
    # Of nine frames quarters begin at the 1st, 3rd, 5th and 7th, and end where the next begins.
    values = np.array([0.9, 0.8, 0.7, 0.5, 0.5, 0.5, 0.4, 0.2, 0.0])
    assert mean_recall_decay(values) == pytest.approx((0.5, 3 / 9, 0.8 - 0.2))
    segmentation = Segmentation(np.r_[9, 9, values], np.r_[9, 9, values[::-1]])
    assert list(segmentation_scores(segmentation, 1).values()) == pytest.approx(
        [0.5, 3 / 9, 0.6, 0.5, 3 / 9, -0.6]
    )


@pytest.mark.parametrize(
    ("n", "first", "last"),
    [(1, 1, 1), (2, 1, 1), (3, 2, 1), (4, 2, 2), (6, 2, 2), (7, 3, 2), (8, 3, 3), (300, 76, 76)],
)
def test_quarters_equal_those_of_the_published_code(n, first, last):
    # They begin and end at round(1 + k (n - 1) / 4) for k = 0 to 4, halves upwards.
    values = np.arange(n) ** 2.0
    by_hand = values[:first].mean() - values[n - last :].mean()
    assert mean_recall_decay(values)[2] == pytest.approx(by_hand)


def test_frames_without_a_value_do_not_count():
    values = np.array([np.nan, 0.8, 0.2, np.nan, 0.2])
    assert mean_recall_decay(values) == pytest.approx((0.4, 1 / 3, 0.6))
    for missing in (np.full(5, np.nan), np.empty(0)):
        assert np.isnan(mean_recall_decay(missing)).all()
