"""Search for a template's pose: translation and scale, from coarse to fine (equations 1 to 4)."""

from math import ceil, floor
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from numba import njit

from trackmark.trackers.base.arrays import Array

Ties: TypeAlias = Literal["ascending", "unchanged"]

MIN_SCALE, MAX_SCALE = 0.5, 2.0
FINEST = 6  # distance by which the finer levels can exceed the search range [pixels]
WIDEST = 1.05  # upper bound of the product of their scale factors


class Pose(NamedTuple):
    """Translation and scale: the transformation a of equation 1."""

    x: float  # centre of the template in the image; pixel centres are whole numbers [pixels]
    y: float
    scale: float  # of the template, between 0.5 and 2


class Match(NamedTuple):
    """Best pose, and its cost over every second pixel of every second row (equation 4)."""

    pose: Pose
    cost: float


class FeatureWindow(NamedTuple):
    """Features of a window of the image; border pixels are repeated outside the image."""

    features: Array  # (window rows, window columns, d)
    left: int  # first column of the window in the image
    top: int  # first row
    n_rows: int  # of the image
    n_columns: int


def whitening(covariance: Array) -> Array:
    """Return W (d, d) with W' W = C⁻¹: |W r|² is the squared Mahalanobis distance of r."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def search_bounds(
    pose: Pose, search_range: float, template_shape: tuple[int, ...], n_rows: int, n_columns: int
) -> tuple[int, int, int, int]:
    """Return left, top, right and bottom (exclusive) of the pixels that a search can read."""
    height, width = template_shape[:2]
    scale = WIDEST * min(max(pose.scale, MIN_SCALE), MAX_SCALE)
    half_width = scale * (width - 1) / 2 + search_range + FINEST
    half_height = scale * (height - 1) / 2 + search_range + FINEST
    left = min(max(floor(pose.x - half_width), 0), n_columns - 1)
    top = min(max(floor(pose.y - half_height), 0), n_rows - 1)
    right = min(max(ceil(pose.x + half_width) + 1, left + 2), n_columns)
    bottom = min(max(ceil(pose.y + half_height) + 1, top + 2), n_rows)
    return left, top, right, bottom


def find_pose(
    window: FeatureWindow,
    template: Array,
    covariance: Array,
    around: Pose,
    search_range: int,
    cutoff: float,
    subpixel: bool,
    ties: Ties = "ascending",
) -> Match:
    """Return the pose of minimum robust cost (equations 3 and 4).

    The first level searches ± `search_range` in steps of 4 pixels. The second searches around the
    three best poses in steps of 2. The next two search around the best pose in steps of 1, with
    scales 2 % and then 1 % apart. With `subpixel`, steps of 0.5 and 0.25 pixels follow.

    `window`: pixels of at least `search_bounds`.
    `template` float64 (height, width, d): features of the template.
    `covariance` float64 (d, d): covariance of residuals.
    `around`: centre of the search, rounded to whole pixels.
    `search_range`: maximum translation of the first level, even [pixels]; 0 for none. `cutoff`: c
    of Huber's function; infinite for quadratic costs. `subpixel`: refine to fractions of a pixel,
    with bilinear interpolation. `ties` {"ascending", "unchanged"}: order of poses; the first of
    equal cost is selected.
      `ascending`: by scale, y and x. `unchanged`: poses with unchanged scale first.
    """
    start = floor(around.x + 0.5), floor(around.y + 0.5), around.scale
    pose, cost = _search(
        window,
        template,
        tuple(range(len(covariance))),
        whitening(covariance),
        start,
        search_range,
        cutoff,
        subpixel,
        FINE[ties],
    )
    return Match(Pose(pose[0], pose[1], pose[2]), cost)


def offset_grid(
    half_range: float, step: float, scale_step: float, ties: Ties = "ascending"
) -> Array:
    """Return offsets x, y and scale factors, (n, 3), in the order of the search."""
    steps = np.arange(-half_range, half_range + step / 2, step)
    factors = [1 - scale_step, 1.0, 1 + scale_step] if scale_step else [1.0]
    if ties == "unchanged":
        factors.sort(key=lambda factor: factor != 1.0)
    scales, rows, columns = np.meshgrid(np.array(factors), steps, steps, indexing="ij")
    return np.stack([columns.ravel(), rows.ravel(), scales.ravel()], axis=1)


NEAR = offset_grid(2, 2.0, 0.0)
FINE: dict[Ties, tuple[Array, Array, Array, Array]] = {
    ties: (
        offset_grid(1, 1.0, 0.02, ties),
        offset_grid(1, 1.0, 0.01, ties),
        offset_grid(0.5, 0.5, 0.01, ties),
        offset_grid(0.25, 0.25, 0.005, ties),
    )
    for ties in get_args(Ties)
}


@njit(cache=True)
def _search(
    unwhitened: FeatureWindow,
    template: Array,
    components: tuple[int, ...],
    white: Array,
    start: tuple[float, float, float],
    search_range: int,
    cutoff: float,
    subpixel: bool,
    fine: tuple[Array, Array, Array, Array],
) -> tuple[Array, float]:
    features = _whiten(unwhitened.features, components, white)
    window = FeatureWindow(
        features, unwhitened.left, unwhitened.top, unwhitened.n_rows, unwhitened.n_columns
    )
    sought = _whiten(template, components, white)
    n = 2 * search_range // 4 + 1
    coarse = np.ones((n * n, 3))
    for i in range(n * n):
        coarse[i, 0], coarse[i, 1] = 4 * (i % n) - search_range, 4 * (i // n) - search_range
    around = np.array([[start[0], start[1], start[2]]])
    best, _ = best_poses(window, sought, components, around, coarse, 4, 2, False, cutoff, 3)
    best, _ = best_poses(window, sought, components, best, NEAR, 4, 2, False, cutoff, 1)
    best, _ = best_poses(window, sought, components, best, fine[0], 2, 1, False, cutoff, 1)
    best, costs = best_poses(window, sought, components, best, fine[1], 2, 1, False, cutoff, 1)
    if subpixel:
        best, _ = best_poses(window, sought, components, best, fine[2], 2, 1, True, cutoff, 1)
        best, costs = best_poses(window, sought, components, best, fine[3], 2, 1, True, cutoff, 1)
    return best[0], costs[0]


@njit(cache=True)
def _whiten(features: Array, components: tuple[int, ...], white: Array) -> Array:
    """Return W f of every pixel; W is lower triangular."""
    rows, columns, _ = features.shape
    d = len(components)
    whitened = np.empty_like(features)
    for row in range(rows):
        for column in range(columns):
            for k in range(d):
                value = 0.0
                for m in range(k + 1):
                    value += white[k, m] * features[row, column, m]
                whitened[row, column, k] = value
    return whitened


def sample_template(
    window: FeatureWindow, pose: Pose, height: int, width: int, bilinear: bool
) -> Array:
    """Return the image's features (height, width, d) at a template's pixels (equation 1).

    Features are those of the nearest pixel (of two, the right or lower one), or interpolated if
    `bilinear`. Border pixels are repeated outside the image.
    """
    components = tuple(range(window.features.shape[2]))
    return _sample(window, components, pose, height, width, bilinear)


@njit(cache=True)
def _sample(
    window: FeatureWindow,
    components: tuple[int, ...],
    pose: Pose,
    height: int,
    width: int,
    bilinear: bool,
) -> Array:
    d = len(components)
    features = np.empty((height, width, d))
    across = _axis_positions(pose.x, pose.scale, width, window.n_columns)
    along = _axis_positions(pose.y, pose.scale, height, window.n_rows)
    for i in range(height):
        nearest_row = int(along[i] + 0.5) - window.top
        for j in range(width):
            nearest_column = int(across[j] + 0.5) - window.left
            for k in range(d):
                if bilinear:
                    features[i, j, k] = _interpolate(window, across[j], along[i], k)
                else:
                    features[i, j, k] = window.features[nearest_row, nearest_column, k]
    return features


@njit(cache=True)
def _axis_positions(centre: float, scale: float, length: int, limit: int) -> Array:
    """Return image coordinates of a row or column of template pixels, clipped to the image."""
    positions = np.empty(length)
    for i in range(length):
        positions[i] = min(max(centre + scale * (i - (length - 1) / 2), 0.0), limit - 1.0)
    return positions


@njit(cache=True)
def _interpolate(window: FeatureWindow, x: float, y: float, k: int) -> float:
    """Return feature `k` interpolated between four pixels."""
    features = window.features
    left, top = int(x), int(y)
    u, v = x - left, y - top
    right, bottom = min(left + 1, window.n_columns - 1), min(top + 1, window.n_rows - 1)
    left, right = left - window.left, right - window.left
    top, bottom = top - window.top, bottom - window.top
    upper = (1 - u) * features[top, left, k] + u * features[top, right, k]
    lower = (1 - u) * features[bottom, left, k] + u * features[bottom, right, k]
    between: float = (1 - v) * upper + v * lower
    return between


@njit(cache=True)
def best_poses(
    window: FeatureWindow,
    template: Array,
    components: tuple[int, ...],
    around: Array,
    offsets: Array,
    stride: int,
    first: int,
    bilinear: bool,
    cutoff: float,
    n_poses: int,
) -> tuple[Array, Array]:
    """Return the `n_poses` best poses at `offsets` (m, 3) from `around` (n, 3), and their costs.

    Terms of the cost are not negative, so a sum stops once it reaches the worst of the best costs
    so far. The tuple `components` has a length known to the compiler, which unrolls the loops over
    features.
    """
    height, width, _ = template.shape
    n_poses = min(n_poses, len(around) * len(offsets))
    looked_at = template[first::stride, first::stride].copy()
    poses = np.empty((n_poses, 3))
    costs = np.full(n_poses, np.inf)
    for n in range(len(around)):
        for m in range(len(offsets)):
            x, y = around[n, 0] + offsets[m, 0], around[n, 1] + offsets[m, 1]
            scale = min(max(around[n, 2] * offsets[m, 2], MIN_SCALE), MAX_SCALE)
            across = _axis_positions(x, scale, width, window.n_columns)[first::stride]
            along = _axis_positions(y, scale, height, window.n_rows)[first::stride]
            worst = costs[n_poses - 1]
            if bilinear:
                cost = _bilinear_cost(window, looked_at, components, across, along, cutoff, worst)
            else:
                cost = _nearest_cost(window, looked_at, components, across, along, cutoff, worst)
            if cost >= worst:
                continue
            rank = n_poses - 1
            while rank > 0 and cost < costs[rank - 1]:
                costs[rank] = costs[rank - 1]
                poses[rank] = poses[rank - 1]
                rank -= 1
            costs[rank] = cost
            poses[rank, 0], poses[rank, 1], poses[rank, 2] = x, y, scale
    return poses, costs


@njit(cache=True)
def _nearest_cost(
    window: FeatureWindow,
    template: Array,
    components: tuple[int, ...],
    across: Array,
    along: Array,
    cutoff: float,
    worst: float,
) -> float:
    """Return the cost with nearest pixels, or any number ≥ `worst` if the cost is ≥ `worst`."""
    columns = np.empty(len(across), np.int64)
    for j in range(len(across)):
        columns[j] = int(across[j] + 0.5) - window.left
    cost = 0.0
    for i in range(len(along)):
        row, expected = window.features[int(along[i] + 0.5) - window.top], template[i]
        for j in range(len(columns)):
            distance = 0.0
            for k in range(len(components)):
                residual = row[columns[j], k] - expected[j, k]
                distance += residual * residual
            cost += _huber(distance, cutoff)
        if cost >= worst:
            break
    return cost


@njit(cache=True)
def _bilinear_cost(
    window: FeatureWindow,
    template: Array,
    components: tuple[int, ...],
    across: Array,
    along: Array,
    cutoff: float,
    worst: float,
) -> float:
    """Return the cost as `_nearest_cost` does, with bilinear interpolation."""
    lefts, rights = np.empty(len(across), np.int64), np.empty(len(across), np.int64)
    shares = np.empty(len(across))
    for j in range(len(across)):
        left = int(across[j])
        shares[j] = across[j] - left
        lefts[j] = left - window.left
        rights[j] = min(left + 1, window.n_columns - 1) - window.left
    cost = 0.0
    for i in range(len(along)):
        top = int(along[i])
        v = along[i] - top
        above = window.features[top - window.top]
        below = window.features[min(top + 1, window.n_rows - 1) - window.top]
        expected = template[i]
        for j in range(len(lefts)):
            u, left, right = shares[j], lefts[j], rights[j]
            distance = 0.0
            for k in range(len(components)):
                upper = (1 - u) * above[left, k] + u * above[right, k]
                lower = (1 - u) * below[left, k] + u * below[right, k]
                residual = (1 - v) * upper + v * lower - expected[j, k]
                distance += residual * residual
            cost += _huber(distance, cutoff)
        if cost >= worst:
            break
    return cost


@njit(cache=True)
def _huber(squared: float, cutoff: float) -> float:
    """Return ρ of a squared distance (equation 3)."""
    if squared < cutoff * cutoff:
        return squared / 2
    return float(cutoff * (np.sqrt(squared) - cutoff / 2))
