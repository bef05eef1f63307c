"""Filters of light and sensor: the truth stays as it is."""

import cv2
import numpy as np
from numpy.typing import NDArray

from trackmark.datasets.filters.timing import changed, generator
from trackmark.datasets.interface import Image, Sequence


def gain(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Fade by equal ratios from the first box on until half of the rest is over."""
    first = sequence.first_frame
    half = max(1.0, (len(sequence) - first) / 2)

    def image(frame: int) -> Image:
        progress = min(1.0, max(0.0, (frame - first) / half))
        return _levels(sequence[frame] * np.float32(value**progress))

    return changed(sequence, image)


def blur(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Blur all images alike."""

    def image(frame: int) -> Image:
        shown = sequence[frame]
        return np.asarray(cv2.GaussianBlur(shown, (0, 0), value)) if value else shown.copy()

    return changed(sequence, image)


def noise(sequence: Sequence, value: float, draw: int) -> Sequence:
    """Add noise that is independent from pixel, channel and frame to the next."""

    def image(frame: int) -> Image:
        shown = sequence[frame]
        grain = generator(draw, 0, frame).standard_normal(shown.shape, np.float32)
        return _levels(shown + np.float32(value) * grain)

    return changed(sequence, image)


def _levels(image: NDArray[np.float32]) -> Image:
    """Grey levels: rounded, and within what a pixel can hold."""
    return np.clip(np.rint(image), 0, 255).astype(np.uint8)
