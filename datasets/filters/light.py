"""Filters of light and sensor, which keep the ground truth."""

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.filters.timing import generator, with_changes
from trackmark.datasets.interface import Image, Sequence


def gain(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Scale the light, geometrically from 1 in the init frame to `value` half-way to the end."""
    first = sequence.first_frame
    half = max(1.0, (len(sequence) - first) / 2)

    def image(frame: int) -> Image:
        progress = min(1.0, max(0.0, (frame - first) / half))
        return _as_image(sequence[frame] * np.float32(value**progress))

    return with_changes(sequence, image)


def blur(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Blur all images with the same Gaussian."""

    def image(frame: int) -> Image:
        pixels = sequence[frame]
        return np.asarray(cv2.GaussianBlur(pixels, (0, 0), value)) if value else pixels.copy()

    return with_changes(sequence, image)


def noise(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Add Gaussian noise that is independent in all pixels, channels and frames."""

    def image(frame: int) -> Image:
        pixels = sequence[frame]
        grain = generator(draw, 0, frame).standard_normal(pixels.shape, np.float32)
        return _as_image(pixels + np.float32(value) * grain)

    return with_changes(sequence, image)


def _as_image(image: NDArray[np.float32]) -> Image:
    """Round grey levels and limit them to 0 to 255."""
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
