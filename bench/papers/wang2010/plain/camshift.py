"""CamShift without particles: traditional (hue) and improved (colour and motion)."""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.papers.wang2010.plain.colour import hue_map, make_template
from bench.papers.wang2010.plain.observation import JointMaps
from bench.papers.wang2010.plain.windows import mean_shift, whole_size

__all__ = ["PlainCamShift", "PlainImprovedCamShift"]

SMALLEST_WINDOW = 3  # pixels a side


class _CamShift:
    """Mean shift of one window on a map, then Bradski's rule for its size if that is asked for."""

    def __init__(self, window: str, stop_distance: float, max_iterations: int) -> None:
        self._adaptive = window == "adaptive"
        self._stop_distance, self._max_iterations = stop_distance, max_iterations
        self.iterations = 0

    def _start(self, box: NDArray[np.float64]) -> None:
        x, y, width, height = box.tolist()
        self._x, self._y = x + width / 2, y + height / 2
        self._size: tuple[float, float] = width, height
        self._window = whole_size(width), whole_size(height)
        self._ratio = width / height

    def _shift(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        self._x, self._y, self.iterations, total = mean_shift(
            values, self._x, self._y, *self._window, self._stop_distance, self._max_iterations
        )
        if self._adaptive and total > 0:
            rows, columns = values.shape
            width = whole_size(2 * sqrt(total * self._ratio))
            height = whole_size(2 * sqrt(total / self._ratio))
            self._window = (
                min(max(width, SMALLEST_WINDOW), columns),
                min(max(height, SMALLEST_WINDOW), rows),
            )
            self._size = self._window
        size = np.array(self._size)
        return np.concatenate([(self._x, self._y) - size / 2, size])


class PlainCamShift(_CamShift):
    """Traditional CamShift, on the map of the hue.

    Parameters
    ----------
    seed : SeedSequence or int, optional
        As for the filters; nothing is drawn.
    window : {"fixed", "adaptive"}
        Whether its size follows Bradski's rule.

    Others as `JointMaps` and `mean_shift`.
    """

    def __init__(
        self,
        seed: np.random.SeedSequence | int | None = None,
        window: str = "fixed",
        hue_bins: int = 32,
        stop_distance: float = 2.0,
        max_iterations: int = 10,
        minimum_saturation: float = 0.0,
        minimum_value: float = 0.0,
        maximum_value: float = 1.0,
    ) -> None:
        super().__init__(window, stop_distance, max_iterations)
        self._histograms = hue_bins, 1, minimum_saturation, minimum_value, maximum_value

    def init(self, image: NDArray[np.uint8], box: NDArray[np.float64]) -> None:
        """Take the template from a box of the first frame."""
        self._start(box)
        self._template = make_template(image, box, *self._histograms)

    def update(self, image: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Box in the next frame."""
        return self._shift(hue_map(image, self._template))


class PlainImprovedCamShift(_CamShift):
    """Improved CamShift, on the joint map of colour and motion.

    Parameters
    ----------
    seed, window
        As `PlainCamShift`.
    **maps
        See `JointMaps`.

    Attributes
    ----------
    maps : JointMaps
        Of the last frame.
    """

    def __init__(
        self,
        seed: np.random.SeedSequence | int | None = None,
        window: str = "fixed",
        stop_distance: float = 2.0,
        max_iterations: int = 10,
        **maps: Any,
    ) -> None:
        super().__init__(window, stop_distance, max_iterations)
        self.maps = JointMaps(**maps)

    def init(self, image: NDArray[np.uint8], box: NDArray[np.float64]) -> None:
        """Take the template from a box of the first frame."""
        self._start(box)
        self.maps.init(image, box)

    def update(self, image: NDArray[np.uint8]) -> NDArray[np.float64]:
        """Box in the next frame."""
        self.maps.update(image)
        return self._shift(self.maps.joint)
