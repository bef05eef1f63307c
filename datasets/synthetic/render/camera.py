"""Camera model: vignette, exposure and sensor noise."""

from statistics import NormalDist

import cv2
import numpy as np
from numba import njit
from numpy.random import Generator
from numpy.typing import NDArray

from trackmark.datasets.interface import Array, Image
from trackmark.datasets.synthetic.render.views import random_wander

GAIN_STEPS = 1024  # number of fixed-point steps in a gain of 1
LEVEL_STEPS = 16  # number of fixed-point steps of the noise table in one grey level
LENS = 0.5  # standard deviation of the blur of the lens [pixels]


class Camera:
    """Camera with vignette and sensor noise.

    `size` is the width and height of the images [pixels]. `noise` is the standard deviation of the
    sensor noise [grey levels]. `fall` is the fraction of light that the vignette removes at the
    centres of the horizontal and of the vertical image borders.
    """

    def __init__(
        self, size: tuple[int, int], noise: float, fall: tuple[float, float] = (0.08, 0.10)
    ) -> None:
        self._rows, self._columns = _vignette(size[1], fall[0]), _vignette(size[0], fall[1])
        self._noise = noise_table(noise)

    def exposed(self, canvas: Image, seed: int, frame: int, gain: float | Array = 1.0) -> Image:
        """Apply exposure, vignette and noise to an image in place and return the image.

        The noise depends only on seed and frame. `gain` is a scalar or has one value per column.
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
    """Convert linear light (BGR, 1 is white) to grey levels by lens blur and a square root."""
    blurred = np.asarray(cv2.GaussianBlur(seen, (0, 0), LENS))
    levels = 255 * np.sqrt(np.clip(blurred, 0, 1)) + np.float32(0.5)
    image: Image = levels.astype(np.uint8)
    return image


def slow_exposure(
    random: Generator, frames: int, periods: tuple[float, float] = (6.0, 20.0), depth: float = 0.03
) -> Array:
    """Return the gain in every frame of a camera with slow automatic exposure.

    The gain has the standard deviation `depth`. It oscillates with periods in the range `periods`
    [seconds].
    """
    return np.asarray(1 + random_wander(random, frames, periods, depth))


def fixed_point(gains: Array) -> NDArray[np.int32]:
    """Return gains as rounded integers in units of 1 / `GAIN_STEPS`."""
    return np.round(gains * GAIN_STEPS).astype(np.int32)


def _vignette(size: int, fall: float) -> Array:
    """Return the gain of each row or column: 1 in the middle, 1 - `fall` at both ends."""
    u = (np.arange(size) + 0.5) / size * 2 - 1
    return 1 - fall * u * u


def random_bytes(seed: int, frame: int, count: int, first: int = 0) -> NDArray[np.uint8]:
    """Return `count` random bytes of a frame, starting at the byte `first`.

    Philox is a counter-based generator whose key is seed and frame, so frames are independent.
    """
    generator = np.random.Philox(key=np.array([seed, frame], np.uint64))
    blocks, skipped = divmod(first, 32)
    words = generator.advance(blocks).random_raw(-(-(skipped + count) // 8))
    return words.astype("<u8", copy=False).view(np.uint8)[skipped : skipped + count]


def noise_table(deviation: float) -> NDArray[np.int32]:
    """Return a table that converts random bytes to Gaussian noise, shape (256,).

    The unit is 1 / `LEVEL_STEPS` grey level; `deviation` is the standard deviation [grey levels].
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
    """Apply gain and sensor noise to a canvas in place.

    The gain of a pixel is the product of `row_gain` and `column_gain`, which are gains times 1024.
    `table` is the noise of each random byte in 1/16 grey level. `random` has one byte per value of
    the canvas.
    """
    # With unsigned 32-bit numbers and a separate loop for the table, the compiler vectorises the
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
