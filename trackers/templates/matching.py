"""Where a template fits best: translation and scale, from coarse to fine (equations 1 to 4)."""

from math import ceil, floor
from typing import Literal, NamedTuple, TypeAlias, get_args

import numpy as np
from numba import njit

from trackmark.trackers.base.arrays import Array

Ties: TypeAlias = Literal["ascending", "unchanged"]

SMALLEST_SCALE, LARGEST_SCALE = 0.5, 2.0
FINEST = 6  # pixels that the levels below the first may add to its range, all together
WIDEST = 1.05  # and what their scales come to


class Pose(NamedTuple):
    """The transformation a of equation 1."""

    x: float  # centre of the template in the image; pixel centres are whole numbers [pixels]
    y: float
    scale: float  # of the template, between 0.5 and 2


class Match(NamedTuple):
    """The best pose, and its cost over every second pixel either way (equation 4)."""

    pose: Pose
    cost: float


class Window(NamedTuple):
    """Features of a part of the image, whose rest is taken to continue its rim."""

    features: Array  # (rows, columns, d) of the part
    left: int  # the image's pixel that the first one is
    top: int
    rows: int  # of the image
    columns: int


def whitening(covariance: Array) -> Array:
    """W with W' W the inverse of a covariance (d, d): |W r|² is the Mahalanobis distance of r."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def reach(
    pose: Pose, search_range: float, template_shape: tuple[int, ...], rows: int, columns: int
) -> tuple[int, int, int, int]:
    """Columns and rows, ends excluded, that a search around a pose looks at; within the image."""
    height, width = template_shape[:2]
    scale = WIDEST * min(max(pose.scale, SMALLEST_SCALE), LARGEST_SCALE)
    half_width = scale * (width - 1) / 2 + search_range + FINEST
    half_height = scale * (height - 1) / 2 + search_range + FINEST
    left = min(max(floor(pose.x - half_width), 0), columns - 1)
    top = min(max(floor(pose.y - half_height), 0), rows - 1)
    right = min(max(ceil(pose.x + half_width) + 1, left + 2), columns)
    bottom = min(max(ceil(pose.y + half_height) + 1, top + 2), rows)
    return left, top, right, bottom


def search(
    window: Window,
    template: Array,
    covariance: Array,
    around: Pose,
    search_range: int,
    cutoff: float,
    subpixel: bool,
    ties: Ties = "ascending",
) -> Match:
    """Pose of the least robust cost (equations 3 and 4).

    First over ± `search_range` in steps of 4 pixels, then around the three best in steps of 2, then
    around the best in steps of 1 with scales 2 % and then 1 % apart; for fractions of a pixel on in
    steps of a half and a quarter. Of equal costs the first wins: scale, y and x ascend, or the
    unchanged scale comes first.

    The window holds all that `reach` says; the template is (height, width, d), the covariance of
    residuals (d, d). The search is `around` a place rounded to whole pixels, with an even range
    [pixels]; 0 is the place itself. `cutoff` is c of Huber's function; infinite for a quadratic
    one.
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


def grid(half_range: float, step: float, scale_step: float, ties: Ties = "ascending") -> Array:
    """Offsets x, y and factors of the scale, (n, 3) in the order of the scan."""
    steps = np.arange(-half_range, half_range + step / 2, step)
    factors = [1 - scale_step, 1.0, 1 + scale_step] if scale_step else [1.0]
    if ties == "unchanged":
        factors.sort(key=lambda factor: factor != 1.0)
    scales, rows, columns = np.meshgrid(np.array(factors), steps, steps, indexing="ij")
    return np.stack([columns.ravel(), rows.ravel(), scales.ravel()], axis=1)


NEAR = grid(2, 2.0, 0.0)
FINE: dict[Ties, tuple[Array, Array, Array, Array]] = {
    ties: (
        grid(1, 1.0, 0.02, ties),
        grid(1, 1.0, 0.01, ties),
        grid(0.5, 0.5, 0.01, ties),
        grid(0.25, 0.25, 0.005, ties),
    )
    for ties in get_args(Ties)
}


@njit(cache=True)
def _search(
    whole: Window,
    template: Array,
    components: tuple[int, ...],
    white: Array,
    start: tuple[float, float, float],
    search_range: int,
    cutoff: float,
    subpixel: bool,
    fine: tuple[Array, Array, Array, Array],
) -> tuple[Array, float]:
    features = _whitened(whole.features, components, white)
    window = Window(features, whole.left, whole.top, whole.rows, whole.columns)
    sought = _whitened(template, components, white)
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
def _whitened(features: Array, components: tuple[int, ...], white: Array) -> Array:
    """W f of every pixel; W is lower triangular."""
    rows, columns, _ = features.shape
    d = len(components)
    found = np.empty_like(features)
    for row in range(rows):
        for column in range(columns):
            for k in range(d):
                value = 0.0
                for m in range(k + 1):
                    value += white[k, m] * features[row, column, m]
                found[row, column, k] = value
    return found


