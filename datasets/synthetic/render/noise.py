"""Noise of the sensor: white in space and time, a function of seed and frame alone."""

from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEVEL_STEPS", "noise_table", "random_bytes"]

LEVEL_STEPS = 16
"""Steps of the noise table in one grey level."""


def random_bytes(seed: int, frame: int, count: int) -> NDArray[np.uint8]:
    """Independent random bytes of a frame.

    Philox is counter-based: seed and frame are its key, so that no frame needs another's.
    """
    words = np.random.Philox(key=np.array([seed, frame], np.uint64)).random_raw(-(-count // 8))
    return words.astype("<u8", copy=False).view(np.uint8)[:count]


def noise_table(deviation: float) -> NDArray[np.int32]:
    """Gaussian quantile of each byte, in 1 / `LEVEL_STEPS` grey levels, shape (256,).

    Parameters
    ----------
    deviation : float
        Standard deviation of a random byte's entry [grey levels].
    """
    normal = NormalDist()
    quantiles = np.array([normal.inv_cdf((byte + 0.5) / 256) for byte in range(256)])
    unit = quantiles / float(np.sqrt(np.mean(quantiles * quantiles)))
    return np.round(unit * deviation * LEVEL_STEPS).astype(np.int32)
