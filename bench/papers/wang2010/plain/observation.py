"""The maps of one frame after the other: colour, motion and both."""

import numpy as np
from numpy.typing import NDArray

from bench.papers.wang2010.plain.colour import colour_map, make_template
from bench.papers.wang2010.plain.motion import joint_map, local_difference, moving

__all__ = ["JointMaps"]


class JointMaps:
    """The joint map of each frame, from the template and the frames before.

    Parameters
    ----------
    alpha : float
        Weight of the hue.
    beta : float
        Weight of the motion.
    hue_bins, saturation_bins : int
        Of the template's histograms.
    difference_window : int
        Side n of the window of local differences, odd [pixels].
    differences : {"two", "one"}
        Whether the difference before is averaged in.
    threshold_factor : float
        λ of the adaptive threshold.
    motion_threshold : "adaptive" or float
        A fixed threshold instead: mean absolute difference in the window [grey levels].
    minimum_saturation, minimum_value, maximum_value : float
        Pixels below either of the first or above the last count for nothing [fractions].

    Attributes
    ----------
    colour : ndarray of float64, shape (rows, columns)
        I_c of the last frame.
    difference : ndarray of float64, shape (rows, columns)
        Its D.
    moving : ndarray of bool, shape (rows, columns)
        Its B.
    joint : ndarray of float64, shape (rows, columns)
        Its P.
    """

    def __init__(
        self,
        alpha: float = 0.7,
        beta: float = 0.8,
        hue_bins: int = 32,
        saturation_bins: int = 32,
        difference_window: int = 5,
        differences: str = "two",
        threshold_factor: float = 2.0,
        motion_threshold: str | float = "adaptive",
        minimum_saturation: float = 0.0,
        minimum_value: float = 0.0,
        maximum_value: float = 1.0,
    ) -> None:
        self._alpha, self._beta = alpha, beta
        limits = minimum_saturation, minimum_value, maximum_value
        self._histograms = hue_bins, saturation_bins, *limits
        self._window, self._averaged = difference_window, differences == "two"
        self._factor, self._fixed = threshold_factor, motion_threshold
        self._before: NDArray[np.int64] | None = None

    def init(self, image: NDArray[np.uint8], box: NDArray[np.float64]) -> None:
        """Take the template from a box of the first frame."""
        self._template = make_template(image, box, *self._histograms)
        self._image, self._before = image, None

    def update(self, image: NDArray[np.uint8]) -> None:
        """See the next frame."""
        self.colour = colour_map(image, self._template, self._alpha)
        latest = local_difference(image, self._image, self._window)
        self.difference: NDArray[np.float64] = latest.astype(float)
        if self._averaged and self._before is not None:
            self.difference = (latest + self._before) / 2
        self._image, self._before = image, latest
        if self._fixed == "adaptive":
            self.moving = moving(self.difference, self._factor)
        else:
            self.moving = self.difference > float(self._fixed) * 3 * self._window**2
        self.joint = joint_map(self.colour, self.moving, self._beta)
