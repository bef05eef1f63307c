"""Joint map of colour and motion, and mean shift on it (Wang & Tang 2010, section 2.1).

Weights are integers in units of 2^-bits. `weight_bits` chooses `bits` such that moments of the
image fit 64 bits (40 at 160 x 120, 34 at 640 x 480). Sums are exact, so boxes depend neither on the
order of summation nor on the size of the summed region.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from trackmark.trackers.base.arrays import Array, Ints
from trackmark.trackers.base.interface import Image
from trackmark.trackers.base.parameters import (
    TrackerError,
    bounded,
    choice,
    chosen,
    fraction,
    integer,
    nonnegative,
    printed,
)
from trackmark.trackers.base.sharing import SharedFrame
from trackmark.trackers.maps.colour_limits import ColourLimits
from trackmark.trackers.maps.differences import (
    MAX_WINDOW,
    FrameMotion,
    Sums,
    compare_frames,
    first_frame,
    moving_share,
)

Size: TypeAlias = tuple[int, int]
Bins: TypeAlias = NDArray[np.int32]

ROUNDING = 1e-9
"""Tolerance [pixels] for centroids on pixel edges, because weights are rounded.

Centroids on edges are common: weights take few values, so rows of pixels often balance.
"""


class Region(NamedTuple):
    """Rectangle of pixels; right and bottom are exclusive."""

    left: int
    top: int
    right: int
    bottom: int


class DriftResult(NamedTuple):
    """Windows after mean shift."""

    points: Array  # (n, 2): centres x, y [pixels]
    iterations: Ints  # (n,): number of steps
    before: Ints  # (n,): M₀₀ of the initial windows, in units of 2^-bits
    after: Ints  # (n,): M₀₀ of the final windows


class ColourBinning(NamedTuple):
    """Numbers of bins, and limits [fractions] outside which pixels have weight 0."""

    hues: int
    saturations: int
    minimum_saturation: float
    minimum_value: float
    maximum_value: float


def weight_bits(n_rows: int, n_columns: int) -> int:
    """Return the number of fraction bits, 1 to 40, for which no moment of an image overflows.

    Examples
    --------
    >>> weight_bits(115, 142), weight_bits(480, 640), weight_bits(2160, 3840)
    (40, 34, 27)
    """
    maximum = n_rows * n_columns * max(n_rows, n_columns)
    return min(40, 62 - maximum.bit_length())


@njit(cache=True)
def window_region(
    x: float, y: float, width: int, height: int, n_rows: int, n_columns: int
) -> Region:
    """Return the part in the image of a window around (x, y); empty if it is outside."""
    left = int(np.floor(x - width / 2 + 0.5 + ROUNDING))
    top = int(np.floor(y - height / 2 + 0.5 + ROUNDING))
    first_column, first_row = min(max(left, 0), n_columns), min(max(top, 0), n_rows)
    return Region(
        first_column,
        first_row,
        max(min(left + width, n_columns), first_column),
        max(min(top + height, n_rows), first_row),
    )


@njit(cache=True)
def enclosing_region(points: Array, width: int, height: int, n_rows: int, n_columns: int) -> Region:
    """Return the smallest region that contains the windows at all points (n, 2)."""
    left, top, right, bottom = n_columns, n_rows, 0, 0
    for x, y in points:
        window = window_region(x, y, width, height, n_rows, n_columns)
        left, top = min(left, window.left), min(top, window.top)
        right, bottom = max(right, window.right), max(bottom, window.bottom)
    return Region(left, top, right, bottom)


@njit(cache=True, error_model="numpy")
def colour_bins(
    image: Image, row: int, left: int, right: int, binning: ColourBinning, out: Bins
) -> None:
    """Write joint hue and saturation bins of a part of a row to `out`, shape (right - left,).

    Hue and saturation are defined as in MATLAB's `rgb2hsv`. The bin is hue · `saturations` +
    saturation, and `hues` · `saturations` for a pixel outside the limits. Quotients are computed in
    float32, for vector code. Half a unit is added to the numerator, so quotients are further from
    an integer than the rounding error, and rounding down is exact.
    """
    n_hues, n_saturations = np.float32(binning.hues), np.float32(binning.saturations)
    half, unit, six = np.float32(0.5), np.float32(1), np.float32(6)
    highest = np.float32(binning.saturations - 1)
    masked = np.int32(binning.hues * binning.saturations)
    least_saturation = np.float32(binning.minimum_saturation)
    least_value = np.float32(binning.minimum_value * 255)
    most_value = np.float32(binning.maximum_value * 255)
    length = right - left
    channels = np.empty((3, length), np.float32)
    pixels = image[row, left:right]
    for column in range(length):
        channels[0, column] = pixels[column, 0]
        channels[1, column] = pixels[column, 1]
        channels[2, column] = pixels[column, 2]
    for column in range(length):
        blue, green, red = channels[0, column], channels[1, column], channels[2, column]
        largest = max(max(blue, green), red)
        spread = largest - min(min(blue, green), red)
        from_red = green - blue + (six * spread if green < blue else np.float32(0))
        from_green = blue - red + np.float32(2) * spread
        from_blue = red - green + np.float32(4) * spread
        sixths = from_red if largest == red else (from_green if largest == green else from_blue)
        hue = np.int32((n_hues * sixths + half) / (six * max(spread, unit)))
        saturation = np.int32(min((n_saturations * spread + half) / max(largest, unit), highest))
        passes = (
            spread >= least_saturation * largest
            and largest >= least_value
            and largest <= most_value
        )
        out[column] = hue * np.int32(binning.saturations) + saturation if passes else masked


@njit(cache=True)
def integral_image(
    image: Image,
    region: Region,
    latest: Sums,
    earlier: Sums,
    threshold: float,
    weights: Ints,
    binning: ColourBinning,
) -> Ints:
    """Return the integral image of the joint map P (eq. 5) and of its first moments in a region.

    A pixel moves if `latest` + `earlier` exceeds the threshold. `weights` (2, hues · saturations +
    1) hold P by colour bin, for static and for moving pixels, in units of 2^-bits. The result (rows
    + 1, columns + 1, 3) holds sums of P, column · P and row · P above and left of each pixel.
    """
    left, top, right, bottom = region
    columns = right - left
    limit = np.int32(np.floor(threshold))  # equivalent, because the compared sums are integers
    sums = np.empty((bottom - top + 1, columns + 1, 3), np.int64)
    sums[0] = 0
    bins = np.empty(columns, np.int32)
    for row in range(top, bottom):
        colour_bins(image, row, left, right, binning, bins)
        total, total_x = np.int64(0), np.int64(0)
        above, current = sums[row - top], sums[row - top + 1]
        current[0] = 0
        first, second = latest[row, left:right], earlier[row, left:right]
        for column in range(columns):
            moves = np.int32(first[column]) + np.int32(second[column]) > limit
            weight = weights[1 if moves else 0, bins[column]]
            total += weight
            total_x += weight * (left + column)
            current[column + 1, 0] = above[column + 1, 0] + total
            current[column + 1, 1] = above[column + 1, 1] + total_x
            current[column + 1, 2] = above[column + 1, 2] + total * row
    return sums


@njit(cache=True)
def contains(region: Region, window: Region) -> bool:
    """Return whether a region contains a window."""
    return (
        window.left >= region.left
        and window.top >= region.top
        and window.right <= region.right
        and window.bottom <= region.bottom
    )


@njit(cache=True)
def moments_in_window(sums: Ints, region: Region, window: Region) -> tuple[int, int, int]:
    """Return M₀₀, M₁₀ and M₀₁ of a window (eq. 6) inside the region of the sums."""
    left, right = window.left - region.left, window.right - region.left
    upper, lower = sums[window.top - region.top], sums[window.bottom - region.top]
    return (
        lower[right, 0] - upper[right, 0] - lower[left, 0] + upper[left, 0],
        lower[right, 1] - upper[right, 1] - lower[left, 1] + upper[left, 1],
        lower[right, 2] - upper[right, 2] - lower[left, 2] + upper[left, 2],
    )


@njit(cache=True)
def drift(
    sums: Ints,
    region: Region,
    n_rows: int,
    n_columns: int,
    points: Array,
    width: int,
    height: int,
    stop_distance: float,
    max_iterations: int,
) -> tuple[DriftResult, Region]:
    """Move windows of equal size by mean shift (eqs. 6, 7), with the `sums` of a `region`.

    Each window moves from its point (n, 2) to the centroid of its weights, until a step is below
    `stop_distance` [pixels] or after `max_iterations`. A window without weight is not moved. If a
    window leaves the region, the second result is that window and the first is incomplete;
    otherwise the second is (0, 0, 0, 0).
    """
    n = len(points)
    moved = DriftResult(
        points.copy(), np.zeros(n, np.int64), np.zeros(n, np.int64), np.zeros(n, np.int64)
    )
    for i in range(n):
        x, y = points[i]
        step = np.inf
        iterations = 0
        while True:
            window = window_region(x, y, width, height, n_rows, n_columns)
            if not contains(region, window):
                return moved, window
            total, total_x, total_y = moments_in_window(sums, region, window)
            if iterations == 0:
                moved.before[i] = total
            if total == 0 or step < stop_distance or iterations == max_iterations:
                break
            new_x, new_y = total_x / total + 0.5, total_y / total + 0.5
            step = np.hypot(new_x - x, new_y - y)
            x, y = new_x, new_y
            iterations += 1
        moved.points[i, 0], moved.points[i, 1] = x, y
        moved.iterations[i] = iterations
        moved.after[i] = total
    return moved, Region(0, 0, 0, 0)


def _odd(value: int) -> int:
    if value % 2 == 0:
        raise ValueError("must be odd, so that the window has a middle")
    return value


class ColourMotionParameters(ColourLimits):
    """Parameters of `ColourMotionModel`; the defaults are the values of Wang & Tang 2010."""

    alpha: float = fraction(
        0.7,
        "α: weight of the hue; the weight of the saturation is 1 - α [ratio]",
        origin=printed("section 2.1.1: α = 0.7"),
    )
    beta: float = fraction(
        0.8,
        "β: weight of the motion; the weight of the colour is 1 - β [ratio]",
        origin=printed("section 2.1.3: β = 0.8"),
    )
    hue_bins: int = integer(
        32,
        "number of bins of the hue histogram [count]",
        maximum=256,
        origin=chosen("not printed; a bin then has 11 degrees of hue"),
    )
    saturation_bins: int = integer(
        32,
        "number of bins of the saturation histogram [count]",
        maximum=256,
        origin=chosen("not printed; equal to that of the hue"),
    )
    difference_window: Annotated[int, AfterValidator(_odd)] = bounded(
        5,
        "n: side of the square over which differences are summed, odd [pixels]",
        ge=1,
        le=MAX_WINDOW,
        origin=chosen("section 2.1.2: a local range around the pixel, without its size"),
    )
    differences: Literal["two", "one"] = choice(
        "two",
        "number of consecutive frame differences that are averaged",
        origin=printed("section 2.1.2, step 3: D = (D¹ + D²) / 2"),
    )
    motion_threshold: Annotated[float, Field(ge=0.0)] | Literal["adaptive"] = choice(
        "adaptive",
        "a pixel moves if the mean difference in the window around it exceeds this; adaptive: "
        "mean of the image plus λ standard deviations [grey levels]",
        origin=printed("section 2.1.2, step 4: T = m + λσ"),
    )
    threshold_factor: float = nonnegative(
        2.0,
        "λ: number of standard deviations in the adaptive threshold [ratio]",
        origin=printed("section 2.1.2, step 4: λ = 2"),
    )


CHOICES: Mapping[str, tuple[Any, str]] = {
    "weight of the largest bin of a histogram": (
        1.0,
        "section 2.1.2: maps are in [0, 1], without a rule; the rule of Bradski's CamShift",
    ),
    "differences of the second frame": ("D¹ alone", "D² needs three frames"),
    "grey value": ("R + G + B", "section 2.1.2 does not say which image is differenced"),
    "pixels outside the image": (0.0, "not stated; they have no colour"),
    "size of the window": (
        "that of the init box",
        "section 2.2 lists no size step, and eq. 8 has one radius",
    ),
}
"""Choices of all trackers that use `ColourMotionModel`."""


class ColourMotionModel:
    """Histograms of the target's hue and saturation, and the motion of the last frames.

    `owner`: name of the tracker, for error messages.
    `parameters`: parameters of the map.
    `frame`: first frame.
    `centre` float64 (2,): centre x, y of the template window [pixels].
    `window`: width and height of the template window [pixels].

    Raises TrackerError if no pixel of the window is in the image and within the limits of
    saturation and value.
    """

    def __init__(
        self,
        owner: str,
        parameters: ColourMotionParameters,
        frame: SharedFrame,
        centre: Array,
        window: Size,
    ) -> None:
        self._owner, self._parameters = owner, parameters
        self._binning = ColourBinning(
            parameters.hue_bins,
            parameters.saturation_bins,
            parameters.minimum_saturation,
            parameters.minimum_value,
            parameters.maximum_value,
        )
        self._motion = frame.compute(first_frame)
        rows, columns = frame.image.shape[:2]
        self._bits = weight_bits(rows, columns)
        left, top, right, bottom = enclosing_region(centre[np.newaxis], *window, rows, columns)
        counts = np.zeros(parameters.hue_bins * parameters.saturation_bins + 1, np.int64)
        bins = np.empty(right - left, np.int32)
        for row in range(top, bottom):
            colour_bins(frame.image, row, left, right, self._binning, bins)
            counts += np.bincount(bins, minlength=len(counts))
        joint = counts[:-1].reshape(parameters.hue_bins, parameters.saturation_bins)
        if not joint.any():
            raise TrackerError(
                f"{owner}: no pixel of the {window[0]}x{window[1]} window around "
                f"({centre[0]:.1f}, {centre[1]:.1f}) is in the image and within the limits "
                "minimum_saturation, minimum_value and maximum_value. Use another box, or widen "
                "the limits."
            )
        hue, saturation = joint.sum(axis=1), joint.sum(axis=0)
        of_hue, of_saturation = hue / hue.max(), saturation / saturation.max()
        colour = parameters.alpha * of_hue[:, np.newaxis] + (1 - parameters.alpha) * of_saturation
        weights = np.stack([(1 - parameters.beta) * colour, colour]).reshape(2, -1)
        scaled = np.rint(weights * 2.0**self._bits).astype(np.int64)
        self._weights = np.concatenate([scaled, np.zeros((2, 1), np.int64)], axis=1)

    def observe(self, frame: SharedFrame) -> "JointMap":
        """Return the joint map of the next frame; raise TrackerError if its size differs."""
        parameters = self._parameters
        if frame.image.shape[:2] != self._motion.grey.shape:
            rows, columns = self._motion.grey.shape
            raise TrackerError(
                f"{self._owner}: a frame has {frame.image.shape[1]}x{frame.image.shape[0]} "
                f"pixels, the previous one {columns}x{rows}. All frames of a sequence must have "
                "the same size."
            )
        self._motion = frame.compute(
            compare_frames,
            self._motion,
            parameters.difference_window,
            parameters.differences == "two",
        )
        threshold = self._threshold(self._motion)
        return JointMap(frame, self._motion, threshold, self._weights, self._bits, self._binning)

    def _threshold(self, motion: FrameMotion) -> float:
        """Return the threshold of D¹ + D² for motion: twice the T in step 4 of the paper."""
        parameters = self._parameters
        if parameters.motion_threshold == "adaptive":
            return motion.mean + parameters.threshold_factor * motion.deviation
        return 2 * 3 * parameters.difference_window**2 * parameters.motion_threshold


class JointMap:
    """Joint map P of a frame (eq. 5), summed only in the regions that windows reach.

    The attribute `unit` is 2^-bits: the weight that the integer 1 stands for.
    """

    def __init__(
        self,
        frame: SharedFrame,
        motion: FrameMotion,
        threshold: float,
        weights: Ints,
        bits: int,
        binning: ColourBinning,
    ) -> None:
        self._image, self._motion, self._threshold = frame.image, motion, threshold
        self._weights, self._binning = weights, binning
        self.unit = 2.0**-bits
        self._region = Region(0, 0, 0, 0)
        self._sums = np.zeros((1, 1, 3), np.int64)

    def drift(
        self, points: Array, window: Size, stop_distance: float, max_iterations: int
    ) -> DriftResult:
        """Move windows of one size by mean shift; see the function `drift`."""
        rows, columns = self._image.shape[:2]
        region = enclosing_region(points, *window, rows, columns)
        margin_x, margin_y = window[0] // 4, window[1] // 4
        while True:
            self._cover(region, margin_x, margin_y)
            moved, region = drift(
                self._sums,
                self._region,
                rows,
                columns,
                points,
                *window,
                stop_distance,
                max_iterations,
            )
            if region.right == 0:
                return moved
            margin_x, margin_y = 2 * margin_x + 1, 2 * margin_y + 1

    def details(self, centre: Array, window: Size) -> dict[str, float]:
        """Return `similarity` (M / M₀) and the shares `moving`, `moving_inside` and `changing`."""
        rows, columns = self._image.shape[:2]
        motion = self._motion
        change = motion.latest, motion.earlier, self._threshold
        pixels = window_region(float(centre[0]), float(centre[1]), *window, rows, columns)
        self._cover(pixels, 0, 0)
        total = moments_in_window(self._sums, self._region, pixels)[0]
        return {
            "similarity": total * self.unit / (window[0] * window[1]),
            "moving": moving_share(*change, 0, 0, columns, rows),
            "moving_inside": moving_share(*change, *pixels),
            "changing": motion.changing,
        }

    def full_map(self) -> Array:
        """Return the map of the whole image, shape (height, width), in [0, 1]."""
        rows, columns = self._image.shape[:2]
        sums = self._summed(Region(0, 0, columns, rows))[..., 0]
        return np.diff(np.diff(sums, axis=0), axis=1) * self.unit

    def _cover(self, reached: Region, margin_x: int, margin_y: int) -> None:
        """Extend the summed region to contain `reached`, with a margin [pixels]."""
        before = self._region
        if before.right > 0:
            if contains(before, reached):
                return
            reached = Region(
                min(reached.left, before.left),
                min(reached.top, before.top),
                max(reached.right, before.right),
                max(reached.bottom, before.bottom),
            )
        rows, columns = self._image.shape[:2]
        self._region = Region(
            max(reached.left - margin_x, 0),
            max(reached.top - margin_y, 0),
            min(reached.right + margin_x, columns),
            min(reached.bottom + margin_y, rows),
        )
        self._sums = self._summed(self._region)

    def _summed(self, region: Region) -> Ints:
        motion = self._motion
        change = motion.latest, motion.earlier, self._threshold
        return integral_image(self._image, region, *change, self._weights, self._binning)