def sampled(window: Window, pose: Pose, height: int, width: int, bilinear: bool) -> Array:
    """Features (height, width, d) of the image where a template's pixels come to lie (equation 1).

    The nearest pixel's (of two, the right or the lower one), or interpolated between four. Outside
    the image its rim continues.
    """
    components = tuple(range(window.features.shape[2]))
    return _sampled(window, components, pose, height, width, bilinear)


@njit(cache=True)
def _sampled(
    window: Window, components: tuple[int, ...], pose: Pose, height: int, width: int, bilinear: bool
) -> Array:
    d = len(components)
    found = np.empty((height, width, d))
    across = _positions(pose.x, pose.scale, width, window.columns)
    along = _positions(pose.y, pose.scale, height, window.rows)
    for i in range(height):
        nearest_row = int(along[i] + 0.5) - window.top
        for j in range(width):
            nearest_column = int(across[j] + 0.5) - window.left
            for k in range(d):
                if bilinear:
                    found[i, j, k] = _between(window, across[j], along[i], k)
                else:
                    found[i, j, k] = window.features[nearest_row, nearest_column, k]
    return found


@njit(cache=True)
def _positions(centre: float, scale: float, length: int, limit: int) -> Array:
    """Coordinates of a row or column of template pixels, held inside the image."""
    found = np.empty(length)
    for i in range(length):
        found[i] = min(max(centre + scale * (i - (length - 1) / 2), 0.0), limit - 1.0)
    return found


@njit(cache=True)
def _between(window: Window, x: float, y: float, k: int) -> float:
    """One feature between four pixels."""
    features = window.features
    left, top = int(x), int(y)
    u, v = x - left, y - top
    right, bottom = min(left + 1, window.columns - 1), min(top + 1, window.rows - 1)
    left, right = left - window.left, right - window.left
    top, bottom = top - window.top, bottom - window.top
    upper = (1 - u) * features[top, left, k] + u * features[top, right, k]
    lower = (1 - u) * features[bottom, left, k] + u * features[bottom, right, k]
    between: float = (1 - v) * upper + v * lower
    return between


@njit(cache=True)
def best_poses(
    window: Window,
    template: Array,
    components: tuple[int, ...],
    around: Array,
    offsets: Array,
    stride: int,
    first: int,
    bilinear: bool,
    cutoff: float,
    number: int,
) -> tuple[Array, Array]:
    """Return the poses of least cost, `number` of `offsets` (m, 3) from `around` (n, 3), in order.

    A sum that already is no less than the last of them is not finished: terms are not negative. The
    length of `components` is known to the compiler, which makes the loops over features short.
    """
    height, width, _ = template.shape
    number = min(number, len(around) * len(offsets))
    looked_at = template[first::stride, first::stride].copy()
    poses = np.empty((number, 3))
    costs = np.full(number, np.inf)
    for n in range(len(around)):
        for m in range(len(offsets)):
            x, y = around[n, 0] + offsets[m, 0], around[n, 1] + offsets[m, 1]
            scale = min(max(around[n, 2] * offsets[m, 2], SMALLEST_SCALE), LARGEST_SCALE)
            across = _positions(x, scale, width, window.columns)[first::stride]
            along = _positions(y, scale, height, window.rows)[first::stride]
            worst = costs[number - 1]
            if bilinear:
                cost = _cost_between(window, looked_at, components, across, along, cutoff, worst)
            else:
                cost = _cost_nearest(window, looked_at, components, across, along, cutoff, worst)
            if cost >= worst:
                continue
            place = number - 1
            while place > 0 and cost < costs[place - 1]:
                costs[place] = costs[place - 1]
                poses[place] = poses[place - 1]
                place -= 1
            costs[place] = cost
            poses[place, 0], poses[place, 1], poses[place, 2] = x, y, scale
    return poses, costs


@njit(cache=True)
def _cost_nearest(
    window: Window,
    template: Array,
    components: tuple[int, ...],
    across: Array,
    along: Array,
    cutoff: float,
    worst: float,
) -> float:
    """Cost of the nearest pixels at some columns and rows, or something no less than `worst`."""
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
def _cost_between(
    window: Window,
    template: Array,
    components: tuple[int, ...],
    across: Array,
    along: Array,
    cutoff: float,
    worst: float,
) -> float:
    """As `_cost_nearest`, interpolating between four pixels."""
    lefts, rights = np.empty(len(across), np.int64), np.empty(len(across), np.int64)
    shares = np.empty(len(across))
    for j in range(len(across)):
        left = int(across[j])
        shares[j] = across[j] - left
        lefts[j] = left - window.left
        rights[j] = min(left + 1, window.columns - 1) - window.left
    cost = 0.0
    for i in range(len(along)):
        top = int(along[i])
        v = along[i] - top
        above = window.features[top - window.top]
        below = window.features[min(top + 1, window.rows - 1) - window.top]
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
    """ρ of a distance that is given squared (equation 3)."""
    if squared < cutoff * cutoff:
        return squared / 2
    return float(cutoff * (np.sqrt(squared) - cutoff / 2))
