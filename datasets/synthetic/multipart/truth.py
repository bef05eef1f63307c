"""Truth of a walking scene: boxes in closed form, the silhouette where it is needed."""

import numpy as np
from numpy.typing import NDArray

from datasets.synthetic.multipart.plan import Plan
from datasets.synthetic.render.pinhole import FRAMES_PER_SECOND, SIZE
from datasets.synthetic.scene import Truth

__all__ = ["body_boxes", "full_boxes", "walking_truth"]

Array = NDArray[np.float64]

OCCLUDED = 0.9
"""Visible fraction below which the target counts as occluded."""

TURNING = np.radians(30)
"""A target turns that turns by this much in a second [radians]."""


def walking_truth(plan: Plan, shade: NDArray[np.bool_]) -> Truth:
    """Truth of all frames.

    `boxes` are the body from shoulders to ankles, the region `full` is the whole person in
    mid-step, `tight` the extents of the silhouette. Attributes are `occlusion` (less than 0.9
    of the target is seen), `out_of_view` (a part of `full`), `scale_change` (outside 0.8 to
    1.25 of the first size), `turning` (by more than 30 degrees in a second), `clutter`
    (another person's axis within two of the box's widths of the target's) and `shade`.

    Parameters
    ----------
    plan : Plan
    shade : ndarray of bool, shape (n,)
        Where the target is in the shade of a tree.
    """
    x, y, height = plan.places[0].T
    full = full_boxes(x, y, height)
    inside = (full[:, :2] >= 0).all(axis=1) & (full[:, :2] + full[:, 2:] <= SIZE).all(axis=1)
    size = height / height[0]
    second = round(FRAMES_PER_SECOND)
    heading = np.pad(plan.people[0].course.heading, second // 2, mode="edge")
    turned = np.abs(heading[2 * (second // 2) :] - heading[: len(x)])
    tight, visibility = plan.measured
    near = np.abs(plan.places[1:, :, 0] - x) < 2 * 0.24 * height
    return Truth(
        body_boxes(x, y, height),
        visibility,
        {
            "occlusion": np.less(visibility, OCCLUDED),
            "out_of_view": np.logical_not(inside),
            "scale_change": np.logical_or(size < 0.8, size > 1.25),
            "turning": np.greater(turned, TURNING),
            "clutter": near.any(axis=0),
            "shade": shade,
        },
        regions={"full": full, "tight": tight},
    )


def body_boxes(x: Array, y: Array, height: Array) -> Array:
    """Shoulders to ankles of standing persons, shape (n, 4), the waist in the middle.

    Parameters
    ----------
    x, y : ndarray of float64, shape (n,)
        Places on the ground below the bodies' axes, in the image [pixels].
    height : ndarray of float64, shape (n,)
        Of the persons in the image [pixels].
    """
    return np.stack([x - 0.12 * height, y - 0.86 * height, 0.24 * height, 0.78 * height], axis=1)


def full_boxes(x: Array, y: Array, height: Array) -> Array:
    """Whole persons in mid-step, head to sole, shape (n, 4); parameters as `body_boxes`."""
    return np.stack([x - 0.18 * height, y - height, 0.36 * height, height], axis=1)
