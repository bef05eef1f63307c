"""Target model of mean shift trackers: histogram, size, and localisation in a frame."""

from math import ceil, floor, inf
from typing import Literal, NamedTuple

import numpy as np

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Image
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    bounded,
    choice,
    chosen,
    fraction,
    integer,
    positive,
)
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.histograms.bins import ColourSpace, JointBins
from trackmark.trackers.histograms.counting import count_ellipses, frame_codes
from trackmark.trackers.histograms.ellipses import (
    CodeWindow,
    EllipseCounts,
    MeanShiftResult,
    bhattacharyya_coefficients,
    mean_shift,
)

MIN_SIDE = 3.0  # minimum side [pixels]; a smaller ellipse may contain no pixel centre
SEARCH_REACH = 1.7  # half size of the first search window [half axes]; mostly sufficient

RECALLED = "recalled from PAMI 2003, whose text was not at hand:"
"""Origin of values that were not compared with the text of the paper."""


class MeanShiftParameters(Parameters):
    """Parameters of mean shift trackers; the defaults are the values of the preset `as-written`."""

    colour: ColourSpace = choice(
        "rgb", "colour space of the histograms", origin=chosen(f"{RECALLED} RGB")
    )
    bins: int = integer(
        8,
        "number of bins per channel; V of hsv has half as many [count]",
        2,
        32,
        origin=chosen(
            "as in the particle filter of Nummiaro et al. 2003, whose baseline this is; 16 in the "
            "papers, as recalled"
        ),
    )
    scale: Literal["adaptive", "fixed"] = choice(
        "adaptive",
        "adaptive: size of the most similar of a smaller, an equal and a larger ellipse; fixed: "
        "size of the init box",
        origin=chosen(f"{RECALLED} adaptive scale"),
    )
    scale_step: float = bounded(
        0.1,
        "relative difference of these sizes [fraction]",
        gt=0.0,
        lt=1.0,
        origin=chosen(f"{RECALLED} Δh = 0.1 h"),
    )
    scale_smoothing: float = fraction(
        0.1,
        "γ: weight of the located size in the next size [fraction]",
        origin=chosen(f"{RECALLED} γ = 0.1"),
    )
    stop_distance: float = positive(
        1.0,
        "ε: mean shift stops after a step shorter than this [pixels]",
        origin=chosen(f"{RECALLED} y0 and y1 in the same pixel"),
    )
    max_iterations: int = integer(
        20,
        "maximum number of mean shift steps of an ellipse [count]",
        origin=chosen(f"{RECALLED} typically 20"),
    )
    step_halving: bool = choice(
        True,
        "whether steps that lower the coefficient are halved",
        origin=chosen(
            "recalled from CVPR 2000, whose text was not at hand: the algorithm halves them"
        ),
    )


CHOICES = {
    "minimum side [pixels]": (MIN_SIDE, "a smaller ellipse may contain no pixel centre"),
    "precision of kernel weights": (
        "1/65536",
        "sums of whole numbers do not depend on the order of pixels",
    ),
    "size if coefficients are equal": (
        "the current one",
        "a target of one colour fits ellipses of several sizes",
    ),
    "ellipse without a pixel in a colour of the model": (
        "not moved, not visible",
        "the weights of mean shift are all 0",
    ),
}
"""Constants of mean shift trackers that are no parameters, with reasons."""


class Location(NamedTuple):
    """Ellipse of highest similarity in a frame."""

    x: float  # centre [pixels]
    y: float
    half_width: float  # [pixels]
    half_height: float
    coefficient: float  # Bhattacharyya coefficient in [0, 1]; 0 if no pixel has a target colour
    iterations: int  # number of mean shift steps


