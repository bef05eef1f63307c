"""Placed and tilted layer, compared with geometry."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.wang2010.cup import FINE, SIZE, PlacedLayer


@pytest.fixture(scope="module")
def bar():
    """Return 12 x 6 pixels, anchored in the centre."""
    return PlacedLayer(np.full((6 * FINE, 12 * FINE), 255, np.uint8), (6, 3))


def centre(coverage):
    rows, columns = np.indices(coverage.shape) + 0.5
    return np.array([(columns * coverage).sum(), (rows * coverage).sum()]) / coverage.sum()


@pytest.mark.parametrize("tilt", [0.0, 0.06, -1.2])
@pytest.mark.parametrize("place", [(50.0, 40.0), (30.28125, 41.59375)])
def test_layer_anchor_is_at_the_requested_place(bar, place, tilt):
    coverage = bar.render_at(place, tilt)
    assert coverage.shape == SIZE[::-1]
    assert coverage.sum() == pytest.approx(72, rel=0.01)
    assert centre(coverage) == pytest.approx(place, abs=0.03)


def test_layer_tilts_to_the_right():
    """A point above the anchor moves to the right."""
    picture = np.zeros((20 * FINE, 20 * FINE), np.uint8)
    picture[2 * FINE : 4 * FINE, 9 * FINE : 11 * FINE] = 255
    x, y = centre(PlacedLayer(picture, (10, 10)).render_at((50, 40), 0.5))
    assert x == pytest.approx(50 + 7 * np.sin(0.5), abs=0.05)
    assert y == pytest.approx(40 - 7 * np.cos(0.5), abs=0.05)


def test_layer_extents_equal_the_rotated_rectangle():
    bar = PlacedLayer(np.full((6 * FINE, 12 * FINE), 255, np.uint8), (1, 2))
    tilts = np.array([0.0, 0.3])
    boxes = bar.extents(np.array([[50.0, 40.0]] * 2), tilts)
    cosine, sine = np.cos(0.3), np.sin(0.3)
    left, top = 50 - cosine - 4 * sine, 40 - sine - 2 * cosine
    turned = [left, top, 12 * cosine + 6 * sine, 12 * sine + 6 * cosine]
    assert boxes == pytest.approx(np.array([[49, 38, 12, 6], turned]))
    for box, tilt in zip(boxes, tilts, strict=True):
        rows, columns = np.nonzero(bar.render_at((50, 40), float(tilt)) > 0.02)
        assert columns.min() == pytest.approx(box[0], abs=1)
        assert rows.max() + 1 == pytest.approx(box[1] + box[3], abs=1)
