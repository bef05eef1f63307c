"""What the cues are shown of a frame, and weights from it (Moreno-Noguer et al. 2005, section 5).

Colours are taken together in cells of a grid, so that each is judged only once.
"""

from math import ceil, floor, inf, isfinite
from typing import Literal, NamedTuple, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array, Ints
from trackmark.trackers.base.interface import Image
from trackmark.trackers.contours.mixture import Mixture, fit_mixture
from trackmark.trackers.contours.outline import bounding_box

Cells: TypeAlias = NDArray[np.int32]


class ColourCells(NamedTuple):
    """The K cells of a colour grid that an image occupies, in the grid's order."""

    colours: Array  # (K, 3): mean RGB of each cell's pixels, in [0, 1]
    image: Cells  # (rows, columns): cell of every pixel, in [0, K)
    sizes: Ints  # (K,): pixels of each, at least 1


@njit(cache=True)
def colour_cells(image: Image, levels: int = 20) -> ColourCells:
    """Cells of equal size in a BGR image, `levels`, 1 to 64, along each of red, green and blue."""
    rows, columns, _ = image.shape
    totals = np.zeros((levels**3, 4), np.int64)  # of red, green and blue, and pixels
    cells = np.empty((rows, columns), np.int32)
    for row in range(rows):
        for column in range(columns):
            blue = np.int64(image[row, column, 0])
            green = np.int64(image[row, column, 1])
            red = np.int64(image[row, column, 2])
            cell = (red * levels >> 8) * levels + (green * levels >> 8)
            cell = cell * levels + (blue * levels >> 8)
            cells[row, column] = cell
            totals[cell, 0] += red
            totals[cell, 1] += green
            totals[cell, 2] += blue
            totals[cell, 3] += 1
    occupied = np.flatnonzero(totals[:, 3])
    numbers = np.empty(len(totals), np.int32)
    colours = np.empty((len(occupied), 3))
    sizes = np.empty(len(occupied), np.int64)
    for number, cell in enumerate(occupied):
        numbers[cell] = number
        sizes[number] = totals[cell, 3]
        for channel in range(3):
            colours[number, channel] = totals[cell, channel] / (255.0 * sizes[number])
    for row in range(rows):
        for column in range(columns):
            cells[row, column] = numbers[cells[row, column]]
    return ColourCells(colours, cells, sizes)


