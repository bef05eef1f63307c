"""The target's colours, and where they are and move: the joint map (Wang & Tang 2010, 2.1)."""

from typing import Annotated, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from trackmark.trackers.base.arrays import Array
from trackmark.trackers.base.parameters import (
    Parameters,
    TrackerError,
    choice,
    fraction,
    nonnegative,
    whole,
)
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.maps.differences import (
    LARGEST_WINDOW,
    FrameMotion,
    first_frame,
    frame_after,
    moving_share,
)
from trackmark.trackers.maps.drift import (
    Binning,
    Drifted,
    Region,
    colour_bins,
    drift,
    holds,
    region_of,
    summed,
    weight_bits,
    window_at,
    window_moments,
)

Size: TypeAlias = tuple[int, int]


def _odd(value: int) -> int:
    if value % 2 == 0:
        raise ValueError("must be odd, so that the window has a middle")
    return value


class ModelParameters(Parameters):
    """Parameters of `ColourMotionModel`."""

    alpha: float = fraction(0.7, "α: weight of the hue map beside the saturation map [ratio]")
    beta: float = fraction(0.8, "β: weight of the motion map beside the colour map [ratio]")
    hue_bins: int = whole(32, "bins of the hue histogram [count]", most=256)
    saturation_bins: int = whole(32, "bins of the saturation histogram [count]", most=256)
    difference_window: Annotated[int, AfterValidator(_odd)] = Field(
        5,
        ge=1,
        le=LARGEST_WINDOW,
        description="n: side of the square that differences are summed over, odd [pixels]",
    )
    differences: Literal["two", "one"] = choice(
        "two", "how many differences of frames in succession are averaged"
    )
    motion_threshold: Annotated[float, Field(ge=0.0)] | Literal["adaptive"] = choice(
        "adaptive",
        "a pixel moves where the window around it differs by more than this a pixel; "
        "adaptive: by more than the image's mean and λ deviations [grey levels]",
    )
    threshold_factor: float = nonnegative(
        2.0, "λ: deviations above the mean, of the adaptive threshold [ratio]"
    )
    minimum_saturation: float = fraction(0.0, "pixels of less saturation weigh nothing [fraction]")
    minimum_value: float = fraction(0.0, "pixels darker than this weigh nothing [fraction]")
    maximum_value: float = fraction(1.0, "pixels brighter than this weigh nothing [fraction]")


class ColourMotionModel:
    """Histograms of the target's hue and saturation, and the motion of the frames shown so far.

    All pixels of a window around a centre (2,) [pixels, continuous coordinates from 0], of whole
    width and height, are the template in the first `frame`; `owner` is the tracker's name, for
    messages. Raises TrackerError where none of them is in the image and passes the limits of
    saturation and value.
    """

    def __init__(
        self, owner: str, settings: ModelParameters, frame: SharedFrame, centre: Array, window: Size
    ) -> None:
        self._owner = owner
        self._settings = settings
        self._binning = Binning(
            settings.hue_bins,
            settings.saturation_bins,
            settings.minimum_saturation,
            settings.minimum_value,
            settings.maximum_value,
        )
        self._motion = frame.compute(first_frame)
        rows, columns = frame.image.shape[:2]
        self._bits = weight_bits(rows, columns)
        left, top, right, bottom = region_of(centre[np.newaxis], *window, rows, columns)
        counts = np.zeros(settings.hue_bins * settings.saturation_bins + 1, np.int64)
        bins = np.empty(right - left, np.int32)
        for row in range(top, bottom):
            colour_bins(frame.image, row, left, right, self._binning, bins)
            counts += np.bincount(bins, minlength=len(counts))
        joint = counts[:-1].reshape(settings.hue_bins, settings.saturation_bins)
        if not joint.any():
            raise TrackerError(
                f"{owner}: no pixel of the {window[0]}x{window[1]} window around "
                f"({centre[0]:.1f}, {centre[1]:.1f}) lies "
                "in the image and is within minimum_saturation, minimum_value and maximum_value; "
                "give another box or widen them."
            )
        hue, saturation = joint.sum(axis=1), joint.sum(axis=0)
        of_hue, of_saturation = hue / hue.max(), saturation / saturation.max()
        colour = settings.alpha * of_hue[:, np.newaxis] + (1 - settings.alpha) * of_saturation
        weights = np.stack([(1 - settings.beta) * colour, colour]).reshape(2, -1)
        scaled = np.rint(weights * 2.0**self._bits).astype(np.int64)
        self._weights = np.concatenate([scaled, np.zeros((2, 1), np.int64)], axis=1)

    def observe(self, frame: SharedFrame) -> "JointMap":
        """The joint map of the next frame; every frame after the first must be shown, in order.

        Raises TrackerError for a frame of another size than the first.
        """
        settings = self._settings
        if frame.image.shape[:2] != self._motion.grey.shape:
            rows, columns = self._motion.grey.shape
            raise TrackerError(
                f"{self._owner}: a frame of {frame.image.shape[1]}x{frame.image.shape[0]} pixels "
                f"after one of {columns}x{rows}; frames of a sequence are of one size."
            )
        self._motion = frame.compute(
            frame_after, self._motion, settings.difference_window, settings.differences == "two"
        )
        threshold = self._threshold(self._motion)
        return JointMap(frame, self._motion, threshold, self._weights, self._bits, self._binning)

    def _threshold(self, motion: FrameMotion) -> float:
        """What D¹ + D² must exceed where something moves: twice the T of step 4."""
        settings = self._settings
        if settings.motion_threshold == "adaptive":
            return motion.mean + settings.threshold_factor * motion.deviation
        return 2 * 3 * settings.difference_window**2 * settings.motion_threshold


