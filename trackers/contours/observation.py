"""Observation of a frame by the cues (Moreno-Noguer et al. 2005, section 5).

Colours are grouped into cells of a grid, so that each cell is evaluated only once.
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
    """The K non-empty cells of an image's colour grid, in grid order."""

    colours: Array  # (K, 3): mean RGB of each cell's pixels, in [0, 1]
    image: Cells  # (rows, columns): cell of every pixel, in [0, K)
    sizes: Ints  # (K,): number of pixels of each cell, at least 1


def colour_cells(image: Image, levels: int = 20) -> ColourCells:
    """Return the colour cells of a BGR image; `levels`: cells per channel, 1 to 64."""
    totals, cells = _cell_totals(image, levels)
    sizes = totals[:, 3].copy()
    return ColourCells(totals[:, :3] / (255.0 * sizes[:, np.newaxis]), cells, sizes)


@njit(cache=True)
def _cell_totals(image: Image, levels: int) -> tuple[Ints, Cells]:
    """Return sums of red, green and blue, and the number of pixels, by cell, (K, 4); and cells."""
    rows, columns, _ = image.shape
    totals = np.zeros((levels**3, 4), np.int64)
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
    index_of_cell = np.empty(len(totals), np.int32)
    n_cells = 0
    for index in range(len(totals)):
        index_of_cell[index] = n_cells
        if totals[index, 3] > 0:
            for k in range(4):
                totals[n_cells, k] = totals[index, k]
            n_cells += 1
    for row in range(rows):
        for column in range(columns):
            cells[row, column] = index_of_cell[cells[row, column]]
    return totals[:n_cells], cells


def cells_inside(cells: ColourCells, x0: int, y0: int, x1: int, y1: int) -> Ints:
    """Count each cell's pixels (K,) in columns x0 to x1 and rows y0 to y1, ends exclusive."""
    inside = cells.image[max(y0, 0) : max(y1, 0), max(x0, 0) : max(x1, 0)]
    return np.bincount(inside.ravel(), minlength=len(cells.sizes))


Weights: TypeAlias = Literal["literal", "exponential"]

ROUNDING_NOISE = 1e-6  # rounding error of differences of posteriors in single precision


def weights_from_scores(scores: Array, weights: Weights, temperature: float) -> Array:
    """Return weights of hypotheses (n,), up to a common factor.

    A score is the mean posterior inside a region minus the mean outside, in [-1, 1]. `literal`
    returns the score, or 0 if it is negative or rounding noise (Moreno-Noguer et al. 2005, section
    5). `exponential` returns exp(score / temperature). The scores of good and mediocre hypotheses
    differ by a few hundredths: `literal` hardly separates them.

    Examples
    --------
    >>> weights_from_scores(np.array([-0.5, 0.2]), "literal", 1.0).tolist()
    [0.0, 0.2]
    >>> weights_from_scores(np.array([0.0, 0.1]), "exponential", 0.1).round(3).tolist()
    [0.368, 1.0]
    """
    if weights == "literal":
        return np.where(scores > ROUNDING_NOISE, scores, 0.0)
    exponentials: Array = np.exp((scores - scores.max()) / temperature)
    return exponentials


Rectangle: TypeAlias = tuple[int, int, int, int]
"""Pixel bounds x0, y0, x1, y1; x1 and y1 are exclusive."""

MIN_WINDOW_SIDE = 8  # minimum side of a window inside the image [pixels]
FIRST_STEPS = 6  # EM steps in three dimensions; more follow on the planes


class ColourSet(NamedTuple):
    """Sample of a region's colours, and a mixture fitted to it."""

    points: Array  # (n, 3): R, G, B in [0, 1]
    mixture: Mixture  # in three dimensions


