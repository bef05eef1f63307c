"""Frames as another camera, or other light, would give them."""

import numpy as np

from trackers.base.interface import Image

__all__ = ["with_contrast", "with_gain", "with_noise"]

MIDDLE = 128.0  # grey level about which contrast changes


def with_gain(image: Image, gain: float) -> Image:
    """Brighter or darker; what exceeds the camera's range is cut off."""
    return _as_bytes(image * np.float32(gain))


def with_contrast(image: Image, contrast: float) -> Image:
    """Less or more contrast about a middle grey."""
    middle = np.float32(MIDDLE)
    return _as_bytes(middle + (image - middle) * np.float32(contrast))


def with_noise(image: Image, deviation: float, generator: np.random.Generator) -> Image:
    """With Gaussian noise of a sensor, of this deviation in grey levels, in every channel."""
    noise = generator.standard_normal(image.shape, np.float32) * np.float32(deviation)
    return _as_bytes(image + noise)


def _as_bytes(values: "np.ndarray[tuple[int, ...], np.dtype[np.floating]]") -> Image:
    return np.clip(np.round(values), 0, 255).astype(np.uint8)
