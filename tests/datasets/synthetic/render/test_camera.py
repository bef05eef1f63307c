"""The camera: its vignette, exposure and noise."""

import numpy as np
import pytest

from trackmark.datasets.synthetic.render.camera import (
    Camera,
    develop_light,
    random_bytes,
    slow_exposure,
)

SIZE = 160, 120


def grey(level=128):
    return np.full((*SIZE[::-1], 3), level, np.uint8)


def test_camera_without_noise_and_fall_changes_nothing():
    assert (Camera(SIZE, noise=0.0, fall=(0.0, 0.0)).exposed(grey(), 1, 2) == 128).all()


def test_camera_vignette_reaches_the_requested_fall():
    image = Camera(SIZE, noise=0.0, fall=(0.2, 0.4)).exposed(grey(), 1, 2)[..., 0] / 128
    middle = image[60, 80], image[0, 80], image[-1, 80], image[60, 0], image[60, -1]
    assert middle == pytest.approx([1, 0.8, 0.8, 0.6, 0.6], abs=0.015)


@pytest.mark.parametrize("noise", [1.0, 4.0])
def test_camera_noise_differs_by_frame_and_seed(noise):
    camera = Camera(SIZE, noise, fall=(0.0, 0.0))
    images = [camera.exposed(grey(), *key).astype(float) for key in ((1, 2), (1, 3), (2, 2))]
    for image in images:
        assert image.std() == pytest.approx(np.hypot(noise, 1 / np.sqrt(12)), rel=0.05)
    correlations = np.corrcoef([image.ravel() for image in images])
    assert np.abs(correlations - np.eye(3)).max() < 0.02


def test_camera_gain_is_scalar_or_per_column():
    camera = Camera(SIZE, noise=0.0, fall=(0.0, 0.0))
    assert (camera.exposed(grey(), 1, 2, 0.5) == 64).all()
    each = camera.exposed(grey(), 1, 2, np.repeat([0.5, 1.5], 80))
    assert (each[:, :80] == 64).all()
    assert (each[:, 80:] == 192).all()


def test_a_grey_level_is_the_square_root_of_the_light():
    light = np.repeat(np.array([0.0, 0.09, 0.36, 4.0], np.float32), 40).reshape(1, 160, 1)
    image = develop_light(np.broadcast_to(light, (120, 160, 3)).astype(np.float32))[60]
    assert image[[20, 60, 100, 140], 1] == pytest.approx([0, 76.5, 153, 255], abs=0.6)


def test_exposure_wanders_slowly_around_one():
    gains = slow_exposure(np.random.default_rng(0), 5000)
    assert gains.mean() == pytest.approx(1, abs=0.01)
    assert gains.std() == pytest.approx(0.03, rel=0.2)
    assert np.abs(np.diff(gains)).max() < 0.005


@pytest.mark.parametrize("first", [0, 5, 32, 230_400, 230_411])
def test_later_random_bytes_need_no_earlier_ones(first):
    assert (random_bytes(7, 9, 6, first) == random_bytes(7, 9, first + 6)[first:]).all()
