"""Search for a template's pose: translation and scale, from coarse to fine (equations 1 to 4)."""

from functools import cache
from math import ceil, floor
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from trackmark.trackers.base.arrays import Array

MIN_SCALE, MAX_SCALE = 0.5, 2.0
FINEST = 6  # distance by which the finer levels can exceed the search range [pixels]
WIDEST = 1.05  # upper bound of the product of their scale factors


class Pose(NamedTuple):
    """Translation and scale: the transformation a of equation 1."""

    x: float  # centre of the template in the image; pixel centres are whole numbers [pixels]
    y: float
    scale: float  # of the template, between 0.5 and 2


def move_inside(pose: Pose, n_rows: int, n_columns: int) -> Pose:
    """Return a pose with its centre moved to the nearest position in the image."""
    x, y = min(max(pose.x, 0.0), n_columns - 1.0), min(max(pose.y, 0.0), n_rows - 1.0)
    return pose._replace(x=x, y=y)


class Match(NamedTuple):
    """Best pose, and its cost over all pixels of the template (equation 4)."""

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
) -> Match:
    """Return the pose of minimum robust cost (equations 3 and 4).

    The first level searches ± `search_range` in steps of 4 pixels. The second searches around the
    three best poses in steps of 2. The next two search around the best pose in steps of 1, with
    scales 2 % and then 1 % apart. With `subpixel`, steps of 0.5 and 0.25 pixels follow. Only poses
    with the centre in the image are compared.

    `window`: pixels of at least `search_bounds`.
    `template` float64 (height, width, d): features of the template.
    `covariance` float64 (d, d): covariance of residuals.
    `around`: centre of the search, in the image, rounded to whole pixels.
    `search_range`: maximum translation of the first level, even [pixels]; 0 for none. `cutoff`: c
    of Huber's function; infinite for quadratic costs. `subpixel`: refine to fractions of a pixel,
    with bilinear interpolation. Of equal costs, that of the smallest scale, y and x (in this order)
    is selected.
    """
    pose, cost = _search(
        window,
        template,
        tuple(range(len(covariance))),
        whitening(covariance),
        np.array([[floor(around.x + 0.5), floor(around.y + 0.5), around.scale]]),
        (offset_grid(search_range, TRANSLATION_STEPS[0], 0.0), *FINER),
        len(TRANSLATION_STEPS) + (len(SUBPIXEL_STEPS) if subpixel else 0),
        cutoff,
    )
    return Match(Pose(pose[0], pose[1], pose[2]), cost)


@cache
def offset_grid(half_range: float, step: float, scale_step: float) -> Array:
    """Return offsets x, y, scale factors and ranks, (n, 4), of poses in order of their distance.

    The rank counts poses in ascending order of scale, y and x. It decides between equal costs.
    """
    steps = np.arange(-half_range, half_range + step / 2, step)
    factors = [1 - scale_step, 1.0, 1 + scale_step] if scale_step else [1.0]
    scales, rows, columns = np.meshgrid(np.array(factors), steps, steps, indexing="ij")
    ranks = np.arange(float(scales.size))
    offsets = np.stack([columns.ravel(), rows.ravel(), scales.ravel(), ranks], axis=1)
    distances = np.hypot(offsets[:, 0], offsets[:, 1])
    return offsets[np.lexsort((ranks, np.abs(offsets[:, 2] - 1), distances))]


TRANSLATION_STEPS, SUBPIXEL_STEPS = (4, 2, 1, 1), (0.5, 0.25)
"""Steps of the translation on the levels in whole pixels and in fractions [pixels]."""
SCALE_STEPS = 0.02, 0.01, 0.01, 0.005
"""Relative differences of scales on the last four levels."""
N_REFINED = 3  # number of poses of the first level that the second level refines

FINER = (
    offset_grid(TRANSLATION_STEPS[1], TRANSLATION_STEPS[1], 0.0),
    offset_grid(TRANSLATION_STEPS[2], TRANSLATION_STEPS[2], SCALE_STEPS[0]),
    offset_grid(TRANSLATION_STEPS[3], TRANSLATION_STEPS[3], SCALE_STEPS[1]),
    offset_grid(SUBPIXEL_STEPS[0], SUBPIXEL_STEPS[0], SCALE_STEPS[2]),
    offset_grid(SUBPIXEL_STEPS[1], SUBPIXEL_STEPS[1], SCALE_STEPS[3]),
)
"""Offsets of all levels but the first."""


