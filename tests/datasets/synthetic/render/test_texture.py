"""Textures: seamless, reproducible and rich in contrast."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.render import texture


@pytest.mark.parametrize("make", [texture.grass, texture.paving, texture.pebbles])
class TestGround:
    def test_repeats_without_a_seam(self, make):
        image = make(np.random.default_rng(3), 256)
        for axis in (0, 1):
            around = np.concatenate([image, np.take(image, [0], axis)], axis)
            steps = np.abs(np.diff(around, axis=axis)).mean(axis=(1 - axis, 2))
            assert steps[-1] <= steps[:-1].max()

    def test_has_contrast_and_stays_mostly_within_the_grey_levels(self, make):
        image = make(np.random.default_rng(3), 256)
        assert image.std(axis=(0, 1)).min() > 10
        assert ((image < 0) | (image > 255)).mean() < 0.01


def test_noise_is_periodic_and_as_smooth_as_its_cells():
    values = texture.noise(np.random.default_rng(0), 256, 8)
    assert np.abs(values - np.roll(values, 1, axis=0)).max() < 0.15
    assert 0.2 < values.std() < 1


def test_a_ramp_passes_its_colours():
    colours = np.array([[0.0, 10, 20], [100, 110, 120], [200, 190, 180]])
    np.testing.assert_allclose(
        texture.ramp(np.array([[-1.0, 0, 1, -2, 2]]), colours)[0], colours[[0, 1, 2, 0, 2]]
    )
