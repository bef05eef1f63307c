"""Criteria of the moreno2005 scenes."""

import numpy as np
from numpy.typing import NDArray

from trackmark.bench.papers.criteria.shared import SceneImages, colour_auc, speeds
from trackmark.datasets.interface import Mask


def model_auc(scene: SceneImages, *, frame: int, age: int) -> float:
    """Separability of target and ring in `frame` by colours that are `age` frames old."""
    return colour_auc(scene, frame, frame - age)


def auc_percentile(
    scene: SceneImages, *, percentile: float, first_model: bool = False, step: int = 5
) -> float:
    """Percentile over frames of the separability of target and ring.

    The colours are those of each frame itself, or, with `first_model`, of the first frame. Every
    `step`-th frame is measured.
    """
    frames = range(0, len(scene), step)
    values = [colour_auc(scene, frame, 0 if first_model else frame) for frame in frames]
    return float(np.percentile(values, percentile))


def hard_share(scene: SceneImages, *, limit: float, age: int) -> float:
    """Share of the frames with a separability <= `limit` by colours that are `age` frames old."""
    frames = range(age, len(scene))
    return float(np.mean([colour_auc(scene, frame, frame - age) <= limit for frame in frames]))


def channel_gain_ratio(scene: SceneImages, *, frame: int) -> float:
    """Largest over smallest gain of a channel of the target's mean colour since the last frame."""
    before, after = (scene.target_colours(f).mean(axis=0) for f in (frame - 1, frame))
    gains = after / np.maximum(before, 1.0)
    return float(gains.max() / gains.min())


def speed_at(scene: SceneImages, *, frame: int) -> float:
    """Displacement of the box's centre since the last frame in pixels."""
    return float(speeds(scene)[frame - 1])


def speed_percentile(scene: SceneImages, *, percentile: float) -> float:
    """Percentile of the speed of the box's centre in pixels per frame."""
    return float(np.nanpercentile(speeds(scene), percentile))


def colour_step(scene: SceneImages) -> float:
    """Median change of the target's mean colour per frame, RGB in [0, 1]."""
    means = np.array([scene.target_colours(f).mean(axis=0) for f in range(len(scene))]) / 255
    return float(np.median(np.linalg.norm(np.diff(means, axis=0), axis=1)))


def affine_overlap(scene: SceneImages, *, percentile: float, step: int = 10) -> float:
    """Percentile over frames of the overlap of the mask and an affine map of the first mask.

    The map gives the first mask the mean and covariance of the other; its rotation is the best
    of 72. The overlap is a lower bound of the best affine map's.
    """
    first = scene.mask(0)
    overlaps = [_moment_overlap(first, scene.mask(f)) for f in range(step, len(scene), step)]
    return float(np.percentile(overlaps, percentile))


def _moment_overlap(first: Mask, second: Mask, rotations: int = 72) -> float:
    """Best overlap of two masks over the affine maps that match mean and covariance."""
    means, roots = zip(*(_mask_moments(mask) for mask in (first, second)), strict=True)
    rows, columns = np.indices(second.shape)
    places = np.stack([columns.ravel(), rows.ravel()]) - means[1][:, None]
    near = (np.linalg.solve(roots[1], places) ** 2).sum(axis=0) < 16  # within 4 deviations
    white, inside = np.linalg.solve(roots[1], places[:, near]), second.ravel()[near]
    best = 0.0
    for angle in np.arange(rotations) * 2 * np.pi / rotations:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        x, y = np.round(roots[0] @ turn @ white + means[0][:, None]).astype(int)
        valid = (x >= 0) & (y >= 0) & (x < first.shape[1]) & (y < first.shape[0])
        mapped = np.zeros(len(x), np.bool_)
        mapped[valid] = first[y[valid], x[valid]]
        best = max(best, float((mapped & inside).sum() / (mapped | inside).sum()))
    return best


def _mask_moments(mask: Mask) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean (x, y) of a mask's pixels and the symmetric square root of their covariance."""
    rows, columns = np.nonzero(mask)
    places = np.stack([columns, rows]).astype(float)
    values, vectors = np.linalg.eigh(np.cov(places))
    return places.mean(axis=1), np.asarray(vectors * np.sqrt(values) @ vectors.T)