def cells_inside(cells: ColourCells, x0: int, y0: int, x1: int, y1: int) -> Ints:
    """Count each cell's pixels (K,) in columns x0 to x1 and rows y0 to y1, ends excluded."""
    inside = cells.image[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
    return np.bincount(inside.ravel(), minlength=len(cells.sizes))


Weights: TypeAlias = Literal["literal", "exponential"]

NOISE = 1e-6  # of differences of posteriors in single precision


def weights_from_scores(scores: Array, weights: Weights, temperature: float) -> Array:
    """Weights of hypotheses, up to a common factor.

    A score, (n,), is the mean posterior in a region minus the mean outside, in [-1, 1]. 'literal'
    is that difference itself, not below 0 (Moreno-Noguer et al. 2005, section 5), nor what rounding
    makes of 0; 'exponential' is exp(difference / temperature). Good and mediocre hypotheses differ
    by some hundredths, so that the former hardly tells them apart.

    Examples
    --------
    >>> graded(np.array([-0.5, 0.2]), "literal", 1.0).tolist()
    [0.0, 0.2]
    >>> graded(np.array([0.0, 0.1]), "exponential", 0.1).round(3).tolist()
    [0.368, 1.0]
    """
    if weights == "literal":
        return np.where(scores > NOISE, scores, 0.0)
    exponentials: Array = np.exp((scores - scores.max()) / temperature)
    return exponentials


Rectangle: TypeAlias = tuple[int, int, int, int]
"""Pixel columns x0 to x1 and rows y0 to y1, the latter of each not included: x0, y0, x1, y1."""

MIN_WINDOW_SIDE = 8  # pixels that a window keeps of the image, wherever the target went
FIRST_STEPS = 6  # of EM in three dimensions; more follow on the planes


class ColourSet(NamedTuple):
    """Colours that were drawn from a region, and a mixture of Gaussians fitted to them."""

    points: Array  # (n, 3): R, G, B in [0, 1]
    mixture: Mixture  # in three dimensions


class Observation(NamedTuple):
    """A frame, the window W in which the target is expected, and what is outside.

    The contrast (cells,) is the share of W's pixels that have a colour, minus the share of those
    outside: its product with a posterior of the colours is the mean in W minus the mean outside.
    """

    cells: ColourCells  # the colours of the frame
    window: Rectangle  # W
    around: Rectangle  # of which the rest is what is outside
    contrast: Array
    prior: float  # P(O): probability of the target before a pixel's colour is seen
    inside: ColourSet | None = None  # colours in W; None where no cue wants them
    outside: ColourSet | None = None


def window_around(
    contour: Array, margin: float, growth: float, width: int, height: int
) -> Rectangle:
    """Return W: a contour's bounding box, wider by `margin` and `growth` of half its sides."""
    x, y, wide, high = bounding_box(contour)
    columns = _spread(x, wide, margin + growth * wide / 2, width)
    rows = _spread(y, high, margin + growth * high / 2, height)
    return columns[0], rows[0], columns[1], rows[1]


def observe(
    cells: ColourCells, window: Rectangle, prior: float = 0.5, ring: float = inf
) -> Observation:
    """Contrast a window's colours with the rest of a rectangle `ring` times as wide and high."""
    height, width = cells.image.shape
    around = 0, 0, width, height
    if isfinite(ring):
        x0, y0, x1, y1 = window
        more = (ring - 1) / 2
        columns = _spread(x0, x1 - x0, more * (x1 - x0), width)
        rows = _spread(y0, y1 - y0, more * (y1 - y0), height)
        around = columns[0], rows[0], columns[1], rows[1]
    inside = cells_inside(cells, *window)
    outside = cells_inside(cells, *around) - inside
    # A window that fills the image is compared with nothing: only what is in it counts.
    contrast = inside / inside.sum() - outside / max(int(outside.sum()), 1)
    return Observation(cells, window, around, contrast, prior)


def with_colour_sets(
    observation: Observation,
    image: Image,
    points: tuple[int, int],
    components: tuple[int, int],
    generator: np.random.Generator,
) -> Observation:
    """Draw `points` in the window and outside, and fit mixtures of `components` (section 5.2)."""
    within, around = (
        _filled(rectangle, image.shape[:2])
        for rectangle in (observation.window, observation.around)
    )
    beyond = around & ~within
    if not beyond.any():
        beyond = within
    sets = []
    for region, count, parts in zip((within, beyond), points, components, strict=True):
        colours = draw_colours(image, region, count, generator)
        mixture = fit_mixture(colours, parts, generator, iterations=FIRST_STEPS)
        sets.append(ColourSet(colours, mixture))
    return observation._replace(inside=sets[0], outside=sets[1])


def draw_colours(
    image: Image, region: NDArray[np.bool_], count: int, generator: np.random.Generator
) -> Array:
    """R, G, B in [0, 1], (count, 3), of pixels drawn evenly, with replacement, from a region."""
    places = np.flatnonzero(region)
    chosen = places[generator.integers(0, len(places), count)]
    return to_rgb(image.reshape(-1, 3)[chosen])


def to_rgb(pixels: NDArray[np.uint8]) -> Array:
    """R, G, B in [0, 1] of pixels that are B, G, R."""
    return pixels[..., ::-1] / 255.0


def _filled(rectangle: Rectangle, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    x0, y0, x1, y1 = rectangle
    pixels = np.zeros(shape, bool)
    pixels[y0:y1, x0:x1] = True
    return pixels


def _spread(start: float, length: float, more: float, limit: int) -> tuple[int, int]:
    """An interval with some more on both sides, in whole pixels inside [0, limit)."""
    narrowest = min(MIN_WINDOW_SIDE, limit)
    first = min(max(floor(start - more), 0), limit - narrowest)
    last = min(max(ceil(start + length + more), first + narrowest), limit)
    return first, last