@njit(cache=True)
def _search(
    unwhitened: FeatureWindow,
    template: Array,
    components: tuple[int, ...],
    white: Array,
    around: Array,
    levels: tuple[Array, ...],
    n_levels: int,
    cutoff: float,
) -> tuple[Array, float]:
    features = _whiten(unwhitened.features, components, white)
    window = FeatureWindow(
        features, unwhitened.left, unwhitened.top, unwhitened.n_rows, unwhitened.n_columns
    )
    sought = _whiten(template, components, white)
    best, cost = around, 0.0
    for level in range(n_levels):  # a loop, because each call with other constants is compiled
        bilinear = level >= len(TRANSLATION_STEPS)
        n_poses = N_REFINED if level == 0 else 1
        best, costs = best_poses(
            window, sought, components, best, levels[level], bilinear, cutoff, n_poses
        )
        cost = costs[0]
    return best[0], cost


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
    bilinear: bool,
    cutoff: float,
    n_poses: int,
) -> tuple[Array, Array]:
    """Return the `n_poses` best poses at `offsets` (m, 4) from `around` (n, 3), and their costs.

    Poses with the centre outside the image have no cost; a pose in `around` takes the place of
    missing ones. Terms of the cost are not negative, so a sum stops once it exceeds the worst of
    the best costs so far. Near poses come first, because they are often good and then stop the
    other sums early.
    Of equal costs, that of the first pose in `around`, and then of the smallest rank, is better.
    The tuple `components` has a length known to the compiler, which unrolls the loops over
    features.
    """
    height, width, _ = template.shape
    n_poses = min(n_poses, len(around) * len(offsets))
    poses, costs, ranks = np.empty((n_poses, 3)), np.empty(n_poses), np.empty(n_poses)
    for i in range(n_poses):
        poses[i, 0], poses[i, 1], poses[i, 2] = around[0, 0], around[0, 1], around[0, 2]
        costs[i] = ranks[i] = np.inf
    for n in range(len(around)):
        for m in range(len(offsets)):
            x, y = around[n, 0] + offsets[m, 0], around[n, 1] + offsets[m, 1]
            if not (0 <= x <= window.n_columns - 1 and 0 <= y <= window.n_rows - 1):
                continue
            scale = min(max(around[n, 2] * offsets[m, 2], MIN_SCALE), MAX_SCALE)
            across = _axis_positions(x, scale, width, window.n_columns)
            along = _axis_positions(y, scale, height, window.n_rows)
            worst = costs[n_poses - 1]
            if bilinear:
                cost = _bilinear_cost(window, template, components, across, along, cutoff, worst)
            else:
                cost = _nearest_cost(window, template, components, across, along, cutoff, worst)
            rank = n * len(offsets) + offsets[m, 3]
            if cost > worst or (cost == worst and rank >= ranks[n_poses - 1]):
                continue
            i = n_poses - 1
            while i > 0 and (cost < costs[i - 1] or (cost == costs[i - 1] and rank < ranks[i - 1])):
                costs[i], ranks[i] = costs[i - 1], ranks[i - 1]
                for k in range(3):
                    poses[i, k] = poses[i - 1, k]
                i -= 1
            costs[i], ranks[i] = cost, rank
            poses[i, 0], poses[i, 1], poses[i, 2] = x, y, scale
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
    """Return the cost with nearest pixels, or any number > `worst` if the cost is > `worst`."""
    columns = np.empty(len(across), np.uint32)  # unsigned: no check for negative indices
    for j in range(len(across)):
        columns[j] = int(across[j] + 0.5) - window.left
    distances = np.empty(len(across))
    cost = 0.0
    for i in range(len(along)):
        row, expected = window.features[int(along[i] + 0.5) - window.top], template[i]
        for j in range(len(columns)):
            column = columns[j]
            distance = 0.0
            for k in range(len(components)):
                residual = row[column, k] - expected[j, k]
                distance += residual * residual
            distances[j] = distance
        cost = _add_huber(cost, distances, cutoff)
        if cost > worst:
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
    lefts, rights = np.empty(len(across), np.uint32), np.empty(len(across), np.uint32)
    shares = np.empty(len(across))
    for j in range(len(across)):
        left = int(across[j])
        shares[j] = across[j] - left
        lefts[j] = left - window.left
        rights[j] = min(left + 1, window.n_columns - 1) - window.left
    above, below = np.empty_like(template[0]), np.empty_like(template[0])
    above_row = below_row = -1  # rows that these buffers contain
    distances = np.empty(len(across))
    cost = 0.0
    for i in range(len(along)):
        top = int(along[i])
        v = along[i] - top
        upper_row, lower_row = top - window.top, min(top + 1, window.n_rows - 1) - window.top
        if below_row == upper_row:  # the usual step by one row
            above, below, above_row, below_row = below, above, below_row, above_row
        if above_row != upper_row:
            _interpolate_row(above, window.features[upper_row], components, lefts, rights, shares)
            above_row = upper_row
        if below_row != lower_row:
            _interpolate_row(below, window.features[lower_row], components, lefts, rights, shares)
            below_row = lower_row
        expected = template[i]
        for j in range(len(distances)):
            distance = 0.0
            for k in range(len(components)):
                residual = (1 - v) * above[j, k] + v * below[j, k] - expected[j, k]
                distance += residual * residual
            distances[j] = distance
        cost = _add_huber(cost, distances, cutoff)
        if cost > worst:
            break
    return cost


@njit(cache=True)
def _interpolate_row(
    between: Array,
    row: Array,
    components: tuple[int, ...],
    lefts: NDArray[np.uint32],
    rights: NDArray[np.uint32],
    shares: Array,
) -> None:
    """Fill `between` (width, d) with the features between two columns each."""
    for j in range(len(shares)):
        u, left, right = shares[j], lefts[j], rights[j]
        for k in range(len(components)):
            between[j, k] = (1 - u) * row[left, k] + u * row[right, k]


@njit(cache=True)
def _add_huber(cost: float, squared: Array, cutoff: float) -> float:
    """Return a cost plus ρ of squared distances (equation 3), which are replaced by ρ."""
    for j in range(len(squared)):  # without branches, so that the compiler can vectorise it
        near, far = squared[j] / 2, cutoff * (np.sqrt(squared[j]) - cutoff / 2)
        squared[j] = near if squared[j] < cutoff * cutoff else far
    for j in range(len(squared)):
        cost += squared[j]
    return cost
