"""Criteria of the moreno2005 scenes; the ring is the surroundings of the target in `shared`."""

import cv2
import numpy as np
from numpy.typing import NDArray

from tools.criteria.shared import SceneImages, colour_auc, speeds
from trackmark.datasets.interface import Image, Mask


def model_auc(scene: SceneImages, *, frame: int, age: int) -> float:
    """Return the AUC of target against ring in `frame`, by the colours `age` frames earlier."""
    return colour_auc(scene, frame, frame - age)


def auc_percentile(
    scene: SceneImages, *, percentile: float, first_model: bool = False, step: int = 5
) -> float:
    """Return a percentile over frames of the AUC of target against ring.

    The colour model is that of the measured frame or, with `first_model`, of the first frame. Every
    `step`-th frame is measured.
    """
    frames = range(0, len(scene), step)
    values = [colour_auc(scene, frame, 0 if first_model else frame) for frame in frames]
    return float(np.percentile(values, percentile))


def hard_share(scene: SceneImages, *, limit: float, age: int, step: int = 1) -> float:
    """Return the share of frames with an AUC <= `limit`, by the colours `age` frames earlier.

    Every `step`-th frame is measured.
    """
    frames = range(age, len(scene), step)
    return float(np.mean([colour_auc(scene, frame, frame - age) <= limit for frame in frames]))


def visible_outline(
    scene: SceneImages, *, percentile: float, contrast: float, step: int = 5
) -> float:
    """Return a percentile over frames of the share of the outline with a contrast > `contrast`.

    The contrast of an outline point is the distance in RGB of [0, 1] between the means of 5 x 5
    pixels 4 pixels inside and 4 pixels outside. Every `step`-th frame is measured.
    """
    shares = [
        np.mean(_outline_contrasts(scene.image(frame), scene.mask(frame)) > contrast)
        for frame in range(0, len(scene), step)
    ]
    return float(np.percentile(shares, percentile))


def _outline_contrasts(image: Image, mask: Mask) -> NDArray[np.float64]:
    """Return the contrast at every second point of the largest outline of a mask.

    Points whose inner or outer side is outside the image are omitted.
    """
    target = mask.astype(np.uint8)
    outlines, _ = cv2.findContours(target, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    points = max(outlines, key=len)[::2, 0]
    inwards, outwards = (
        cv2.distanceTransform(area, cv2.DIST_L2, 5) for area in (target, 1 - target)
    )
    rise, climb = np.gradient(cv2.GaussianBlur(inwards - outwards, (0, 0), 2))
    normals = np.stack([climb, rise], axis=2)[points[:, 1], points[:, 0]].astype(np.float64)
    normals *= 4 / (np.linalg.norm(normals, axis=1, keepdims=True) + 1e-6)
    ends = [np.round(points + side * normals).astype(int) for side in (1, -1)]
    valid = np.logical_and.reduce(
        [((end >= 0) & (end < mask.shape[::-1])).all(axis=1) for end in ends]
    )
    means = cv2.blur(image.astype(np.float64), (5, 5)) / 255
    inside, outside = (means[end[valid, 1], end[valid, 0]] for end in ends)
    return np.asarray(np.linalg.norm(inside - outside, axis=1))


def channel_gain_ratio(scene: SceneImages, *, frame: int) -> float:
    """Return the ratio of the largest to the smallest channel gain since the frame before.

    The gain of a channel is the ratio of the target's mean colours in both frames.
    """
    before, after = (scene.target_colours(f).mean(axis=0) for f in (frame - 1, frame))
    gains = after / np.maximum(before, 1.0)
    return float(gains.max() / gains.min())


def speed_at(scene: SceneImages, *, frame: int) -> float:
    """Return the displacement of the box centre since the frame before [px]."""
    return float(speeds(scene)[frame - 1])


def speed_percentile(scene: SceneImages, *, percentile: float) -> float:
    """Return a percentile of the speed of the box centre [px/frame]."""
    return float(np.nanpercentile(speeds(scene), percentile))


def colour_step(scene: SceneImages) -> float:
    """Return the median change per frame of the target's mean colour, RGB in [0, 1]."""
    means = np.array([scene.target_colours(f).mean(axis=0) for f in range(len(scene))]) / 255
    return float(np.median(np.linalg.norm(np.diff(means, axis=0), axis=1)))


def affine_overlap(scene: SceneImages, *, percentile: float, step: int = 10) -> float:
    """Return a percentile over frames of the overlap of the mask with a map of the first mask.

    The affine map gives the first mask the mean and covariance of the frame's mask. Its rotation is
    the best of 72. The result is a lower bound for the best affine map.
    """
    first = scene.mask(0)
    overlaps = [_moment_overlap(first, scene.mask(f)) for f in range(step, len(scene), step)]
    return float(np.percentile(overlaps, percentile))


def _moment_overlap(first: Mask, second: Mask, rotations: int = 72) -> float:
    """Return the best overlap of two masks over affine maps that match mean and covariance."""
    means, roots = zip(*(_mask_moments(mask) for mask in (first, second)), strict=True)
    rows, columns = np.indices(second.shape)
    places = np.stack([columns.ravel(), rows.ravel()]) - means[1][:, None]
    near = (np.linalg.solve(roots[1], places) ** 2).sum(axis=0) < 16  # within 4 standard deviations
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
    """Return the mean (x, y) of a mask's pixels and the square root of their covariance."""
    rows, columns = np.nonzero(mask)
    places = np.stack([columns, rows]).astype(float)
    values, vectors = np.linalg.eigh(np.cov(places))
    return places.mean(axis=1), np.asarray(vectors * np.sqrt(values) @ vectors.T)
