"""Camera model: vignette, exposure and sensor noise."""

from statistics import NormalDist

import cv2
import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.datasets.interface import Image
from trackmark.datasets.synthetic.render.views import random_wander

GAIN_STEPS = 1024
"""Steps in a gain of 1."""

LEVEL_STEPS = 16
"""Steps of the noise table in one grey level."""

LENS = 0.5
"""Standard deviation of the lens's blur [pixels]."""


class Camera:
    """Image-independent properties of a camera.

    `size`: width and height of its images [pixels]. `noise`: standard deviation of the sensor noise
    [grey levels]. `fall`: share of light that is lost at the centre of the upper and lower border,
    and of the left and right.
    """

    def __init__(
        self, size: tuple[int, int], noise: float, fall: tuple[float, float] = (0.08, 0.10)
    ) -> None:
        self._rows, self._columns = _vignette(size[1], fall[0]), _vignette(size[0], fall[1])
        self._noise = noise_table(noise)

    def exposed(
        self, canvas: Image, seed: int, frame: int, gain: float | NDArray[np.float64] = 1.0
    ) -> Image:
        """Apply exposure, vignette and noise to an image in place and return it.

        The noise depends only on seed and frame; `gain` is that of all columns, or of each.
        """
        _develop(
            canvas,
            fixed_point(self._rows),
            fixed_point(self._columns * gain),
            self._noise,
            random_bytes(seed, frame, canvas.size),
        )
        return canvas


def develop_light(seen: NDArray[np.float32]) -> Image:
    """Convert linear light (BGR, 1 is white) behind a lens to grey levels: its square root."""
    blurred = np.asarray(cv2.GaussianBlur(seen, (0, 0), LENS))
    levels = 255 * np.sqrt(np.clip(blurred, 0, 1)) + np.float32(0.5)
    image: Image = levels.astype(np.uint8)
    return image


def slow_exposure(
    random: np.random.Generator,
    frames: int,
    periods: tuple[float, float] = (6.0, 20.0),
    depth: float = 0.03,
) -> NDArray[np.float64]:
    """Return the gain by frame of a camera with slow automatic exposure.

    Its standard deviation is `depth`; `periods` are the shortest and the longest period of its
    oscillation [seconds].
    """
    return np.asarray(1 + random_wander(random, frames, periods, depth))


def fixed_point(gains: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return gains in units of 1 / `GAIN_STEPS`, rounded."""
    return np.round(gains * GAIN_STEPS).astype(np.int32)


def _vignette(size: int, fall: float) -> NDArray[np.float64]:
    """Return the gain of each row or column: 1 in the middle, 1 - `fall` at both ends."""
    u = (np.arange(size) + 0.5) / size * 2 - 1
    return 1 - fall * u * u


def random_bytes(seed: int, frame: int, count: int, first: int = 0) -> NDArray[np.uint8]:
    """Return independent random bytes of a frame, from the `first` on.

    Philox is counter-based: seed and frame are its key, so no frame depends on another.
    """
    generator = np.random.Philox(key=np.array([seed, frame], np.uint64))
    blocks, skipped = divmod(first, 32)
    words = generator.advance(blocks).random_raw(-(-(skipped + count) // 8))
    return words.astype("<u8", copy=False).view(np.uint8)[skipped : skipped + count]


def noise_table(deviation: float) -> NDArray[np.int32]:
    """Return the Gaussian quantile of each byte in units of 1 / `LEVEL_STEPS`, shape (256,).

    `deviation` is the standard deviation of a random byte's entry [grey levels].
    """
    normal = NormalDist()
    quantiles = np.array([normal.inv_cdf((byte + 0.5) / 256) for byte in range(256)])
    unit = quantiles / float(np.sqrt(np.mean(quantiles * quantiles)))
    return np.round(unit * deviation * LEVEL_STEPS).astype(np.int32)


@njit(cache=True)
def _develop(
    canvas: NDArray[np.uint8],
    row_gain: NDArray[np.int32],
    column_gain: NDArray[np.int32],
    table: NDArray[np.int32],
    random: NDArray[np.uint8],
) -> None:
    """Apply light and sensor noise to a canvas in place.

    `row_gain` and `column_gain` are gains times 1024, whose product applies. `table` is the noise
    of each random byte in 1/16 grey level; `random` has one byte per value of the canvas.
    """
    # Unsigned 32-bit numbers, and a separate loop for the table, let the compiler vectorise the
    # other loop.
    values = canvas.shape[1] * 3
    gains, noise = np.repeat(column_gain, 3), np.empty(values, np.int32)
    for y in range(len(canvas)):
        out = canvas[y].ravel()
        dice = random[values * y : values * (y + 1)]
        for i in range(values):
            noise[i] = table[dice[i]]
        for i in range(values):
            gain = np.uint32(row_gain[y] * gains[i])
            value = np.int32(np.uint32(out[i] * gain) >> np.uint32(16)) + noise[i]
            out[i] = min(max(np.int32(value + 8) >> np.int32(4), 0), 255)