class TargetEllipse:
    """Histogram and size of a target: the ellipse inscribed in its box.

    The attributes `half_width` and `half_height` are the current half axes [pixels].

    `name`: name of the tracker, for error messages.
    `parameters`: parameters of histogram and search.
    `frame`: first frame.
    `box` float64 (4,): init box [pixels].

    Raises TrackerError if a side of the box is below 3 pixels, or its ellipse is outside the image.
    """

    def __init__(
        self, name: str, parameters: MeanShiftParameters, frame: SharedFrame, box: Box
    ) -> None:
        x, y, width, height = (float(value) for value in box)
        if not (width >= MIN_SIDE and height >= MIN_SIDE):
            raise TrackerError(
                f"{name}: the box {np.round(box, 1).tolist()} has a side below {MIN_SIDE:.0f} "
                "pixels. Use a larger box."
            )
        self.half_width, self.half_height = width / 2, height / 2
        self._parameters = parameters
        self._colours = JointBins(parameters.colour, parameters.bins)
        self._bins = np.arange(self._colours.n_bins)
        ellipse = x + self.half_width, y + self.half_height, self.half_width, self.half_height
        histogram = self._histograms(frame, np.array([ellipse]))
        if histogram.totals[0] == 0:
            raise TrackerError(
                f"{name}: the ellipse in the box {np.round(box, 1).tolist()} is outside the "
                "image. Use another box."
            )
        self._bins = np.flatnonzero(histogram.counts[0])
        self._model = histogram.counts[0, self._bins] / histogram.totals[0]

    def locate(self, frame: SharedFrame, x: float, y: float) -> Location:
        """Search from (x, y) [pixels]; if coefficients are equal, the current size is kept."""
        for reach in (SEARCH_REACH, inf):
            window = self._window(frame, x, y, reach)
            locations = [self._shift(window, x, y, factor) for factor in self._factors(frame)]
            if all(complete for _, complete in locations):
                break
        return max(
            (location for location, _ in locations), key=lambda location: location.coefficient
        )

    def adapt_size(self, location: Location) -> None:
        """Set the half axes h to γ h_found + (1 - γ) h, where h_found are the located half axes."""
        share = self._parameters.scale_smoothing
        self.half_width += share * (location.half_width - self.half_width)
        self.half_height += share * (location.half_height - self.half_height)

    def neighbour_coefficients(self, frame: SharedFrame, location: Location) -> Array:
        """Return coefficients (4,) of ellipses one half axis to the left, right, top and bottom."""
        aside = np.array([[-1, 0], [1, 0], [0, -1], [0, 1]]) * location[2:4]
        ellipses = np.tile(np.array(location[:4]), (4, 1))
        ellipses[:, :2] += aside
        histograms = self._histograms(frame, ellipses)
        return bhattacharyya_coefficients(
            histograms.counts, histograms.totals, self._model[np.newaxis]
        )

    def map(self, image: Image) -> Array:
        """Return each pixel's bin frequency in the target, relative to the largest one."""
        frequent = np.zeros(self._colours.n_bins)
        frequent[self._bins] = self._model / self._model.max()
        return np.asarray(frequent[self._colours.codes(image)])

    def details(self, location: Location) -> dict[str, float]:
        """Return the details of an estimate, with the current size."""
        return {
            "coefficient": location.coefficient,
            "iterations": float(location.iterations),
            "half_width": self.half_width,
            "half_height": self.half_height,
        }

    def box(self, x: float, y: float) -> Box:
        """Return the target's box around (x, y) [pixels]."""
        half_width, half_height = self.half_width, self.half_height
        return np.array([x - half_width, y - half_height, 2 * half_width, 2 * half_height])

    def _factors(self, frame: SharedFrame) -> list[float]:
        """Return the scale factors to try; the first is 1."""
        if self._parameters.scale == "fixed":
            return [1.0]
        factors, step = [1.0], self._parameters.scale_step
        width, height = 2 * self.half_width, 2 * self.half_height
        if min(width, height) * (1 - step) >= MIN_SIDE:
            factors.append(1 - step)
        if (
            width * (1 + step) <= frame.image.shape[1]
            and height * (1 + step) <= frame.image.shape[0]
        ):
            factors.append(1 + step)
        return factors

    def _shift(
        self, window: CodeWindow, x: float, y: float, factor: float
    ) -> tuple[Location, bool]:
        parameters = self._parameters
        half_width, half_height = self.half_width * factor, self.half_height * factor
        result: MeanShiftResult = mean_shift(
            window,
            self._bins,
            self._model,
            self._colours.n_bins,
            (x, y, half_width, half_height),
            parameters.stop_distance,
            parameters.max_iterations,
            parameters.step_halving,
        )
        location = Location(
            result.x, result.y, half_width, half_height, result.coefficient, result.iterations
        )
        return location, result.is_complete

    def _histograms(self, frame: SharedFrame, ellipses: Array) -> EllipseCounts:
        return count_ellipses(frame, ellipses, "epanechnikov", self._colours, self._bins)

    def _window(self, frame: SharedFrame, x: float, y: float, reach: float) -> CodeWindow:
        """Return the codes within `reach` half axes of (x, y), or all codes if that is faster."""
        height, width = frame.image.shape[:2]
        reach_x, reach_y = reach * self.half_width, reach * self.half_height
        left, right = floor(max(x - reach_x, 0)), ceil(min(x + reach_x, width))
        top, bottom = floor(max(y - reach_y, 0)), ceil(min(y + reach_y, height))
        columns, rows = max(right - left, 0), max(bottom - top, 0)
        if frame.sharers * columns * rows >= width * height:
            codes = frame_codes(frame, self._colours, transposed=True)
            return CodeWindow(codes, 0, 0, width, height)
        near = frame.image[top : top + rows, left : left + columns]
        return CodeWindow(self._colours.codes(near, transposed=True), left, top, width, height)
