"""Features f of a pixel: intensity, colour, and colour invariants (equation 18)."""

import numpy as np
from numpy.typing import NDArray

__all__ = ["features_of"]

Array = NDArray[np.float64]


def features_of(image: NDArray[np.uint8], kind: str) -> Array:
    """Features (rows, columns, d) of a BGR image.

    `intensity` is R + G + B, `rgb` the three, `invariants` are c1, c2, c3 with a largest of 0
    counted as 1, `arctan` their arc tangents.
    """
    blue, green, red = np.moveaxis(image.astype(np.float64), 2, 0)
    if kind == "intensity":
        return np.asarray((red + green + blue)[:, :, np.newaxis])
    if kind == "rgb":
        return np.stack([red, green, blue], axis=2)
    ratios = np.stack(
        [_ratio(red, green, blue), _ratio(green, blue, red), _ratio(blue, red, green)], axis=2
    )
    return np.arctan(ratios) if kind == "arctan" else ratios


def _ratio(one: Array, other: Array, third: Array) -> Array:
    return one / np.maximum(np.maximum(other, third), 1.0)