class JointMap:
    """The joint map P of one frame, I_c where something moves and (1 - β) I_c elsewhere (eq. 5).

    It is summed up only where windows come to; `unit` is a weight of 1 in the sums that `drift`
    gives.
    """

    def __init__(
        self,
        frame: SharedFrame,
        motion: FrameMotion,
        threshold: float,
        weights: NDArray[np.int64],
        bits: int,
        binning: Binning,
    ) -> None:
        self._frame = frame
        self._motion = motion
        self._threshold = threshold
        self._weights = weights
        self.unit = 2.0**-bits
        self._binning = binning
        self._region = Region(0, 0, 0, 0)
        self._sums = np.zeros((1, 1, 3), np.int64)

    def drift(
        self, points: Array, window: Size, stop_distance: float, max_iterations: int
    ) -> Drifted:
        """Mean shift of windows of one size; see `trackers.maps.drift.drift`."""
        rows, columns = self._frame.image.shape[:2]
        reached = region_of(points, *window, rows, columns)
        margin_x, margin_y = window[0] // 4, window[1] // 4
        while True:
            self._cover(reached, margin_x, margin_y)
            moved, reached = drift(
                self._sums,
                self._region,
                rows,
                columns,
                points,
                *window,
                stop_distance,
                max_iterations,
            )
            if reached.right == 0:
                return moved
            margin_x, margin_y = 2 * margin_x + 1, 2 * margin_y + 1

    def details(self, centre: Array, window: Size) -> dict[str, float]:
        """What a report says of the frame's motion, and of the window around the estimate.

        `similarity` (M / M₀ of the window), `moving` and `moving_inside` (share of the pixels that
        move, of the image and of the window), `changing` (see `FrameMotion`).
        """
        rows, columns = self._frame.image.shape[:2]
        motion = self._motion
        change = motion.latest, motion.earlier, self._threshold
        pixels = window_at(float(centre[0]), float(centre[1]), *window, rows, columns)
        self._cover(pixels, 0, 0)
        total = window_moments(self._sums, self._region, pixels)[0]
        return {
            "similarity": total * self.unit / (window[0] * window[1]),
            "moving": moving_share(*change, 0, 0, columns, rows),
            "moving_inside": moving_share(*change, *pixels),
            "changing": motion.changing,
        }

    def whole(self) -> Array:
        """The map of the whole image, shape (height, width), in [0, 1]."""
        rows, columns = self._frame.image.shape[:2]
        sums = summed(
            self._frame.image,
            Region(0, 0, columns, rows),
            self._motion.latest,
            self._motion.earlier,
            self._threshold,
            self._weights,
            self._binning,
        )[..., 0]
        return np.diff(np.diff(sums, axis=0), axis=1) * self.unit

    def _cover(self, reached: Region, margin_x: int, margin_y: int) -> None:
        """Sum up a region that holds what was summed before and what was reached now."""
        before = self._region
        if before.right > 0:
            if holds(before, reached):
                return
            reached = Region(
                min(reached.left, before.left),
                min(reached.top, before.top),
                max(reached.right, before.right),
                max(reached.bottom, before.bottom),
            )
        rows, columns = self._frame.image.shape[:2]
        self._region = Region(
            max(reached.left - margin_x, 0),
            max(reached.top - margin_y, 0),
            min(reached.right + margin_x, columns),
            min(reached.bottom + margin_y, rows),
        )
        self._sums = summed(
            self._frame.image,
            self._region,
            self._motion.latest,
            self._motion.earlier,
            self._threshold,
            self._weights,
            self._binning,
        )
