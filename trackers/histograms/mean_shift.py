"""A target's histogram and size, and where mean shift finds it again."""

from math import ceil, floor, inf
from typing import Literal, NamedTuple

import numpy as np
from pydantic import Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.interface import Box, Image
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    choice,
    fraction,
    positive,
    whole,
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

MIN_SIDE = 3.0  # pixels; a smaller ellipse may lie between the pixels' centres
REACH = 1.7  # half axes around the start within which a target is mostly found


class MeanShiftParameters(Parameters):
    """Parameters of trackers by kernel-weighted mean shift."""

    colour: ColourSpace = choice("rgb", "colour space of the histograms")
    bins: int = whole(8, "bins a channel; V of hsv has half as many [count]", 2, 32)
    scale: Literal["adaptive", "fixed"] = choice(
        "adaptive",
        "adaptive: the size follows whichever of a smaller, the same and a larger "
        "ellipse is the most similar; fixed: it stays the first box's",
    )
    scale_step: float = Field(
        0.1, gt=0.0, lt=1.0, description="by how much these ellipses differ [fraction]"
    )
    scale_smoothing: float = fraction(0.1, "γ: share of the size found in the next one [fraction]")
    stop_distance: float = positive(
        0.1, "ε: a mean shift step shorter than this is the last one [pixels]"
    )
    max_iterations: int = whole(20, "most mean shift steps of an ellipse [count]")
    step_halving: bool = choice(
        True, "whether a step that lowers the coefficient is halved until it does not"
    )


class Location(NamedTuple):
    """Where a target was found: the ellipse that was the most similar."""

    x: float  # centre [pixels]
    y: float
    half_width: float  # [pixels]
    half_height: float
    coefficient: float  # Bhattacharyya's, in [0, 1]; 0 where no pixel has a colour of the target
    iterations: int  # steps that it took


class TargetEllipse:
    """What a target looks like and how large it is: the ellipse inscribed in its box.

    It is learnt from the first `frame` and the `box` there, and looked for as `settings` say;
    `name` is the tracker's, for messages. `half_width` and `half_height` are the ellipse's half
    axes as they are now [pixels]. Raises TrackerError where the box is smaller than 3 pixels either
    way, or its ellipse outside the image.
    """

    def __init__(
        self, name: str, settings: MeanShiftParameters, frame: SharedFrame, box: Box
    ) -> None:
        x, y, width, height = (float(value) for value in box)
        if not (width >= MIN_SIDE and height >= MIN_SIDE):
            raise TrackerError(
                f"{name}: the box {np.round(box, 1).tolist()} is narrower or lower than "
                f"{MIN_SIDE:.0f} pixels; give a larger box."
            )
        self.half_width, self.half_height = width / 2, height / 2
        self._settings = settings
        self._colours = JointBins(settings.colour, settings.bins)
        self._bins = np.arange(self._colours.n_bins)
        ellipse = x + self.half_width, y + self.half_height, self.half_width, self.half_height
        histogram = self._histograms(frame, np.array([ellipse]))
        if histogram.totals[0] == 0:
            raise TrackerError(
                f"{name}: of the box {np.round(box, 1).tolist()} nothing lies in the image; "
                "give another box."
            )
        self._bins = np.flatnonzero(histogram.counts[0])
        self._model = histogram.counts[0, self._bins] / histogram.totals[0]

    def locate(self, frame: SharedFrame, x: float, y: float) -> Location:
        """Look for the target from (x, y), in pixels; of equals the size as it is wins."""
        for reach in (REACH, inf):
            window = self._window(frame, x, y, reach)
            found = [self._shifted(window, x, y, factor) for factor in self._factors(frame)]
            if all(complete for _, complete in found):
                break
        return max((location for location, _ in found), key=lambda location: location.coefficient)

    def take_size(self, found: Location) -> None:
        """Follow the size of what was found: h = γ h_found + (1 - γ) h."""
        share = self._settings.scale_smoothing
        self.half_width += share * (found.half_width - self.half_width)
        self.half_height += share * (found.half_height - self.half_height)

    def coefficients_beside(self, frame: SharedFrame, found: Location) -> Array:
        """Coefficients half a target to the left, right, above and below; shape (4,)."""
        aside = np.array([[-1, 0], [1, 0], [0, -1], [0, 1]]) * found[2:4]
        ellipses = np.tile(np.array(found[:4]), (4, 1))
        ellipses[:, :2] += aside
        histograms = self._histograms(frame, ellipses)
        return bhattacharyya_coefficients(
            histograms.counts, histograms.totals, self._model[np.newaxis]
        )

    def map(self, image: Image) -> Array:
        """How frequent each pixel's colour is in the target, as a share of the most frequent."""
        frequent = np.zeros(self._colours.n_bins)
        frequent[self._bins] = self._model / self._model.max()
        return np.asarray(frequent[self._colours.codes(image)])

    def details(self, found: Location) -> dict[str, float]:
        """What a report says of what was found, and of the size as it is then."""
        return {
            "coefficient": found.coefficient,
            "iterations": float(found.iterations),
            "half_width": self.half_width,
            "half_height": self.half_height,
        }

    def box(self, x: float, y: float) -> Box:
        """Its box around (x, y), in pixels."""
        half_width, half_height = self.half_width, self.half_height
        return np.array([x - half_width, y - half_height, 2 * half_width, 2 * half_height])

    def _factors(self, frame: SharedFrame) -> list[float]:
        """Sizes to look for, relative to the present one, which comes first."""
        if self._settings.scale == "fixed":
            return [1.0]
        factors, step = [1.0], self._settings.scale_step
        width, height = 2 * self.half_width, 2 * self.half_height
        if min(width, height) * (1 - step) >= MIN_SIDE:
            factors.append(1 - step)
        if (
            width * (1 + step) <= frame.image.shape[1]
            and height * (1 + step) <= frame.image.shape[0]
        ):
            factors.append(1 + step)
        return factors

    def _shifted(
        self, window: CodeWindow, x: float, y: float, factor: float
    ) -> tuple[Location, bool]:
        settings = self._settings
        half_width, half_height = self.half_width * factor, self.half_height * factor
        found: MeanShiftResult = mean_shift(
            window,
            self._bins,
            self._model,
            self._colours.n_bins,
            (x, y, half_width, half_height),
            settings.stop_distance,
            settings.max_iterations,
            settings.step_halving,
        )
        location = Location(
            found.x, found.y, half_width, half_height, found.coefficient, found.iterations
        )
        return location, found.complete

    def _histograms(self, frame: SharedFrame, ellipses: Array) -> EllipseCounts:
        return count_ellipses(frame, ellipses, "epanechnikov", self._colours, self._bins)

    def _window(self, frame: SharedFrame, x: float, y: float, reach: float) -> CodeWindow:
        """Codes of so many half axes around (x, y), of the whole frame where that costs less."""
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
