"""Features and the search of nguyen2002's template in plain NumPy (equations 1 to 4 and 18).

Images are BGR; features have the shape (rows, columns, d).
"""

from math import floor
from typing import NamedTuple

import numpy as np


def features_of(image, kind):
    """R + G + B, the three, or c1, c2, c3 (equation 18, a largest of 0 counted as 1), or arctan."""
    blue, green, red = np.moveaxis(image.astype(np.float64), 2, 0)
    if kind == "intensity":
        return (red + green + blue)[:, :, np.newaxis]
    if kind == "rgb":
        return np.stack([red, green, blue], axis=2)
    both = (red, green, blue), (green, blue, red), (blue, red, green)
    ratios = [channel / np.maximum(np.maximum(*others), 1.0) for channel, *others in both]
    return np.arctan(np.stack(ratios, axis=2)) if kind == "arctan" else np.stack(ratios, axis=2)


class Pose(NamedTuple):
    """a of equation 1: the template's centre, where pixel centres are whole numbers, and scale."""

    x: float
    y: float
    scale: float


def sample(features, pose, height, width, *, bilinear, pixels=slice(None)):
    """Features at φ(p; a) of a template's pixels, or of some of them either way."""
    rows, columns = features.shape[:2]
    x = pose.x + pose.scale * (np.arange(width) - (width - 1) / 2)
    y = pose.y + pose.scale * (np.arange(height) - (height - 1) / 2)
    x, y = np.clip(x[pixels], 0, columns - 1), np.clip(y[pixels], 0, rows - 1)
    if not bilinear:
        return features[np.ix_(np.floor(y + 0.5).astype(int), np.floor(x + 0.5).astype(int))]
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    right, bottom = np.minimum(left + 1, columns - 1), np.minimum(top + 1, rows - 1)
    u, v = (x - left)[np.newaxis, :, np.newaxis], (y - top)[:, np.newaxis, np.newaxis]
    upper = (1 - u) * features[np.ix_(top, left)] + u * features[np.ix_(top, right)]
    lower = (1 - u) * features[np.ix_(bottom, left)] + u * features[np.ix_(bottom, right)]
    return (1 - v) * upper + v * lower


def huber(error, cutoff):
    """ρ of equation 3."""
    with np.errstate(invalid="ignore"):  # an infinite cutoff times an error of 0
        return np.where(error < cutoff, error**2 / 2, cutoff * (error - cutoff / 2))


def matching_cost(features, template, inverse, pose, cutoff, *, stride, bilinear):
    """Sum of equation 4 over every `stride`th pixel either way."""
    pixels = slice(stride // 2, None, stride)
    seen = sample(features, pose, *template.shape[:2], bilinear=bilinear, pixels=pixels)
    r = seen - template[pixels, pixels]
    squared = np.einsum("...k,km,...m->...", r, inverse, r)
    return float(huber(np.sqrt(np.maximum(squared, 0)), cutoff).sum())


def match(features, template, covariance, around, search_range, cutoff, *, subpixel, ties):
    """Pose of the least cost, and this cost."""
    inverse = np.linalg.inv(covariance)

    def best(poses, number, *, stride, bilinear=False):
        rated = []
        for pose in poses:
            held = pose._replace(scale=min(max(pose.scale, 0.5), 2.0))
            cost = matching_cost(
                features, template, inverse, held, cutoff, stride=stride, bilinear=bilinear
            )
            rated.append((cost, held))
        return sorted(rated, key=lambda rating: rating[0])[
            :number
        ]  # of equals the first stays first

    centre = Pose(floor(around.x + 0.5), floor(around.y + 0.5), around.scale)
    actual = best(grid(centre, search_range, 4), 3, stride=4)
    actual = best([pose for _, coarse in actual for pose in grid(coarse, 2, 2)], 1, stride=4)
    for spread in (0.02, 0.01):
        actual = best(grid(actual[0][1], 1, 1, spread, ties), 1, stride=2)
    if subpixel:
        for step, spread in ((0.5, 0.01), (0.25, 0.005)):
            actual = best(grid(actual[0][1], step, step, spread, ties), 1, stride=2, bilinear=True)
    cost, pose = actual[0]
    return pose, cost


def grid(centre, half_range, step, spread=0.0, ties="ascending"):
    """Poses around one, in steps from minus to plus the range; scale, y and x ascend.

    With `unchanged` ties the scale as it is comes before the others.
    """
    shifts = [step * n - half_range for n in range(int(2 * half_range / step) + 1)]
    factors = [1 - spread, 1.0, 1 + spread] if spread else [1.0]
    if ties == "unchanged" and spread:
        factors = [1.0, 1 - spread, 1 + spread]
    return [
        Pose(centre.x + across, centre.y + down, centre.scale * factor)
        for factor in factors
        for down in shifts
        for across in shifts
    ]
