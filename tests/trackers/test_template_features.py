"""What a template holds of a pixel."""

import numpy as np
import pytest

from tests.trackers import plain_nguyen2002 as plain
from trackers.templates.features import FLOORS, dimension, features_of

BLACK, BLUE, GREY, SKIN = (0, 0, 0), (200, 0, 0), (90, 90, 90), (60, 80, 160)


def of_pixel(pixel, kind):
    return features_of(np.array([[pixel]], np.uint8), kind)[0, 0]


def test_a_pixel_in_bgr_has_the_features_of_equation_18():
    assert of_pixel(SKIN, "invariants") == pytest.approx([160 / 80, 80 / 160, 60 / 160])
    assert of_pixel(SKIN, "arctan") == pytest.approx(np.arctan([160 / 80, 80 / 160, 60 / 160]))
    assert of_pixel(SKIN, "rgb").tolist() == [160, 80, 60]
    assert of_pixel(SKIN, "intensity").tolist() == [300]


@pytest.mark.parametrize(
    ("pixel", "expected"), [(BLACK, [0, 0, 0]), (BLUE, [0, 0, 200]), (GREY, [1, 1, 1])]
)
def test_a_largest_of_0_counts_as_one_grey_level(pixel, expected):
    assert of_pixel(pixel, "invariants").tolist() == expected
    assert of_pixel(pixel, "arctan") == pytest.approx(np.arctan(expected))


@pytest.mark.parametrize("kind", ["invariants", "arctan"])
def test_half_the_light_leaves_invariants_as_they_are(kind):
    image = 2 * np.random.default_rng(0).integers(1, 128, (9, 7, 3), dtype=np.uint8)
    np.testing.assert_allclose(
        features_of(image // 2, kind), features_of(image, kind), rtol=0, atol=1e-15
    )


@pytest.mark.parametrize("kind", FLOORS)
def test_an_image_has_the_features_of_the_plain_reference(kind):
    image = np.random.default_rng(1).integers(0, 256, (40, 50, 3), dtype=np.uint8)
    image[:8] //= 64  # many zeros
    found = features_of(image, kind)
    assert found.shape == (40, 50, dimension(kind))
    np.testing.assert_allclose(found, plain.features_of(image, kind), rtol=0, atol=1e-15)