class Observation(NamedTuple):
    """Frame, window W in which the target is expected, and its surroundings.

    `contrast` (cells,) is the share of W's pixels in each cell minus the share of the outside
    pixels. Its scalar product with a posterior per cell is the mean posterior in W minus the mean
    outside.
    """

    cells: ColourCells
    window: Rectangle  # W
    around: Rectangle  # rectangle around W; "outside" is its part without W
    contrast: Array
    prior: float  # P(O): prior probability of the target at a pixel
    inside: ColourSet | None = None  # colours in W; None if no cue uses them
    outside: ColourSet | None = None


def window_around(
    contour: Array, margin: float, growth: float, width: int, height: int
) -> Rectangle:
    """Return W: a contour's bounding box, extended by `margin` + `growth` · half its sides."""
    x, y, wide, high = bounding_box(contour)
    columns = _expanded_interval(x, wide, margin + growth * wide / 2, width)
    rows = _expanded_interval(y, high, margin + growth * high / 2, height)
    return columns[0], rows[0], columns[1], rows[1]


def observe(
    cells: ColourCells, window: Rectangle, prior: float = 0.5, ring: float = inf
) -> Observation:
    """Return the observation of a window and of its surroundings, `ring` times as wide and high."""
    height, width = cells.image.shape
    around = 0, 0, width, height
    if isfinite(ring):
        x0, y0, x1, y1 = window
        more = (ring - 1) / 2
        columns = _expanded_interval(x0, x1 - x0, more * (x1 - x0), width)
        rows = _expanded_interval(y0, y1 - y0, more * (y1 - y0), height)
        around = columns[0], rows[0], columns[1], rows[1]
    inside = cells_inside(cells, *window)
    outside = cells_inside(cells, *around) - inside
    # For a window that fills the image, the mean outside is 0.
    contrast = inside / inside.sum() - outside / max(int(outside.sum()), 1)
    return Observation(cells, window, around, contrast, prior)


def with_colour_sets(
    observation: Observation,
    image: Image,
    points: tuple[int, int],
    components: tuple[int, int],
    generator: np.random.Generator,
) -> Observation:
    """Add samples of the colours inside and outside W, and mixtures fitted to them (section 5.2).

    Numbers of colours (`points`) and Gaussians (`components`) are pairs: inside W, outside W.
    """
    within, around = (
        _rectangle_mask(rectangle, image.shape[:2])
        for rectangle in (observation.window, observation.around)
    )
    beyond = around & ~within
    if not beyond.any():
        beyond = within
    sets = []
    for region, count, n_components in zip((within, beyond), points, components, strict=True):
        colours = draw_colours(image, region, count, generator)
        mixture = fit_mixture(colours, n_components, generator, iterations=FIRST_STEPS)
        sets.append(ColourSet(colours, mixture))
    return observation._replace(inside=sets[0], outside=sets[1])


def draw_colours(
    image: Image, region: NDArray[np.bool_], count: int, generator: np.random.Generator
) -> Array:
    """Draw colours R, G, B in [0, 1], (count, 3), from a region, uniformly with replacement."""
    places = np.flatnonzero(region)
    chosen = places[generator.integers(0, len(places), count)]
    return to_rgb(image.reshape(-1, 3)[chosen])


def to_rgb(pixels: NDArray[np.uint8]) -> Array:
    """Convert B, G, R bytes (..., 3) to R, G, B in [0, 1]."""
    return pixels[..., ::-1] / 255.0


def _rectangle_mask(rectangle: Rectangle, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    x0, y0, x1, y1 = rectangle
    pixels = np.zeros(shape, bool)
    pixels[y0:y1, x0:x1] = True
    return pixels


def _expanded_interval(start: float, length: float, more: float, limit: int) -> tuple[int, int]:
    """Return an interval extended by `more` on both sides, in whole pixels in [0, limit)."""
    narrowest = min(MIN_WINDOW_SIDE, limit)
    first = min(max(floor(start - more), 0), limit - narrowest)
    last = min(max(ceil(start + length + more), first + narrowest), limit)
    return first, last
