"""What a template holds of a pixel."""

import numpy as np
import pytest

from tests.trackers import plain_nguyen2002 as plain
from trackers.templates.features import FLOORS, dimension, features_of

BLACK, BLUE, GREY, SKIN = (0, 0, 0), (200, 0, 0), (90, 90, 90), (60, 80, 160)


def of_pixel(pixel, kind):
    return features_of(np.array([[pixel]], np.uint8), kind)[0, 0]


@pytest.mark.parametrize(
    ("pixel", "expected"),
    [
        (SKIN, [160 / 80, 80 / 160, 60 / 160]),
        (BLACK, [0, 0, 0]),  # a largest of 0 counts as one grey level
        (BLUE, [0, 0, 200]),
        (GREY, [1, 1, 1]),
    ],
)
def test_a_pixel_in_bgr_has_the_features_of_equation_18(pixel, expected):
    assert of_pixel(pixel, "invariants") == pytest.approx(expected)
    assert of_pixel(pixel, "arctan") == pytest.approx(np.arctan(expected))
    assert of_pixel(pixel, "rgb").tolist() == [*pixel[::-1]]
    assert of_pixel(pixel, "intensity").tolist() == [sum(pixel)]


@pytest.mark.parametrize("kind", FLOORS)
def test_an_image_has_the_features_of_the_plain_reference(kind):
    image = np.random.default_rng(1).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    image[:8] //= 64  # many zeros
    found = features_of(image, kind)
    assert found.shape == (40, 50, dimension(kind))
    np.testing.assert_allclose(found, plain.features_of(image, kind), rtol=0, atol=1e-15)
