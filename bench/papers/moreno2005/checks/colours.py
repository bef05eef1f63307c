"""Colours of a target and of its background in a frame, drawn at random."""

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.interface import Image, Mask

__all__ = ["BACKGROUND_COMPONENTS", "OBJECT_COMPONENTS", "contrast", "drawn_colours"]

OBJECT_COMPONENTS, BACKGROUND_COMPONENTS = 2, 5  # of the mixtures, as the tracker has them
OBJECT_COLOURS, BACKGROUND_COLOURS = 500, 1500  # that are drawn, likewise

NEAR = 12  # pixels, of what is around a target

Array = NDArray[np.float64]


def drawn_colours(
    image: Image, mask: Mask, generator: np.random.Generator, share: float = 1.0
) -> tuple[Array, Array]:
    """Colours inside a mask and outside, at most so many as the tracker starts with.

    Parameters
    ----------
    image : ndarray of uint8, shape (rows, columns, 3)
    mask : ndarray of bool, shape (rows, columns)
        With pixels inside and outside.
    generator : Generator
        Chooses pixels, none of them twice.
    share : float
        Times so many.

    Returns
    -------
    tuple of ndarray of float64, shape (n, 3)
        RGB in [0, 1].
    """
    colours = image[..., ::-1] / 255.0
    sets = (mask, OBJECT_COLOURS), (~mask, BACKGROUND_COLOURS)
    inside, outside = (
        generator.permutation(colours[where])[: round(share * number)] for where, number in sets
    )
    return inside, outside


def contrast(image: Image, mask: Mask) -> float:
    """Distance of the mean colours of a target and of what is near it, in [0, √3]."""
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * NEAR + 1, 2 * NEAR + 1))
    around = cv2.dilate(mask.astype(np.uint8), disc).astype(bool) & ~mask
    means = [image[where].mean(axis=0) / 255.0 for where in (mask, around)]
    return float(np.linalg.norm(means[0] - means[1]))
